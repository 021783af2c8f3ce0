"""The summary at the end of a run."""

from __future__ import annotations

from composer.cli.support.progress import summary
from composer.runtime.supervision.events import NodeSummary, Outcome


def node(name: str, *, in_process: bool, received: int) -> NodeSummary:
    return NodeSummary(name, "finalized", received, 0, 0, 0, 0, 0, in_process)


def test_counts_of_nodes_outside_the_process_are_not_known() -> None:
    nodes = (
        node("/planner", in_process=True, received=30),
        node("/lidar", in_process=False, received=0),
    )
    shown = summary(Outcome(0, "--for elapsed", 2.0, nodes)).splitlines()
    assert shown[2].split() == ["/planner", "finalized", "30", "0", "0", "0", "0"]
    assert shown[3].split() == ["/lidar", "finalized", "-", "-", "-", "-", "-"]

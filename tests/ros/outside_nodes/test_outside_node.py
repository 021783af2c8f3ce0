"""A node outside the process follows the events of its own lifecycle, and no others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from composer.model import LogLevel
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.outside_nodes.outside_node import OutsideContext, OutsideNode
from tests.ros.support.in_process import system_of

TEXT = """
system: robot
nodes: {driver: {executable: {command: ["true"], lifecycle: managed}}}
"""


class Driver(OutsideNode):
    """A node that something else moves."""

    def destroy(self) -> None:
        pass

    async def _work(self, transition: str) -> None:
        raise NotImplementedError


class Listener:
    """Keeps what the node reports."""

    def __init__(self) -> None:
        self.results: list[TransitionOutcome] = []

    def on_transition_end(self, result: TransitionOutcome) -> None:
        self.results.append(result)


def test_events_with_unknown_states_are_ignored(tmp_path: Path) -> None:
    (model,) = system_of(TEXT, tmp_path).nodes
    nothing: Any = None
    listener: Any = Listener()
    node = Driver(
        model,
        OutsideContext(nothing, nothing, nothing, listener, Statistics(), 1.0, LogLevel.INFO),
    )
    node._on_event("unconfigured", "configuring")
    node._on_event("configuring", "inactive")
    for label in ("", "on fire", "\x1b[31m", "ACTIVE"):
        node._on_event("activating", label)  # another program may publish on the topic
        assert node.state == "inactive"
    node._on_event("inactive", "activating")
    assert node.state == "activating"
    node._on_event("activating", "errorprocessing")
    node._on_event("errorprocessing", "unconfigured")
    assert [(item.transition, item.state, item.success) for item in listener.results] == [
        ("configure", "inactive", True),
        ("activate", "unconfigured", False),
    ]

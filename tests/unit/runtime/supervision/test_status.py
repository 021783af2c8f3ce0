"""Whether a system as a whole is active, and ready."""

from __future__ import annotations

from dataclasses import replace

import pytest

from composer.runtime.protocol.reports import NodeReport, SystemReport

PLANNER = NodeReport("/planner", "active", state="active")
CAMERA = NodeReport("/camera", "inactive", starts_active=False, state="inactive")


@pytest.mark.parametrize(
    ("nodes", "is_active"),
    [
        ((PLANNER, CAMERA), True),
        ((PLANNER, replace(CAMERA, state="active")), True),
        ((PLANNER, replace(CAMERA, state="unconfigured")), True),  # by a requested transition
        ((replace(PLANNER, state="inactive"), CAMERA), False),
        ((replace(PLANNER, state="deactivating"), CAMERA), False),
        ((PLANNER, replace(CAMERA, state="unconfigured", held_down="no lens")), False),
        ((replace(PLANNER, held_down="its executor hangs"), CAMERA), False),
        ((CAMERA,), False),  # no node starts active
    ],
)
def test_a_system_is_active_if_all_nodes_that_start_active_are(
    nodes: tuple[NodeReport, ...], is_active: bool
) -> None:
    status = SystemReport("robot", "running", nodes, "host", "1")
    assert status.is_active is is_active


@pytest.mark.parametrize(
    ("activity", "nodes", "is_ready"),
    [
        ("running", (PLANNER, CAMERA), True),
        ("running", (CAMERA,), True),  # it is where it should be
        ("running", (), True),
        ("starting", (PLANNER, CAMERA), False),
        ("paused", (replace(PLANNER, state="inactive", desired="inactive"),), False),
        ("running", (replace(PLANNER, state="activating"), CAMERA), False),
        ("running", (replace(PLANNER, held_down="silent"), CAMERA), False),
        ("running", (PLANNER, replace(CAMERA, state="unconfigured")), False),
        # In a process whose nodes have not been brought up.
        ("running", (NodeReport("/planner", "unconfigured"),), False),
    ],
)
def test_a_system_is_ready_if_all_nodes_are_where_they_should_be(
    activity: str, nodes: tuple[NodeReport, ...], is_ready: bool
) -> None:
    assert SystemReport("robot", activity, nodes, "host", "1").is_ready is is_ready


def test_the_summary_lists_only_some_failed_nodes() -> None:
    failed = tuple(NodeReport(f"/node_{n}", "active", held_down="silent") for n in range(100))
    summary = SystemReport("robot", "running", failed, "host", "1").message
    assert summary.startswith("0 of 100 nodes active, /node_0 is down: silent, /node_1 is")
    assert summary.endswith("/node_4 is down: silent, 95 more are down")

"""A tear-down whose steps find that an external transition has come first."""

from __future__ import annotations

import threading
from pathlib import Path

from composer.model import PrimaryState
from composer.runtime.supervision.events import NodeTransitionFailed
from tests.ros.support.in_process import running, wait_until


def test_a_node_that_was_shut_down_meanwhile_does_not_fail(tmp_path: Path) -> None:
    """As by the coordinating process of the system, when it also ends this one."""
    text = "{system: robot, nodes: {arm: {}}}"
    with running(text, tmp_path, autostart=PrimaryState.UNCONFIGURED) as system:
        node, is_free = system.node("arm"), threading.Event()
        node.loop.call_soon(is_free.wait)
        change = node.loop.run_task(node.lifecycle.change("shutdown"))
        tasks = len(node.loop._tasks)
        system.host.stop("the test is over")
        wait_until(lambda: len(node.loop._tasks) > tasks, "the step of the tear-down")
        is_free.set()
        assert system.end().exit_code == 0
        assert change.result().success
        assert not system.reported(NodeTransitionFailed)
        assert "refused" not in system.log_text()

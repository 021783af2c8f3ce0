"""Recordings as browsers request them: whatever they name, and whatever happens to the folder."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path

import pytest

from composer.dashboard.protocol.messages import BadRequestError, RequestError
from composer.dashboard.recordings import Recordings

pytest.importorskip("rclpy", reason="recordings need ROS")

LOOKS = 300


@pytest.mark.parametrize("topic", ["", "a\0b", "x" * 300, "/a b", "--output=x", "/a\n/b"])
def test_what_cannot_be_the_name_of_a_topic(tmp_path: Path, topic: str) -> None:
    with pytest.raises(BadRequestError, match="is not the name of a topic, or a pattern"):
        Recordings(tmp_path / "bags").record(["/*", topic])


def test_a_command_that_cannot_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(RequestError, match="cannot start 'compose record': No such file"):
        Recordings(tmp_path / "bags").record([])


def test_bags_that_are_deleted_meanwhile(tmp_path: Path) -> None:
    has_ended = threading.Event()

    def churn() -> None:
        while not has_ended.is_set():
            for number in range(20):
                (tmp_path / f"bag{number}").mkdir()
            for number in range(20):
                (tmp_path / f"bag{number}").rmdir()

    thread = threading.Thread(target=churn)
    thread.start()
    try:
        states = [Recordings(tmp_path).state() for _ in range(LOOKS)]
    finally:
        has_ended.set()
        thread.join()
    assert all(state["bags"] == [] for state in states)

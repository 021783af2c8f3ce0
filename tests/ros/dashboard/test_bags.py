"""Bags on the page in a real browser: record, list, play; and their end with the dashboard."""

from __future__ import annotations

import signal
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32

from composer.bags.reader import open_bag
from tests.ros.support.dashboard import PATIENCE_S, Dashboard, browser, dashboard
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.pages import allowed, expect_text, watched

if TYPE_CHECKING:
    from playwright import sync_api

pytestmark = pytest.mark.browser


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of the dashboard, also with a folder that is not a bag, and a link."""
    bags = tmp_path / "work" / "bags"
    (bags / "notes").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "a.mcap").touch()
    (bags / "link").symlink_to(tmp_path / "elsewhere")
    (bags / "<b>cut" / "x").mkdir(parents=True)
    (bags / "<b>cut" / "a_0.mcap").write_bytes(b"cut")
    return tmp_path / "work"


def _bags(page: sync_api.Page) -> list[str]:
    return page.locator("tbody tr:visible").evaluate_all("rows => rows.map(row => row.dataset.key)")


def _started(folder: Path, size: int) -> Path:
    """Wait until a bag is being written; return its folder."""
    [file] = wait_until(
        lambda: [path for path in folder.glob("bags/rec*/*.mcap") if path.stat().st_size > size]
    )
    return file.parent


def test_a_recording_is_made_listed_and_played(
    talker: None, folder: Path, browser: sync_api.Browser, peer: Peer
) -> None:
    with (
        dashboard(cwd=folder) as server,
        allowed(browser, server.address) as context,
        watched(context.new_page(), server.address) as page,
    ):
        page.goto("/bags")
        expect_text(page.locator("tbody"), "<b>cut")
        assert _bags(page) == ["<b>cut"]
        page.click("text=Record")
        expect_text(page.locator("[role=status]"), r"^recording recording-\d+-\d+, \d s$")
        recording = _started(folder, 2000)
        page.click("text=Stop recording")
        expect_text(page.locator(".toast"), r"\d+ messages, .*, 0 dropped: bags/recording-")
        page.locator(f"tr[data-key={recording.name}]").wait_for()
        count = open_bag(recording).summary.counts["/lab/count"]
        assert count > 0
        received: list[int] = []
        qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
        peer.node.create_subscription(
            Int32, "/lab/count", lambda item: received.append(item.data), qos
        )
        wait_until(lambda: received)
        page.click(f"[aria-label='Play {recording.name}']")
        expect_text(page.locator("[role=status]"), f"^playing {recording.name}, ")
        wait_until(lambda: any(one > other for one, other in pairwise(received)))
        page.set_viewport_size({"width": 390, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        page.locator("text=Stop the replay").wait_for(state="hidden")


def test_names_stay_in_the_folder_and_recordings_end_with_the_dashboard(
    talker: None, folder: Path
) -> None:
    server = Dashboard(cwd=folder)
    with browser(server.address) as page:
        for bag in ("../../elsewhere", "link", "notes", "", ".", str(folder)):
            assert page.error("replay", on=True, bag=bag)["code"] == "not_found"
        assert page.error("record", on=False)["code"] == "not_found"
        name = page.ok("record", on=True, topics=["/lab/*"])["message"]
        assert page.error("record", on=True)["code"] == "busy"
        page.ok("replay", on=True, bag="<b>cut")
        state = page.until(page.subscribe("bags"), lambda data: data["problems"])
        assert "is not an MCAP file" in state["problems"]["replay"]
        recording = _started(folder, 1500)
        assert recording.name == name
    server.process.send_signal(signal.SIGKILL)
    server.process.wait(PATIENCE_S)
    wait_until((recording / "metadata.yaml").exists)
    assert open_bag(recording).warnings == []

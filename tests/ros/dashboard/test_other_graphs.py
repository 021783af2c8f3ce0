"""The page with chains and dropped messages, and with a graph that has no system of ours."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import dashboard
from tests.ros.support.pages import opened
from tests.ros.support.system_process import RunningSystem

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.browser
SYSTEM = """
system: dropping
nodes:
  source:
    behavior: dropping:Source
    publishers: {burst: {type: std_msgs/msg/Int64, qos: {depth: 100}}}
    timers: {send: {period_ms: 100}}
  sink:
    subscriptions: {burst: {type: std_msgs/msg/Int64, qos: {depth: 2}, publish: {last: {}}}}
    publishers: {last: {type: std_msgs/msg/Int64, external: true}}
connections:
  - {topic: /burst, from: source.burst, to: sink.burst}
chains:
  through: {through: [source.burst, sink.last], latency_ms: 10000}
"""
SOURCE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def on_send(self):
        for _ in range(5):
            self.publishers.burst.publish(Int64())
"""


def expect(page: Page, place: str, pattern: str) -> None:
    page.locator(place).filter(has_text=re.compile(pattern)).first.wait_for()


@pytest.fixture
def dropping(browser: Browser, tmp_path: Path, ros_domain_id: int) -> Iterator[Page]:
    path = tmp_path / "dropping.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    path.with_name("dropping.py").write_text(SOURCE, encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for("2 of 2 nodes active")
        with dashboard() as server, opened(browser, server.address) as page:
            yield page


def test_chains_and_dropped_messages_are_shown(dropping: Page) -> None:
    page = dropping
    expect(page, ".world .drop-label", r"^\d+ dropped$")
    assert page.locator(".world path.lossy").count() == 1
    page.keyboard.press("7")
    expect(page, ".chain[data-tone=good]", r"through.*mean [\d.]+ .s.*budget 10(\.0)? s|10,?000")
    expect(page, ".chain", r"0 of [1-9][\d,]* over the budget")


def test_a_graph_without_a_system(browser: Browser, ros_domain_id: int) -> None:
    with (
        hand_written("hand_written_talker.py"),
        dashboard() as server,
        opened(browser, server.address) as page,
    ):
        expect(page, '.world [data-key="node:/lab/talker"]', "talker")
        expect(page, ".world [data-label]", r"[45]\d\.?\d* Hz")  # about 50
        expect(page, ".activity", "^1 nodes?$")
        assert page.locator("#bar [data-command]").count() == 0
        page.goto("/nodes/lab/talker")
        expect(page, "aside.detail:visible .state", "no lifecycle")
        assert page.locator("button[data-transition]").count() == 0
        page.goto("/nodes?show=plan")
        expect(page, ".empty", "needs the file of the system")
        page.goto("/timing")
        expect(page, ".empty:visible", r"\w")

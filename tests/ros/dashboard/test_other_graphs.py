"""The page with chains and dropped messages, and with a graph that has no system of ours."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.commands import hand_written, listed
from tests.ros.support.dashboard import dashboard
from tests.ros.support.pages import expect_text, opened, visit
from tests.ros.support.system_process import RunningSystem

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.browser
SYSTEM = """
system: dropping
nodes:
  source:
    behavior: dropping:Source
    parameters:
      mode: {type: string, default: slow, choices: [slow, "fast, very"], description: How fast.}
      gear: {type: integer, default: 1, choices: [1, 2, 3]}
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
SPLIT = """
system: split
lifecycle: {on_failure: restart, restart: {backoff_ms: 100}}
processes: {other: {nodes: [killed]}}
nodes:
  killed: {timers: {tick: {period_ms: 500, log: tick}}}
  own: {timers: {tick: {period_ms: 500, log: tick}}}
"""
SOURCE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def on_send(self):
        for _ in range(5):
            self.publishers.burst.publish(Int64())
"""


def test_what_the_pipeline_does_not_have(
    browser: Browser, tmp_path: Path, ros_domain_id: int
) -> None:
    path = tmp_path / "dropping.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    path.with_name("dropping.py").write_text(SOURCE, encoding="utf-8")
    with (
        RunningSystem(str(path)) as system,
        dashboard(path.name, cwd=tmp_path) as server,
        opened(browser, server.address) as page,
    ):
        system.wait_for("2 of 2 nodes active")
        expect_text(page.locator(".world .drop-label"), r"^\d+ dropped$")
        assert page.locator(".world path.lossy").count() == 1
        page.keyboard.press("7")
        expect_text(
            page.locator(".chain[data-tone=good]"),
            r"through.*mean [\d.]+ .s.*budget 10(\.0)? s|10,?000",
        )
        expect_text(page.locator(".chain"), r"0 of [1-9][\d,]* over the budget")
        # Declared choices are a list.
        visit(page, "/parameters/source")
        mode, gear = page.get_by_label("mode"), page.get_by_label("gear")
        expect_text(page.locator("[data-name=mode]"), "one of: slow, fast, very")
        assert mode.locator("option").all_inner_texts() == ["slow", "fast, very"]
        assert mode.input_value() == "slow"
        mode.select_option("fast, very")
        expect_text(page.locator("[data-name=mode] .outcome"), "^Set$")
        gear.select_option("3")
        expect_text(page.locator("[data-name=gear] .outcome"), "^Set$")
        expect_text(
            page.locator("[data-name=gear] .declared"), r"^declared 1 at dropping\.yaml:\d+:\d+$"
        )
        for name, value in (("mode", "fast, very"), ("gear", "3")):
            assert listed((value,), "param", "get", "/source", name).strip().endswith(value)


def test_the_deployment_shows_processes_and_restarts(
    browser: Browser, tmp_path: Path, ros_domain_id: int
) -> None:
    path = tmp_path / "split.yaml"
    path.write_text(SPLIT, encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for("2 of 2 nodes active")
        with dashboard(str(path)) as server, opened(browser, server.address) as page:
            page.goto("/graph?view=deployment")
            running = page.locator('.world .cluster[data-state="active"] text')
            expect_text(
                page.locator(".cluster text"), f"^default: events · pid {system.process.pid}$"
            )
            running.filter(has_text=re.compile(r"^process other · pid \d+$")).wait_for()
            killed = local_systems()["/split/other"]
            os.kill(int(killed), signal.SIGKILL)
            restarted = re.compile(rf"^process other · pid (?!{killed} )\d+ · [1-9]\d* restarts?$")
            running.filter(has_text=restarted).wait_for()


def test_a_graph_without_a_system(browser: Browser, ros_domain_id: int) -> None:
    with (
        hand_written("hand_written_talker.py"),
        dashboard() as server,
        opened(browser, server.address) as page,
    ):
        expect_text(page.locator('.world [data-key="node:/lab/talker"]'), "talker")
        expect_text(page.locator(".world [data-label]"), r"[45]\d\.?\d* Hz")  # about 50
        expect_text(page.locator(".activity"), "^1 nodes?$")
        assert page.locator("#bar [data-command]").count() == 0
        page.goto("/nodes/lab/talker")
        expect_text(page.locator("aside.detail:visible .state"), "no lifecycle")
        assert page.locator("button[data-transition]").count() == 0
        page.goto("/nodes?show=plan")
        expect_text(page.locator(".empty"), "needs the file of the system")
        page.goto("/timing")
        expect_text(page.locator(".empty:visible"), r"\w")

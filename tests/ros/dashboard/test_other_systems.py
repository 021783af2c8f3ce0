"""The page with what the pipeline lacks: drops, processes, a hundred nodes, odd names, no system.

``python -m benchmarks page`` measures its speed with a hundred nodes.
"""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rcl_interfaces.msg import Log, ParameterDescriptor
from std_msgs.msg import String
from std_srvs.srv import Trigger

from benchmarks.page import ALL_SHOWN, NODES
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.codec import encode
from composer.runtime.protocol.reports import (
    CallbackFigures,
    ChainFigures,
    NodeReport,
    SystemReport,
    TimingReport,
)
from composer.runtime.ros.service_requests import CALLBACKS_QOS, STATE_QOS
from tests.ros.support.commands import hand_written, listed, running
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.pages import SIZE, VIEWS, allowed, expect_text, opened, visit, watched
from tests.ros.support.system_process import RunningSystem
from tests.unit.support.fleets import fleet_text

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, ViewportSize

pytestmark = pytest.mark.browser
PHONE: ViewportSize = {"width": 390, "height": 844}
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
            clusters = page.locator('.world .cluster[data-state="active"] text')
            expect_text(
                page.locator(".cluster text"), f"^default: events · pid {system.process.pid}$"
            )
            clusters.filter(has_text=re.compile(r"^process other · pid \d+$")).wait_for()
            killed = local_systems()["/split/other"]
            os.kill(int(killed), signal.SIGKILL)
            restarted = re.compile(rf"^process other · pid (?!{killed} )\d+ · [1-9]\d* restarts?$")
            clusters.filter(has_text=restarted).wait_for()


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


EVIL = "'\"><img src=x onerror=window.pwned=1><script>window.pwned=1</script>"
HOSTILE = f"""
system: hostile
nodes:
  talker:
    parameters:
      text: {EVIL!r}
    publishers: {{out: {{type: std_msgs/msg/String, qos: command}}}}
    timers:
      tick: {{period_ms: 200, publish: {{out: {{data: {EVIL!r}}}}}, log: {EVIL!r}}}
    transforms: {{static: {{{EVIL!r}: {{parent: "<b>world</b>"}}}}}}
""".replace("\\'", "''")
FORGED = "/forged/manager"
#: What no text may have become.
_ELEMENTS = "document.querySelectorAll('[onerror], [src=x], script:not([src]), b').length"


def _publish(peer: Peer) -> None:
    node = peer.node
    descriptor = ParameterDescriptor(description=EVIL, additional_constraints=EVIL)
    node.declare_parameter(EVIL, EVIL, descriptor)
    node.create_service(Trigger, f"{FORGED}/is_active", lambda _, response: response)
    texts = dict.fromkeys(("held_down", "condition", "last_error", "slowest", "process"), EVIL)
    nodes = (
        NodeReport(name, EVIL, state=EVIL, host=EVIL, pid=EVIL, depends_on={"/a": "<b>x"}, **texts)  # type: ignore[arg-type]
        for name in (f"/{EVIL}", "/forged/node")
    )
    report = SystemReport("/forged", EVIL, tuple(nodes), EVIL, EVIL)
    timings = TimingReport(
        (CallbackFigures("/forged/node", EVIL, EVIL),), (ChainFigures(EVIL, 1.0),)
    )
    logged = Log(level=40, name=EVIL, msg=EVIL, file=EVIL, function=EVIL)
    for kind, topic, qos, message in (
        (String, f"{FORGED}/state", STATE_QOS, String(data=encode(report))),
        (String, f"{FORGED}/callbacks", CALLBACKS_QOS, String(data=encode(timings))),
        (Log, "/rosout", 10, logged),
        (String, "/text", 10, String(data=EVIL)),
    ):
        publisher = node.create_publisher(kind, topic, qos)
        node.create_timer(0.3, lambda to=publisher, message=message: to.publish(message))


#: Views, with a part of the text that must be there.
HOSTILE_VIEWS = {
    **{f"/{view}": "" for view in VIEWS},
    "/graph?view=connections": "",
    "/nodes/talker": "script",
    "/nodes/forged/node": "",
    "/topics/text": "img src=x",
    "/parameters/talker": "img src=x",
    "/log?text=img": "img src=x",
}


def test_markup_and_quotes_are_text_in_all_that_the_page_shows(
    browser: Browser, tmp_path: Path, ros_domain_id: int
) -> None:
    file = tmp_path / "hostile.yaml"
    file.write_text(HOSTILE, encoding="utf-8")
    peer = Peer()
    with (
        closing(peer),
        running(tmp_path / "log", str(file)) as run,
        hand_written("hand_written_odd_names.py"),
        dashboard(str(file)) as server,
        allowed(browser, server.address) as context,
        watched(context.new_page(), server.address) as page,
    ):
        run.wait_for("1 of 1 nodes active")
        _publish(peer)
        page.set_viewport_size(SIZE)
        page.goto("/nodes")
        for path, text in HOSTILE_VIEWS.items():
            visit(page, path)
            if text:
                expect_text(page.locator("#main"), text)
            page.wait_for_timeout(700)  # until what is published has arrived
            found: Any = page.evaluate(f"[window.pwned ?? 0, {_ELEMENTS}]")
            assert found == [0, 0], (path, page.locator("#main").inner_html()[:2000])


@pytest.fixture(scope="module")
def fleet(shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dashboard]:
    path = tmp_path_factory.mktemp("fleet") / "fleet.yaml"
    path.write_text(fleet_text(NODES), encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for(f"{NODES} of {NODES} nodes active", 120.0)
        with dashboard(str(path), cwd=path.parent) as server:
            yield server


#: Names of nodes whose text is shown, and the least height of their letters in pixels.
NAMES = """() => {
    const shown = [...document.querySelectorAll(".world [data-kind=node]:not(.nameless) > text")]
        .filter(text => text.checkVisibility())
        .map(text => [text.textContent, text.getBoundingClientRect()]);
    const areas = [...document.querySelectorAll(".world .cluster:not(.nameless) > text")];
    const all = document.querySelector(".world").getBoundingClientRect();
    const stage = document.querySelector(".canvas").getBoundingClientRect();
    return {
        names: shown.map(([name]) => name),
        areas: areas.map(text => text.textContent),
        least: Math.min(...shown.map(([, box]) => box.height)),
        used: all.width * all.height / (stage.width * stage.height),
    };
}"""


def test_names_can_be_read_at_once_and_what_is_searched_for_is_brought_near(
    browser: Browser, fleet: Dashboard
) -> None:
    with opened(browser, fleet.address, viewport=PHONE) as page:
        check_the_names(page, whole=0)
    with opened(browser, fleet.address) as page:
        check_the_names(page, whole=95)
        page.keyboard.press("/")
        page.keyboard.type("controller_14")
        page.keyboard.press("Enter")
        node = page.locator('.world [data-key="node:/area14/act/controller_14"]')
        page.wait_for_url("**/area14/act/controller_14")

        def is_near() -> bool:
            box = node.bounding_box()
            return box is not None and box["width"] > 60 and box["x"] + box["width"] < 1280

        wait_until(is_near, "the node is near")


def check_the_names(page: Page, whole: int) -> None:
    """Check that names can be read from afar, as many ``whole``, and more when near."""
    page.wait_for_function(ALL_SHOWN)
    page.wait_for_function(f"() => ({NAMES})().names.length >= 95")  # once the diagram is fitted
    shown = page.evaluate(NAMES)
    assert len({name for name in shown["names"] if "…" not in name}) >= whole
    assert {"/area1", "/area14"} <= set(shown["areas"])
    assert shown["least"] >= 11
    assert shown["used"] > 0.7
    assert not page.locator(".world [data-label]").first.is_visible()
    for _ in range(9):
        page.keyboard.press("+")
    # Near, everything is as it is drawn.
    page.locator(".picture:not(.far)").wait_for()
    page.locator(".world [data-label]").first.wait_for()
    page.keyboard.press("0")
    page.locator(".picture.far").wait_for()
    assert page.evaluate(NAMES)["names"] == shown["names"]


DRIVERS = ("lidar", "imu", "camera", "odometry", "battery", "motor", "gripper", "bumper")
OTHERS = ("localization", "obstacle_detector", "path_planner", "status_reporter", "watchdog")
NAMELESS = """() => [...document.querySelectorAll(".world [data-kind=node]")]
    .filter(node => node.matches(".nameless") || !node.querySelector("text").textContent)
    .map(node => node.dataset.key)"""


def test_on_a_phone_every_box_has_a_name(
    browser: Browser, shared_domain_id: int, tmp_path: Path
) -> None:
    lines = [f"  {name}_driver: {{on_activate: {{log: on}}}}" for name in DRIVERS]
    lines += [f"  {name}: {{lifecycle: {{depends_on: ['*_driver']}}}}" for name in OTHERS]
    path = tmp_path / "robot.yaml"
    path.write_text("\n".join(["system: robot", "nodes:", *lines, ""]), encoding="utf-8")
    with dashboard(str(path)) as server, opened(browser, server.address, viewport=PHONE) as page:
        visit(page, "/graph?view=lifecycle")
        page.locator(".picture.far").wait_for()
        assert page.evaluate(NAMELESS) == []

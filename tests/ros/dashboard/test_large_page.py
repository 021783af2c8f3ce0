"""The page with a system of a hundred nodes. `python -m benchmarks page` measures its speed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from benchmarks.page import ALL_SHOWN, NODES
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.in_process import wait_until
from tests.ros.support.pages import opened, visit
from tests.ros.support.system_process import RunningSystem
from tests.unit.support.fleets import fleet_text

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, ViewportSize

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def fleet(shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dashboard]:
    path = tmp_path_factory.mktemp("fleet") / "fleet.yaml"
    path.write_text(fleet_text(NODES), encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for(f"{NODES} of {NODES} nodes active", 120.0)
        with dashboard(str(path), cwd=Path(path).parent) as running:
            yield running


@pytest.fixture
def page(browser: Browser, fleet: Dashboard) -> Iterator[Page]:
    with opened(browser, fleet.address) as page:
        yield page


def test_what_is_searched_for_is_brought_near(page: Page) -> None:
    page.wait_for_function(ALL_SHOWN)
    page.keyboard.press("/")
    page.keyboard.type("controller_14")
    page.keyboard.press("Enter")
    node = page.locator('.world [data-key="node:/area14/act/controller_14"]')
    page.wait_for_url("**/area14/act/controller_14")

    def is_near() -> bool:
        box = node.bounding_box()
        return box is not None and box["width"] > 60 and box["x"] + box["width"] < 1280

    wait_until(is_near, "the node is near")


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


@pytest.mark.parametrize(("width", "height", "whole"), [(1280, 800, 95), (390, 844, 0)])
def test_names_can_be_read_at_once(
    width: int, height: int, whole: int, browser: Browser, fleet: Dashboard
) -> None:
    with opened(browser, fleet.address, viewport={"width": width, "height": height}) as page:
        page.wait_for_function(ALL_SHOWN)
        shown = page.evaluate(NAMES)
        assert len(shown["names"]) >= 95
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
    phone: ViewportSize = {"width": 390, "height": 844}
    with (
        dashboard(str(path)) as server,
        opened(browser, server.address, viewport=phone) as page,
    ):
        visit(page, "/graph?view=lifecycle")
        page.locator(".picture.far").wait_for()
        assert page.evaluate(NAMELESS) == []

"""Every view, for users of a keyboard, of a screen reader, and of a narrow screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.programs import require_package
from tests.ros.support.dashboard import Dashboard
from tests.ros.support.in_process import wait_until
from tests.ros.support.pages import VIEWS, opened, visit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route

pytestmark = pytest.mark.browser
PLANNER = "/planning/planner"
DETAILS = (
    f"nodes{PLANNER}",
    f"graph{PLANNER}",
    "topics/sensor_data",
    "topics/lab/in?tab=publish",
    f"parameters{PLANNER}",
    "services/plan_trajectory",
    "actions/lab/navigate",
)
PACKAGES = Path(__file__).parents[2] / "browser"
AXE = PACKAGES / "node_modules" / "axe-core" / "axe.min.js"


def test_a_view_is_busy_until_its_module_is_loaded(view: Page) -> None:
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    view.route("**/views/timing.js", hold)
    view.goto("/log")
    view.click("#rail a[href='/timing']")
    view.locator("#main[aria-busy=true]").wait_for()
    wait_until(lambda: view.title() and held, "the request of the module")
    held[0].continue_()
    view.locator("#main:not([aria-busy]) .view-title", has_text="Timing").wait_for()


#: Marks the control with the focus; returns it if the focus cannot be seen there.
FOCUS = """() => {
    const one = document.activeElement;
    one.dataset.reached = "true";
    const isSeen = getComputedStyle(one).outlineStyle !== "none" || one.matches("body, .world *");
    return isSeen ? "" : one.outerHTML.slice(0, 120);
}"""
#: Visible controls that the focus has not reached. In the diagram, the arrow keys move it.
UNREACHED = """() => [...document.querySelectorAll("a[href], button, input, select, summary")]
    .filter(one => one.checkVisibility() && !one.disabled && one.tabIndex >= 0)
    .filter(one => !one.dataset.reached)
    .map(one => one.outerHTML.slice(0, 120))"""
MAX_TABS = 200


def test_tab_reaches_every_control_and_the_focus_is_seen(view: Page) -> None:
    for path in (*DETAILS, "topics/sensor_data?tab=info", "nodes?show=plan", "timing"):
        visit(view, f"/{path}")
        for _ in range(MAX_TABS):
            view.keyboard.press("Tab")
            assert view.evaluate(FOCUS) == "", path
            if view.evaluate(UNREACHED) == []:
                break
        assert view.evaluate(UNREACHED) == [], path


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_view_has_a_serious_accessibility_violation(
    scheme: str, browser: Browser, server: Dashboard
) -> None:
    require_package(PACKAGES, "axe-core")
    with opened(browser, server.address, color_scheme=scheme) as page:
        page.evaluate(AXE.read_text(encoding="utf-8"))
        for path in (*VIEWS, *DETAILS):
            visit(page, f"/{path}")
            found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
            serious = [
                (path, violation["id"], [item["html"] for item in violation["nodes"]][:3])
                for violation in found["violations"]
                if violation["impact"] in ("serious", "critical")
            ]
            assert serious == []


@pytest.mark.parametrize("width", [360, 768])
def test_no_view_is_wider_than_the_screen(width: int, browser: Browser, server: Dashboard) -> None:
    with opened(browser, server.address, viewport={"width": width, "height": 800}) as page:
        for path in (*VIEWS, *DETAILS):
            visit(page, f"/{path}")
            assert page.evaluate("document.scrollingElement.scrollWidth") <= width
            cut = page.evaluate(
                """() => [...document.querySelectorAll("#bar *, #rail a, .view-head *, .toolbar *")]
                .filter(element => element.checkVisibility({contentVisibilityAuto: true}))
                .filter(element => element.getBoundingClientRect().right > innerWidth + 1)
                .map(element => element.outerHTML.slice(0, 80))"""
            )
            assert cut == [], path

"""Every view, for users of a keyboard, a screen reader and a narrow screen, and its pictures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from composer.dashboard.web.app import VIEWS as ADDRESSES
from composer.dashboard.web.app import file_of_page, index_of
from tests.programs import require_package
from tests.ros.support.dashboard import Dashboard
from tests.ros.support.in_process import wait_until
from tests.ros.support.pages import VIEWS, visit
from tools.draw_dashboard import FOLDER, PICTURES, ROOT, take

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
LINK = re.compile(r'<link rel="modulepreload" href="/page/([^"]+)">')


def test_a_view_is_busy_until_its_module_is_loaded(own_view: Page) -> None:
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    own_view.route("**/views/timing.js", hold)
    own_view.goto("/log")
    own_view.click("#rail a[href='/timing']")
    own_view.locator("#main[aria-busy=true]").wait_for()
    wait_until(lambda: own_view.title() and held, "the request of the module")
    held[0].continue_()
    own_view.locator("#main:not([aria-busy]) .view-title", has_text="Timing").wait_for()


#: Marks the control with the focus. Returns it if the focus cannot be seen there, and the visible
#: controls that the focus has not reached. In the diagram, the arrow keys move it.
FOCUS = """() => {
    const focused = document.activeElement;
    focused.dataset.reached = "true";
    const isSeen = getComputedStyle(focused).outlineStyle !== "none"
        || focused.matches("body, main, .world *");
    const controls = [...document.querySelectorAll("a[href], button, input, select, summary")]
        .filter(one => one.checkVisibility() && !one.disabled && one.tabIndex >= 0);
    const textOf = one => one.outerHTML.slice(0, 120);
    return {
        unseen: isSeen ? "" : textOf(focused),
        unreached: controls.filter(one => !one.dataset.reached).map(textOf),
    };
}"""
MAX_TABS = 200


def test_tab_reaches_every_control_and_the_focus_is_seen(view: Page) -> None:
    view.goto("/log")
    for path in (*DETAILS, "topics/sensor_data?tab=info", "nodes?show=plan", "timing"):
        visit(view, f"/{path}")
        if path.startswith("parameters"):  # they are read from the node first
            view.locator("[data-name]").first.wait_for()
        found = {"unreached": ["everything"]}
        for _ in range(MAX_TABS):
            view.keyboard.press("Tab")
            found = view.evaluate(FOCUS)
            assert found["unseen"] == "", path
            if not found["unreached"]:
                break
        assert found["unreached"] == [], path


#: Scrolls the log away from its end, once it is long enough; returns whether that was noticed.
SCROLL_UP = """() => {
    const [list, button] = document.querySelectorAll("ol.log, .to-end");
    list.style.maxHeight = "24px";
    if (button.hidden) list.scrollTop = list.scrollTop > 0 ? 0 : list.scrollHeight;
    return !button.hidden;
}"""


#: Shows an error, which stays until it is closed.
NOTICE = """async () => {
    const { toast } = await import("/page/widgets/notices.js");
    toast("failed", {tone: "bad"});
}"""


def wait_for_focus(page: Page, selector: str) -> None:
    page.wait_for_function("selector => document.activeElement.matches(selector)", arg=selector)


def test_the_focus_stays_near_a_control_that_is_gone(view: Page) -> None:
    view.goto("/log")
    # Hidden: the buttons of a parameter.
    visit(view, f"/parameters{PLANNER}")
    line = view.locator("[data-name=max_velocity]")
    line.locator("input[type=text]").fill("2")
    line.get_by_text("Undo").press("Enter")
    wait_for_focus(view, "[data-name=max_velocity] input[type=text]")
    # Disabled: there is no older message than the first one.
    visit(view, "/topics/sensor_data")
    view.get_by_text(re.compile(r"([2-9]|\d\d+) received")).wait_for()
    view.locator(".echo").get_by_text("Pause").press("Enter")
    view.get_by_label("Older message").focus()
    while view.get_by_label("Older message").is_enabled():
        view.keyboard.press("Enter")
    wait_for_focus(view, ".echo [aria-label='Newer message']")
    # Removed: a notice, and before it, another control had the focus.
    view.get_by_label("Messages per second shown").focus()
    view.evaluate(NOTICE)
    view.locator(".toast button").press("Enter")
    wait_for_focus(view, "[aria-label='Messages per second shown']")
    # Hidden, at the end of a list that can have the focus.
    visit(view, "/log")
    wait_until(lambda: view.evaluate(SCROLL_UP), "a log that is scrolled up")
    view.get_by_text("Jump to the newest").press("Enter")
    wait_for_focus(view, "ol.log")
    # Replaced: the diagram is drawn again for another size of the page.
    visit(view, "/graph")
    planner = f'.world [data-key="node:{PLANNER}"]'
    view.focus(planner)
    view.evaluate("document.querySelector('.world').classList.add('old')")
    view.set_viewport_size({"width": 700, "height": 800})
    view.locator(".world:not(.old)").wait_for()
    wait_for_focus(view, planner)


#: The rules to check in each color scheme, by default all: only colors differ between them.
CHECKED = {"light": "", "dark": "runOnly: ['color-contrast', 'link-in-text-block'],"}


def test_no_view_has_a_serious_accessibility_violation(view: Page) -> None:
    require_package(PACKAGES, "axe-core")
    view.goto("/log")
    view.evaluate(AXE.read_text(encoding="utf-8"))
    for path in (*VIEWS, *DETAILS):
        visit(view, f"/{path}")
        for scheme, rules in CHECKED.items():
            view.emulate_media(color_scheme=scheme)
            found = view.evaluate(f"axe.run(document, {{{rules} resultTypes: ['violations']}})")
            serious = [
                (path, scheme, violation["id"], [item["html"] for item in violation["nodes"]][:3])
                for violation in found["violations"]
                if violation["impact"] in ("serious", "critical")
            ]
            assert serious == []


@pytest.mark.parametrize("width", [360, 768])
def test_no_view_is_wider_than_the_screen(width: int, view: Page) -> None:
    view.set_viewport_size({"width": width, "height": 800})
    view.goto("/log")
    for path in (*VIEWS, *DETAILS):
        visit(view, f"/{path}")
        assert view.evaluate("document.scrollingElement.scrollWidth") <= width
        cut = view.evaluate(
            """() => [...document.querySelectorAll("#bar *, #rail a, .view-head *, .toolbar *")]
            .filter(element => element.checkVisibility({contentVisibilityAuto: true}))
            .filter(element => element.getBoundingClientRect().right > innerWidth + 1)
            .map(element => element.outerHTML.slice(0, 80))"""
        )
        assert cut == [], path


@pytest.mark.parametrize("view", ["", *ADDRESSES])
def test_every_view_names_its_modules_so_that_they_are_loaded_at_once(view: str) -> None:
    modules = LINK.findall(index_of(view).decode())
    assert len(set(modules)) == len(modules)
    assert {"main.js", "dom.js", "connection.js"} <= set(modules)
    assert all(file_of_page(name).is_file() for name in modules)
    assert ("graph/viewport.js" in modules) == (view in ("", "graph"))


def test_the_guide_shows_every_picture_in_its_present_size() -> None:
    guide = (ROOT / "docs" / "guides" / "dashboard.md").read_text(encoding="utf-8")
    shown = re.findall(r"\(\.\./pictures/(dashboard-[\w.-]+)\)", guide)
    assert sorted(shown) == sorted(picture.name for picture in PICTURES)
    for picture in PICTURES:
        head = (FOLDER / picture.name).read_bytes()[:24]  # a PNG begins with its size
        assert head.startswith(b"\x89PNG")
        size = tuple(int.from_bytes(head[at : at + 4], "big") for at in (16, 20))
        assert size == (picture.width, picture.height)


def test_all_pictures_can_be_taken(browser: Browser, server: Dashboard, tmp_path: Path) -> None:
    address = server.address
    take(browser, f"{address.origin}/?token={address.token}", tmp_path, plotted_s=0.0)
    taken = {picture.name: (tmp_path / picture.name).stat().st_size for picture in PICTURES}
    # An empty page is much smaller as a PNG.
    assert min(taken.values()) > 20_000, taken

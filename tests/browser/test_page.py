"""The HTML page, in a real browser: it works without a network, by pointer and by keyboard."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from composer.base.folders import systems_folder
from composer.graph.diagram import Graph
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.unit.support.fleets import fleet

if TYPE_CHECKING:
    from playwright.sync_api import FloatRect, Page

Open = Callable[..., "Page"]
NODES = "[data-view=nodes]"
PLANNER = "node:/planning/planner"
EXAMPLES = [path.stem for path in sorted(systems_folder().glob("*.yaml"))]


def written(folder: Path, name: str = "pipeline") -> Path:
    """Write the page of an example system, or of a made-up one (``fleet_30``)."""
    path = folder / f"{name}.html"
    path.write_bytes(rendered(name))
    return path


@functools.cache
def rendered(name: str) -> bytes:
    return render(graphs_of(name), Format.HTML)


@functools.cache
def graphs_of(name: str) -> list[Graph]:
    if name.startswith("fleet_"):
        system, diagnostics = fleet(int(name.removeprefix("fleet_")))
        scene = scene_of([system], diagnostics)
    else:
        loading = load(systems_folder() / f"{name}.yaml")
        assert loading.system is not None
        scene = scene_of([loading.system], loading.diagnostics)
    return [build_graph(scene, view) for view in View]


@pytest.fixture
def page(open_file: Open, tmp_path: Path) -> Page:
    return open_file(written(tmp_path))


def thing(key: str, view: str = "nodes") -> str:
    return f'[data-view={view}] [data-key="{key}"]'


def scale(page: Page, view: str = "nodes") -> float:
    found = page.get_attribute(f"[data-view={view}] .picture", "data-scale")
    assert found is not None
    return float(found)


def box_of(page: Page, selector: str) -> FloatRect:
    box = page.locator(selector).bounding_box()
    assert box is not None
    return box


def visible_keys(page: Page, view: str = "nodes") -> set[str]:
    script = """view => [...document.querySelectorAll(`[data-view=${view}] [data-key]`)]
        .filter(element => element.getBoundingClientRect().width > 0)
        .map(element => element.dataset.key)"""
    return set(page.evaluate(script, view))


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_opens_in_every_view_and_as_an_svg(
    name: str, open_file: Open, tmp_path: Path
) -> None:
    page = open_file(written(tmp_path, name))
    for view in View:
        page.click(f"#tab-{view}")
        assert page.is_visible(f"#view-{view} .picture")
        assert page.locator(".picture:visible").count() == 1
    for view, graph in zip(View, graphs_of(name), strict=True):
        path = tmp_path / f"{view}.svg"
        path.write_bytes(render([graph], Format.SVG))
        page = open_file(path)
        assert page.evaluate("document.documentElement.tagName") == "svg"
        drawn = page.evaluate("document.documentElement.width.baseVal.value")
        size = page.evaluate("document.documentElement.getBoundingClientRect().width")
        assert size == pytest.approx(drawn, abs=0.5)


def test_a_click_shows_details_and_dims_what_is_far(page: Page) -> None:
    assert page.is_hidden("#details")
    page.click(thing(PLANNER))
    text = page.inner_text("#details")
    for expected in (
        "/planning/planner",
        "nav_msgs/msg/Odometry",
        "best_effort",
        "max_velocity",
        "composer_interfaces/srv/PlanTrajectory",
        "planner.yaml:",
        "pipeline.yaml:",
    ):
        assert expected in text
    assert page.locator(f"{NODES} .near").count() > 0
    page.click("#neighbors button:has-text('/sensor_data')")
    assert page.inner_text("#about h2") == "/sensor_data"
    far = page.locator(thing("action:/navigate"))
    assert float(far.evaluate("element => getComputedStyle(element).opacity")) < 0.5
    page.click("#close")
    assert page.is_hidden("#details")
    line = '[data-label="publisher:/perception/sensor_simulator.sensor_data"]'
    page.click(f"{NODES} {line}")
    assert "nav_msgs/msg/Odometry" in page.inner_text("#about")


def test_search_finds_names_and_what_is_known_and_goes_from_one_to_the_next(page: Page) -> None:
    page.keyboard.press("/")
    page.keyboard.type("odometry")
    # The topic, its publishers and its subscriptions.
    assert page.inner_text("#matches") == "4 found"
    page.keyboard.press("Enter")
    assert page.inner_text("#matches") == "1 of 4"
    assert page.inner_text("#about h2") == "/sensor_data"  # names come first
    page.keyboard.press("Shift+Enter")
    assert page.inner_text("#matches") == "4 of 4"
    page.keyboard.press("Escape")
    assert page.input_value("#search") == ""
    assert page.inner_text("#matches") == ""
    assert page.locator(".searching").count() == 0
    page.fill("#search", "unicorn")
    assert page.inner_text("#matches") == "0 found"


def test_filters_keep_what_is_joined_and_hold_in_all_views(page: Page) -> None:
    page.click(".filter summary")
    page.uncheck("input[name=namespace][value='/control']")
    page.uncheck("input[name=namespace][value='/perception']")
    assert visible_keys(page) == {PLANNER, "topic:/sensor_data", "service:/plan_trajectory"}
    page.keyboard.press("Escape")
    page.click("#tab-connections")
    assert page.is_hidden(thing("node:/control/motor_controller", "connections"))
    assert page.is_visible(thing(PLANNER, "connections"))
    page.click("#tab-nodes")
    page.click(".filter summary")
    page.click("#everything")
    assert "node:/control/motor_controller" in visible_keys(page)
    page.uncheck("input[name=kind][value='topic']")
    assert not any(key.startswith("topic:") for key in visible_keys(page))
    assert page.locator(f"{NODES} path.edge.topic:visible").count() == 0
    assert page.locator(f"{NODES} path.edge.service:visible").count() == 2
    assert page.locator(".filter.active").count() == 1


def test_zoom_by_buttons_keys_and_wheel_and_back(page: Page) -> None:
    first = scale(page)
    page.click("[data-zoom=in]")
    assert scale(page) > first
    page.keyboard.press("-")
    assert scale(page) == pytest.approx(first, rel=0.01)
    page.hover(thing(PLANNER))
    before = box_of(page, thing(PLANNER))
    page.mouse.wheel(0, -400)
    page.wait_for_function(f"document.querySelector('{NODES} .picture').dataset.scale > {first}")
    after = box_of(page, thing(PLANNER))
    assert after["width"] > before["width"]
    assert after["x"] < before["x"] < after["x"] + after["width"]  # the pointer stays on it
    page.keyboard.press("0")
    assert scale(page) == pytest.approx(first, rel=0.01)


def test_dragging_moves_the_picture_and_is_not_a_click(page: Page) -> None:
    box = box_of(page, thing(PLANNER))
    page.mouse.move(box["x"] + 5, box["y"] + 5)
    page.mouse.down()
    page.mouse.move(box["x"] - 95, box["y"] + 65, steps=5)
    page.mouse.up()
    moved = box_of(page, thing(PLANNER))
    assert moved["x"] - box["x"] == pytest.approx(-100, abs=6)
    assert moved["y"] - box["y"] == pytest.approx(60, abs=6)
    assert page.is_hidden("#details")


def test_the_keyboard_reaches_everything(page: Page) -> None:
    page.focus("#appearance")
    page.keyboard.press("Tab")
    assert focused(page) == "node:/perception/sensor_simulator"
    page.keyboard.press("ArrowRight")
    reached = focused(page)
    assert reached != "node:/perception/sensor_simulator"
    page.keyboard.press("Enter")
    assert page.is_visible("#details")
    assert reached.endswith(page.inner_text("#about h2"))
    page.keyboard.press("Escape")
    assert page.is_hidden("#details")
    page.focus("#tab-nodes")
    page.keyboard.press("ArrowRight")
    assert page.is_visible("#view-connections")


def focused(page: Page) -> str:
    found = page.evaluate("document.activeElement.dataset.key ?? ''")
    assert isinstance(found, str)
    return found


def test_everything_that_can_be_used_has_a_name_for_screen_readers(page: Page) -> None:
    page.click(".filter summary")
    nameless = page.evaluate("""() => [...document.querySelectorAll(
            "button, input, summary, [role=button], [role=tabpanel], svg:not([aria-hidden])")]
        .filter(element => !(element.getAttribute("aria-label") || element.textContent.trim()
            || element.closest("label")?.textContent.trim()))
        .map(element => element.outerHTML)""")
    assert nameless == []
    label = page.get_attribute(thing(PLANNER), "aria-label")
    assert label is not None
    assert label.startswith("node planner")


def test_light_dark_and_as_the_system_says(open_file: Open, tmp_path: Path) -> None:
    path = written(tmp_path)
    light = background(open_file(path, color_scheme="light"))
    opened = open_file(path, color_scheme="dark")
    dark = background(opened)
    assert light == "rgb(255, 255, 255)"
    assert dark != light
    opened.click("#appearance")
    assert opened.inner_text("#appearance") == "Theme: light"
    assert background(opened) == light
    opened.click("#appearance")
    assert background(opened) == dark


def background(page: Page) -> str:
    found = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert isinstance(found, str)
    return found


def test_print_has_the_whole_picture_on_white_and_everything_as_text(
    open_file: Open, tmp_path: Path
) -> None:
    page = open_file(written(tmp_path), color_scheme="dark")
    page.click("[data-zoom=in]")
    page.emulate_media(media="print")
    assert background(page) == "rgb(255, 255, 255)"
    assert page.is_hidden(".tools")
    assert page.is_visible(".listing")
    transform = page.evaluate(
        f"getComputedStyle(document.querySelector('{NODES} .world')).transform"
    )
    assert transform == "none"
    assert "max_velocity" in page.inner_text(".listing")
    assert page.pdf(prefer_css_page_size=True).startswith(b"%PDF")


def test_a_page_with_diagnostics_shows_them(open_file: Open, tmp_path: Path) -> None:
    source = tmp_path / "broken.yaml"
    source.write_text("system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n")
    loading = load(source)
    assert loading.system is not None
    graph = build_graph(scene_of([loading.system], loading.diagnostics))
    path = tmp_path / "broken.html"
    path.write_bytes(render([graph], Format.HTML))
    page = open_file(path)
    assert page.locator("[role=tab]").count() == 0
    page.click(thing("node:/one"))
    assert "depends on 'two'" in page.inner_text("#details .diagnostic")


@pytest.mark.parametrize("count", [3, 300])
def test_texts_stay_in_their_boxes_with_the_fonts_of_the_browser(
    count: int, open_file: Open, tmp_path: Path
) -> None:
    page = open_file(written(tmp_path, f"fleet_{count}"))
    for view in View:
        page.click(f"#tab-{view}")
        outside = page.evaluate(
            """view => {
            // Not as small as it opens: Chromium rounds the widths of tiny letters.
            const world = document.querySelector(`[data-view=${view}] .world`);
            world.style.transform = `scale(${1 / world.ownerSVGElement.getScreenCTM().a})`;
            return [...world.querySelectorAll("[data-key]")]
            .filter(element => {
                const shape = element.querySelector(".shape").getBBox();
                return [...element.querySelectorAll("text")].some(text => {
                    const box = text.getBBox();
                    return box.x < shape.x - 0.5 || box.x + box.width > shape.x + shape.width + 0.5;
                });
            })
            .map(element => element.dataset.key);
            }""",
            view,
        )
        assert outside == []


def test_three_hundred_nodes_open_as_a_whole_and_are_quick_to_use(
    open_file: Open, tmp_path: Path
) -> None:
    page = open_file(written(tmp_path, "fleet_300"))
    for view in View:
        page.click(f"#tab-{view}")
        frame, drawn = (box_of(page, f"#view-{view} .{part}") for part in ("picture", "world"))
        assert drawn["x"] >= frame["x"] - 1
        assert drawn["y"] >= frame["y"] - 1
        assert drawn["x"] + drawn["width"] <= frame["x"] + frame["width"] + 1
        assert drawn["y"] + drawn["height"] <= frame["y"] + frame["height"] + 1
    page.click(f"#tab-{View.NODES}")
    page.fill("#search", "controller_17")
    page.press("#search", "Enter")
    assert page.inner_text("#about h2") == "/area17/act/controller_17"
    box = box_of(page, thing("node:/area17/act/controller_17"))
    assert box["width"] > 40  # it was brought near, and into sight
    assert 0 < box["x"] < 1280
    assert 0 < box["y"] < 800


def test_a_namespace_takes_those_in_it_along(open_file: Open, tmp_path: Path) -> None:
    page = open_file(written(tmp_path, "fleet_30"))
    page.click(".filter summary")
    page.uncheck("input[name=namespace][value='/']")
    assert visible_keys(page) == set()
    page.check("input[name=namespace][value='/area2']")
    nodes = {key for key in visible_keys(page) if key.startswith("node:")}
    assert len(nodes) == 7
    assert all(key.startswith("node:/area2/") for key in nodes)


@pytest.mark.parametrize("width", [600, 1280])
def test_the_details_do_not_hide_what_they_are_about(
    width: int, open_file: Open, tmp_path: Path
) -> None:
    page = open_file(written(tmp_path))
    page.set_viewport_size({"width": width, "height": 900})
    page.click(thing(PLANNER))
    box, panel = box_of(page, thing(PLANNER)), box_of(page, "#details")
    is_left = box["x"] + box["width"] <= panel["x"]
    above = box["y"] + box["height"] <= panel["y"]
    assert is_left or above

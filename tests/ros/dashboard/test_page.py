"""The page in a real browser, against a running system and a hand-written node."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32

from tests.ros.dashboard.conftest import FILE
from tests.ros.support.commands import hand_written, output_of
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.pages import VIEWS, opened
from tests.ros.support.system_process import REPOSITORY

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser, Locator, Page

pytestmark = pytest.mark.browser
PLANNER = "/planning/planner"


@pytest.fixture
def view(browser: Browser, server: Dashboard) -> Iterator[Page]:
    with opened(browser, server.address) as page:
        yield page


def node(name: str) -> str:
    return f'.world [data-key="node:{name}"]'


def detail(page: Page) -> Locator:
    return page.locator("aside.detail:visible")


def expect_text(place: Locator, pattern: str) -> None:
    place.filter(has_text=re.compile(pattern)).first.wait_for()


def test_the_graph_shows_states_rates_and_details(view: Page) -> None:
    expect_text(view.locator(f'{node(PLANNER)}[data-state="active"]'), "planner")
    expect_text(view.locator(".world [data-label]"), r"[23]\d\.?\d* Hz")  # about 30
    expect_text(view.locator(node("/lab/talker")), "no lifecycle|talker")
    view.click(node(PLANNER))
    for expected in (
        "best effort",
        "nav_msgs/msg/Odometry",
        "max_velocity",
        "1 m/s",
        "pipeline.yaml:10",
        "restarts",
    ):
        expect_text(detail(view), re.escape(expected))
    assert view.url.endswith("/graph/planning/planner")
    view.keyboard.press("Escape")
    detail(view).wait_for(state="hidden")
    view.keyboard.press("/")
    view.keyboard.type("motor_commands")
    expect_text(view.locator(".matches"), r"\d+ found")
    view.keyboard.press("Enter")
    expect_text(detail(view), "/motor_commands")


def test_every_view_has_an_address_and_a_key(view: Page) -> None:
    for number, name in enumerate(VIEWS, 1):
        view.keyboard.press(str(number))
        view.wait_for_url(f"**/{name}")
        assert view.locator(f'#rail a[href="/{name}"]').get_attribute("aria-current") == "page"
    view.goto("/nodes?show=plan")
    expect_text(view.locator("tbody tr"), "planner.*configure")
    view.go_back()
    view.wait_for_url("**/timing")
    expect_text(view.locator("tbody tr"), "timer control")
    view.click("tbody a:has-text('timer control')")
    view.locator(".histogram rect").first.wait_for()
    expect_text(view.locator(".facts:visible"), r"p99[\d.]+ (ms|µs)")
    view.goto("/graph?view=lifecycle")
    expect_text(view.locator(".world"), "configure")
    view.goto("/topics")
    expect_text(view.locator("tr[data-key='/sensor_data'] td"), "^best effort, volatile$")


def test_a_node_is_deactivated_and_activated_by_click(view: Page) -> None:
    view.goto(f"/nodes{PLANNER}")
    view.focus("button[data-transition=deactivate]")
    view.keyboard.press("Enter")
    expect_text(view.locator("dialog"), "depend on it: /control/motor_controller")
    view.click("dialog >> text=Only this node")
    expect_text(detail(view).locator(".state"), "inactive")
    assert "inactive" in output_of("lifecycle", "get", PLANNER)
    # The button is gone, and the focus is at another one.
    view.wait_for_function("document.activeElement.dataset.transition === 'activate'")
    view.click("button[data-transition=activate]")
    expect_text(detail(view).locator(".state"), "^active")
    assert "inactive" not in output_of("lifecycle", "get", PLANNER)
    view.click("#bar [data-command=pause]")
    expect_text(view.locator(".activity"), "paused · 0 of 3 active")
    view.click("#bar [data-command=resume]")
    expect_text(view.locator(".activity"), "running · 3 of 3 active")


def test_a_parameter_is_changed_and_refused(view: Page) -> None:
    view.goto(f"/parameters{PLANNER}")
    line = view.locator("[data-name=max_velocity]")
    line.locator("input[type=text]").fill("1.5")
    view.keyboard.press("Enter")
    expect_text(line.locator(".outcome"), "Set")
    assert "1.5" in output_of("param", "get", PLANNER, "max_velocity")
    line.locator("input[type=text]").fill("50")
    view.keyboard.press("Enter")
    expect_text(line.locator(".outcome[data-tone=bad]"), "at most 5|between|range|maximum")
    assert "1.5" in output_of("param", "get", PLANNER, "max_velocity")
    line.locator("input[type=text]").fill("fast")
    view.keyboard.press("Enter")
    expect_text(line.locator(".outcome"), "a number is expected")
    view.keyboard.press("Escape")
    wait_until(lambda: line.locator("input[type=text]").input_value() == "1.5", "the value")
    line.locator("input[type=range]").fill("1")
    expect_text(line.locator(".outcome"), "Set")


def test_the_drift_is_shown_until_it_is_gone(view: Page) -> None:
    output_of("param", "set", PLANNER, "max_velocity", "2.5")
    view.goto("/nodes?show=drift")
    expect_text(view.locator(".drift"), r"/lab/talker.*extra node")
    wrong = view.locator(".drift", has_text="wrong parameter")
    expect_text(wrong, r"max_velocity.*declared1\.0running2\.5declared at")
    output_of("param", "set", PLANNER, "max_velocity", "1.0")
    view.click("text=Compare again")
    wrong.wait_for(state="detached")
    view.locator(".drift", has_text="/lab/talker").wait_for()


def test_plotted_values_are_those_published(view: Page, peer: Peer) -> None:
    published: list[int] = []
    # A deep queue: the browser is driven on another thread of this process.
    qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
    peer.node.create_subscription(
        Int32, "/lab/count", lambda message: published.append(message.data), qos
    )
    wait_until(lambda: published)
    view.goto("/topics/lab/count")
    value = view.locator(".message [data-path=data] .value")
    value.wait_for()
    assert int(value.inner_text()) in range(published[0], published[-1] + 100)
    view.click("button[aria-label='Plot data']")
    view.wait_for_url("**tab=plot**")
    expect_text(view.locator(".legend output"), r"^\d+$")
    first = int(view.inner_text(".legend output"))
    wait_until(lambda: int(view.inner_text(".legend output")) > first + 50)
    assert view.locator(".plot canvas").is_visible()
    view.click(".plot-panel >> text=Pause")
    with view.expect_download() as download:
        view.click("text=Export CSV")
    head, *rows = csv.reader(io.StringIO(download.value.path().read_text(encoding="utf-8")))
    assert head == ["time_s", "/lab/count:data"]
    plotted = [int(row[1]) for row in rows]
    wait_until(lambda: published[-1] >= plotted[-1])
    assert len(plotted) > 50
    start = published.index(plotted[0])
    assert plotted == published[start : start + len(plotted)]


def test_fields_are_added_to_a_plot_with_the_keyboard(view: Page) -> None:
    view.goto("/topics/sensor_data?tab=plot")
    fields = view.get_by_label("Field to add")
    fields.locator("option[value='pose.pose.position.x']").wait_for(state="attached")
    fields.focus()
    for name in ("pose.pose.position.x", "pose.pose.position.y"):
        while fields.input_value() != name:
            view.keyboard.press("ArrowDown")
        view.keyboard.press("Tab")
        view.keyboard.press("Enter")
        expect_text(view.locator(".legend li"), re.escape(name))
        view.keyboard.press("Shift+Tab")
    plotted = view.locator(".legend output")
    assert plotted.count() == 2
    wait_until(lambda: all(re.search(r"\d", text) for text in plotted.all_inner_texts()))
    view.get_by_label("Remove /sensor_data:pose.pose.position.x").press("Enter")
    view.wait_for_function("document.activeElement.ariaLabel?.startsWith('Remove')")
    assert plotted.count() == 1


def test_images_are_shown(view: Page) -> None:
    with hand_written("hand_written_camera.py"):
        view.goto("/topics/camera?tab=image")
        expect_text(detail(view), r"640 . 480 rgb8")
        drawn = view.evaluate(
            """() => {
            const canvas = document.querySelector("canvas.image");
            const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, 1).data;
            return [canvas.width, pixels[3]];
            }"""
        )
        assert drawn[0] >= 320
        assert drawn[1] == 255  # opaque: something was drawn
        view.goto("/topics/camera/compressed?tab=image")
        expect_text(detail(view), r"1 . 1 png")


def test_a_message_is_published_from_a_form(view: Page) -> None:
    view.goto("/topics/lab/in?tab=publish")
    view.get_by_label("data").fill("hello <b>you</b>")
    view.click("form >> text=Publish")
    expect_text(view.locator(".toast"), "to 1 subscription")
    view.get_by_label("Rate in Hz").fill("50")
    view.click("form >> text=Repeat")
    expect_text(view.locator(".publish .status"), r"^\d{2,} published to 1 subscription$")
    view.click("form >> text=Stop")
    view.locator("form >> text=Repeat").wait_for()
    view.goto("/topics/lab/received")
    expect_text(view.locator(".message"), "hello <b>you</b>")


def test_only_what_is_on_the_screen_is_subscribed(view: Page, peer: Peer) -> None:
    view.goto("/topics/lab/text")
    view.locator(".message [data-path=data] .value").wait_for()
    wait_until(lambda: peer.node.count_subscribers("/lab/text") > 0)
    view.click("#rail a[href='/log']")
    wait_until(lambda: peer.node.count_subscribers("/lab/text") == 0)


def test_markup_of_nodes_stays_text(view: Page, peer: Peer) -> None:
    markup = "<img src=x onerror=alert()><b id=bold>bold</b>"
    peer.node.declare_parameter("odd", markup, ParameterDescriptor(description=markup))
    name = peer.node.get_fully_qualified_name()
    view.goto(f"/parameters{name}")
    expect_text(view.locator("[data-name=odd]"), re.escape(markup))
    assert view.locator("[data-name=odd] input[type=text]").input_value() == markup
    assert view.locator("#bold, img[src=x]").count() == 0
    peer.node.get_logger().error(markup)
    view.goto("/log")
    expect_text(view.locator(".log li"), re.escape(markup))
    assert view.locator("#bold, img[src=x]").count() == 0


def test_a_service_is_called(view: Page) -> None:
    view.goto("/services")
    view.click("tbody a:has-text('/plan_trajectory')")
    view.locator("fieldset", has_text="goal").get_by_label("x").fill("1")
    view.get_by_label("max_velocity").fill("0.5")
    view.click("form >> text=Call")
    expect_text(detail(view), r"Response after [\d.]+ ms")
    expect_text(detail(view).locator(".message"), "trajectory|path|points|success")
    view.goto("/services/lab/add")
    view.get_by_label("data").check()
    view.click("form >> text=Call")
    expect_text(detail(view).locator(".message"), "switched")


def test_a_goal_is_sent_followed_and_canceled(view: Page) -> None:
    view.goto("/actions/lab/navigate")
    view.get_by_label("max_velocity").fill("-1")
    view.click("text=Send goal")
    goal = view.locator(".goal").first
    expect_text(goal.locator("[data-path=progress_percent]"), r"progress_percent[1-9]")
    assert goal.locator("progress").get_attribute("value") is not None
    view.click("#rail a[href='/log']")
    view.go_back()
    goal.locator("text=Cancel").click()
    expect_text(goal.locator(".goal-status"), "canceled")
    expect_text(goal, "stopped")
    view.get_by_label("max_velocity").fill("0")
    view.click("text=Send goal")
    expect_text(view.locator(".goal").first, "reject|refused")


def test_the_log_is_filtered_and_leads_to_nodes(view: Page) -> None:
    view.goto("/log")
    expect_text(view.locator(".log li"), "driving to")
    view.get_by_label("Node").fill("planner")
    view.wait_for_url("**node=planner**")
    expect_text(view.locator(".empty:visible"), "No log lines")
    view.get_by_label("Node").fill("motor")
    expect_text(view.locator(".log li"), "driving to")
    view.click(".log li a >> nth=0")
    view.wait_for_url("**/nodes/control/motor_controller")


def test_a_lost_connection_is_made_again_and_read_only_has_no_buttons(
    browser: Browser, server: Dashboard, tmp_path: Path
) -> None:
    token = tmp_path / "token"
    token.write_text("0123456789" * 5, encoding="utf-8")
    token.chmod(0o600)
    page = browser.new_context().new_page()
    with dashboard(FILE, "--token-file", str(token), cwd=REPOSITORY) as first:
        page.goto(f"{first.address.origin}/nodes{PLANNER}?token={first.address.token}")
        page.locator("button[data-transition=deactivate]").wait_for()
        port = str(first.address.port)
    expect_text(page.locator("#banner:visible"), "Not connected")
    again = ("--port", port, "--token-file", str(token), "--read-only")
    with dashboard(FILE, *again, cwd=REPOSITORY):
        page.locator("#banner").wait_for(state="hidden")
        page.locator(".badge:visible").wait_for()
        expect_text(detail(page).locator(".state"), "active")
        page.locator("button[data-transition]").first.wait_for(state="detached")
        page.locator("#bar [data-command]").first.wait_for(state="detached")
    page.context.close()

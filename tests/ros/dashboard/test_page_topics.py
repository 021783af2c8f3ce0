"""Topics, services and actions on the page in a real browser."""

from __future__ import annotations

import csv
import io
import re
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pytest
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry, Path
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Header, Int32

from tests.ros.support.commands import hand_written, listed
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.pages import detail, expect_text, visit

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.browser


#: The fields of two topics, from whose messages a test takes the same numbers.
SERIES = {
    "/lab/count:data": lambda message: message.data,
    "/sensor_data:pose.pose.position.x": lambda message: message.pose.pose.position.x,
    "/sensor_data:twist.twist.linear.x": lambda message: message.twist.twist.linear.x,
}


def test_exported_values_are_those_published(view: Page, peer: Peer) -> None:
    published: dict[str, dict[float, float]] = {name: {} for name in SERIES}
    # A deep queue: the browser is driven on another thread of this process.
    qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
    for kind, topic in ((Int32, "/lab/count"), (Odometry, "/sensor_data")):

        def take(message: Any, info: Any, topic: str = topic) -> None:
            for name, value_of in SERIES.items():
                if name.startswith(f"{topic}:"):
                    published[name][info["source_timestamp"] * 1e-9] = value_of(message)

        peer.node.create_subscription(kind, topic, take, qos)
    wait_until(lambda: all(published.values()))
    view.goto("/topics/lab/count")
    view.click("button[aria-label='Plot data']")
    view.wait_for_url("**tab=plot**")
    view.goto(f"/topics/lab/count?tab=plot&series={quote(' '.join(SERIES))}")
    values = view.locator(".legend output")
    expect_text(values.first, r"^\d+$")
    first = int(values.first.inner_text())
    wait_until(lambda: int(values.first.inner_text()) > first + 50)
    assert view.locator(".plot canvas").is_visible()
    view.click(".plot-panel >> text=Pause")
    with view.expect_download() as download:
        view.click("text=Export CSV")
    head, *rows = csv.reader(io.StringIO(download.value.path().read_text(encoding="utf-8")))
    assert head == ["time_s", *SERIES]
    for column, name in enumerate(SERIES, 1):
        exported = {float(row[0]): float(row[column]) for row in rows if row[column]}
        first, last = min(exported), max(exported)
        wait_until(lambda name=name, last=last: max(published[name]) >= last, f"the last of {name}")
        known = published[name].copy()  # it grows on another thread
        expected = {at: value for at, value in known.items() if first <= at <= last}
        # A busy machine may lose messages of best effort, here or there, where they are counted.
        received = exported.keys() & expected.keys()
        assert len(received) > 20
        assert {at: exported[at] for at in received} == {at: expected[at] for at in received}
        assert expected.keys() <= exported.keys() or view.locator(".plot-panel .drops").is_visible()


def group(name: str) -> str:
    return f'fieldset:has(> legend > .field-name:text-is("{name}"))'


def field(name: str) -> str:
    return f'.field-line:has(.field-name:text-is("{name}")) input'


def test_a_message_with_lists_is_published(view: Page, peer: Peer) -> None:
    received: list[Path] = []
    peer.node.create_subscription(Path, "/lab/path", received.append, 10)
    view.goto("/topics/lab/path?tab=publish")
    form = view.locator("form.fields")
    form.locator(f"{group('header')} {field('stamp')}").fill("1.5")
    form.locator(f"{group('header')} {field('frame_id')}").fill("map")
    for x in ("1", "2", "-3.25"):
        form.get_by_text("Add item").click()
        form.locator(f".item >> nth=-1 >> {group('position')} {field('x')}").fill(x)
    form.get_by_label("Remove [1] of poses").click()
    items = form.locator(".item > fieldset > legend > .field-name")
    assert items.all_inner_texts() == ["[0]", "[1]"]
    third = form.locator(f"{group('[1]')} {group('position')} {field('y')}")
    third.fill("")
    form.get_by_text("Publish").click()
    view.locator("form input:invalid:focus").wait_for()
    third.fill("4e-3")
    form.get_by_text("Publish").click()
    expect_text(view.locator(".toast"), "to 1 subscription")
    (message,) = wait_until(lambda: received, "the message")
    assert message.header == Header(stamp=Time(sec=1, nanosec=500_000_000), frame_id="map")
    places = [(pose.pose.position.x, pose.pose.position.y) for pose in message.poses]
    assert places == [(1.0, 0.0), (-3.25, 0.004)]


def test_fields_are_filtered_counted_and_plotted(view: Page) -> None:
    view.goto("/topics/sensor_data")
    shown = view.locator(".message .field:visible")
    shown.first.wait_for()
    view.get_by_label("Filter fields").fill("Position.x")
    assert [line.get_attribute("data-path") for line in shown.all()] == [
        "pose",
        "pose.pose",
        "pose.pose.position",
        "pose.pose.position.x",
    ]
    expect_text(view.locator("[data-path='pose.pose.position.x'] .value"), r"^-?\d")
    view.get_by_label("Filter fields").fill("posix")
    expect_text(view.locator(".message"), "^No field matches.$")
    view.get_by_label("Filter fields").fill("")
    view.locator("[data-path='header.frame_id']").wait_for()
    view.get_by_label("Messages per second shown").select_option("1 Hz")
    expect_text(view.locator(".echo .drops:visible"), r"^[1-9]\d not shown$")
    # Fields are added to a plot with the keyboard.
    visit(view, "/topics/sensor_data?tab=plot")
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
        visit(view, "/topics/camera/compressed?tab=image")
        expect_text(detail(view), r"1 . 1 png")


def test_a_message_is_published_from_a_form_and_shown(view: Page, peer: Peer) -> None:
    view.goto("/topics/lab/in?tab=publish")
    view.get_by_label("data").fill("hello <b>you</b>")
    view.click("form >> text=Publish")
    expect_text(view.locator(".toast"), "to 1 subscription")
    view.get_by_label("Rate in Hz").fill("50")
    view.click("form >> text=Repeat")
    expect_text(view.locator(".publish .status"), r"^\d{2,} published to 1 subscription$")
    view.click("form >> text=Stop")
    view.locator("form >> text=Repeat").wait_for()
    visit(view, "/topics/lab/received")
    expect_text(view.locator(".message"), "hello <b>you</b>")
    # Only what is on the screen is subscribed.
    visit(view, "/topics/lab/text")
    view.locator(".message [data-path=data] .value").wait_for()
    wait_until(lambda: peer.node.count_subscribers("/lab/text") > 0)
    view.click("#rail a[href='/log']")
    wait_until(lambda: peer.node.count_subscribers("/lab/text") == 0)


def test_services_are_called_also_with_lists_and_ranges(view: Page) -> None:
    view.goto("/services")
    view.click("tbody a:has-text('/plan_trajectory')")
    view.locator("fieldset", has_text="goal").get_by_label("x").fill("1")
    view.get_by_label("max_velocity").fill("0.5")
    view.click("form >> text=Call")
    expect_text(detail(view), r"Response after [\d.]+ ms")
    expect_text(detail(view).locator(".message"), "trajectory|path|points|success")
    visit(view, "/services/lab/add")
    view.get_by_label("data").check()
    view.click("form >> text=Call")
    expect_text(detail(view).locator(".message"), "switched")
    visit(view, "/services/lab/talker/set_parameters")  # hidden, unless it is chosen
    form = view.locator("form.fields")
    form.get_by_text("Add item").first.click()
    form.locator(field("name")).fill("speed")
    kind = form.locator(f"{group('value')} {field('type')}")
    expect_text(form.locator(".hint"), "0 … 255")
    kind.fill("256")
    form.get_by_text("Call").click()
    view.locator("form input:invalid:focus").wait_for()
    assert detail(view).locator("[role=status]").inner_text() == ""
    kind.fill("3")
    form.locator(field("double_value")).fill("2.5")
    form.get_by_text("Call").click()
    expect_text(detail(view).locator(".message"), "successful.*true")
    listed(("2.5",), "param", "get", "/lab/talker", "speed")
    form.locator(field("double_value")).fill("5.5")
    form.get_by_text("Call").click()
    expect_text(detail(view).locator(".message"), "successful.*false.*reason.*range")


def test_what_is_not_there_is_named(view: Page) -> None:
    view.goto("/topics")
    for kind in ("topic", "service", "action"):
        visit(view, f"/{kind}s/lab/missing")
        expect_text(detail(view), f"There is no {kind} /lab/missing")
    visit(view, "/topics/parameter_events?tab=info")  # hidden, unless it is chosen
    expect_text(detail(view), r"Publishers \(\d+\)/")
    view.locator("tr.selected", has_text="/parameter_events").wait_for()


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

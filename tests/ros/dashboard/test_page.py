"""The page in a real browser, against a running system and a hand-written node."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest
from lifecycle_msgs.msg import State, TransitionEvent
from lifecycle_msgs.srv import GetAvailableTransitions
from rclpy.lifecycle import LifecycleNode

from tests.ros.dashboard.conftest import FILE
from tests.ros.support.commands import expect_state, listed, output_of
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.pages import VIEWS, detail, expect_text, expect_texts, visit
from tests.ros.support.system_process import REPOSITORY

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser, Page, WebSocketRoute

pytestmark = pytest.mark.browser
PLANNER, CONTROLLER = "/planning/planner", "/control/motor_controller"


def node(name: str) -> str:
    return f'.world [data-key="node:{name}"]'


def test_the_graph_shows_states_rates_and_details(view: Page) -> None:
    view.goto("/")
    expect_text(view.locator(f'{node(PLANNER)}[data-state="active"]'), "planner")
    expect_text(view.locator(".world [data-label]"), r"[23]\d\.?\d* Hz")  # about 30
    assert view.evaluate(LEAST_SIZE) >= 9.5
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
    visit(view, "/graph?view=connections")
    expect_text(view.locator(".world [data-label]"), r"/sensor_data[^/]*[23]\d\.?\d* Hz")


#: The size of the smallest letters of the diagram, in pixels of the screen.
LEAST_SIZE = """() => {
    const texts = [...document.querySelectorAll(".world text")];
    const shown = texts.filter(one => one.checkVisibility());
    return Math.min(...shown.map(
        one => parseFloat(getComputedStyle(one).fontSize) * one.getScreenCTM().a
    ));
}"""


def test_every_view_has_an_address_and_a_key(view: Page) -> None:
    view.goto("/")
    for number, name in enumerate(VIEWS, 1):
        view.keyboard.press(str(number))
        view.wait_for_url(f"**/{name}")
        assert view.locator(f'#rail a[href="/{name}"]').get_attribute("aria-current") == "page"
    view.goto("/nodes?show=plan")
    check_plan(view)
    view.go_back()
    view.wait_for_url(f"**/{VIEWS[-1]}")
    visit(view, "/timing")
    expect_text(view.locator("tbody tr"), "timer control")
    view.click("tbody a:has-text('timer control')")
    view.locator(".histogram rect").first.wait_for()
    expect_text(view.locator(".facts:visible"), r"p99[\d.]+ (ms|µs)")
    visit(view, "/graph?view=lifecycle")
    expect_text(view.locator(".world"), "configure")
    visit(view, "/topics")
    expect_text(view.locator("tr[data-key='/sensor_data'] td"), "^best effort, volatile$")


def check_plan(view: Page) -> None:
    """Check that each step of the bring-up has the cause that ``compose run --dry-run`` prints."""
    steps = output_of("run", REPOSITORY / FILE, "--dry-run").splitlines()
    rows = view.locator("table[aria-label='Plan of the bring-up'] tbody tr")
    rows.first.wait_for()
    shown = []
    for row in rows.all():
        number, node, transition, why = row.locator("td, th").all_inner_texts()
        cause, _, after = why.partition(" after step ")
        order = "".join(f" after #{step}" for step in after.split(", ") if step)
        shown.append(f"#{number} {transition} {node}{order}: {cause}")
    assert shown == steps


def test_a_node_and_the_system_are_changed_by_click(view: Page) -> None:
    view.goto(f"/nodes{PLANNER}")
    view.focus("button[data-transition=deactivate]")
    view.keyboard.press("Enter")
    expect_text(view.locator("dialog"), "depend on it: /control/motor_controller")
    view.click("dialog >> text=Only this node")
    expect_text(detail(view).locator(".state"), "inactive")
    expect_state(PLANNER, "inactive")
    # The button is gone, and the focus is at another one.
    view.wait_for_function("document.activeElement.dataset.transition === 'activate'")
    view.click("button[data-transition=activate]")
    expect_text(detail(view).locator(".state"), "^active")
    expect_state(PLANNER, "active")
    view.click("#bar [data-command=pause]")
    expect_text(view.locator(".activity"), "paused · 0 of 3 active")
    view.click("#bar [data-command=resume]")
    expect_text(view.locator(".activity"), "running · 3 of 3 active")
    # The whole system is reset and started again.
    activity, bar = view.locator(".activity"), view.locator("#bar")
    view.click("#rail a[href='/nodes']")
    bar.locator("[data-command=reset]").click()
    expect_text(view.locator("dialog"), "All nodes are cleaned up")
    view.click("dialog >> text=Cancel")
    expect_text(activity, "running · 3 of 3 active")
    bar.locator("[data-command=reset]").click()
    view.click("dialog >> button:text-is('Reset')")
    expect_text(activity, "^reset · 0 of 3 active")
    expect_text(view.locator("tbody tr"), "planner.*unconfigured")
    bar.locator("[data-command=startup]").wait_for()
    expect_state(PLANNER, "unconfigured")
    assert bar.locator("[data-command=pause]").count() == 0
    bar.locator("[data-command=startup]").click()
    expect_text(activity, "running · 3 of 3 active")
    expect_state(PLANNER, "active")


#: Each transition once, with the state that it leads to.
TRANSITIONS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": "finalized",
}


def test_every_legal_transition_has_a_button_and_no_other_has(view: Page, peer: Peer) -> None:
    name = peer.join("managed", LifecycleNode).get_fully_qualified_name()
    view.goto(f"/nodes{name}")
    expect_text(detail(view).locator(".state"), "unconfigured")
    for transition, state in TRANSITIONS.items():
        assert sorted(buttons(view)) == legal_transitions(peer, name)
        view.click(f"button[data-transition={transition}]")
        if transition == "shutdown":
            view.click("dialog >> text=Cancel")
            assert peer.state(name) == "unconfigured"
            view.click("button[data-transition=shutdown]")
            view.click("dialog >> button:text-is('Shutdown')")
        expect_text(detail(view).locator(".state"), f"^{state}")
        assert peer.state(name) == state
    assert (buttons(view), legal_transitions(peer, name)) == ([], [])


def buttons(view: Page) -> list[str | None]:
    found = detail(view).locator("button[data-transition]").all()
    return [button.get_attribute("data-transition") for button in found]


def legal_transitions(peer: Peer, node: str) -> list[str]:
    """Return what the node itself says."""
    response = peer.call(GetAvailableTransitions, f"{node}/get_available_transitions")
    return sorted(item.transition.label for item in response.available_transitions)


def test_nodes_are_restarted_by_click_also_after_a_shutdown(view: Page, peer: Peer) -> None:
    events = peer.listen(TransitionEvent, f"{PLANNER}/transition_event", 100)
    peer.wait_until_known(PLANNER)
    view.goto(f"/nodes{PLANNER}")
    view.click("button[data-transition=restart]")
    expect_text(view.locator(".toast"), "Restart: done")
    passed = ["inactive", "unconfigured", "inactive", "active"]
    wait_until(lambda: [event.goal_state.label for event in events if ends(event)] == passed)
    expect_text(detail(view).locator(".state"), "^active")
    assert sorted(buttons(view)) == sorted([*legal_transitions(peer, PLANNER), "restart"])
    # One that is shut down is created again.
    visit(view, f"/nodes{CONTROLLER}")
    expect_text(detail(view), re.escape(CONTROLLER))
    view.click("button[data-transition=shutdown]")
    expect_text(view.locator("dialog"), "Only a restart makes it usable again")
    view.click("dialog >> button:text-is('Shutdown')")
    expect_text(detail(view).locator(".state"), "^finalized")
    assert buttons(view) == ["restart"]
    view.click("button[data-transition=restart]")
    expect_text(detail(view).locator(".state"), "^active")
    expect_text(view.locator(".activity"), "running · 3 of 3 active")


def ends(event: TransitionEvent) -> bool:
    """Return whether a node is in a primary state then."""
    return bool(event.goal_state.id <= State.PRIMARY_STATE_FINALIZED)


def test_parameters_are_described_changed_and_refused(view: Page) -> None:
    view.goto("/parameters/lab/talker")
    expect_text(view.locator("[data-name=speed] .hint"), r"^0 … 5 · How fast\.$")
    visit(view, f"/parameters{PLANNER}")
    line = view.locator("[data-name=max_velocity]")
    value, outcome = line.locator("input[type=text]"), line.locator(".outcome")
    expect_text(line, r"max_velocity double.*m/s")
    expect_text(line.locator(".hint"), r"^0.01 … 5 m/s · Speed limit of every plan\.$")
    search = view.get_by_label("Search parameters")
    search.fill("between two points")
    expect_text(view.locator(".parameter:visible"), "sample_period_ms")
    line.wait_for(state="hidden")
    search.fill("")
    value.fill("1.5")
    view.keyboard.press("Enter")
    expect_text(outcome, "Set")
    listed(("1.5",), "param", "get", PLANNER, "max_velocity")
    value.fill("50")
    view.keyboard.press("Enter")
    expect_text(line.locator(".outcome[data-tone=bad]"), "at most 5|between|range|maximum")
    listed(("1.5",), "param", "get", PLANNER, "max_velocity")
    value.fill("fast")
    view.keyboard.press("Enter")
    expect_text(outcome, "a number is expected")
    view.keyboard.press("Escape")
    wait_until(lambda: value.input_value() == "1.5", "the value")
    line.locator("input[type=range]").fill("1")
    expect_text(outcome, "Set")


def test_the_drift_is_shown_until_it_is_gone(view: Page) -> None:
    from playwright.sync_api import TimeoutError as NotSeen  # noqa: PLC0415 - not everywhere

    listed((), "param", "set", PLANNER, "max_velocity", "2.5")
    view.goto("/nodes?show=drift")
    talker = view.locator(".drift", has_text=re.compile("/lab/talker.*extra node"))
    wrong = view.locator(".drift", has_text="wrong parameter")

    def shows(is_wrong: bool) -> bool:
        """Compare again: some of it may not have been discovered before."""
        view.click("text=Compare again")
        with suppress(NotSeen):
            wrong.first.wait_for(state="visible" if is_wrong else "detached", timeout=5000)
            talker.first.wait_for(timeout=5000)
            return True
        return False

    wait_until(lambda: shows(is_wrong=True), "the difference")
    expect_text(wrong, r"max_velocity.*declared1\.0running2\.5declared at")
    listed((), "param", "set", PLANNER, "max_velocity", "1.0")
    wait_until(lambda: shows(is_wrong=False), "no difference")


def test_the_log_is_filtered_and_paused_and_leads_to_nodes(own_view: Page, peer: Peer) -> None:
    log, lines = peer.node.get_logger(), own_view.locator(".log li .text")
    sockets: list[WebSocketRoute] = []

    def connect(socket: WebSocketRoute) -> None:
        socket.connect_to_server()
        sockets.append(socket)

    own_view.route_web_socket(re.compile("/ws[?]"), connect)
    own_view.goto("/log?text=mark")
    log.info("mark 1")
    log.warning("mark 2")
    log.error("mark 3")
    expect_texts(lines, "mark 1", "mark 2", "mark 3")
    own_view.get_by_label("Lowest level").select_option("warn and above")
    expect_texts(lines, "mark 2", "mark 3")
    assert own_view.url.endswith("/log?level=warn&text=mark")
    own_view.click(".toolbar >> text=Pause")
    log.error("mark 4")
    expect_text(own_view.locator(".toolbar"), "1 more while paused")
    expect_texts(lines, "mark 2", "mark 3")
    # New filters apply to what has arrived by then.
    own_view.get_by_label("Lowest level").select_option("error and above")
    expect_texts(lines, "mark 3", "mark 4")
    log.error("mark 5")
    expect_text(own_view.locator(".toolbar"), "1 more while paused")
    own_view.click(".toolbar >> text=Pause")
    expect_texts(lines, "mark 3", "mark 4", "mark 5")
    # What arrives again after a lost connection is not shown twice.
    sockets[-1].close()
    wait_until(lambda: own_view.title() and len(sockets) > 1)
    log.fatal("mark 6")
    expect_texts(lines, "mark 3", "mark 4", "mark 5", "mark 6")
    visit(own_view, "/log")
    expect_text(own_view.locator(".log li"), "driving to")
    own_view.get_by_label("Node").fill("planner")
    own_view.wait_for_url("**node=planner**")
    expect_text(own_view.locator(".empty:visible"), "No log lines")
    own_view.get_by_label("Node").fill("motor")
    expect_text(own_view.locator(".log li"), "driving to")
    own_view.click(".log li a >> nth=0")
    own_view.wait_for_url("**/nodes/control/motor_controller")


def test_timers_are_sorted_by_lateness_and_have_histograms(view: Page) -> None:
    view.goto("/timing?show=timers")

    def lateness() -> dict[str, float]:
        return {name: in_ms(text) for name, text in view.evaluate(LATE) if text[0].isdigit()}

    wait_until(lambda: len(lateness()) == 3, "all timers were called")
    late = lateness()
    assert late.keys() == {"timer control", "timer plan", "timer step"}
    assert list(late.values()) == sorted(late.values(), reverse=True)
    view.get_by_role("link", name="timer step").click()
    expect_text(view.locator(".facts:visible"), r"late, p99[\d.]+ (ms|µs)")
    view.locator(".histogram figcaption", has_text="calls").wait_for()
    counts = view.evaluate(COUNTS)
    assert sum(counts["bins"]) == counts["total"] > 0


#: The names and the lateness of timers, read at once, since they change every second.
LATE = """() => {
    const head = document.querySelector("th[data-id=late][aria-sort=descending]");
    const rows = [...document.querySelectorAll("table[aria-label^=Timers] tbody tr")];
    return rows.map(({cells}) => [cells[0].innerText, cells[head.cellIndex].innerText]);
}"""
#: The number of calls of each bin of a histogram, and of all.
COUNTS = """() => {
    const numberOf = text => Number(text.match(/([\\d,]+) calls/)[1].replaceAll(",", ""));
    const bins = document.querySelectorAll(".histogram rect title");
    return {
        bins: [...bins].map(bin => numberOf(bin.textContent)),
        total: numberOf(document.querySelector(".histogram figcaption").innerText),
    };
}"""


def in_ms(text: str) -> float:
    value, unit = text.split()
    return float(value) * {"µs": 0.001, "ms": 1.0, "s": 1000.0}[unit]


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

"""Markup and quotes in all that the page shows: nothing of it becomes an element, or runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rcl_interfaces.msg import Log, ParameterDescriptor
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.runtime.protocol.codec import encode
from composer.runtime.protocol.reports import (
    CallbackFigures,
    ChainFigures,
    NodeReport,
    SystemReport,
    TimingReport,
)
from composer.runtime.ros.manager_interface import CALLBACKS_QOS, STATE_QOS
from tests.ros.support.commands import Running, hand_written
from tests.ros.support.dashboard import Address, dashboard
from tests.ros.support.in_process import Peer
from tests.ros.support.pages import SIZE, VIEWS, allowed, expect_text, visit, watched

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

EVIL = "'\"><img src=x onerror=window.pwned=1><script>window.pwned=1</script>"
SYSTEM = f"""
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


@pytest.fixture(scope="module")
def hostile(shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Address]:
    """A dashboard, a system, and a participant that publishes markup wherever it can."""
    folder: Path = tmp_path_factory.mktemp("hostile")
    file = folder / "hostile.yaml"
    file.write_text(SYSTEM, encoding="utf-8")
    running = Running(folder / "log", str(file))
    peer = Peer()
    try:
        running.wait_for("1 of 1 nodes active")
        _publish(peer)
        with hand_written("hand_written_odd_names.py"), dashboard(str(file)) as server:
            yield server.address
    finally:
        peer.close()
        running.process.terminate()
        running.process.wait()


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


@pytest.fixture(scope="module")
def page(browser: Browser, hostile: Address) -> Iterator[Page]:
    """The page, which must not complain."""
    with allowed(browser, hostile) as context, watched(context.new_page(), hostile) as opened:
        opened.set_viewport_size(SIZE)
        opened.goto("/nodes")
        yield opened


@pytest.mark.parametrize(
    ("path", "text"),
    [
        *((f"/{view}", "") for view in VIEWS),
        ("/graph?view=connections", ""),
        ("/nodes/talker", "script"),
        ("/nodes/forged/node", ""),
        ("/topics/text", "img src=x"),
        ("/parameters/talker", "img src=x"),
        ("/log?text=img", "img src=x"),
    ],
)
def test_markup_is_text(page: Page, path: str, text: str) -> None:
    visit(page, path)
    if text:
        expect_text(page.locator("#main"), text)
    page.wait_for_timeout(700)  # until what is published has arrived
    found: Any = page.evaluate(f"[window.pwned ?? 0, {_ELEMENTS}]")
    assert found == [0, 0], page.locator("#main").inner_html()[:2000]

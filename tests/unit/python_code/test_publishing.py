"""The publishing rates of a node, from its YAML and its behavior."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent, indent

import pytest

from composer.graph.facts import publishing_rates_hz
from composer.model import Node
from composer.python_code.lookup import find_behavior
from composer.rules.analysis.rates import causes_in_node, published_by_method
from tests.unit.support.resolving import system_of

SENDER = """
    from composer.behavior import Behavior

    class Sender(Behavior):
        def on_tick(self):
            self.publishers.out.publish(self.make())

        def on_other(self):
            pass
"""
SYSTEM = """
    system: sending
    nodes:
      sender:
        behavior: sender:Sender
        publishers: {out: {type: std_msgs/msg/String}}
        timers: {tick: {rate_hz: 20}, other: {rate_hz: 5}}
"""
#: What is known of a publisher: its rate, and the timers that publish through it.
Known = tuple[float | None, list[str] | None]


def sender(folder: Path, python: str = SENDER, system: str = SYSTEM) -> Node:
    (folder / "sender.py").write_text(dedent(python))
    (node,) = system_of(system, folder).nodes
    return node


def known_of(body: str, folder: Path) -> Known:
    """Return what is known of the publisher ``out`` of a node whose timer has this handler."""
    head = (
        "from composer.behavior import Behavior\nclass Sender(Behavior):\n    def on_tick(self):\n"
    )
    node = sender(folder, head + indent(dedent(body), "        "))
    assert node.behavior is not None
    source = find_behavior(node.behavior)
    causes = causes_in_node(node, source, published_by_method(source)).get("out")
    timers = None if causes is None else [cause.timer.name.value for cause in causes if cause.timer]
    return publishing_rates_hz(node).get("out"), timers


@pytest.mark.parametrize(
    "body",
    [
        "self.publishers.out.publish(x)",
        "x = 1\nif x:\n    x = 2\nself.publishers.out.publish(x)",
        "for x in y:\n    z()\nself.publishers.out.publish(x)\nreturn",
        "publish = self.publishers.out.publish\npublish(x)",
        "out = self.publishers.out\nout.publish(x)",
        "publishers = self.publishers\nout = publishers.out\nsend = out.publish\nsend(x)",
    ],
)
def test_unconditional_statements_publish_each_time(body: str, tmp_path: Path) -> None:
    assert known_of(body, tmp_path) == (20.0, ["tick"])


@pytest.mark.parametrize(
    "body",
    [
        "if x:\n    self.publishers.out.publish(x)",
        "if x:\n    return\nself.publishers.out.publish(x)",
        "for x in y:\n    self.publishers.out.publish(x)",
        "assert x\nself.publishers.out.publish(x)",
        "self.publishers.out.publish(x)\nself.publishers.out.publish(x)",
        "out = self.publishers.out\nif x:\n    out.publish(x)",
    ],
)
def test_conditional_statements_publish_at_an_unknown_rate(body: str, tmp_path: Path) -> None:
    assert known_of(body, tmp_path) == (None, ["tick"])


@pytest.mark.parametrize(
    "body",
    [
        "send(self.publishers.out)",
        "self.send = self.publishers.out.publish",
        "out = self.publishers.out\nsend(out)",
        "out = self.publishers.out\nout = other\nout.publish(x)",
        "def send(out=self.publishers.out):\n    out.publish(x)",
    ],
)
def test_stored_publishers_may_be_used_anywhere(body: str, tmp_path: Path) -> None:
    assert known_of(body, tmp_path) == (None, None)


@pytest.mark.parametrize(
    "body",
    ["out.publish(x)", "self.out.publish(x)", "self.publishers", "self.publishers.out.topic"],
)
def test_other_attributes_are_not_publishers(body: str, tmp_path: Path) -> None:
    assert known_of(body, tmp_path) == (None, [])


def test_the_rate_is_that_of_the_timer_whose_handler_publishes(tmp_path: Path) -> None:
    assert publishing_rates_hz(sender(tmp_path)) == {"out": 20.0}


def test_the_rate_is_unknown_if_another_handler_publishes_too(tmp_path: Path) -> None:
    python = SENDER.replace("pass", "self.publishers.out.publish(1)")
    assert publishing_rates_hz(sender(tmp_path, python)) == {}


def test_the_rate_is_unknown_if_a_subscription_publishes_too(tmp_path: Path) -> None:
    system = SYSTEM.replace(
        "timers:",
        "subscriptions: {in: {type: std_msgs/msg/String, publish: {out: {}}}}\n        timers:",
    )
    assert publishing_rates_hz(sender(tmp_path, SENDER, system)) == {}


def test_the_rate_is_unknown_without_a_handler(tmp_path: Path) -> None:
    assert publishing_rates_hz(sender(tmp_path, SENDER.replace("on_tick", "on_tock"))) == {}

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


def sender(folder: Path, python: str, system: str = SYSTEM) -> Node:
    (folder / "sender.py").write_text(dedent(python))
    (node,) = system_of(system, folder).nodes
    return node


def known_of(body: str, folder: Path) -> Known:
    """Return what is known of the publisher ``out`` of a node whose timer has this handler."""
    head = (
        "from composer.behavior import Behavior\nclass Sender(Behavior):\n    def on_tick(self):\n"
    )
    node = sender(folder, head + indent(body, "        "))
    source = find_behavior(node.behavior)
    causes = causes_in_node(node, source, published_by_method(source)).get("out")
    timers = None if causes is None else [cause.timer.name.value for cause in causes if cause.timer]
    return publishing_rates_hz(node).get("out"), timers


EACH_TIME: Known = (20.0, ["tick"])
SOMETIMES: Known = (None, ["tick"])
ANYWHERE: Known = (None, None)
NEVER: Known = (None, [])


@pytest.mark.parametrize(
    ("body", "known"),
    [
        # Unconditional statements.
        ("self.publishers.out.publish(x)", EACH_TIME),
        ("x = 1\nif x:\n    x = 2\nself.publishers.out.publish(x)", EACH_TIME),
        ("for x in y:\n    z()\nself.publishers.out.publish(x)\nreturn", EACH_TIME),
        ("publish = self.publishers.out.publish\npublish(x)", EACH_TIME),
        ("out = self.publishers.out\nout.publish(x)", EACH_TIME),
        (
            "publishers = self.publishers\nout = publishers.out\nsend = out.publish\nsend(x)",
            EACH_TIME,
        ),
        # Conditional ones, and two.
        ("if x:\n    self.publishers.out.publish(x)", SOMETIMES),
        ("if x:\n    return\nself.publishers.out.publish(x)", SOMETIMES),
        ("for x in y:\n    self.publishers.out.publish(x)", SOMETIMES),
        ("assert x\nself.publishers.out.publish(x)", SOMETIMES),
        ("self.publishers.out.publish(x)\nself.publishers.out.publish(x)", SOMETIMES),
        ("out = self.publishers.out\nif x:\n    out.publish(x)", SOMETIMES),
        # Publishers that are stored.
        ("send(self.publishers.out)", ANYWHERE),
        ("self.send = self.publishers.out.publish", ANYWHERE),
        ("out = self.publishers.out\nsend(out)", ANYWHERE),
        ("out = self.publishers.out\nout = other\nout.publish(x)", ANYWHERE),
        ("def send(out=self.publishers.out):\n    out.publish(x)", ANYWHERE),
        # Other attributes.
        ("out.publish(x)", NEVER),
        ("self.out.publish(x)", NEVER),
        ("self.publishers", NEVER),
        ("self.publishers.out.topic", NEVER),
    ],
)
def test_statements_that_publish(body: str, known: Known, tmp_path: Path) -> None:
    assert known_of(body, tmp_path) == known


SUBSCRIPTION = "{in: {type: std_msgs/msg/String, publish: {out: {}}}}"


@pytest.mark.parametrize(
    ("python", "system", "rates_hz"),
    [
        (SENDER, SYSTEM, {"out": 20.0}),
        (SENDER.replace("pass", "self.publishers.out.publish(1)"), SYSTEM, {}),
        (SENDER, SYSTEM.replace("timers:", f"subscriptions: {SUBSCRIPTION}\n        timers:"), {}),
        (SENDER.replace("on_tick", "on_tock"), SYSTEM, {}),
    ],
    ids=["a timer", "another handler too", "a subscription too", "without a handler"],
)
def test_the_rate_of_a_timer(
    python: str, system: str, rates_hz: dict[str, float], tmp_path: Path
) -> None:
    assert publishing_rates_hz(sender(tmp_path, python, system)) == rates_hz

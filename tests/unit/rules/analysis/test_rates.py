"""The rates of publishers and topics, from YAML and behaviors."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.rules.analysis.context import Context
from composer.rules.analysis.rates import rates

HEAD = "system: demo\nnodes:\n"
TALKER = """\
  talker:
    parameters: {rate_hz: {type: double, default: 20.0}}
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {rate_hz: "{parameters.rate_hz}", publish: {chatter: {data: hello}}}}
"""
RELAY = """\
  relay:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, publish: {echo: "{message}"}}
    publishers: {echo: {type: std_msgs/msg/String, qos: command}}
"""
BEHAVIOR = """\
  robot:
    behavior: robot:Robot
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    timers: {fast: {rate_hz: 50}, slow: {rate_hz: 1}}
    services: {reset: {type: std_srvs/srv/Trigger}}
"""
HANDLERS = {
    "on_fast": "pass",
    "on_slow": "pass",
    "on_reset": "return response",
    "helper": "pass",
}


def topic_hz(name: str, text: str, folder: Path) -> float | None:
    path = folder / "system.yaml"
    path.write_text(HEAD + text, encoding="utf-8")
    loading = load(path)
    assert loading.system is not None
    context = Context(loading.system, loading.interfaces, loading.node_types)
    return rates(context).topic_hz(name)


def test_a_timer_determines_the_rate_of_its_publishers(tmp_path: Path) -> None:
    assert topic_hz("/chatter", TALKER, tmp_path) == pytest.approx(20.0)


def test_a_relay_publishes_at_the_rate_of_its_subscription(tmp_path: Path) -> None:
    assert topic_hz("/echo", TALKER + RELAY, tmp_path) == pytest.approx(20.0)


def test_publishers_of_one_topic_add_up(tmp_path: Path) -> None:
    other = TALKER.replace("talker", "second").replace("20.0", "5.0")
    assert topic_hz("/echo", TALKER + RELAY + other, tmp_path) == pytest.approx(25.0)


def test_a_topic_with_external_publishers_has_no_known_rate(tmp_path: Path) -> None:
    outside = RELAY.replace("qos: command, publish", "qos: command, external: true, publish")
    assert topic_hz("/echo", TALKER + outside, tmp_path) is None


def test_topics_in_a_cycle_have_no_known_rate(tmp_path: Path) -> None:
    back = RELAY.replace("relay:", "back:").replace("chatter", "x").replace("echo", "chatter")
    back = back.replace("      x:", "      echo:")
    assert topic_hz("/echo", TALKER + RELAY + back, tmp_path) is None


def behavior(**bodies: str) -> str:
    arguments = {"on_reset": "self, request, response"}
    methods = "".join(
        f"    def {name}({arguments.get(name, 'self')}):\n        {body}\n"
        for name, body in (HANDLERS | bodies).items()
    )
    return f"class Robot:\n{methods}"


PUBLISH = "self.publishers.chatter.publish(None)"


@pytest.mark.parametrize(
    ("bodies", "rate_hz"),
    [
        ({}, 0.0),
        ({"on_fast": PUBLISH}, 50.0),
        ({"on_fast": PUBLISH, "on_slow": PUBLISH}, 51.0),
        ({"on_slow": "self.helper()", "helper": PUBLISH}, 1.0),
        ({"on_reset": f"{PUBLISH}; return response"}, None),
        ({"helper": PUBLISH}, None),
        ({"on_fast": f"send = lambda: {PUBLISH}"}, None),
        ({"on_fast": "send = self.publishers.chatter.publish; send(None)"}, 50.0),
        ({"on_slow": "out = self.publishers.chatter; self.log.info('hello'); out.publish(1)"}, 1.0),
        ({"on_configure": "self.send = self.publishers.chatter.publish"}, None),
    ],
)
def test_publishers_in_behaviors_are_recognized(
    bodies: dict[str, str], rate_hz: float | None, tmp_path: Path
) -> None:
    (tmp_path / "robot.py").write_text(behavior(**bodies), encoding="utf-8")
    assert topic_hz("/chatter", BEHAVIOR, tmp_path) == rate_hz


@pytest.mark.slow  # 1500 nodes
def test_a_long_chain_of_relays_is_followed(tmp_path: Path) -> None:
    count = 1500
    nodes = [TALKER]
    for number in range(count):
        source = "chatter" if number == 0 else f"t{number - 1}"
        nodes.append(
            f"  n{number}: {{subscriptions: {{{source}: {{type: std_msgs/msg/String, qos: command, "
            f'publish: {{t{number}: "{{message}}"}}}}}}, '
            f"publishers: {{t{number}: {{type: std_msgs/msg/String, qos: command}}}}}}\n"
        )
    assert topic_hz(f"/t{count - 1}", "".join(nodes), tmp_path) == pytest.approx(20.0)

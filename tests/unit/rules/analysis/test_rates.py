"""The rates of publishers and topics, from YAML and behaviors."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load_models
from composer.rules.analysis.context import Context
from composer.rules.analysis.rates import rates
from tests.unit.support.checking import write_files

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
HANDLERS = {"on_fast": "pass", "on_slow": "pass", "on_reset": "return response", "helper": "pass"}


def topic_hz(name: str, text: str, folder: Path, python: str = "") -> float | None:
    write_files(folder, {"system.yaml": HEAD + text, "robot.py": python})
    [loading] = load_models([folder / "system.yaml"])
    context = Context(loading.system, loading.interfaces, loading.node_types)
    return rates(context).topic_hz(name)


BACK = RELAY.replace("relay:", "back:").replace("chatter", "x").replace("echo", "chatter")


@pytest.mark.parametrize(
    ("topic", "nodes", "rate_hz"),
    [
        pytest.param("/chatter", [TALKER], 20.0, id="a timer"),
        pytest.param("/echo", [TALKER, RELAY], 20.0, id="a relay"),
        pytest.param(
            "/echo",
            [TALKER, RELAY, TALKER.replace("talker", "second").replace("20.0", "5.0")],
            25.0,
            id="publishers of one topic add up",
        ),
        pytest.param(
            "/echo",
            [
                TALKER,
                RELAY.replace("qos: command, publish", "qos: command, external: true, publish"),
            ],
            None,
            id="publishers elsewhere",
        ),
        pytest.param(
            "/echo", [TALKER, RELAY, BACK.replace("      x:", "      echo:")], None, id="a cycle"
        ),
    ],
)
def test_topic_rates(topic: str, nodes: list[str], rate_hz: float | None, tmp_path: Path) -> None:
    found = topic_hz(topic, "".join(nodes), tmp_path)
    assert found == (rate_hz and pytest.approx(rate_hz))


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
def test_rates_of_behaviors(bodies: dict[str, str], rate_hz: float | None, tmp_path: Path) -> None:
    assert topic_hz("/chatter", BEHAVIOR, tmp_path, behavior(**bodies)) == rate_hz


@pytest.mark.slow  # more nodes than Python has frames
def test_a_long_chain_of_relays_is_followed(tmp_path: Path) -> None:
    count = 1100
    nodes = [TALKER]
    for number in range(count):
        source = "chatter" if number == 0 else f"t{number - 1}"
        nodes.append(
            f"  n{number}: {{subscriptions: {{{source}: {{type: std_msgs/msg/String, qos: command, "
            f'publish: {{t{number}: "{{message}}"}}}}}}, '
            f"publishers: {{t{number}: {{type: std_msgs/msg/String, qos: command}}}}}}\n"
        )
    assert topic_hz(f"/t{count - 1}", "".join(nodes), tmp_path) == pytest.approx(20.0)

"""A mistake with consequences in several files: where it is reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.loading.reported import collect_diagnostics
from tests.unit.rules.test_follow_ups import system
from tests.unit.support.checking import diagnostics_in, rules_broken


def test_a_mistake_in_a_node_type_is_reported_once_for_all_instances(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "talker.yaml").write_text(
        "node: talker\n"
        "publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}\n"
        "timers: {tick: {period_ms: 100, publish: {chatter: {dat: hello}}}}\n",
        encoding="utf-8",
    )
    text = system("a: {type: talker}", "b: {type: talker}", "c: {type: talker, namespace: left}")
    assert rules_broken(text, tmp_path) == ["unknown-field"]


def test_a_node_type_alone_needs_no_connections(tmp_path: Path) -> None:
    text = (
        "node: relay\nvariables: {message_type: {description: The type.}}\n"
        "parameters: {rate_hz: {type: double}}\n"
        "subscriptions:\n"
        "  input: {type: '${message_type}', qos: command, publish: {output: '{message}'}}\n"
        "publishers: {output: {type: '${message_type}', qos: command}}\n"
    )
    path = tmp_path / "relay.yaml"
    path.write_text(text, encoding="utf-8")
    assert load(path).diagnostics == []


def test_a_renamed_variable_is_reported_where_it_is_used(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "system: part\nvariables: {begin: 10}\n"
        'nodes: {motor: {timers: {tick: {rate_hz: "${start}", log: tick}}}}\n',
        encoding="utf-8",
    )
    text = "system: demo\ninclude: [{file: part.yaml, variables: {start: 20}}]\n"
    [found] = diagnostics_in(text, tmp_path)
    assert (found.rule.name, found.primary.file.path) == ("unknown-variable", "part.yaml")


def test_a_misspelled_key_does_not_make_profiles_different(tmp_path: Path) -> None:
    scan = "qos_profiles: {scan: {extends: sensor_data, %s: 100}}\n"
    port = "{type: std_msgs/msg/String, qos: scan, external: true}"
    (tmp_path / "part.yaml").write_text(
        f"system: part\n{scan % 'deadline_ms'}nodes: {{a: {{publishers: {{scan: {port}}}}}}}\n",
        encoding="utf-8",
    )
    text = (
        f"system: demo\ninclude: [part.yaml]\n{scan % 'deadline'}"
        f"nodes: {{b: {{publishers: {{other: {port}}}}}}}\n"
    )
    assert rules_broken(text, tmp_path) == ["unknown-key"]


def test_two_includes_with_one_prefix_are_reported_at_the_second_prefix(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "system: part\nnodes: {motor: {on_activate: {log: started}}}\n", encoding="utf-8"
    )
    text = (
        "system: demo\ninclude:\n  - {file: part.yaml, prefix: a_}\n"
        "  - file: part.yaml\n    prefix: a_\n"
    )
    [found] = diagnostics_in(text, tmp_path)
    assert (found.rule.name, found.primary.line) == ("duplicate-name", 5)


def test_a_renamed_field_is_reported_once_with_all_its_uses(tmp_path: Path) -> None:
    folder = tmp_path / "interfaces" / "demo_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Zone.msg").write_text("string area\n", encoding="utf-8")
    (folder.parent / "package.xml").write_text(
        "<package><name>demo_msgs</name></package>", encoding="utf-8"
    )
    (tmp_path / "composer.yaml").write_text("interfaces: [interfaces]\n", encoding="utf-8")
    port = "type: demo_msgs/msg/Zone, qos: state, external: true"
    log = 'log: "{message.zone}", when: message.zone != ""'
    text = system(f"a: {{subscriptions: {{zone: {{{port}, {log}}}}}}}")
    [found] = diagnostics_in(text, tmp_path)
    assert found.message == "demo_msgs/msg/Zone has no field 'zone'"
    assert [label.message for label in found.related] == ["here too"]


def test_without_a_folder_of_interfaces_their_types_are_not_reported(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("interfaces: [messages]\n", encoding="utf-8")
    text = system("a: {publishers: {z: {type: demo_msgs/msg/Zone, qos: state, external: true}}}")
    assert rules_broken(text, tmp_path) == ["bad-setting"]


def test_a_port_in_the_wrong_section_is_reported_where_it_is_used(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "user.yaml").write_text(
        "node: user\nservices: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}\n"
        "timers: {tick: {period_ms: 100, call: {ask: {}}}}\n",
        encoding="utf-8",
    )
    (tmp_path / "system.yaml").write_text(
        system(
            "server: {services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}}",
            "user: {type: user}",
            connections=("{service: /ask, server: server.ask, clients: user.ask}",),
        ),
        encoding="utf-8",
    )
    paths = [tmp_path / "system.yaml", tmp_path / "nodes" / "user.yaml"]
    found = collect_diagnostics([load(path) for path in paths])
    assert [item.rule.name for item in found] == ["wrong-port-kind", "wrong-port-kind"]


PART = """\
system: part
variables: {unit: a}
nodes:
  driver:
    publishers: {odom: {type: std_msgs/msg/String, qos: command, required: false}}
    services: {stop: {type: std_srvs/srv/Trigger, external: true, respond: {}}}
    timers: {tick: {period_ms: 100, publish: {odom: {data: "${unit}"}}}}
"""
FLEET = """\
system: fleet
include:
  - {file: part.yaml, for_each: {unit: [a, b]}, prefix: "${unit}_", namespace: "${unit}",
     variables: {unit: "${unit}"}}
nodes:
  monitor:
    subscriptions:
      a: {type: std_msgs/msg/String, qos: command, log: a}
      b: {type: std_msgs/msg/String, qos: command, log: b}
connections:
  - {topic: "${unit}/odom", for_each: {unit: [a, b]}, from: "${unit}_driver.odom",
     to: "monitor.${unit}"}
"""


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        ("{unit: [a, b]}, prefix", "{unit: [a, b, a]}, prefix", "duplicate-name", "a"),
        ("{unit: [a, b]}, from", "{unit: [a, b, b]}, from", "duplicate-name", "b"),
        ("[a, b]}, prefix", "[a, b, 3c]}, prefix", "invalid-include", "3c"),
        ("[a, b]}, from", "[a, b, c]}, from", "unknown-node", "${unit}_driver.odom"),
        ('namespace: "${unit}"', 'namespace: "${unti}"', "unknown-variable", "${unti}"),
        # durability: the file of the system is wrong, not the included one
        ("b: {type: std_msgs/msg/String, qos: command", "b: {type: std_msgs/msg/String, qos: state",
         "qos-incompatible", "state"),
    ],
)  # fmt: skip
def test_a_wrong_value_of_a_loop_is_reported_once(
    old: str, new: str, rule: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / "part.yaml").write_text(PART, encoding="utf-8")
    assert diagnostics_in(FLEET, tmp_path) == []
    [found] = diagnostics_in(FLEET.replace(old, new), tmp_path)
    assert (found.rule.name, found.primary.text) == (rule, text)


def test_a_type_that_contradicts_the_class_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "camera.py").write_text(
        "from rclpy.node import Node\nfrom std_msgs.msg import String\n\n\nclass Camera(Node):\n"
        "    def __init__(self):\n        super().__init__('camera')\n"
        "        self.create_publisher(String, 'text', 10)\n",
        encoding="utf-8",
    )
    text = system(
        "camera: {class: 'camera:Camera', publishers: {text: {type: std_msgs/msg/Int32}}}",
        "sink: {subscriptions: {text: {type: std_msgs/msg/String, log: a}}}",
    )
    assert "class-port" in rules_broken(text, tmp_path)
    assert "type-mismatch" not in rules_broken(text, tmp_path)

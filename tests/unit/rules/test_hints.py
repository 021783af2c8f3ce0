"""Hints: following them must fix the problem and not cause another one."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from tests.unit.support.checking import diagnostics_in, load_project

SCAN = "type: sensor_msgs/msg/LaserScan"
SENSOR = "'qos: sensor_data'"
SERVER = "type: std_srvs/srv/Trigger, respond: {success: true}, service: ~/ask"
LIDAR = f"""\
nodes:
  lidar:
    publishers: {{scan: {{{SCAN}, topic: /scan, qos: command, external: true}}}}
    timers: {{tick: {{rate_hz: 30, publish: {{scan: {{}}}}}}}}
"""
RELIABLE = f"""{LIDAR.replace(", external: true", "")}  map:
    subscriptions: {{scan: {{{SCAN}, topic: /scan, qos: command, log: x}}}}
"""
CHAIN = """\
nodes:
  camera: {publishers: {image: {type: std_msgs/msg/String, topic: /image, qos: sensor_data}}}
  viewer:
    subscriptions:
      image: {type: std_msgs/msg/String, topic: /image, qos: sensor_data%s}
    publishers: {out: {type: std_msgs/msg/String, qos: command, external: true}}%s
chains: {all: {through: [camera.image, viewer.out], latency_ms: 5}}
"""
#: A file, and the rules and hints of all its diagnostics.
HINTS: list[tuple[str, list[str]]] = [
    (
        "nodes: {a-b: {}, a b: {}, a_b: {}}",
        ["invalid-name: rename it to 'a_b_2'", "invalid-name: rename it to 'a_b_3'"],
    ),
    ("nodes: {n: {parameters: {a-b: 1, a_b: 1}}}", ["invalid-name: rename it to 'a_b_2'"]),
    (
        "nodes: {'n_${i}': {for_each: {i: [1, 1]}, on_activate: {log: hello}}}",
        ["duplicate-name: give 'for_each' values that make the names different"],
    ),
    (
        "nodes: {'n_${i}': {for_each: {i: [1, 2], j: [1, 2]}, on_activate: {log: 'to ${j}'}}}",
        ["duplicate-name: make the names unique: 'n_${i}_${j}'"],
    ),
    (
        f"nodes: {{a: {{services: {{b: {{{SERVER}}}, ask: {{{SERVER}}}}}}}}}",
        ["duplicate-server: rename one of them"],
    ),
    ("nodes: {n: {behavior: lift.Lift}}", ["class-missing: did you mean 'lift:Lift'?"]),
    ("nodes: {n: {behavior: 'lift:'}}", ["class-missing: write 'module:Class'"]),
    (
        "executors: {io: {threads: 4}}\nnodes: {n: {executor: io, on_activate: {log: hello}}}",
        ["executor-settings: add 'kind: multi_threaded', or remove 'threads'"],
    ),
    (
        CHAIN % (", budget_ms: 20, publish: {out: '{message}'}", ""),
        ["impossible-chain: use shorter budgets, or allow a higher latency"],
    ),
    (
        CHAIN % (", log: x", "\n    timers: {t: {period_ms: 50, publish: {out: {data: x}}}}"),
        ["impossible-chain: publish from the subscription, or use shorter timer periods"],
    ),
    (
        RELIABLE,
        [f"unsuited-qos: use {SENSOR} for it and for the subscriptions that request reliable QoS"],
    ),
    (
        LIDAR,
        [f"unsuited-qos: let subscriptions use {SENSOR}; a reliable publisher serves them too"],
    ),
    # Consumers request joint states reliably.
    (LIDAR.replace("LaserScan", "JointState"), []),
    (
        "include:\n  - {file: other.yaml, for_each: {bay: [north, south]}, prefix: '${bay}_', "
        "arguments: {zone: '${side}'}}",
        ["invalid-include: None", "unknown-variable: 'for_each' sets 'bay'"],
    ),
    (
        "nodes: {n: {type: relay, variables: {kind: std_msgs/msg/String}}}",
        ["unknown-variable: did you mean 'message_type'?"],
    ),
]


@pytest.mark.parametrize(("text", "hints"), HINTS)
def test_hint(tmp_path: Path, text: str, hints: list[str]) -> None:
    found = diagnostics_in(f"system: demo\n{text}\n", tmp_path)
    assert [f"{item.rule.name}: {item.hint}" for item in found] == hints
    if text is RELIABLE:
        labels = [(label.message, label.span.line) for label in found[0].related]
        assert labels == [("'map.scan' requests it", 7)]


def test_definitions_without_a_package_xml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = "{type: x_msgs/msg/State, qos: state, external: true}"
    files = {
        "systems/x.yaml": f"system: x\nnodes: {{n: {{publishers: {{out: {port}}}}}}}\n",
        "interfaces/x_msgs/msg/State.msg": "bool ok\n",
    }
    monkeypatch.chdir(tmp_path)
    diagnostics = load_project(tmp_path, files).diagnostics
    hints = [item.hint for item in diagnostics if item.rule.name == "unknown-interface"]
    assert hints == ["'interfaces/x_msgs' has no package.xml: add one that names 'x_msgs'"]


@pytest.mark.parametrize(
    "node",
    [
        *(
            f"publishers: {{out: {{type: {package}/msg/State, qos: state, external: true}}}}"
            for package in ("y" * 3000, "y/" * 1500, "Y" * 150)
        ),
        f"behavior: '{'9' * 3000}:Driver'",
    ],
    ids=["package", "parts", "capitals", "module"],
)
def test_hints_about_long_names_are_short(tmp_path: Path, node: str) -> None:
    text = f"system: x\nnodes: {{n: {{{node}}}}}\n"
    errors = [item for item in diagnostics_in(text, tmp_path) if item.severity is Severity.ERROR]
    assert 0 < max(len(str(item.hint)) for item in errors) < 400


@pytest.mark.parametrize(("wrong", "meant"), [("publisherz", "publishers"), ("lgo", "log")])
def test_a_misspelt_attribute_of_a_behavior(tmp_path: Path, wrong: str, meant: str) -> None:
    code = "class Counter:\n    def on_tick(self):\n        self.log.info('x'); self.%s.x.y()\n"
    text = 'system: x\nnodes: {n: {behavior: "code:Counter", timers: {tick: {rate_hz: 1}}}}\n'
    diagnostics = load_project(tmp_path, {"x.yaml": text, "code.py": code % wrong}).diagnostics
    [found] = [item for item in diagnostics if item.rule.name[:7] == "missing"]
    assert found.hint == f"did you mean '{meant}'?"

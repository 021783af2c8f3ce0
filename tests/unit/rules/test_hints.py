"""Hints: following them must fix the problem and not cause another one."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from composer.loading import load
from tests.unit.support.checking import diagnostics_in

SCAN = "type: sensor_msgs/msg/LaserScan"
SERVER = "type: std_srvs/srv/Trigger, respond: {success: true}"
LIDAR = f"""\
system: demo
nodes:
  lidar:
    publishers: {{scan: {{{SCAN}, topic: /scan, qos: command, external: true}}}}
    timers: {{tick: {{rate_hz: 30, publish: {{scan: {{}}}}}}}}
"""
CHAIN = """\
system: demo
nodes:
  camera: {publishers: {image: {type: std_msgs/msg/String, topic: /image, qos: sensor_data}}}
  viewer:
    subscriptions:
      image: {type: std_msgs/msg/String, topic: /image, qos: sensor_data%s}
    publishers: {out: {type: std_msgs/msg/String, qos: command, external: true}}%s
chains: {all: {through: [camera.image, viewer.out], latency_ms: 5}}
"""
HINTS: dict[str, tuple[str, str, list[str | None]]] = {
    "node names that would become equal": (
        "system: demo\nnodes: {a-b: {}, a b: {}, a_b: {}}\n",
        "invalid-name",
        ["rename it to 'a_b_2'", "rename it to 'a_b_3'"],
    ),
    "parameter names that would become equal": (
        "system: demo\nnodes: {n: {parameters: {a-b: {type: bool}, a_b: {type: bool}}}}\n",
        "invalid-name",
        ["rename it to 'a_b_2'"],
    ),
    "copies whose names have all variables": (
        "system: demo\nnodes: {'n_${i}': {for_each: {i: [1, 1]}, on_activate: {log: hello}}}\n",
        "duplicate-name",
        ["give 'for_each' values that make the names different"],
    ),
    "copies whose names have some variables": (
        "system: demo\n"
        "nodes: {'n_${i}': {for_each: {i: [1, 2], j: [1, 2]}, on_activate: {log: '${j}'}}}\n",
        "duplicate-name",
        ["make the names unique: 'n_${i}_${j}'"],
    ),
    "a server with the private name already": (
        f"system: demo\nnodes: {{a: {{services: {{b: {{{SERVER}, service: ~/ask}}, "
        f"ask: {{{SERVER}, service: ~/ask}}}}}}}}\n",
        "duplicate-server",
        ["rename one of them"],
    ),
    "a behavior with a dot instead of a colon": (
        "system: demo\nnodes: {n: {behavior: lift.Lift}}\n",
        "class-missing",
        ["did you mean 'lift:Lift'?"],
    ),
    "a behavior without a class": (
        "system: demo\nnodes: {n: {behavior: 'lift:'}}\n",
        "class-missing",
        ["write 'module:Class'"],
    ),
    "threads of an executor that has one": (
        "system: demo\nexecutors: {io: {threads: 4}}\n"
        "nodes: {n: {executor: io, on_activate: {log: hello}}}\n",
        "executor-settings",
        ["add 'kind: multi_threaded', or remove 'threads'"],
    ),
    "a chain without timers": (
        CHAIN % (", budget_ms: 20, publish: {out: '{message}'}", ""),
        "impossible-chain",
        ["use shorter budgets, or allow a higher latency"],
    ),
    "a chain with a timer": (
        CHAIN % (", log: x", "\n    timers: {t: {period_ms: 50, publish: {out: {data: x}}}}"),
        "impossible-chain",
        ["publish from the subscription, or use shorter timer periods"],
    ),
    "sensor data with a reliable subscription": (
        f"{LIDAR.replace(', external: true', '')}  map:\n"
        f"    subscriptions: {{scan: {{{SCAN}, topic: /scan, qos: command, log: x}}}}\n",
        "unsuited-qos",
        ["use 'qos: sensor_data' for it and for the subscriptions that request reliable QoS"],
    ),
    "sensor data for external nodes": (
        LIDAR,
        "unsuited-qos",
        ["let subscriptions use 'qos: sensor_data'; a reliable publisher serves them too"],
    ),
    "joint states, which consumers request reliably": (
        LIDAR.replace("LaserScan", "JointState"),
        "unsuited-qos",
        [],
    ),
    "a variable of an include with for_each": (
        "system: demo\ninclude:\n  - {file: other.yaml, for_each: {bay: [north, south]}, "
        "prefix: '${bay}_', arguments: {zone: '${side}'}}\n",
        "unknown-variable",
        ["'for_each' sets 'bay'"],
    ),
    "a variable of a node type under another name": (
        "system: demo\nnodes: {n: {type: relay, variables: {kind: std_msgs/msg/String}}}\n",
        "unknown-variable",
        ["did you mean 'message_type'?"],
    ),
}


@pytest.mark.parametrize(("text", "rule", "hints"), HINTS.values(), ids=HINTS)
def test_hint(tmp_path: Path, text: str, rule: str, hints: list[str | None]) -> None:
    found = [item for item in diagnostics_in(text, tmp_path) if item.rule.name == rule]
    assert [diagnostic.hint for diagnostic in found] == hints


def test_reliable_subscriptions_are_labeled(tmp_path: Path) -> None:
    text = HINTS["sensor data with a reliable subscription"][0]
    [diagnostic] = [
        item for item in diagnostics_in(text, tmp_path) if item.rule.name == "unsuited-qos"
    ]
    assert [(label.message, label.span.line) for label in diagnostic.related] == [
        ("'map.scan' requests it", 7)
    ]


def test_definitions_without_a_package_xml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "interfaces" / "x_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "interfaces" / "x_msgs" / "msg" / "State.msg").write_text("bool ok\n")
    (tmp_path / "systems").mkdir()
    path = tmp_path / "systems" / "x.yaml"
    path.write_text(
        "system: x\nnodes:\n  n:\n    publishers: "
        "{out: {type: x_msgs/msg/State, qos: state, external: true}}\n"
    )
    monkeypatch.chdir(tmp_path)
    hints = [d.hint for d in load(path).diagnostics if d.rule.name == "unknown-interface"]
    assert hints == ["'interfaces/x_msgs' has no package.xml: add one that names 'x_msgs'"]


@pytest.mark.parametrize("package", ["y" * 3000, "y/" * 1500, "Y" * 150])
def test_the_hint_about_an_unknown_type_is_short(tmp_path: Path, package: str) -> None:
    port = f"{{type: {package}/msg/State, qos: state, external: true}}"
    text = f"system: x\nnodes:\n  n:\n    publishers: {{out: {port}}}\n"
    hints = [
        item.hint for item in diagnostics_in(text, tmp_path) if item.severity is Severity.ERROR
    ]
    assert hints
    assert max(len(str(hint)) for hint in hints) < 400


@pytest.mark.parametrize(("wrong", "meant"), [("publisherz", "publishers"), ("lgo", "log")])
def test_a_misspelt_attribute_of_a_behavior(tmp_path: Path, wrong: str, meant: str) -> None:
    code = "class Counter:\n    def on_tick(self):\n        self.log.info('x'); self.%s.x.y()\n"
    (tmp_path / "code.py").write_text(code % wrong)
    text = 'system: x\nnodes: {n: {behavior: "code:Counter", timers: {tick: {rate_hz: 1}}}}\n'
    [found] = [item for item in diagnostics_in(text, tmp_path) if item.rule.name[:7] == "missing"]
    assert found.hint == f"did you mean '{meant}'?"

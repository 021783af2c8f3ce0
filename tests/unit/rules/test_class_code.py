"""Classes of rclpy: their parameters and ports, and what hosting refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from tests.unit.support.checking import diagnostics_of_each, load_project, quoted
from tests.unit.support.statements import Statements, diagnostics_of

CLASS = Statements.read("class")


def _found(tmp_path: Path, *codes: str) -> list[list[tuple[str, str]]]:
    results = diagnostics_of(CLASS.system, codes, tmp_path)
    return [[(item.rule.name, quoted(item)) for item in found] for found in results]


def test_a_constructor_calls_that_of_node_and_a_transition_gets_the_state(tmp_path: Path) -> None:
    code = CLASS.code_with()
    no_call = code.replace('super().__init__("robot")', "pass")
    no_state = code.replace("def on_activate(self, state)", "def on_activate(self)")
    first, second = _found(tmp_path, no_call, no_state)
    assert ("missing-constructor", "__init__") in first
    assert second == [("handler-signature", "on_activate")]


def test_functions_may_have_attributes(tmp_path: Path) -> None:
    code = CLASS.code_with("tick", "table.cache_clear()\nself.count_up.__func__")
    code += "@cache\ndef table(): return {}\n"
    assert _found(tmp_path, "from functools import cache\n" + code) == [[]]


RETURNED = {
    "on_reset": "return response",
    "on_goal": "return Fibonacci.Result(sequence=[1])",
    "on_activate": "return TransitionCallbackReturn.SUCCESS",
}


def test_a_callback_returns_a_result(tmp_path: Path) -> None:
    code = CLASS.code_with()
    codes = [
        code.replace(returned, text)
        for returned in RETURNED.values()
        for text in ("pass", f"if self.count:\n            {returned}")
    ]
    expected = [[("missing-return", method)] for method in RETURNED for _ in range(2)]
    assert _found(tmp_path, *codes) == expected


DECLARING = """\
from rclpy.node import Node
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from std_msgs.msg import String


class Declaring(Node):
    def __init__(self):
        super().__init__("declaring")
        self.declare_parameter("offset", -1.5)
        self.declare_parameter("gains", [1.0, 2.0])
        self.declare_parameter("any", 1, ParameterDescriptor(dynamic_typing=True))
        self.declare_parameters("arm", [("length", 1.0)])
        self.create_publisher(String, "~/text", 10)
        self.create_subscription(String, "scan", print, qos_profile_sensor_data)
        fast = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(String, "fast", print, fast)
        self.create_subscription(String, "any", print, self.chosen())
        self.create_service(self.text_type, "text", self.on_text)
"""


PUBLISHED = "publishers: {text: {type: std_msgs/msg/String, topic: ~/text%s}}"


#: Lines of a node, and whether one contradicts its class.
DECLARED: list[tuple[str, list[str]]] = [
    ("parameters: {offset: {type: double, default: 1.0}}", []),
    ("parameters: {offset: {type: integer, default: 1}}", ["class-parameter"]),
    ("parameters: {gains: {type: double_array, default: [1.0]}}", []),
    ("parameters: {gains: {type: double, default: 1.0}}", ["class-parameter"]),
    ("parameters: {any: {type: string, default: a}}", []),
    ("parameters: {arm.length: {type: double, default: 1.0}}", []),
    ("parameters: {length: {type: double, default: 1.0}}", ["class-parameter"]),
    ("parameters: {use_sim_time: {type: bool, default: true}}", []),
    ("publishers: {text: {type: std_msgs/msg/Int32, topic: ~/text}}", ["class-port"]),
    ("publishers: {text: {type: std_msgs/msg/Int32, topic: text}}", []),
    (PUBLISHED % "", []),
    (PUBLISHED % ", qos: command", []),
    (PUBLISHED % ", qos: {extends: command, lifespan_ms: 100}", []),
    (PUBLISHED % ", qos: {extends: command, depth: 1}", []),
    (PUBLISHED % ", qos: {extends: command, deadline_ms: 100}", ["class-port"]),
    (PUBLISHED % ", qos: state", ["class-port"]),
    ("subscriptions: {scan: {type: std_msgs/msg/String, qos: sensor_data}}", []),
    ("subscriptions: {scan: {type: std_msgs/msg/String, qos: command}}", ["class-port"]),
    ("subscriptions: {fast: {type: std_msgs/msg/String, qos: state}}", ["class-port"]),
    ("subscriptions: {any: {type: std_msgs/msg/String, qos: state}}", []),
]


def test_parameters_and_ports_agree_with_the_class(tmp_path: Path) -> None:
    system = "system: a\nnodes:\n  n:\n    class: declaring:Declaring\n    %s\n"
    projects = [{"system.yaml": system % line, "declaring.py": DECLARING} for line, _ in DECLARED]
    rules = {"class-parameter", "class-port"}
    results = [
        (line, [item.rule.name for item in found if item.rule.name in rules])
        for (line, _), found in zip(DECLARED, diagnostics_of_each(projects, tmp_path), strict=True)
    ]
    assert results == DECLARED


@pytest.mark.parametrize(
    ("qos", "severity"), [("sensor_data", Severity.INFO), ("state", Severity.WARNING)]
)
def test_another_qos_and_the_other_end(qos: str, severity: Severity, tmp_path: Path) -> None:
    port = f"type: std_msgs/msg/String, topic: /text, qos: {qos}"
    system = (
        "system: a\nnodes:\n"
        f"  n: {{class: declaring:Declaring, publishers: {{text: {{{port}}}}}}}\n"
        f"  other: {{subscriptions: {{text: {{{port}, log: message}}}}}}\n"
    )
    files = {"a.yaml": system, "declaring.py": DECLARING.replace('"~/text"', '"/text"')}
    diagnostics = load_project(tmp_path, files).diagnostics
    assert [item.severity for item in diagnostics if item.rule.code == "RC487"] == [severity]


HOSTED = """\
import rclpy
from rclpy.node import Node


class Robot(Node):
    def __init__(self, *, spins=False, cli_args=None):
        {init}
"""
ERROR, WARNING = [Severity.ERROR], [Severity.WARNING]
#: Constructors, and the severities of the reports about them.
REFUSED = [
    ('super().__init__("r", cli_args=["-r"])', ERROR),
    ('super().__init__("r", cli_args=cli_args)', []),
    ('super().__init__("r", cli_args=None)', []),
    ('super().__init__("r")\n        rclpy.spin(self)', ERROR),
    ('super().__init__("r")\n        if spins:\n            rclpy.spin(self)', WARNING),
    ('super().__init__("r")\n        self.x = rclpy.create_node("x")', ERROR),
    ('super().__init__("r")\n        self.x = spins and rclpy.create_node("x")', WARNING),
]


def test_only_what_hosting_surely_refuses_is_an_error(tmp_path: Path) -> None:
    codes = [HOSTED.format(init=init) for init, _ in REFUSED]
    results = diagnostics_of(CLASS.system, codes, tmp_path)
    for case, found in zip(REFUSED, results, strict=True):
        assert [item.rule.severity for item in found] == case[1], case
    assert {item.rule.name for found in results for item in found} == {"unsupported-class"}

"""Classes of rclpy: their parameters and ports, and what hosting refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from tests.unit.support.checking import diagnostics_in, diagnostics_of_each, quoted
from tests.unit.support.statements import Statements, diagnostics_of

CLASS = Statements.read("class")


def _found(tmp_path: Path, *codes: str) -> list[list[tuple[str, str]]]:
    results = diagnostics_of(CLASS.system, codes, tmp_path)
    return [[(item.rule.name, quoted(item)) for item in found] for found in results]


def test_a_constructor_calls_that_of_node(tmp_path: Path) -> None:
    code = CLASS.code_with().replace('super().__init__("robot")', "pass")
    assert ("missing-constructor", "__init__") in _found(tmp_path, code)[0]


def test_functions_may_have_attributes(tmp_path: Path) -> None:
    code = CLASS.code_with("tick", "table.cache_clear()\nself.count_up.__func__")
    code += "@cache\ndef table(): return {}\n"
    assert _found(tmp_path, "from functools import cache\n" + code) == [[]]


@pytest.mark.parametrize(
    ("returned", "method"),
    [
        ("return response", "on_reset"),
        ("return Fibonacci.Result(sequence=[1])", "on_goal"),
        ("return TransitionCallbackReturn.SUCCESS", "on_activate"),
    ],
)
def test_a_callback_returns_a_result(returned: str, method: str, tmp_path: Path) -> None:
    code = CLASS.code_with()
    codes = [
        code.replace(returned, text) for text in ("pass", "if self.count:\n            " + returned)
    ]
    for [item] in diagnostics_of(CLASS.system, codes, tmp_path):
        assert (item.rule.name, quoted(item)) == ("missing-return", method)


def test_a_transition_gets_the_state(tmp_path: Path) -> None:
    code = CLASS.code_with().replace("def on_activate(self, state)", "def on_activate(self)")
    assert _found(tmp_path, code) == [[("handler-signature", "on_activate")]]


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


PUBLISHED = (
    "publishers: {text: {type: std_msgs/msg/String, topic: ~/text, qos: %s, external: true}}"
)


#: Lines of a node, and the rules about its class that they break.
DECLARED: list[tuple[str, list[str]]] = [
    ("parameters: {offset: {type: double, default: 1.0}}", []),
    ("parameters: {offset: {type: integer, default: 1}}", ["class-parameter"]),
    ("parameters: {gains: {type: double_array, default: [1.0]}}", []),
    ("parameters: {gains: {type: double, default: 1.0}}", ["class-parameter"]),
    ("parameters: {any: {type: string, default: a}}", []),
    ("parameters: {arm.length: {type: double, default: 1.0}}", []),
    ("parameters: {length: {type: double, default: 1.0}}", ["class-parameter"]),
    ("parameters: {use_sim_time: {type: bool, default: true}}", []),
    ("publishers: {text: {type: std_msgs/msg/String, topic: ~/text, external: true}}", []),
    ("publishers: {text: {type: std_msgs/msg/Int32, topic: ~/text, external: true}}",
     ["class-port"]),
    ("publishers: {text: {type: std_msgs/msg/Int32, topic: text, external: true}}", []),
    (PUBLISHED % "command", []),
    (PUBLISHED % "{extends: command, lifespan_ms: 100}", []),
    (PUBLISHED % "{extends: command, depth: 1}", []),
    (PUBLISHED % "{extends: command, deadline_ms: 100}", ["class-port"]),
    (PUBLISHED % "state", ["class-port"]),
    ("subscriptions: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}",
     []),
    ("subscriptions: {scan: {type: std_msgs/msg/String, qos: command, external: true}}",
     ["class-port"]),
    ("subscriptions: {fast: {type: std_msgs/msg/String, qos: state, external: true}}",
     ["class-port"]),
    ("subscriptions: {any: {type: std_msgs/msg/String, qos: state, external: true}}", []),
]  # fmt: skip


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
def test_another_qos_is_a_warning_if_another_end_does_not_match(
    qos: str, severity: Severity, tmp_path: Path
) -> None:
    port = f"type: std_msgs/msg/String, topic: /text, qos: {qos}"
    system = (
        "system: a\nnodes:\n  n:\n    class: declaring:Declaring\n    publishers:\n"
        f"      text: {{{port}}}\n"
        "  other:\n    subscriptions:\n"
        f"      text: {{{port}, log: message}}\n"
    )
    code = DECLARING.replace('"~/text"', '"/text"')
    (tmp_path / "declaring.py").write_text(code, encoding="utf-8")
    found = [item for item in diagnostics_in(system, tmp_path) if item.rule.code == "RC487"]
    assert [item.rule.severity for item in found] == [severity]


HOSTED = """\
import rclpy
from rclpy.node import Node


class Robot(Node):
    def __init__(self, *, spins=False, cli_args=None):
        {init}
"""
REFUSED = [
    ('super().__init__("r", cli_args=["-r"])', [Severity.ERROR]),
    ('super().__init__("r", cli_args=cli_args)', []),
    ('super().__init__("r", cli_args=None)', []),
    ('super().__init__("r")\n        rclpy.spin(self)', [Severity.ERROR]),
    (
        'super().__init__("r")\n        if spins:\n            rclpy.spin(self)',
        [Severity.WARNING],
    ),
    ('super().__init__("r")\n        self.x = rclpy.create_node("x")', [Severity.ERROR]),
    (
        'super().__init__("r")\n        self.x = spins and rclpy.create_node("x")',
        [Severity.WARNING],
    ),
]


def test_only_what_hosting_surely_refuses_is_an_error(tmp_path: Path) -> None:
    codes = [HOSTED.format(init=init) for init, _ in REFUSED]
    results = diagnostics_of(CLASS.system, codes, tmp_path)
    severities = [[item.rule.severity for item in found] for found in results]
    assert list(zip(codes, severities, strict=True)) == [
        (HOSTED.format(init=init), expected) for init, expected in REFUSED
    ]
    assert {item.rule.name for found in results for item in found} == {"unsupported-class"}


ALTERNATIVES = """\
import os

from rclpy.node import Node

OLD = os.environ.get("ROS_DISTRO", "humble") == "humble"
if OLD:
    from geometry_msgs.msg import Twist as Command
else:
    from geometry_msgs.msg import TwistStamped as Command


class Robot(Node):
    def __init__(self):
        super().__init__("robot")
        self.commands = self.create_publisher(Command, "cmd_vel", 10)

    def send(self):
        command = Command()
        if OLD:
            command.linear.x = 0.1
        else:
            command.twist.linear.x = 0.1
        self.commands.publish(command)
"""


def test_alternative_messages_are_not_checked(tmp_path: Path) -> None:
    assert _found(tmp_path, ALTERNATIVES) == [[("not-checked", "Twist")]]

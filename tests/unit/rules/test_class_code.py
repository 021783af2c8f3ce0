"""Mistakes in the code of classes of rclpy, and code that is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity, has_errors
from tests.unit.support.checking import diagnostics_in, quoted
from tests.unit.support.python_cases import diagnostics_of

SYSTEM = "system: demo\nnodes:\n  robot: {class: code:Robot}\n"
CODE = """\
import time
from collections import defaultdict
from functools import partial

import rclpy
from example_interfaces.action import Fibonacci
from geometry_msgs.msg import PointStamped, Twist
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient, ActionServer, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.qos import HistoryPolicy, QoSPresetProfiles, QoSProfile, ReliabilityPolicy
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger


class Robot(LifecycleNode):
    def __init__(self):
        super().__init__("robot")
        self.declare_parameter("speed", 1.0)
        self.speed = self.get_parameter("speed").value
        self.last: Time | None = None
        self.count = 0
        self.texts = self.create_publisher(String, "texts", 10)
        self.create_subscription(PointStamped, "point", self.on_point, 10)
        self.create_service(Trigger, "reset", self.on_reset)
        self.create_timer(1.0, self.on_tick)
        ActionServer(self, Fibonacci, "count", self.on_goal, goal_callback=self.accept)
        ActionServer(self, Fibonacci, "typed", self.on_typed_goal)
        self.action = ActionClient(self, Fibonacci, "other")
        self.stop = self.create_client(SetBool, "stop")
        self.add_on_set_parameters_callback(self.on_parameters)
        {init}

    def on_point(self, message):
        {point}

    def on_reset(self, request, response):
        {reset}
        return response

    def on_tick(self):
        {tick}

    def accept(self, goal):
        {accept}
        return GoalResponse.ACCEPT

    def on_goal(self, goal_handle):
        {goal}
        goal_handle.succeed()
        return Fibonacci.Result(sequence=[1])

    def on_parameters(self, parameters):
        for parameter in parameters:
            self.speed = parameter.value
            {parameters}
        return SetParametersResult(successful=True)

    def on_stopped(self, future):
        {stopped}

    def halt(self):
        future = self.stop.call_async(SetBool.Request())
        future.add_done_callback(self.on_stopped)

    def turn(self):
        future = self.action.send_goal_async(Fibonacci.Goal())
        future.add_done_callback(self.on_accepted)

    def on_accepted(self, future):
        self.count = future.result().accepted

    def on_activate(self, state):
        {activate}
        return TransitionCallbackReturn.SUCCESS

    def on_typed_goal(self, goal_handle: ServerGoalHandle) -> Fibonacci.Result:
        {typed_goal}
        return Fibonacci.Result()

    def add(self, number):
        self.count += number

    def count_up(self):
        self.count += 1

    async def run(self):
        return self.count
"""
PLACES = ("init", "point", "reset", "tick", "accept", "goal", "stopped", "parameters", "activate")
PLACES += ("typed_goal",)

#: The place of a statement, the statement, the rule it breaks, and the text that is underlined.
MISTAKES = [
    ("init", "self.create_publisher(String, 'x')", "call-arguments", "(String, 'x')"),
    ("init", "self.create_publisher('x', String, 10)", "call-arguments", "'x'"),
    ("init", "self.create_publisher(String(), 'x', 10)", "call-arguments", "String()"),
    ("init", "self.create_publisher(String, 'x', 'sensor')", "call-arguments", "'sensor'"),
    (
        "init",
        "self.create_publisher(String, 'x', QoSPresetProfiles.SENSOR_DATA)",
        "call-arguments",
        "QoSPresetProfiles.SENSOR_DATA",
    ),
    ("init", "self.create_client(SetBool)", "call-arguments", "(SetBool)"),
    ("init", "self.create_timer(self.on_tick, 1.0)", "call-arguments", "self.on_tick"),
    ("init", "self.create_timer(1.0, self.count_up())", "handler-signature", "self.count_up()"),
    ("init", "self.create_timer(1.0, callback=self.run())", "handler-signature", "self.run()"),
    ("init", "self.create_timer(1.0, self.on_tik)", "missing-attribute", "on_tik"),
    (
        "init",
        "self.create_service(SetBool, 'x', lambda request: None)",
        "call-arguments",
        "lambda request: None",
    ),
    (
        "init",
        "self.create_subscription(String, 'x', qos_profile_sensor_data, self.on_tick)",
        "call-arguments",
        "qos_profile_sensor_data",
    ),
    (
        "init",
        "self.create_subscription(String, 'x', self.count_up, 10)",
        "call-arguments",
        "self.count_up",
    ),
    ("init", "ActionServer(self, Fibonacci, 'x')", "call-arguments", "(self, Fibonacci, 'x')"),
    (
        "init",
        "QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST)",
        "missing-attribute",
        "BEST",
    ),
    ("init", "self.get_parameter('sped')", "undeclared-parameter", "'sped'"),
    ("init", "self.get_parameter('speed').get_parameter_value().double", "unknown-field", "double"),
    ("init", "self.logger().info('x')", "missing-attribute", "logger"),
    ("init", "self.get_logger().warm('x')", "missing-attribute", "warm"),
    ("init", "self.get_logger().info(5)", "call-arguments", "5"),
    ("init", "self.texts.publish(5)", "call-arguments", "5"),
    ("init", "self.texts.publish(Twist())", "call-arguments", "Twist()"),
    ("init", "self.texts.publish(String)", "call-arguments", "String"),
    ("init", "self.text.publish(String())", "missing-attribute", "text"),
    (
        "init",
        "self.get_parameter('speed').get_parameter_value().floating_value",
        "unknown-field",
        "floating_value",
    ),
    ("init", "self.get_parameter('speed').bool_value", "missing-attribute", "bool_value"),
    ("parameters", "parameter.type", "missing-attribute", "type"),
    (
        "init",
        "QoSProfile(reliability=ReliabilityPolicy.RELIABLE)",
        "call-arguments",
        "QoSProfile(reliability=ReliabilityPolicy.RELIABLE)",
    ),
    ("point", "message.x", "unknown-field", "x"),
    ("point", "message.point[0]", "type-error", "message.point[0]"),
    ("reset", "response.ok = True", "unknown-field", "ok"),
    ("reset", "request.data", "unknown-field", "data"),
    ("accept", "goal.target", "unknown-field", "target"),
    ("accept", "return True", "call-arguments", "self.accept"),
    ("accept", "return GoalResponse.REJECTED", "missing-attribute", "REJECTED"),
    (
        "goal",
        "goal_handle.publish_feedback(Fibonacci.Result())",
        "call-arguments",
        "Fibonacci.Result()",
    ),
    ("goal", "goal_handle.request.size", "unknown-field", "size"),
    ("goal", "goal_handle.cancel()", "missing-attribute", "cancel"),
    ("stopped", "future.result().accepted", "unknown-field", "accepted"),
    ("typed_goal", "return Fibonacci.Feedback()", "missing-return", "Fibonacci.Feedback()"),
    (
        "tick",
        "async def halt():\n    await self.stop.call(SetBool.Request())",
        "type-error",
        "await self.stop.call(SetBool.Request())",
    ),
    ("activate", "return True", "missing-return", "True"),
    ("activate", "super().on_activate()", "call-arguments", "()"),
    ("tick", "self.stop.call_async(SetBool())", "call-arguments", "SetBool()"),
    (
        "tick",
        "future = self.stop.call_async(SetBool.Request())\nfuture.result().ok",
        "unknown-field",
        "ok",
    ),
    (
        "tick",
        "self.stop.call_async(SetBool.Request()).add_done_callback(self.count_up)",
        "call-arguments",
        "self.count_up",
    ),
    (
        "tick",
        "self.action.send_goal_async(Fibonacci.Goal()).result().canceled()",
        "missing-attribute",
        "canceled",
    ),
    ("tick", "now = self.get_clock().now()\nnow.seconds", "unknown-field", "seconds"),
    ("tick", "age = self.get_clock().now() - Time()\nage * 2.0", "type-error", "age * 2.0"),
    ("tick", "age = self.get_clock().now() - Time()\nage.seconds", "unknown-field", "seconds"),
    (
        "tick",
        "point = PointStamped()\npoint.header.stamp = self.get_clock().now()",
        "invalid-value",
        "self.get_clock().now()",
    ),
    ("tick", "Duration(1.0)", "call-arguments", "1.0"),
    ("tick", "time.sleep(Duration(seconds=1))", "call-arguments", "Duration(seconds=1)"),
    ("tick", "raise 'no'", "type-error", "'no'"),
    ("tick", "String() == 1", "unused-result", "String() == 1"),
    ("tick", "(Time() - Time()) > 2.0", "type-error", "(Time() - Time()) > 2.0"),
    (
        "init",
        "self.create_subscription(String, 'x', lambda m: print(m.text), 10)",
        "unknown-field",
        "text",
    ),
    ("init", "QoSProfile(depth=1, reliability='reliable')", "call-arguments", "'reliable'"),
    ("tick", "self.count_up.data", "missing-attribute", "data"),
    ("tick", "min([String()], key=lambda item: item.text)", "unknown-field", "text"),
    (
        "init",
        "self.create_timer(1.0, self.on_tick, callback_group=ReentrantCallbackGroup)",
        "call-arguments",
        "ReentrantCallbackGroup",
    ),
    (
        "goal",
        "def call(handle: ServerGoalHandle):\n    handle.target",
        "missing-attribute",
        "target",
    ),
    ("tick", "Time() + Time()", "type-error", "Time() + Time()"),
    ("tick", "Time() + 2.0", "type-error", "Time() + 2.0"),
    ("tick", "Time() - 'x'", "type-error", "Time() - 'x'"),
    ("tick", "Duration() - Duration()", "type-error", "Duration() - Duration()"),
    ("tick", "(Time() + Duration()).to_sec()", "unknown-field", "to_sec"),
    ("tick", "PointStamped(header=None)", "invalid-value", "None"),
    ("tick", "partial(self.add, numbr=1)", "call-arguments", "numbr"),
    ("tick", "partial(self.add, 1, 2)", "call-arguments", "2"),
]
RIGHT = [
    ("init", "self.create_publisher(msg_type=String, topic='x', qos_profile=QoSProfile(depth=1))"),
    ("init", "self.create_publisher(String, 'x', QoSPresetProfiles.SENSOR_DATA.value)"),
    ("init", "self.create_subscription(String, 'x', lambda message: None, 10)"),
    ("init", "self.create_subscription(String, 'x', lambda message, info: None, 10)"),
    ("init", "self.create_subscription(String, 'x', print, 10, raw=True)"),
    ("init", "self.create_timer(1, lambda: self.count_up())"),
    ("tick", "now = Time()\nif hasattr(now, 'sec'):\n    pass\nelse:\n    now.to_sec()"),
    ("init", "self.get_parameter('use_sim_time')"),
    ("init", "self.rate = self.get_parameter('speed').value * 2.0"),
    ("init", "self.get_logger().info('x', once=True)"),
    ("init", "self._parameters"),
    ("point", "stamp = Time.from_msg(message.header.stamp)\nstamp.nanoseconds"),
    ("point", "self.last = Time.from_msg(message.header.stamp)\nself.last < Time()"),
    ("point", "print(f'{message!r:>20} {None!s:>8}')"),
    ("goal", "if goal_handle.is_cancel_requested:\n    goal_handle.canceled()"),
    ("goal", "goal_handle.publish_feedback(Fibonacci.Feedback(sequence=[1]))"),
    (
        "tick",
        "request = SetBool.Request(data=True)\n"
        "self.stop.call_async(request).add_done_callback(self.on_stopped)",
    ),
    ("tick", "(self.get_clock().now() - Time()) > Duration(seconds=1)"),
    ("tick", "print(f'{self.count:>4} {self.get_name():10}')"),
    ("tick", "record = {'name': None, 'ok': False}\nrecord['name']['x']"),
    ("tick", "counts = defaultdict(int)\ncounts['x'] += 1"),
    ("tick", "'%s' % String()"),
    ("tick", "rclpy.spin_once(self)"),
    ("tick", "total = 0\nfor character in 'abc':\n    total ^= ord(character)"),
    ("init", "self.create_subscription(String, 'x', lambda m: print(m.data), 10)"),
    ("init", "QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)"),
    ("stopped", "if future.result().success:\n    self.count = 0"),
    ("init", "QoSProfile(history=HistoryPolicy.KEEP_ALL)"),
    ("init", "options = {'depth': 1}\nQoSProfile(**options)"),
    ("init", "self.create_publisher(String, 'x', 0)"),
    ("init", "self.create_timer(1.0, self.on_tick, callback_group=ReentrantCallbackGroup())"),
    ("init", "self.create_timer(1.0, self.on_tick, callback_group=None)"),
    ("typed_goal", "goal_handle.publish_feedback(Fibonacci.Feedback())"),
    ("tick", "(Time() + Duration()).seconds_nanoseconds()[1]\n(Duration() + Time()).nanoseconds"),
    ("tick", "((Time() - Duration()) - Time()).nanoseconds"),
    ("tick", "self.last = Time() - Duration()"),
    ("tick", "partial(self.add, number=1)\npartial(self.add)\npartial(print, 1, sep='')"),
]


def _code(place: str, statement: str) -> str:
    code = CODE
    for name in PLACES:
        text = statement.replace("\n", "\n        ") if name == place else "pass"
        code = code.replace("{" + name + "}", text)
    return code


def _found(tmp_path: Path, *codes: str) -> list[list[tuple[str, str]]]:
    results = diagnostics_of(SYSTEM, codes, tmp_path)
    return [[(item.rule.name, quoted(item)) for item in found] for found in results]


def test_each_mistake_is_reported_once_where_it_is(tmp_path: Path) -> None:
    found = _found(tmp_path, *(_code(place, statement) for place, statement, _, _ in MISTAKES))
    reported = [(*case[:2], *items) for case, items in zip(MISTAKES, found, strict=True)]
    assert reported == [
        (place, statement, (rule, text)) for place, statement, rule, text in MISTAKES
    ]


def test_right_code_is_not_reported(tmp_path: Path) -> None:
    found = _found(tmp_path, *(_code(place, statement) for place, statement in RIGHT))
    reported = zip(RIGHT, found, strict=True)
    assert [item for item in reported if item[1]] == []


def test_nothing_is_an_error(tmp_path: Path) -> None:
    codes = [_code(place, statement) for place, statement, _, _ in MISTAKES]
    results = diagnostics_of(SYSTEM, codes, tmp_path)
    assert not any(map(has_errors, results))


def test_a_constructor_calls_that_of_node(tmp_path: Path) -> None:
    code = _code("tick", "pass").replace('super().__init__("robot")', "pass")
    assert ("missing-constructor", "__init__") in _found(tmp_path, code)[0]


DECLARED_OTHERWISE = [
    "for name in ('a', 'b'):\n    self.declare_parameter(name, 1)\nself.get_parameter('a')",
    "if self.has_parameter('a'):\n    self.get_parameter('a')",
    "self.declare_parameters('', [('a', 1)])\nself.get_parameter('a')",
    "declare = self.declare_parameter\ndeclare('a', 1)\nself.get_parameter('a')",
    "try:\n    self.get_parameter('a')\nexcept ParameterNotDeclaredException:\n    pass",
]


def test_parameters_may_be_declared_in_other_ways(tmp_path: Path) -> None:
    codes = [_code("init", statement) for statement in DECLARED_OTHERWISE]
    assert _found(tmp_path, *codes) == [[]] * len(codes)


def test_functions_may_have_attributes(tmp_path: Path) -> None:
    code = _code("tick", "table.cache_clear()\nself.count_up.__func__")
    code += "@cache\ndef table(): return {}\n"
    assert _found(tmp_path, "from functools import cache\n" + code) == [[]]


@pytest.mark.parametrize(
    ("returned", "method", "hint"),
    [
        ("return response", "on_reset", "end it with 'return response'"),
        ("return Fibonacci.Result(sequence=[1])", "on_goal", "end it with 'return result'"),
        (
            "return TransitionCallbackReturn.SUCCESS",
            "on_activate",
            "end it with 'return TransitionCallbackReturn.SUCCESS'",
        ),
    ],
)
def test_a_callback_returns_a_result(returned: str, method: str, hint: str, tmp_path: Path) -> None:
    code = _code("tick", "pass")
    codes = [
        code.replace(returned, text) for text in ("pass", "if self.count:\n            " + returned)
    ]
    for [item] in diagnostics_of(SYSTEM, codes, tmp_path):
        assert (item.rule.name, quoted(item), item.hint) == ("missing-return", method, hint)


def test_a_transition_gets_the_state(tmp_path: Path) -> None:
    code = _code("tick", "pass").replace("def on_activate(self, state)", "def on_activate(self)")
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


@pytest.mark.parametrize(
    ("line", "rule"),
    [
        ("parameters: {offset: {type: double, default: 1.0}}", None),
        ("parameters: {offset: {type: integer, default: 1}}", "class-parameter"),
        ("parameters: {gains: {type: double_array, default: [1.0]}}", None),
        ("parameters: {gains: {type: double, default: 1.0}}", "class-parameter"),
        ("parameters: {any: {type: string, default: a}}", None),
        ("parameters: {arm.length: {type: double, default: 1.0}}", None),
        ("parameters: {length: {type: double, default: 1.0}}", "class-parameter"),
        ("parameters: {use_sim_time: {type: bool, default: true}}", None),
        ("publishers: {text: {type: std_msgs/msg/String, topic: ~/text, external: true}}", None),
        ("publishers: {text: {type: std_msgs/msg/Int32, topic: ~/text, external: true}}",
         "class-port"),
        ("publishers: {text: {type: std_msgs/msg/Int32, topic: text, external: true}}", None),
        (PUBLISHED % "command", None),
        (PUBLISHED % "{extends: command, lifespan_ms: 100}", None),
        (PUBLISHED % "{extends: command, depth: 1}", None),
        (PUBLISHED % "{extends: command, deadline_ms: 100}", "class-port"),
        (PUBLISHED % "state", "class-port"),
        ("subscriptions: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}",
         None),
        ("subscriptions: {scan: {type: std_msgs/msg/String, qos: command, external: true}}",
         "class-port"),
        ("subscriptions: {fast: {type: std_msgs/msg/String, qos: state, external: true}}",
         "class-port"),
        ("subscriptions: {any: {type: std_msgs/msg/String, qos: state, external: true}}", None),
    ],
)  # fmt: skip
def test_parameters_and_ports_agree_with_the_class(
    line: str, rule: str | None, tmp_path: Path
) -> None:
    (tmp_path / "declaring.py").write_text(DECLARING, encoding="utf-8")
    system = f"system: a\nnodes:\n  n:\n    class: declaring:Declaring\n    {line}\n"
    rules = {"class-parameter", "class-port"}
    found = [item.rule.name for item in diagnostics_in(system, tmp_path)]
    assert [name for name in found if name in rules] == ([rule] if rule is not None else [])


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
    ('super().__init__("r", cli_args=["-r"])', "unsupported-class", Severity.ERROR),
    ('super().__init__("r", cli_args=cli_args)', None, None),
    ('super().__init__("r", cli_args=None)', None, None),
    ('super().__init__("r")\n        rclpy.spin(self)', "unsupported-class", Severity.ERROR),
    (
        'super().__init__("r")\n        if spins:\n            rclpy.spin(self)',
        "unsupported-class",
        Severity.WARNING,
    ),
    (
        'super().__init__("r")\n        self.x = rclpy.create_node("x")',
        "unsupported-class",
        Severity.ERROR,
    ),
    (
        'super().__init__("r")\n        self.x = spins and rclpy.create_node("x")',
        "unsupported-class",
        Severity.WARNING,
    ),
]


@pytest.mark.parametrize(("init", "rule", "severity"), REFUSED)
def test_only_what_hosting_surely_refuses_is_an_error(
    init: str, rule: str | None, severity: Severity | None, tmp_path: Path
) -> None:
    (tmp_path / "code.py").write_text(HOSTED.format(init=init), encoding="utf-8")
    found = [(item.rule.name, item.rule.severity) for item in diagnostics_in(SYSTEM, tmp_path)]
    assert found == ([(rule, severity)] if rule is not None else [])


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

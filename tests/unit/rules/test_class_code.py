"""Mistakes in the code of classes of rclpy, and code that is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = "system: demo\nnodes: {robot: {class: 'robot_code:Robot'}}\n"
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
        return SetParametersResult(successful=True)

    def on_stopped(self, future):
        {stopped}

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
"""
PLACES = ("init", "point", "reset", "tick", "accept", "goal", "stopped", "activate", "typed_goal")

#: The statement, the place that it is in, the rule, and the text that is underlined.
MISTAKES = [
    # calls of rclpy
    ("init", "self.create_publisher(String, 'x')", "call-arguments", "self.create_publisher"),
    ("init", "self.create_publisher('x', String, 10)", "call-arguments", "'x'"),
    ("init", "self.create_publisher(String(), 'x', 10)", "call-arguments", "String()"),
    ("init", "self.create_publisher(Trigger, 'x', 10)", "call-arguments", "Trigger"),
    ("init", "self.create_publisher(String, 'x', 'sensor')", "call-arguments", "'sensor'"),
    ("init", "self.create_publisher(String, 'x', QoSPresetProfiles.SENSOR_DATA)", "call-arguments",
     "QoSPresetProfiles.SENSOR_DATA"),
    ("init", "self.create_client(SetBool)", "call-arguments", "self.create_client"),
    ("init", "self.create_timer(self.on_tick, 1.0)", "call-arguments", "self.on_tick"),
    ("init", "self.create_timer(1.0, self.count_up())", "call-arguments", "self.count_up()"),
    ("init", "self.create_timer(1.0, self.on_tik)", "unknown-attribute", "on_tik"),
    ("init", "self.create_service(SetBool, 'x', lambda request: None)", "handler-signature",
     "lambda request: None"),
    ("init", "self.create_subscription(String, 'x', qos_profile_sensor_data, self.on_tick)",
     "call-arguments", "qos_profile_sensor_data"),
    ("init", "self.create_subscription(String, 'x', self.count_up, 10)", "handler-signature",
     "count_up"),
    ("init", "ActionServer(self, Fibonacci, 'x')", "call-arguments", "ActionServer"),
    ("init", "QoSProfile(reliability=ReliabilityPolicy.BEST)", "unknown-attribute", "BEST"),
    ("init", "self.get_parameter('sped')", "undeclared-parameter", "'sped'"),
    ("init", "self.get_parameter('speed').get_parameter_value().double", "unknown-field", "double"),
    ("init", "self.logger().info('x')", "unknown-attribute", "logger"),
    ("init", "self.get_logger().warm('x')", "unknown-attribute", "warm"),
    ("init", "self.get_logger().info(5)", "call-arguments", "5"),
    ("init", "self.texts.publish(5)", "invalid-value", "5"),
    ("init", "self.texts.publish(Twist())", "invalid-value", "Twist()"),
    ("init", "self.texts.publish(String)", "invalid-value", "String"),
    ("init", "self.text.publish(String())", "unknown-attribute", "text"),
    # what callbacks get
    ("point", "message.x", "unknown-field", "x"),
    ("point", "self.count += message.point", "invalid-value", "message.point"),
    ("point", "1.0 - message", "invalid-value", "1.0 - message"),
    ("reset", "response.ok = True", "unknown-field", "ok"),
    ("reset", "response.message = 5", "invalid-value", "5"),
    ("reset", "request.data", "unknown-field", "data"),
    ("reset", "return", "missing-return", "return"),
    ("reset", "return True", "invalid-value", "True"),
    ("accept", "goal.target", "unknown-field", "target"),
    ("accept", "return True", "missing-return", "True"),
    ("accept", "return GoalResponse.REJECTED", "unknown-attribute", "REJECTED"),
    ("goal", "goal_handle.publish_feedback(Fibonacci.Result())", "invalid-value",
     "Fibonacci.Result()"),
    ("goal", "goal_handle.request.size", "unknown-field", "size"),
    ("goal", "goal_handle.cancel()", "unknown-attribute", "cancel"),
    ("goal", "return True", "invalid-value", "True"),
    ("activate", "return True", "missing-return", "True"),
    ("activate", "super().on_activate()", "call-arguments", "super().on_activate"),
    # futures
    ("tick", "self.stop.call_async(SetBool())", "invalid-value", "SetBool"),
    ("tick", "future = self.stop.call_async(SetBool.Request())\nfuture.result().ok",
     "unknown-field", "ok"),
    ("tick", "self.stop.call_async(SetBool.Request()).add_done_callback(self.count_up)",
     "handler-signature", "count_up"),
    ("tick", "self.action.send_goal_async(Fibonacci.Goal()).result().canceled()",
     "unknown-attribute", "canceled"),
    # time
    ("tick", "now = self.get_clock().now()\nnow.seconds", "unknown-attribute", "seconds"),
    ("tick", "age = self.get_clock().now() - Time()\nage * 2.0", "invalid-value", "age * 2.0"),
    ("tick", "age = self.get_clock().now() - Time()\nage.seconds", "unknown-attribute", "seconds"),
    ("tick", "point = PointStamped()\npoint.header.stamp = self.get_clock().now()", "invalid-value",
     "self.get_clock().now()"),
    ("tick", "if self.sent + 1:\n    self.sent = 1", "unknown-attribute", "sent"),
    ("tick", "Duration(1.0)", "call-arguments", "1.0"),
    ("tick", "time.sleep(Duration(seconds=1))", "invalid-value", "Duration(seconds=1)"),
    # Python
    ("tick", "'%s %s' % (1,)", "invalid-value", "'%s %s' % (1,)"),
    ("tick", "raise 'no'", "invalid-value", "'no'"),
    ("tick", "print(f'{String():.2f}')", "invalid-value", "String()"),
    ("tick", "numbers = {}\nnumbers[String()] = 1", "invalid-value", "String()"),
    ("tick", "sum([String()])", "invalid-value", "[String()]"),
    ("tick", "String() == 1", "invalid-value", "String() == 1"),
    ("tick", "name: str = self.get_parameter('speed')", "invalid-value",
     "self.get_parameter('speed')"),
    ("tick", "total = 0\nfor letter in 'abc':\n    total ^= letter", "invalid-value", "letter"),
    ("tick", "'%d %s' % len('x')", "invalid-value", "'%d %s' % len('x')"),
    ("tick", "(Time() - Time()) > 2.0", "invalid-value", "(Time() - Time()) > 2.0"),
    ("init", "self.create_subscription(String, 'x', lambda m: print(m.text), 10)", "unknown-field",
     "text"),
    ("init", "QoSProfile(reliability='reliable')", "call-arguments", "'reliable'"),
    ("tick", "self.count += 'x'", "invalid-value", "'x'"),
    ("tick", "self.count_up.data", "unknown-attribute", "data"),
    ("tick", "min([String()], key=lambda item: item.text)", "unknown-field", "text"),
    ("init", "QoSProfile(reliability=ReliabilityPolicy.RELIABLE)", "call-arguments", "QoSProfile"),
    ("init", "QoSProfile(history=HistoryPolicy.KEEP_LAST)", "call-arguments", "QoSProfile"),
    ("init", "self.create_publisher(String, 'x', -1)", "call-arguments", "-1"),
    ("init", "self.create_timer(1.0, self.on_tick, callback_group=ReentrantCallbackGroup)",
     "call-arguments", "ReentrantCallbackGroup"),
    ("goal", "def call(handle: ServerGoalHandle):\n    handle.target", "unknown-attribute",
     "target"),
    ("typed_goal", "goal_handle.publish_feedback(5)", "invalid-value", "5"),
    ("tick", "Time() + Time()", "invalid-value", "Time() + Time()"),
    ("tick", "Time() + 2.0", "invalid-value", "Time() + 2.0"),
    ("tick", "Time() - 'x'", "invalid-value", "Time() - 'x'"),
    ("tick", "Duration() - Duration()", "invalid-value", "Duration() - Duration()"),
    ("tick", "(Time() + Duration()).to_sec()", "unknown-attribute", "to_sec"),
    ("tick", "Time().seconds_nanoseconds()[2]", "invalid-value", "2"),
    ("tick", "PointStamped(header=None)", "invalid-value", "None"),
    ("tick", "text = String()\ntext.data = 'x' if self.count else None", "invalid-value", "None"),
    ("tick", "partial(self.add, numbr=1)", "call-arguments", "numbr"),
    ("tick", "partial(self.add, 1, 2)", "call-arguments", "2"),
]  # fmt: skip

#: Statements that are right, and the place that they are in.
RIGHT = [
    ("init", "self.create_publisher(msg_type=String, topic='x', qos_profile=QoSProfile(depth=1))"),
    ("init", "self.create_publisher(String, 'x', QoSPresetProfiles.SENSOR_DATA.value)"),
    ("init", "self.create_subscription(String, 'x', lambda message: None, 10)"),
    ("init", "self.create_subscription(String, 'x', lambda message, info: None, 10)"),
    ("init", "self.create_subscription(String, 'x', print, 10, raw=True)"),
    ("init", "self.create_timer(1, lambda: self.count_up())"),
    ("init", "self.get_parameter('use_sim_time')"),
    ("init", "self.rate = self.get_parameter('speed').value * 2.0"),
    ("init", "self.get_logger().info('x', once=True)"),
    ("init", "self._parameters"),
    ("point", "stamp = Time.from_msg(message.header.stamp)\nstamp.nanoseconds"),
    ("point", "self.last = Time.from_msg(message.header.stamp)\nself.last < Time()"),
    ("point", "print(f'{message!r:>20} {None!s:>8}')"),
    ("goal", "if goal_handle.is_cancel_requested:\n    goal_handle.canceled()"),
    ("goal", "goal_handle.publish_feedback(Fibonacci.Feedback(sequence=[1]))"),
    ("tick", "request = SetBool.Request(data=True)\n"
             "self.stop.call_async(request).add_done_callback(self.on_stopped)"),
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
]  # fmt: skip


def _code(place: str, statement: str) -> str:
    code = CODE
    for name in PLACES:
        text = statement.replace("\n", "\n        ") if name == place else "pass"
        code = code.replace("{" + name + "}", text)
    return code


def _found(tmp_path: Path, code: str) -> list[tuple[str, str]]:
    (tmp_path / "robot_code.py").write_text(code)
    return [(item.rule.name, quoted(item)) for item in diagnostics_in(SYSTEM, tmp_path)]


@pytest.mark.parametrize(("place", "statement", "rule", "underlined"), MISTAKES)
def test_a_mistake_is_reported(
    tmp_path: Path, place: str, statement: str, rule: str, underlined: str
) -> None:
    assert (rule, underlined) in _found(tmp_path, _code(place, statement))


def test_nothing_else_is_reported(tmp_path: Path) -> None:
    assert _found(tmp_path, _code("tick", "pass")) == []


@pytest.mark.parametrize(("place", "statement"), RIGHT)
def test_right_code_is_not_reported(tmp_path: Path, place: str, statement: str) -> None:
    assert _found(tmp_path, _code(place, statement)) == []


def test_one_wrong_value_is_reported_once(tmp_path: Path) -> None:
    uses = "age = self.get_clock().now() - Time()\nage * 2.0\nage * 3.0\nself.count += age * 1.0"
    assert len(_found(tmp_path, _code("tick", uses))) == 1


def test_a_constructor_calls_that_of_node(tmp_path: Path) -> None:
    code = _code("tick", "pass").replace('super().__init__("robot")', "pass")
    assert ("missing-constructor", "__init__") in _found(tmp_path, code)


@pytest.mark.parametrize(
    "statement",
    [
        "for name in ('a', 'b'):\n    self.declare_parameter(name, 1)\nself.get_parameter('a')",
        "if self.has_parameter('a'):\n    self.get_parameter('a')",
        "self.declare_parameters('', [('a', 1)])\nself.get_parameter('a')",
        "declare = self.declare_parameter\ndeclare('a', 1)\nself.get_parameter('a')",
        "try:\n    self.get_parameter('a')\nexcept ParameterNotDeclaredException:\n    pass",
    ],
)
def test_parameters_may_be_declared_in_other_ways(tmp_path: Path, statement: str) -> None:
    assert _found(tmp_path, _code("init", statement)) == []


def test_functions_may_have_attributes(tmp_path: Path) -> None:
    code = _code("tick", "table.cache_clear()\ncounted.calls += 1\nself.count_up.__func__")
    code += "def counted(): pass\ncounted.calls = 0\n"
    code += "@cache\ndef table(): return {}\n"
    assert _found(tmp_path, "from functools import cache\n" + code) == []


def test_a_transition_gets_the_state(tmp_path: Path) -> None:
    code = _code("tick", "pass").replace("def on_activate(self, state)", "def on_activate(self)")
    assert _found(tmp_path, code) == [("handler-signature", "on_activate")]


DECLARING = """\
from rclpy.node import Node
from rcl_interfaces.msg import ParameterDescriptor
from std_msgs.msg import String


class Declaring(Node):
    def __init__(self):
        super().__init__("declaring")
        self.declare_parameter("offset", -1.5)
        self.declare_parameter("gains", [1.0, 2.0])
        self.declare_parameter("any", 1, ParameterDescriptor(dynamic_typing=True))
        self.declare_parameters("arm", [("length", 1.0)])
        self.create_publisher(String, "~/text", 10)
        self.create_service(self.text_type, "text", self.on_text)
"""


@pytest.mark.parametrize(
    ("line", "rule"),
    [
        ("parameters: {offset: {type: double, default: 1.0}}", None),
        ("parameters: {offset: {type: integer, default: 1}}", "class-parameter-type"),
        ("parameters: {gains: {type: double_array, default: [1.0]}}", None),
        ("parameters: {gains: {type: double, default: 1.0}}", "class-parameter-type"),
        ("parameters: {any: {type: string, default: a}}", None),
        ("parameters: {arm.length: {type: double, default: 1.0}}", None),
        ("parameters: {length: {type: double, default: 1.0}}", "class-parameter"),
        ("parameters: {use_sim_time: {type: bool, default: true}}", None),
        ("publishers: {text: {type: std_msgs/msg/String, topic: ~/text, external: true}}", None),
        ("publishers: {text: {type: std_msgs/msg/Int32, topic: ~/text, external: true}}",
         "class-port-type"),
        ("publishers: {text: {type: std_msgs/msg/Int32, topic: text, external: true}}", None),
    ],
)  # fmt: skip
def test_parameters_and_ports_agree_with_the_class(
    line: str, rule: str | None, tmp_path: Path
) -> None:
    (tmp_path / "declaring.py").write_text(DECLARING, encoding="utf-8")
    system = f"system: a\nnodes:\n  n:\n    class: declaring:Declaring\n    {line}\n"
    rules = {"class-parameter", "class-parameter-type", "class-port-type"}
    found = [item.rule.name for item in diagnostics_in(system, tmp_path)]
    assert [name for name in found if name in rules] == ([rule] if rule is not None else [])

"""Classes that are derived from rclpy's Node."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from tests.unit.support.python_checks import check

IMPORTS = """
import functools
from functools import partial
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from std_msgs.msg import String, UInt8
from std_srvs.srv import SetBool, Trigger
from tf2_ros import Buffer, TransformListener

"""
METHODS = """
def tick(self):
    self.count = 1
def on_message(self, message):
    self.count = 2
def on_named(self, message, name):
    self.count = 3
def on_service(self, request, response):
    return response
def on_failing_service(self, request, response):
    raise NotImplementedError
def on_optional(self, event=None):
    pass
def anything(self, *arguments):
    pass
def make(self):
    return self.tick
def run_goal(self, goal_handle):
    return Fibonacci.Result()
async def run(self):
    return 1
@functools.cache
def decorated(self, event):
    pass
@staticmethod
def static():
    pass
"""


def node(body: str) -> str:
    start = "class Robot(Node):\n    def __init__(self):\n        super().__init__('robot')\n"
    start += "        self.callback = lambda: None\n"
    body = textwrap.indent(body, "        ")
    end = "def module_function(argument):\n    pass\n"
    return f"{IMPORTS}{start}{body}\n{textwrap.indent(METHODS, '    ')}\n{end}"


#: Statements of a constructor, separated by lines of dashes.
PARAMETERS = """\
self.declare_parameter('rate', 1.0)
self.get_parameter('rat').value  # PARAMETER
self.get_parameter('rate').value
self.get_parameter('use_sim_time').value
self.get_parameter('qos_overrides./a.depth').value
---
self.declare_parameters('', [('rate', 1.0), ('name', 'a')])
self.declare_parameters('arm', [('rate', 1.0)])
self.get_parameter('arm.rate').value
self.get_parameter('arm.rat').value  # PARAMETER
self.get_parameter('arm.color').value
---
RATE = 'rate'
self.declare_parameter(RATE, 1.0)
self.get_parameter('rate').value
self.buffer = TransformListener(Buffer(), self)
self.get_parameter('rates').value  # PARAMETER
---
helper.declare(self)
self.get_parameter('rate').value
---
self.node.get_parameter('rate')
self.get_parameter(self.name)
"""


#: Files, separated by lines of dashes.
FILES = """\
class Robot(Node):
    def __init__(self):  # CONSTRUCTOR
        self.rate = 1.0
---
class Base(Node):
    def __init__(self):
        Node.__init__(self, 'robot')

class Robot(Base):
    def __init__(self):
        self.rate = 1.0
---
class Robot(Node):
    def __init__(self):
        self.start()
    def start(self):
        super().__init__('robot')
---
class Robot(Node):
    def __init__(self):
        super().__init__('robot', **self.options)
        self.get_parameter('rate').value
---
class Robot(Node):
    def __init__(self, **kwargs):
        super().__init__('robot', **kwargs)
        self.declare_parameter('rate', 1.0)
        self.get_parameter('rates').value  # PARAMETER
---
class Robot(Node):
    def __init__(self, **kwargs):
        kwargs['allow_undeclared_parameters'] = True
        super().__init__('robot', **kwargs)
        self.get_parameter('rate').value
---
class Robot(Node):
    def __init__(self):
        super().__init__('robot', allow_undeclared_parameters=True)
        self.get_parameter('rate').value
---
class Robot(Node):
    def get_parameter(self, name):
        return super().get_parameter(name).value
    def on_tick(self):
        return self.get_parameter('rate') > 3
---
class Robot(LifecycleNode):
    def on_configure(self, state):
        self.publisher = self.create_lifecycle_publisher(String, 'a', 10)
        return TransitionCallbackReturn.SUCCESS
    def on_activate(self, state):
        return TransitionCallbackReturn.SUCCESS  # CONSTRUCTOR?
    def on_deactivate(self, state):
        return super().on_deactivate(state)
    def on_cleanup(self, state):
        self.publisher = None
---
class Robot(LifecycleNode):
    def on_configure(self, state):
        self.publisher = self.create_lifecycle_publisher(String, 'a', 10)
        return TransitionCallbackReturn.SUCCESS
    def on_activate(self, state):
        self.publisher.on_activate(state)
        return TransitionCallbackReturn.SUCCESS
    def on_cleanup(self, state):
        return self.clean()
    def on_error(self, state):
        raise RuntimeError
---
class Robot(LifecycleNode):
    def on_activate(self, state):
        return TransitionCallbackReturn.SUCCESS
---
class Robot(Node):
    def build():
        return 1
    def names(kind):
        return [kind]
    NAMES = names('a')

Robot.build()
---
class Robot(Node):
    def create_timer(self, callback, seconds):
        return super().create_timer(seconds, callback)
    def on_tick(self):
        self.create_timer(lambda: None, lambda event: None)
---
class Robot(Node):
    def __init__(self):
        super().__init__('robot')
        self.create_subscription(UInt8, 'a', self.on_a, 10)
    def on_a(self, message):
        message.data = 300  # VALUE
"""


@pytest.mark.parametrize(
    "text",
    [
        *(node(body) for body in PARAMETERS.split("---\n")),
        *(IMPORTS + text for text in FILES.split("---\n")),
    ],
)
def test_classes(text: str, tmp_path: Path) -> None:
    check(text, tmp_path, "class")

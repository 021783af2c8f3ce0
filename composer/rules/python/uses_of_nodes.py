"""Rules on what code does with its node: ports, parameters, messages and calls."""

from __future__ import annotations

from composer.diagnostics import error, warning
from composer.rules.python.definitions import behavior, on_tick, on_total, rclpy_class

_RESET = "services: {reset: {type: std_srvs/srv/Trigger}}"
_ON_RESET = "class Counter:\n    def on_reset(self, request, response):\n        "
_UNSET = (
    "class Counter:\n    def __init__(self):\n        self.last: list[int] | None = None\n\n"
    "    def on_tick(self):\n"
)
_EARLY = (
    "class Counter:\n    def %s(self):\n        self.log.info(self.name)\n\n"
    "    def on_tick(self):\n        pass\n"
)
_READING = rclpy_class(
    'self.declare_parameter("rate_hz", 10.0)',
    'self.rate = self.get_parameter("rate_hz").value',
)

UNKNOWN_ATTRIBUTE = error(
    code="RC442",
    name="unknown-attribute",
    summary="A behavior uses a port, a parameter or another attribute that does not exist.",
    why=(
        "self.publishers, self.clients, self.action_clients and self.parameters have exactly "
        "what the node declares. Any other name raises AttributeError."
    ),
    bad=on_total("def on_total(self, message):", "    self.publishers.counts.publish(Int32())"),
    good=on_total("def on_total(self, message):", "    self.publishers.count.publish(Int32())"),
)
WRONG_MESSAGE_TYPE = error(
    code="RC457",
    name="wrong-message-type",
    summary="A behavior sends a message of another type than the port has.",
    why="Publishing or calling raises TypeError.",
    bad=on_total(
        "def on_total(self, message):",
        "    self.publishers.count.publish(Int64())",
        head="from std_msgs.msg import Int64",
    ),
    good=on_total("def on_total(self, message):", "    self.publishers.count.publish(Int32())"),
)
MISSING_RETURN = error(
    code="RC448",
    name="missing-return",
    summary="A handler or an annotated function may return None instead of its result.",
    why=(
        "A service handler returns the response; without it, the client gets a failure. A "
        "goal is accepted only if 'accept_...' returns True."
    ),
    bad=behavior(f"{_ON_RESET}response.success = True\n", _RESET),
    good=behavior(f"{_ON_RESET}response.success = True\n        return response\n", _RESET),
)
MISSING_AWAIT = error(
    code="RC443",
    name="missing-await",
    summary="A behavior calls something asynchronous and does not await it.",
    why=(
        "Without 'await', the call returns at once: an 'async def' method does not even start, "
        "and the result of a service or an action is not available."
    ),
    bad=on_tick("self.clock.sleep(0.05)", is_async=True),
    good=on_tick("await self.clock.sleep(0.05)", is_async=True),
)
ASYNCIO_CALL = error(
    code="RC454",
    name="asyncio-call",
    summary="A callback awaits a function of asyncio.",
    why=(
        "Callbacks run on the event loop of the composer, which also waits for ROS. Functions "
        "of asyncio need a running loop of asyncio and raise an error. Run libraries that need "
        "asyncio in a thread, with 'asyncio.run'."
    ),
    bad=on_tick("await asyncio.sleep(0.05)", head="import asyncio", is_async=True),
    good=on_tick("await self.clock.sleep(0.05)", is_async=True),
)
UNCHECKED_NONE = warning(
    code="RC456",
    name="unchecked-none",
    summary="A value that may be None is used without a check.",
    why=(
        "An attribute that is None at first stays so until the first message, and a callback "
        "may run before. Any attribute of None raises AttributeError."
    ),
    bad=behavior(f"{_UNSET}        self.last.append(1)\n"),
    good=behavior(f"{_UNSET}        if self.last is not None:\n            self.last.append(1)\n"),
)
HANDLER_ANNOTATION = warning(
    code="RC451",
    name="handler-annotation",
    summary="A handler annotates its argument with another type than its port has.",
    why=(
        "The port determines the type of the messages. The annotation misleads readers and "
        "type checkers, or the type of the port is wrong."
    ),
    bad=on_total(
        "def on_total(self, message: String):",
        "    pass",
        head="from std_msgs.msg import String",
    ),
    good=on_total("def on_total(self, message: Int32):", "    pass"),
)
TOO_EARLY = warning(
    code="RC459",
    name="too-early",
    summary="A behavior uses its node before the node is ready for it.",
    why=(
        "Ports, parameters and the clock exist from 'on_configure' on, not in '__init__'. "
        "Messages are dropped before the node is active."
    ),
    bad=behavior(_EARLY % "__init__"),
    good=behavior(_EARLY % "on_configure"),
)
UNDECLARED_PARAMETER = error(
    code="RC483",
    name="undeclared-parameter",
    summary="A class reads a parameter that it does not declare.",
    why="rclpy raises ParameterNotDeclaredException, in the constructor or in a callback.",
    bad=_READING.replace('get_parameter("rate_hz")', 'get_parameter("rate")'),
    good=_READING,
)
MISSING_CONSTRUCTOR = error(
    code="RC484",
    name="missing-constructor",
    summary="A constructor or a transition does not call that of its base class.",
    why=(
        "Without super().__init__(name), there is no node: every use of it raises an error. "
        "Lifecycle publishers are activated by super().on_activate(state)."
    ),
    bad=rclpy_class().replace('super().__init__("talker")', "self.count = 0"),
    good=rclpy_class("self.count = 0"),
)

"""Node classes whose callbacks block, await, or run in callback groups, for tests."""

from __future__ import annotations

import threading
from typing import Any

import rclpy
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.node import Node
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger


class BlockingCaller(Node):
    """Calls a service from a timer, and waits for the response there."""

    def __init__(self) -> None:
        super().__init__("caller")
        self.client = self.create_client(Trigger, "count")
        self.responses: list[Any] = []
        self.overlaps = 0
        self.busy = False
        self.create_timer(0.01, self.tick)

    def tick(self) -> None:
        self.overlaps += self.busy
        self.busy = True
        self.responses.append(self.client.call(Trigger.Request()))
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future)
        self.responses.append(future.result())
        self.busy = False


class AsyncCaller(Node):
    """Awaits one service in the callback of another one."""

    def __init__(self) -> None:
        super().__init__("caller")
        self.group = ReentrantCallbackGroup()
        self.client = self.create_client(Trigger, "count", callback_group=self.group)
        self.create_service(Trigger, "relay", self.on_relay, callback_group=self.group)

    async def on_relay(self, request: Any, _: Any) -> Any:
        return await self.client.call_async(request)


class Groups(Node):
    """Two callback groups: a callback of one runs while the other blocks."""

    def __init__(self) -> None:
        super().__init__("groups")
        self.done = threading.Event()
        self.together = 0
        first, second = MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()
        self.create_subscription(String, "wait", self.on_wait, 10, callback_group=first)
        self.create_subscription(String, "finish", self.on_finish, 10, callback_group=second)

    def on_wait(self, _: String) -> None:
        self.together += self.done.wait(5.0)

    def on_finish(self, _: String) -> None:
        self.done.set()


class Tokens(CallbackGroup):
    """A callback group of the class's own: each callback takes a token."""

    def __init__(self) -> None:
        super().__init__()
        self.tokens = 3
        self.ended: list[Any] = []

    def can_execute(self, entity: Any) -> bool:
        return self.tokens > 0

    def beginning_execution(self, entity: Any) -> bool:
        self.tokens -= 1
        return True

    def ending_execution(self, entity: Any) -> None:
        self.ended.append(entity)


class Throttled(Node):
    """A timer, a subscription and a service in a callback group of the class's own."""

    def __init__(self) -> None:
        super().__init__("throttled")
        self.group = Tokens()
        self.calls: list[str] = []
        self.ticks = 0
        self.timer = self.create_timer(0.01, self.tick)
        self.numbers = self.create_subscription(
            Int64, "numbers", self.on_number, 10, callback_group=self.group
        )
        self.service = self.create_service(
            Trigger, "count", self.on_count, callback_group=self.group
        )

    def tick(self) -> None:
        self.ticks += 1
        self.get_logger().debug(f"tick {self.ticks}")

    async def on_number(self, message: Int64) -> None:
        self.calls.append(f"number {message.data}")

    def on_count(self, _: Any, response: Any) -> Any:
        self.calls.append("count")
        return response


class AsyncTimers(Node):
    """Two timers of one callback group, whose callbacks await a service."""

    def __init__(self) -> None:
        super().__init__("timers")
        self.client = self.create_client(
            Trigger, "count", callback_group=MutuallyExclusiveCallbackGroup()
        )
        self.busy = False
        self.overlaps = self.rounds = 0
        for _ in range(2):
            self.create_timer(0.005, self.tick)

    async def tick(self) -> None:
        self.overlaps += self.busy
        self.busy = True
        await self.client.call_async(Trigger.Request())
        self.busy = False
        self.rounds += 1

"""Node classes whose callbacks block, await, or run in callback groups, for tests."""

from __future__ import annotations

import random
import signal
import threading
import time
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rclpy.action import ActionServer
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.wait_for_message import wait_for_message
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


class Sleeper(Node):
    """Sleeps in callbacks: at a rate, and until a message of its own subscription has arrived."""

    def __init__(self) -> None:
        super().__init__("sleeper")
        self.rounds = 0
        self.number = 0
        group = ReentrantCallbackGroup()
        self.create_subscription(Int64, "numbers", self.on_number, 10, callback_group=group)
        self.create_service(Trigger, "wait", self.on_wait, callback_group=group)
        self.create_timer(0.05, self.on_timer)

    def on_timer(self) -> None:
        rate = self.create_rate(100)
        for _ in range(2):
            rate.sleep()
        self.destroy_rate(rate)
        self.rounds += 1

    def on_number(self, message: Int64) -> None:
        self.number = message.data

    def on_wait(self, _: Any, response: Any) -> Any:
        while not self.number:
            time.sleep(0.01)
        response.success = True
        return response


class CallerWithoutServer(Node):
    """Waits for the response of a service that does not exist, in the callback of a timer."""

    def __init__(self) -> None:
        super().__init__("caller")
        self.create_timer(0.01, self.on_timer)

    def on_timer(self) -> None:
        self.create_client(Trigger, "missing").call(Trigger.Request())


class HangingTimer(Node):
    """A timer whose callback does not return, once it is commanded."""

    def __init__(self) -> None:
        super().__init__("hanging")
        self.create_subscription(String, "command", self.on_command, 10)

    def on_command(self, _: String) -> None:
        self.create_timer(0.01, self.tick)

    def tick(self) -> None:
        while True:
            time.sleep(0.01)


class SleepingServer(Node):
    """Sleeps in the callback of a goal; the callback is ``async`` or not."""

    def __init__(self, is_async: bool = False, seconds: float = 0.01) -> None:
        super().__init__("server")
        self.seconds = seconds
        self.goals = 0
        execute = self.execute_async if is_async else self.execute
        ActionServer(self, Navigate, "navigate", execute)

    def execute(self, _: Any) -> Any:
        self.goals += 1
        while True:
            time.sleep(self.seconds)

    async def execute_async(self, goal: Any) -> Any:
        return self.execute(goal)


class Waiter(Node):
    """Waits in its constructor: for messages, in two ways, and for the response of a service."""

    def __init__(self) -> None:
        super().__init__("waiter")
        self.numbers: list[int] = []
        self.publisher = self.create_publisher(Int64, "stopped", 10)
        signal.signal(signal.SIGTERM, self.on_signal)
        _, message = wait_for_message(Int64, self, "numbers", time_to_wait=10.0)
        self.waited_for = message.data
        self.create_subscription(Int64, "numbers", self.on_number, 10)
        while len(self.numbers) < 2:
            rclpy.spin_once(self, timeout_sec=1.0)
        client = self.create_client(Trigger, "count")
        client.wait_for_service()
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future)
        self.response = future.result()
        self.create_timer(0.01, self.on_timer)
        self.awaited = 0

    def on_number(self, message: Int64) -> None:
        self.numbers.append(message.data)

    def on_timer(self) -> None:
        is_received, _ = wait_for_message(Int64, self, "numbers", time_to_wait=10.0)
        self.awaited += is_received

    def on_signal(self, number: int, _: Any) -> None:
        self.publisher.publish(Int64(data=number))


class Matched(Node):
    """Gets the matches of a publisher and a subscription, in its process and outside."""

    def __init__(self) -> None:
        super().__init__("matched")
        self.matches: list[tuple[str, int]] = []
        publisher = PublisherEventCallbacks(matched=self.on_publisher)
        self.create_publisher(Int64, "out", 10, event_callbacks=publisher)
        subscription = SubscriptionEventCallbacks(matched=self.on_subscription)
        self.create_subscription(Int64, "in", print, 10, event_callbacks=subscription)

    def on_publisher(self, status: Any) -> None:
        self.matches.append(("publisher", status.current_count))

    def on_subscription(self, status: Any) -> None:
        self.matches.append(("subscription", status.current_count))


class Busy(Node):
    """Publishes, receives, calls itself and sleeps at random, in four callback groups."""

    def __init__(self) -> None:
        super().__init__("busy")
        self.random = random.Random(1)
        self.sent = self.calls = self.naps = self.overlaps = 0
        self.numbers: list[int] = []
        self.busy = False
        shared = ReentrantCallbackGroup()
        own = [MutuallyExclusiveCallbackGroup() for _ in range(3)]
        self.publisher = self.create_publisher(Int64, "numbers", 10_000)
        self.create_subscription(Int64, "numbers", self.on_number, 10_000, callback_group=own[0])
        self.create_service(Trigger, "answer", self.on_answer, callback_group=shared)
        self.client = self.create_client(Trigger, "answer", callback_group=shared)
        self.create_timer(0.002, self.publish, callback_group=own[1])
        self.create_timer(0.005, self.call, callback_group=own[2])
        self.create_timer(0.005, self.nap, callback_group=shared)

    def publish(self) -> None:
        self.publisher.publish(Int64(data=self.sent))
        self.sent += 1

    def on_number(self, message: Int64) -> None:
        self.overlaps += self.busy
        self.busy = True
        self.numbers.append(message.data)
        chance = self.random.random()
        if chance < 0.01:
            time.sleep(0.05)
        elif chance < 0.02:
            self.client.call(Trigger.Request())
        self.busy = False

    def on_answer(self, _: Any, response: Any) -> Any:
        if self.random.random() < 0.1:
            time.sleep(0.05)
        return response

    def call(self) -> None:
        self.client.call(Trigger.Request())
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future)
        self.calls += future.done()

    def nap(self) -> None:
        rate = self.create_rate(100)
        rate.sleep()
        self.destroy_rate(rate)
        self.naps += 1


class Tasks(Node):
    """Creates tasks of all kinds, and spins its executor until they are done."""

    def __init__(self) -> None:
        super().__init__("tasks")
        self.results: list[Any] = []
        self.arrived = threading.Event()
        group = ReentrantCallbackGroup()
        self.create_subscription(
            Int64, "numbers", lambda _: self.arrived.set(), 10, callback_group=group
        )
        self.create_service(Trigger, "wait", self.on_wait)

    def on_wait(self, _: Any, response: Any) -> Any:
        create: Any = self.executor.create_task  # type: ignore[union-attr]
        tasks = [
            create(self.plain, "a"),
            create(self.awaits, "b", end="c"),
            create(self.awaits("d")),
        ]
        tasks += [create(self.fails)]
        for task in tasks:
            self.executor.spin_until_future_complete(task)  # type: ignore[union-attr]
        self.results = [str(task.exception() or task.result()) for task in tasks]
        response.success = True
        future = rclpy.task.Future(executor=self.executor)
        future.add_done_callback(self.on_done)
        future.set_result(None)
        return response

    def plain(self, text: str) -> str:
        self.arrived.wait()
        return text

    async def awaits(self, text: str, end: str = "") -> str:
        self.arrived.wait()
        return text + end

    def fails(self) -> None:
        raise ValueError("no")

    def on_done(self, _: Any) -> None:
        threading.Event().wait()

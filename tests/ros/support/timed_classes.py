"""Node classes that read clocks, sleep and wait, for tests: nothing here knows the composer."""

from __future__ import annotations

import threading
import time
from typing import Any

from composer_interfaces.action import Navigate
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import LoggerLevel, ParameterEvent
from rcl_interfaces.srv import SetLoggerLevels, SetParameters
from rclpy.action import ActionClient
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


class ClockReader(Node):
    """Reads clocks of all kinds, each second, and sleeps in between."""

    def __init__(self) -> None:
        super().__init__("reader")
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.times: list[dict[str, float]] = []
        self.create_timer(1.0, self.tick, clock=self.steady)

    def tick(self) -> None:
        before = self.read()
        time.sleep(0.125)
        self.get_clock().sleep_for(Duration(seconds=0.125))
        self.steady.sleep_until(self.steady.now() + Duration(seconds=0.25))
        threading.Event().wait(0.25)
        after = self.read()
        self.times.append({name: after[name] - before[name] for name in before})
        self.get_logger().info("tick", throttle_duration_sec=1.5)

    def read(self) -> dict[str, float]:
        return {
            "time": time.time(),
            "monotonic": time.monotonic(),
            "perf_counter_ns": time.perf_counter_ns() / 1e9,
            "ros": self.get_clock().now().nanoseconds / 1e9,
            "system": Clock().now().nanoseconds / 1e9,
            "steady": self.steady.now().nanoseconds / 1e9,
        }


class Overdue(Node):
    """A topic with deadlines on which one message is published, received serialized as well."""

    def __init__(self) -> None:
        super().__init__("overdue")
        self.missed = {"offered": 0, "requested": 0}
        self.raw: list[int] = []
        profile = QoSProfile(depth=1, deadline=Duration(seconds=1))
        offered = PublisherEventCallbacks(deadline=lambda status: self.count("offered", status))
        requested = SubscriptionEventCallbacks(
            deadline=lambda status: self.count("requested", status)
        )
        self.publisher = self.create_publisher(Int64, "x", profile, event_callbacks=offered)
        self.create_subscription(Int64, "x", self.ignore, profile, event_callbacks=requested)
        self.create_subscription(Int64, "x", self.on_raw, 1, raw=True)
        self.timer = self.create_timer(1.0, self.tick)

    def tick(self) -> None:
        self.publisher.publish(Int64(data=3))
        self.timer.cancel()

    def ignore(self, _: Any, info: Any) -> None:
        pass

    def on_raw(self, message: bytes) -> None:
        self.raw.append(deserialize_message(message, Int64).data)

    def count(self, kind: str, status: Any) -> None:
        self.missed[kind] = status.total_count


class Unserved(Node):
    """Waits for servers that there are not, and subscribes to what the middleware publishes."""

    def __init__(self) -> None:
        super().__init__("unserved")
        client = self.create_client(SetParameters, "/reader/set_parameters")
        found = client.wait_for_service(2.0)
        self.get_logger().info(f"found: {found} at {self.get_clock().now().nanoseconds}")
        client.call_async(SetParameters.Request())
        self.create_subscription(ParameterEvent, "/parameter_events", print, 1)


class Operator(Node):
    """Sets a parameter of another node, restarts the node, and reads the parameter, once."""

    def __init__(self, target: str) -> None:
        super().__init__("operator")
        self.seen: list[object] = []
        self.target = target
        self.parameters = AsyncParameterClient(self, target)
        self.change = self.create_client(ChangeState, f"{target}/change_state")
        self.state = self.create_client(GetState, f"{target}/get_state")
        self.levels = self.create_client(SetLoggerLevels, f"{target}/set_logger_levels")
        self.timer = self.create_timer(0.1, self.operate)

    async def operate(self) -> None:
        self.timer.cancel()
        wanted = Parameter("period", value=0.5)
        (result,) = (await self.parameters.set_parameters([wanted])).results
        for transition in ("deactivate", "activate", "no_such"):
            request = ChangeState.Request(transition=Transition(label=transition))
            self.seen.append((await self.change.call_async(request)).success)
            state = (await self.state.call_async(GetState.Request())).current_state
            self.seen.append(state.label)
        (value,) = (await self.parameters.get_parameters(["period"])).values
        level = LoggerLevel(name=self.target[1:], level=LoggerLevel.LOG_LEVEL_WARN)
        levels = self.levels.call_async(SetLoggerLevels.Request(levels=[level]))
        self.seen += [result.successful, value.double_value, (await levels).results[0].successful]


class WaitsForever(Node):
    """Waits in its constructor, as many examples do."""

    def __init__(self) -> None:
        super().__init__("waits")
        client = self.create_client(Trigger, "nothing")
        while not client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("waiting")


class WaitsBusily(Node):
    """Reads a clock until some time has passed, without a sleep."""

    def __init__(self, is_ros: bool) -> None:
        super().__init__("busily")
        self.is_ros = is_ros
        self.create_timer(1.0, self.tick)

    def now_s(self) -> float:
        return self.get_clock().now().nanoseconds / 1e9 if self.is_ros else time.time()

    def tick(self) -> None:
        end_s = self.now_s() + 100.0
        while self.now_s() < end_s:
            pass


class Locked(Node):
    """Waits for a lock in its constructor or in a callback, and nothing releases the lock."""

    def __init__(self, in_callback: bool) -> None:
        super().__init__("locked")
        self.lock = threading.Lock()
        self.lock.acquire()
        if in_callback:
            self.create_timer(1.0, self.lock_again)
        else:
            self.lock_again()

    def lock_again(self) -> None:
        self.lock.acquire()


class Commander(Node):
    """Sends goals from a timer, and waits there; cancels every second one."""

    def __init__(self) -> None:
        super().__init__("commander")
        self.client = ActionClient(self, Navigate, "navigate")
        self.ends: list[tuple[int, float]] = []
        self.create_timer(1.0, self.tick)

    def tick(self) -> None:
        self.client.wait_for_server()
        goal = Navigate.Goal()
        goal.target.x = 10.0  # steps of 10 ms
        status = self.client.send_goal(goal).status
        self.ends.append((status, self.get_clock().now().nanoseconds / 1e9 % 1))
        goal.target.x = 1000.0
        self.client.send_goal_async(goal).add_done_callback(self.on_accepted)

    def on_accepted(self, sent: Any) -> None:
        handle = sent.result()
        handle.cancel_goal()
        self.ends.append((handle.get_result().status, 0.0))

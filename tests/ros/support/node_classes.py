"""rclpy node classes as teams have them, written for the tests: nothing here knows the composer.

Each uses parts of rclpy's API as the examples and demos of ROS 2 do: publishers and timers in the
constructor, callbacks with and without message information, services that call others, action
servers, lifecycle nodes, and threads that spin.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, State, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import Int64, String
from std_srvs.srv import SetBool, Trigger

SUCCESS = TransitionCallbackReturn.SUCCESS
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: The constructions and ends of instances, in order, for tests in the same process.
history: list[str] = []


class Talker(Node):
    """A publisher, a timer and parameters."""

    def __init__(self, prefix: str = "message") -> None:
        super().__init__("talker")
        history.append("constructed")
        self.prefix = prefix
        self.declare_parameter("period", 0.01)
        self.declare_parameter("word", "hello")
        self.count = 0
        self.publisher = self.create_publisher(Int64, "numbers", 10)
        self.words = self.create_publisher(String, "~/words", 10)
        self.timer = self.create_timer(self.get_parameter("period").value, self.tick)

    def tick(self) -> None:
        self.count += 1
        self.publisher.publish(Int64(data=self.count))
        self.words.publish(String(data=f"{self.prefix} {self.get_parameter('word').value}"))

    def destroy_node(self) -> None:
        history.append("destroyed")
        super().destroy_node()


class Listener(Node):
    """Subscriptions with and without message information, a service, and a logger."""

    def __init__(self) -> None:
        super().__init__("listener")
        self.numbers: list[int] = []
        self.infos: list[Any] = []
        self.create_subscription(Int64, "numbers", self.on_number, 10)
        self.create_subscription(Int64, "numbers", self.on_number_with_info, 10)
        self.create_service(Trigger, "count", self.on_count)

    def on_number(self, message: Int64) -> None:
        self.numbers.append(message.data)
        self.get_logger().info(f"got {message.data}", once=True)

    def on_number_with_info(self, message: Int64, info: Any) -> None:
        self.infos.append((message.data, info["publication_sequence_number"]))

    def on_count(self, _: Any, response: Any) -> Any:
        response.success = True
        response.message = str(len(self.numbers))
        return response


class Reuser(Node):
    """Publishes one message object again and again, as some drivers do."""

    def __init__(self) -> None:
        super().__init__("reuser")
        self.message = Int64()
        self.publisher = self.create_publisher(Int64, "numbers", 10)
        self.create_subscription(String, "go", self.on_go, 10)

    def on_go(self, _: String) -> None:
        for number in (1, 2, 3):
            self.message.data = number
            self.publisher.publish(self.message)


class Announcer(Node):
    """Publishes a latched message once, in its constructor."""

    def __init__(self) -> None:
        super().__init__("announcer")
        self.create_publisher(String, "map", LATCHED).publish(String(data="the map"))


class WaitingConstructor(Node):
    """Calls a service in its constructor, on an executor of its own."""

    def __init__(self) -> None:
        super().__init__("waiting")
        client = self.create_client(Trigger, "count")
        assert client.wait_for_service(60.0)
        executor = SingleThreadedExecutor()
        executor.add_node(self)
        future = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(future, 60.0)
        self.answer = future.result()
        self.get_logger().info(f"answer {self.answer.message}")


class Spinner(Node):
    """Spins in a thread of its own, which is what many drivers do."""

    def __init__(self) -> None:
        super().__init__("spinner")
        self.publisher = self.create_publisher(Int64, "numbers", 10)
        self.create_timer(0.01, lambda: self.publisher.publish(Int64(data=1)))
        self.thread = threading.Thread(target=rclpy.spin, args=(self,), name="own spin")
        self.thread.start()


class Poller(Node):
    """A thread that polls a device while rclpy is up, as many drivers have."""

    def __init__(self) -> None:
        super().__init__("poller")
        self.publisher = self.create_publisher(Int64, "numbers", 10)
        self.thread = threading.Thread(target=self.poll, name="poller")
        self.thread.start()

    def poll(self) -> None:
        while rclpy.ok():
            self.publisher.publish(Int64(data=1))
            time.sleep(0.01)


class Stubborn(Node):
    """A thread that outlives the node."""

    release = threading.Event()

    def __init__(self) -> None:
        super().__init__("stubborn")
        threading.Thread(target=self.release.wait, name="stubborn", daemon=True).start()


class Counter(LifecycleNode):
    """A lifecycle node class with handlers, a lifecycle publisher and a timer."""

    def __init__(self) -> None:
        super().__init__("counter")
        self.calls: list[str] = []
        self.declare_parameter("refuse", "")
        self.count = 0
        self.publisher: Any = None

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        self.calls.append(f"configure from {state.label}")
        self.publisher = self.create_lifecycle_publisher(Int64, "numbers", 10)
        self.create_timer(0.01, self.tick)
        if self.get_parameter("refuse").value == "configure":
            return TransitionCallbackReturn.FAILURE
        return SUCCESS

    def on_activate(self, state: State) -> TransitionCallbackReturn:
        self.calls.append("activate")
        return super().on_activate(state)

    def on_deactivate(self, state: State) -> TransitionCallbackReturn:
        self.calls.append("deactivate")
        return super().on_deactivate(state)

    def on_cleanup(self, _: State) -> TransitionCallbackReturn:
        history.append("cleaned up")
        return SUCCESS

    def tick(self) -> None:
        self.count += 1
        self.publisher.publish(Int64(data=self.count))


class Navigator(Node):
    """An action server whose goals take as many steps as their pose says."""

    def __init__(self) -> None:
        super().__init__("navigator")
        self.canceled = 0
        self.serve()

    def serve(self) -> None:
        self.server = ActionServer(
            self,
            Navigate,
            "navigate",
            self.execute,
            callback_group=ReentrantCallbackGroup(),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def execute(self, goal: Any) -> Navigate.Result:
        for _ in range(int(goal.request.target.x)):
            if goal.is_cancel_requested:
                self.canceled += 1
                goal.canceled()
                return Navigate.Result()
            goal.publish_feedback(Navigate.Feedback())
            time.sleep(0.01)
        goal.succeed()
        return Navigate.Result()


class Sender(Node):
    """An action client that sends a goal from a timer."""

    def __init__(self) -> None:
        super().__init__("sender")
        self.client = ActionClient(node=self, action_type=Navigate, action_name="navigate")
        self.statuses: list[int] = []
        self.feedback = 0
        self.timer = self.create_timer(0.01, self.send)

    def send(self) -> None:
        if not self.client.server_is_ready():
            return
        self.timer.cancel()
        goal = Navigate.Goal()
        goal.target.x = 3.0
        self.client.send_goal_async(goal, self.on_feedback).add_done_callback(self.on_accepted)

    def on_feedback(self, _: Any) -> None:
        self.feedback += 1

    def on_accepted(self, future: Any) -> None:
        future.result().get_result_async().add_done_callback(self.on_result)

    def on_result(self, future: Any) -> None:
        self.statuses.append(future.result().status)


class Matcher(Node):
    """A publisher with callbacks for QoS events."""

    def __init__(self) -> None:
        super().__init__("matcher")
        self.matches: list[int] = []
        callbacks = PublisherEventCallbacks(matched=self.on_matched)
        self.publisher = self.create_publisher(Int64, "numbers", 10, event_callbacks=callbacks)
        self.create_timer(0.01, lambda: self.publisher.publish(Int64(data=1)))

    def on_matched(self, info: Any) -> None:
        self.matches.append(info.current_count)


class Faulty(Node):
    """Callbacks that raise, as commanded."""

    def __init__(self) -> None:
        super().__init__("faulty")
        self.create_service(SetBool, "fail", self.on_fail)
        self.create_subscription(String, "command", self.on_command, 10)

    def on_fail(self, request: Any, response: Any) -> Any:
        if request.data:
            raise ValueError("as requested")
        response.success = True
        return response

    def on_command(self, message: String) -> None:
        if message.data == "exit":
            raise SystemExit
        if message.data == "shutdown":
            rclpy.shutdown()
        if message.data == "hang":
            while True:
                time.sleep(0.01)
        raise ValueError(message.data)


class Configured(Node):
    """Parameters of all kinds, declared as a driver does."""

    def __init__(self) -> None:
        super().__init__("configured", automatically_declare_parameters_from_overrides=True)
        self.create_publisher(String, "scan", 10)
        self.create_publisher(String, "~/private", 10)
        options = QoSOverridingOptions.with_default_policies()
        self.create_publisher(String, "other", 10, qos_overriding_options=options)
        self.create_service(Trigger, "start", lambda _, response: response)
        self.add_on_set_parameters_callback(self.on_set)

    def on_set(self, parameters: list[Parameter]) -> Any:
        refused = any(parameter.value == "bad" for parameter in parameters)
        return SetParametersResult(successful=not refused, reason="bad" if refused else "")


class Sampler(Node):
    """A timer and a rate by the time of the node."""

    def __init__(self) -> None:
        super().__init__("sampler")
        self.times: list[float] = []
        self.create_timer(0.5, self.tick)

    def tick(self) -> None:
        self.times.append(self.get_clock().now().nanoseconds / 1e9)

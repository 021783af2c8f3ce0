"""A hostile neighbor: floods inputs, forges messages and sends requests without sense.

Runs until it is killed. Prints ``ready``.
"""

from __future__ import annotations

import itertools
import json
import random

import rclpy
from builtin_interfaces.msg import Time
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from tests.ros.programs.spinning import spin

FLOOD_S = 0.001
REQUESTS_S = 0.02
STATE = "/hardy/manager/state"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Neighbor(Node):
    def __init__(self) -> None:
        super().__init__("neighbor")
        self.random = random.Random(1)
        self.numbers = itertools.count()
        self.text = self.create_publisher(String, "/text", 10)
        self.state = self.create_publisher(String, STATE, LATCHED)
        self.clock_topic = self.create_publisher(Clock, "/clock", 10)
        self.create_subscription(String, STATE, self.replay, LATCHED)
        self.clients_of_nodes = [
            self.create_client(ChangeState, f"/{name}/change_state")
            for name in ("ticker", "sleeper")
        ]
        self.create_timer(FLOOD_S, self.flood)
        self.create_timer(REQUESTS_S, self.request)

    def flood(self) -> None:
        for _ in range(3):
            self.text.publish(String(data="x" * self.random.choice((0, 10, 10_000))))

    def replay(self, message: String) -> None:
        """Publish a report of the manager again, with another host and an earlier start."""
        if "elsewhere" in message.data or "content" not in message.data:
            return
        document = json.loads(message.data)
        document["content"] |= {"host": "elsewhere", "pid": "1", "started_s": 1.0}
        for _ in range(3):
            self.state.publish(String(data=json.dumps(document)))
        self.state.publish(String())

    def request(self) -> None:
        number = next(self.numbers)
        self.clock_topic.publish(Clock(clock=Time(sec=-number)))
        label = self.random.choice(("", "activate ", "\x1b[2J", "x" * 100_000, "configuring"))
        transition = Transition(id=self.random.choice((0, 99, 200, 255)), label=label)
        for client in self.clients_of_nodes:
            if client.service_is_ready():
                client.call_async(ChangeState.Request(transition=transition))


if __name__ == "__main__":
    rclpy.init()
    spin(Neighbor())

"""A hostile neighbor: floods inputs, forges messages and sends requests without sense.

Runs until it is killed. Prints ``ready``.
"""

from __future__ import annotations

import itertools
import random

import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

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
        self.state = self.create_publisher(DiagnosticArray, STATE, LATCHED)
        self.clock_topic = self.create_publisher(Clock, "/clock", 10)
        self.create_subscription(DiagnosticArray, STATE, self.replay, LATCHED)
        self.clients_of_nodes = [
            self.create_client(ChangeState, f"/{name}/change_state")
            for name in ("ticker", "sleeper")
        ]
        self.create_timer(FLOOD_S, self.flood)
        self.create_timer(REQUESTS_S, self.request)

    def flood(self) -> None:
        for _ in range(3):
            self.text.publish(String(data="x" * self.random.choice((0, 10, 10_000))))

    def replay(self, message: DiagnosticArray) -> None:
        """Publish a status of the manager again, with another host and a larger uptime."""
        values = {item.key: item.value for status in message.status[:1] for item in status.values}
        if values.get("host", "elsewhere") == "elsewhere":
            return
        values |= {"host": "elsewhere", "pid": "1", "uptime": "1e9"}
        forged = [KeyValue(key=key, value=value) for key, value in values.items()]
        for _ in range(3):
            self.state.publish(DiagnosticArray(status=[DiagnosticStatus(values=forged)]))
        self.state.publish(DiagnosticArray())

    def request(self) -> None:
        number = next(self.numbers)
        self.clock_topic.publish(Clock(clock=Time(sec=-number)))
        label = self.random.choice(("", "activate ", "\x1b[2J", "x" * 100_000, "configuring"))
        transition = Transition(id=self.random.choice((0, 99, 200, 255)), label=label)
        for client in self.clients_of_nodes:
            if client.service_is_ready():
                client.call_async(ChangeState.Request(transition=transition))


def main() -> None:
    rclpy.init()
    node = Neighbor()
    print("ready", flush=True)
    rclpy.spin(node)


if __name__ == "__main__":
    main()

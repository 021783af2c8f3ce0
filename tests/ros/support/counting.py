"""A source of numbers, a listener on the same loop, and one on another loop."""

from __future__ import annotations

from typing import Any

from tests.ros.support.in_process import RunningSystem

NUMBERS = """
system: numbers
executors: {other: {kind: KIND}}
nodes:
  source:
    behavior: counting:Source
    publishers:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
  near:
    behavior: counting:Listener
    subscriptions:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
  far:
    executor: other
    behavior: counting:Listener
    subscriptions:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
"""
MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def on_configure(self):
        self.next = 0
        self.sent = []

    def send(self, count):
        for _ in range(count):
            self.sent.append(Int64(data=self.next))
            self.publishers.numbers.publish(self.sent[-1])
            self.next += 1

class Listener(Behavior):
    def on_configure(self):
        self.received = []

    def on_numbers(self, message):
        self.received.append(message)
"""


def send(system: RunningSystem, count: int) -> None:
    """Make the source publish ``number`` messages at once, in a callback of its loop."""
    source = system.node("source")
    source.loop.run(lambda: system.behavior("source").send(count))


def numbers(messages: list[Any]) -> list[int]:
    return [message.data for message in messages]

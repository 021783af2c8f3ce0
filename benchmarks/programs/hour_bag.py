"""Writes a bag of an hour at 100 Hz into the folder that it is given."""

from __future__ import annotations

import sys
from pathlib import Path

from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message

from benchmarks.programs.work import print_result
from composer.bags.bag import NANOSECONDS, BagMessage, BagTopic
from composer.bags.writer import BagWriter

_TOPIC = BagTopic("/sensor_data", "nav_msgs/msg/Odometry")
_PERIOD_NS = 10_000_000
_MESSAGES = 360_000


def main() -> None:
    """Write the bag."""
    writer = BagWriter(Path(sys.argv[1]))
    writer.add_topic(_TOPIC)
    data = bytes(serialize_message(Odometry()))
    for number in range(_MESSAGES):
        at_ns = NANOSECONDS + number * _PERIOD_NS
        writer.write(BagMessage(_TOPIC.name, at_ns, at_ns, data))
    writer.close()
    print_result({"messages": _MESSAGES})


if __name__ == "__main__":
    main()

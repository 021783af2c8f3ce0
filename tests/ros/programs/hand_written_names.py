"""A plain rclpy node that waits for other nodes, and counts the messages of a topic.

Its arguments are the topic (String) and the names of the nodes. Prints ``ready`` once it knows all
of them, then the number of messages so far for each line of stdin; without stdin, the names that
it knows by then.
"""

from __future__ import annotations

import sys
import threading

import rclpy
from std_msgs.msg import String


def main() -> None:
    topic, *expected = sys.argv[1:]
    rclpy.init()
    node = rclpy.create_node("observer")
    received: list[String] = []
    node.create_subscription(String, topic, received.append, 10)

    def answer() -> None:
        for _ in sys.stdin:
            print(len(received), *sorted(node.get_node_names()), flush=True)
        rclpy.try_shutdown()

    threading.Thread(target=answer, daemon=True).start()
    is_ready = False
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.05)
        if not is_ready and set(expected) <= set(node.get_node_names()):
            is_ready = True
            print("ready", flush=True)


if __name__ == "__main__":
    main()

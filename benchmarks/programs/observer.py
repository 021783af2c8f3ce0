"""A participant that does nothing but discover others; a line on stdin asks for its figures."""

from __future__ import annotations

import json
import sys
import time

import rclpy
from rclpy.node import Node

from benchmarks.processes import RESULT_MARK
from benchmarks.programs.work import memory_mb


def main() -> None:
    """Join the ROS graph and answer until stdin is closed."""
    rclpy.init()
    node = Node("observer", start_parameter_services=False, enable_rosout=False)
    for _ in sys.stdin:
        figures = {
            "nodes": len(node.get_node_names()),
            "memory_mb": memory_mb(),
            "cpu_s": time.process_time(),
        }
        print(RESULT_MARK + json.dumps(figures), flush=True)


if __name__ == "__main__":
    main()

"""A program with two nodes, one of them in a namespace; each prints the parameters that it got."""

from __future__ import annotations

import json
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


def main() -> None:
    """Run both nodes."""
    rclpy.init()
    executor = SingleThreadedExecutor()
    nodes = [
        Node(name, namespace=namespace, automatically_declare_parameters_from_overrides=True)
        for name, namespace in (("base", "/"), ("wheels", "/drive"))
    ]
    for node in nodes:
        values = {name: item.value for name, item in node.get_parameters_by_prefix("").items()}
        del values["start_type_description_service"]
        print(node.get_fully_qualified_name(), json.dumps(values, sort_keys=True), flush=True)
        executor.add_node(node)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


main()

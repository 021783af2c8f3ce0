"""Start and stop N idle default rclpy lifecycle nodes, which are destroyed one by one."""

from __future__ import annotations

import rclpy
from rclpy.lifecycle import LifecycleNode

from benchmarks.programs.phases import Phases, size_from_arguments
from benchmarks.programs.work import print_result


def main() -> None:
    """Bring the nodes up and down, and print the timings."""
    size = size_from_arguments()
    phases = Phases()
    phases.starts()
    rclpy.init()
    nodes = [LifecycleNode(f"node_{index}") for index in range(size.nodes)]
    for node in nodes:
        node.trigger_configure()
    for node in nodes:
        node.trigger_activate()
    phases.has_started()
    phases.stops()
    for transition in ("deactivate", "cleanup", "shutdown"):
        for node in reversed(nodes):
            getattr(node, f"trigger_{transition}")()
    for node in reversed(nodes):
        node._state_machine.destroy_when_not_in_use()  # rclpy omits this
        node.destroy_node()
    rclpy.shutdown()
    phases.has_stopped()
    print_result(phases.figures)


if __name__ == "__main__":
    main()

"""N nodes that do nothing, by hand: default rclpy lifecycle nodes, destroyed one by one."""

from __future__ import annotations

import rclpy
from rclpy.lifecycle import LifecycleNode

from benchmarks.programs.phases import Phases, size_from_arguments
from benchmarks.programs.work import hand_over


def main() -> None:
    """Bring the nodes up and down again, tell what that took."""
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
        node._state_machine.destroy_when_not_in_use()  # rclpy forgets it, and the node stays
        node.destroy_node()
    rclpy.shutdown()
    phases.has_stopped()
    hand_over(phases.figures)


if __name__ == "__main__":
    main()

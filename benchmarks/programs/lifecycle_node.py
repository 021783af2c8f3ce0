"""A lifecycle node that runs until it is killed."""

from __future__ import annotations

import rclpy
from rclpy.lifecycle import LifecycleNode


def main() -> None:
    """Run the node /arm."""
    rclpy.init()
    rclpy.spin(LifecycleNode("arm"))


if __name__ == "__main__":
    main()

"""A lifecycle node as anybody would write it, until it is killed."""

from __future__ import annotations

import rclpy
from rclpy.lifecycle import LifecycleNode


def main() -> None:
    """Serve /arm."""
    rclpy.init()
    rclpy.spin(LifecycleNode("arm"))


if __name__ == "__main__":
    main()

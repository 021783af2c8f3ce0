# The deprecated name of `event_handler`.

from rclpy.event_handler import *  # noqa: F403

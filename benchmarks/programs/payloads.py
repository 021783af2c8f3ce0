"""The messages: small, medium and large."""

from __future__ import annotations

import time
from array import array
from typing import Any

from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String

_WIDTH, _HEIGHT, _CHANNELS = 640, 480, 3
_PIXELS = array("B", bytes(_WIDTH * _HEIGHT * _CHANNELS))
_RANGES = array("f", [1.0] * 720)
TYPES = {
    "String": "std_msgs/msg/String",
    "LaserScan": "sensor_msgs/msg/LaserScan",
    "Image": "sensor_msgs/msg/Image",
}
CLASSES = {"String": String, "LaserScan": LaserScan, "Image": Image}


def make(kind: str) -> Any:
    """Return a new message. A String has 32 characters that differ each time."""
    match kind:
        case "LaserScan":
            return LaserScan(ranges=_RANGES, intensities=_RANGES)
        case "Image":
            return Image(
                width=_WIDTH,
                height=_HEIGHT,
                encoding="rgb8",
                step=_WIDTH * _CHANNELS,
                data=_PIXELS,
            )
        case _:
            return String(data=f"{time.monotonic_ns():032}")

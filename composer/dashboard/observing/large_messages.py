"""Large messages, and topics with many bytes per second: only some of their messages are read."""

from __future__ import annotations

from dataclasses import replace

from composer.model.qos import Durability, QosProfile, Reliability

#: Messages of these types are expected to be large; those of others are once one was.
LARGE_TYPES = frozenset(
    f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud2", "PointCloud")
) | {"nav_msgs/msg/OccupancyGrid", "visualization_msgs/msg/MarkerArray"}
LARGE_BYTES = 100_000
#: Of one topic, for one reader. Images with 640 x 480 pixels have less at 30 Hz.
MAX_BYTES_PER_S = 30_000_000
_BURST_S = 0.3
#: Large messages that may wait.
_DEPTH = 5


def large_profile(profile: QosProfile) -> QosProfile:
    """Return a profile to read large messages.

    They are not requested reliably: a reader that is late would delay a publisher. Latched ones,
    such as maps, only arrive if they are.
    """
    few = replace(profile, depth=min(profile.depth, _DEPTH))
    if profile.durability is Durability.VOLATILE:
        return replace(few, reliability=Reliability.BEST_EFFORT)
    return few


class ByteLimit:
    """Says when to read a topic, so that no more than so many bytes per second are read."""

    def __init__(self) -> None:
        self._left = MAX_BYTES_PER_S * _BURST_S
        self._at_s: float | None = None

    def allows(self, now_s: float) -> bool:
        """Return whether to read now, by ``time.monotonic()``."""
        passed_s = 0.0 if self._at_s is None else now_s - self._at_s
        self._at_s = now_s
        self._left = min(self._left + passed_s * MAX_BYTES_PER_S, MAX_BYTES_PER_S * _BURST_S)
        return self._left > 0.0

    def count(self, size: int) -> None:
        """Count a message that was read."""
        self._left -= size

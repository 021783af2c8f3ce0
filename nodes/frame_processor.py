"""Work that benefits from threads: zlib releases the GIL while it compresses."""

from __future__ import annotations

import random
import threading
import zlib

from std_msgs.msg import String

from composer.typed import FrameProcessorBehavior


class FrameProcessor(FrameProcessorBehavior):
    """Compress a frame each time the timer fires; callbacks may overlap on several threads."""

    def on_configure(self) -> None:
        """Create a frame that is half noise, half zeros."""
        size = self.parameters.frame_bytes
        self.frame = random.randbytes(size // 2) + bytes(size - size // 2)  # noqa: S311 - noise

    def on_frame(self) -> None:
        """Compress one frame."""
        compressed = zlib.compress(self.frame)
        thread = threading.current_thread().name
        self.publishers.processed.publish(String(data=f"{thread}: {len(compressed)} bytes"))

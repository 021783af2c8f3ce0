"""Work that gains from threads: zlib leaves Python's lock while it compresses."""

from __future__ import annotations

import os
import threading
import zlib

from std_msgs.msg import String

from composer.behavior import Behavior


class FrameProcessor(Behavior):
    """Compresses a frame each time its timer fires; frames may overlap where threads allow."""

    def on_configure(self) -> None:
        """Make a frame that is worth compressing: half noise, half nothing."""
        size = self.parameters.frame_bytes
        self.frame = os.urandom(size // 2) + bytes(size - size // 2)

    def on_frame(self) -> None:
        """Compress one frame."""
        compressed = zlib.compress(self.frame)
        thread = threading.current_thread().name
        self.publishers.processed.publish(String(data=f"{thread}: {len(compressed)} bytes"))

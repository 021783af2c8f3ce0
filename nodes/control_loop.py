"""A control cycle that is never run twice at once."""

from __future__ import annotations

import threading

from std_msgs.msg import String

from composer.behavior import Behavior


class ControlLoop(Behavior):
    """Publishes the name of its thread in every cycle: always the same one."""

    def on_cycle(self) -> None:
        """Run one cycle."""
        self.publishers.cycles.publish(String(data=threading.current_thread().name))

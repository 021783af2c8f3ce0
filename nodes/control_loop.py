"""A control loop whose cycles never overlap."""

from __future__ import annotations

import threading

from std_msgs.msg import String

from composer.typed import ControlLoopBehavior


class ControlLoop(ControlLoopBehavior):
    """Publish the name of the thread in every cycle: it is always the same."""

    def on_cycle(self) -> None:
        """Run one cycle."""
        self.publishers.cycles.publish(String(data=threading.current_thread().name))

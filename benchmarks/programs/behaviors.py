"""The nodes of the composed systems, as anybody would write them."""

from __future__ import annotations

import time

from std_msgs.msg import String

from benchmarks.programs.work import COUNTS, PAYLOAD, needs_kick
from composer.behavior import Behavior


class Relay(Behavior):
    """Passes messages on."""

    def on_input(self, message: String) -> None:
        """Count the message and pass it on."""
        COUNTS.delivered += 1
        self.publishers.output.publish(message)


class Starter(Relay):
    """The relay that sets the message going."""

    def on_activate(self) -> None:
        """Nothing moves yet."""
        self.seen = 0

    def on_kick(self) -> None:
        """Send a message when none is on its way."""
        if needs_kick(self.seen):
            self.publishers.output.publish(String(data=PAYLOAD))
        self.seen = COUNTS.delivered


class Ticker(Relay):
    """Notes when its timer is called."""

    def on_tick(self) -> None:
        """Note the time."""
        COUNTS.ticks_ns.append(time.monotonic_ns())

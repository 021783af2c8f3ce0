"""The behavior of nodes that compute."""

from __future__ import annotations

import time

from composer.behavior import Behavior

_WORK_STEPS = 100_000  # some milliseconds, many periods of the timer
_WARM_UP_S = 1.0


class Worker(Behavior):
    """Computes almost without a pause, and logs how many results per second it had."""

    def on_activate(self) -> None:
        """Begin the warm-up."""
        self.results = 0
        self.began_s = self.ended_s = time.monotonic() + _WARM_UP_S

    def on_tick(self) -> None:
        """Compute a result."""
        total = 0
        for number in range(_WORK_STEPS):
            total += number
        now_s = time.monotonic()
        if now_s > self.began_s:
            self.results += 1
            self.ended_s = now_s

    def on_deactivate(self) -> None:
        """Log the result."""
        self.log.info(f"results per second: {self.results / (self.ended_s - self.began_s):.1f}")

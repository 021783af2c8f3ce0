"""Refuses parameters."""


class Counter:
    def on_configure(self):
        if self.parameters.lowest > self.parameters.highest:
            raise ValueError("lowest must not be above highest")

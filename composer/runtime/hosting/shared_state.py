"""What an instance adds to the ROS node that it shares with the instances after it."""

from __future__ import annotations

from typing import Any

_SHARED = (
    "_parameters",
    "_descriptors",
    "_pre_set_parameters_callbacks",
    "_on_set_parameters_callbacks",
    "_post_set_parameters_callbacks",
)


class SharedState:
    """Removes the parameters and callbacks that were added since it was created."""

    def __init__(self, node: Any) -> None:
        self._before = [(shared := getattr(node, name), shared.copy()) for name in _SHARED]

    def restore(self) -> None:
        """Remove what was added; what was there before keeps its present value."""
        for shared, before in self._before:
            if isinstance(shared, dict):
                for name in shared.keys() - before.keys():
                    del shared[name]
            else:
                shared[:] = [item for item in shared if item in before]

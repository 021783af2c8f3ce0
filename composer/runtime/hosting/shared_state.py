"""What an instance adds to the ROS node that it shares with the instances after it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

_CALLBACKS = (
    "_pre_set_parameters_callbacks",
    "_on_set_parameters_callbacks",
    "_post_set_parameters_callbacks",
)
_SHARED = ("_parameters", "_descriptors", *_CALLBACKS)


class SharedState:
    """Removes the parameters and callbacks that were added since it was created."""

    def __init__(self, node: Any) -> None:
        self._before = {name: (shared := getattr(node, name), shared.copy()) for name in _SHARED}

    def restore(self) -> None:
        """Remove what was added; what was there before keeps its present value."""
        self._remove(_SHARED)

    def remove_callbacks(self) -> None:
        """Remove the callbacks that were added, but no parameters."""
        self._remove(_CALLBACKS)

    def _remove(self, names: Iterable[str]) -> None:
        for shared, before in map(self._before.__getitem__, names):
            if isinstance(shared, dict):
                for name in shared.keys() - before.keys():
                    del shared[name]
            else:
                shared[:] = [item for item in shared if item in before]

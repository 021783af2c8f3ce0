"""An operation: reads a request, and returns what to run on a worker thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Dashboard
from composer.dashboard.protocol.messages import Values
from composer.fast_dataclass import dataclass

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide
    from composer.remote.session import Deadline

#: Runs on a worker thread, and returns what the browser gets. Raises RequestError or RosError.
Run = Callable[["RosGraphSide", "Deadline"], Any]
#: What to run, and its time limit in seconds.
Prepared = tuple[Run, float]


@dataclass(frozen=True, slots=True)
class Operation:
    """``prepare`` reads the request; it raises BadRequestError and must not block.

    ``changes`` is whether it changes something, which a read-only dashboard refuses.
    """

    prepare: Callable[[Values, Dashboard], Prepared]
    changes: bool = False

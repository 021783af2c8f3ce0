"""What all connections of one dashboard share, and what their operations are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TYPE_CHECKING, Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.access import Access
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feeds
from composer.dashboard.protocol.messages import Values
from composer.dashboard.ros_side import RosSide
from composer.interfaces import Interfaces

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.observing.ros_graph import RosGraph


@dataclass(frozen=True, slots=True)
class Options:
    """How the dashboard was started. ``system`` is what the user wrote, or empty."""

    system: str = ""
    read_only: bool = False
    foxglove: bool = True


@dataclass(frozen=True)
class Dashboard:
    """One running dashboard."""

    options: Options
    access: Access
    declared: Declared | None
    ros: RosSide
    feeds: Feeds
    interfaces: Interfaces
    hello: dict[str, Any] = field(default_factory=dict)


#: Runs on a worker thread, and returns what the browser gets. Raises RequestError or RosError.
Run = Callable[["RosGraph", "Deadline"], Any]
#: What to run, and its time limit in seconds.
Prepared = tuple[Run, float]


@dataclass(frozen=True, slots=True)
class Operation:
    """What a browser can request.

    ``prepare`` reads the request; it raises BadRequestError and must not block. ``changes`` is
    whether it changes something, which a read-only dashboard refuses.
    """

    prepare: Callable[[Values, Dashboard], Prepared]
    changes: bool = False

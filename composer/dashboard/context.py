"""What all connections of one dashboard share."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from composer.dashboard.access import Access
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feeds
from composer.dashboard.ros_side import RosSide
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces


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

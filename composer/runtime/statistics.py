"""What a node has done so far, counted where it happens."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Statistics:
    """Counters of one node. See :class:`composer.runtime.events.NodeSummary` for their meaning."""

    received: int = 0
    sent: int = 0
    calls: int = 0
    dropped: int = 0
    skipped: int = 0
    errors: int = 0

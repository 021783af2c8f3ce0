"""What a system declares held against what runs: pure, so it works and is tested without ROS.

``snapshot`` is what somebody saw of the ROS graph, ``expected`` what a system should look like,
``compare`` the differences, ``patience`` which of them last long enough to be told.
"""

from __future__ import annotations

from composer.drift.compare import compare
from composer.drift.patience import Change, Patience
from composer.drift.report import Drift, DriftKind
from composer.drift.snapshot import EndSeen, NodeSeen, Snapshot

__all__ = [
    "Change",
    "Drift",
    "DriftKind",
    "EndSeen",
    "NodeSeen",
    "Patience",
    "Snapshot",
    "compare",
]

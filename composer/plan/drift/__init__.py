"""Compares a declared system with an observed ROS graph, without using ROS.

``drift`` has the observed graph, describes differences and selects those that last long enough to
be reported; ``compare`` finds them.
"""

from __future__ import annotations

from composer.plan.drift.compare import compare
from composer.plan.drift.drift import (
    Debouncer,
    Drift,
    DriftChange,
    DriftKind,
    ObservedEndpoint,
    ObservedNode,
    ObservedProcess,
    Snapshot,
    is_manager,
)

__all__ = [
    "Debouncer",
    "Drift",
    "DriftChange",
    "DriftKind",
    "ObservedEndpoint",
    "ObservedNode",
    "ObservedProcess",
    "Snapshot",
    "compare",
    "is_manager",
]

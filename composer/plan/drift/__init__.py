"""Compares a declared system with an observed ROS graph, without using ROS.

``snapshot`` is the observed graph, ``compare`` finds the differences, and ``drift`` describes them
and selects those that last long enough to be reported.
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
]

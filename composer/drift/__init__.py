"""Compares a declared system with an observed ROS graph, without using ROS.

``snapshot`` is the observed graph, ``compare`` finds the differences, ``drift`` describes one of
them, and ``debounce`` selects those that last long enough to be reported.
"""

from __future__ import annotations

from composer.drift.compare import compare
from composer.drift.debounce import Debouncer, DriftChange
from composer.drift.drift import Drift, DriftKind
from composer.drift.snapshot import (
    ObservedEndpoint,
    ObservedNode,
    ObservedProcess,
    Snapshot,
    parse_endpoint,
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
    "parse_endpoint",
]

"""Tests of systems and behaviors, in time that the test controls.

``from composer.testing import BehaviorTest`` needs no ROS, ``SystemTest`` does. The fixtures
``behavior_test`` and ``system_test`` of pytest are in :mod:`composer.testing.pytest_plugin`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.testing.behavior_test import BehaviorTest
    from composer.testing.failures import TestFailure
    from composer.testing.system_test import SystemTest

__all__ = ["BehaviorTest", "SystemTest", "TestFailure"]

_MODULES = {
    "BehaviorTest": "behavior_test",
    "SystemTest": "system_test",
    "TestFailure": "failures",
}


def __getattr__(name: str) -> Any:
    """Import a class when it is used: pytest imports this package in every project."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)

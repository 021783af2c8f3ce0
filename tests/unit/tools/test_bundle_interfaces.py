"""The snapshot of interfaces."""

from __future__ import annotations

from tools.bundle_interfaces import definitions


def test_packages_that_are_not_installed_keep_their_definitions() -> None:
    known = {"elsewhere_msgs/msg/Kept": "bool on"}
    assert definitions(known).items() >= known.items()

"""Filters differences that do not last, such as those during bring-up and transitions."""

from __future__ import annotations

from collections.abc import Iterable

from composer.drift.drift import Drift, DriftKind
from composer.fast_dataclass import dataclass

_Identity = tuple[DriftKind, str, str]


@dataclass(frozen=True, slots=True)
class DriftChange:
    """The changes since the last update: new differences, and reported ones that are resolved."""

    appeared: tuple[Drift, ...]
    resolved: tuple[Drift, ...]


class Debouncer:
    """Reports differences that last for at least ``grace_s`` seconds."""

    def __init__(self, grace_s: float) -> None:
        self._grace_s = grace_s
        self._since_s: dict[_Identity, float] = {}
        self._reported: dict[_Identity, Drift] = {}

    @property
    def reported(self) -> tuple[Drift, ...]:
        """The differences that were reported and still exist."""
        return tuple(self._reported.values())

    def update(self, now_s: float, drifts: Iterable[Drift]) -> DriftChange:
        """Process the differences observed at ``now_s``; return what to report.

        A reported difference whose value changes is reported again.
        """
        observed = {drift.identity: drift for drift in drifts}
        self._since_s = {key: self._since_s.get(key, now_s) for key in observed}
        lasting = {
            key: drift
            for key, drift in observed.items()
            if key in self._reported or now_s - self._since_s[key] >= self._grace_s
        }
        appeared = tuple(
            drift for key, drift in lasting.items() if self._reported.get(key) != drift
        )
        resolved = tuple(drift for key, drift in self._reported.items() if key not in lasting)
        self._reported = lasting
        return DriftChange(appeared, resolved)

    def is_settled(self, drifts: Iterable[Drift]) -> bool:
        """Return whether all of ``drifts``, from the last update, have lasted long enough."""
        return all(drift.identity in self._reported for drift in drifts)

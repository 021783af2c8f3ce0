"""Which differences last: starting up and changing over are no drift."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from composer.drift.report import Drift, DriftKind

_Identity = tuple[DriftKind, str, str]


@dataclass(frozen=True, slots=True)
class Change:
    """What is told after a look: differences that have lasted, and told ones that are gone."""

    appeared: tuple[Drift, ...]
    resolved: tuple[Drift, ...]


class Patience:
    """Remembers since when each difference is there. ``grace_s`` is how long it must have been."""

    def __init__(self, grace_s: float) -> None:
        self._grace_s = grace_s
        self._since_s: dict[_Identity, float] = {}
        self._told: dict[_Identity, Drift] = {}

    @property
    def told(self) -> tuple[Drift, ...]:
        """The differences that were told and are still there."""
        return tuple(self._told.values())

    def update(self, now_s: float, drifts: Iterable[Drift]) -> Change:
        """Take in what was seen at ``now_s``; return what is to be told.

        A told difference whose value changes is told again.
        """
        seen = {drift.identity: drift for drift in drifts}
        self._since_s = {key: self._since_s.get(key, now_s) for key in seen}
        lasting = {
            key: drift
            for key, drift in seen.items()
            if key in self._told or now_s - self._since_s[key] >= self._grace_s
        }
        appeared = tuple(drift for key, drift in lasting.items() if self._told.get(key) != drift)
        resolved = tuple(drift for key, drift in self._told.items() if key not in lasting)
        self._told = lasting
        return Change(appeared, resolved)

    def is_settled(self, drifts: Iterable[Drift]) -> bool:
        """Say whether all of ``drifts``, which were just seen, have lasted long enough."""
        return all(drift.identity in self._told for drift in drifts)

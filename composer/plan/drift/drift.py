"""Differences between the declared and the observed system, and which of them last."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span


class DriftKind(StrEnum):
    """The kinds of difference."""

    MISSING_NODE = "missing node"
    EXTRA_NODE = "extra node"
    DUPLICATE_NODE = "duplicate node"
    MISSING_ENDPOINT = "missing endpoint"
    EXTRA_ENDPOINT = "extra endpoint"
    WRONG_TYPE = "wrong type"
    WRONG_QOS = "wrong qos"
    WRONG_STATE = "wrong state"
    MISSING_PARAMETER = "missing parameter"
    WRONG_PARAMETER = "wrong parameter"
    NO_ANSWER = "no answer"


_SENTENCES = {
    DriftKind.MISSING_NODE: "the node does not exist",
    DriftKind.EXTRA_NODE: "the node exists, but is not declared",
    DriftKind.DUPLICATE_NODE: "{live} nodes have this name",
    DriftKind.MISSING_ENDPOINT: "{subject} is missing",
    DriftKind.MISSING_PARAMETER: "{subject} is missing",
    DriftKind.EXTRA_ENDPOINT: "{subject} exists, but is not declared",
    DriftKind.NO_ANSWER: "no response to the request for its {subject}",
}


@dataclass(frozen=True, slots=True)
class Drift:
    """One difference.

    ``node`` is a full name. ``subject`` is the part of it that differs, empty for the node itself.
    ``declared`` and ``live`` describe the two sides, empty if one has nothing. ``span`` is the
    declaration.
    """

    kind: DriftKind
    node: str
    subject: str = ""
    declared: str = ""
    live: str = ""
    hint: str = ""
    span: Span | None = field(default=None, compare=False)

    @property
    def identity(self) -> tuple[DriftKind, str, str]:
        """The identity of the difference, independent of its value."""
        return (self.kind, self.node, self.subject)

    @property
    def message(self) -> str:
        """The difference in one line, without the hint."""
        sentence = _SENTENCES.get(self.kind, "{subject} is {live}, declared {declared}")
        return f"{self.node}: " + sentence.format(
            subject=self.subject, live=self.live, declared=self.declared
        )


@dataclass(frozen=True, slots=True)
class DriftChange:
    """The changes since the last update: new differences, and reported ones that are resolved."""

    appeared: tuple[Drift, ...]
    resolved: tuple[Drift, ...]


class Debouncer:
    """Reports differences that last for at least ``grace_s`` seconds.

    Others come and go during bring-up and transitions.
    """

    def __init__(self, grace_s: float) -> None:
        self._grace_s = grace_s
        self._since_s: dict[tuple[DriftKind, str, str], float] = {}
        self._reported: dict[tuple[DriftKind, str, str], Drift] = {}

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

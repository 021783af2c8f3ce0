"""A difference between what is declared and what runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from composer.source import Span


class DriftKind(StrEnum):
    """What differs."""

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
    DriftKind.MISSING_NODE: "the node is not there",
    DriftKind.EXTRA_NODE: "the node is there, but not declared",
    DriftKind.DUPLICATE_NODE: "{live} nodes have this name",
    DriftKind.MISSING_ENDPOINT: "{subject} is missing",
    DriftKind.MISSING_PARAMETER: "{subject} is missing",
    DriftKind.EXTRA_ENDPOINT: "{subject} is there, but not declared",
    DriftKind.NO_ANSWER: "it does not tell its {subject}",
}


@dataclass(frozen=True, slots=True)
class Drift:
    """One difference.

    ``node`` is a full name; ``subject`` is what of it differs, empty for the node itself.
    ``declared`` and ``live`` are the two sides as people say them, empty where a side has nothing.
    ``span`` is where the declaration stands.
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
        """What makes it the same difference again, even with another value."""
        return (self.kind, self.node, self.subject)

    @property
    def message(self) -> str:
        """Say it in one line, without the hint."""
        said = _SENTENCES.get(self.kind, "{subject} is {live}, declared {declared}")
        return f"{self.node}: " + said.format(
            subject=self.subject, live=self.live, declared=self.declared
        )

"""A difference between the declared and the observed system."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum

from composer.fast_dataclass import dataclass
from composer.source import Span


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

"""Formatting of names, numbers and lists in messages."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from composer.base.diagnostics import MAXIMUM_VALUE_LENGTH, Diagnostic, Label, shown
from composer.base.fast_dataclass import replace
from composer.base.source import Located
from composer.language.rules import CYCLE
from composer.model import PortKind, PortOfNode

_LONG_VALUE = re.compile(rf"'([^']{{{MAXIMUM_VALUE_LENGTH + 1},}})'")


def a(kind: str) -> str:
    """Return the name of a kind with its article: ``an action server``."""
    return f"{'an' if kind[0] in 'ae' else 'a'} {kind}"


def either(kinds: Sequence[PortKind]) -> str:
    """Return the kinds as alternatives: ``a client or an action client``."""
    return " or ".join(a(kind) for kind in kinds)


def listed(names: Sequence[str], limit: int = 3) -> str:
    """Return quoted names joined with ``and``; of a long list, the first ones and a count."""
    quoted = [f"'{name}'" for name in names]
    if len(quoted) > limit:
        quoted[limit - 1 :] = [f"{len(quoted) - limit + 1} others"]
    if len(quoted) == 1:
        return quoted[0]
    return f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def and_others(count: int) -> str:
    """Return the end of a list of which only the first is named: `` and 2 others``, or nothing."""
    return f" and {count} other{'s' if count > 1 else ''}" if count else ""


def number(value: float) -> str:
    """Return a number without trailing zeros: ``50``, not ``50.0``; ``0.1``."""
    return f"{value:.6g}"


def with_short_values(diagnostic: Diagnostic) -> Diagnostic:
    """Return the diagnostic with every quoted value shortened to the maximum length."""
    texts = [
        diagnostic.message,
        diagnostic.hint or "",
        *(label.message for label in diagnostic.related),
    ]
    if not any(len(text) > MAXIMUM_VALUE_LENGTH and _LONG_VALUE.search(text) for text in texts):
        return diagnostic
    return replace(
        diagnostic,
        message=_shorten_values(diagnostic.message),
        hint=_shorten_values(diagnostic.hint) if diagnostic.hint is not None else None,
        related=tuple(
            replace(label, message=_shorten_values(label.message)) for label in diagnostic.related
        ),
    )


def _shorten_values(text: str) -> str:
    return _LONG_VALUE.sub(lambda match: f"'{shown(match[1])}'", text)


def safe_name(name: str) -> str:
    """Return a valid ROS name similar to ``name``."""
    plain = unicodedata.normalize("NFKD", name)
    kept = "".join(
        character if _is_safe(character) else "_" for character in _without_accents(plain)
    )
    joined = re.sub("__+", "_", kept).strip("_")
    return f"n{joined}" if not joined or joined[0].isdigit() else joined


def _without_accents(text: str) -> str:
    """Return ``text`` without combining characters such as accents."""
    return "".join(character for character in text if not unicodedata.combining(character))


def _is_safe(character: str) -> bool:
    return character.isascii() and (character.isalnum() or character == "_")


def port_name(endpoint: PortOfNode) -> str:
    """Return the name of a port in connections: ``planner.sensor_data``."""
    return f"{endpoint.node.name}.{endpoint.port.name}"


def cycle_of(
    noun: str,
    verbs: tuple[str, str],
    links: Sequence[tuple[str, Located[str]]],
    hints: Sequence[str],
) -> Diagnostic:
    """Report things that need each other: ``links`` are their names, each with what it needs.

    ``verbs`` and ``hints`` are for one thing, and for several ones.
    """
    (name, needed), *others = links
    if not others:
        message = f"{noun} '{name}' {verbs[0]} itself"
        return Diagnostic(CYCLE, message, needed.span, hint=hints[0])
    path = " -> ".join((*(item for item, _ in links), name))
    message = f"{noun}s {verbs[1]} each other in a cycle: {path}"
    labels = (Label(other.span, f"'{item}' {verbs[0]} '{other}'") for item, other in others)
    return Diagnostic(CYCLE, message, needed.span, tuple(labels), hints[1])

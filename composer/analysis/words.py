"""How messages put things."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import replace

from composer.diagnostics import LONGEST_ECHO, Diagnostic, shown
from composer.model import PortKind, PortOfNode

_LONG_ECHO = re.compile(rf"'([^']{{{LONGEST_ECHO + 1},}})'")


def a(kind: PortKind) -> str:
    """Return the kind with its article: ``an action server``."""
    return f"{'an' if kind.value.startswith('a') else 'a'} {kind}"


def either(kinds: Sequence[PortKind]) -> str:
    """Return the kinds as alternatives: ``a client or an action client``."""
    return " or ".join(a(kind) for kind in kinds)


def listed(names: Sequence[str], limit: int = 3) -> str:
    """Return names in quotes, with ``and``; of many the first ones and how many more."""
    quoted = [f"'{name}'" for name in names]
    if len(quoted) > limit:
        quoted[limit - 1 :] = [f"{len(quoted) - limit + 1} others"]
    if len(quoted) == 1:
        return quoted[0]
    return f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def number(value: float) -> str:
    """Return a number without needless digits: ``50``, not ``50.0``; ``0.1``."""
    return f"{value:.6g}"


def with_short_echoes(finding: Diagnostic) -> Diagnostic:
    """Return the finding with every quoted value cut to the length that messages echo."""
    texts = [finding.message, finding.hint or "", *(label.message for label in finding.related)]
    if all(len(text) <= LONGEST_ECHO for text in texts):
        return finding
    return replace(
        finding,
        message=_cut_echoes(finding.message),
        hint=_cut_echoes(finding.hint) if finding.hint is not None else None,
        related=tuple(
            replace(label, message=_cut_echoes(label.message)) for label in finding.related
        ),
    )


def _cut_echoes(text: str) -> str:
    return _LONG_ECHO.sub(lambda found: f"'{shown(found[1])}'", text)


def safe_name(name: str) -> str:
    """Return a valid ROS name made of what can be kept of ``name``."""
    plain = unicodedata.normalize("NFKD", name)
    kept = "".join(character if _is_safe(character) else "_" for character in _base(plain))
    joined = re.sub("__+", "_", kept).strip("_")
    return f"n{joined}" if not joined or joined[0].isdigit() else joined


def _base(text: str) -> str:
    """Return ``text`` without the accents that were taken off its letters."""
    return "".join(character for character in text if not unicodedata.combining(character))


def _is_safe(character: str) -> bool:
    return character.isascii() and (character.isalnum() or character == "_")


def end_name(end: PortOfNode) -> str:
    """Return a port as connections name it: ``planner.sensor_data``."""
    return f"{end.node.name}.{end.port.name}"

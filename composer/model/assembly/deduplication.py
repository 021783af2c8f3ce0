"""Deduplicate diagnostics of copies, and label those in included files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Map

from composer.base.diagnostics import Diagnostic, Label
from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located, Span
from composer.model import Node

_QUOTED = re.compile(r"'([^']*)'")
_BETWEEN_NAMES = re.compile(r"[./\s]+")
_WORD = re.compile(r"\w+")
_MAX_PLACES = 3  # for a file that is included many times


def add_include_labels(
    diagnostics: Iterable[Diagnostic], included: Map[str, tuple[Span, ...]]
) -> list[Diagnostic]:
    """Return the diagnostics; those in included files get labels where these are included."""
    labeled = []
    for diagnostic in diagnostics:
        labels = tuple(_includes(diagnostic.primary.file.path, included))
        related = (*diagnostic.related, *labels)
        labeled.append(replace(diagnostic, related=related) if labels else diagnostic)
    return labeled


def _includes(path: str, included: Map[str, tuple[Span, ...]]) -> Iterator[Label]:
    """Yield the places that include a file, then those that include that file's includer."""
    visited: set[str] = set()
    while path in included and path not in visited:
        visited.add(path)
        spans = included[path]
        yield from (Label(span, "included here") for span in spans[:_MAX_PLACES])
        path = spans[0].file.path


def deduplicate(diagnostics: Iterable[Diagnostic], nodes: Iterable[Node]) -> list[Diagnostic]:
    """Return the diagnostics without repetitions for copies of a node.

    ``nodes`` are all nodes of the system; copies are nodes that were made from the same entry.
    """
    copies = _Copies.among(nodes)
    unique: dict[tuple[str, str, str], Diagnostic] = {}
    for diagnostic in diagnostics:
        message = copies.without_names(diagnostic)
        unique.setdefault((diagnostic.rule.code, str(diagnostic.primary), message), diagnostic)
    return list(unique.values())


@dataclass(frozen=True, slots=True)
class _Copies:
    """The names of copies, and the prefixes and namespaces that includes added to names."""

    names: frozenset[str]
    prefixes: tuple[str, ...]

    @classmethod
    def among(cls, nodes: Iterable[Node]) -> _Copies:
        by_place: dict[str, list[Node]] = {}
        for node in nodes:
            by_place.setdefault(str(node.name.span), []).append(node)
        copies = [node for found in by_place.values() if len(found) > 1 for node in found]
        prefixes = dict.fromkeys(_prefix(node.name) for node in copies)
        namespaces = dict.fromkeys(f"{node.namespace.value.strip('/')}/" for node in copies)
        return cls(
            frozenset(node.name.value for node in copies),
            (*filter(None, prefixes), *(name for name in namespaces if name != "/")),
        )

    def without_names(self, diagnostic: Diagnostic) -> str:
        """Return the message without the names that differ between copies."""
        if not self.names:
            return diagnostic.message
        if "${" in diagnostic.primary.text:
            return _QUOTED.sub("''", diagnostic.message)
        message = _QUOTED.sub(self._without_name, diagnostic.message)
        return _WORD.sub(lambda word: "" if word[0] in self.names else word[0], message)

    def _without_name(self, quoted: re.Match[str]) -> str:
        text = quoted[1]
        if text.startswith(("/", *self.prefixes)):
            return "''"
        is_copy = any(name in self.names for name in _BETWEEN_NAMES.split(text))
        return "''" if is_copy else quoted[0]


def _prefix(name: Located[str]) -> str:
    """Return the prefix that was added to a name; empty if the written name is another."""
    written = name.span.text
    return name.value[: -len(written)] if written and name.value.endswith(written) else ""

"""What is reported: the diagnostics of a file, and of several files together.

Diagnostics of copies of a node are reported once; those in included files have labels.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator
from collections.abc import Mapping as Map
from contextlib import suppress
from itertools import takewhile
from pathlib import Path
from typing import TypeAlias

from composer.base.diagnostics import Diagnostic, Label, has_errors, in_order
from composer.base.fast_dataclass import dataclass, replace
from composer.base.files import read_regular
from composer.base.source import Located, SourceFile, Span
from composer.interfaces import Interfaces
from composer.language.rules import MAX_BYTES
from composer.language.tree import Mapping
from composer.model import Node, System
from composer.model.scenario import Scenario
from composer.project import Project
from composer.project.node_types import NodeTypes
from composer.project.settings import apply_rule_settings
from composer.rules.ignore_comments import without_ignored
from composer.rules.implementations import unused_node_types

#: What identifies a diagnostic across the systems in which it appears: its rule and place.
Identity: TypeAlias = tuple[str, str]
#: Rules whose diagnostics may be about node types, also those that were left out as follow-ups.
_HIDING_NODE_TYPES = ("bad-setting", "unknown-base", "unknown-node-type")
_QUOTED = re.compile(r"'([^']*)'")
_BETWEEN_NAMES = re.compile(r"[./\s]+")
_WORD = re.compile(r"\w+")
_MAX_PLACES = 3  # for a file that is included many times


@dataclass(frozen=True, slots=True)
class LoadResult:
    """The model and the diagnostics of a file.

    ``system`` is None if too little of the file could be read. ``node_types`` and ``interfaces``
    are the definitions that the file could refer to. ``tree`` is the file merged with everything
    that it includes or extends.
    """

    system: System | None
    diagnostics: list[Diagnostic]
    source: SourceFile
    project: Project
    node_types: NodeTypes
    interfaces: Interfaces
    tree: Mapping | None = None
    #: What was left out because it follows from another diagnostic, also if other systems with
    #: the same node types report it; and the used comments that they would report as unused.
    follow_ups: frozenset[Identity] = frozenset()
    #: The models with the other combinations of arguments, if all of them were checked.
    other_systems: tuple[System, ...] = ()
    #: The file itself if it is a scenario; ``system`` is its system, with its changes.
    scenario: Scenario | None = None

    @property
    def is_valid(self) -> bool:
        """True for a system or node type without errors."""
        return self.system is not None and not has_errors(self.diagnostics)

    @property
    def is_runnable(self) -> bool:
        """True for a system without errors."""
        return self.system is not None and not self.system.node_type and self.is_valid


def collect_diagnostics(results: Collection[LoadResult]) -> list[Diagnostic]:
    """Return the diagnostics of all files together, each once.

    A diagnostic in a file that was loaded itself is reported with that file, not with the systems
    that include or use it; any other is reported with the first of these systems.
    """
    reporter: dict[Identity, LoadResult] = {}
    for result in results:
        for diagnostic in result.diagnostics:
            if diagnostic.primary.file == result.source:
                reporter[identity(diagnostic)] = result
    diagnostics = project_diagnostics(results)
    follow_ups = frozenset().union(*(result.follow_ups for result in results))
    for result in results:
        diagnostics += (
            diagnostic
            for diagnostic in result.diagnostics
            if identity(diagnostic) not in follow_ups
            and reporter.setdefault(identity(diagnostic), result) is result
        )
    return in_order(diagnostics)


def identity(diagnostic: Diagnostic) -> Identity:
    """Return what identifies a diagnostic across the systems in which it appears."""
    return (diagnostic.rule.code, str(diagnostic.primary))


def _lacks_node_types(result: LoadResult) -> bool:
    """Return whether a system may use node types that are not in its model."""
    rules = {diagnostic.rule.name for diagnostic in result.diagnostics}
    return result.system is None or not rules.isdisjoint(_HIDING_NODE_TYPES)


def project_diagnostics(results: Collection[LoadResult]) -> list[Diagnostic]:
    """Return the diagnostics that need several files, such as unused node types."""
    systems = [
        system
        for result in results
        for system in (result.system, *result.other_systems)
        if system is not None
    ]
    if any(_lacks_node_types(result) for result in results):
        return []
    settings = {result.source.path: result.project.settings for result in results}
    diagnostics: list[Diagnostic] = []
    for diagnostic in unused_node_types(systems):
        file = diagnostic.primary.file
        kept, _ = without_ignored([diagnostic], file, complete=False)
        diagnostics += apply_rule_settings(kept, settings[file.path])
    return in_order(diagnostics)


def may_be_included(path: Path, project: Project, checked: Collection[Path]) -> bool:
    """Return whether a file next to or above this one, which is not checked now, names it."""
    folders = takewhile(project.holds, path.parents)
    for other in (item for folder in folders for item in folder.glob("*.y*ml")):
        if other not in checked and project.holds(other):
            with suppress(OSError):
                if os.fsencode(path.name) in read_regular(other, MAX_BYTES):
                    return True
    return False


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

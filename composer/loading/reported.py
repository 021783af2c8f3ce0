"""What is reported: the diagnostics of a file, and of several files together."""

from __future__ import annotations

import os
from collections.abc import Collection
from contextlib import suppress
from itertools import takewhile
from pathlib import Path
from typing import TypeAlias

from composer.base.diagnostics import Diagnostic, has_errors, in_order
from composer.base.fast_dataclass import dataclass
from composer.base.files import read_regular
from composer.base.source import SourceFile
from composer.interfaces import Interfaces
from composer.language.document.limits import MAX_BYTES
from composer.language.tree import Mapping
from composer.model import System
from composer.model.scenario import Scenario
from composer.project import Project
from composer.project.node_types import NodeTypes
from composer.project.settings import apply_rule_settings
from composer.rules.ignore_comments import without_ignored
from composer.rules.implementations import unused_node_types

#: What identifies a diagnostic across the systems in which it appears: its rule and place.
Identity: TypeAlias = tuple[str, str]


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


#: Rules whose diagnostics may be about node types, also those that were left out as follow-ups.
_HIDING_NODE_TYPES = ("bad-setting", "unknown-base", "unknown-node-type")


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

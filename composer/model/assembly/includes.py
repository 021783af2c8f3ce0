"""Merge a system with everything that it includes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import field, replace
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Label, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.expand import expand, missing_values
from composer.language.rules import CYCLE, EMPTY_COLLECTION, MAX_INCLUDE_DEPTH
from composer.language.schema import SYSTEM, check_schema, with_intended_sections
from composer.language.tree import (
    Entry,
    LeftOut,
    Mapping,
    Tree,
    count_values,
    entries,
    items,
    plain,
    plain_text,
)
from composer.model.assembly.include_entries import (
    PREFIXED,
    Include,
    IncludeReader,
    SystemFile,
    add_namespace,
    read_include,
)
from composer.model.assembly.limits import SystemLimits, exceeded
from composer.model.assembly.merging import INCLUDE, Part, apply_overrides, join_parts
from composer.model.assembly.references import (
    WILDCARD,
    expand_references,
    without_empty_processes,
    without_left_out,
)


@dataclass(frozen=True, slots=True)
class _Frame:
    """A file that is being merged, and the place where it includes the next one."""

    file: SystemFile
    span: Span


@dataclass(frozen=True, slots=True)
class IncludedSystem:
    """A system with the arguments and overrides of an include."""

    tree: Mapping
    include: Include
    file: SystemFile


@dataclass(slots=True)
class IncludeResolver:
    """Merges systems with the files that they include.

    ``is_partial`` is true if an included file is unavailable. ``folders`` are the folders of all
    files and ``included`` the places that include them, each once, by file name. ``left_out`` are
    the entries that conditions leave out of the file that was merged last, ``values`` the number of
    keys and values of all files as written and as expanded, each time that they are merged.
    """

    reader: IncludeReader
    limits: SystemLimits
    diagnostics: list[Diagnostic]
    is_partial: bool = False
    folders: dict[str, Path] = field(default_factory=dict)
    included: dict[str, dict[str, Span]] = field(default_factory=dict)
    left_out: tuple[LeftOut, ...] = ()
    values: int = 0
    _stack: list[_Frame] = field(default_factory=list)

    def merge(self, file: SystemFile, arguments: dict[str, Entry]) -> Mapping:
        """Return ``file`` with ``arguments`` for its variables, merged with its includes.

        Raises Stopped.
        """
        self.folders[file.source.path] = file.path.parent
        tree, misspelled = with_intended_sections(file.tree, SYSTEM)
        self.diagnostics += misspelled
        expanded, found, left_out, values = expand(tree, arguments)
        self.values += count_values(file.tree) + values
        if self._stack:
            self.limits.count("values", values, self._stack[-1].span)
            span = self._stack[-1].span
            found += missing_values(tree, arguments, span, "the file", "include")
        found += _without_emptied(check_schema(expanded, SYSTEM), tree)
        self.diagnostics += found
        includes = expanded.get(INCLUDE)
        lines = _lines_of_includes(expanded)
        if any(item.primary.line in lines and item.primary.file == file.source for item in found):
            self.is_partial = True
        all_left_out = [*left_out]
        for absent in left_out:
            if absent.include is not None:
                all_left_out += self._nodes_of(absent, absent.include, file)
        parts = []
        for item in items(includes):
            part = self._part(item, file)
            if part is not None:
                parts.append(part)
                all_left_out += part.left_out
        conflicts: list[Diagnostic] = []
        joined = join_parts(expanded, parts, conflicts)
        # The copies of an include with an error may have the same names because of it, and an
        # entry with an error may differ from another one because of it.
        if not self.is_partial:
            wrong = {(item.primary.file.path, item.primary.line) for item in self.diagnostics}
            self.diagnostics += (item for item in conflicts if not _lines(item) & wrong)
        self.left_out = tuple(all_left_out)
        whole = expand_references(joined, self.left_out, self.limits)
        return whole if self._stack else without_empty_processes(whole, self.left_out)

    def _part(self, item: Tree, includer: SystemFile) -> Part | None:
        included = self.included_system(item, includer)
        if included is None:
            return None
        include, file = included.include, included.file
        placed = add_namespace(
            included.tree, include.placement, includer.path.parent, file.path.parent
        )
        prefix = include.placement.prefix
        prefixed = (
            replace(item, name=f"{prefix}{item.name}") if item.section in PREFIXED else item
            for item in self.left_out
        )
        return Part(placed, include.naming, tuple(prefixed))

    def included_system(self, item: Tree, includer: SystemFile) -> IncludedSystem | None:
        """Return the system that an entry of ``include`` names, with its arguments and overrides.

        It is not placed in a namespace. None if it is unavailable; the reason is reported. Raises
        Stopped.
        """
        include = read_include(item, self.diagnostics)
        if include is None:
            self.is_partial = True
            return None
        self.limits.count("includes", 1, include.file.span)
        file = self.reader.read(include.file, includer.path.parent, includer.source)
        if file is None:
            self.is_partial = True
            return None
        self._stack.append(_Frame(includer, include.file.span))
        try:
            if self._is_cycle(file):
                return None
            return IncludedSystem(self._merge_included(file, include), include, file)
        finally:
            self._stack.pop()

    def _nodes_of(self, absent: LeftOut, item: Tree, includer: SystemFile) -> Iterator[LeftOut]:
        """Yield the nodes of an include that is left out. Its errors are not reported.

        If its file is unavailable, any name with its prefix may be one of its nodes.
        """
        diagnostics, is_partial = len(self.diagnostics), self.is_partial
        part = self._part(item, includer)
        del self.diagnostics[diagnostics:]
        self.is_partial = is_partial
        if part is None:
            prefix = plain_text(item.get("prefix")) if isinstance(item, Mapping) else ""
            yield replace(absent, section="nodes", name=f"{prefix}{WILDCARD}", include=None)
            return
        for node in entries(part.tree.get("nodes")):
            yield replace(absent, section="nodes", name=node.name, include=None)
        yield from part.left_out

    def _merge_included(self, file: SystemFile, include: Include) -> Mapping:
        span = include.file.span
        if len(self._stack) > MAX_INCLUDE_DEPTH:
            message = f"files include each other more than {MAX_INCLUDE_DEPTH} deep"
            raise exceeded(message, span, "include the file directly")
        self.included.setdefault(file.source.path, {}).setdefault(str(span), span)
        tree = self.merge(file, include.arguments)
        if include.overrides is not None:
            # In a partial tree, an unknown name is not known to be an error.
            diagnostics: list[Diagnostic] = [] if self.is_partial else self.diagnostics
            overrides = without_left_out(include.overrides, self.left_out)
            tree = apply_overrides(tree, overrides, file.source, diagnostics)
            diagnostics += check_schema(tree, SYSTEM)
        return tree

    def _is_cycle(self, file: SystemFile) -> bool:
        """Return whether ``file`` is being merged already, and report the cycle."""
        numbers = [
            number for number, frame in enumerate(self._stack) if frame.file.path == file.path
        ]
        if not numbers:
            return False
        self.is_partial = True
        self.diagnostics.append(_cycle(self._stack[numbers[0] :]))
        return True


def _cycle(frames: list[_Frame]) -> Diagnostic:
    """Report a cycle, starting at its first file by name: one diagnostic for all entry points."""
    paths = [frame.file.source.path for frame in frames]
    first = paths.index(min(paths))
    frames, paths = frames[first:] + frames[:first], paths[first:] + paths[:first]
    spans = [frame.span for frame in frames]
    if len(frames) == 1:
        message = f"'{shown(paths[0])}' includes itself"
        return Diagnostic(CYCLE, message, spans[0], hint="remove the include")
    cycle = " -> ".join(map(shown, [*paths, paths[0]]))
    labels = tuple(Label(span, "through this") for span in spans[1:])
    return Diagnostic(CYCLE, f"this includes itself: {cycle}", spans[0], labels)


def _without_emptied(found: list[Diagnostic], written: Mapping) -> Iterator[Diagnostic]:
    """Yield diagnostics, except of sections that are empty because of conditions."""
    sections = {str(entry.key.span): entry.value for entry in written}
    for item in found:
        section = sections.get(str(item.primary)) if item.rule is EMPTY_COLLECTION else None
        if section is None or not plain(section):
            yield item


def _lines(conflict: Diagnostic) -> set[tuple[str, int]]:
    """Return the lines of the entries in conflict, as they are usually written."""
    spans = (conflict.primary, *(label.span for label in conflict.related))
    return {(span.file.path, span.line) for span in spans}


def _lines_of_includes(tree: Mapping) -> range:
    """Return the lines of the section ``include`` of a file; none if it is not there."""
    section = tree.entry(INCLUDE)
    if section is None:
        return range(0)
    start, file = section.key.span.line, section.key.span.file
    starts = (entry.key.span.line for entry in tree if entry.key.span.file == file)
    return range(start, min((line for line in starts if line > start), default=sys.maxsize))

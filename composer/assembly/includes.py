"""A system with everything that it includes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from composer.assembly.include_entries import Include, IncludeReader, SystemFile, read_include
from composer.assembly.joining import INCLUDE, Part, join_parts
from composer.assembly.limits import IncludeLimits, LimitExceeded
from composer.assembly.merging import apply_overrides
from composer.assembly.namespacing import add_namespace
from composer.assembly.rules import INCLUDE_CYCLE
from composer.assembly.wildcards import Wildcards
from composer.diagnostics import Diagnostic, Label, shown
from composer.document.limits import MAX_INCLUDE_DEPTH
from composer.expand import expand
from composer.expand.scope import measure
from composer.schema import check_schema
from composer.schema.kinds import SYSTEM
from composer.source import SourceFile, Span
from composer.tree import Entry, Mapping, Sequence, Tree


@dataclass(frozen=True, slots=True)
class _Link:
    """A file on the way from the system to what it includes, and where it includes the next."""

    file: SystemFile
    span: Span


@dataclass(slots=True)
class IncludeResolver:
    """Puts systems together. What was met on the way is kept.

    ``is_partial`` is true when something that is included could not be had. By what the files are
    called, ``folders`` are where they are, ``included`` where each was included.
    """

    reader: IncludeReader
    limits: IncludeLimits
    diagnostics: list[Diagnostic]
    is_partial: bool = False
    folders: dict[str, Path] = field(default_factory=dict)
    included: dict[str, tuple[Span, ...]] = field(default_factory=dict)
    _stack: list[_Link] = field(default_factory=list)

    def merge(self, file: SystemFile, arguments: dict[str, Tree]) -> Mapping:
        """Return what ``file`` says with ``arguments`` for its variables. Raises LimitExceeded."""
        self.folders[file.source.path] = file.path.parent
        expanded, found = expand(file.tree, arguments)
        if self._stack:
            self.limits.add(measure(expanded).values, self._stack[-1].span)
        self.diagnostics += found
        self.diagnostics += check_schema(expanded, SYSTEM)
        asked = expanded.get(INCLUDE)
        parts = [
            part
            for item in (asked.items if isinstance(asked, Sequence) else ())
            if (part := self._part(item, file)) is not None
        ]
        return self._expand_wildcards(join_parts(expanded, parts, self.diagnostics))

    def _part(self, item: Tree, includer: SystemFile) -> Part | None:
        include = read_include(item, self.diagnostics)
        if include is None:
            self.is_partial = True
            return None
        self.limits.include(include.file.span)
        file = self.reader.read(include.file, includer.path.parent, includer.source)
        if file is None:
            self.is_partial = True
            return None
        self._stack.append(_Link(includer, include.file.span))
        try:
            return None if self._is_cycle(file) else self._merge_included(file, include)
        finally:
            self._stack.pop()

    def _merge_included(self, file: SystemFile, include: Include) -> Part:
        span = include.file.span
        if len(self._stack) > MAX_INCLUDE_DEPTH:
            raise LimitExceeded(
                f"files include each other more than {MAX_INCLUDE_DEPTH} deep", span
            )
        known = self.included.get(file.source.path, ())
        self.included[file.source.path] = (*known, span)
        tree = self.merge(file, include.arguments)
        if include.overrides is not None:
            # What is not there cannot be missed.
            diagnostics: list[Diagnostic] = [] if self.is_partial else self.diagnostics
            tree = apply_overrides(tree, include.overrides, file.source, diagnostics)
            diagnostics += check_schema(tree, SYSTEM)
        whole = add_namespace(tree, include.placement, self._folder(), file.path.parent)
        return Part(whole, span)

    def _is_cycle(self, file: SystemFile) -> bool:
        """Say whether ``file`` includes itself by way of the last files, and tell it."""
        numbers = [number for number, link in enumerate(self._stack) if link.file.path == file.path]
        if not numbers:
            return False
        self.is_partial = True
        self.diagnostics.append(_cycle(self._stack[numbers[0] :]))
        return True

    def _folder(self) -> Path:
        return self._stack[-1].file.path.parent

    def _expand_wildcards(self, tree: Mapping) -> Mapping:
        """Return the system with names in the place of patterns."""
        nodes = tree.get("nodes")
        names = tuple(entry.name for entry in nodes) if isinstance(nodes, Mapping) else ()
        wildcards = Wildcards(names, self.limits)
        changes = {"nodes": wildcards.in_nodes, "connections": wildcards.in_connections}
        return Mapping(
            tuple(
                Entry(entry.key, changes[entry.name](entry.value))
                if entry.name in changes
                else entry
                for entry in tree
            ),
            tree.span,
        )


def _cycle(links: list[_Link]) -> Diagnostic:
    """Tell a circle, from the first of its files by name, so that it is one from wherever."""
    paths = [link.file.source.path for link in links]
    first = paths.index(min(paths))
    links = links[first:] + links[:first]
    paths = paths[first:] + paths[:first]
    circle = " -> ".join(map(shown, [*paths, paths[0]]))
    spans = [link.span for link in links]
    labels = tuple(Label(span, "by way of this") for span in spans[1:])
    return Diagnostic(INCLUDE_CYCLE, f"this includes itself: {circle}", spans[0], labels)


def system_file(tree: Mapping, source: SourceFile, folder: Path) -> SystemFile:
    """Return the file that everything begins with."""
    return SystemFile(folder / Path(source.path).name, source, tree)

"""A system with everything that it includes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from composer.assembly.budget import Budget, TooMuch
from composer.assembly.joining import INCLUDE, Part, joined
from composer.assembly.overriding import overridden
from composer.assembly.placing import placed
from composer.assembly.reading import File, Include, Reader, read_include
from composer.assembly.rules import INCLUDE_CYCLE
from composer.assembly.wildcards import Wildcards
from composer.diagnostics import Diagnostic, Label, shown
from composer.document.limits import MAX_INCLUDE_DEPTH
from composer.expand import expand
from composer.expand.scope import measured
from composer.schema import check_schema
from composer.schema.kinds import SYSTEM
from composer.source import SourceFile, Span
from composer.tree import Entry, Mapping, Sequence, Tree


@dataclass(frozen=True, slots=True)
class _Link:
    """A file on the way from the system to what it includes, and where it includes the next."""

    file: File
    span: Span


@dataclass(slots=True)
class Including:
    """Puts systems together. What was met on the way is kept.

    ``is_partial`` is true when something that is included could not be had. By what the files are
    called, ``folders`` are where they are, ``included`` where each was included.
    """

    reader: Reader
    budget: Budget
    findings: list[Diagnostic]
    is_partial: bool = False
    folders: dict[str, Path] = field(default_factory=dict)
    included: dict[str, tuple[Span, ...]] = field(default_factory=dict)
    _way: list[_Link] = field(default_factory=list)

    def whole(self, file: File, arguments: dict[str, Tree]) -> Mapping:
        """Return what ``file`` says with ``arguments`` for its variables. Raises TooMuch."""
        self.folders[file.source.path] = file.path.parent
        expanded, found = expand(file.tree, arguments)
        if self._way:
            self.budget.add(measured(expanded).values, self._way[-1].span)
        self.findings += found
        self.findings += check_schema(expanded, SYSTEM)
        asked = expanded.get(INCLUDE)
        parts = [
            part
            for item in (asked.items if isinstance(asked, Sequence) else ())
            if (part := self._part(item, file)) is not None
        ]
        return self._filled_in(joined(expanded, parts, self.findings))

    def _part(self, item: Tree, includer: File) -> Part | None:
        include = read_include(item, self.findings)
        if include is None:
            self.is_partial = True
            return None
        self.budget.include(include.file.span)
        file = self.reader.read(include.file, includer.path.parent, includer.source)
        if file is None:
            self.is_partial = True
            return None
        self._way.append(_Link(includer, include.file.span))
        try:
            return None if self._is_on_the_way(file) else self._included(file, include)
        finally:
            self._way.pop()

    def _included(self, file: File, include: Include) -> Part:
        span = include.file.span
        if len(self._way) > MAX_INCLUDE_DEPTH:
            raise TooMuch(f"files include each other more than {MAX_INCLUDE_DEPTH} deep", span)
        known = self.included.get(file.source.path, ())
        self.included[file.source.path] = (*known, span)
        tree = self.whole(file, include.arguments)
        if include.overrides is not None:
            # What is not there cannot be missed.
            findings: list[Diagnostic] = [] if self.is_partial else self.findings
            tree = overridden(tree, include.overrides, file.source, findings)
            findings += check_schema(tree, SYSTEM)
        whole = placed(tree, include.position, self._folder(), file.path.parent)
        return Part(whole, span)

    def _is_on_the_way(self, file: File) -> bool:
        """Say whether ``file`` includes itself by way of the last files, and tell it."""
        numbers = [number for number, link in enumerate(self._way) if link.file.path == file.path]
        if not numbers:
            return False
        self.is_partial = True
        self.findings.append(_cycle(self._way[numbers[0] :]))
        return True

    def _folder(self) -> Path:
        return self._way[-1].file.path.parent

    def _filled_in(self, tree: Mapping) -> Mapping:
        """Return the system with names in the place of patterns."""
        nodes = tree.get("nodes")
        names = tuple(entry.name for entry in nodes) if isinstance(nodes, Mapping) else ()
        wildcards = Wildcards(names, self.budget)
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


def system_file(tree: Mapping, source: SourceFile, folder: Path) -> File:
    """Return the file that everything begins with."""
    return File(folder / Path(source.path).name, source, tree)

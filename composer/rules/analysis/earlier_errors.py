"""Which parts of a system contain earlier errors, so that names may be missing from the model."""

from __future__ import annotations

from bisect import bisect_right

from composer.base.diagnostics import nearest
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.model import Node, PortKind
from composer.rules.analysis.context import Context

PORT_SECTIONS = tuple(kind.section for kind in PortKind)
SECTIONS = (*PORT_SECTIONS, "parameters", "state", "timers", "transforms")

_NEARBY_LINES = 8


@dataclass(frozen=True, slots=True)
class EarlierErrors:
    """The parts of a system that contain errors of earlier stages.

    ``nodes`` are the keys of the nodes that contain one. ``elsewhere`` is true if another part of
    the system contains one, such as connections or profiles. ``misspelled`` are pairs of a node and
    a section (``publishers``) whose key is probably misspelled: its content is not in the model.
    """

    nodes: frozenset[str]
    elsewhere: bool
    misspelled: frozenset[tuple[str, str]] = frozenset()

    @property
    def any(self) -> bool:
        """Whether there is any earlier error."""
        return self.elsewhere or bool(self.nodes)

    def may_declare(self, node: str, *sections: str) -> bool:
        """Return whether a section of a node may declare more than the model contains."""
        return not self.misspelled.isdisjoint((node, section) for section in sections)


def earlier_errors(context: Context) -> EarlierErrors:
    """Locate the errors of the stages before the rules."""
    system = context.system
    node_files = _node_files(context)
    files = {span.file.path for span in context.refused} - node_files.keys()
    affected = {node.name.value for node in system.nodes if _files(node) & files}
    elsewhere = context.is_partial
    misspelled: set[tuple[str, str]] = set()
    for span in context.refused:
        node_file = node_files.get(span.file.path)
        names = node_file.nodes_at(span) if node_file is not None else ()
        if node_file is not None and not names:
            elsewhere = True
        affected.update(names)
        section = nearest(span.text, SECTIONS) if names else None
        if section is not None:
            misspelled.update((name, section) for name in names)
    return EarlierErrors(frozenset(affected), elsewhere, frozenset(misspelled))


def is_misspelled(context: Context, key: str, near: Span) -> bool:
    """Return whether an earlier error next to ``near`` is about a misspelling of ``key``.

    The keys of a map are on one line, or on lines that follow each other.
    """
    return any(
        abs(span.line - near.line) <= _NEARBY_LINES
        and span.file == near.file
        and nearest(span.text, [key]) is not None
        for span in context.refused
    )


@dataclass(frozen=True, slots=True)
class _NodeFile:
    """A file that declares nodes: where each node starts, and where the last one ends."""

    starts: list[tuple[int, int]]
    names: dict[tuple[int, int], list[str]]  # several if one entry creates several nodes
    end: tuple[int, int] | None

    def nodes_at(self, span: Span) -> list[str]:
        """Return the nodes that contain ``span``."""
        place = (span.line, span.column)
        index = bisect_right(self.starts, place) - 1
        if index < 0 or (self.end is not None and place >= self.end):
            return []
        return self.names[self.starts[index]]


def _node_files(context: Context) -> dict[str, _NodeFile]:
    """Return the files that declare the nodes of the system, and the system file, by path."""
    system = context.system
    names: dict[str, dict[tuple[int, int], list[str]]] = {system.source.path: {}}
    for node in system.nodes:
        span = node.name.span
        in_file = names.setdefault(span.file.path, {})
        in_file.setdefault((span.line, span.column), []).append(node.name.value)
    others = [connection.span for connection in system.connections]
    others += [profile.name.span for profile in system.qos_profiles]
    others += [executor.name.span for executor in system.executors]
    others_in: dict[str, list[tuple[int, int]]] = {}
    for span in others:
        others_in.setdefault(span.file.path, []).append((span.line, span.column))
    node_files = {}
    for path, found in names.items():
        starts = sorted(found)
        following = others_in.get(path, [])
        # The first known part after the last node starts here.
        end = min((place for place in following if starts and place > starts[-1]), default=None)
        node_files[path] = _NodeFile(starts, found, end)
    return node_files


def _files(node: Node) -> set[str]:
    """Return the paths of the files that declare the ports, timers and parameters of a node."""
    names = [port.name for port in node.ports]
    names += [timer.name for timer in node.timers]
    names += [parameter.name for parameter in node.parameters]
    return {name.span.file.path for name in names}

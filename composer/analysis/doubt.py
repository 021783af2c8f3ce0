"""Which parts of a system were refused in parts, so that nothing may be called missing there."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from composer.analysis.context import Context
from composer.diagnostics import nearest
from composer.model import Node, PortKind
from composer.source import Span

PORT_SECTIONS = tuple(kind.section for kind in PortKind)
SECTIONS = (*PORT_SECTIONS, "parameters", "state", "timers")


@dataclass(frozen=True, slots=True)
class Doubt:
    """Where earlier errors are.

    ``nodes`` are the keys of nodes with one in them; ``elsewhere`` is true when there is one
    outside of all nodes: among connections or profiles. ``misspelt`` are nodes and sections
    (``publishers``) that were probably meant by a refused word: what they declare is not in the
    model.
    """

    nodes: frozenset[str]
    elsewhere: bool
    misspelt: frozenset[tuple[str, str]] = frozenset()

    @property
    def any(self) -> bool:
        """Whether there is any earlier error."""
        return self.elsewhere or bool(self.nodes)

    def may_have(self, node: str, *sections: str) -> bool:
        """Say whether a node may have more in a section than the model says."""
        return not self.misspelt.isdisjoint((node, section) for section in sections)


def doubt(context: Context) -> Doubt:
    """Find what the errors of the stages before the checks were in."""
    system = context.system
    homes = _homes(context)
    files = {span.file.path for span in context.refused} - homes.keys()
    suspects = {node.name.value for node in system.nodes if _files(node) & files}
    elsewhere = context.is_partial
    misspelt: set[tuple[str, str]] = set()
    for span in context.refused:
        home = homes.get(span.file.path)
        names = home.nodes_at(span) if home is not None else ()
        if home is not None and not names:
            elsewhere = True
        suspects.update(names)
        section = nearest(_text(span), SECTIONS) if names else None
        if section is not None:
            misspelt.update((name, section) for name in names)
    return Doubt(frozenset(suspects), elsewhere, frozenset(misspelt))


@dataclass(frozen=True, slots=True)
class _Home:
    """A file that nodes of the system are written in: where each begins, and where they end."""

    starts: list[tuple[int, int]]
    names: dict[tuple[int, int], list[str]]  # several where one entry makes several nodes
    end: tuple[int, int] | None

    def nodes_at(self, span: Span) -> list[str]:
        """Return the nodes within which ``span`` is."""
        place = (span.line, span.column)
        index = bisect_right(self.starts, place) - 1
        if index < 0 or (self.end is not None and place >= self.end):
            return []
        return self.names[self.starts[index]]


def _homes(context: Context) -> dict[str, _Home]:
    """Return the files that the system's nodes are written in, and its own."""
    system = context.system
    names: dict[str, dict[tuple[int, int], list[str]]] = {system.source.path: {}}
    for node in system.nodes:
        span = node.name.span
        in_file = names.setdefault(span.file.path, {})
        in_file.setdefault((span.line, span.column), []).append(node.name.value)
    others = [connection.span for connection in system.connections]
    others += [profile.name.span for profile in system.qos_profiles]
    others += [executor.name.span for executor in system.executors]
    homes = {}
    for path, found in names.items():
        starts = sorted(found)
        behind = [(span.line, span.column) for span in others if span.file.path == path]
        # As far as it is known, the first part behind the last node begins here.
        end = min((place for place in behind if starts and place > starts[-1]), default=None)
        homes[path] = _Home(starts, found, end)
    return homes


def _text(span: Span) -> str:
    return span.file.line(span.line)[span.column - 1 :][: span.length].strip("'\"")


def _files(node: Node) -> set[str]:
    """Return the files that a node is declared in."""
    names = [port.name for port in node.ports]
    names += [timer.name for timer in node.timers]
    names += [parameter.name for parameter in node.parameters]
    return {name.span.file.path for name in names}

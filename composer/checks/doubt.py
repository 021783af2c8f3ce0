"""Which parts of a system were refused in parts, so that nothing may be called missing there."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from composer.checks.context import Context
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
    home = system.source.path
    files = {span.file.path for span in context.refused} - {home}
    suspects = {node.name.value for node in system.nodes if _files(node) & files}
    starts = sorted(
        (node.name.span.line, node.name.span.column, node.name.value) for node in system.nodes
    )
    end = _end_of_nodes(context)
    elsewhere = False
    misspelt: set[tuple[str, str]] = set()
    for span in context.refused:
        if span.file.path != home:
            continue
        index = bisect_right(starts, (span.line, span.column, "\U0010ffff")) - 1
        if index < 0 or (end is not None and (span.line, span.column) >= end):
            elsewhere = True
        else:
            name = starts[index][2]
            suspects.add(name)
            section = nearest(_text(span), SECTIONS)
            if section is not None:
                misspelt.add((name, section))
    return Doubt(frozenset(suspects), elsewhere, frozenset(misspelt))


def _text(span: Span) -> str:
    return span.file.line(span.line)[span.column - 1 :][: span.length].strip("'\"")


def _files(node: Node) -> set[str]:
    """Return the files that a node is declared in."""
    names = [port.name for port in node.ports]
    names += [timer.name for timer in node.timers]
    names += [parameter.name for parameter in node.parameters]
    return {name.span.file.path for name in names}


def _end_of_nodes(context: Context) -> tuple[int, int] | None:
    """Return where the first part behind the last node begins, as far as it is known."""
    system = context.system
    if not system.nodes:
        return None
    last = max((node.name.span.line, node.name.span.column) for node in system.nodes)
    others = [connection.span for connection in system.connections]
    others += [profile.name.span for profile in system.qos_profiles]
    others += [executor.name.span for executor in system.executors]
    behind = [(span.line, span.column) for span in others if span.file == system.source]
    return min((found for found in behind if found > last), default=None)

"""What all connections of one dashboard share, and what their operations are.

Among it is the system as its file declares it: for source lines, plans with causes, and drift.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.dashboard.access import Access
from composer.dashboard.feeds import Feeds
from composer.dashboard.protocol.messages import RequestError, Values
from composer.dashboard.ros_side import RosSide
from composer.graph.facts import node_facts, publishing_rates_hz
from composer.interfaces import Interfaces
from composer.model import Node, Parameter, PrimaryState, System

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.observing.ros_graph import RosGraph


#: Runs on a worker thread, and returns what the browser gets. Raises RequestError or RosError.
Run = Callable[["RosGraph", "Deadline"], Any]
#: What to run, and its time limit in seconds.
Prepared = tuple[Run, float]
_MAX_LINES = 200


@dataclass(frozen=True, slots=True)
class Options:
    """How the dashboard was started. ``system`` is what the user wrote, or empty."""

    system: str = ""
    read_only: bool = False
    foxglove: bool = True


@dataclass(frozen=True)
class Dashboard:
    """One running dashboard."""

    options: Options
    access: Access
    declared: Declared | None
    ros: RosSide
    feeds: Feeds
    interfaces: Interfaces

    @property
    def title(self) -> str:
        """What it shows: a system, or everything."""
        if self.declared is not None:
            return self.declared.system.name.value
        return self.options.system or "ROS graph"


@dataclass(frozen=True, slots=True)
class Operation:
    """What a browser can request.

    ``prepare`` reads the request; it raises BadRequestError and must not block. ``changes`` is
    whether it changes something, which a read-only dashboard refuses.
    """

    prepare: Callable[[Values, Dashboard], Prepared]
    changes: bool = False


@dataclass(frozen=True)
class Declared:
    """A system that was loaded from ``file``, which is shown as the user wrote it."""

    system: System
    file: str
    diagnostics: tuple[Diagnostic, ...] = ()
    autostart: PrimaryState | None = None

    @cached_property
    def nodes(self) -> Mapping[str, Node]:
        """The nodes by their full names."""
        return {node.full_name: node for node in self.system.nodes}

    @cached_property
    def parameters(self) -> Mapping[str, Mapping[str, Parameter]]:
        """The parameters of each node by their names."""
        return {
            full_name: {parameter.name.value: parameter for parameter in node.parameters}
            for full_name, node in self.nodes.items()
        }

    def is_of(self, running: str) -> bool:
        """Return whether this is the running system with that name."""
        return running.rpartition("/")[2] == self.system.name.value

    def declared_at(self, node: str) -> str | None:
        """Return file, line and column of a node, by its full name."""
        found = self.nodes.get(node)
        return None if found is None else str(found.span)

    def facts(self, node: str) -> dict[str, Any] | None:
        """Return what is declared of a node, as ``compose graph`` shows it."""
        found = self.nodes.get(node)
        return None if found is None else dict(node_facts(found, publishing_rates_hz(found)))

    def source(self, node: str) -> dict[str, Any] | None:
        """Return the lines of the file that declare a node."""
        found = self.nodes.get(node)
        return None if found is None else _excerpt(found.span)


def required(declared: Declared | None, what: str) -> Declared:
    """Return the declared system. Raises RequestError if the dashboard has no file of it."""
    if declared is None:
        raise RequestError(
            "not_found",
            f"{what} needs the file of the system",
            "start the dashboard with it: compose dashboard FILE",
        )
    return declared


def _excerpt(span: Span) -> dict[str, Any] | None:
    """Return the line of a span, and the lines below it that are indented more."""
    lines = span.file.lines
    if not 1 <= span.line <= len(lines):
        return None
    indent = _indent(lines[span.line - 1])
    end = span.line
    while end < len(lines) and (not lines[end].strip() or _indent(lines[end]) > indent):
        end += 1
    shown = lines[span.line - 1 : min(end, span.line - 1 + _MAX_LINES)]
    text = "\n".join(shown).rstrip()
    return {"file": span.file.path, "line": span.line, "text": text}


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())

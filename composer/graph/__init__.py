"""Diagrams: a system becomes a graph (``views/``), a graph becomes text (one file a format)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import StrEnum

from composer.diagnostics import Diagnostic
from composer.graph import dot, json, mermaid, svg
from composer.graph.findings import Findings
from composer.graph.picture import Graph
from composer.graph.views import connections, deployment, lifecycle, nodes, states
from composer.model import System


class View(StrEnum):
    """The ways to look at a system."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"


_VIEWS: dict[View, Callable[[System, Findings], Graph]] = {
    View.NODES: nodes.build,
    View.CONNECTIONS: connections.build,
    View.LIFECYCLE: lifecycle.build,
    View.DEPLOYMENT: deployment.build,
    View.STATES: states.build,
}

#: The renderers of text formats, by the file ending that asks for them.
RENDERERS: dict[str, Callable[[Graph], str]] = {
    "mermaid": mermaid.render,
    "dot": dot.render,
    "json": json.render,
    "svg": svg.render,
}


def build_graph(
    system: System, view: View = View.NODES, diagnostics: Iterable[Diagnostic] = ()
) -> Graph:
    """Return the diagram of ``system``; what a finding points at is marked as wrong."""
    return _VIEWS[view](system, Findings(diagnostics))

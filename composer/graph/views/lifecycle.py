"""The order of the bring-up: which step each node takes when, and whom it waits for."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.facts import node_facts
from composer.graph.findings import Findings
from composer.graph.namespaces import Namespaces
from composer.graph.picture import Direction, Edge, Graph, Kind, Line, Vertex
from composer.model import Node, System
from composer.plan import Plan, bring_up


def build(system: System, findings: Findings) -> Graph:
    """Return the graph of dependencies. Arrows point from a node to those that wait for it."""
    plan = bring_up(system)
    namespaces = Namespaces(system.nodes)
    return Graph(
        title=system.name.value,
        view="lifecycle",
        direction=Direction.DOWN,
        vertices=tuple(
            Vertex(
                key=f"node:{node.name.value}",
                kind=Kind.NODE,
                lines=(node.name.value, *_steps(node, plan)),
                cluster=namespaces.around(node.namespace.value),
                details=node_facts(node),
                wrong=findings.about_node(node),
            )
            for node in system.nodes
        ),
        edges=tuple(edge for node in system.nodes for edge in _dependencies(node, system)),
        clusters=namespaces.clusters(),
    )


def _steps(node: Node, plan: Plan) -> Iterator[str]:
    steps = [step for step in plan.steps if step.node == node.name.value]
    yield ", ".join(f"#{step.number} {step.transition}" for step in steps) or "stays unconfigured"


def _dependencies(node: Node, system: System) -> Iterator[Edge]:
    for dependency in node.depends_on:
        if system.node(dependency.node.value) is not None:
            yield Edge(
                source=f"node:{dependency.node.value}",
                target=f"node:{node.name.value}",
                kind=Line.DEPENDENCY,
                lines=(f"once {dependency.state}",),
            )

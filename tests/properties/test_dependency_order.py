"""Random dependency graphs: the order satisfies all dependencies, and cycles are cycles."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

from hypothesis import given
from hypothesis import strategies as st

from composer.base.source import Located, SourceFile, Span
from composer.model import Dependency, Node, System
from composer.model.dependencies import declared_edges, dependency_cycles, in_dependency_order

SOURCE = SourceFile("robot.yaml")
SPAN = Span(SOURCE, 1, 1)


def _graphs(count: int) -> st.SearchStrategy[list[list[int]]]:
    needed = st.lists(st.integers(0, count), max_size=3)
    return st.lists(needed, min_size=count, max_size=count)


graphs = st.integers(1, 9).flatmap(_graphs)


def system_of(graph: list[list[int]]) -> System:
    """Return a system of nodes n0, n1, ...; numbers without a node are unknown nodes."""
    nodes = tuple(
        Node(
            name=Located(f"n{number}", SPAN),
            namespace=Located("/", SPAN),
            span=SPAN,
            depends_on=tuple(Dependency(Located(f"n{other}", SPAN)) for other in needed),
        )
        for number, needed in enumerate(graph)
    )
    return System(name=Located("robot", SPAN), source=SOURCE, nodes=nodes, span=SPAN)


@given(graphs)
def test_order_and_cycles_agree_with_the_standard_library(graph: list[list[int]]) -> None:
    system = system_of(graph)
    edges = {(edge.node, edge.on) for edge in declared_edges(system)}
    order = in_dependency_order(system)
    assert sorted(order) == sorted(node.name.value for node in system.nodes)
    sorter = TopologicalSorter({node: set() for node in order})
    for node, needed in edges:
        sorter.add(node, needed)
    try:
        sorter.prepare()
    except CycleError:
        assert dependency_cycles(system)
    else:
        assert dependency_cycles(system) == ()
        assert all(order.index(needed) < order.index(node) for node, needed in edges)
    for cycle in dependency_cycles(system):
        assert len(set(cycle)) == len(cycle)
        assert set(zip(cycle, (*cycle[1:], cycle[0]), strict=True)) <= edges

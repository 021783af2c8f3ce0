"""What holds for every layout: nothing overlaps, frames hold theirs, same input same picture."""

from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from composer.graph.diagram import Cluster, Direction, Edge, EdgeKind, Graph, Vertex, VertexKind
from composer.graph.layout import Rectangle, arrange
from composer.graph.layout.geometry import measure
from tests.examples import examples


def graph_of(
    vertices: dict[str, str],
    edges: list[tuple[str, str]],
    clusters: list[tuple[str, str]] | None = None,
    direction: Direction = Direction.RIGHT,
) -> Graph:
    return Graph(
        title="test",
        view="nodes",
        direction=direction,
        vertices=tuple(
            Vertex(key, VertexKind.NODE, (key,), around) for key, around in vertices.items()
        ),
        edges=tuple(
            Edge(f"e{number}", begin, end, EdgeKind.TOPIC, (f"{begin} to {end}",))
            for number, (begin, end) in enumerate(edges)
        ),
        clusters=tuple(Cluster(key, key, parent) for key, parent in clusters or []),
    )


def overlap(first: Rectangle, second: Rectangle) -> bool:
    """Return whether two rectangles lie on one another; they may touch."""
    across = abs(first.center.x - second.center.x) * 2 - first.size.width - second.size.width
    along = abs(first.center.y - second.center.y) * 2 - first.size.height - second.size.height
    return across < -0.02 and along < -0.02


def holds(outer: Rectangle, inner: Rectangle) -> bool:
    return (
        outer.left <= inner.left
        and outer.top <= inner.top
        and inner.left + inner.size.width <= outer.left + outer.size.width
        and inner.top + inner.size.height <= outer.top + outer.size.height
    )


def test_a_chain_runs_in_a_straight_line_in_the_direction() -> None:
    chain = (dict.fromkeys("abc", ""), [("a", "b"), ("b", "c")])
    right = [place.center for place in arrange(graph_of(*chain)).vertices.values()]
    assert right[0].x < right[1].x < right[2].x
    assert len({round(center.y, 3) for center in right}) == 1
    graph = graph_of(*chain, direction=Direction.DOWN)
    down = [place.center for place in arrange(graph).vertices.values()]
    assert down[0].y < down[1].y < down[2].y
    assert len({center.x for center in down}) == 1


def test_an_edge_begins_at_its_source_and_ends_at_its_target_also_against_the_direction() -> None:
    graph = graph_of(dict.fromkeys("ab", ""), [("a", "b"), ("b", "a")])
    layout = arrange(graph)
    places = layout.vertices
    for path in layout.paths:
        begin, end = path.points[0], path.points[-1]
        source, target = places[path.edge.source], places[path.edge.target]
        assert abs(begin.x - source.center.x) == source.size.width / 2
        assert abs(end.x - target.center.x) == target.size.width / 2


def test_an_empty_picture_and_an_empty_cluster() -> None:
    layout = arrange(graph_of({}, []))
    assert layout.vertices == {}
    assert layout.size.width > 0
    layout = arrange(graph_of({"a": "full"}, [], [("full", ""), ("empty", "")]))
    assert [frame.cluster.key for frame in layout.frames] == ["full"]


def test_a_frame_is_wide_enough_for_its_label() -> None:
    long_name = "/a/namespace/with/a/very/long/name"
    graph = graph_of({"a": long_name}, [], [(long_name, "")])
    width = arrange(graph).frames[0].place.size.width
    assert width >= measure(graph).frames[long_name].width


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    count = draw(st.integers(1, 12))
    names = [f"v{number}" for number in range(count)]
    groups = [f"g{number}" for number in range(draw(st.integers(0, 4)))]
    clusters = [
        (group, draw(st.sampled_from(["", *groups[:number]])))
        for number, group in enumerate(groups)
    ]
    vertices = {name: draw(st.sampled_from(["", *groups])) for name in names}
    pair = st.tuples(st.sampled_from(names), st.sampled_from(names))
    edges = draw(st.lists(pair, max_size=20))
    return graph_of(vertices, edges, clusters, draw(st.sampled_from(Direction)))


@examples(60)
@given(graphs())
def test_nothing_overlaps_that_must_not_and_everything_is_inside_the_picture(graph: Graph) -> None:
    layout = arrange(graph)
    places = layout.vertices
    for first, second in combinations(places.values(), 2):
        assert not overlap(first, second)
    labels = [
        Rectangle(path.label, measure(graph).labels[path.edge.key])
        for path in layout.paths
        if path.label is not None
    ]
    for label in labels:
        assert not any(overlap(label, place) for place in places.values())
    for first, second in combinations(labels, 2):
        assert not overlap(first, second)
    for place in (*places.values(), *(frame.place for frame in layout.frames)):
        assert place.left >= 0.0
        assert place.top >= 0.0
        assert place.left + place.size.width <= layout.size.width
        assert place.top + place.size.height <= layout.size.height
    assert arrange(graph) == layout  # the same again


@examples(60)
@given(graphs())
def test_frames_hold_what_is_theirs_and_nothing_else(graph: Graph) -> None:
    layout = arrange(graph)
    frames = {frame.cluster.key: frame for frame in layout.frames}
    for frame in layout.frames:
        if frame.cluster.parent:
            assert holds(frames[frame.cluster.parent].place, frame.place)
        inside = {frame.cluster.key}
        for other in layout.frames:  # parents come first
            if other.cluster.parent in inside:
                inside.add(other.cluster.key)
        for vertex in graph.vertices:
            place = layout.vertices[vertex.key]
            if vertex.cluster in inside:
                assert holds(frame.place, place)
            else:
                assert not overlap(frame.place, place)

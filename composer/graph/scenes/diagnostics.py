"""Find the diagnostics about a node or port, by location."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.diagnostics import Diagnostic, Severity
from composer.graph.diagram import Mark, Problem, worst
from composer.model import DynamicTransform, Node, Port, StaticTransform
from composer.source import Span

_Place = tuple[str, int, int]


class DiagnosticIndex:
    """Errors and warnings by location."""

    def __init__(self, diagnostics: Iterable[Diagnostic] = ()) -> None:
        self._by_place: dict[_Place, Problem] = {}
        for diagnostic in diagnostics:
            if diagnostic.severity is Severity.INFO:
                continue
            mark = Mark.WRONG if diagnostic.severity is Severity.ERROR else Mark.DOUBTFUL
            problem = Problem(f"{diagnostic.rule.code} {diagnostic.message}", mark)
            for span in (diagnostic.primary, *(label.span for label in diagnostic.related)):
                place = _place(span)
                self._by_place[place] = worst((self._by_place.get(place), problem)) or problem

    def about_port(self, port: Port) -> Problem | None:
        """Return the diagnostic about a port's declaration, if there is one."""
        return self._first(_port_spans(port))

    def about_node(self, node: Node) -> Problem | None:
        """Return the diagnostic about a node itself, if there is one."""
        return self._first(_node_spans(node))

    def about_transform(self, declared: StaticTransform | DynamicTransform) -> Problem | None:
        """Return the diagnostic about the frames of a transform, if there is one."""
        return self._first((declared.child.span, declared.parent.span))

    def _first(self, spans: Iterable[Span]) -> Problem | None:
        return worst(self._by_place.get(_place(span)) for span in spans)


def _place(span: Span) -> _Place:
    return (span.file.path, span.line, span.column)


def _port_spans(port: Port) -> Iterator[Span]:
    yield port.span
    yield port.name.span
    yield port.interface.span
    yield port.ros_name.span
    yield port.qos.span
    for _, span in port.qos.policy_spans:
        yield span


def _node_spans(node: Node) -> Iterator[Span]:
    yield node.span
    yield node.name.span
    yield node.namespace.span
    if node.type_name is not None:
        yield node.type_name.span
    if node.behavior is not None:
        yield node.behavior.text.span
    if node.hosted_class is not None:
        yield node.hosted_class.reference.text.span
    if node.executable is not None:
        yield from (node.executable.span, *(key.span for key in node.executable.given))
    if node.executor is not None:
        yield node.executor.span
    for dependency in node.depends_on:
        yield dependency.node.span
    for parameter in node.parameters:
        yield parameter.span
        if parameter.value is not None:
            yield parameter.value.span

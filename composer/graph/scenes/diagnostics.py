"""Find the diagnostics about a node or port, by location."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.diagnostics import Diagnostic, Severity
from composer.model import DynamicTransform, Node, Port, StaticTransform
from composer.source import Span

_Place = tuple[str, int, int]


class DiagnosticIndex:
    """Errors and warnings by location."""

    def __init__(self, diagnostics: Iterable[Diagnostic] = ()) -> None:
        self._by_place: dict[_Place, str] = {}
        for diagnostic in diagnostics:
            if diagnostic.severity is Severity.INFO:
                continue
            text = f"{diagnostic.rule.code} {diagnostic.message}"
            for span in (diagnostic.primary, *(label.span for label in diagnostic.related)):
                self._by_place.setdefault(_place(span), text)

    def about_port(self, port: Port) -> str:
        """Return the diagnostic about a port's declaration, or an empty text."""
        return self._first(_port_spans(port))

    def about_node(self, node: Node) -> str:
        """Return the diagnostic about a node itself, or an empty text."""
        return self._first(_node_spans(node))

    def about_transform(self, declared: StaticTransform | DynamicTransform) -> str:
        """Return the diagnostic about the frames of a transform, or an empty text."""
        return self._first((declared.child.span, declared.parent.span))

    def _first(self, spans: Iterable[Span]) -> str:
        return next(
            (self._by_place[place] for place in map(_place, spans) if place in self._by_place), ""
        )


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

"""What the command line says on top of a file: ``--set node.parameter=value``, ``--namespace``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from composer.diagnostics import Diagnostic, Label, Rule, Severity, register, shown
from composer.document import parse_document
from composer.source import Located, SourceFile, Span
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

SET = "--set"
NAMESPACE = "--namespace"

RULE = register(
    Rule(
        code="RC041",
        name="invalid-override",
        severity=Severity.ERROR,
        summary="A value on the command line is not of the form node.parameter=value.",
        why="The value is read like one in a file: a YAML scalar or list in flow style.",
        bad="compose run systems/pipeline.yaml --set max_velocity 2.0",
        good="compose run systems/pipeline.yaml --set planner.max_velocity=2.0",
    )
)


@dataclass(frozen=True, slots=True)
class Override:
    """A parameter's value from the command line, each part with its place there."""

    node: Located[str]
    parameter: Entry


@dataclass(frozen=True, slots=True)
class Overrides:
    """Everything the command line says on top of a file."""

    parameters: tuple[Override, ...] = ()
    namespace: Located[str] | None = None
    by_node: dict[str, dict[str, Entry]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        by_node: dict[str, dict[str, Entry]] = {}
        for item in self.parameters:
            by_node.setdefault(item.node.value, {})[item.parameter.name] = item.parameter
        object.__setattr__(self, "by_node", by_node)


def read_overrides(
    settings: Iterable[str] = (), namespace: str | None = None
) -> tuple[Overrides, list[Diagnostic]]:
    """Read command-line settings, each ``node.parameter=value``.

    The value is YAML, as it would stand in a file; of two for one parameter the last counts.
    """
    texts = [setting.replace("\r", " ").replace("\n", " ") for setting in settings]
    source = SourceFile(SET, "\n".join(texts))
    findings: list[Diagnostic] = []
    found = (_override(text, source, line, findings) for line, text in enumerate(texts, start=1))
    parameters = tuple(item for item in found if item is not None)
    return Overrides(parameters, _namespace(namespace)), findings


def _namespace(namespace: str | None) -> Located[str] | None:
    if namespace is None:
        return None
    source = SourceFile(NAMESPACE, namespace)
    return Located(namespace, Span(source, 1, 1, max(len(namespace), 1)))


def _override(
    text: str, source: SourceFile, line: int, findings: list[Diagnostic]
) -> Override | None:
    target, equals, _ = text.partition("=")
    node, dot, parameter = target.partition(".")
    if not (equals and dot and node and parameter):
        span = Span(source, line, 1, max(len(text), 1))
        message = f"'{shown(text)}' is not of the form node.parameter=value"
        findings.append(Diagnostic(RULE, message, span))
        return None
    value = _value(text, len(target) + 1, source, line, findings)
    if value is None:
        return None
    name = Scalar(parameter, Span(source, line, len(node) + 2, len(parameter)))
    return Override(Located(node, Span(source, line, 1, len(node))), Entry(name, value))


def _value(
    text: str, start: int, source: SourceFile, line: int, findings: list[Diagnostic]
) -> Tree | None:
    """Read what is behind the equals sign."""
    # As the value of a one-line document of the same width, so that its columns are right.
    key = "v" * (start - 2)
    document = SourceFile(SET, f"{key}: {text[start:]}")
    tree, found = parse_document(document)
    findings.extend(_moved_finding(item, source, line) for item in found)
    value = tree.get(key) if tree is not None else None
    return _moved(value, source, line) if value is not None else None


def _moved(tree: Tree, source: SourceFile, line: int) -> Tree:
    span = _moved_span(tree.span, source, line)
    match tree:
        case Scalar():
            return Scalar(tree.value, span, tree.verbatim, tree.content_offset)
        case Sequence():
            return Sequence(tuple(_moved(item, source, line) for item in tree.items), span)
        case Mapping():
            return Mapping(
                tuple(
                    Entry(
                        Scalar(entry.key.value, _moved_span(entry.key.span, source, line)),
                        _moved(entry.value, source, line),
                    )
                    for entry in tree
                ),
                span,
            )


def _moved_span(span: Span, source: SourceFile, line: int) -> Span:
    return Span(source, line, span.column, span.length)


def _moved_finding(finding: Diagnostic, source: SourceFile, line: int) -> Diagnostic:
    return Diagnostic(
        finding.rule,
        finding.message,
        _moved_span(finding.primary, source, line),
        tuple(
            Label(_moved_span(label.span, source, line), label.message) for label in finding.related
        ),
        finding.hint,
    )

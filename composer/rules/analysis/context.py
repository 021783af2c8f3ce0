"""The input of the rules: a system, its Python classes, places, and what several rules compute."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field
from functools import wraps
from typing import Any, TypeAlias, TypeVar

from composer.base.diagnostics import Diagnostic, Label, Rule, Severity
from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located, Span
from composer.interfaces import Action, Interfaces, Message, Service
from composer.interfaces.definitions import parts
from composer.language.expressions import Expression, FieldPath
from composer.language.rules import MAX_FINDINGS, TOO_LARGE
from composer.model import Channel, ChannelKind, HostedClass, Node, Port, System, channels
from composer.model.scenario import Scenario
from composer.project.node_types import NodeTypes
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import NodeClass, node_classes, use_of
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, span_of, walk

T = TypeVar("T")

#: What may leave out the code in it, or stop it.
_CONDITIONAL = (
    *SCOPES,
    *(ast.If, ast.IfExp, ast.BoolOp, ast.Match, ast.Try, ast.TryStar, ast.With),
    *(ast.For, ast.While, ast.ListComp, ast.GeneratorExp),
)

#: The kinds of channels that use each kind of definition.
KINDS_OF_INTERFACES = {
    Message: ChannelKind.TOPIC,
    Service: ChannelKind.SERVICE,
    Action: ChannelKind.ACTION,
}


@dataclass(frozen=True, slots=True)
class Context:
    """A system, and the interfaces and node types it can refer to.

    ``refused`` are the spans of the errors that earlier stages reported. What contains them is
    missing from the model, entirely or in part. If ``is_partial``, whole nodes, profiles and
    executors may be missing, so an unknown name may not be an error. ``scenario`` is the file that
    was loaded, if it is a scenario of the system.
    """

    system: System
    interfaces: Interfaces
    node_types: NodeTypes
    refused: tuple[Span, ...] = ()
    is_partial: bool = False
    scenario: Scenario | None = None
    _cache: dict[Callable[[Context], Any], Any] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def once(self, compute: Callable[[Context], T]) -> T:
        """Return ``compute(self)``, computed once per context."""
        if compute not in self._cache:
            self._cache[compute] = compute(self)
        result: T = self._cache[compute]
        return result

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every topic, service and action whose name is known, with its endpoints."""
        return self.once(_channels)

    @property
    def all_channels(self) -> tuple[Channel, ...]:
        """The same, with the endpoints on /tf and /tf_static that follow from ``transforms``."""
        return self.once(_all_channels)

    def interface(self, port: Port) -> Message | Service | Action | None:
        """Return the definition of a port's type; None if it is unknown or of another kind."""
        found = self.interfaces.find(port.interface.value)
        is_of_kind = found is not None and KINDS_OF_INTERFACES[type(found)] is port.kind.channel
        return found if is_of_kind else None

    def messages(self, port: Port | None) -> dict[str, Message]:
        """Return the messages of a port's type, by ``message``, ``goal`` and so on, if known."""
        found = self.interface(port) if port is not None else None
        return parts(found) if found is not None else {}

    def sent(self, port: Port | None) -> Message | None:
        """Return the message, request or goal of a port's type; None if it is unknown."""
        return next(iter(self.messages(port).values()), None)


Check: TypeAlias = Callable[[Context], Iterator[Diagnostic]]


def limited(check: Check) -> Check:
    """Limit the places at which a check finds something; only for one that reports no errors.

    Beyond the limit, the check ends with an info that says so. Copies are at one place.
    """

    @wraps(check)
    def limited_check(context: Context) -> Iterator[Diagnostic]:
        places = set()
        for item in check(context):
            yield item
            places.add(location(item.primary))
            if len(places) > MAX_FINDINGS:
                message = f"more than {MAX_FINDINGS:,} places have this; the others are left out"
                yield Diagnostic(replace(TOO_LARGE, severity=Severity.INFO), message, item.primary)
                return

    return limited_check


def is_unresolved(text: str) -> bool:
    """Return whether ``text`` contains a variable without a value, so it cannot be checked."""
    return "${" in text


def location(span: Span) -> tuple[str, int, int]:
    """Return the file, line and column of ``span``."""
    return (span.file.path, span.line, span.column)


def _channels(context: Context) -> tuple[Channel, ...]:
    return _known(channels(context.system.nodes))


def _all_channels(context: Context) -> tuple[Channel, ...]:
    if all(node.transforms is None for node in context.system.nodes):
        return context.channels
    return _known(channels(context.system.nodes, with_transforms=True))


def _known(found: Iterable[Channel]) -> tuple[Channel, ...]:
    return tuple(channel for channel in found if not is_unresolved(channel.name))


def behaviors(context: Context) -> tuple[NodeClass, ...]:
    """Return every node that names a behavior, with its source."""
    return tuple(item for item in context.once(_classes) if item[0].behavior is not None)


def distinct_behaviors(context: Context) -> tuple[NodeClass, ...]:
    """Return one node for each behavior and each set of ports, timers and parameters."""
    first: dict[object, NodeClass] = {}
    for node, source in behaviors(context):
        first.setdefault(use_of(node, source), (node, source))
    return tuple(first.values())


@dataclass(frozen=True, slots=True)
class ClassOfNode:
    """A node with the source of its class."""

    node: Node
    hosted: HostedClass
    source: BehaviorSource

    @property
    def span(self) -> Span:
        """Where the YAML file names the class."""
        return self.hosted.reference.text.span

    @property
    def constructor(self) -> Method | None:
        """The constructor of the class or of its bases outside of rclpy, if it is known."""
        method = self.source.method("__init__")
        is_nearest = any(method in class_.methods for _, class_ in self.source.classes[:1])
        return method if is_nearest or self.source.complete else None

    def is_certain(self, span: Span) -> bool:
        """Return whether the constructor makes the call at a place whatever happens before."""
        constructor = self.constructor
        if constructor is None or constructor.node is None or constructor.span.file != span.file:
            return False
        nodes = walk(constructor.node.body, closed=_CONDITIONAL)
        calls = (span_of(node, span.file) for node in nodes if isinstance(node, ast.Call))
        return any((call.line, call.column) == (span.line, span.column) for call in calls)

    def diagnostic(self, rule: Rule, message: str, where: Span, hint: str) -> Diagnostic:
        """Return a diagnostic about the class, with its place in the Python file."""
        related = (Label(where, "here"),)
        return Diagnostic(rule, message, self.span, related=related, hint=hint)


def hosted_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return every node with a class, and the source of the class."""
    return tuple(
        ClassOfNode(node, node.hosted_class, source)
        for node, source in context.once(_classes)
        if node.hosted_class is not None and node.behavior is None
    )


def distinct_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return the first node of each class."""
    first: dict[int, ClassOfNode] = {}
    for item in hosted_classes(context):
        first.setdefault(id(item.source), item)
    return tuple(first.values())


def _classes(context: Context) -> tuple[NodeClass, ...]:
    return node_classes(context.system)


def part_of(text: Located[str], start: int, length: int) -> Span:
    """Return the span of ``length`` characters of ``text`` from ``start``.

    If the file does not contain the text literally, because of variables or escapes, return the
    span of the whole text.
    """
    span = text.span
    part = text.value[start : start + length]
    source_text = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    found = source_text.find(part, start)
    if found < 0 and start + length == len(text.value):  # a variable or an escape precedes it
        end = len(source_text.rstrip("'\""))
        found = end - length if source_text[:end].endswith(part) else -1
    return span.part(found, len(part)) if part and found >= 0 else span


def part_of_path(span: Span, expression: Expression, path: FieldPath, index: int = 0) -> Span:
    """Return the span of part ``index`` of a path within an expression at ``span``.

    If the file does not contain the expression literally, return the span of all of it.
    """
    source = expression.source
    offset = path.offset
    for part in path.parts[: index + 1]:
        found = source.find(str(part), offset, path.offset + path.length)
        if found < 0:
            return span
        start, offset = found, found + len(str(part))
    source_text = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    return span.part(start, len(str(path.parts[index]))) if source_text == source else span

"""A frame ID that begins with a slash."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import uses_of_behaviors
from composer.analysis.messages.reactions import message_templates
from composer.diagnostics import Diagnostic, warning
from composer.model import Transforms
from composer.source import Located, Span
from composer.templates import Constant, Items, Record, Template, Text

RULE = warning(
    code="RC309",
    name="frame-id-slash",
    summary="A frame ID begins with a slash.",
    why=(
        "tf2 refuses frame IDs with a leading slash: every lookup of the frame fails. Frame "
        "IDs are not in the namespace of a node."
    ),
    bad="""\
system: frames
nodes:
  robot:
    publishers: {header: {type: std_msgs/msg/Header, qos: command, external: true}}
    timers: {tick: {period_ms: 100, publish: {header: {frame_id: /odom}}}}
""",
    good="""\
system: frames
nodes:
  robot:
    publishers: {header: {type: std_msgs/msg/Header, qos: command, external: true}}
    timers: {tick: {period_ms: 100, publish: {header: {frame_id: odom}}}}
""",
)


_FIELDS = frozenset({"frame_id", "child_frame_id"})


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the frame IDs in messages, transforms and behaviors, and in parameters for them."""
    for template, _ in message_templates(context):
        yield from _template(template)
    for node in context.system.nodes:
        for parameter in node.parameters:
            value = parameter.value
            if value is not None and parameter.name.value.endswith(tuple(_FIELDS)):
                yield from _text(value.value, value.span)
        if node.transforms is not None:
            for frame in _frames(node.transforms):
                yield from _text(frame.value, frame.span)
    for _, use in context.once(uses_of_behaviors):
        for frame in use.frames:
            yield from _text(frame.value, frame.span)


def _frames(transforms: Transforms) -> Iterator[Located[str]]:
    for item in transforms.broadcasts:
        yield item.child
        yield item.parent
    if transforms.lookup is not None:
        yield from transforms.lookup.value


def _template(template: Template) -> Iterator[Diagnostic]:
    match template:
        case Record(fields=fields):
            for name, content in fields:
                if name.value in _FIELDS:
                    yield from _field(content)
                yield from _template(content)
        case Items(items=items):
            for item in items:
                yield from _template(item)
        case _:
            return


def _field(content: Template) -> Iterator[Diagnostic]:
    match content:
        case Constant(value=value, span=span):
            yield from _text(value, span)
        case Text(parts=[str() as first, *_], span=span):
            yield from _text(first, span)
        case _:
            return


def _text(value: object, span: Span) -> Iterator[Diagnostic]:
    if isinstance(value, str) and value.startswith("/"):
        yield Diagnostic(
            RULE,
            f"frame ID '{value}' begins with a slash",
            span,
            hint="remove the slash",
        )

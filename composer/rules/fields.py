"""The fields of messages that reactions read and fill."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.expressions import message_templates
from composer.diagnostics import Diagnostic, error, warning
from composer.field_types import constant_problem, enumerator_problem
from composer.interfaces import Interfaces, Message
from composer.rules.types import certain_field_problems
from composer.templates import Constant, Items, Record, Template

UNKNOWN_FIELD = error(
    code="RC304",
    name="unknown-field",
    summary="An expression reads, or a map sets, a field that the message does not have.",
    why="The reaction would fail on every message.",
    bad="""\
system: fields
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.text}"}
""",
    good="""\
system: fields
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.data}"}
""",
)


def check_unknown_field(context: Context) -> Iterator[Diagnostic]:
    """Report the fields in YAML that do not exist."""
    for problem in certain_field_problems(context):
        if problem.missing:
            yield Diagnostic(UNKNOWN_FIELD, problem.message, problem.span, hint=problem.hint)


INVALID_VALUE = error(
    code="RC305",
    name="invalid-value",
    summary="A constant or an expression does not fit the field it is assigned to.",
    why=(
        "Message fields are typed and bounded: 300 does not fit a uint8, text does not fit a "
        "number, and a condition must be a bool. The reaction would fail at run time."
    ),
    bad="""\
system: values
nodes:
  talker:
    publishers: {level: {type: std_msgs/msg/UInt8, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {level: {data: 300}}}}
""",
    good="""\
system: values
nodes:
  talker:
    publishers: {level: {type: std_msgs/msg/UInt8, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {level: {data: 200}}}}
""",
)


def check_invalid_value(context: Context) -> Iterator[Diagnostic]:
    """Report the values in YAML that do not fit."""
    for problem in certain_field_problems(context):
        if not problem.missing:
            yield Diagnostic(INVALID_VALUE, problem.message, problem.span, hint=problem.hint)


UNKNOWN_ENUMERATOR = warning(
    code="RC306",
    name="unknown-enumerator",
    summary="A field for which the message defines constants is set to another number.",
    why=(
        "A message that defines STATUS_IDLE and STATUS_BUSY expects one of them in its field "
        "'status'. Subscribers cannot interpret any other number."
    ),
    bad="""\
system: battery
nodes:
  battery:
    publishers: {charge: {type: sensor_msgs/msg/BatteryState, qos: state, external: true}}
    timers: {tick: {period_ms: 1000, publish: {charge: {power_supply_status: 9}}}}
""",
    good="""\
system: battery
nodes:
  battery:
    publishers: {charge: {type: sensor_msgs/msg/BatteryState, qos: state, external: true}}
    timers: {tick: {period_ms: 1000, publish: {charge: {power_supply_status: 2}}}}
""",
)


def check_unknown_enumerator(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers that message fields are set to."""
    for template, message in message_templates(context):
        yield from _unknown_enumerators(template, message, context.interfaces)


def _unknown_enumerators(
    template: Template, message: Message, interfaces: Interfaces
) -> Iterator[Diagnostic]:
    if not isinstance(template, Record):
        return
    for name, content in template.fields:
        field = message.field(name.value)
        if field is None:
            continue
        nested = interfaces.message(field.type.name)
        for item in content.items if isinstance(content, Items) else (content,):
            if isinstance(item, Constant):
                if constant_problem(item.value, field.type.element, interfaces) is None:
                    yield from _unknown_enumerator(item, name.value, message)
            elif nested is not None:
                yield from _unknown_enumerators(item, nested, interfaces)


def _unknown_enumerator(constant: Constant, field: str, message: Message) -> Iterator[Diagnostic]:
    problem = enumerator_problem(message, field, constant.value)
    if problem is not None:
        yield Diagnostic(UNKNOWN_ENUMERATOR, problem[0], constant.span, hint=problem[1])

"""A number that is none of the constants of its field."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.messages.reactions import message_templates
from composer.diagnostics import Diagnostic, warning
from composer.field_types import constant_problem, enumerator_problem
from composer.interfaces import Interfaces, Message
from composer.templates import Constant, Items, Record, Template

RULE = warning(
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers that message fields are set to."""
    for template, message in message_templates(context):
        yield from _template(template, message, context.interfaces)


def _template(template: Template, message: Message, interfaces: Interfaces) -> Iterator[Diagnostic]:
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
                    yield from _number(item, name.value, message)
            elif nested is not None:
                yield from _template(item, nested, interfaces)


def _number(constant: Constant, field: str, message: Message) -> Iterator[Diagnostic]:
    problem = enumerator_problem(message, field, constant.value)
    if problem is not None:
        yield Diagnostic(RULE, problem[0], constant.span, hint=problem[1])

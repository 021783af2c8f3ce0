"""A number that is none of the constants of its field."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from composer.analysis.context import Context
from composer.analysis.messages.reactions import message_templates
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.field_types import constant_problem
from composer.interfaces import Interfaces, Message
from composer.templates import Constant, Items, Record, Template

RULE = register(
    Rule(
        code="RC306",
        name="unknown-enumerator",
        severity=Severity.WARNING,
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
)

#: Maximum number of names in a hint.
_SHOWN = 6


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
    value = constant.value
    known = _enumerators(message, field)
    if not known or not isinstance(value, int) or isinstance(value, bool):
        return
    if value in known.values() or _is_combination(value, set(known.values())):
        return
    names = [f"{number} {name}" for name, number in known.items()]
    listed = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
    yield Diagnostic(
        RULE,
        f"{message.name} has no constant for '{field}' with the value {value}",
        constant.span,
        hint=f"valid here: {listed}",
    )


def _enumerators(message: Message, field: str) -> Mapping[str, int]:
    """Return the constants that are named after the field: STATUS_IDLE for ``status``.

    Without any, they are all constants of the message if only this field has their type.
    """
    prefix = f"{field.upper()}_"
    numbers = [item for item in message.constants if isinstance(item.value, int)]
    found = [item for item in numbers if item.name.startswith(prefix)]
    types = {item.type for item in message.constants}
    alike = [item.name for item in message.fields if item.type in types]
    if not found and len(numbers) > 1 and len(types) == 1 and alike == [field]:
        found = numbers
    return {item.name: item.value for item in found if isinstance(item.value, int)}


def _is_combination(value: int, known: set[int]) -> bool:
    """Return whether the constants are flags and ``value`` is a combination of them."""
    flags = known - {0}
    if not all(flag > 0 and flag.bit_count() == 1 for flag in flags) or max(flags, default=0) < 4:
        return False
    return value & ~sum(flags) == 0

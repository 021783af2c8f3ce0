"""Scenarios: the names, times, values and expressions of their steps and expectations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from composer.base.diagnostics import Diagnostic, Label, suggestion
from composer.base.source import Located, Span
from composer.interfaces import Message
from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.types import NUMBER, STATUS, ValueType
from composer.language.expressions import Expression
from composer.language.rules import KEYS_EXCLUDE_EACH_OTHER, OUT_OF_RANGE, UNKNOWN_KEY
from composer.language.templates import Template, expressions_in
from composer.language.tree import Plain
from composer.model import Channel, ChannelKind, Node, System
from composer.model.names import matches_wildcard
from composer.model.scenario import (
    Action,
    Condition,
    EventKind,
    Expectation,
    ExpectationKind,
    Scenario,
    Verb,
)
from composer.python_code.nodes import handlers
from composer.rules.analysis.context import Context, part_of_path
from composer.rules.analysis.parameters import KNOWN_TYPES, range_problem, type_problem
from composer.rules.connections import no_node
from composer.rules.expressions import UNKNOWN_NAME
from composer.rules.implementations import SETTING_WITHOUT_EFFECT
from composer.rules.parameter_values import PARAMETER_VALUE
from composer.rules.parameters import UNKNOWN_PARAMETER
from composer.rules.references import UNDECLARED_NAME, UNKNOWN_NODE, unknown_name

_KINDS = (*EventKind, *ExpectationKind)
_COUNTS = frozenset({"after_s", "within_s", "at_least", "at_most"})
_VALUES = frozenset({"where", "fields", "tolerance"})
#: The keys of each kind of expectation. A condition has those that are about one event.
_KEYS: dict[str, frozenset[str]] = {
    **dict.fromkeys((EventKind.MESSAGE, EventKind.RESPONSE, EventKind.RESULT), _VALUES | _COUNTS),
    EventKind.LOG: frozenset({"node", "level"}) | _COUNTS,
    EventKind.STATE: frozenset({"after_s", "within_s"}),
    ExpectationKind.RATE: frozenset({"where", "after_s", "for_s", "at_least_hz", "at_most_hz"}),
    ExpectationKind.SILENCE: frozenset({"where", "after_s", "for_s"}),
    ExpectationKind.ORDER: frozenset({"after_s", "within_s"}),
    ExpectationKind.LATENCY: frozenset({"at_most_ms"}),
    ExpectationKind.END_STATE: frozenset(),
}
#: What no node does if none provides a channel that a step or an expectation names.
_NOT_DONE = {
    ChannelKind.TOPIC: "publishes",
    ChannelKind.SERVICE: "serves",
    ChannelKind.ACTION: "serves",
}
#: The step without which an event or a step has nothing to wait for.
_NEEDED = {
    EventKind.RESPONSE: Verb.CALL,
    EventKind.RESULT: Verb.SEND_GOAL,
    Verb.CANCEL: Verb.SEND_GOAL,
}
_NOW: dict[str, ValueType] = {"now": NUMBER}
#: How a goal ends, also one that is not accepted.
_STATUS = replace(STATUS, words=(*STATUS.words, "rejected"))


def check_keys(context: Context) -> Iterator[Diagnostic]:
    """Check that each expectation is of one kind, and has the keys of that kind."""
    scenario = context.scenario
    if scenario is None:
        return
    events = [step.when for step in scenario.steps if step.when is not None]
    orders = (item for item in scenario.all_expectations if item.kind is ExpectationKind.ORDER)
    items: list[Expectation | Condition] = [*scenario.all_expectations, *events]
    items += (event for order in orders for event in order.events)
    for item in items:
        kinds = [key for key in item.given if key.value in _KINDS]
        for first, second in pairwise(kinds):
            message = f"this has both '{first}' and '{second}'"
            labels = (Label(first.span, "the other one"),)
            hint = "write two expectations" if isinstance(item, Expectation) else "keep one of them"
            yield Diagnostic(KEYS_EXCLUDE_EACH_OTHER, message, second.span, labels, hint)
        for key in item.given if len(kinds) == 1 else ():
            if key.value not in (item.kind, *_KEYS[item.kind]):
                valid = suggestion(key.value, _KEYS[item.kind])
                message = f"'{key}' has no meaning with '{item.kind}'"
                yield Diagnostic(UNKNOWN_KEY, message, key.span, hint=valid)


def check_times(context: Context) -> Iterator[Diagnostic]:
    """Check that steps are in order, and that what is expected can happen within the run."""
    scenario = context.scenario
    if scenario is None:
        return
    base_s = 0.0  # the earliest time of the step
    for step in scenario.steps:
        at_s = step.at_s
        if at_s is not None and at_s.value < base_s:
            message = f"the previous step is not before {base_s:g} s"
            hint = "the steps run in the order of the file"
            yield Diagnostic(OUT_OF_RANGE, message, at_s.span, hint=hint)
        base_s = max(base_s, 0.0 if at_s is None else at_s.value) + step.after_s
        if base_s > scenario.for_s.value:
            yield _too_late(scenario, f"the step at {base_s:g} s", at_s.span if at_s else step.span)
            break
        for item in step.expectations:
            yield from _window(scenario, item, base_s)
    for item in scenario.expectations:
        yield from _window(scenario, item, 0.0)
    for item in scenario.all_expectations:
        for low, high in (("at_least", "at_most"), ("at_least_hz", "at_most_hz")):
            least, most = item.limits.get(low), item.limits.get(high)
            if least is not None and most is not None and least.value > most.value:
                message = f"'{low}' is above '{high}'"
                yield Diagnostic(OUT_OF_RANGE, message, least.span, (Label(most.span, high),))


def _window(scenario: Scenario, item: Expectation, base_s: float) -> Iterator[Diagnostic]:
    until_s = item.until_s
    if until_s is not None and until_s.value <= item.after_s:
        message = f"this must happen after {item.after_s:g} s and within {until_s.value:g} s"
        yield Diagnostic(OUT_OF_RANGE, message, until_s.span)
    elif until_s is not None and base_s + until_s.value > scenario.for_s.value:
        yield _too_late(scenario, f"{base_s + until_s.value:g} s", until_s.span)
    elif base_s + item.after_s >= scenario.for_s.value and item.after_s:
        yield _too_late(scenario, f"{base_s + item.after_s:g} s", item.span)


def _too_late(scenario: Scenario, what: str, span: Span) -> Diagnostic:
    message = f"{what} is after the end of the run, which lasts {scenario.for_s.value:g} s"
    return Diagnostic(OUT_OF_RANGE, message, span, (Label(scenario.for_s.span, "the end"),))


def check_names(context: Context) -> Iterator[Diagnostic]:
    """Check the topics, services, actions, nodes and chains that a scenario names."""
    scenario = context.scenario
    if scenario is None or context.is_partial:
        return
    for action in (item for item in scenario.actions if item.replay is None):  # see replays.py
        if action.verb.channel is None:
            yield from _unknown_node(context, action.name, action.node)
        else:
            is_sink = action.verb.channel is ChannelKind.TOPIC
            yield from _unknown_channel(context, action.verb.channel, action.name, is_sink=is_sink)
    for event in scenario.conditions:
        if event.kind.channel is not None:
            yield from _unknown_channel(context, event.kind.channel, event.name, is_sink=False)
        nodes = [name for name, _ in event.states]
        for name in (*nodes, *([event.node] if event.node is not None else [])):
            yield from _unknown_node(context, name, name.value)
    chains = [chain.name.value for chain in context.system.chains]
    for item in scenario.all_expectations:
        for name, _ in item.states:
            yield from _unknown_node(context, name, name.value)
        if item.name is not None and item.name.value not in chains:
            message = f"the system has no chain '{item.name}'"
            hint = suggestion(item.name.value, chains)
            yield Diagnostic(UNDECLARED_NAME, message, item.name.span, hint=hint)
    yield from _without_step(scenario)


def check_exploration(context: Context) -> Iterator[Diagnostic]:
    """Check what ``compose test --explore`` may vary."""
    scenario = context.scenario
    if scenario is None or context.is_partial:
        return
    jitter_ms = scenario.exploration.jitter_ms
    if jitter_ms is not None and jitter_ms.value > scenario.for_s.value * 1000.0:
        yield _too_late(scenario, f"{jitter_ms.value:g} ms", jitter_ms.span)
    for topic in scenario.exploration.topics:
        yield from _unknown_channel(context, ChannelKind.TOPIC, topic, is_sink=True)


def _unknown_node(context: Context, name: Located[str], node: str) -> Iterator[Diagnostic]:
    if _is_replaced(context, node):
        message = f"node '{node}' is not in the run: a bag replaces it"
        yield Diagnostic(UNKNOWN_NODE, message, name.span)
    elif context.system.node(node) is None:
        message = f"'{name}' names node '{node}'"
        span = name.span.part(0, len(node)) if name.value != node else name.span
        yield unknown_name(context, "node", message, Located(node, span))


def _is_replaced(context: Context, node: str) -> bool:
    return any(matches_wildcard(pattern, node) for pattern in context.once(_replaced))


def _replaced(context: Context) -> tuple[str, ...]:
    return () if context.scenario is None else tuple(dict.fromkeys(context.scenario.replaced))


def _unknown_channel(
    context: Context, kind: ChannelKind, name: Located[str], *, is_sink: bool
) -> Iterator[Diagnostic]:
    usable = [
        channel
        for channel in context.all_channels
        if channel.kind is kind
        and any(
            not _is_replaced(context, end.node.name.value)
            for end in (channel.sinks if is_sink else channel.sources)
        )
    ]
    names = [channel.name for channel in usable]
    if name.value not in names:
        not_done = "subscribes to" if is_sink else _NOT_DONE[kind]
        message, hint = no_node(context, not_done, name.value, names)
        yield Diagnostic(UNDECLARED_NAME, message, name.span, hint=hint)


def _without_step(scenario: Scenario) -> Iterator[Diagnostic]:
    """Report responses and results of what no step sends."""
    done = {(action.verb, action.name.value) for action in scenario.actions}
    waiting: list[tuple[Verb | EventKind, Located[str]]]
    waiting = [(event.kind, event.name) for event in scenario.conditions]
    waiting += [(action.verb, action.name) for action in scenario.actions]
    for kind, name in waiting:
        needed = _NEEDED.get(kind)
        if needed is not None and (needed, name.value) not in done:
            message = f"no step has '{needed}: {{{name}: ...}}'"
            yield Diagnostic(UNDECLARED_NAME, message, name.span)


def check_values(context: Context) -> Iterator[Diagnostic]:
    """Check the fields of messages, the expressions, and the values of parameters."""
    scenario = context.scenario
    if scenario is None:
        return
    channels = {(channel.kind, channel.name): channel for channel in context.all_channels}
    for action in scenario.actions:
        kind = action.verb.channel
        channel = None if kind is None else channels.get((kind, action.name.value))
        if channel is not None and action.content is not None:
            sent, scope = context.sent(channel.ends[0].port), _NOW
            if action.verb is Verb.CORRUPT and sent is not None:
                scope = {"message": sent, **_NOW}
            yield from _template(context, action.content, sent, scope)
        elif action.verb is Verb.SET_PARAMETER and action.value is not None:
            yield from _parameter(context.system, action.name, action.value)
        elif action.verb in (Verb.RAISE_IN, Verb.HANG):
            yield from _handler(context.system, action)
        elif action.verb is Verb.DELAY_TIMER:
            yield from _timer(context.system, action)
    for event in scenario.conditions:
        kind = event.kind.channel
        channel = None if kind is None else channels.get((kind, event.name.value))
        if channel is not None:
            yield from _event(context, event, channel)


def _event(context: Context, event: Condition, channel: Channel) -> Iterator[Diagnostic]:
    messages = context.messages(channel.ends[0].port)
    part = next((name for name in ("message", "response", "result") if name in messages), None)
    if part is None:
        return
    received = messages[part]
    scope = {**_NOW, part: received, **({"status": _STATUS} if part == "result" else {})}
    if event.where is not None:
        where, span = event.where.value, event.where.span
        names = list(_names(where, span, scope))
        yield from names
        if not names:
            yield from FieldChecker(context.interfaces, scope).condition(where, span)
    if event.fields is not None:
        yield from _template(context, event.fields, received, _NOW)


def _template(
    context: Context, content: Template, message: Message | None, scope: dict[str, ValueType]
) -> Iterator[Diagnostic]:
    names = [
        problem
        for expression, span in expressions_in(content)
        for problem in _names(expression, span, scope)
    ]
    yield from names
    if message is not None and not names:
        yield from FieldChecker(context.interfaces, scope).template(content, message)


def _names(expression: Expression, span: Span, scope: dict[str, ValueType]) -> Iterator[Diagnostic]:
    for path in expression.paths:
        if path.root not in scope:
            place = part_of_path(span, expression, path)
            message = f"name '{path.root}' is not available here"
            hint = suggestion(path.root, scope)
            yield Diagnostic(UNKNOWN_NAME, message, place, hint=hint)


def _parameter(system: System, name: Located[str], value: Located[Plain]) -> Iterator[Diagnostic]:
    key, _, parameter_name = name.value.partition(".")
    node = system.node(key)
    if node is None:
        return
    parameter = node.parameter(parameter_name)
    if parameter is None:
        names = [item.name.value for item in node.parameters]
        span = name.span.part(len(key) + 1, len(parameter_name))
        message = f"node '{key}' has no parameter '{parameter_name}'"
        yield Diagnostic(UNKNOWN_PARAMETER, message, span, hint=suggestion(parameter_name, names))
    elif parameter.type.value in KNOWN_TYPES:
        is_double = parameter.type.value == "double" and type(value.value) is int
        problem = None if is_double else type_problem(value.value, parameter.type.value)
        label = Label(parameter.name.span, f"declared as {parameter.type}")
        if problem is not None:
            message = f"parameter '{parameter_name}' must be of type {parameter.type}"
            message = f"{message}, not {problem}"
            yield Diagnostic(PARAMETER_VALUE, message, value.span, (label,))
        elif (limit := range_problem(parameter, value.value)) is not None:
            message = f"parameter '{parameter_name}': {limit.message}"
            labels = (Label(limit.limit.span, "the limit"),)
            yield Diagnostic(PARAMETER_VALUE, message, value.span, labels)


def _handler(system: System, action: Action) -> Iterator[Diagnostic]:
    node: Node | None = system.node(action.node)
    if node is None:
        return
    if node.behavior is None:
        if node.hosted_class is None:
            message = f"node '{action.name}' has no behavior and no class"
            message = f"{message}, in which '{action.verb}' could act"
            yield Diagnostic(SETTING_WITHOUT_EFFECT, message, action.name.span)
        return  # a callback of a class may be any function
    handler = action.options.get("handler")
    names = [item.name for item in handlers(node)]
    if handler is not None and handler.value not in names:
        message = f"node '{action.name}' has no handler '{handler}'"
        hint = suggestion(str(handler), names)
        yield Diagnostic(UNDECLARED_NAME, message, handler.span, hint=hint)


def _timer(system: System, action: Action) -> Iterator[Diagnostic]:
    node: Node | None = system.node(action.node)
    if node is None:
        return
    timer = action.name.value.partition(".")[2]
    names = [item.name.value for item in node.timers]
    if timer not in names:
        message = f"node '{action.node}' has no timer '{timer}'"
        hint = suggestion(timer, names)
        span = action.name.span
        if timer:
            span = span.part(len(action.node) + 1, len(timer))
        yield Diagnostic(UNDECLARED_NAME, message, span, hint=hint)

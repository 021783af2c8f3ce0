"""Declarations of ports, timers and reactions, with their expressions and templates."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Map
from functools import partial
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.base.source import Located, Span
from composer.language.expressions import Expression, ExpressionError, compile_expression
from composer.language.rules import INVALID_EXPRESSION
from composer.language.templates import Computed, Template, Text, compile_template
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    Tree,
    choice,
    entries,
    flag,
    integer,
    is_opaque,
    key,
    mapping,
    number,
    plain_text,
    text,
    text_or_opaque,
    value_or,
)
from composer.model import (
    Event,
    FeedbackSteps,
    Isolation,
    LogLevel,
    Period,
    PeriodUnit,
    Port,
    PortKind,
    Reaction,
    Send,
    Timer,
    TimerClock,
)
from composer.model.ports import CALL_TIMEOUT_MS
from composer.model.resolve.qos import QosTable, implicit_qos

#: The keys of a reaction of a port, a timer or a lifecycle transition.
KEYS = ("when", "set", "log", "publish", "call", "respond")

NODE_EVENTS = (
    ("on_configure", Event.CONFIGURE),
    ("on_activate", Event.ACTIVATE),
    ("on_deactivate", Event.DEACTIVATE),
    ("on_cleanup", Event.CLEANUP),
)
Events = tuple[tuple[Event, Reaction], ...]
_SECTIONS = tuple((kind, kind.section) for kind in PortKind)
_CLIENTS = frozenset({PortKind.CLIENT, PortKind.ACTION_CLIENT})
_INLINE_EVENTS = {
    PortKind.SUBSCRIPTION: Event.MESSAGE,
    PortKind.SERVICE: Event.REQUEST,
    PortKind.ACTION_SERVER: Event.GOAL,
}
_NESTED_EVENTS = {
    PortKind.CLIENT: (("on_response", Event.RESPONSE), ("on_failure", Event.FAILURE)),
    PortKind.ACTION_CLIENT: (
        ("on_feedback", Event.FEEDBACK),
        ("on_result", Event.RESULT),
        ("on_failure", Event.FAILURE),
    ),
}
_IS_SET = partial(flag, default=False)
#: The keys of ports of all kinds, and how to read them.
_SETTINGS: Map[str, Callable[[Tree], Any]] = {
    "result_timeout_ms": number,
    "budget_ms": number,
    "reentrant": _IS_SET,
    "always_on": _IS_SET,
    "external": _IS_SET,
    "required": partial(flag, default=None),
    "description": plain_text,
}


def expression(tree: Tree | None, diagnostics: list[Diagnostic]) -> Located[Expression] | None:
    """Compile a condition. Its span excludes quotes."""
    if not isinstance(tree, Scalar) or not isinstance(tree.value, str) or is_opaque(tree.value):
        return None
    try:
        compiled = compile_expression(tree.value)
    except ExpressionError as error:
        span = tree.part(error.offset, error.length)
        diagnostics.append(Diagnostic(INVALID_EXPRESSION, error.message, span, hint=error.hint))
        return None
    return Located(compiled, tree.part(0, len(tree.value)))


def template(tree: Tree | None, diagnostics: list[Diagnostic]) -> Template | None:
    """Compile a value that may have ``{...}`` in its texts."""
    if tree is None:
        return None
    compiled, problems = compile_template(tree)
    diagnostics.extend(problems)
    return compiled


def reaction(tree: Tree | None, span: Span, diagnostics: list[Diagnostic]) -> Reaction | None:
    """Return the reaction that ``tree`` declares, or None."""
    if not isinstance(tree, Mapping) or not any(entry.name in KEYS for entry in tree):
        return None
    when = expression(tree.get("when"), diagnostics)
    log, level = _log(tree.get("log"), diagnostics)
    return Reaction(
        span=span,
        when=when.value if when is not None else None,
        when_span=when.span if when is not None else None,
        state=_templates(tree.get("set"), diagnostics),
        log=log,
        log_level=level,
        publish=_sends(tree.get("publish"), diagnostics),
        call=_sends(tree.get("call"), diagnostics),
        respond=template(tree.get("respond"), diagnostics),
    )


def nested(entry: Entry | None, event: Event, diagnostics: list[Diagnostic]) -> Events:
    """Return the reaction under a separate key, such as ``on_response``."""
    found = reaction(entry.value, entry.key.span, diagnostics) if entry is not None else None
    return ((event, found),) if found is not None else ()


def node_reactions(tree: Mapping, diagnostics: list[Diagnostic]) -> Events:
    """Return the reactions of a node to its transitions."""
    return tuple(
        found
        for name, event in NODE_EVENTS
        for found in nested(tree.entry(name), event, diagnostics)
    )


def _templates(
    tree: Tree | None, diagnostics: list[Diagnostic]
) -> tuple[tuple[Located[str], Template], ...]:
    compiled = ((key(entry), template(entry.value, diagnostics)) for entry in entries(tree))
    return tuple((name, value) for name, value in compiled if value is not None)


def _sends(tree: Tree | None, diagnostics: list[Diagnostic]) -> tuple[Send, ...]:
    return tuple(Send(name, content) for name, content in _templates(tree, diagnostics))


def _log(tree: Tree | None, diagnostics: list[Diagnostic]) -> tuple[Template | None, LogLevel]:
    if not isinstance(tree, Mapping):
        return template(tree, diagnostics), LogLevel.INFO
    level = value_or(choice(tree.get("level"), LogLevel), LogLevel.INFO)
    return template(tree.get("message"), diagnostics), level


def read_ports(node: Mapping, qos: QosTable, diagnostics: list[Diagnostic]) -> tuple[Port, ...]:
    """Return the ports that a node declares.

    Their full names are the declared ones until the node has a name and a namespace.
    """
    # A class may use its messages again, so they are copied.
    isolation = Isolation.SHARE if node.get("class") is None else Isolation.COPY
    return tuple(
        _port(kind, entry, qos, isolation, diagnostics)
        for kind, section in _SECTIONS
        for entry in entries(node.get(section))
    )


def read_timers(node: Mapping, diagnostics: list[Diagnostic]) -> tuple[Timer, ...]:
    """Return the timers that a node declares."""
    return tuple(_timer(entry, diagnostics) for entry in entries(node.get("timers")))


def _port(
    kind: PortKind, entry: Entry, qos: QosTable, isolation: Isolation, diagnostics: list[Diagnostic]
) -> Port:
    span = entry.key.span
    tree = mapping(entry)
    name = key(entry)
    ros_name = text(tree.get(kind.channel)) or name
    accept = expression(tree.get("accept"), diagnostics)
    return Port(
        kind,
        name,
        text_or_opaque(tree.get("type"), span),
        ros_name,
        ros_name.value,
        qos.resolve(tree.get("qos"), implicit_qos(kind.channel, span)),
        span,
        _reactions(kind, entry, tree, diagnostics),
        _timeout(kind, tree, span),
        accept=accept.value if accept is not None else None,
        accept_span=accept.span if accept is not None else None,
        feedback=_feedback(tree.entry("feedback"), diagnostics),
        result=template(tree.get("result"), diagnostics),
        isolation=value_or(choice(tree.get("isolation"), Isolation), isolation),
        **_settings(tree),
    )


def _settings(tree: Mapping) -> dict[str, Any]:
    """Return the settings that are written: of most ports, that is less than reading them all."""
    return {
        name: _SETTINGS[name](entry.value)
        for entry in tree.entries
        if (name := entry.name) in _SETTINGS
    }


def _timeout(kind: PortKind, tree: Mapping, span: Span) -> Located[float] | None:
    timeout_ms = number(tree.get("timeout_ms"))
    if timeout_ms is None and kind in _CLIENTS:
        return Located(CALL_TIMEOUT_MS, span)
    return timeout_ms


def _reactions(
    kind: PortKind, entry: Entry, tree: Mapping, diagnostics: list[Diagnostic]
) -> Events:
    if kind in _INLINE_EVENTS:
        found = reaction(tree, entry.key.span, diagnostics)
        return ((_INLINE_EVENTS[kind], found),) if found is not None else ()
    return tuple(
        found
        for name, event in _NESTED_EVENTS.get(kind, ())
        for found in nested(tree.entry(name), event, diagnostics)
    )


def _feedback(entry: Entry | None, diagnostics: list[Diagnostic]) -> FeedbackSteps | None:
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    count = integer(entry.value.get("count"))
    period_ms = number(entry.value.get("period_ms"))
    content = template(entry.value.get("message"), diagnostics)
    if count is None or period_ms is None:
        return None
    return FeedbackSteps(count, period_ms, content, entry.key.span)


def _timer(entry: Entry, diagnostics: list[Diagnostic]) -> Timer:
    span = entry.key.span
    tree = mapping(entry)
    return Timer(
        name=key(entry),
        period=_period(tree, span, diagnostics),
        span=span,
        reaction=reaction(tree, span, diagnostics),
        clock=value_or(choice(tree.get("clock"), TimerClock), TimerClock.ROS),
        budget_ms=number(tree.get("budget_ms")),
        reentrant=flag(tree.get("reentrant"), default=False),
        always_on=flag(tree.get("always_on"), default=False),
        description=plain_text(tree.get("description")),
    )


def _period(tree: Mapping, span: Span, diagnostics: list[Diagnostic]) -> Period:
    """Return the period of a timer, without a value if it is invalid (reported elsewhere)."""
    for unit in PeriodUnit:
        written = tree.get(unit.value)
        if written is not None:
            return _written_period(written, unit, diagnostics)
    return Period(None, PeriodUnit.MILLISECONDS, span)


def _written_period(tree: Tree, unit: PeriodUnit, diagnostics: list[Diagnostic]) -> Period:
    value = number(tree)
    if value is not None:
        return Period(value.value, unit, tree.span)
    compiled = template(tree, diagnostics) if isinstance(tree, Scalar) else None
    if isinstance(compiled, Computed):
        return Period(compiled.expression, unit, compiled.span)
    if isinstance(compiled, Text):
        message = f"'{unit}' takes a number or one '{{expression}}', not text around it"
        diagnostics.append(Diagnostic(INVALID_EXPRESSION, message, tree.span))
    return Period(None, unit, tree.span)

"""Declarations of ports, timers and reactions, with their expressions and templates."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Mapping as Map
from functools import partial
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
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

NODE_EVENTS = (Event.CONFIGURE, Event.ACTIVATE, Event.DEACTIVATE, Event.CLEANUP)
Events = tuple[tuple[Event, Reaction], ...]
_SECTIONS = tuple((kind, kind.section) for kind in PortKind)
_CLIENTS = frozenset({PortKind.CLIENT, PortKind.ACTION_CLIENT})
_INLINE_EVENTS = {
    PortKind.SUBSCRIPTION: Event.MESSAGE,
    PortKind.SERVICE: Event.REQUEST,
    PortKind.ACTION_SERVER: Event.GOAL,
}
_NESTED_EVENTS = {
    PortKind.CLIENT: (Event.RESPONSE, Event.FAILURE),
    PortKind.ACTION_CLIENT: (Event.FEEDBACK, Event.RESULT, Event.FAILURE),
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


@dataclass(slots=True)
class ExpressionReader:
    """Reads expressions and templates, and adds the diagnostics of them."""

    diagnostics: list[Diagnostic]

    def expression(self, tree: Tree | None) -> Located[Expression] | None:
        """Compile a condition. Its span excludes quotes."""
        if not isinstance(tree, Scalar) or not isinstance(tree.value, str) or is_opaque(tree.value):
            return None
        try:
            compiled = compile_expression(tree.value)
        except ExpressionError as error:
            span = tree.part(error.offset, error.length)
            self._report(error.message, span, error.hint)
            return None
        return Located(compiled, tree.part(0, len(tree.value)))

    def template(self, tree: Tree | None) -> Template | None:
        """Compile a value that may have ``{...}`` in its texts."""
        if tree is None:
            return None
        compiled, problems = compile_template(tree)
        self.diagnostics.extend(problems)
        return compiled

    def _report(self, message: str, span: Span, hint: str | None = None) -> None:
        self.diagnostics.append(Diagnostic(INVALID_EXPRESSION, message, span, hint=hint))


@dataclass(slots=True)
class PortReader(ExpressionReader):
    """Reads the ports, timers and reactions that nodes declare."""

    qos: QosTable

    def ports(self, node: Mapping) -> tuple[Port, ...]:
        """Return the ports that a node declares.

        Their full names are the declared ones until the node has a name and a namespace.
        """
        # A class may use its messages again, so they are copied.
        isolation = Isolation.SHARE if node.get("class") is None else Isolation.COPY
        return tuple(
            self._port(kind, entry, isolation)
            for kind, section in _SECTIONS
            for entry in entries(node.get(section))
        )

    def timers(self, node: Mapping) -> tuple[Timer, ...]:
        """Return the timers that a node declares."""
        return tuple(map(self._timer, entries(node.get("timers"))))

    def reactions(self, tree: Mapping, events: Iterable[Event] = NODE_EVENTS) -> Events:
        """Return the reactions under the keys of events, such as ``on_response``."""
        written = ((event, tree.entry(f"on_{event}")) for event in events)
        found = ((event, self._reaction(entry.value, entry)) for event, entry in written if entry)
        return tuple((event, reaction) for event, reaction in found if reaction is not None)

    def _reaction(self, tree: Tree, entry: Entry) -> Reaction | None:
        """Return the reaction in an entry, or None."""
        if not isinstance(tree, Mapping) or not any(item.name in KEYS for item in tree):
            return None
        when = self.expression(tree.get("when"))
        log, level = self._log(tree.get("log"))
        return Reaction(
            span=entry.key.span,
            when=when,
            state=self._templates(tree.get("set")),
            log=log,
            log_level=level,
            publish=self._sends(tree.get("publish")),
            call=self._sends(tree.get("call")),
            respond=self.template(tree.get("respond")),
        )

    def _templates(self, tree: Tree | None) -> tuple[tuple[Located[str], Template], ...]:
        compiled = ((key(entry), self.template(entry.value)) for entry in entries(tree))
        return tuple((name, value) for name, value in compiled if value is not None)

    def _sends(self, tree: Tree | None) -> tuple[Send, ...]:
        return tuple(Send(name, content) for name, content in self._templates(tree))

    def _log(self, tree: Tree | None) -> tuple[Template | None, LogLevel]:
        if not isinstance(tree, Mapping):
            return self.template(tree), LogLevel.INFO
        level = value_or(choice(tree.get("level"), LogLevel), LogLevel.INFO)
        return self.template(tree.get("message")), level

    def _port(self, kind: PortKind, entry: Entry, isolation: Isolation) -> Port:
        span = entry.key.span
        tree = mapping(entry)
        name = key(entry)
        ros_name = text(tree.get(kind.channel)) or name
        accept = self.expression(tree.get("accept"))
        return Port(
            kind,
            name,
            text_or_opaque(tree.get("type"), span),
            ros_name,
            ros_name.value,
            self.qos.resolve(tree.get("qos"), implicit_qos(kind.channel, span)),
            span,
            self._port_reactions(kind, entry, tree),
            _timeout(kind, tree, span),
            accept=accept,
            feedback=self._feedback(tree.entry("feedback")),
            result=self.template(tree.get("result")),
            isolation=value_or(choice(tree.get("isolation"), Isolation), isolation),
            **_settings(tree),
        )

    def _port_reactions(self, kind: PortKind, entry: Entry, tree: Mapping) -> Events:
        if kind not in _INLINE_EVENTS:
            return self.reactions(tree, _NESTED_EVENTS.get(kind, ()))
        found = self._reaction(tree, entry)
        return ((_INLINE_EVENTS[kind], found),) if found is not None else ()

    def _feedback(self, entry: Entry | None) -> FeedbackSteps | None:
        if entry is None or not isinstance(entry.value, Mapping):
            return None
        count = integer(entry.value.get("count"))
        period_ms = number(entry.value.get("period_ms"))
        content = self.template(entry.value.get("message"))
        if count is None or period_ms is None:
            return None
        return FeedbackSteps(count, period_ms, content, entry.key.span)

    def _timer(self, entry: Entry) -> Timer:
        tree = mapping(entry)
        return Timer(
            name=key(entry),
            period=self._period(tree, entry.key.span),
            span=entry.key.span,
            reaction=self._reaction(tree, entry),
            clock=value_or(choice(tree.get("clock"), TimerClock), TimerClock.ROS),
            budget_ms=number(tree.get("budget_ms")),
            reentrant=flag(tree.get("reentrant"), default=False),
            always_on=flag(tree.get("always_on"), default=False),
            description=plain_text(tree.get("description")),
        )

    def _period(self, tree: Mapping, span: Span) -> Period:
        """Return the period of a timer, without a value if it is invalid (reported elsewhere)."""
        for unit in PeriodUnit:
            written = tree.get(unit.value)
            if written is not None:
                return self._written_period(written, unit)
        return Period(None, PeriodUnit.MILLISECONDS, span)

    def _written_period(self, tree: Tree, unit: PeriodUnit) -> Period:
        value = number(tree)
        if value is not None:
            return Period(value.value, unit, tree.span)
        compiled = self.template(tree) if isinstance(tree, Scalar) else None
        if isinstance(compiled, Computed):
            return Period(compiled.expression, unit, compiled.span)
        if isinstance(compiled, Text):
            message = f"'{unit}' takes a number or one '{{expression}}', not text around it"
            self._report(message, tree.span)
        return Period(None, unit, tree.span)


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

"""Read a scenario into the model. Its system is resolved before."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.base.source import Located, SourceFile, Span
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    Tree,
    choice,
    entries,
    flag,
    integer,
    items,
    key,
    number,
    plain,
    plain_text,
    text,
    text_or_opaque,
    texts,
    value_or,
)
from composer.model.names import join
from composer.model.ports import LogLevel
from composer.model.resolve.ports import ExpressionReader
from composer.model.scenario import (
    Action,
    Condition,
    EventKind,
    Expectation,
    ExpectationKind,
    Exploration,
    Replay,
    Scenario,
    States,
    Step,
    Verb,
)
from composer.model.system import System

_LIMITS = ("at_least", "at_most", "at_least_hz", "at_most_hz", "at_most_ms")
_CONTENTS = (Verb.PUBLISH, Verb.CALL, Verb.SEND_GOAL)
_VALUES = (Verb.SET_PARAMETER, Verb.TRANSITION)


def resolve_scenario(
    tree: Mapping, source: SourceFile, system: System, folder: Path
) -> tuple[Scenario, list[Diagnostic]]:
    """Return the scenario in a file of a folder, with diagnostics of its expressions."""
    reader = _Reader(system, folder)
    span = next((entry.key.span for entry in tree), tree.span)
    scenario = Scenario(
        name=text_or_opaque(tree.get("scenario"), span),
        source=source,
        for_s=number(tree.get("for_s")) or Located(1.0, span),
        seed=value_or(integer(tree.get("seed")), 0),
        steps=tuple(reader.step(item) for item in items(tree.get("steps"))),
        expectations=tuple(reader.expectations(tree)),
        exit_code=value_or(integer(tree.get("exit_code")), 0),
        allow_errors=flag(tree.get("allow_errors"), default=False),
        exploration=reader.exploration(tree.get("explore")),
    )
    return scenario, reader.diagnostics


class _Reader(ExpressionReader):
    def __init__(self, system: System, folder: Path) -> None:
        super().__init__([])
        self._namespace = system.namespace
        self._folder = folder

    def step(self, tree: Tree) -> Step:
        when = tree.get("when") if isinstance(tree, Mapping) else None
        return Step(
            tree.span,
            at_s=number(_get(tree, "at_s")),
            after_s=value_or(number(_get(tree, "after_s")), 0.0),
            when=self._condition(when) if isinstance(when, Mapping) else None,
            actions=tuple(
                action
                for entry in entries(tree)
                if entry.name in set(Verb)
                for action in self._actions(Verb(entry.name), entry)
            ),
            expectations=tuple(self.expectations(tree)),
        )

    def _actions(self, verb: Verb, entry: Entry) -> Iterator[Action]:
        if verb is Verb.REPLAY:
            yield self._replay(entry)
            return
        name = text(entry.value)
        if name is not None:  # cancel, kill
            yield Action(verb, self._name(verb, name))
        for item in entries(entry.value):
            target = self._name(verb, key(item))
            if verb in _CONTENTS:
                yield Action(verb, target, self.template(item.value))
            elif verb in _VALUES:
                value = Located(plain(item.value), item.value.span)
                yield Action(verb, target, value=value)
            else:
                options = {
                    option.name: Located(plain(option.value), option.value.span)
                    for option in entries(item.value)
                    if isinstance(option.value, Scalar)
                }
                content = self.template(_get(item.value, "set"))
                yield Action(verb, target, content, options=options)

    def _replay(self, entry: Entry) -> Action:
        tree = entry.value
        bag = text_or_opaque(_get(tree, "bag"), entry.key.span)
        replay = Replay(
            self._folder / bag.value,
            tuple(self._name(EventKind.MESSAGE, topic) for topic in texts(_get(tree, "topics"))),
            texts(_get(tree, "replace")),
            number(_get(tree, "start_s")),
            value_or(number(_get(tree, "duration_s")), inf),
        )
        return Action(Verb.REPLAY, bag, replay=replay)

    def _name(self, kind: Verb | EventKind, name: Located[str]) -> Located[str]:
        """Return the full name of a topic, service or action."""
        if kind.channel is None:
            return name
        return name.map(lambda written: join(self._namespace, written))

    def exploration(self, tree: Tree | None) -> Exploration:
        return Exploration(
            jitter_ms=number(_get(tree, "jitter_ms")),
            drop=value_or(integer(_get(tree, "drop")), 0),
            reorder=value_or(integer(_get(tree, "reorder")), 0),
            topics=tuple(self._name(EventKind.MESSAGE, it) for it in texts(_get(tree, "topics"))),
        )

    def _condition(self, tree: Mapping) -> Condition:
        kind = next((kind for kind in EventKind if tree.entry(kind) is not None), EventKind.LOG)
        fields = tree.entry("fields")
        return Condition(
            kind,
            self._name(kind, text_or_opaque(tree.get(kind), tree.span)),
            _span(tree, kind),
            states=_states(tree.get(EventKind.STATE)),
            where=self.expression(tree.get("where")),
            fields=None if fields is None else self.template(fields.value),
            tolerance=value_or(number(tree.get("tolerance")), 0.0),
            node=text(tree.get("node")),
            level=value_or(choice(tree.get("level"), LogLevel), None),
            given=tuple(map(key, tree)),
        )

    def expectations(self, tree: Tree) -> Iterator[Expectation]:
        for item in items(_get(tree, "expect")):
            kinds = (*EventKind, *ExpectationKind)
            kind = next((kind for kind in kinds if _get(item, kind) is not None), None)
            if kind is not None and isinstance(item, Mapping):
                yield self._expectation(kind, item)

    def _expectation(self, kind: EventKind | ExpectationKind, tree: Mapping) -> Expectation:
        events: tuple[Condition, ...] = ()
        if kind is ExpectationKind.ORDER:
            given = items(tree.get(kind))
            events = tuple(self._condition(item) for item in given if isinstance(item, Mapping))
        elif kind in (ExpectationKind.RATE, ExpectationKind.SILENCE):
            topic = self._name(EventKind.MESSAGE, text_or_opaque(tree.get(kind), tree.span))
            where = self.expression(tree.get("where"))
            condition = Condition(EventKind.MESSAGE, topic, _span(tree, kind), where=where)
            events = (condition,)
        elif isinstance(kind, EventKind):
            events = (self._condition(tree),)
        limits = ((name, number(tree.get(name))) for name in _LIMITS)
        return Expectation(
            kind,
            _span(tree, kind),
            events,
            name=text(tree.get(ExpectationKind.LATENCY)),
            states=_states(tree.get(ExpectationKind.END_STATE)),
            after_s=value_or(number(tree.get("after_s")), 0.0),
            until_s=self._until(tree),
            limits={name: value for name, value in limits if value is not None},
            given=tuple(map(key, tree)),
        )

    @staticmethod
    def _until(tree: Mapping) -> Located[float] | None:
        """Return the end of an expectation, after its step."""
        within, lasting = number(tree.get("within_s")), number(tree.get("for_s"))
        after_s = value_or(number(tree.get("after_s")), 0.0)
        return within if lasting is None else lasting.map(lambda for_s: after_s + for_s)


def _get(tree: Tree | None, name: str) -> Tree | None:
    return tree.get(name) if isinstance(tree, Mapping) else None


def _span(tree: Mapping, name: str) -> Span:
    """Return the place of a value, or of its key if it is a map or a list."""
    entry = tree.entry(name)
    if entry is None:
        return tree.span
    return entry.value.span if isinstance(entry.value, Scalar) else entry.key.span


def _states(tree: Tree | None) -> States:
    return tuple((key(entry), plain_text(entry.value)) for entry in entries(tree))

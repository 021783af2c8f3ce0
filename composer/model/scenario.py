"""A scenario: what happens to a system in one run, and what the system must do."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum
from math import inf
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span
from composer.language.expressions import Expression
from composer.language.templates import Template
from composer.language.tree import Plain
from composer.model.names import matches_wildcard
from composer.model.ports import ChannelKind, LogLevel

#: The states that nodes must have, by their keys in the system.
States = tuple[tuple[Located[str], str], ...]


class Verb(StrEnum):
    """What a step does, by its key."""

    PUBLISH = "publish"
    CALL = "call"
    SEND_GOAL = "send_goal"
    CANCEL = "cancel"
    SET_PARAMETER = "set_parameter"
    TRANSITION = "transition"
    DROP = "drop"
    DELAY = "delay"
    DELAY_TIMER = "delay_timer"
    DUPLICATE = "duplicate"
    REORDER = "reorder"
    CORRUPT = "corrupt"
    RAISE_IN = "raise_in"
    HANG = "hang"
    KILL = "kill"
    REPLAY = "replay"

    @property
    def channel(self) -> ChannelKind | None:
        """The kind of channel that the verb is about; None if it is about a node."""
        return _CHANNELS.get(self)


_CHANNELS = {
    **dict.fromkeys((Verb.PUBLISH, Verb.DROP, Verb.DELAY, Verb.DUPLICATE), ChannelKind.TOPIC),
    **dict.fromkeys((Verb.REORDER, Verb.CORRUPT), ChannelKind.TOPIC),
    Verb.CALL: ChannelKind.SERVICE,
    **dict.fromkeys((Verb.SEND_GOAL, Verb.CANCEL), ChannelKind.ACTION),
}


@dataclass(frozen=True, slots=True)
class Replay:
    """The replay of a bag, from ``start_s`` on and for ``duration_s``.

    ``topics`` are patterns of full names; without any, all are played that the system receives and
    does not publish. ``replaced`` are patterns of nodes that the bag stands in for.
    """

    bag: Path
    topics: tuple[Located[str], ...] = ()
    replaced: tuple[Located[str], ...] = ()
    start_s: Located[float] | None = None
    duration_s: float = inf

    def includes(self, topic: str) -> bool:
        """Return whether a topic is played, by its full name."""
        patterns = self.topics
        return not patterns or any(matches_wildcard(item.value, topic) for item in patterns)


@dataclass(frozen=True, slots=True)
class Action:
    """One thing that a step does.

    ``name`` is a topic, service or action with its full name, or the key of a node; of a parameter,
    ``node.parameter``; of a timer, ``node.timer``; of a replay, its bag as it is written.
    ``content`` is a message, a request, a goal, or the fields that ``corrupt`` sets; ``value`` is
    the value of a parameter, or the name of a transition. ``options`` are the other keys.
    """

    verb: Verb
    name: Located[str]
    content: Template | None = None
    value: Located[Plain] | None = None
    options: dict[str, Located[Plain]] = field(default_factory=dict)
    replay: Replay | None = None

    @property
    def node(self) -> str:
        """The key of the node; with a parameter or timer, what precedes the first dot."""
        is_part = self.verb in (Verb.SET_PARAMETER, Verb.DELAY_TIMER)
        return self.name.value.partition(".")[0] if is_part else self.name.value


class EventKind(StrEnum):
    """The kinds of events that a condition names, by its key."""

    MESSAGE = "message"
    RESPONSE = "response"
    RESULT = "result"
    STATE = "state"
    LOG = "log"

    @property
    def channel(self) -> ChannelKind | None:
        """The kind of channel of the event, if it has one."""
        return {
            EventKind.MESSAGE: ChannelKind.TOPIC,
            EventKind.RESPONSE: ChannelKind.SERVICE,
            EventKind.RESULT: ChannelKind.ACTION,
        }.get(self)


@dataclass(frozen=True, slots=True)
class Condition:
    """An event, as far as it is described.

    ``name`` is the full name of a topic, service or action, or the text of a line of the log; empty
    for ``states``. ``fields`` are values that a message must have, ``tolerance`` the largest
    difference of numbers.
    """

    kind: EventKind
    name: Located[str]
    span: Span = field(compare=False)
    states: States = ()
    where: Located[Expression] | None = None
    fields: Template | None = None
    tolerance: float = 0.0
    node: Located[str] | None = None
    level: LogLevel | None = None
    given: tuple[Located[str], ...] = field(default=(), compare=False)  # its keys


class ExpectationKind(StrEnum):
    """The kinds of expectations other than events, by their keys."""

    RATE = "rate"
    SILENCE = "silence"
    ORDER = "order"
    LATENCY = "latency"
    END_STATE = "end_state"


@dataclass(frozen=True, slots=True)
class Expectation:
    """What must happen, after ``after_s`` and until ``until_s`` after the step that expects it.

    ``events`` has one condition for an event, a rate and silence, and several for an order.
    ``until_s`` is None for the end of the run. ``name`` is a chain, with its latency. ``limits``
    are the lowest and the highest number, rate or latency (``at_least``, ``at_most_hz`` ...).
    """

    kind: EventKind | ExpectationKind
    span: Span = field(compare=False)
    events: tuple[Condition, ...] = ()
    name: Located[str] | None = None
    states: States = ()
    after_s: float = 0.0
    until_s: Located[float] | None = None
    limits: dict[str, Located[float]] = field(default_factory=dict)
    given: tuple[Located[str], ...] = field(default=(), compare=False)  # its keys

    def limit(self, name: str) -> float | None:
        """Return a limit; None if it is not set."""
        found = self.limits.get(name)
        return None if found is None else found.value


@dataclass(frozen=True, slots=True)
class Step:
    """What happens at ``at_s``, on the event ``when``, or ``after_s`` after the previous step."""

    span: Span = field(compare=False)
    at_s: Located[float] | None = None
    after_s: float = 0.0
    when: Condition | None = None
    actions: tuple[Action, ...] = ()
    expectations: tuple[Expectation, ...] = ()


@dataclass(frozen=True, slots=True)
class Exploration:
    """What may vary from run to run.

    Messages and timers may be late by ``jitter_ms``, ``drop`` messages may be lost, ``reorder``
    pairs of messages may be swapped: on ``topics`` (their full names), or on all if there are none.
    """

    jitter_ms: Located[float] | None = None
    drop: int = 0
    reorder: int = 0
    topics: tuple[Located[str], ...] = ()


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario without its system. Times are seconds since the end of the bring-up."""

    name: Located[str]
    source: SourceFile
    for_s: Located[float]
    seed: int = 0
    steps: tuple[Step, ...] = ()
    expectations: tuple[Expectation, ...] = ()
    exit_code: int = 0
    allow_errors: bool = False
    exploration: Exploration = field(default_factory=Exploration)

    @property
    def actions(self) -> tuple[Action, ...]:
        """What all steps do."""
        return tuple(action for step in self.steps for action in step.actions)

    @property
    def replaced(self) -> tuple[str, ...]:
        """The patterns of nodes that bags stand in for."""
        replays = (action.replay for action in self.actions if action.replay is not None)
        return tuple(item.value for replay in replays for item in replay.replaced)

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All events that the scenario waits for or expects."""
        awaited = [step.when for step in self.steps if step.when is not None]
        return (*awaited, *(event for item in self.all_expectations for event in item.events))

    @property
    def all_expectations(self) -> tuple[Expectation, ...]:
        """The expectations of all steps and of the whole run."""
        of_steps = [item for step in self.steps for item in step.expectations]
        return (*of_steps, *self.expectations)

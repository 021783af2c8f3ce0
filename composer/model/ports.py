"""The parts of a node: ports, timers with their periods, parameters and reactions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.expressions import EvaluationError, Expression
from composer.language.templates import Template, expressions_in
from composer.language.tree import Plain
from composer.model.qos import QosProfile

#: Default timeout of clients for the server and its response.
CALL_TIMEOUT_MS = 5000.0
#: The parameter of every ROS node that selects the time of /clock.
USE_SIM_TIME = "use_sim_time"


class PeriodUnit(StrEnum):
    """The key under which a timer's period is declared."""

    MILLISECONDS = "period_ms"
    HERTZ = "rate_hz"


class PeriodError(Exception):
    """A period that cannot be evaluated, or that no timer can have."""


@dataclass(frozen=True, slots=True)
class Period:
    """The time between two calls of a timer: a number, or an expression over ``parameters``.

    None: it is not known, since it is invalid or a load-time variable without a value.
    """

    value: float | Expression | None
    unit: PeriodUnit
    span: Span = field(compare=False)

    def evaluate(self, parameters: Mapping[str, object]) -> float:
        """Return the number in ``unit`` for the given parameter values. Raises PeriodError."""
        value: object = self.value
        if value is None:
            raise PeriodError(f"{self.unit} is not known")
        try:
            if isinstance(value, Expression):
                value = value.evaluate({"parameters": parameters})
            return float(value)  # type: ignore[arg-type]
        except (EvaluationError, OverflowError, TypeError, ValueError) as error:
            raise PeriodError(f"{self.unit} cannot be {value}: {error}") from error

    def seconds(self, parameters: Mapping[str, object]) -> float:
        """Return the period in seconds for the given parameter values.

        Raises PeriodError unless it is positive and finite.
        """
        number = self.evaluate(parameters)
        if math.isfinite(number) and number > 0.0:
            seconds = number / 1000.0 if self.unit is PeriodUnit.MILLISECONDS else 1.0 / number
            if math.isfinite(seconds) and seconds > 0.0:
                return seconds
        raise PeriodError(f"{self.unit} must be positive and finite, not {number:g}")


class PortKind(StrEnum):
    """The kinds of ports; the value is the term for messages."""

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    SERVICE = "service"
    CLIENT = "client"
    ACTION_SERVER = "action server"
    ACTION_CLIENT = "action client"

    @property
    def section(self) -> str:
        """The key of a node that declares ports of this kind."""
        return self.value.replace(" ", "_") + "s"

    @property
    def channel(self) -> ChannelKind:
        """The kind of channel of such a port."""
        return _CHANNELS[self]

    @property
    def is_source(self) -> bool:
        """Whether it is a publisher or a server."""
        return self in (PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER)

    @property
    def counterpart(self) -> PortKind:
        """The kind of the ports that it connects to."""
        return next(kind for kind in self.channel.ends if kind is not self)


class ChannelKind(StrEnum):
    """The kinds of channels between nodes."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"

    @property
    def interface_folder(self) -> str:
        """The middle part of its interface names: ``msg``, ``srv`` or ``action``."""
        return {"topic": "msg", "service": "srv", "action": "action"}[self.value]

    @property
    def ends(self) -> tuple[PortKind, ...]:
        """The kinds of its ports, the source first."""
        return tuple(kind for kind in PortKind if kind.channel is self)

    @property
    def keys_of_ends(self) -> tuple[str, str]:
        """The keys of a connection that name its ports, in the same order."""
        return ("from", "to") if self is ChannelKind.TOPIC else ("server", "clients")


_CHANNELS = {
    PortKind.PUBLISHER: ChannelKind.TOPIC,
    PortKind.SUBSCRIPTION: ChannelKind.TOPIC,
    PortKind.SERVICE: ChannelKind.SERVICE,
    PortKind.CLIENT: ChannelKind.SERVICE,
    PortKind.ACTION_SERVER: ChannelKind.ACTION,
    PortKind.ACTION_CLIENT: ChannelKind.ACTION,
}


class Delivery(StrEnum):
    """How messages are delivered between ports of the process."""

    AUTO = "auto"  # directly in the process, and by DDS to other processes
    DDS = "dds"  # by DDS only


class Isolation(StrEnum):
    """Whether subscriptions in the process share the published object or get a copy."""

    SHARE = "share"
    COPY = "copy"


class Event(StrEnum):
    """The event that triggers a reaction."""

    MESSAGE = "message"  # subscription
    REQUEST = "request"  # service
    RESPONSE = "response"  # client, `on_response`
    GOAL = "goal"  # action server, once a goal is accepted
    FEEDBACK = "feedback"  # action client, `on_feedback`
    RESULT = "result"  # action client, `on_result`
    FAILURE = "failure"  # client and action client, `on_failure`
    TIMER = "timer"
    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    CLEANUP = "cleanup"


class LogLevel(StrEnum):
    """The severities of rclpy's loggers."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


#: The numbers of rcl_interfaces/msg/Log.
SEVERITIES = {
    LogLevel.DEBUG: 10,
    LogLevel.INFO: 20,
    LogLevel.WARN: 30,
    LogLevel.ERROR: 40,
    LogLevel.FATAL: 50,
}


@dataclass(frozen=True, slots=True)
class Send:
    """A message, request or goal to send through a port."""

    port: Located[str]
    content: Template


@dataclass(frozen=True, slots=True)
class Reaction:
    """A reaction to an event, declared in YAML.

    If ``when`` is true, the fields take effect in this order: the new ``state`` (all values
    computed from the old one), the log line, messages, calls and goals, the response.
    """

    span: Span = field(compare=False)
    when: Located[Expression] | None = None
    state: tuple[tuple[Located[str], Template], ...] = ()
    log: Template | None = None
    log_level: LogLevel = LogLevel.INFO
    publish: tuple[Send, ...] = ()
    call: tuple[Send, ...] = ()
    respond: Template | None = None

    def expressions(self) -> Iterator[tuple[Expression, Span]]:
        """Yield all expressions with their spans."""
        if self.when is not None:
            yield self.when.value, self.when.span
        contents = [content for _, content in self.state]
        contents += [send.content for send in (*self.publish, *self.call)]
        for content in (*contents, self.log, self.respond):
            if content is not None:
                yield from expressions_in(content)


@dataclass(frozen=True, slots=True)
class Qos:
    """The QoS profile of a port, with the locations that set it and each of its policies."""

    profile: QosProfile
    span: Span = field(compare=False)
    explicit: bool = True
    policy_spans: tuple[tuple[str, Span], ...] = field(default=(), compare=False)
    known: bool = True  # False: based on an unknown profile, so the values are a guess
    inline: frozenset[str] = field(default=frozenset(), compare=False)  # policies set at the port
    #: The policies that a parameter of the node sets; see ``model/qos_overrides.py``.
    overridden: frozenset[str] = field(default=frozenset(), compare=False)

    def policy_span(self, policy: str) -> Span:
        """Return where ``policy`` was set, or the span of the whole profile."""
        return dict(self.policy_spans).get(policy, self.span)

    def own_span(self, policy: str) -> Span:
        """Return where the port itself sets ``policy``, or names the profile that does."""
        return self.policy_span(policy) if policy in self.inline else self.span


@dataclass(frozen=True, slots=True)
class FeedbackSteps:
    """Declared feedback of an action: ``count`` messages, one every ``period_ms``."""

    count: Located[int]
    period_ms: Located[float]
    content: Template | None
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Port:
    """An endpoint of a topic, service or action in a node of a system."""

    kind: PortKind
    name: Located[str]
    interface: Located[str]  # "std_msgs/msg/String"
    ros_name: Located[str]  # as declared; by default the name of the port
    full_name: str  # expanded, remapped and connected: the name in ROS
    qos: Qos
    span: Span = field(compare=False)
    reactions: tuple[tuple[Event, Reaction], ...] = ()
    timeout_ms: Located[float] | None = None  # clients: for the server and its (first) response
    result_timeout_ms: Located[float] | None = None  # action clients; None waits forever
    accept: Located[Expression] | None = None  # action servers: which goals are accepted
    feedback: FeedbackSteps | None = None  # action servers
    result: Template | None = None  # action servers
    budget_ms: Located[float] | None = None  # maximum duration of its callback
    reentrant: bool = False
    always_on: bool = False  # also active while its node is inactive
    external: bool = False  # its other end is outside the system
    delivery: Delivery | None = None  # set by its connection; None: the system's
    isolation: Isolation = Isolation.SHARE
    required: bool | None = None  # whether another endpoint must exist; None: not set
    connected_at: Span | None = field(default=None, compare=False)  # the name of its connection
    declared_qos: Qos | None = field(default=None, compare=False)  # if its connection sets another
    description: str = ""

    def reaction(self, event: Event) -> Reaction | None:
        """Return the reaction to ``event``, or None."""
        return dict(self.reactions).get(event)

    @property
    def call_timeout_ms(self) -> float:
        """How long a client waits for its server, and then for the first response."""
        return CALL_TIMEOUT_MS if self.timeout_ms is None else self.timeout_ms.value


class TimerClock(StrEnum):
    """The clock of a timer."""

    ROS = "ros"  # the node's time: /clock with `use_sim_time`, else STEADY
    STEADY = "steady"  # monotonic real time


@dataclass(frozen=True, slots=True)
class Timer:
    """A timer of a node."""

    name: Located[str]
    period: Period
    span: Span = field(compare=False)
    reaction: Reaction | None = None
    clock: TimerClock = TimerClock.ROS
    budget_ms: Located[float] | None = None  # maximum duration of its callback
    reentrant: bool = False
    always_on: bool = False  # also runs while its node is inactive
    description: str = ""


class ParameterType(StrEnum):
    """The types of ROS parameters (rcl_interfaces/msg/ParameterType)."""

    BOOL = "bool"
    INTEGER = "integer"
    DOUBLE = "double"
    STRING = "string"
    BYTE_ARRAY = "byte_array"
    BOOL_ARRAY = "bool_array"
    INTEGER_ARRAY = "integer_array"
    DOUBLE_ARRAY = "double_array"
    STRING_ARRAY = "string_array"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A declared parameter and its initial value.

    ``value`` is the one set by the system, else the ``default`` object itself, else None.
    """

    name: Located[str]
    type: Located[str]  # a ParameterType; other text is kept for diagnostics
    value: Located[Plain] | None
    default: Located[Plain] | None
    span: Span = field(compare=False)
    minimum: Located[float] | None = None
    maximum: Located[float] | None = None
    step: Located[float] | None = None
    choices: Located[tuple[Plain, ...]] | None = None
    read_only: bool = False
    unit: str = ""
    description: str = ""


@dataclass(frozen=True, slots=True)
class ParameterSection:
    """The parameters for the nodes that a name with wildcards matches, as in a parameter file."""

    name: str
    parameters: tuple[Parameter, ...]

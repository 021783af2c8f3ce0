"""What a node is made of: ports, timers, parameters, and what is done when something happens."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from composer.expressions import Expression
from composer.model.periods import Period
from composer.qos import QosProfile
from composer.source import Located, Span
from composer.templates import Template
from composer.tree import Plain


class PortKind(StrEnum):
    """The six kinds of port a node can have; the value is the word for one of them."""

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    SERVICE = "service"
    CLIENT = "client"
    ACTION_SERVER = "action server"
    ACTION_CLIENT = "action client"

    @property
    def section(self) -> str:
        """The key of a node under which ports of this kind are declared."""
        return self.value.replace(" ", "_") + "s"

    @property
    def channel(self) -> ChannelKind:
        """The kind of channel that such a port is an end of."""
        match self:
            case PortKind.PUBLISHER | PortKind.SUBSCRIPTION:
                return ChannelKind.TOPIC
            case PortKind.SERVICE | PortKind.CLIENT:
                return ChannelKind.SERVICE
            case PortKind.ACTION_SERVER | PortKind.ACTION_CLIENT:
                return ChannelKind.ACTION


class ChannelKind(StrEnum):
    """The three ways in which nodes talk to each other."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"

    @property
    def interface_folder(self) -> str:
        """The middle of such a channel's type name: ``msg``, ``srv`` or ``action``."""
        return {"topic": "msg", "service": "srv", "action": "action"}[self.value]


class Delivery(StrEnum):
    """How messages get from port to port within the process."""

    AUTO = "auto"  # straight, and by DDS as well to whoever is outside
    DDS = "dds"  # by DDS alone


class Isolation(StrEnum):
    """Whether who publishes and who receives in one process hold the same object."""

    SHARE = "share"
    COPY = "copy"


class Event(StrEnum):
    """What a reaction reacts to."""

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
    """rcl's severities, as rclpy's loggers spell them."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


@dataclass(frozen=True, slots=True)
class Send:
    """What goes out of a port: a message to publish, or a request or goal to send."""

    port: Located[str]
    content: Template


@dataclass(frozen=True, slots=True)
class Reaction:
    """What is done, in YAML, when something happens.

    Carried out in the order of the fields: nothing at all unless ``when`` is true; then the new
    ``state`` (all values worked out from the old one), the log line, the messages, the calls and
    goals, the response. ``when_span`` is the place of the expression's text, so that a diagnostic
    can point into it.
    """

    span: Span = field(compare=False)
    when: Expression | None = None
    when_span: Span | None = field(default=None, compare=False)
    state: tuple[tuple[Located[str], Template], ...] = ()
    log: Template | None = None
    log_level: LogLevel = LogLevel.INFO
    publish: tuple[Send, ...] = ()
    call: tuple[Send, ...] = ()
    respond: Template | None = None


@dataclass(frozen=True, slots=True)
class Qos:
    """The profile a port uses, and the place that decided it: of the whole, and of each policy."""

    profile: QosProfile
    span: Span = field(compare=False)
    explicit: bool = True
    policy_spans: tuple[tuple[str, Span], ...] = field(default=(), compare=False)
    known: bool = True  # False: it builds on a name that is no profile, so the values are a guess

    def policy_span(self, policy: str) -> Span:
        """Return where ``policy`` was decided; where the whole profile was, if nowhere closer."""
        return dict(self.policy_spans).get(policy, self.span)


@dataclass(frozen=True, slots=True)
class FeedbackSteps:
    """A declared action: ``count`` feedback messages, one every ``period_ms``."""

    count: Located[int]
    period_ms: Located[float]
    content: Template | None
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Port:
    """One end of a topic, service or action, as one node of one system has it."""

    kind: PortKind
    name: Located[str]
    interface: Located[str]  # "std_msgs/msg/String"
    ros_name: Located[str]  # as declared; the port's own name unless it says otherwise
    full_name: str  # expanded, remapped and connected: what ROS will see
    qos: Qos
    span: Span = field(compare=False)
    reactions: tuple[tuple[Event, Reaction], ...] = ()
    timeout_ms: Located[float] | None = None  # clients: for the server and its (first) answer
    result_timeout_ms: Located[float] | None = None  # action clients; None waits for ever
    accept: Expression | None = None  # action servers: which goals are taken
    accept_span: Span | None = field(default=None, compare=False)
    feedback: FeedbackSteps | None = None  # action servers
    result: Template | None = None  # action servers
    budget_ms: Located[float] | None = None  # how long its callback may take
    reentrant: bool = False
    always_on: bool = False  # it lives while its node is inactive, too
    external: bool = False  # the other end is outside this system
    delivery: Delivery | None = None  # as its connection says; None: as the system does
    isolation: Isolation = Isolation.SHARE
    required: bool | None = None  # whether an other end must be there; None: nobody said
    description: str = ""

    def reaction(self, event: Event) -> Reaction | None:
        """Return what is declared for ``event``, or None."""
        return dict(self.reactions).get(event)


class TimerClock(StrEnum):
    """What a timer goes by."""

    ROS = "ros"  # the node's time: that of /clock with `use_sim_time`, else as STEADY
    STEADY = "steady"  # real time, which nobody sets


@dataclass(frozen=True, slots=True)
class Timer:
    """Something a node does again and again while it is active."""

    name: Located[str]
    period: Period
    span: Span = field(compare=False)
    reaction: Reaction | None = None
    clock: TimerClock = TimerClock.ROS
    budget_ms: Located[float] | None = None  # how long its callback may take
    reentrant: bool = False
    always_on: bool = False  # it runs while its node is inactive, too
    description: str = ""


#: The parameter that every ROS node has: whether its time is that of /clock.
USE_SIM_TIME = "use_sim_time"


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
    """A declared parameter and the value it starts with.

    ``value`` is what the system gives; else it is the very ``default``; None without either.
    """

    name: Located[str]
    type: Located[str]  # a ParameterType; other text is kept for the diagnostic
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

"""The system model: what a YAML file declares, resolved as far as possible, with locations.

The model does not check anything. A reference to a missing entity stays as written, and the rules
report it.
"""

from composer.model.dependencies import Channel, PortOfNode, channels
from composer.model.hosts import Discovery, DiscoveryKind, Host, Process
from composer.model.implementation import (
    BehaviorReference,
    Component,
    Executable,
    ExecutableKind,
    External,
    HostedClass,
    ImplementationKind,
    LifecycleKind,
    Outside,
)
from composer.model.node import (
    DEFAULT_INTROSPECTION,
    DEFAULT_SUPERVISION,
    DRIVEN_BY_MANAGER,
    Dependency,
    Introspection,
    Node,
    OnFailure,
    PrimaryState,
    Remapping,
    RestartBudget,
    Supervision,
    UnknownKey,
    Watch,
)
from composer.model.ports import (
    SEVERITIES,
    USE_SIM_TIME,
    ChannelKind,
    Delivery,
    Event,
    FeedbackSteps,
    Isolation,
    LogLevel,
    Parameter,
    ParameterSection,
    ParameterType,
    Period,
    PeriodError,
    PeriodUnit,
    Port,
    PortKind,
    Qos,
    Reaction,
    Send,
    Timer,
    TimerClock,
)
from composer.model.system import (
    DEFAULT_EXECUTOR,
    Chain,
    Connection,
    Endpoint,
    Executor,
    ExecutorKind,
    NamedQos,
    QosReference,
    System,
    UnmatchedParameters,
    member_system,
)
from composer.model.transforms import (
    POSE_TYPES,
    TF_STATIC_TOPIC,
    TF_TOPIC,
    TF_TYPE,
    DynamicTransform,
    StaticTransform,
    Transforms,
    transform_ports,
)

"""Requests to managers, each with the type of its answer, and the names of services and topics.

Commands import this and not the manager, whose imports include the whole runtime.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.model.names import is_hidden
from composer.plan.drift import ObservedEndpoint
from composer.runtime.protocol.reports import SystemReport

#: The manager node, its services and its topics.
NAME = "manager"
#: std_srvs/srv/Trigger.
IS_ACTIVE = "is_active"
#: At the end of ``startup`` and ``resume``: undo everything if a node fails.
ALL_OR_NOTHING = "_all_or_nothing"
#: Carries documents: see :mod:`composer.runtime.ros.service_requests`.
REQUEST = "request"
#: A hidden service of each manager, with a unique name: see ``manager/other_instances.py``.
INSTANCE_PREFIX = "_instance_"
STATE_TOPIC = "state"
CALLBACKS_TOPIC = "callbacks"

#: A name and its types. Nodes have none; more than one type is a mistake in some node.
NameAndTypes: TypeAlias = tuple[str, tuple[str, ...]]
#: The kinds of names in the ROS graph.
KINDS = ("node", "topic", "service", "action")
#: The sorted names of all nodes, topics, services and actions, including hidden ones.
GraphView: TypeAlias = Mapping[str, tuple[NameAndTypes, ...]]
#: A step that creates a finalized node again, which is unconfigured then.
CREATE = "create"


def visible_names(names: Iterable[NameAndTypes]) -> tuple[NameAndTypes, ...]:
    """Return the names that ROS tools do not hide."""
    return tuple(item for item in names if not is_hidden(item[0]))


# --- queries of commands on this computer: see composer.runtime.manager.graph_view


@dataclass(frozen=True, slots=True)
class GraphAnswer:
    """The names in the ROS graph, by :data:`KINDS`."""

    names: GraphView


@dataclass(frozen=True, slots=True)
class GraphQuery:
    """Asks for the view of the whole graph."""

    Answer: ClassVar = GraphAnswer


@dataclass(frozen=True, slots=True)
class NodesAnswer:
    """The full names of all nodes; a name that two nodes share is listed twice."""

    nodes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NodesQuery:
    """Asks for the nodes that can be meant by a name."""

    Answer: ClassVar = NodesAnswer


@dataclass(frozen=True, slots=True)
class DetailsAnswer:
    """A node, topic or action with its endpoints, as ``ros/endpoints.py`` has them."""

    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class DetailsQuery:
    """Asks for the endpoints of a node, topic or action (``kind``), by its full name."""

    kind: str
    name: str
    Answer: ClassVar = DetailsAnswer


@dataclass(frozen=True, slots=True)
class EndpointsAnswer:
    """The endpoints by node, and the names of all nodes: one that two share is listed twice."""

    endpoints: Mapping[str, tuple[ObservedEndpoint, ...]]
    nodes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class EndpointsQuery:
    """Asks for the endpoints of all nodes."""

    Answer: ClassVar = EndpointsAnswer


@dataclass(frozen=True, slots=True)
class StatusQuery:
    """Asks for the report of the system, with the timings of callbacks and chains on request."""

    callbacks: bool = False
    Answer: ClassVar = SystemReport


@dataclass(frozen=True, slots=True)
class ParameterDescription:
    """The description of a parameter. Bounds are None if there are none."""

    name: str
    type: str
    description: str
    constraints: str
    read_only: bool
    minimum: float | None
    maximum: float | None
    step: float | None


@dataclass(frozen=True, slots=True)
class ParametersAnswer:
    """The descriptions and values of parameters, by node."""

    nodes: Mapping[str, tuple[tuple[ParameterDescription, Any], ...]]


@dataclass(frozen=True, slots=True)
class ParametersQuery:
    """Asks for the parameters of nodes, by their full names; None for all nodes."""

    nodes: tuple[str, ...] | None = None
    Answer: ClassVar = ParametersAnswer


# --- requests by the service


@dataclass(frozen=True, slots=True)
class Done:
    """The end of a request: whether it succeeded, and its result or why it failed, in words."""

    success: bool
    message: str = ""


@dataclass(frozen=True, slots=True)
class Restart:
    """Restarts nodes of the system, by their full names, as one command of the supervisor."""

    nodes: tuple[str, ...]
    Answer: ClassVar = Done


@dataclass(frozen=True, slots=True)
class SaveRecording:
    """Writes the last seconds of a flight recorder; the message of the answer is the folder."""

    Answer: ClassVar = Done


@dataclass(frozen=True, slots=True)
class NodeCall:
    """A request to a service that a node does not have: its full name, and the request."""

    service: str
    request: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class NodeResponses:
    """The responses to the calls of a request, in their order; None if there is no such service."""

    responses: tuple[Mapping[str, Any] | None, ...]


@dataclass(frozen=True, slots=True)
class CallNodes:
    """Calls services of ROS that nodes leave to their manager: ``manager/member_service.py``."""

    calls: tuple[NodeCall, ...]
    Answer: ClassVar = NodeResponses


@dataclass(frozen=True, slots=True)
class Step:
    """A transition of a node, or :data:`CREATE`, with a number that it keeps if it is sent again.

    It begins after the transitions of the nodes ``after`` that were requested before.
    """

    number: int
    transition: str
    node: str
    after: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.transition} {self.node}"


@dataclass(frozen=True, slots=True)
class StepResult:
    """The result of a step: why it failed, or the last report that may not include it."""

    success: bool
    reason: str = ""
    report: int = 0


@dataclass(frozen=True, slots=True)
class StepResults:
    """The results of the steps of a request, in their order."""

    results: tuple[StepResult, ...]


@dataclass(frozen=True, slots=True)
class ChangeStates:
    """Moves nodes of a process of the system.

    ``participant`` is the one that is meant, as it reports itself, or empty: another process of the
    same name, on another computer for example, receives the request as well, but neither follows
    nor answers it. ``sender`` identifies the coordinating process, ``seen_report`` is the number of
    the last report that it has received: see ``manager/publishing.py``. ``are_last`` is whether
    the process ends after the steps.
    """

    participant: str
    sender: str
    seen_report: int
    steps: tuple[Step, ...]
    are_last: bool = False
    Answer: ClassVar = StepResults


@dataclass(frozen=True, slots=True)
class ReportKey:
    """The key of the reports of a process."""

    key: str


@dataclass(frozen=True, slots=True)
class AskReportKey:
    """Asks a process that no coordinating one has started for the key of its reports."""

    Answer: ClassVar = ReportKey


@dataclass(frozen=True, slots=True)
class Instance:
    """A process that runs a system, for ``uptime_s`` seconds: ``manager/other_instances.py``."""

    host: str
    pid: str
    uptime_s: float

"""Parameters and log levels of any node, through the standard services (rcl_interfaces).

A node without logger services is served by the manager of its process: a process keeps the levels
of all its loggers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import (
    DescribeParameters,
    GetLoggerLevels,
    GetParameters,
    ListParameters,
    SetLoggerLevels,
    SetParameters,
)
from rclpy.parameter import Parameter

from composer.base.diagnostics import suggestion
from composer.client.graph_names import GraphNames
from composer.client.requests import ServiceCaller, required
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.client.systems.local_queries import nodes_with
from composer.client.systems.managers import DISCOVERY_S, Systems
from composer.client.systems.node_services import NodeServices
from composer.model import SEVERITIES, LogLevel
from composer.model.names import is_hidden
from composer.runtime.callbacks.log import logger_name
from composer.runtime.protocol.requests import NAME, ParameterDescription
from composer.runtime.ros.conversions import NOT_SET, description, plain_value

T = TypeVar("T")
_GET, _SET = "get_logger_levels", "set_logger_levels"
_GET_TYPE = "rcl_interfaces/srv/GetLoggerLevels"
#: Of a logger whose level was never set: the level of its process applies.
UNSET = "unset"
_LEVELS = {severity: level.value for level, severity in SEVERITIES.items()}


class UnknownParameterError(RosError):
    """The node has no such parameter."""


class InvalidResponseError(RosError):
    """The response of the node does not fit the request."""


class ParameterRejectedError(RosError):
    """The node rejected the value."""


class ParameterClient:
    """Reads and sets the parameters of a node. Raises NotFoundError if there is no such node."""

    def __init__(self, session: Session, deadline: Deadline, node: str) -> None:
        self._session = session
        self._deadline = deadline
        self.node = GraphNames(session, deadline).find_node(node)
        self._services = NodeServices(session)
        # Its manager may have the services: wait until that, or the node itself, is discovered.
        session.search(lambda: self._services.has(self.node, ListParameters, deadline), deadline)

    def close(self) -> None:
        """Destroy clients and subscriptions; the end of the session does so too."""
        self._services.close()

    def names(self) -> tuple[str, ...]:
        """Return the names of all parameters, sorted. Raises NoResponseError."""
        response = self._call(ListParameters, ListParameters.Request())
        return tuple(sorted(response.result.names))

    def values(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters, None if not set. Raises UnknownParameterError."""
        requested = list(names)
        self._check_known(requested)
        request = GetParameters.Request(names=requested)
        response = self._call(GetParameters, request)
        return {
            name: plain_value(value) for name, value in self._by_name(requested, response.values)
        }

    def describe(self, names: Iterable[str]) -> tuple[ParameterDescription, ...]:
        """Return the descriptions of parameters. Raises UnknownParameterError."""
        requested = list(names)
        self._check_known(requested)
        request = DescribeParameters.Request(names=requested)
        response = self._call(DescribeParameters, request)
        return tuple(
            description(name, found)
            for name, found in self._by_name(requested, response.descriptors)
        )

    def set(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set parameters and return the values that were set.

        An integer is converted for a parameter of type double. Raises UnknownParameterError,
        ParameterRejectedError with the reason.
        """
        types = {item.name: item.type for item in self.describe(values)}
        messages = [_message(name, value, types[name]) for name, value in values.items()]
        request = SetParameters.Request(parameters=messages)
        response = self._call(SetParameters, request, once=True)
        rejected = [
            f"{name}: {result.reason or 'no reason given'}"
            for name, result in self._by_name(list(values), response.results)
            if not result.successful
        ]
        if rejected:
            raise ParameterRejectedError(f"{self.node} rejected " + "; ".join(rejected))
        return {item.name: plain_value(item.value) for item in messages}

    def load(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set the parameters of a file, except for read-only ones that have the value already.

        ROS nodes dump read-only parameters together with the others. Raises like :meth:`set`.
        """
        present = self.values(values)
        fixed = {item.name for item in self.describe(values) if item.read_only}
        return self.set(
            {
                name: value
                for name, value in values.items()
                if name not in fixed or value != present[name]
            }
        )

    def _by_name(self, names: list[str], responses: Sequence[T]) -> Iterable[tuple[str, T]]:
        """Return the names with their responses. Raises InvalidResponseError."""
        if len(names) != len(responses):
            raise InvalidResponseError(
                f"{self.node} responded with {len(responses)} values for {len(names)} parameters",
                "another node may have the same name; 'compose doctor' checks that",
            )
        return zip(names, responses, strict=True)

    def _check_known(self, names: Iterable[str]) -> None:
        known = self.names()
        for name in names:
            if name not in known:
                raise UnknownParameterError(
                    f"{self.node} has no parameter '{name}'", suggestion(name, known)
                )

    def _call(self, kind: Any, request: Any, *, once: bool = False) -> Any:
        try:
            return self._services.call(kind, self.node, request, self._deadline, once=once)
        except NoResponseError as error:
            raise NoResponseError(
                f"{self.node} did not respond within {self._deadline.timeout_s:g} s",
                "its parameter services may be disabled, or its process may be busy",
            ) from error


def names_by_node(
    session: Session, deadline: Deadline, *, hidden: bool = False
) -> dict[str, list[str] | None]:
    """Return the parameter names of all nodes, None for nodes that did not respond in time."""
    with NodeServices(session) as services:
        found = session.wait_until_settled(
            lambda: services.nodes(ListParameters, deadline), deadline
        )
        nodes = sorted(node for node in found if hidden or not is_hidden(node))
        requests = dict.fromkeys(nodes, ListParameters.Request())
        responses = services.call_all(ListParameters, requests, deadline)
    return {
        node: None if response is None else sorted(response.result.names)
        for node, response in responses.items()
    }


def _message(name: str, value: Any, kind: str) -> ParameterMessage:
    """Return the parameter with its declared type. Raises ParameterRejectedError."""
    try:
        if kind == NOT_SET:
            return Parameter(name, value=value).to_parameter_msg()
        declared = Parameter.Type[kind.upper()]
        return Parameter(name, declared, _converted(value, kind)).to_parameter_msg()
    except (TypeError, ValueError, OverflowError, AssertionError) as error:
        raise ParameterRejectedError(
            f"parameter '{name}' has type {kind}, got {value!r}"
        ) from error


def _converted(value: Any, kind: str) -> Any:
    match kind, value:
        case "double", int() if not isinstance(value, bool):
            return float(value)
        case "double_array", list():
            return [float(item) if type(item) is int else item for item in value]
        case "byte_array", list():
            return [bytes([item]) if type(item) is int else item for item in value]
        case _:
            return value


class LevelRejectedError(RosError):
    """The node did not set the level."""


class LoggerLevels:
    """Reads and sets the levels of the loggers of nodes, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._systems = Systems(session, deadline)
        self._caller = ServiceCaller(session)

    def all(self) -> dict[str, str | None]:
        """Return the levels of all nodes that can be asked, None for those that do not respond."""
        self._session.wait_until_settled(self._systems.discover, self._deadline)
        self._session.wait_for(
            lambda: None not in self._systems.current().values(),
            self._deadline.at_most(DISCOVERY_S),
        )
        servers = self._servers()
        by_server: dict[str, list[str]] = {}
        for node, server in sorted(servers.items()):
            by_server.setdefault(server, []).append(node)
        levels: dict[str, str | None] = dict.fromkeys(sorted(servers))
        responses = self._levels(by_server).values()
        for nodes, response in zip(by_server.values(), responses, strict=True):
            if response is not None:
                levels.update(zip(nodes, map(_name_of, response.levels), strict=False))
        return levels

    def get(self, node: str) -> tuple[str, str]:
        """Return the full name of a node and its level.

        Raises NotFoundError; RosError if the level of the node cannot be read.
        """
        found, server = self._find(node)
        response = required(self._levels({server: [found]}), self._deadline)
        return found, _name_of(response.levels[0])

    def set(self, node: str, level: LogLevel) -> str:
        """Set the level of a node, and return its full name. Raises like ``get``."""
        found, server = self._find(node)
        request = SetLoggerLevels.Request(
            levels=[LoggerLevel(name=logger_name(found), level=SEVERITIES[level])]
        )
        service = f"{server}/{_SET}"
        response = self._caller.call_once(SetLoggerLevels, service, request, self._deadline)
        (result,) = response.results
        if not result.successful:
            raise LevelRejectedError(f"{found} did not set its log level: {result.reason}")
        return found

    def _levels(self, nodes: Mapping[str, list[str]]) -> dict[str, Any]:
        """Return the responses by the names of services, None without one; ``nodes`` by server."""
        calls = {}
        for server, served in nodes.items():
            request = GetLoggerLevels.Request(names=list(map(logger_name, served)))
            calls[f"{server}/{_GET}"] = (GetLoggerLevels, request)
        return self._caller.call_each(calls, self._deadline)

    def _find(self, node: str) -> tuple[str, str]:
        """Return the full name of a node, and the node with the services for it."""
        found = GraphNames(self._session, self._deadline).find_node(node)
        server = self._session.wait_for(
            lambda: self._servers().get(found), self._deadline.at_most(DISCOVERY_S)
        )
        if server is None:
            raise RosError(
                f"{found} has no services for log levels",
                "start it with 'enable_logger_service' (rclpy, rclcpp)",
            )
        return found, server

    def _servers(self) -> dict[str, str]:
        """Return the nodes with the services, by the nodes that they serve."""
        self._systems.discover()
        of_managers = {
            item.node: f"{name}/{NAME}"
            for name, report in self._systems.current().items()
            if report is not None
            for item in report.nodes
            if (item.pid, item.host or report.host) == (report.pid, report.host)
        }
        own = nodes_with(self._session.graph.services(), f"/{_GET}", _GET_TYPE)
        return of_managers | {node: node for node in own}


def _name_of(level: LoggerLevel) -> str:
    return _LEVELS.get(level.level, UNSET)

"""Parameters of any node, through the standard parameter services (rcl_interfaces)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from typing import Any, TypeVar

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
)
from rclpy.parameter import Parameter

from composer.base.diagnostics import suggestion
from composer.client.graph_names import GraphNames
from composer.client.requests import (
    Call,
    ServiceCaller,
    call_all_with_retries,
    call_once,
    call_with_retries,
)
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.client.systems.proxies import PARAMETERS, Proxies
from composer.language.tree import Plain
from composer.runtime.protocol.requests import ParameterDescription, full_parameter_name
from composer.runtime.ros.parameter_values import NOT_SET, description, plain_value

T = TypeVar("T")

_LIST_SERVICE = "/list_parameters"


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
        manager = _manager(session, deadline, self.node)
        #: The node with the services, and the prefix of the parameter names there.
        self._server, self._prefix = (
            (manager, full_parameter_name(self.node, "")) if manager else (self.node, "")
        )

    def names(self) -> tuple[str, ...]:
        """Return the names of all parameters, sorted. Raises NoResponseError."""
        request = ListParameters.Request(prefixes=[self.node] if self._prefix else [])
        response = self._call(call_with_retries, ListParameters, "list_parameters", request)
        return tuple(sorted(name.removeprefix(self._prefix) for name in response.result.names))

    def values(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters, None if not set. Raises UnknownParameterError."""
        requested = list(names)
        self._check_known(requested)
        request = GetParameters.Request(names=self._qualified(requested))
        response = self._call(call_with_retries, GetParameters, "get_parameters", request)
        return {
            name: plain_value(value) for name, value in self._by_name(requested, response.values)
        }

    def describe(self, names: Iterable[str]) -> tuple[ParameterDescription, ...]:
        """Return the descriptions of parameters. Raises UnknownParameterError."""
        requested = list(names)
        self._check_known(requested)
        request = DescribeParameters.Request(names=self._qualified(requested))
        response = self._call(call_with_retries, DescribeParameters, "describe_parameters", request)
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
        request = SetParameters.Request(
            parameters=[
                ParameterMessage(name=f"{self._prefix}{item.name}", value=item.value)
                for item in messages
            ]
        )
        response = self._call(call_once, SetParameters, "set_parameters", request)
        rejected = [
            f"{name}: {result.reason or 'no reason given'}"
            for name, result in self._by_name(list(values), response.results)
            if not result.successful
        ]
        if rejected:
            raise ParameterRejectedError(f"{self.node} rejected " + "; ".join(rejected))
        return {item.name: plain_value(item.value) for item in messages}

    def delete(self, name: str) -> None:
        """Delete a parameter. Raises UnknownParameterError, ParameterRejectedError.

        Nodes delete only parameters that they declared without a fixed type.
        """
        self._check_known([name])
        (qualified,) = self._qualified([name])
        request = SetParameters.Request(parameters=[ParameterMessage(name=qualified)])
        (result,) = self._call(call_once, SetParameters, "set_parameters", request).results
        if not result.successful:
            reason = result.reason or "no reason given"
            raise ParameterRejectedError(f"{self.node} did not delete {name}: {reason}")

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

    def _qualified(self, names: Iterable[str]) -> list[str]:
        """Return the names of parameters at the node with the services."""
        return [f"{self._prefix}{name}" for name in names]

    def _call(self, send: Call, service: Any, name: str, request: Any) -> Any:
        try:
            return send(self._session, service, f"{self._server}/{name}", request, self._deadline)
        except NoResponseError as error:
            raise NoResponseError(
                f"{self.node} did not respond within {self._deadline.timeout_s:g} s",
                "its parameter services may be disabled, or its process may be busy",
            ) from error


def names_by_node(
    session: Session, deadline: Deadline, *, hidden: bool = False
) -> dict[str, list[str] | None]:
    """Return the parameter names of all nodes, None for nodes that did not respond in time."""
    # Nodes without parameter services are left out.
    services = {
        name: name.removesuffix(_LIST_SERVICE)
        for name, _ in GraphNames(session, deadline).names("service", hidden=hidden)
        if name.endswith(_LIST_SERVICE)
    }
    proxies = Proxies(session)
    proxies.discover(deadline)
    responses = call_all_with_retries(
        session, ListParameters, services, ListParameters.Request(), deadline
    )
    listed = {
        node: None if responses[name] is None else sorted(responses[name].result.names)
        for name, node in services.items()
    }
    managers = proxies.nodes(PARAMETERS)
    proxies.close()
    own = {
        manager: names and [name for name in names if not name.startswith("/")]
        for manager in managers.values()
        if (names := listed.get(manager)) is not None
    }
    proxied = {node: _of_node(node, listed.get(manager)) for node, manager in managers.items()}
    return listed | own | proxied


def _of_node(node: str, listed: list[str] | None) -> list[str] | None:
    """Return the names of a node's parameters from the list of its manager."""
    if listed is None:
        return None
    prefix = full_parameter_name(node, "")
    return [name.removeprefix(prefix) for name in listed if name.startswith(prefix)]


def _manager(session: Session, deadline: Deadline, node: str) -> str | None:
    """Return the manager with the parameter services of a node, None if the node has its own."""
    proxies = Proxies(session)

    def server() -> str | None:
        names = (name for name, _ in session.graph.services())
        if f"{node}{_LIST_SERVICE}" in names:
            return ""
        proxies.discover(deadline)
        return proxies.nodes(PARAMETERS).get(node)

    found = session.search(server, deadline)
    proxies.close()
    return found or None


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


#: How long to wait for the responses of nodes; the parameters of later ones have no description.
_RESPONSE_S = 2.0
_SERVICE = "describe_parameters"
_TYPE = "rcl_interfaces/srv/DescribeParameters"


def parameter_settings(
    session: Session, deadline: Deadline, names: Mapping[str, Iterable[str]]
) -> dict[str, dict[str, dict[str, Plain]]]:
    """Return the declarations of parameters as in YAML, by node and parameter.

    ``names`` are the parameters of each node. Nodes without the service, or that do not respond,
    are left out.
    """
    known = {name for name, types in session.graph.services() if _TYPE in types}
    requests = {
        f"{node}/{_SERVICE}": (node, list(parameters))
        for node, parameters in names.items()
        if f"{node}/{_SERVICE}" in known
    }
    with closing(ServiceCaller(session)) as caller:
        responses = caller.call_all(
            DescribeParameters,
            {
                service: DescribeParameters.Request(names=listed)
                for service, (_, listed) in requests.items()
            },
            Deadline(min(_RESPONSE_S, deadline.left_s)),
        )
    found: dict[str, dict[str, dict[str, Plain]]] = {}
    for service, (node, listed) in requests.items():
        response = responses[service]
        if response is not None and len(response.descriptors) == len(listed):
            descriptions = map(description, listed, response.descriptors)
            found[node] = {item.name: settings_of(item) for item in descriptions}
    return found


def settings_of(item: ParameterDescription) -> dict[str, Plain]:
    """Return the declaration of a parameter as in YAML, without its value."""
    settings: dict[str, Plain] = {
        "minimum": item.minimum,
        "maximum": item.maximum,
        "step": item.step,
        "read_only": item.read_only or None,
        "description": item.description or None,
    }
    if "unknown" not in item.type and item.type != "not set":
        settings["type"] = item.type
    return {key: value for key, value in settings.items() if value is not None}

"""Parameters of any node, through its parameter services (rcl_interfaces)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
)
from rclpy.parameter import Parameter, parameter_value_to_python

from composer.diagnostics import suggestion
from composer.remote.graph_names import Names
from composer.remote.proxies import PARAMETERS, Deputies
from composer.remote.requests import Send, ask, ask_each, call_once
from composer.remote.session import Deadline, NoAnswer, RosError, Session
from composer.runtime.ros.manager_protocol import full_parameter_name

_NOT_SET = "not set"
_LIST_SERVICE = "/list_parameters"
_TYPES = {
    ParameterType.PARAMETER_NOT_SET: _NOT_SET,
    ParameterType.PARAMETER_BOOL: "bool",
    ParameterType.PARAMETER_INTEGER: "integer",
    ParameterType.PARAMETER_DOUBLE: "double",
    ParameterType.PARAMETER_STRING: "string",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array",
}


class UnknownParameter(RosError):
    """The node has no such parameter."""


class ParameterRefused(RosError):
    """The node did not take the value."""


@dataclass(frozen=True, slots=True)
class Description:
    """What a node says of a parameter. Bounds are None where there are none."""

    name: str
    type: str
    description: str
    constraints: str
    read_only: bool
    minimum: float | None
    maximum: float | None
    step: float | None


class Parameters:
    """The parameters of one node. Raises NotThere when there is no such node."""

    def __init__(self, session: Session, deadline: Deadline, node: str) -> None:
        self._session = session
        self._deadline = deadline
        self.node = Names(session, deadline).find_node(node)
        manager = _manager(session, deadline, self.node)
        #: Whom to ask, and what its names of the node's parameters begin with.
        self._asked, self._prefix = (
            (manager, full_parameter_name(self.node, "")) if manager else (self.node, "")
        )

    def names(self) -> tuple[str, ...]:
        """Return the names of all parameters, sorted. Raises NoAnswer."""
        request = ListParameters.Request(prefixes=[self.node] if self._prefix else [])
        response = self._response(ask, ListParameters, "list_parameters", request)
        return tuple(sorted(name.removeprefix(self._prefix) for name in response.result.names))

    def values(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters; None for one without. Raises UnknownParameter."""
        wanted = list(names)
        self._check_known(wanted)
        request = GetParameters.Request(names=self._there(wanted))
        response = self._response(ask, GetParameters, "get_parameters", request)
        return {
            name: plain_value(value) for name, value in zip(wanted, response.values, strict=True)
        }

    def describe(self, names: Iterable[str]) -> tuple[Description, ...]:
        """Return what the node says of parameters. Raises UnknownParameter."""
        wanted = list(names)
        self._check_known(wanted)
        request = DescribeParameters.Request(names=self._there(wanted))
        response = self._response(ask, DescribeParameters, "describe_parameters", request)
        return tuple(
            _description(name, found)
            for name, found in zip(wanted, response.descriptors, strict=True)
        )

    def set(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set parameters and return what the node took.

        A whole number becomes a double where the node has one. Raises UnknownParameter,
        ParameterRefused with the node's reason.
        """
        types = {item.name: item.type for item in self.describe(values)}
        wanted = [_message(name, value, types[name]) for name, value in values.items()]
        request = SetParameters.Request(
            parameters=[
                ParameterMessage(name=f"{self._prefix}{item.name}", value=item.value)
                for item in wanted
            ]
        )
        response = self._response(call_once, SetParameters, "set_parameters", request)
        refused = [
            f"{name}: {result.reason or 'no reason given'}"
            for name, result in zip(values, response.results, strict=True)
            if not result.successful
        ]
        if refused:
            raise ParameterRefused(f"{self.node} refused " + "; ".join(refused))
        return {item.name: plain_value(item.value) for item in wanted}

    def load(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set the parameters of a file; what is read-only and has its value already is left alone.

        Like :meth:`set` otherwise. ROS nodes have such parameters, and dump them with the others.
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

    def _check_known(self, names: Iterable[str]) -> None:
        known = self.names()
        for name in names:
            if name not in known:
                raise UnknownParameter(
                    f"{self.node} has no parameter '{name}'", suggestion(name, known)
                )

    def _there(self, names: Iterable[str]) -> list[str]:
        """Return what parameters are called where they are asked for."""
        return [f"{self._prefix}{name}" for name in names]

    def _response(self, send: Send, service: Any, name: str, request: Any) -> Any:
        try:
            return send(self._session, service, f"{self._asked}/{name}", request, self._deadline)
        except NoAnswer as error:
            raise NoAnswer(
                f"{self.node} did not answer within {self._deadline.timeout_s:g} s",
                "its parameter services may be switched off, or its process busy",
            ) from error


def names_by_node(session: Session, deadline: Deadline) -> dict[str, list[str] | None]:
    """Return the names of all nodes' parameters; None for a node that did not answer in time."""
    # A node without parameter services has none to tell of.
    services = {
        name: name.removesuffix(_LIST_SERVICE)
        for name, _ in Names(session, deadline).services()
        if name.endswith(_LIST_SERVICE)
    }
    deputies = Deputies(session)
    deputies.meet(deadline)
    responses = ask_each(session, ListParameters, services, ListParameters.Request(), deadline)
    listed = {
        node: None if responses[name] is None else sorted(responses[name].result.names)
        for name, node in services.items()
    }
    left = deputies.nodes(PARAMETERS)
    deputies.close()
    told = {manager: listed.pop(manager, None) for manager in set(left.values())}
    return listed | {node: _of_node(node, told[manager]) for node, manager in left.items()}


def _of_node(node: str, listed: list[str] | None) -> list[str] | None:
    """Return the parameters of a node among those that its manager lists."""
    if listed is None:
        return None
    owned = full_parameter_name(node, "")
    return [name.removeprefix(owned) for name in listed if name.startswith(owned)]


def _manager(session: Session, deadline: Deadline, node: str) -> str | None:
    """Return the manager that answers for a node; None where the node does itself."""
    deputies = Deputies(session)

    def asked() -> str | None:
        names = (name for name, _ in session.node.get_service_names_and_types())
        if f"{node}{_LIST_SERVICE}" in names:
            return ""
        deputies.meet(deadline)
        return deputies.nodes(PARAMETERS).get(node)

    found = session.search(asked, deadline)
    deputies.close()
    return found or None


def plain_value(value: ParameterValue) -> Any:
    """Return the value as plain data; byte strings become numbers."""
    found = parameter_value_to_python(value)
    if isinstance(found, list):
        return [item[0] if isinstance(item, bytes) else item for item in found]
    return found


def _message(name: str, value: Any, kind: str) -> ParameterMessage:
    """Return the parameter with the type that the node has it in. Raises ParameterRefused."""
    try:
        if kind == _NOT_SET:
            return Parameter(name, value=value).to_parameter_msg()
        wanted = Parameter.Type[kind.upper()]
        return Parameter(name, wanted, _converted(value, kind)).to_parameter_msg()
    except (TypeError, ValueError) as error:
        raise ParameterRefused(f"'{name}' is a {kind}, which {value!r} is not") from error


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


def _description(name: str, found: ParameterDescriptor) -> Description:
    bounds = [*found.floating_point_range, *found.integer_range]
    return Description(
        name=name,
        type=_TYPES[found.type],
        description=found.description,
        constraints=found.additional_constraints,
        read_only=found.read_only,
        minimum=bounds[0].from_value if bounds else None,
        maximum=bounds[0].to_value if bounds else None,
        step=(bounds[0].step or None) if bounds else None,
    )

"""The standard parameter and logger services (rcl_interfaces) of a node.

They respond as rclpy's do, except that a large request does not keep the node's loop from its other
callbacks: it is handled in slices, or refused above the limits of
:mod:`composer.runtime.ros.service_requests`. A value of an unknown type is refused with a reason.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from functools import partial
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    LoggerLevel,
    ParameterDescriptor,
    ParameterValue,
    SetLoggerLevelsResult,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import (
    DescribeParameters,
    GetLoggerLevels,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetLoggerLevels,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from rclpy.logging import get_logger_level, set_logger_level
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameters

from composer.runtime.clock import Clock
from composer.runtime.executors.tracebacks import text_of
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.protocol.requests import ParameterDescription
from composer.runtime.ros.conversions import description
from composer.runtime.ros.service_requests import MAX_ITEMS, TooLarge, limited

T = TypeVar("T")

#: The services by name.
PARAMETER_SERVICES: Mapping[str, Any] = {
    "list_parameters": ListParameters,
    "get_parameters": GetParameters,
    "get_parameter_types": GetParameterTypes,
    "describe_parameters": DescribeParameters,
    "set_parameters": SetParameters,
    "set_parameters_atomically": SetParametersAtomically,
}
#: Other callbacks of the loop run after this time.
_SLICE_S = 1e-3
_TYPES = frozenset(kind.value for kind in Parameter.Type)


class UnknownParameterError(Exception):
    """There is no such parameter, or it has no value: the response is empty, as rclpy's."""


class ParameterServices:
    """Answers requests to the six services of one node; see :meth:`provide` for the services."""

    def __init__(self, node: Node, clock: Clock, warn: Callable[[str], None]) -> None:
        """``warn`` logs requests that are refused."""
        self._in_slices = partial(in_slices, clock)
        self._node = node
        self._warn = warn
        self._repeats = RepeatLimit(clock)

    def provide(self) -> None:
        """Create the services. Call it before the node is added to its loop."""
        for name, kind in PARAMETER_SERVICES.items():
            self._node.create_service(
                limited(kind),
                f"~/{name}",
                partial(self.answer, name),
                qos_profile=qos_profile_parameters,
            )

    async def answer(self, name: str, request: Any, response: Any) -> Any:
        """Fill and return the response of a service to a request, on the node's loop."""
        if isinstance(request, TooLarge):
            self._refuse(name, request.reason, response)
            return response
        match name:
            case "list_parameters":
                prefixes = list(dict.fromkeys(request.prefixes))
                response.result = self._node.list_parameters(prefixes, request.depth)
            case "get_parameters":
                await self._get(request, response)
            case "get_parameter_types":
                types = [kind async for kind in self._in_slices(request.names, self._type)]
                response.types = types if len(types) == len(request.names) else []
            case "describe_parameters":
                found = [item async for item in self._in_slices(request.names, self._descriptor)]
                response.descriptors = found if len(found) == len(request.names) else []
            case "set_parameters":
                changes = [[change] for change in request.parameters]
                response.results = [item async for item in self._in_slices(changes, self._set)]
            case _:
                response.result = self._set(request.parameters)
        return response

    async def described(self) -> list[tuple[ParameterDescription, ParameterValue]]:
        """Return the descriptions and values of all parameters, on the node's loop."""
        names = self._node.list_parameters([], 0).names
        return [item async for item in self._in_slices(names, self._described)]

    def _refuse(self, service: str, reason: str, response: Any) -> None:
        """Log the refusal, and add it to the response if its type has a reason."""
        self._repeats.warn(self._warn, service, f"refused a request of '{service}': {reason}")
        if isinstance(response, SetParameters.Response):
            response.results = [_refusal(reason)]
        elif isinstance(response, SetParametersAtomically.Response):
            response.result = _refusal(reason)

    async def _get(self, request: Any, response: Any) -> None:
        values: list[ParameterValue] = []
        items = 0
        async for value in self._in_slices(request.names, self._value):
            items += count_items(value)
            if items > MAX_ITEMS:
                reason = f"more than {MAX_ITEMS} array items and characters in one response"
                self._refuse("get_parameters", reason, response)
                return
            values.append(value)
        response.values = values if len(values) == len(request.names) else []

    def _value(self, name: str) -> ParameterValue:
        try:
            return self._node.get_parameter(name).get_parameter_value()
        except (ParameterNotDeclaredException, ParameterUninitializedException) as error:
            raise UnknownParameterError(name) from error

    def _type(self, name: str) -> int:
        try:
            kind: Any = self._node.get_parameter_type(name)  # its type hint is wrong
        except ParameterNotDeclaredException as error:
            raise UnknownParameterError(name) from error
        return int(kind)

    def _descriptor(self, name: str) -> ParameterDescriptor:
        try:
            return self._node.describe_parameter(name)
        except ParameterNotDeclaredException as error:
            raise UnknownParameterError(name) from error

    def _described(self, name: str) -> tuple[ParameterDescription, ParameterValue]:
        try:
            value = self._value(name)
        except UnknownParameterError:  # it is declared, and has no value
            value = ParameterValue()
        return description(name, self._descriptor(name)), value

    def _set(self, changes: Iterable[ParameterMessage]) -> SetParametersResult:
        """Set all parameters or none. Raises nothing."""
        try:
            return self._node.set_parameters_atomically([_parameter(item) for item in changes])
        except ParameterNotDeclaredException as error:
            return _refusal(str(error))
        except Exception as error:  # such as a value that rclpy cannot compare
            return _refusal(text_of(error))


async def in_slices(clock: Clock, items: Iterable[Any], call: Callable[[Any], T]) -> Any:
    """Yield the result of ``call`` for each item, up to the first unknown parameter.

    Other callbacks of the loop run in between.
    """
    until_s = clock.monotonic() + _SLICE_S
    for item in items:
        try:
            result = call(item)
        except UnknownParameterError:
            return
        yield result
        if clock.monotonic() > until_s:
            await _NextTurn()
            until_s = clock.monotonic() + _SLICE_S


class _NextTurn:
    """Lets the other callbacks of the loop run."""

    def __await__(self) -> Generator[None, None, None]:
        yield


def count_items(value: ParameterValue) -> int:
    """Return the number of array items and characters of a value."""
    return len(value.string_value) + sum(
        map(
            len,
            (
                value.byte_array_value,
                value.bool_array_value,
                value.integer_array_value,
                value.double_array_value,
                value.string_array_value,
            ),
        )
    )


def _parameter(message: ParameterMessage) -> Parameter:
    """Return the parameter. Raises ValueError for an unknown type."""
    kind = message.value.type
    if kind not in _TYPES:
        raise ValueError(f"parameter '{message.name:.80}' has the unknown type {kind}")
    parameter: Parameter = Parameter.from_parameter_msg(message)
    return parameter


def _refusal(reason: str) -> SetParametersResult:
    return SetParametersResult(successful=False, reason=reason)


def provide_logger_services(node: Node, clock: Clock, warn: Callable[[str], None]) -> None:
    """Create the two services of one node. Call it before the node is added to its loop.

    ``warn`` logs requests that are refused.
    """
    repeats = RepeatLimit(clock)

    def add(kind: Any, name: str, answer: Callable[[Any, Any], None]) -> None:
        def respond(request: Any, response: Any) -> Any:
            if isinstance(request, TooLarge):
                repeats.warn(warn, name, f"refused a request of '{name}': {request.reason}")
            else:
                answer(request, response)
            return response

        node.create_service(limited(kind), f"~/{name}", respond)

    add(GetLoggerLevels, "get_logger_levels", _get)
    add(SetLoggerLevels, "set_logger_levels", _set)


def _get(request: Any, response: Any) -> None:
    response.levels = [
        LoggerLevel(name=name, level=int(get_logger_level(name))) for name in request.names
    ]


def _set(request: Any, response: Any) -> None:
    response.results = [_result(item) for item in request.levels]


def _result(item: Any) -> SetLoggerLevelsResult:
    try:
        set_logger_level(item.name, item.level, detailed_error=True)
    except (ValueError, RuntimeError) as error:
        return SetLoggerLevelsResult(successful=False, reason=str(error))
    return SetLoggerLevelsResult(successful=True)

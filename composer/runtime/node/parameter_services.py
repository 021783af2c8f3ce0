"""The standard parameter services (rcl_interfaces) of a node.

They respond as rclpy's do, except that a large request does not keep the node's loop from its other
callbacks: it is handled in slices, or refused above the limits of
:mod:`composer.runtime.ros.limited_requests`. A value of an unknown type is refused with a reason.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator, Iterable
from functools import partial
from typing import Any, Protocol, TypeVar

from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameters

from composer.runtime.clock.clock import Clock
from composer.runtime.executors.exceptions import text_of
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.ros.limited_requests import MAX_ITEMS, TooLarge, limited

T = TypeVar("T")

#: Other callbacks of the loop run after this time.
_SLICE_S = 1e-3


class UnknownParameterError(Exception):
    """There is no such parameter, or it has no value: the response is empty, as rclpy's."""


class ParameterStore(Protocol):
    """Parameters by name. Methods raise UnknownParameterError."""

    async def list_names(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """Return the names that begin with one of ``prefixes``, as rclpy's ``list_parameters``."""

    async def value(self, name: str) -> ParameterValue:
        """Return the value of a parameter."""

    async def type_of(self, name: str) -> int:
        """Return the type of a parameter, a constant of ParameterType."""

    async def descriptor(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter."""

    async def set(self, changes: list[ParameterMessage]) -> SetParametersResult:
        """Set all parameters or none. Raises nothing."""


class NodeParameterStore:
    """The parameters of a node."""

    def __init__(self, node: Node) -> None:
        self._node = node

    async def list_names(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """Return the names that begin with one of ``prefixes``."""
        return self._node.list_parameters(list(dict.fromkeys(prefixes)), depth)

    async def value(self, name: str) -> ParameterValue:
        """Return the value of a parameter."""
        return value_of(self._node, name)

    async def type_of(self, name: str) -> int:
        """Return the type of a parameter."""
        try:
            kind: Any = self._node.get_parameter_type(name)  # its type hint is wrong
        except ParameterNotDeclaredException as error:
            raise UnknownParameterError(name) from error
        return int(kind)

    async def descriptor(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter."""
        return descriptor_of(self._node, name)

    async def set(self, changes: list[ParameterMessage]) -> SetParametersResult:
        """Set all parameters or none."""
        return set_parameters(self._node, changes)


def value_of(node: Node, name: str) -> ParameterValue:
    """Return the value of a node's parameter. Raises UnknownParameterError."""
    try:
        return node.get_parameter(name).get_parameter_value()
    except (ParameterNotDeclaredException, ParameterUninitializedException) as error:
        raise UnknownParameterError(name) from error


def descriptor_of(node: Node, name: str) -> ParameterDescriptor:
    """Return the descriptor of a node's parameter. Raises UnknownParameterError."""
    try:
        return node.describe_parameter(name)
    except ParameterNotDeclaredException as error:
        raise UnknownParameterError(name) from error


def set_parameters(node: Node, changes: Iterable[ParameterMessage]) -> SetParametersResult:
    """Set all parameters of a node or none. Raises nothing."""
    try:
        return node.set_parameters_atomically([_parameter(change) for change in changes])
    except ParameterNotDeclaredException as error:
        return _refusal(str(error))
    except Exception as error:  # such as a value that rclpy cannot compare
        return _refusal(text_of(error))


class ParameterServices:
    """The six services of one node. Create it before the node is added to its loop."""

    def __init__(
        self, node: Node, clock: Clock, store: ParameterStore, warn: Callable[[str], None]
    ) -> None:
        """``warn`` logs requests that are refused."""
        self._in_slices = partial(in_slices, clock)
        self._node = node
        self._store = store
        self._warn = warn
        self._repeats = RepeatLimit(clock)
        self._add(ListParameters, "list_parameters", self._list)
        self._add(GetParameters, "get_parameters", self._get)
        self._add(GetParameterTypes, "get_parameter_types", self._get_types)
        self._add(DescribeParameters, "describe_parameters", self._describe)
        self._add(SetParameters, "set_parameters", self._set)
        self._add(SetParametersAtomically, "set_parameters_atomically", self._set_atomically)

    def _add(
        self, kind: Any, name: str, answer: Callable[[Any, Any], Coroutine[Any, Any, None]]
    ) -> None:
        async def respond(request: Any, response: Any) -> Any:
            if isinstance(request, TooLarge):
                self._refuse(name, request.reason, response)
            else:
                await answer(request, response)
            return response

        self._node.create_service(
            limited(kind), f"~/{name}", respond, qos_profile=qos_profile_parameters
        )

    def _refuse(self, service: str, reason: str, response: Any) -> None:
        """Log the refusal, and add it to the response if its type has a reason."""
        admission = self._repeats.admit(service)
        if admission is not None:
            self._warn(f"refused a request of '{service}': {reason}{admission.suffix}")
        if isinstance(response, SetParameters.Response):
            response.results = [_refusal(reason)]
        elif isinstance(response, SetParametersAtomically.Response):
            response.result = _refusal(reason)

    async def _list(self, request: Any, response: Any) -> None:
        response.result = await self._store.list_names(request.prefixes, request.depth)

    async def _get(self, request: Any, response: Any) -> None:
        values: list[ParameterValue] = []
        items = 0
        async for value in self._in_slices(request.names, self._store.value):
            items += count_items(value)
            if items > MAX_ITEMS:
                reason = f"more than {MAX_ITEMS} array items and characters in one response"
                self._refuse("get_parameters", reason, response)
                return
            values.append(value)
        response.values = values if len(values) == len(request.names) else []

    async def _get_types(self, request: Any, response: Any) -> None:
        types = [kind async for kind in self._in_slices(request.names, self._store.type_of)]
        response.types = types if len(types) == len(request.names) else []

    async def _describe(self, request: Any, response: Any) -> None:
        found = [item async for item in self._in_slices(request.names, self._store.descriptor)]
        response.descriptors = found if len(found) == len(request.names) else []

    async def _set(self, request: Any, response: Any) -> None:
        async def set_one(change: ParameterMessage) -> SetParametersResult:
            return await self._store.set([change])

        response.results = [item async for item in self._in_slices(request.parameters, set_one)]

    async def _set_atomically(self, request: Any, response: Any) -> None:
        response.result = await self._store.set(request.parameters)


async def in_slices(
    clock: Clock, items: Iterable[Any], call: Callable[[Any], Coroutine[Any, Any, T]]
) -> Any:
    """Yield the result of ``call`` for each item, up to the first unknown parameter.

    Other callbacks of the loop run in between.
    """
    until_s = clock.monotonic() + _SLICE_S
    for item in items:
        try:
            result = await call(item)
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


_TYPES = frozenset(kind.value for kind in Parameter.Type)

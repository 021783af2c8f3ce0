"""Requests to services: limited before they become Python objects, and documents as requests.

rclpy converts a whole request while it holds the interpreter's lock: 50 000 parameters take two
seconds, in which no node of the process runs. Here the size of the request is read from the C
message that the middleware has filled, which takes a hundredth of that, and a request that is too
large is not converted.

rclpy finds the conversion in an attribute of the metaclass of the request; the types here have
another one. This is rosidl_generator_py's interface, and the layout of its C structures.

A document of the protocol is a text, and so is the answer. Of the service types in every ROS
installation, SetParametersAtomically is the one that takes any text and returns another, with a
reason if there is none; a type of our own would have to be compiled by every user. Its only
parameter is ``request``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache, partial
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
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
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.type_support import check_is_valid_srv_type
from type_description_interfaces.srv import GetTypeDescription

from composer.base.fast_dataclass import dataclass
from composer.runtime.protocol.codec import ProtocolError, decode, encode

#: Names in one request; a response with so many values takes a few milliseconds.
MAX_NAMES = 10_000
#: Parameters to set, or prefixes to list, in one request.
MAX_PARAMETERS = 1000
#: Array items and characters of all values in one request or response.
MAX_ITEMS = 1_000_000
#: Characters of a label of a transition, or of the name of a type: names are shorter.
MAX_CHARACTERS = 1000
#: Carries documents of the protocol.
RequestService = SetParametersAtomically
#: Transient local: a late joiner gets the last message at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_QOS = QoSProfile(depth=10)
_PARAMETER = "request"


@dataclass(frozen=True, slots=True)
class TooLarge:
    """What is taken instead of a request that is too large."""

    reason: str


class _Sequence(ctypes.Structure):
    """A string or a sequence of any type (rosidl_runtime_c)."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    ]


class _Parameter(ctypes.Structure):
    """rcl_interfaces/msg/Parameter with its value."""

    _fields_ = [
        ("name", _Sequence),
        ("type", ctypes.c_uint8),
        ("bool_value", ctypes.c_bool),
        ("integer_value", ctypes.c_int64),
        ("double_value", ctypes.c_double),
        ("sequences", _Sequence * 6),  # a string, and an array of each of five types
    ]


class _Transition(ctypes.Structure):
    """lifecycle_msgs/msg/Transition."""

    _fields_ = [("id", ctypes.c_uint8), ("label", _Sequence)]


#: Returns why the request at an address is too large, or None.
_Check = Callable[[int], str | None]
_Convert = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)

_NEW_CAPSULE = ctypes.pythonapi.PyCapsule_New
_NEW_CAPSULE.restype = ctypes.py_object
_NEW_CAPSULE.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
_POINTER_OF = ctypes.pythonapi.PyCapsule_GetPointer
_POINTER_OF.restype = ctypes.c_void_p
_POINTER_OF.argtypes = [ctypes.py_object, ctypes.c_char_p]
#: The functions that rclpy calls; they must not be deallocated.
_functions: list[Any] = []


@cache
def limited(service: Any) -> Any:
    """Return ``service``, one of those below, with limited requests.

    A node that creates a server with the returned type takes a :class:`TooLarge` instead of a
    request that is too large.
    """
    check = _CHECKS[service]
    check_is_valid_srv_type(service)  # loads the type support
    request = service.Request
    metaclass: Any = type(request)
    convert = _Convert(_POINTER_OF(metaclass._CONVERT_TO_PY, None))

    def convert_limited(address: int) -> Any:
        reason = check(address)
        return convert(address) if reason is None else TooLarge(reason)

    function = _Convert(convert_limited)
    _functions.append(function)
    capsule = _NEW_CAPSULE(ctypes.cast(function, ctypes.c_void_p), None, None)
    limited_metaclass = type(metaclass.__name__, (metaclass,), {"_CONVERT_TO_PY": capsule})
    limited_request = limited_metaclass(request.__name__, (request,), {"__slots__": ()})
    return type(service)(service.__name__, (service,), {"Request": limited_request})


def _check_names(address: int) -> str | None:
    return excess_of(_Sequence.from_address(address).size, MAX_NAMES, "names")


def _check_prefixes(address: int) -> str | None:
    return excess_of(_Sequence.from_address(address).size, MAX_PARAMETERS, "prefixes")


def _check_parameters(address: int) -> str | None:
    sequence = _Sequence.from_address(address)
    reason = excess_of(sequence.size, MAX_PARAMETERS, "parameters")
    if reason is not None or not sequence.size:
        return reason
    parameters = (_Parameter * sequence.size).from_address(sequence.data)
    items = sum(part.size for parameter in parameters for part in parameter.sequences)
    return excess_of(items, MAX_ITEMS, "array items and characters")


def _check_transition(address: int) -> str | None:
    return excess_of(_Transition.from_address(address).label.size, MAX_CHARACTERS, "characters")


def _check_type(address: int) -> str | None:
    name_and_hash = (_Sequence * 2).from_address(address)
    return excess_of(sum(text.size for text in name_and_hash), MAX_CHARACTERS, "characters")


def excess_of(number: int, limit: int, what: str) -> str | None:
    """Return the reason to refuse a request with more than ``limit``, or None."""
    return f"{number} {what} in one request, at most {limit}" if number > limit else None


_CHECKS: dict[Any, _Check] = {
    GetParameters: _check_names,
    GetParameterTypes: _check_names,
    DescribeParameters: _check_names,
    GetLoggerLevels: _check_names,
    SetLoggerLevels: _check_names,
    ListParameters: _check_prefixes,
    SetParameters: _check_parameters,
    SetParametersAtomically: _check_parameters,
    ChangeState: _check_transition,
    GetTypeDescription: _check_type,
}


def limit_type_descriptions(node: Node) -> None:
    """Refuse requests with long texts, which rcl would print. Call it before the node is served."""
    for service in node.services:
        if service.srv_type is GetTypeDescription:
            service.srv_type = limited(GetTypeDescription)
            service.callback = partial(_respond, service.callback)


def _respond(callback: Any, request: Any, response: Any) -> Any:
    if not isinstance(request, TooLarge):
        return callback(request, response)
    response.successful = False
    response.failure_reason = request.reason
    return response


def request_message(request: Any) -> SetParametersAtomically.Request:
    """Return the message with a request of :mod:`composer.runtime.protocol.requests`."""
    kind = ParameterType.PARAMETER_STRING
    value = ParameterValue(type=kind, string_value=encode(request))
    return RequestService.Request(parameters=[Parameter(name=_PARAMETER, value=value)])


def read_request(message: Any, *kinds: type[Any]) -> Any:
    """Return the request of one of the types ``kinds`` in a message. Raises ProtocolError."""
    if isinstance(message, TooLarge):
        raise ProtocolError(message.reason)
    texts = [item.value.string_value for item in message.parameters if item.name == _PARAMETER]
    if len(texts) != 1:
        raise ProtocolError(f"expected one parameter '{_PARAMETER}' with a document as its value")
    return decode(texts[0], *kinds, limit=MAX_ITEMS)


def answer_message(answer: Any) -> SetParametersAtomically.Response:
    """Return the message with an answer; with the reason for a ProtocolError."""
    is_error = isinstance(answer, ProtocolError)
    reason = str(answer) if is_error else encode(answer)
    return RequestService.Response(
        result=SetParametersResult(successful=not is_error, reason=reason)
    )


def read_answer(message: SetParametersAtomically.Response, request: Any) -> Any:
    """Return the answer to a request in a message. Raises ProtocolError."""
    if not message.result.successful:
        raise ProtocolError(message.result.reason)
    return decode(message.result.reason, request.Answer)

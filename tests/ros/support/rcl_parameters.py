"""rcl's own reader of parameter files, called through its C interface."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from ctypes import (
    POINTER,
    Structure,
    c_bool,
    c_char,
    c_char_p,
    c_double,
    c_int64,
    c_size_t,
    c_void_p,
)
from pathlib import Path
from typing import Any

Values = dict[str, dict[str, Any]]


class RclError(Exception):
    """rcl refuses the file; the text is its reason."""


class _Allocator(Structure):
    _fields_ = [(name, c_void_p) for name in ("a", "deallocate", "r", "z", "state")]


def _array_of(kind: Any) -> Any:
    """Return the structure of an array of a primitive type."""
    fields = [("values", POINTER(kind)), ("size", c_size_t)]
    return type("_Array", (Structure,), {"_fields_": fields})


_Bools, _Integers, _Doubles = map(_array_of, (c_bool, c_int64, c_double))


class _Strings(Structure):
    _fields_ = [("size", c_size_t), ("values", POINTER(c_char_p)), ("allocator", _Allocator)]


class _Value(Structure):
    """One of the pointers is set; for an empty list, none."""

    _fields_ = [
        ("bool", POINTER(c_bool)),
        ("integer", POINTER(c_int64)),
        ("double", POINTER(c_double)),
        ("string", c_char_p),
        ("bytes", c_void_p),
        ("bools", POINTER(_Bools)),
        ("integers", POINTER(_Integers)),
        ("doubles", POINTER(_Doubles)),
        ("strings", POINTER(_Strings)),
    ]


class _Node(Structure):
    _fields_ = [
        ("names", POINTER(c_char_p)),
        ("values", POINTER(_Value)),
        ("count", c_size_t),
        ("capacity", c_size_t),
    ]


class _Nodes(Structure):
    _fields_ = [
        ("names", POINTER(c_char_p)),
        ("nodes", POINTER(_Node)),
        ("count", c_size_t),
        ("capacity", c_size_t),
        ("allocator", _Allocator),
    ]


class _ErrorString(Structure):
    _fields_ = [("text", c_char * 1024)]


def read(path: Path) -> Values:
    """Return the parameters in a file by node, as rcl reads them. Raises RclError.

    Node names begin with a slash. Where rcl keeps several values of different types for one
    parameter, the first one counts, as in rclpy and rclcpp.
    """
    rcutils = ctypes.CDLL("librcutils.so")
    rcutils.rcutils_get_default_allocator.restype = _Allocator
    rcutils.rcutils_get_error_string.restype = _ErrorString
    parser = ctypes.CDLL("librcl_yaml_param_parser.so")
    parser.rcl_yaml_node_struct_init.restype = POINTER(_Nodes)
    parser.rcl_yaml_node_struct_init.argtypes = [_Allocator]
    parser.rcl_parse_yaml_file.restype = c_bool
    parser.rcl_parse_yaml_file.argtypes = [c_char_p, POINTER(_Nodes)]
    parser.rcl_yaml_node_struct_fini.argtypes = [POINTER(_Nodes)]
    rcutils.rcutils_reset_error()
    nodes = parser.rcl_yaml_node_struct_init(rcutils.rcutils_get_default_allocator())
    if not parser.rcl_parse_yaml_file(bytes(path), nodes):
        # The structure of a failed run may be inconsistent: it is not freed, as rcl advises.
        text = rcutils.rcutils_get_error_string().text.decode()
        rcutils.rcutils_reset_error()
        raise RclError(text)
    try:
        return _values(nodes[0])
    finally:
        parser.rcl_yaml_node_struct_fini(nodes)


def _values(nodes: _Nodes) -> Values:
    found: Values = {}
    for number in range(nodes.count):
        name = "/" + nodes.names[number].decode().removeprefix("/")
        found.setdefault(name, {}).update(_parameters(nodes.nodes[number]))
    return found


def _parameters(node: _Node) -> Iterator[tuple[str, Any]]:
    for number in range(node.count):
        yield node.names[number].decode(), _value(node.values[number])


def _value(value: _Value) -> Any:
    for pointer in (value.bool, value.integer, value.double):
        if pointer:
            return pointer[0]
    if value.string is not None:
        return value.string.decode()
    for array in (value.bools, value.integers, value.doubles):
        if array:
            return array[0].values[: array[0].size]
    if value.strings:
        return [text.decode() for text in value.strings[0].values[: value.strings[0].size]]
    return []

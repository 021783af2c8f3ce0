"""Messages as plain data, and YAML text as messages."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from composer.diagnostics import suggestion
from composer.document import parse_document
from composer.expressions import EvaluationError
from composer.interfaces import Interfaces
from composer.interfaces.similar import similar_interface
from composer.remote.session import RosError
from composer.runtime.ros.messages import MessageError, compile_message, interface_class
from composer.source import SourceFile
from composer.templates import compile_template


class _Kind(NamedTuple):
    """Where the types of a kind are, and what only their classes have."""

    folder: str
    part: str


_KINDS = {
    "message": _Kind("msg", "get_fields_and_field_types"),
    "service": _Kind("srv", "Request"),
    "action": _Kind("action", "Goal"),
}
_SLASHES = 2
_WHAT_A_TYPE_IS = "it has three parts, as std_msgs/msg/String"

#: Makes a message; expressions in it see the names of the scope.
Build = Callable[[Mapping[str, Any]], Any]


class BadValue(RosError):
    """What was given does not make a message of the type, or names no part of it."""


def class_of(name: str, kind: str = "message") -> Any:
    """Return the class of an interface.

    Raises BadValue when it is not installed here, or of another kind.
    """
    if name.count("/") != _SLASHES:
        raise BadValue(f"there is no type '{name}'", _similar(name, kind) or _WHAT_A_TYPE_IS)
    try:
        found = interface_class(name)
    except MessageError as error:
        hint = _similar(name, kind) or "the package that defines it must be installed here"
        raise BadValue(str(error), hint) from error
    if not hasattr(found, _KINDS[kind].part):
        raise BadValue(f"'{name}' is no {kind} type")
    return found


def _similar(name: str, kind: str) -> str | None:
    interfaces = Interfaces.load()
    if interfaces.find(name) is not None:
        return None
    return similar_interface(name, interfaces.names(_KINDS[kind].folder))


def compile_content(text: str, message_type: Any, what: str) -> Build:
    """Return what makes messages of YAML ``text``; fields left out keep their defaults.

    ``{expressions}`` are evaluated each time. Raises BadValue, now and from the result.
    """
    tree, findings = parse_document(SourceFile(what, text.strip() or "{}"))
    if tree is None or findings:
        reasons = "; ".join(finding.message for finding in findings)
        raise BadValue(f"{what} is not a YAML map: {reasons}", "write it as '{data: hello}'")
    template, problems = compile_template(tree)
    if template is None or problems:
        raise BadValue(f"{what}: " + "; ".join(problem.message for problem in problems))
    try:
        build = compile_message(template, message_type, what)
    except MessageError as error:
        raise BadValue(str(error), error.hint) from error

    def build_checked(scope: Mapping[str, Any]) -> Any:
        try:
            return build(scope)
        except (MessageError, EvaluationError) as error:
            raise BadValue(f"{what}: {error}", getattr(error, "hint", None)) from error

    return build_checked


def to_plain(value: Any) -> Any:
    """Return a message, or a part of one, as dicts, lists and scalars."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: to_plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, array) or hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    return value


def part(value: Any, path: str) -> Any:
    """Return the part of a message that ``path`` names: ``pose.position.x``, ``ranges.3``.

    Raises BadValue.
    """
    for name in path.split("."):
        value = _step(value, name, path)
    return value


def age_s(message: Any, came_at_s: float) -> float:
    """Return how many seconds lay between a message's ``header.stamp`` and its coming.

    ``came_at_s`` is by time.monotonic. Raises BadValue for a message without a header.
    """
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        raise BadValue(
            f"{type(message).__name__} has no header.stamp, so its age is not known",
            "compose topic hz tells how often it comes",
        )
    now_s = time.time() - (time.monotonic() - came_at_s)
    return float(now_s - (stamp.sec + stamp.nanosec * 1e-9))


def _step(value: Any, name: str, path: str) -> Any:
    if hasattr(value, "get_fields_and_field_types"):
        fields = value.get_fields_and_field_types()
        if name in fields:
            return getattr(value, name)
        raise BadValue(f"there is no field '{name}' in '{path}'", suggestion(name, fields))
    if name.isdigit() and hasattr(value, "__getitem__") and not isinstance(value, str):
        try:
            return value[int(name)]
        except IndexError as error:
            raise BadValue(f"'{path}': there are {len(value)} items only") from error
    raise BadValue(f"'{name}' in '{path}' is not a part of {value!r:.60}")

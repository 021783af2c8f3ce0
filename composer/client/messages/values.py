"""Messages as plain data, and YAML text as messages."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from composer.base.characters import counted
from composer.base.diagnostics import suggestion
from composer.base.source import SourceFile
from composer.client.messages.field_paths import path_steps
from composer.client.session import RosError
from composer.interfaces import Interfaces
from composer.interfaces.index import similar_interface
from composer.language.document import parse_document
from composer.language.document.scalars import resolve_any_number
from composer.language.expressions import EvaluationError
from composer.language.templates import compile_template
from composer.runtime.ros.messages import (
    MessageError,
    compile_message,
    convert_message,
    interface_class,
    to_plain,
)

_SLASHES = 2
_TYPE_HINT = "a type has three parts, such as std_msgs/msg/String"
#: Builds a message; its expressions see the names of the scope.
Build = Callable[[Mapping[str, Any]], Any]


class _Kind(NamedTuple):
    """The folder of an interface kind, and an attribute that only its classes have."""

    folder: str
    part: str


_KINDS = {
    "message": _Kind("msg", "get_fields_and_field_types"),
    "service": _Kind("srv", "Request"),
    "action": _Kind("action", "Goal"),
}


class InvalidValueError(RosError):
    """A value does not fit the message type, or a path does not exist in it."""


def class_of(name: str, kind: str = "message") -> Any:
    """Return the class of an interface.

    Raises InvalidValueError if it is not installed, or of another kind.
    """
    if name.count("/") != _SLASHES:
        raise InvalidValueError(f"there is no type '{name}'", _similar(name, kind) or _TYPE_HINT)
    try:
        found = interface_class(name)
    except MessageError as error:
        hint = _similar(name, kind) or "install the package that defines it"
        raise InvalidValueError(str(error), hint) from error
    if not hasattr(found, _KINDS[kind].part):
        raise InvalidValueError(f"'{name}' is not {'an' if kind == 'action' else 'a'} {kind} type")
    return found


def _similar(name: str, kind: str) -> str | None:
    if Interfaces.load().find(name) is not None:
        return None
    return similar_interface(name, Interfaces.installed().names(_KINDS[kind].folder))


def compile_content(text: str, message_type: Any, what: str) -> Build:
    """Return a function that builds messages from YAML ``text``; other fields keep their defaults.

    ``{expressions}`` are evaluated for each message. This and the returned function raise
    InvalidValueError.
    """
    source = SourceFile(what, text.strip() or "{}")
    tree, diagnostics = parse_document(source, resolve_any_number)
    reasons = "; ".join(item.message for item in diagnostics)
    if tree is None:
        raise InvalidValueError(
            f"{what} is not a YAML map: {reasons}", "write a map, such as '{data: hello}'"
        )
    if diagnostics:
        raise InvalidValueError(f"{what}: {reasons}")
    template, problems = compile_template(tree)
    if template is None or problems:
        raise InvalidValueError(f"{what}: " + "; ".join(problem.message for problem in problems))
    try:
        build = compile_message(template, message_type, what)
    except MessageError as error:
        raise InvalidValueError(str(error), error.hint) from error

    def build_checked(scope: Mapping[str, Any]) -> Any:
        try:
            return build(scope)
        except MessageError as error:
            raise InvalidValueError(str(error), error.hint) from error
        except EvaluationError as error:
            raise InvalidValueError(f"{what}: {error}") from error

    return build_checked


def build_message(content: str | Mapping[str, Any], message_type: Any, what: str) -> Any:
    """Return a message from YAML text, as :func:`compile_content`, or from plain values.

    Raises InvalidValueError.
    """
    if isinstance(content, str):
        return compile_content(content, message_type, what)({})
    try:
        return convert_message(content, message_type, what)
    except MessageError as error:
        raise InvalidValueError(str(error), error.hint) from error


def to_short_plain(value: Any, max_items: int) -> Any:
    """Return the same as :func:`to_plain`, with arrays cut after ``max_items``.

    A cut array ends with a text that says how many items are left out.
    """
    if hasattr(value, "get_fields_and_field_types"):
        names = value.get_fields_and_field_types()
        return {name: to_short_plain(getattr(value, name), max_items) for name in names}
    is_list = isinstance(value, list | tuple | array) or hasattr(value, "tolist")
    if not is_list and not (isinstance(value, bytes) and len(value) > 1):
        return to_plain(value)
    shown = [to_short_plain(item, max_items) for item in _items(value[:max_items])]
    left = len(value) - len(shown)
    return [*shown, f"... {left} more of {len(value)}"] if left else shown


def _items(value: Any) -> list[Any]:
    """Return the items of an array of any kind."""
    return list(value) if isinstance(value, bytes | list | tuple) else value.tolist()


def part(value: Any, path: str) -> Any:
    """Return the part of a message that ``path`` names: ``pose.position.x``, ``ranges[3]``.

    Raises InvalidValueError.
    """
    for step in path_steps(path):
        value = _step(value, step, path)
    return value


def _step(value: Any, step: str | int, path: str) -> Any:
    if isinstance(step, str) and hasattr(value, "get_fields_and_field_types"):
        fields = value.get_fields_and_field_types()
        if step in fields:
            return getattr(value, step)
        raise InvalidValueError(f"'{path}': there is no field '{step}'", suggestion(step, fields))
    if isinstance(step, int) and hasattr(value, "__getitem__") and not isinstance(value, str):
        try:
            return value[step]
        except IndexError as error:
            items = counted(len(value), "item")
            raise InvalidValueError(f"'{path}': index {step} of {items}") from error
    raise InvalidValueError(f"'{path}': {value!r:.60} has no part '{step}'")

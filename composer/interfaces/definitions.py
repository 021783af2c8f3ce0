"""Interface definitions: messages, services, actions and the types of their fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.language.tree import Plain

#: The primitive types of the ROS 2 interface definition language, and the range of the integers.
#: ``char`` is a uint8 in ROS 2 and is converted to it; ``byte`` is a separate type.
INTEGER_RANGES: Mapping[str, tuple[int, int]] = {
    "byte": (0, 255),
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}
FLOATS = frozenset(("float32", "float64"))
TEXTS = frozenset(("string", "wstring"))
PRIMITIVES = frozenset(INTEGER_RANGES) | FLOATS | TEXTS | {"bool"}


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field. ``name`` is a primitive or a message (``geometry_msgs/msg/Point``).

    An array has ``array_size`` elements when that is given, at most ``array_bound`` when that is,
    and any number otherwise. ``string_bound`` is the greatest length of a text.
    """

    name: str
    is_array: bool = False
    array_size: int | None = None
    array_bound: int | None = None
    string_bound: int | None = None

    @property
    def is_primitive(self) -> bool:
        """Whether the type, or the type of the elements, is not a message."""
        return self.name in PRIMITIVES

    @property
    def element(self) -> FieldType:
        """The type of one element of an array."""
        return FieldType(self.name, string_bound=self.string_bound)

    def __str__(self) -> str:
        text = self.name + (f"<={self.string_bound}" if self.string_bound is not None else "")
        if not self.is_array:
            return text
        if self.array_size is not None:
            return f"{text}[{self.array_size}]"
        return f"{text}[<={self.array_bound}]" if self.array_bound is not None else f"{text}[]"


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message. ``default`` is None without a default."""

    name: str
    type: FieldType
    default: Plain = None


@dataclass(frozen=True, slots=True)
class MessageConstant:
    """A named value in a message definition."""

    name: str
    type: FieldType
    value: Plain


@dataclass(frozen=True)
class Message:
    """A message, or the part of a service or an action: ``std_srvs/srv/Empty_Request``."""

    name: str
    fields: tuple[Field, ...] = ()
    constants: tuple[MessageConstant, ...] = ()

    @cached_property
    def _by_name(self) -> Mapping[str, Field]:
        return {item.name: item for item in self.fields}

    def field(self, name: str) -> Field | None:
        """Return the field ``name``, or None."""
        return self._by_name.get(name)

    @property
    def field_names(self) -> tuple[str, ...]:
        """The names of the fields, in the order of the definition."""
        return tuple(self._by_name)


@dataclass(frozen=True, slots=True)
class Service:
    """A service: its request and its response."""

    name: str
    request: Message
    response: Message


@dataclass(frozen=True, slots=True)
class Action:
    """An action: its goal, result and feedback."""

    name: str
    goal: Message
    result: Message
    feedback: Message


Interface: TypeAlias = "Message | Service | Action"


#: The suffixes of the names of an interface's messages, by the folder of its definition.
PARTS: Mapping[str, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}


def interface_of(name: str, part: Callable[[str], Message]) -> Interface:
    """Return the interface ``name``; ``part`` returns the message with a suffix of PARTS."""
    folder = name.split("/")[1]
    messages = [part(suffix) for suffix in PARTS[folder]]
    if folder == "srv":
        return Service(name, *messages)
    return Action(name, *messages) if folder == "action" else messages[0]


def parts(interface: Interface) -> dict[str, Message]:
    """Return the messages of an interface, by ``request``, ``response``, ``goal`` and so on."""
    match interface:
        case Service():
            return {"request": interface.request, "response": interface.response}
        case Action():
            return {
                "goal": interface.goal,
                "result": interface.result,
                "feedback": interface.feedback,
            }
        case _:
            return {"message": interface}

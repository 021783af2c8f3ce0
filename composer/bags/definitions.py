"""The definitions of messages in bags: texts that include the nested messages."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.interfaces import Action, Field, FieldType, Interfaces, Message, Service, parts
from composer.interfaces.index import definition_text

_SEPARATOR = "=" * 80
_GOAL_ID = Field("goal_id", FieldType("unique_identifier_msgs/msg/UUID"))
#: What rosidl adds to a message without fields.
_PLACEHOLDER = Field("structure_needs_at_least_one_member", FieldType("uint8"))


def full_definition(type_name: str, interfaces: Interfaces) -> str:
    """Return the definition of a message as MCAP's ``ros2msg``; empty if it is not known.

    The definitions of the messages in it follow, each after a line of ``=`` and its name. The type
    may be one that rosidl derives from a service or an action, such as
    ``std_srvs/srv/Trigger_Event`` or ``tf2_msgs/action/LookupTransform_FeedbackMessage``.
    """
    return "\n".join(_texts(type_name, interfaces, {type_name}))


def _texts(type_name: str, interfaces: Interfaces, seen: set[str]) -> Iterator[str]:
    message = _message(type_name, interfaces)
    if message is None:
        return
    if "/msg/" in type_name:
        yield definition_text(type_name, interfaces).rstrip("\n")
    else:
        yield _derived_text(message)
    for field in message.fields:
        name = field.type.name
        if not field.type.is_primitive and name not in seen:
            seen.add(name)
            nested = list(_texts(name, interfaces, seen))
            if nested:
                yield f"{_SEPARATOR}\nMSG: {_short(name)}"
                yield from nested


def _short(text: str) -> str:
    """Return a text with names of types as other readers of ``ros2msg`` can use them."""
    return re.sub("/(msg|srv)/", "/", text)


def _derived_text(message: Message) -> str:
    constants = [f"{item.type} {item.name}={item.value}" for item in message.constants]
    fields = message.fields or (_PLACEHOLDER,)
    return "\n".join([*constants, *(_short(f"{item.type} {item.name}") for item in fields)])


def _message(type_name: str, interfaces: Interfaces) -> Message | None:
    """Return a message, also one that rosidl derives from a service or an action."""
    folder, _, name = type_name.rpartition("/")
    owner_name, _, part = name.partition("_")
    owner = interfaces.find(f"{folder}/{owner_name}")
    if isinstance(owner, Message):
        return None if part else owner
    if not isinstance(owner, Service | Action):
        return None
    declared = {key.capitalize(): item for key, item in parts(owner).items()}
    if part in declared:
        return declared[part]
    fields = _derived_fields(type_name, owner.name, part)
    return Message(type_name, fields) if fields else None


def _derived_fields(type_name: str, owner: str, part: str) -> tuple[Field, ...]:
    if part.endswith("Event"):
        service = type_name.removesuffix("_Event")
        return (
            Field("info", FieldType("service_msgs/msg/ServiceEventInfo")),
            Field("request", FieldType(f"{service}_Request", is_array=True, array_bound=1)),
            Field("response", FieldType(f"{service}_Response", is_array=True, array_bound=1)),
        )
    stamp = FieldType("builtin_interfaces/msg/Time")
    return {
        "SendGoal_Request": (_GOAL_ID, Field("goal", FieldType(f"{owner}_Goal"))),
        "SendGoal_Response": (Field("accepted", FieldType("bool")), Field("stamp", stamp)),
        "GetResult_Request": (_GOAL_ID,),
        "GetResult_Response": (
            Field("status", FieldType("int8")),
            Field("result", FieldType(f"{owner}_Result")),
        ),
        "FeedbackMessage": (_GOAL_ID, Field("feedback", FieldType(f"{owner}_Feedback"))),
    }.get(part, ())

"""Stubs of message, service and action packages.

Fields are properties, as in the classes of ROS. A field accepts more than it returns: a list of
numbers may be assigned where an ``array.array`` is read. A float field refuses ints, as ROS sends
garbage for them (``Float64(data=3)`` arrives as 5e-324). The types that packages share are in
``libraries/_ros.pyi``.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator, Mapping

from composer.interfaces import (
    FLOATS,
    TEXTS,
    Action,
    FieldType,
    Interface,
    Interfaces,
    Message,
    Service,
    parts,
)
from composer.interfaces.sources import FOLDERS

_HEAD = (
    "from typing import Final, TypeAlias",
    "",
    "import _ros",
)


def message_stubs(interfaces: Interfaces, names: Iterable[str] | None = None) -> dict[str, str]:
    """Return the stubs of interfaces and of the messages in them; by default, of all interfaces."""
    if names is None:
        names = (name for folder in FOLDERS for name in interfaces.names(folder))
    pending = list(names)
    definitions: dict[str, Interface] = {}
    while pending:
        name = pending.pop()
        definition = interfaces.find(name) if name not in definitions else None
        if definition is not None:
            definitions[name] = definition
            fields = (item for part in parts(definition).values() for item in part.fields)
            pending += [item.type.name for item in fields if not item.type.is_primitive]
    modules: dict[str, list[str]] = {}
    for name in sorted(definitions):
        package, folder, short = name.split("/")
        modules.setdefault(f"{package}/{folder}.pyi", []).append(_text(short, definitions[name]))
    files = {f"{path.partition('/')[0]}/__init__.pyi": "" for path in modules}
    return files | {path: _module("\n".join(texts)) for path, texts in modules.items()}


def python_name(interface: str) -> str:
    """Return how a stub names an interface: ``geometry_msgs.msg.Point``."""
    return interface.replace("/", ".")


def interface_modules(text: str) -> list[str]:
    """Return the modules of the interfaces that types in a text name: ``geometry_msgs.msg``."""
    return sorted({*re.findall(r"(?<![\w.])([a-z]\w*\.(?:msg|srv|action))\.[A-Z]", text)})


def _module(text: str) -> str:
    """Return the text of ``package/msg.pyi`` or of one like it."""
    imports = (f"import {module}" for module in interface_modules(text))
    return "\n".join((*_HEAD, *imports, "", text, ""))


def _text(name: str, definition: Interface) -> str:
    """Return the stub of one interface."""
    match definition:
        case Service(request=request, response=response):
            named = {"Request": request, "Response": response}
            return "\n".join(_with_parts(name, named, "ServiceType"))
        case Action(goal=goal, result=result, feedback=feedback):
            named = {"Goal": goal, "Result": result, "Feedback": feedback}
            return "\n".join(_with_parts(name, named, "ActionType"))
        case _:
            return "\n".join(_message(name, definition))


def _with_parts(name: str, parts: Mapping[str, Message], base: str) -> Iterator[str]:
    for part, message in parts.items():
        yield from _message(f"{name}_{part}", message)
    classes = ", ".join(f"{name}_{part}" for part in parts)
    yield f"class {name}(_ros.{base}[{classes}]):"
    for part in parts:
        yield f"    {part}: TypeAlias = {name}_{part}"


def _message(name: str, message: Message) -> Iterator[str]:
    yield f"class {name}(_ros.MessageType):"
    for constant in message.constants:
        value = constant.value
        if constant.type.name == "byte" and isinstance(value, int):
            value = bytes([value])  # type: ignore[assignment]
        yield f"    {constant.name}: Final = {value!r}"
    fields = [item for item in message.fields if not keyword.iskeyword(item.name)]
    arguments = "".join(f", {item.name}: {_accepted(item.type)} = ..." for item in fields)
    yield f"    def __init__(self{', *' if arguments else ''}{arguments}) -> None: ..."
    for item in fields:
        yield "    @property"
        yield f"    def {item.name}(self) -> {_given(item.type)}: ..."
        yield f"    @{item.name}.setter"
        yield f"    def {item.name}(self, value: {_accepted(item.type)}) -> None: ..."


def _element(type_: FieldType) -> str:
    if type_.name in TEXTS:
        return "str"
    if type_.name in FLOATS:
        return "float"
    if type_.name in ("bool", "byte"):
        return {"bool": "bool", "byte": "bytes"}[type_.name]
    return "int" if type_.is_primitive else python_name(type_.name)


def _given(type_: FieldType) -> str:
    """Return the type of a field that is read."""
    element = _element(type_)
    if not type_.is_array:
        return element
    if not type_.is_primitive or element in ("str", "bytes", "bool"):
        return f"list[{element}]"
    return f"_ros.{'Array' if type_.array_size is None else 'FixedArray'}[{element}]"


def _accepted(type_: FieldType) -> str:
    """Return the type of a field that is written."""
    element = _element(type_)
    if not type_.is_array:
        return "_ros.Real" if element == "float" else element
    if element == "str":
        return "_ros.Texts"
    if type_.name in ("uint8", "byte"):
        return f"_ros.Values[{element}] | bytes"
    return f"_ros.Values[{element}]"

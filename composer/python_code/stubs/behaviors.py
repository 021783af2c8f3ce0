"""Stubs of node types, and of message, service and action packages.

The stub of a node type is the base class of its behavior, with its ports and handlers.

Fields of messages are properties, as in the classes of ROS. A field accepts more than it returns: a
list of numbers may be assigned where an ``array.array`` is read. A float field refuses ints, as ROS
sends garbage for them (``Float64(data=3)`` arrives as 5e-324). The types that packages share are in
``libraries/_ros.pyi``.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator, Mapping
from keyword import iskeyword

from composer.base.fast_dataclass import dataclass
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
from composer.model import Node, Parameter, Port, PortKind
from composer.python_code.nodes import GENERAL_HANDLERS, Signature, handlers
from composer.typed import SUFFIX

#: The types of parameters in Python.
PARAMETER_TYPES: Mapping[str, str] = {
    "bool": "bool",
    "integer": "int",
    "double": "float",
    "string": "str",
    "byte_array": "list[bytes]",
    "bool_array": "list[bool]",
    "integer_array": "list[int]",
    "double_array": "list[float]",
    "string_array": "list[str]",
}
#: The attributes of a behavior with ports, and the kinds of port in them.
PORT_ATTRIBUTES: Mapping[str, PortKind] = {
    kind.section: kind for kind in (PortKind.PUBLISHER, PortKind.CLIENT, PortKind.ACTION_CLIENT)
}
_DEFINITIONS = {"topic": Message, "service": Service, "action": Action}
_HEAD = (
    "from typing import Final, TypeAlias",
    "",
    "import _ros",
)


@dataclass(frozen=True, slots=True)
class NamedNode:
    """A node type, or a node with a behavior of its own, and the file that declares it."""

    name: str
    node: Node
    place: str


def behavior_class_name(name: str) -> str:
    """Return the name of the base class for a node type: ``SensorDriverBehavior``."""
    words = re.split(r"_+", name)
    return "".join(word[:1].upper() + word[1:] for word in words) + SUFFIX


def behavior_classes(
    nodes: Iterable[NamedNode], interfaces: Interfaces
) -> tuple[dict[str, Node], list[tuple[NamedNode, NamedNode]]]:
    """Return the base classes by name, and the nodes that would need another class of that name.

    The first of several nodes gets the class; the others come with it in pairs.
    """
    first: dict[str, NamedNode] = {}
    conflicts = []
    for item in nodes:
        name = behavior_class_name(item.name)
        chosen = first.setdefault(name, item)
        texts = {behavior_module({name: node}, interfaces) for node in (chosen.node, item.node)}
        if name.isidentifier() and len(texts) > 1:
            conflicts.append((chosen, item))
    classes = {name: first[name].node for name in sorted(first) if name.isidentifier()}
    return classes, conflicts


def behavior_module(
    classes: Mapping[str, Node], interfaces: Interfaces, others: Iterable[str] = ()
) -> str:
    """Return the stub of ``composer.typed`` with the given classes by name.

    ``others`` are classes of node types that are not known: without ports and parameters.
    """
    lines = [line for name, node in classes.items() for line in _class(name, node, interfaces)]
    lines += (f"class {name}(composer.behavior.Behavior): ..." for name in others)
    head = [
        "from collections.abc import Awaitable",
        "from typing import Any, Literal, overload",
        "",
        "import composer.behavior",
        *(f"import {module}" for module in interface_modules("\n".join(lines))),
        "",
    ]
    return "\n".join((*head, *lines, ""))


def port_type(port: Port, interfaces: Interfaces) -> str | None:
    """Return the Python name of a port's type, None if it is unknown."""
    name = port.interface.value
    definition = interfaces.find(name)
    expected = _DEFINITIONS[port.kind.channel.value]
    return python_name(name) if isinstance(definition, expected) else None


def signatures(node: Node, interfaces: Interfaces) -> dict[str, Signature]:
    """Return the handlers that the behavior of a node may have."""
    types = {port.name.value: port_type(port, interfaces) for port in node.ports}
    found = {f"on_{timer.name}": Signature() for timer in node.timers}
    for handler in handlers(node):
        type_ = types.get(handler.of.value)
        if type_ is not None and handler.kind != "timer":
            found[handler.name] = handler.signature.of(type_)
    found |= GENERAL_HANDLERS
    return {name: item for name, item in found.items() if name.isidentifier()}


def _member_class_name(behavior: str, attribute: str) -> str:
    """Return the name of the class of ``self.publishers`` or of another group of members."""
    title = attribute.title().replace("_", "")
    return f"{behavior.removesuffix(SUFFIX)}{title}"


def _class(name: str, node: Node, interfaces: Interfaces) -> Iterator[str]:
    groups = {attribute: _ports(node, attribute, interfaces) for attribute in PORT_ATTRIBUTES}
    descriptions = {port.name.value: port.description for port in node.ports}
    for attribute, members in groups.items():
        yield f"class {_member_class_name(name, attribute)}:"
        yield from _properties(members, descriptions)
        yield "    def __getitem__(self, name: str, /) -> Any: ..."
    yield f"class {_member_class_name(name, 'parameters')}:"
    yield from _parameters(node)
    yield f"class {name}(composer.behavior.Behavior):"
    if node.description:
        yield f"    {_docstring(node.description)}"
    for attribute in (*groups, "parameters"):
        yield f"    {attribute}: {_member_class_name(name, attribute)}"
    for handler, signature in signatures(node, interfaces).items():
        arguments = "".join(f", {argument}: {type_}" for argument, type_ in signature.arguments)
        if arguments:
            arguments += ", /"  # they are passed by position: a behavior may name them as it likes
        result = signature.result
        yield f"    def {handler}(self{arguments}) -> Awaitable[{result}] | {result}: ..."


def _docstring(text: str) -> str:
    """Return a description as a docstring of one line."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    plain = plain.replace("\\", "/").replace('"', "'")
    return f'"""{plain}"""'


def _ports(node: Node, attribute: str, interfaces: Interfaces) -> Iterator[tuple[str, str]]:
    for port in node.ports_of(PORT_ATTRIBUTES[attribute]):
        type_ = port_type(port, interfaces)
        match type_, port.kind:
            case None, _:
                yield port.name.value, "Any"
            case _, PortKind.PUBLISHER:
                yield port.name.value, f"composer.behavior.Publisher[{type_}]"
            case _, PortKind.CLIENT:
                parts = f"{type_}.Request, {type_}.Response"
                yield port.name.value, f"composer.behavior.Client[{parts}]"
            case _:
                parts = f"{type_}.Goal, {type_}.Result, {type_}.Feedback"
                yield port.name.value, f"composer.behavior.ActionClient[{parts}]"


def _properties(
    members: Iterable[tuple[str, str]], descriptions: Mapping[str, str]
) -> Iterator[str]:
    for name, type_ in members:
        if name.isidentifier() and not iskeyword(name):
            description = descriptions.get(name)
            yield "    @property"
            yield f"    def {name}(self) -> {type_}:{'' if description else ' ...'}"
            if description:
                yield f"        {_docstring(description)}"


def _described(parameter: Parameter) -> str:
    """Return the description of a parameter, with its unit."""
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    return f"{parameter.description}{unit}".strip()


def _parameters(node: Node) -> Iterator[str]:
    members = [
        (parameter.name.value, PARAMETER_TYPES.get(parameter.type.value, "Any"))
        for parameter in node.parameters
    ]
    yield from _properties(members, {item.name.value: _described(item) for item in node.parameters})
    for name, type_ in members:
        yield "    @overload"
        yield f"    def __getitem__(self, name: Literal[{name!r}], /) -> {type_}: ..."
    if members:
        yield "    @overload"
    yield "    def __getitem__(self, name: str, /) -> Any: ..."


def message_stubs(interfaces: Interfaces, names: Iterable[str] | None = None) -> dict[str, str]:
    """Return the stubs of interfaces and of the messages in them; by default, of all interfaces."""
    pending = list(interfaces.names() if names is None else names)
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
    if isinstance(definition, Message):
        return "\n".join(_message(name, definition))
    named = {part.capitalize(): message for part, message in parts(definition).items()}
    base = "ServiceType" if isinstance(definition, Service) else "ActionType"
    return "\n".join(_with_parts(name, named, base))


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
            value = bytes([value])  # type: ignore[assignment]  # as in the class
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

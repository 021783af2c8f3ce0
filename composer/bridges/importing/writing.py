"""Write descriptions as canonical YAML, as far as a file can hold them."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import fields, replace

from composer.base.characters import escape_lines, is_safe
from composer.base.source import SourceFile, Span
from composer.bridges.importing import FoundNode, FoundParameter, FoundPort, FoundSystem
from composer.language.document.writer import write_document
from composer.language.rules import MAX_NODES
from composer.language.tree import Entry, Mapping, Plain, Scalar, Sequence, Tree
from composer.launch.variants import with_references
from composer.model import ChannelKind, PortKind
from composer.model.names import free_name
from composer.model.qos import PRESETS, QosProfile

#: Presets that may describe a profile, the usual ones first.
_PRESETS = ("command", "sensor_data", "state")
#: Of the value of a parameter: longer ones are data, longer than a robot description.
_MAX_CHARACTERS = 500_000
#: What was left out and is listed in a file.
_MAX_LISTED = 200
_RANGE = ("minimum", "maximum", "step")
_TOLERANCE = 1e-6  # for a whole number of steps, in steps
_NOWHERE = Span(SourceFile("", ""), 1, 1, 1)
_NOT_IN_KEYS = re.compile(r"[^A-Za-z0-9_]+")

_Comments = dict[tuple[str, ...], tuple[str, ...]]


def write_system(found: FoundSystem, parameter_file: str | None = None) -> str:
    """Return a system file. ``parameter_file`` is the file of :func:`write_parameters`, if any."""
    comments: _Comments = {(): found.comments}
    if found.left_out:
        listed = found.left_out[:_MAX_LISTED]
        more = (f"... and {len(found.left_out) - _MAX_LISTED} more",) * (listed != found.left_out)
        comments[()] += ("", "Left out:", *(f"- {text}" for text in listed), *more)
    nodes: dict[str, Plain] = {}
    keys = node_keys(found.nodes)
    key_of = {(node.full_name, node.version): key for key, node in keys.items()}
    for key, node in keys.items():
        container = {"container": key_of[node.container]} if node.container else {}
        written = replace(node, keys={**node.keys, **container})
        nodes[key] = _node(key, written, ("nodes", key), comments)
    content: dict[str, Plain] = {"system": found.name}
    if found.arguments:
        content["arguments"] = dict(found.arguments)
    if parameter_file is not None:
        content["parameter_files"] = [parameter_file]
    return write_document(_map({**content, "nodes": nodes}), comments)


def write_parameters(found: FoundSystem) -> str:
    """Return the parameters of further nodes as a ROS parameter file."""
    sections: dict[str, Plain] = {
        name: {"ros__parameters": dict(values)} for name, values in found.sections.items()
    }
    comments: _Comments = {
        (): (*found.comments[:1], "Of nodes that the programs of the system may create.")
    }
    return write_document(_map(sections, has_variables=False), comments)


def write_node_type(type_name: str, found: FoundNode) -> str:
    """Return the file of a node type.

    The names of ports stay as they are: the namespace is that of each node with the type.
    """
    comments: _Comments = {(): found.comments}
    content: dict[str, Plain] = {"node": type_name, **found.keys}
    content |= _declarations(found, (), comments)
    return write_document(_map(content), comments)


def node_keys(nodes: Iterable[FoundNode]) -> dict[str, FoundNode]:
    """Return the nodes by their keys: their names, with parts of the namespace where needed."""
    nodes = tuple(nodes)
    names = Counter(node.name for node in nodes)
    found: dict[str, FoundNode] = {}
    for node in nodes:
        key = node.name
        if names[node.name] > 1:
            key = _key(node.full_name)
        found[free_name(key, found)] = node
    return found


def qos_value(profile: QosProfile) -> Plain:
    """Return a profile as YAML: a preset, or the policies that differ from the defaults."""
    profile = replace(profile, depth=max(profile.depth, 1))  # 0 leaves it to the middleware: 1
    for name in _PRESETS:
        if PRESETS[name] == profile:
            return name
    default = QosProfile()
    return {
        policy.name: _policy(getattr(profile, policy.name))
        for policy in fields(QosProfile)
        if getattr(profile, policy.name) != getattr(default, policy.name)
    }


def _node(key: str, node: FoundNode, path: tuple[str, ...], comments: _Comments) -> Plain:
    content: dict[str, Plain] = {}
    if node.name != key:
        content["name"] = node.name
    if node.namespace != "/":
        content["namespace"] = node.namespace
    content |= node.keys
    if node.comments:
        comments[path] = node.comments
    content |= _declarations(node, path, comments)
    if node.remappings:
        content["remappings"] = dict(node.remappings)
    return content


def _declarations(node: FoundNode, path: tuple[str, ...], comments: _Comments) -> dict[str, Plain]:
    content: dict[str, Plain] = {}
    if node.parameters:
        content["parameters"] = {item.name: _parameter(item) for item in node.parameters}
        for item in node.parameters:
            if item.comments:
                comments[*path, "parameters", item.name] = item.comments
    keys: set[str] = set()  # a key is the name of one port of the node, whatever its kind
    for kind in PortKind:
        written: dict[str, Plain] = {}
        for port in (port for port in node.ports if port.kind is kind):
            relative = _relative(port.name, node) if path else port.name
            key = free_name(_key(relative.rpartition("/")[2] or "port", relative), keys)
            keys.add(key)
            written[key] = _port(port, relative, key)
            if port.comments:
                comments[*path, kind.section, key] = port.comments
        if written:
            content[kind.section] = written
    return content


def _port(port: FoundPort, relative: str, key: str) -> Plain:
    content: dict[str, Plain] = {"type": port.type}
    if relative != key:
        content[port.kind.channel.value] = relative
    if port.qos is not None and port.kind.channel is ChannelKind.TOPIC:
        content["qos"] = qos_value(port.qos)
    if port.external:
        content["external"] = True
    return content


def _relative(name: str, node: FoundNode) -> str:
    """Return the name of a port as short as a file may write it."""
    if name.startswith(f"{node.full_name}/"):
        return f"~{name.removeprefix(node.full_name)}"
    namespace = node.namespace.rstrip("/") + "/"
    rest = name.removeprefix(namespace)
    return rest if name.startswith(namespace) and "/" not in rest else name


def _parameter(item: FoundParameter) -> Plain:
    content: dict[str, Plain] = {"type": item.type}
    if item.value is not None:
        content["default"] = item.value
    return {**content, **item.settings}


def _policy(value: object) -> Plain:
    return value if isinstance(value, bool | int | float) or value is None else str(value)


def _key(text: str, whole: str = "") -> str:
    """Return ``text`` as the key of a port or node: a Python name."""
    key = _NOT_IN_KEYS.sub("_", text).strip("_") or _NOT_IN_KEYS.sub("_", whole).strip("_")
    return f"_{key}" if key[:1].isdigit() else key or "unnamed"


def _map(content: dict[str, Plain], *, has_variables: bool = True) -> Mapping:
    tree = _tree(content, _literal if has_variables else str)
    return tree if isinstance(tree, Mapping) else Mapping((), _NOWHERE)


def _tree(value: Plain, text: Callable[[str], str]) -> Tree:
    if isinstance(value, dict):
        entries = (
            Entry(Scalar(text(key), _NOWHERE), _tree(item, text)) for key, item in value.items()
        )
        return Mapping(tuple(entries), _NOWHERE)
    if isinstance(value, list):
        return Sequence(tuple(_tree(item, text) for item in value), _NOWHERE)
    return Scalar(text(value) if isinstance(value, str) else value, _NOWHERE)


def _literal(text: str) -> str:
    """Return a text in which only what a launch file takes from its arguments is a variable."""
    return with_references(text.replace("${", "$${"))


def readable(found: FoundSystem) -> FoundSystem:
    """Return what a file can hold: parameters without long values, and the first nodes.

    The language has neither control characters nor numbers that are not finite, and ``${`` in a
    name begins a variable.
    """
    left_out = list(found.left_out)
    nodes = []
    for node in found.nodes[:MAX_NODES]:
        kept = []
        for item in node.parameters:
            what, size = f"parameter {item.name} of {node.full_name}", len(str(item.value))
            if not item.name or "${" in item.name or not _is_readable(item.name):
                left_out.append(f"parameter {item.name!r} of {node.full_name}: an invalid name")
            elif size > _MAX_CHARACTERS:
                left_out.append(f"{what}: its value has {size:,} characters")
            elif _is_readable(item.value):
                kept.append(_with_readable_settings(item))
            else:
                problem = "its value has characters or numbers that a file cannot have"
                left_out.append(f"{what}: {problem}")
        nodes.append(replace(node, parameters=tuple(kept)))
    left_out += (f"node {item.full_name}: the file is full" for item in found.nodes[MAX_NODES:])
    return replace(found, nodes=tuple(nodes), left_out=tuple(left_out))


def _with_readable_settings(item: FoundParameter) -> FoundParameter:
    """Return a parameter without limits that its value is not in: a node may report any."""
    settings = {key: _escaped(value) for key, value in item.settings.items() if _is_readable(value)}
    if all(_is_in_range(value, settings) for value in _elements(item.value)):
        return replace(item, settings=settings)
    others = {key: value for key, value in settings.items() if key not in _RANGE}
    comment = "Its value is not in the range that the node reports."
    return replace(item, settings=others, comments=(*item.comments, comment))


def _elements(value: Plain) -> list[Plain]:
    return value if isinstance(value, list) else [value]


def _is_in_range(value: Plain, settings: dict[str, Plain]) -> bool:
    low, high, step = (settings.get(key) for key in _RANGE)
    numbers = [number for number in (low, value, high) if isinstance(number, int | float)]
    if numbers != sorted(numbers):
        return False
    if not isinstance(step, int | float) or not isinstance(value, int | float) or value == high:
        return True
    steps = (value - (low if isinstance(low, int | float) else 0)) / step if step > 0 else math.nan
    return math.isclose(steps, round(steps), abs_tol=_TOLERANCE) if math.isfinite(steps) else False


def _is_readable(value: Plain) -> bool:
    match value:
        case str():
            return is_safe(value)
        case float():
            return math.isfinite(value)
        case list():
            return all(map(_is_readable, value))
    return True


def _escaped(value: Plain) -> Plain:
    return escape_lines(value) if isinstance(value, str) else value

"""Describe the nodes of a launch file, as :mod:`composer.launch.visitor` reports them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from composer.base.characters import escape_lines
from composer.bridges.importing import FoundNode, FoundParameter, FoundSystem
from composer.bridges.importing.conditions import condition
from composer.language.document.scalars import NumberRefused, resolve_plain
from composer.language.expressions import ExpressionError, compile_expression
from composer.language.tree import Plain
from composer.launch.variants import (
    identifier,
    inner_sections,
    is_switch,
    mark,
    marked_names,
    unified_groups,
    with_references,
)
from composer.model import LogLevel
from composer.model.names import free_name, join_node_name, split_node_name
from composer.model.resolve.parameters import rclpy_type

_PORTS = (
    "A launch file does not show topics, services and actions, so the nodes have no ports.",
    "To add them, start it, and copy the ports from the output of 'compose import live'.",
)
_MS = 1000.0


def describe_launch_file(
    name: str, path: str, given: Iterable[str], report: Mapping[str, Any]
) -> FoundSystem:
    """Return the system that a launch file starts, with the ``given`` arguments as defaults.

    ``report`` are its visits, see :func:`composer.launch.variants.all_visits`.
    """
    visits = report["visits"]
    left_out = [text for visit in visits for text in visit["left_out"]]
    left_out += (
        f"argument {argument}: the system has its value, and cannot change it"
        + (f": {problem}" if problem else "")
        for argument, problem in report["resolved"].items()
    )
    lost: list[str] = []
    sections = _sections_of_all(report, lost)
    items = [*_by_containers([*_items(report)], [visit["values"] for visit in visits])]
    names_in_use = _names_in_use(report["arguments"], items)
    arguments = [item for item in report["arguments"] if item["name"] in names_in_use]
    left_out += (
        f"argument {item['name']}: no node depends on it"
        for item in report["arguments"]
        if item not in arguments
    )
    names = _names(items, left_out)
    nodes = tuple(
        _node(item, node_name, left_out) for item, node_name in zip(items, names, strict=True)
    )
    nodes += tuple(_external_containers(nodes, items, visits))
    left_out += lost
    command = " ".join(["compose import launch", path, *given])
    return FoundSystem(
        name,
        nodes,
        (f"Imported by '{command}'.", *_PORTS),
        tuple(with_references(text) for text in dict.fromkeys(left_out)),
        sections,
        {identifier(item["name"]): _argument(item, items) for item in arguments},
    )


def _items(report: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the nodes of all visits, each with its condition; as few as possible.

    ``present`` are the visits that have it, ``samples`` values of its parameters, and
    ``sections`` the names in its parameter files.
    """
    visits = report["visits"]
    values = [visit["values"] for visit in visits]
    defaults = {mark(item["name"]): item["value"] for item in report["arguments"]}
    by_name: dict[tuple[str, ...], dict[int, dict[str, Any]]] = {}
    for number, visit in enumerate(visits):
        counts: Counter[tuple[str, ...]] = Counter()
        for position, item in enumerate(visit["nodes"]):
            name = tuple(str(item[key]) for key in ("namespace", "name", "package", "executable"))
            counts[name] += 1
            given = item if number else report["base"][position]
            item["samples"] = {
                name: _sample(value, defaults) for name, value in given["parameters"].items()
            }
            by_name.setdefault((*name, str(counts[name])), {})[number] = item
    for present in by_name.values():
        samples: dict[str, Any] = {}
        for item in reversed(present.values()):
            samples |= item.pop("samples")
        sections = {name for item in present.values() for name in item.pop("sections")}
        # What a system has no key for does not make it another node.
        lost = [text for item in present.values() for text in item["process"].pop("left_out")]
        for item, numbers in unified_groups(present, values):
            for part in _expressible(values, numbers):
                yield {
                    **item,
                    "sections": sections,
                    "present": frozenset(part),
                    "condition": condition(values, part),
                    "samples": samples,
                    "left_out": lost,
                }


def _by_containers(
    items: Sequence[dict[str, Any]], values: Sequence[Mapping[str, str]]
) -> Iterator[dict[str, Any]]:
    """Yield the nodes with their versions; a component once for each version of its container."""
    versions: dict[str, list[dict[str, Any]]] = {}
    for item in items:
        same = versions.setdefault(join_node_name(item["namespace"], item["name"] or ""), [])
        item["version"] = (len(same),)
        same.append(item)
    for item in items:
        if item.get("component") is None:
            yield item
            continue
        full_name = join_node_name(*item["container"])
        rest = item["present"]
        # The last one stands for the visits in which the launch file does not start a container.
        for number, container in enumerate([*versions.get(full_name, ()), item]):
            present = rest & container["present"]
            rest -= present
            for part in _expressible(values, sorted(present)) if present else ():
                yield {
                    **item,
                    "container": (full_name, (number,)),
                    "version": (*item["version"], number),
                    "present": frozenset(part),
                    "condition": condition(values, part),
                }


def _expressible(values: Sequence[Mapping[str, str]], numbers: list[int]) -> list[list[int]]:
    """Return the visits in parts, so that the condition of each is a short enough expression."""
    middle = len(numbers) // 2
    try:
        for text in condition(values, numbers).values():
            compile_expression(text)
    except ExpressionError:
        if middle:
            return [
                *_expressible(values, numbers[:middle]),
                *_expressible(values, numbers[middle:]),
            ]
    return [numbers]


def _sample(value: Any, defaults: Mapping[str, str]) -> Any:
    """Return the value of a parameter; the default of an argument if it has the argument's."""
    default = defaults.get(value) if isinstance(value, str) else None
    return value if default is None else _typed(default)


def _typed(default: str) -> Plain:
    try:
        return resolve_plain(default) if default else default
    except NumberRefused:
        return default


def _names_in_use(
    arguments: Iterable[Mapping[str, Any]], items: Iterable[Mapping[str, Any]]
) -> set[str]:
    """Return the names of the arguments in the descriptions and conditions of nodes."""
    used: set[str] = set()
    for item in items:
        used |= marked_names({**item, "present": None, "samples": None, "sections": None})
        for text in item["condition"].values():
            used.update(path.root for path in compile_expression(text).paths)
    return {item["name"] for item in arguments if identifier(item["name"]) in used}


def _argument(argument: Mapping[str, Any], items: Iterable[Mapping[str, Any]]) -> Plain:
    """Return the declaration of an argument: its default alone if there is nothing else."""
    reference, default = mark(argument["name"]), argument["default"]
    text = argument["value"]
    value: Plain = text
    choices = [text for text in argument["choices"] if text in argument["values"]]
    if is_switch([text, *choices, *argument["values"]]):
        value, choices = text.lower() == "true", []
    elif any(
        item["parameters"].get(name) == reference
        for item in items
        for name, sample in item["samples"].items()
        if not isinstance(sample, str)
    ):
        value = _typed(text)
    declared: dict[str, Plain] = {} if default is None else {"default": value}
    if choices:
        declared["choices"] = choices
    elif default is None:
        declared["type"] = "string"
    if argument["description"]:
        declared["description"] = escape_lines(argument["description"])
    return value if [*declared] == ["default"] else declared


def _node(item: Mapping[str, Any], name: str, left_out: list[str]) -> FoundNode:
    full_name = join_node_name(item["namespace"], name)
    comments: tuple[str, ...] = ()
    if item["note"]:
        comments += (f"Started {item['note']} by the launch file.",)
    component = item.get("component")
    implementation: dict[str, Plain] = {"component": component}
    if component is None:
        implementation = {"executable": _executable(item)}
    keys: dict[str, Plain] = {**item["condition"], **implementation}
    if item["name"] is None and component is not None:
        comments += (f"The launch file does not name it: {component['plugin']} does.",)
    elif item["name"] is None:
        comments += ("The launch file does not name its nodes; list them under 'nodes'.",)
        if item["sections"]:
            comments += (f"Its parameter files name: {', '.join(sorted(item['sections']))}.",)
    log_level = _log_level(item["ros_arguments"])
    if log_level is not None:
        keys["log_level"] = log_level
    lifecycle = _lifecycle(item["process"], full_name, left_out)
    if lifecycle:
        keys["lifecycle"] = lifecycle
    left_out += (f"{text} (of {full_name})" for text in item["left_out"])
    left_out += item["problems"]
    return FoundNode(
        name=name,
        namespace=item["namespace"],
        keys=keys,
        parameters=tuple(_declared(item, full_name, left_out)),
        remappings=item["remappings"],
        comments=comments,
        container=item["container"] if component is not None else None,
        version=item["version"],
    )


def _external_containers(
    nodes: Sequence[FoundNode], items: Sequence[Mapping[str, Any]], visits: Sequence[Any]
) -> Iterable[FoundNode]:
    """Yield the containers that the launch file does not start, each with its condition."""
    started = {(node.full_name, node.version) for node in nodes}
    present: dict[tuple[str, tuple[int, ...]], set[int]] = {}
    for node, item in zip(nodes, items, strict=True):
        if node.container is not None and node.container not in started:
            present.setdefault(node.container, set()).update(item["present"])
    for (full_name, version), numbers in present.items():
        namespace, name = split_node_name(full_name)
        keys: dict[str, Plain] = {**condition([visit["values"] for visit in visits], numbers)}
        keys["external"] = True
        comment = "The launch file loads components into it, and does not start it."
        yield FoundNode(name, namespace, keys, comments=(comment,), version=version)


def _names(items: Iterable[Mapping[str, Any]], left_out: list[str]) -> list[str]:
    """Return a name for each node: its own, or a free one if it has none or another has it."""
    taken = {item["name"] for item in items}
    present: dict[str, frozenset[int]] = {}
    names = []
    for item in items:
        name = item["name"]
        full_name = join_node_name(item["namespace"], name or "")
        if name is None:
            name = free_name(_identifier(Path(item["executable"]).name), taken)
        elif present.get(full_name, frozenset()) & item["present"]:
            name = free_name(name, taken)
            left_out.append(f"the name '{item['name']}' of a second node: it is '{name}' here")
        taken.add(name)
        full_name = join_node_name(item["namespace"], name)
        present[full_name] = present.get(full_name, frozenset()) | item["present"]
        names.append(name)
    return names


def _identifier(program: str) -> str:
    stem = program.partition(".")[0]
    name = "".join(each if each.isalnum() and each.isascii() else "_" for each in stem)
    return f"_{name}" if not name or name[0].isdigit() else name


def _executable(item: Mapping[str, Any]) -> Plain:
    if item["package"]:
        found: dict[str, Plain] = {"package": item["package"], "name": item["executable"]}
    else:
        found = {"command": [item["executable"]]}
    if item["name"] is None:
        found["nodes"] = []
    arguments = list(item["arguments"])
    if item["ros_arguments"] and _log_level(item["ros_arguments"]) is None:
        arguments += ["--ros-args", *item["ros_arguments"], "--"]
    if arguments:
        found["arguments"] = arguments
    if item["environment"]:
        found["environment"] = dict(item["environment"])
    if item["lifecycle"]:
        found["lifecycle"] = "managed"
    process = item["process"]
    if process["cwd"] is not None:
        found["working_directory"] = process["cwd"]
    for name in ("sigterm_timeout", "sigkill_timeout"):
        if name in process:
            found[f"{name}_ms"] = _milliseconds(process[name])
    return found


def _log_level(ros_arguments: list[str]) -> str | None:
    """Return the level, if the arguments set only one level, for all loggers."""
    match ros_arguments:
        case ["--log-level", level] if level.lower() in [item.value for item in LogLevel]:
            return str(level.lower())
        case _:
            return None


def _lifecycle(process: Mapping[str, Any], full_name: str, left_out: list[str]) -> dict[str, Plain]:
    """Return what follows when the process ends: a restart, or the end of the system."""
    if process["ends_launch"]:
        return {"on_failure": "shutdown"}
    if "respawn_delay" not in process:
        return {}
    delay_ms = _milliseconds(process["respawn_delay"])
    restart: dict[str, Plain] = {"backoff_ms": delay_ms, "backoff_max_ms": delay_ms}
    if process["respawn_max_retries"] > 0:
        restart["max_attempts"] = process["respawn_max_retries"]
    else:
        left_out.append(
            f"respawn without a limit (of {full_name}): a restart is limited by 'max_attempts'"
        )
    return {"on_failure": "restart", "restart": restart}


def _milliseconds(seconds: float) -> Plain:
    return round(seconds * _MS) if (seconds * _MS).is_integer() else seconds * _MS


def _declared(
    item: Mapping[str, Any], full_name: str, left_out: list[str]
) -> Iterable[FoundParameter]:
    for name, value in item["parameters"].items():
        kind = rclpy_type(item["samples"].get(name, value))
        if kind is None:
            left_out.append(f"parameter {name} of {full_name}: its type is not known")
        else:
            yield FoundParameter(name, kind, value)


def _sections_of_all(report: Mapping[str, Any], lost: list[str]) -> dict[str, dict[str, Plain]]:
    """Return the parameters of nodes inside programs; where arguments change them, the defaults."""
    base = _sections([report["base"]], lost)
    found = _sections([visit["nodes"] for visit in report["visits"]], [])
    for name, values in base.items():
        if changed := sorted(key for key in values if key not in found.get(name, {})):
            lost.append(f"parameters of {name} with other arguments: {', '.join(changed)}")
    return {**found, **base}


def _sections(
    visits: Iterable[Sequence[Mapping[str, Any]]], left_out: list[str]
) -> dict[str, dict[str, Plain]]:
    """Return the parameters of the nodes that a visit does not name, by full names.

    Programs may create them. Another visit may name them: with other arguments, a program may be a
    component. A system has one set of parameters for each name, so what only some programs give to
    that name is left out.
    """
    given: dict[str, list[Mapping[str, Any]]] = {}
    for nodes in visits:
        for name, sections in inner_sections(nodes).items():
            given.setdefault(name, []).extend(sections)
    found: dict[str, dict[str, Plain]] = {}
    for name, (first, *others) in given.items():
        shared = {
            key: value
            for key, value in first.items()
            if all(key in values and values[key] == value for values in others)
        }
        if lost := sorted({key for values in (first, *others) for key in values} - shared.keys()):
            left_out.append(f"parameters of {name} in some programs only: {', '.join(lost)}")
        if shared:
            found[name] = shared
    return found

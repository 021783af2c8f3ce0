"""Visits a launch file as ``ros2 launch`` does, but starts nothing, and reports its nodes.

It is visited with several values of its arguments, see :mod:`composer.launch.variants`.

Run as ``python -P -m composer.launch.visitor REPORT FILE [NAME:=VALUE]...``: launch files are
Python, and their code runs. The report goes to the file REPORT as JSON.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from launch import LaunchContext, LaunchDescription, LaunchService
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteLocal,
    ExecuteProcess,
    IncludeLaunchDescription,
    RegisterEventHandler,
    Shutdown,
    TimerAction,
)
from launch.events import Shutdown as ShutdownEvent
from launch.frontend.parse_substitution import parse_substitution
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.substitutions import TextSubstitution
from launch.utilities.type_utils import perform_typed_substitution
from launch_ros import parameter_descriptions
from launch_ros.actions import ComposableNodeContainer, LifecycleNode, LoadComposableNodes, Node
from launch_ros.actions.load_composable_nodes import get_composable_node_load_request
from rclpy.parameter import parameter_value_to_python

from composer.base.source import shown_path
from composer.launch.comparisons import compared, text_of
from composer.launch.parameter_values import parameter_values
from composer.launch.variants import all_visits, mark, marked_names

_UNKNOWN_NAME = "<node_name_unspecified>"
#: The name that launch gives to the module of each launch file.
_LAUNCH_MODULE = "python_launch_file"
_MAXIMUM_ENTITIES = 100_000
#: What launch waits for after a signal by default, in seconds.
_SIGNAL_TIMEOUT_S = 5.0


class Visitor:
    """Collects the nodes of a launch description, in the order in which they would start."""

    def __init__(
        self, context: LaunchContext, given: Mapping[str, str], needed: Mapping[str, str]
    ) -> None:
        """``needed`` are values for arguments without one."""
        self._context = context
        self._given = given
        self._needed = needed
        self._environment = dict(context.environment)
        self._count = 0
        self.nodes: list[dict[str, Any]] = []
        self.left_out: list[str] = []
        self.arguments: dict[str, dict[str, Any]] = {}
        self.compared: dict[str, list[str]] = {}

    def visit(self, entity: Any, note: str = "") -> None:
        """Visit an entity and what it consists of. ``note`` says when it would be started."""
        self._count += 1
        if self._count > _MAXIMUM_ENTITIES:
            raise RuntimeError("the launch file includes itself without an end")
        if not self._is_chosen(entity):
            return
        if isinstance(entity, DeclareLaunchArgument) and self._declare(entity):
            return
        if isinstance(entity, Node):
            self.nodes.append(self._node(entity, note))
            self._add_components(entity, self.nodes[-1], note)
        elif isinstance(entity, LoadComposableNodes):
            self._add_components(entity, self._target(entity), note)
            return
        elif isinstance(entity, TimerAction):
            period = f"after {self._text(entity.period)} s"
            self.left_out.append(f"timer: what it starts {period} starts at once")
            for inner in entity.actions:
                self.visit(inner, period)
            return
        described = self._left_out(entity)
        self.left_out += described
        if not described and not isinstance(entity, Node):
            for inner in entity.visit(self._context) or ():
                self.visit(inner, note)

    def _is_chosen(self, entity: Any) -> bool:
        """Return whether the condition of an entity holds, and note what the condition compares."""
        condition = getattr(entity, "condition", None)
        if condition is None:
            return True
        for name, text in compared(condition, self._context):
            self.compared.setdefault(name, []).append(text)
        return bool(condition.evaluate(self._context))

    def _declare(self, argument: DeclareLaunchArgument) -> bool:
        """Add an argument, unless the file that includes this one sets it.

        Returns whether its value is none that launch would accept: a mark.
        """
        configurations, name = self._context.launch_configurations, argument.name
        if name in configurations and name not in (*self._given, *self._needed):
            return bool(marked_names(configurations[name]))
        default = self._given.get(name)
        if default is None and argument.default_value is not None:
            default = self._text(argument.default_value)
        value = configurations.get(name, default)
        self.arguments.setdefault(
            name,
            {
                "name": name,
                "default": default,
                "value": value,
                "description": _described(argument),
                "choices": list(argument.choices or ()),
            },
        )
        return bool(marked_names(value))

    def _left_out(self, entity: Any) -> list[str]:
        """Describe what cannot be a node of a system; nothing for what can be visited."""
        match entity:
            case Node():
                return []
            case ExecuteProcess() | ExecuteLocal():
                return [f"process: {' '.join(map(self._text, entity.cmd))}"]
            case RegisterEventHandler():
                return [f"event handler: {type(entity.event_handler).__name__}"]
            case EmitEvent():
                return [f"event: {type(entity.event).__name__}"]
            case _:
                return []

    def _node(self, node: Any, note: str) -> dict[str, Any]:
        node._perform_substitutions(self._context)
        namespace, _, name = str(node.node_name).rpartition("/")
        namespace = "" if "unspecified" in namespace else namespace
        full_name = f"{namespace}/{name}"
        arguments = getattr(node, "_Node__arguments", None) or ()
        found: dict[str, Any] = {
            "name": None if name == _UNKNOWN_NAME else name,
            "namespace": namespace or "/",
            "package": self._text(node.node_package) if node.node_package else None,
            "executable": self._text(node.node_executable),
            "arguments": [self._text(argument) for argument in arguments],
            "remappings": dict(node.expanded_remapping_rules or ()),
            "environment": self._environment_of(node),
            "lifecycle": isinstance(node, LifecycleNode),
            "note": note,
            "process": _process_options(node, self._context),
        }
        sources = [*self._global_parameters()]
        expanded = getattr(node, "_Node__expanded_parameter_arguments", None) or ()
        sources += [(str(text), bool(is_file)) for text, is_file in expanded]
        found |= parameter_values(sources, full_name)
        ros_arguments = getattr(node, "_Node__ros_arguments", None) or ()
        found["ros_arguments"] = [self._text(argument) for argument in ros_arguments]
        return found

    def _global_parameters(self) -> Iterable[tuple[str, bool]]:
        """Yield the values of SetParameter; launch_ros lists its files with those of the node."""
        given: Any = self._context.launch_configurations.get("global_params", None) or ()
        for item in given:
            if isinstance(item, tuple):
                yield f"{item[0]}:={json.dumps(item[1])}", False

    def _environment_of(self, node: Any) -> dict[str, str]:
        """Return the variables that differ from those of the visitor."""
        found = {
            name: value
            for name, value in self._context.environment.items()
            if self._environment.get(name) != value
        }
        for pairs in (node.env or (), node.additional_env or ()):
            found |= {self._text(name): self._text(value) for name, value in pairs}
        return found

    def _target(self, action: Any) -> dict[str, Any]:
        """Return the name and the namespace of the container that an action loads into."""
        target = action._LoadComposableNodes__target_container
        is_named = isinstance(target, ComposableNodeContainer)
        full_name = str(target.node_name) if is_named else self._text(target)
        namespace, _, name = full_name.rpartition("/")
        return {"name": name, "namespace": f"/{namespace.strip('/')}"}

    def _add_components(self, action: Any, container: Mapping[str, Any], note: str) -> None:
        """Add the nodes that are loaded into a container, with the names of a load request."""
        for description in _components(action):
            request = get_composable_node_load_request(description, self._context)
            if request is None:
                continue
            extra = {item.name: _plain(item.value) for item in request.extra_arguments}
            component = {"package": request.package_name, "plugin": request.plugin_name}
            self.nodes.append(
                {
                    "name": request.node_name or None,
                    "namespace": request.node_namespace or "/",
                    "package": request.package_name,
                    "executable": request.plugin_name.rpartition("::")[2],
                    "component": component | ({"extra_arguments": extra} if extra else {}),
                    "container": (container["namespace"], container["name"]),
                    "remappings": dict(rule.split(":=", 1) for rule in request.remap_rules),
                    "parameters": {item.name: _plain(item.value) for item in request.parameters},
                    "sections": {},
                    "problems": [],
                    "ros_arguments": [],
                    "note": note,
                    "process": {"left_out": [], "ends_launch": False},
                }
            )

    def _text(self, value: Any) -> str:
        return text_of(value, self._context)


def _described(argument: DeclareLaunchArgument) -> str:
    """Return the description of an argument, without what launch adds to it."""
    text = re.split(r"(?:One of|Valid choices are): \[", argument.description)[0].strip()
    return "" if text == "no description given" else text


def _process_options(node: Any, context: LaunchContext) -> dict[str, Any]:
    """Return the options that differ from the defaults, and whether they end the launch.

    Times are in seconds. ``left_out`` are options that a system does not have.
    """
    given = _attribute(node, "on_exit")
    on_exit = list(given) if isinstance(given, list | tuple) else [given] if given else []
    found: dict[str, Any] = {
        "cwd": text_of(node.cwd, context) if node.cwd else None,
        "ends_launch": any(map(_is_shutdown, on_exit)),
        "left_out": list(_left_out_options(node, context, on_exit)),
    }
    retries = _attribute(node, "respawn_max_retries")
    if retries != 0 and perform_typed_substitution(
        context, _attribute(node, "respawn") or False, bool
    ):
        delay = _attribute(node, "respawn_delay")
        found["respawn_delay"] = 0.0 if delay is None else float(text_of(delay, context))
        found["respawn_max_retries"] = -1 if retries is None else int(retries)
    for name in ("sigterm_timeout", "sigkill_timeout"):
        timeout_s = float(text_of(_attribute(node, name), context) or _SIGNAL_TIMEOUT_S)
        if timeout_s != _SIGNAL_TIMEOUT_S:
            found[name] = timeout_s
    return found


def _attribute(node: Any, name: str) -> Any:
    """Return what ExecuteLocal has been given; it has no public attribute for that."""
    return getattr(node, f"_ExecuteLocal__{name}", None)


def _left_out_options(node: Any, context: LaunchContext, on_exit: Iterable[Any]) -> Iterator[str]:
    prefix = text_of(node.process_description.prefix, context)
    if prefix:
        yield f"prefix: {prefix}"
    if perform_typed_substitution(context, node.shell, bool):
        yield "shell: the program runs without a shell"
    if node.env:
        yield "env: the variables are added to the others, and do not replace them"
    for item in on_exit:
        if not _is_shutdown(item):
            yield f"on_exit: {getattr(item, '__name__', type(item).__name__)}"


def _is_shutdown(item: Any) -> bool:
    is_event = isinstance(item, EmitEvent) and isinstance(item.event, ShutdownEvent)
    return is_event or isinstance(item, Shutdown)


def _cause(error: BaseException) -> str:
    """Return the first of the errors that launch has tried, with its place in a launch file."""
    while causes := getattr(error, "_likely_errors", None):
        error = causes[0]
    frames = traceback.walk_tb(error.__traceback__)
    places = [
        f"{shown_path(Path(frame.f_code.co_filename))}:{line}: "
        for frame, line in frames
        if frame.f_globals.get("__name__") == _LAUNCH_MODULE
    ]
    text = error.args[0] if isinstance(error, KeyError) and error.args else error
    first = (str(text).strip() or type(error).__name__).splitlines()[0]
    return f"{''.join(places[-1:])}{type(error).__name__}: {first}"


def _plain(value: Any) -> Any:
    """Return the value in a message of a parameter; byte strings become numbers."""
    found = parameter_value_to_python(value)
    if isinstance(found, list):
        return [item[0] if isinstance(item, bytes) else item for item in found]
    return found


def _components(action: Any) -> Iterable[Any]:
    """Return the components of a container, or those that an action loads into one."""
    for kind in ("ComposableNodeContainer", "LoadComposableNodes"):
        found = getattr(action, f"_{kind}__composable_node_descriptions", None)
        if found:
            return list(found)
    return ()


def main(report: Path, path: str, arguments: list[str]) -> None:
    """Visit a launch file, write the report, and end the process."""
    # launch_ros reads each parameter file, and parses its values, several times for each node.
    yaml.SafeLoader = yaml.CSafeLoader  # type: ignore[misc, assignment]
    vars(parameter_descriptions)["parse_substitution"] = lru_cache(maxsize=None)(parse_substitution)
    TextSubstitution.__repr__ = TextSubstitution.describe  # messages of launch have lists of them
    given = dict(text.split(":=", 1) for text in arguments)
    environment = dict(os.environ)

    def visit(values: Mapping[str, str]) -> dict[str, Any]:
        report.with_name("progress").touch()
        os.environ.clear()  # the launch file may have set variables
        os.environ.update(environment)
        return _visited(path, values)

    try:
        found = all_visits(visit, given)
    except Exception as error:
        traceback.print_exc()
        print(_cause(error), file=sys.stderr, flush=True)
        os._exit(1)
    report.write_text(json.dumps(found), encoding="utf-8")
    os._exit(0)  # whatever the launch file has started


def _visited(path: str, values: Mapping[str, str]) -> dict[str, Any]:
    """Return what a launch file has with these arguments."""
    context = LaunchContext(argv=[f"{name}:={value}" for name, value in values.items()])
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    context._set_asyncio_loop(loop)
    context.extend_globals({"launch_service": LaunchService})
    source = AnyLaunchDescriptionSource(path)
    needed = {
        argument.name: [*(argument.choices or ()), mark(argument.name)][0]
        for argument in source.get_launch_description(context).get_launch_arguments()
        if argument.default_value is None and argument.name not in values
    }
    include = IncludeLaunchDescription(source, launch_arguments=[*values.items(), *needed.items()])
    visitor = Visitor(context, values, needed)
    try:
        visitor.visit(LaunchDescription([include]))
    finally:
        loop.close()
    return {
        "nodes": visitor.nodes,
        "left_out": visitor.left_out,
        "arguments": list(visitor.arguments.values()),
        "compared": visitor.compared,
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:])

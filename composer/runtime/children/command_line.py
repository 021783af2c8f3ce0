"""The command line of an executable: the program, its arguments, and those of ROS.

They set what ``ros2 run PACKAGE NAME --ros-args ...`` sets: name, namespace, remappings,
parameters and log level.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from composer.base.diagnostics import suggestion
from composer.language.tree import Plain
from composer.model import (
    ChannelKind,
    Executable,
    LogLevel,
    Node,
    ParameterSection,
    ParameterType,
)
from composer.model.names import expand_name
from composer.project.executables import (
    executable_names,
    find_executable,
    find_program,
    has_package,
    program_path,
)
from composer.runtime.children.child_processes import Command
from composer.runtime.middleware.environment import CONSOLE_FORMAT

#: The topics and services of an action. rcl remaps each of them by its own name.
_ACTION_PARTS = ("send_goal", "cancel_goal", "get_result", "feedback", "status")
_LOG_LEVEL = {LogLevel.WARN: "warn"}


class NotRunnable(Exception):
    """The program of a node cannot be found; the text says what was looked for."""


def make_command(
    node: Node, executable: Executable, log_level: LogLevel, environment: Mapping[str, str]
) -> Command:
    """Return the command that starts the node, without its parameter file.

    Raises NotRunnable.
    """
    own = {name.value: value for name, value in executable.environment}
    words = (
        *_program(executable, {**environment, **own}),
        *(word.value for word in executable.arguments),
        "--ros-args",
        *_names(node),
        *(word for rule in remappings(node) for word in ("-r", rule)),
        *("--log-level", _LOG_LEVEL.get(log_level, log_level.value)),
    )
    changes = {
        "PATH": program_path({**environment, **own}),
        "PYTHONUNBUFFERED": "1",  # otherwise lines of print() arrive in blocks of 8 kB
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": CONSOLE_FORMAT,
        "RCUTILS_COLORIZED_OUTPUT": "0",
    }
    return Command(words, changes | own, _folder(executable))


def _names(node: Node) -> Iterator[str]:
    """Yield the arguments for the name and the namespace that the program does not keep.

    In ``/``, nodes keep namespaces that the program gives them, as with ``ros2 run``.
    """
    if not node.keeps_names:
        yield from ("-r", f"__node:={node.ros_name.value}")
    if node.namespace.value != "/":
        yield from ("-r", f"__ns:={node.namespace.value}")


def remappings(node: Node) -> Iterator[str]:
    """Yield the remapping rules of a node: first of its ports, then of other names."""
    name, namespace = node.ros_name.value, node.namespace.value
    remapped: set[str] = set()
    for port in node.ports:
        declared = port.ros_name.value
        if expand_name(declared, name, namespace) == port.full_name:
            continue
        remapped.add(declared)
        yield f"{declared}:={port.full_name}"
        if port.kind.channel is ChannelKind.ACTION:
            for part in _ACTION_PARTS:
                yield f"{declared}/_action/{part}:={port.full_name}/_action/{part}"
    for remapping in node.remappings:
        if remapping.source.value not in remapped:
            yield f"{remapping.source.value}:={remapping.target.value}"


def parameter_file(node: Node) -> str:
    """Return a ROS parameter file with what the program of a node gets; empty for nothing."""
    return "".join(map(_section, node.parameter_sections))


def _section(section: ParameterSection) -> str:
    values = [
        f"    {_text(parameter.name.value)}: {_yaml(parameter.value.value, kind)}\n"
        for parameter in section.parameters
        if parameter.value is not None
        and parameter.value.value != []  # rcl cannot read a list without a type
        for kind in (parameter.type.value,)
    ]
    head = f"{_text(section.name)}:\n  ros__parameters:\n"
    return head + "".join(values) if values else ""


def _program(executable: Executable, environment: Mapping[str, str]) -> tuple[str, ...]:
    if executable.command:
        program, *arguments = (word.value for word in executable.command)
        path = find_program(program, executable.folder, environment)
        if path is None:
            raise NotRunnable(f"there is no program '{program}'")
        return (path, *arguments)
    package = "" if executable.package is None else executable.package.value
    name = "" if executable.name is None else executable.name.value
    found = find_executable(package, name, environment)
    if found is not None:
        return found
    if not has_package(package, environment):
        raise NotRunnable(f"package '{package}' is not installed")
    hint = suggestion(name, executable_names(package, environment))
    text = f"package '{package}' has no executable '{name}'"
    raise NotRunnable(text if hint is None else f"{text}; {hint}")


def _folder(executable: Executable) -> Path | None:
    """Return the working directory; None for the directory of this process."""
    if executable.working_directory is None:
        return executable.folder.absolute() if executable.command else None
    return (executable.folder / Path(executable.working_directory.value).expanduser()).absolute()


def _yaml(value: Plain, kind: str) -> str:
    """Return a value as rcl reads it with the right type."""
    if isinstance(value, list):
        return f"[{', '.join(_yaml(item, kind) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float) and kind.startswith(ParameterType.DOUBLE):
        return _double(float(value))
    if isinstance(value, int):
        return str(value)
    return _text(value)


def _text(value: Plain) -> str:
    # YAML does not know the pairs of escapes with which JSON writes emojis.
    return json.dumps(value, ensure_ascii=False)


def _double(value: float) -> str:
    if math.isnan(value):
        return ".nan"
    if math.isinf(value):
        return ".inf" if value > 0 else "-.inf"
    return repr(value)

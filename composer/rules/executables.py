"""Programs of executables and plugins of components: which one is meant, and whether it exists."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Label, error, suggestion
from composer.base.source import Located, Span
from composer.language.rules import MAX_ERRORS
from composer.model import (
    Component,
    Executable,
    ExecutableKind,
    ImplementationKind,
    LifecycleKind,
    Node,
)
from composer.project.executables import (
    component_plugins,
    executable_names,
    find_executable,
    find_program,
    has_package,
    has_ros_packages,
)
from composer.python_code.problems import Family
from composer.rules.analysis.context import Context, is_unresolved, limited
from composer.rules.analysis.subjects import is_misspelled
from composer.rules.implementations import SETTING_WITHOUT_EFFECT
from composer.rules.processes import CONFLICTING_PROCESS

NOT_INSTALLED = Family.NOT_INSTALLED.value
INVALID_EXECUTABLE = error("RC473", "invalid-executable")

#: Arguments with these suffixes are files, and are looked for.
_SCRIPTS = (".py", ".sh")
#: The name of a class in C++ or Python.
_CLASS = re.compile(r"[^\W\d]\w*((::|[.:])[^\W\d]\w*)*")
_CONTAINERS = (ImplementationKind.EXECUTABLE, ImplementationKind.EXTERNAL)


def check_unknown_executable(context: Context) -> Iterator[Diagnostic]:
    """Check packages that are installed, and paths."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or node.external is not None:
            continue
        if executable.command:
            yield from _command(executable)
        elif executable.package is not None and executable.name is not None:
            yield from _executable_of_package(context, executable.package, executable.name)
        folder = _folder(executable)
        if folder is not None and not folder.is_dir() and executable.working_directory:
            written = executable.working_directory
            yield Diagnostic(INVALID_EXECUTABLE, f"folder '{written}' does not exist", written.span)


def _command(executable: Executable) -> Iterator[Diagnostic]:
    program, *arguments = executable.command
    folder = _folder(executable)
    if is_unresolved(program.value) or folder is None:
        return
    if "/" in program.value and find_program(program.value, executable.folder, os.environ) is None:
        exists = (executable.folder / program.value).is_file()
        what = "is not executable" if exists else "does not exist"
        hint = f"run 'chmod +x {program}', or name its interpreter first" if exists else None
        yield Diagnostic(INVALID_EXECUTABLE, f"program '{program}' {what}", program.span, hint=hint)
    for script in arguments[:1]:
        path = folder / script.value
        if script.value.endswith(_SCRIPTS) and folder.is_dir() and not path.is_file():
            hint = suggestion(path.name, _file_names(path.parent))
            yield Diagnostic(
                INVALID_EXECUTABLE, f"file '{script}' does not exist", script.span, hint=hint
            )


def _executable_of_package(
    context: Context, package: Located[str], name: Located[str]
) -> Iterator[Diagnostic]:
    if is_unresolved(package.value) or is_unresolved(name.value):
        return
    if not context.once(_installed)(package.value):
        return  # see executable_not_installed.py
    if find_executable(package.value, name.value, os.environ) is None:
        yield Diagnostic(
            INVALID_EXECUTABLE,
            f"package '{package}' has no executable '{name}'",
            name.span,
            hint=suggestion(name.value, executable_names(package.value, os.environ)),
        )


def _has_ros(_: Context) -> bool:
    return has_ros_packages(os.environ)


def _installed(_: Context) -> Callable[[str], bool | None]:
    """Return whether a package is installed; None of very many packages, to limit the time."""
    looked_up: dict[str, bool] = {}

    def is_installed(package: str) -> bool | None:
        if package not in looked_up and len(looked_up) < MAX_ERRORS:
            looked_up[package] = has_package(package, os.environ)
        return looked_up.get(package)

    return is_installed


def _in_path(_: Context) -> Callable[[str], bool]:
    return cache(lambda program: find_program(program, Path(), os.environ) is not None)


def _folder(executable: Executable) -> Path | None:
    """Return the folder that a command runs in; None if it is not known."""
    written = executable.working_directory
    if written is None:
        return executable.folder
    return None if is_unresolved(written.value) else executable.folder / written.value


def _file_names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()] if folder.is_dir() else []


@limited
def check_executable_not_installed(context: Context) -> Iterator[Diagnostic]:
    """Look for the packages, and for programs in PATH."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or node.external is not None:
            continue
        package = executable.package
        if executable.command:
            program = executable.command[0]
            is_path = "/" in program.value or is_unresolved(program.value)
            if not is_path and not context.once(_in_path)(program.value):
                yield Diagnostic(NOT_INSTALLED, f"program '{program}' is not in PATH", program.span)
        elif package is None or is_unresolved(package.value) or not context.once(_has_ros):
            continue
        elif context.once(_installed)(package.value) is False:
            yield Diagnostic(NOT_INSTALLED, f"package '{package}' is not installed", package.span)


def check_incomplete_executable(context: Context) -> Iterator[Diagnostic]:
    """Check which keys the executables have."""
    for node in context.system.nodes:
        if node.executable is not None:
            yield from _programs(context, node.executable)


def _programs(context: Context, executable: Executable) -> Iterator[Diagnostic]:
    spans: dict[str, Span] = {key.value: key.span for key in executable.given}
    if "command" in spans:
        for name in ("package", "name"):
            if name in spans:
                yield Diagnostic(
                    INVALID_EXECUTABLE,
                    f"the executable has a 'command' and a '{name}'",
                    spans[name],
                    hint="keep either 'command', or 'package' and 'name'",
                )
        return
    if is_misspelled(context, "command", executable.span) or _has_unknown_key(context, executable):
        return
    missing = [
        name
        for name in ("package", "name")
        if name not in spans and not is_misspelled(context, name, executable.span)
    ]
    if missing:
        what = "'package' and 'name'" if len(missing) == 2 else f"'{missing[0]}'"
        yield Diagnostic(
            INVALID_EXECUTABLE,
            f"the executable has no {what}",
            executable.span,
            hint="write 'executable: {package: ..., name: ...}' or 'executable: {command: [...]}'",
        )


def _has_unknown_key(context: Context, executable: Executable) -> bool:
    """Return whether an earlier error is on the line of the executable, behind its key."""
    start = executable.span
    return any(
        (span.file.path, span.line) == (start.file.path, start.line) and span.column > start.column
        for span in context.refused
    )


def check_managed_task(context: Context) -> Iterator[Diagnostic]:
    """Check the tasks."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or executable.kind is not ExecutableKind.TASK:
            continue
        if executable.lifecycle is LifecycleKind.MANAGED:
            spans = {key.value: key.span for key in executable.given}
            yield Diagnostic(
                INVALID_EXECUTABLE,
                f"task '{node.name}' cannot be managed: it exits when it is done",
                spans.get("lifecycle", executable.span),
                hint="remove 'lifecycle: managed', or 'kind: task'",
            )


def check_component(context: Context) -> Iterator[Diagnostic]:
    """Check the packages and classes of components."""
    for node in context.system.nodes:
        component = node.component
        if component is None or node.external is not None:
            continue
        for name in ("package", "plugin"):
            is_missing = getattr(component, name) is None
            if is_missing and not is_misspelled(context, name, component.span):
                yield Diagnostic(
                    INVALID_EXECUTABLE,
                    f"the component has no '{name}'",
                    component.span,
                    hint="write 'component: {package: ..., plugin: ...}'",
                )
        if component.plugin is not None and not is_unresolved(component.plugin.value):
            yield from _plugin(context, component, component.plugin)


def _plugin(context: Context, component: Component, plugin: Located[str]) -> Iterator[Diagnostic]:
    package = component.package
    if not _CLASS.fullmatch(plugin.value):
        better = plugin.value.strip().replace("/", "::")
        yield Diagnostic(
            INVALID_EXECUTABLE,
            f"'{plugin}' is not the name of a class",
            plugin.span,
            hint=f"did you mean '{better}'?" if _CLASS.fullmatch(better) else None,
        )
    elif package is not None and not is_unresolved(package.value):
        plugins = component_plugins(package.value, os.environ)
        if plugins is not None and plugin.value not in plugins:
            yield Diagnostic(
                INVALID_EXECUTABLE,
                f"package '{package}' has no component '{plugin}'",
                plugin.span,
                hint=suggestion(plugin.value, plugins),
            )
        elif context.once(_has_ros) and context.once(_installed)(package.value) is False:
            text = f"package '{package}' is not installed"
            yield Diagnostic(NOT_INSTALLED, text, package.span)


def check_container(context: Context) -> Iterator[Diagnostic]:
    """Check that components have containers, and that these can load them."""
    for node in context.system.nodes:
        container = node.container
        if node.implementation is not ImplementationKind.COMPONENT:
            is_known = node.complete and not is_misspelled(context, "component", node.span)
            if container is not None and is_known:
                yield Diagnostic(
                    SETTING_WITHOUT_EFFECT,
                    f"'container' has no effect: node '{node.name}' is not a component",
                    container.span,
                    hint="remove it, or add 'component: {package: ..., plugin: ...}'",
                )
        elif container is not None:
            yield from _container(node, container, context.system.node(container.value))
        elif node.component and not is_misspelled(context, "container", node.component.span):
            yield Diagnostic(
                INVALID_EXECUTABLE,
                f"component '{node.name}' has no container",
                node.component.span,
                hint="name the node that loads it: 'container: ...'",
            )


def _container(node: Node, named: Located[str], container: Node | None) -> Iterator[Diagnostic]:
    if container is None or not container.complete:
        return  # unknown-node reports it
    kind = container.implementation
    program = container.executable if container.external is None else None
    problem = None
    if kind not in _CONTAINERS:
        problem = f"node '{container.name}' is not a container, but a {kind} node"
    elif program is not None and program.kind is ExecutableKind.TASK:
        problem = f"node '{container.name}' is not a container, but a task"
    if problem is not None:
        yield Diagnostic(
            INVALID_EXECUTABLE,
            problem,
            named.span,
            (Label(container.name.span, "declared here"),),
            "name a node with 'executable: {package: rclcpp_components,"
            " name: component_container}', or an external one",
        )
        return
    processes = [
        "the process of 'compose run'" if item.process is None else f"process '{item.process}'"
        for item in (node, container)
    ]
    if processes[0] != processes[1]:
        yield Diagnostic(
            CONFLICTING_PROCESS,
            f"component '{node.name}' is in {processes[0]}, its container in {processes[1]}",
            named.span,
            (Label(container.name.span, "the container"),),
            hint="put both into one process",
        )

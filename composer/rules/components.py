"""Components: their classes, and the containers that load them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, suggestion
from composer.base.source import Located
from composer.model import Component, ExecutableKind, ImplementationKind, Node
from composer.project.executables import component_plugins, has_package, has_ros_packages
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.earlier_errors import is_misspelled
from composer.rules.executables import INVALID_EXECUTABLE
from composer.rules.implementations import SETTING_WITHOUT_EFFECT
from composer.rules.processes import CONFLICTING_PROCESS
from composer.rules.python import NOT_INSTALLED

#: The name of a class in C++ or Python.
_CLASS = re.compile(r"[^\W\d]\w*((::|[.:])[^\W\d]\w*)*")
_CONTAINERS = (ImplementationKind.EXECUTABLE, ImplementationKind.EXTERNAL)


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
            yield from _plugin(component, component.plugin)


def _plugin(component: Component, plugin: Located[str]) -> Iterator[Diagnostic]:
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
        elif has_ros_packages(os.environ) and not has_package(package.value, os.environ):
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

"""What a test reads: files of systems and node types, and values for their parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from composer.base.diagnostics import has_errors
from composer.interfaces import Interfaces
from composer.loading import load_models
from composer.loading.reported import LoadResult
from composer.model import (
    ImplementationKind,
    Node,
    Parameter,
    ParameterType,
    PeriodError,
    System,
)
from composer.model.resolve import OverrideOptions
from composer.project import Project
from composer.project.node_types import NodeTypes
from composer.report.text import render
from composer.rules.analysis.parameters import range_problem, type_problem
from composer.testing.failures import TestFailure, unknown


def load_file(
    path: Path, arguments: Mapping[str, Any], settings: Mapping[str, Any]
) -> tuple[System, LoadResult]:
    """Return the model of a file, and what else is known of it; the rules do not check it.

    ``settings`` are values of parameters, by ``node.name``. Raises TestFailure with the diagnostics
    if the file has errors.
    """
    overrides = OverrideOptions(arguments=_words(arguments), settings=_words(settings))
    [result] = load_models([path], overrides)
    if result.system is None or has_errors(result.diagnostics):
        raise TestFailure(f"{path} has errors:\n{render(result.diagnostics)}")
    return result.system, result


def _words(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return values as on a command line."""
    texts = (
        (key, item if isinstance(item, str) else json.dumps(item)) for key, item in values.items()
    )
    return tuple(f"{key}={text}" for key, text in texts)


def load_node_type(name: Path | str, variables: Mapping[str, Any]) -> tuple[Node, Interfaces]:
    """Return the model of a node type with a behavior, and the interfaces that it may use.

    ``name`` is a file, or the name of a node type of the project in the working directory. Raises
    TestFailure.
    """
    path = Path(name)
    if not path.suffix:
        node_types = NodeTypes.of(Project.at(Path.cwd()))
        file = node_types.find(str(name))
        if file is None:
            raise unknown(f"there is no node type '{name}'", str(name), node_types.names())
        path = file
    system, result = load_file(path, variables, {})
    if not system.node_type:
        raise TestFailure(f"{path} is a system: test it with SystemTest")
    [node] = system.nodes
    if node.implementation is not ImplementationKind.BEHAVIOR:
        kind = node.implementation.value
        raise TestFailure(f"{path} has no behavior ({kind} node): test it with SystemTest")
    reacting = (
        port.reactions or port.accept or port.feedback or port.result for port in node.ports
    )
    if node.reactions or any(reacting) or any(timer.reaction for timer in node.timers):
        raise TestFailure(f"{path} also has reactions in YAML: test it with SystemTest")
    return node, result.interfaces


class ParameterSet:
    """The parameters of a node, with the checks of its type. ``values`` is updated in place."""

    def __init__(self, node: Node, given: Mapping[str, Any]) -> None:
        """Raise TestFailure for a value that the node type does not allow, or that is missing."""
        self._node = node
        self.values: dict[str, Any] = {}
        for parameter in node.parameters:
            default = None if parameter.value is None else parameter.value.value
            value = given.get(parameter.name.value, default)
            if value is None:
                raise TestFailure(f"parameter '{parameter.name}' is required and has no value")
            self.values[parameter.name.value] = _checked(parameter, value)
        for name in given:
            self._declared(name)
        self._check_timers(self.values)

    def set(self, name: str, value: Any) -> Any:
        """Set a value and return it as the behavior sees it. Raises TestFailure."""
        parameter = self._declared(name)
        if parameter.read_only:
            raise TestFailure(f"parameter '{name}' is read-only")
        checked = _checked(parameter, value)
        self._check_timers({**self.values, name: checked})
        self.values[name] = checked
        return checked

    def _declared(self, name: str) -> Parameter:
        parameter = self._node.parameter(name)
        if parameter is None:
            names = [item.name.value for item in self._node.parameters]
            raise unknown(f"the node type has no parameter '{name}'", name, names)
        return parameter

    def _check_timers(self, values: Mapping[str, Any]) -> None:
        for timer in self._node.timers:
            try:
                timer.period.seconds(values)
            except PeriodError as error:
                raise TestFailure(f"timer '{timer.name}': {error}") from None


def _checked(parameter: Parameter, value: Any) -> Any:
    """Return a value as a behavior sees it: an integer for a double is converted."""
    name, kind = parameter.name.value, parameter.type.value
    value = list(value) if isinstance(value, tuple | bytes) else value
    problem = type_problem(value, kind)
    if problem is not None:
        raise TestFailure(f"parameter '{name}' takes {kind}, not {problem}")
    limit = range_problem(parameter, value)
    if limit is not None:
        raise TestFailure(f"parameter '{name}': {limit.message}")
    if parameter.choices is not None and value not in parameter.choices.value:
        choices = ", ".join(map(str, parameter.choices.value))
        raise TestFailure(f"parameter '{name}' must be one of: {choices}; not {value}")
    match kind:
        case ParameterType.DOUBLE:
            return float(value)
        case ParameterType.DOUBLE_ARRAY:
            return [float(item) for item in value]
        case ParameterType.BYTE_ARRAY:
            return bytes(value)
        case _:
            return value

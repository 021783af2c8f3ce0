"""``compose param``: the parameters of running nodes."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.nodes import AnyNode, NodeName
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Hidden,
    Json,
    Timeout,
    command_group,
    examples,
)
from composer.cli.support.ros import require_ros, ros_session
from composer.cli.support.terminal import (
    as_json,
    as_yaml,
    columns,
    lines,
    say,
    say_raw,
    use_color,
    write,
    write_list,
)

if TYPE_CHECKING:
    from composer.client.parameters import ParameterClient
    from composer.client.systems.local_queries import LocalParameters
    from composer.model.resolve.parameter_files import ParameterFiles
    from composer.runtime.protocol.requests import ParameterDescription

param_app = command_group("List, get and set parameters of running nodes.")

Name = Annotated[str, typer.Argument(metavar="PARAMETER")]


@contextmanager
def _parameters(node: str, timeout: float) -> Iterator[ParameterClient]:
    with ros_session("compose param", timeout) as (session, deadline):
        from composer.client.parameters import ParameterClient

        yield ParameterClient(session, deadline, node)


@contextmanager
def _readable(
    node: str, timeout: float, names: Iterable[str] = ()
) -> Iterator[ParameterClient | LocalParameters]:
    """Yield the parameters of a node: from a running system, or else from the node itself.

    Only the latter reports errors, so the former has all of ``names``.
    """
    require_ros("compose param")
    from composer.client.systems.local_queries import local_parameters

    local = local_parameters(node, timeout)
    if local is not None and local.described.keys() >= set(names):
        yield local
        return
    with _parameters(node, timeout) as parameters:
        yield parameters


@param_app.command("list", epilog=examples("compose param list planner", "compose param list"))
def list_parameters(
    node: AnyNode = None,
    *,
    hidden: Hidden = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the parameters of a node or of all nodes."""
    if node is None:
        _list_all(timeout, hidden=hidden, json=json)
        return
    with _readable(node, timeout) as parameters:
        names = parameters.names()
    if json:
        write(as_json(list(names), indent=2))
    elif names:
        write(lines(names))


def _list_all(timeout: float, *, hidden: bool, json: bool) -> None:
    names_by_node = _all_names(timeout, hidden=hidden)
    if json or not names_by_node:
        write_list("node", (), names_by_node, json=json)
        return
    for node, names in names_by_node.items():
        if names is None:
            say(
                f"{node} did not respond: its parameter services may be disabled, or it may be busy"
            )
        else:
            write(lines([f"{node}:", *(f"  {name}" for name in names)]))


def _all_names(timeout: float, *, hidden: bool) -> dict[str, list[str] | None]:
    """Return the parameters of all nodes: from running systems, or else from the ROS graph."""
    require_ros("compose param")
    from composer.client.systems.local_queries import all_local_parameters

    local = all_local_parameters(timeout, hidden=hidden)
    if local is not None:
        return {item.node: list(item.names()) for item in local}
    with ros_session("compose param", timeout) as (session, deadline):
        from composer.client.parameters import names_by_node

        return names_by_node(session, deadline, hidden=hidden)


@param_app.command("get", epilog=examples("compose param get planner max_velocity"))
def get(
    node: NodeName, name: Name, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S
) -> None:
    """Print the value of a parameter."""
    with _readable(node, timeout, [name]) as parameters:
        value = parameters.values([name])[name]
    write(as_json(value) if json else as_yaml(value))


@param_app.command(
    "set",
    epilog=examples(
        "compose param set planner max_velocity 0.5", "compose param set camera offset -1"
    ),
    context_settings={"ignore_unknown_options": True},  # negative numbers are not options
)
def set_value(
    node: NodeName,
    name: Name,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="The value, as YAML.")],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Set a parameter.

    Exit code 1 if the node rejects the value; the reason is printed.
    """
    with _parameters(node, timeout) as parameters:
        (described,) = parameters.describe([name])
        values_set = parameters.set({name: _value(described.type, value)})
    _print_values(parameters.node, values_set, json)


@param_app.command("describe", epilog=examples("compose param describe planner max_velocity"))
def describe(
    node: NodeName,
    names: Annotated[list[str], typer.Argument(metavar="PARAMETER...")],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print the type, range and description of parameters.

    With --json, the output is an object for one parameter and an array for several.
    """
    with _readable(node, timeout, names) as parameters:
        described = [_facts(found) for found in parameters.describe(names)]
    if json:
        write(as_json(described[0] if len(described) == 1 else described, indent=2))
        return
    tables = (columns([(f"{key}:", _shown(facts[key])) for key in facts]) for facts in described)
    write("\n\n".join(tables))


@param_app.command("dump", epilog=examples("compose param dump planner > planner.yaml"))
def dump(node: NodeName, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the parameters of a node as a parameter file."""
    with _readable(node, timeout) as parameters:
        values = parameters.values(parameters.names())
    content = {parameters.node: {"ros__parameters": values}}
    write(as_json(content, indent=2) if json else as_yaml(content))


@param_app.command("load", epilog=examples("compose param load planner planner.yaml"))
def load(
    node: NodeName,
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False)],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Set the parameters of a node from a parameter file.

    The file can name the node in full or with wildcards.
    """
    sections = _read(file)
    with _parameters(node, timeout) as parameters:
        values = _values_for(parameters.node, sections, parameters.names())
        if not values:
            raise CommandError(
                f"'{file}' has no parameters for {parameters.node}",
                hint=f"add them under '{parameters.node}: ros__parameters:'",
            )
        values_set = parameters.load(values)
    _print_values(parameters.node, values_set, json)


def _print_values(node: str, values: dict[str, Any], json: bool) -> None:
    """Print the values that were set; the JSON is a ROS parameter file, as with ``dump``."""
    if json:
        write(as_json({node: {"ros__parameters": values}}, indent=2))
    else:
        write(lines(f"{node} {name}: {as_json(value)}" for name, value in values.items()))


def _value(kind: str, text: str) -> Any:
    """Return a value for a type of parameters. Raises UsageError."""
    if kind == "string":
        return text
    if kind not in ("bool", "integer", "double"):
        return _yaml(text)
    from composer.language.document.parameter_files import resolve_parameter
    from composer.language.document.scalars import NumberRefused

    try:
        return resolve_parameter(text)
    except NumberRefused as error:
        raise UsageError(f"the number {error}") from error


def _yaml(text: str) -> Any:
    import yaml

    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or "it cannot be parsed"
        raise UsageError(f"'{text:.40}' is not YAML: {problem}") from error


def _read(file: Path) -> ParameterFiles:
    from composer.base.diagnostics import has_errors
    from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
    from composer.report.text import render

    sections = ParameterFiles()
    diagnostics = read_parameter_file(file, sections)
    if diagnostics:
        say_raw(render(diagnostics, color=use_color(sys.stderr)))
    if has_errors(diagnostics):
        raise CommandError(f"'{file}' is not a ROS parameter file")
    return sections


def _values_for(node: str, sections: ParameterFiles, declared: Iterable[str]) -> dict[str, Any]:
    from composer.language.tree import plain

    given = sections.given(node, frozenset(declared))
    return {name: plain(entry.value) for name, entry in given.items()}


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else as_json(value)


def _facts(found: ParameterDescription) -> dict[str, Any]:
    facts = {
        "name": found.name,
        "type": found.type,
        "description": found.description,
        "constraints": found.constraints,
        "minimum": found.minimum,
        "maximum": found.maximum,
        "step": found.step,
        "read_only": found.read_only or None,
    }
    return {name: value for name, value in facts.items() if value not in (None, "")}

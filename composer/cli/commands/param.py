"""``compose param``: the parameters of running nodes."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.failure import Failure, UsageFailure
from composer.cli.support.help import examples
from composer.cli.support.listing import Json, say_none_found
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import columns, say, use_color, write
from composer.cli.support.values import as_json, as_yaml

if TYPE_CHECKING:
    from composer.remote.parameters import Description, Parameters
    from composer.resolve.parameter_files import ParameterFiles

app = typer.Typer(
    help="See and set the parameters of running nodes.",
    epilog=examples(
        "compose param list planner",
        "compose param get planner max_velocity",
        "compose param set planner max_velocity 0.5",
        "compose param dump planner > planner.yaml",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Node = Annotated[
    str, typer.Argument(metavar="NODE", help="Its full name, or the last part of just one.")
]
Name = Annotated[str, typer.Argument(metavar="PARAMETER")]


@contextmanager
def _parameters(node: str, timeout: float) -> Iterator[Parameters]:
    with ros_session("compose param", timeout) as (session, deadline):
        from composer.remote.parameters import Parameters

        yield Parameters(session, deadline, node)


@app.command("list", epilog=examples("compose param list planner", "compose param list"))
def list_parameters(
    node: Annotated[
        str | None,
        typer.Argument(metavar="[NODE]", help="Left out: all nodes.", show_default=False),
    ] = None,
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the parameters of a node, or of all nodes."""
    if node is None:
        _list_all(json, timeout)
        return
    with _parameters(node, timeout) as parameters:
        names = parameters.names()
    if json:
        write(as_json(list(names), indent=2))
    elif names:
        write("\n".join(names))


def _list_all(json: bool, timeout: float) -> None:
    with ros_session("compose param", timeout) as (session, deadline):
        from composer.remote.parameters import names_by_node

        found = names_by_node(session, deadline)
    if json:
        write(as_json(found, indent=2))
        return
    if not found:
        say_none_found("node")
    for node, names in found.items():
        if names is None:
            say(f"{node} did not answer: its parameter services may be off, or its process busy")
        else:
            write("\n".join((f"{node}:", *(f"  {name}" for name in names))))


@app.command("get", epilog=examples("compose param get planner max_velocity"))
def get(
    node: Node, name: Name, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S
) -> None:
    """Print the value of a parameter."""
    with _parameters(node, timeout) as parameters:
        value = parameters.values([name])[name]
    write(as_json(value) if json else as_yaml(value))


@app.command("set", epilog=examples("compose param set planner max_velocity 0.5"))
def set_value(
    node: Node,
    name: Name,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="As in YAML.")],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Set a parameter. A value that the node refuses is told with its reason, exit code 1."""
    with _parameters(node, timeout) as parameters:
        (described,) = parameters.describe([name])
        taken = parameters.set({name: value if described.type == "string" else _yaml(value)})
    _print_taken(parameters.node, taken, json)


@app.command("describe", epilog=examples("compose param describe planner max_velocity"))
def describe(
    node: Node,
    names: Annotated[list[str], typer.Argument(metavar="PARAMETER...")],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print what a node says of parameters: type, bounds, meaning.

    The JSON of one is a map, that of several is a list.
    """
    with _parameters(node, timeout) as parameters:
        described = [_facts(found) for found in parameters.describe(names)]
    if json:
        write(as_json(described[0] if len(described) == 1 else described, indent=2))
        return
    tables = (columns([(f"{key}:", str(facts[key])) for key in facts]) for facts in described)
    write("\n\n".join(tables))


@app.command("dump", epilog=examples("compose param dump planner > planner.yaml"))
def dump(node: Node, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print all parameters as a ROS parameter file."""
    with _parameters(node, timeout) as parameters:
        values = parameters.values(parameters.names())
    content = {parameters.node: {"ros__parameters": values}}
    write(as_json(content, indent=2) if json else as_yaml(content))


@app.command("load", epilog=examples("compose param load planner planner.yaml"))
def load(
    node: Node,
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False)],
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Set the parameters that a ROS parameter file has for a node, by its name or by wildcards."""
    sections = _read(file)
    with _parameters(node, timeout) as parameters:
        values = _values_for(parameters.node, sections, parameters.names())
        if not values:
            raise Failure(
                f"'{file}' has nothing for {parameters.node}",
                hint=f"it would stand under '{parameters.node}: ros__parameters:'",
            )
        taken = parameters.load(values)
    _print_taken(parameters.node, taken, json)


def _print_taken(node: str, taken: dict[str, Any], json: bool) -> None:
    """Print what a node has taken; the JSON is a ROS parameter file, as that of ``dump``."""
    if json:
        write(as_json({node: {"ros__parameters": taken}}, indent=2))
    else:
        write("\n".join(f"{node} {name}: {as_json(value)}" for name, value in taken.items()))


def _yaml(text: str) -> Any:
    import yaml

    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or "it cannot be read"
        raise UsageFailure(f"'{text:.40}' is not YAML: {problem}") from error


def _read(file: Path) -> ParameterFiles:
    from composer.report.text import render
    from composer.resolve.parameter_files import ParameterFiles, read_parameter_file

    sections = ParameterFiles()
    findings = read_parameter_file(file, sections)
    if findings:
        say(render(findings, color=use_color(sys.stderr)))
        raise Failure(f"'{file}' is not a ROS parameter file")
    return sections


def _values_for(node: str, sections: ParameterFiles, declared: Iterable[str]) -> dict[str, Any]:
    from composer.tree import plain

    given = sections.given(node, frozenset(declared))
    return {name: plain(entry.value) for name, entry in given.items()}


def _facts(found: Description) -> dict[str, Any]:
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

"""``compose import``: describe existing nodes in YAML."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.new_files import write_and_say, write_output
from composer.cli.support.options import NewFile, Timeout, command_group, examples
from composer.cli.support.ros import require_launch, ros_session
from composer.cli.support.terminal import lines, say
from composer.model.names import node_name_problem

#: The name of an exception of the composer at the end of a traceback; its text says it all.
_OWN_EXCEPTION = re.compile(r"^composer\.[\w.]+: ")

import_app = command_group(
    """Describe existing nodes in YAML.

    The result is a valid file to start from: edit it, and compare it with the running nodes with
    'compose diff'.
    """
)


def _node_name(text: str) -> str:
    """Return a name that a system or a node type can have. Raises typer.BadParameter."""
    problem = node_name_problem(text)
    if problem is not None:
        raise typer.BadParameter(f"the name '{text}' {problem}.")
    return text


SystemToWrite = Annotated[
    str,
    typer.Option(
        "--system", metavar="NAME", callback=_node_name, help="Name of the system that is written."
    ),
]


@import_app.command(
    "live",
    epilog=examples(
        "compose import live",
        "compose import live --node talker --node '/perception/*'",
        "compose import live --system robot -o systems/robot.yaml",
    ),
)
def live(
    *,
    nodes: Annotated[
        list[str] | None,
        typer.Option(
            "--node",
            metavar="NODE",
            help="Only this node: a full name, the last part of a name, or a pattern. Repeatable.",
            autocompletion=complete_node,
        ),
    ] = None,
    system: SystemToWrite = "imported",
    output: NewFile = None,
    timeout: Timeout = 10.0,
) -> None:
    """Describe the nodes of the running ROS graph as a system.

    For each node: its name and namespace, topics, services and actions with types and QoS, and its
    parameters with their descriptions. The nodes are external: 'compose run' waits for them and
    observes them, but does not start or move them. Replace 'external' by 'class' or 'executable' to
    start a node with the system.

    The ROS graph does not show the depth of queues: the file has the depth of the most similar QoS
    preset.
    """
    with ros_session("compose import live", timeout) as (session, deadline):
        from composer.bridges.importing.live import describe_graph
        from composer.client.snapshot import GraphObserver

        with GraphObserver(session) as observer:
            snapshot = observer.snapshot(deadline)
            names = {node.full_name: tuple(node.parameters or ()) for node in snapshot.nodes}
            settings = observer.parameter_settings(names, deadline)
    found = describe_graph(system, snapshot, settings, _known_types(), nodes or ())
    if not found.nodes:
        matching = f" matches {', '.join(nodes)}" if nodes else " was found"
        raise CommandError(
            f"no node{matching}", hint="'compose node list' lists the nodes of the ROS graph"
        )
    from composer.bridges.importing.writing import readable, write_system

    found = readable(found)
    text = write_system(found)
    problem = why_too_large(text)
    if problem is not None:
        raise CommandError(
            f"'compose validate' would refuse the file: {problem}", hint="choose nodes with --node"
        )
    write_output(text, output)
    _report_left_out(found.left_out)


@import_app.command(
    "class",
    epilog=examples("compose import class demo_nodes_py.topics.talker:Talker -o nodes/talker.yaml"),
)
def import_class(
    reference: Annotated[
        str,
        typer.Argument(
            metavar="MODULE:CLASS", help="A class derived from rclpy's Node or LifecycleNode."
        ),
    ],
    *,
    output: NewFile = None,
) -> None:
    """Describe an rclpy node class as a node type.

    The command reads the source and runs none of its code. It declares the topics, services,
    actions and parameters that the class creates with literal names, and lists what only a running
    node would show.

    Python looks for the module in this folder, in the folders of node types, and on its module
    search path.
    """
    from composer.bridges.importing.python_class import ClassNotFound, describe_class
    from composer.bridges.importing.writing import write_node_type

    if output is not None:
        _node_name(output.stem)
    try:
        found, unknown = describe_class(reference, Path.cwd())
    except ClassNotFound as error:
        raise CommandError(str(error), hint=error.hint) from error
    type_name = found.name if output is None else output.stem
    write_output(write_node_type(type_name, found), output)
    if unknown:
        say(lines(["the source does not show:", *(f"  {text}" for text in unknown)]))
    if output is not None and not _is_found(reference, output):
        module = reference.partition(":")[0]
        say(
            f"note: the module '{module}' is not found from {output}: move it next to that file,"
            " or into a folder of node types"
        )


def _is_found(reference: str, output: Path) -> bool:
    """Return whether a node type in the file ``output`` finds the module of a class."""
    from composer.base.source import Located, SourceFile, Span
    from composer.model import BehaviorReference
    from composer.python_code.lookup import find_behavior

    span = Span(SourceFile("", reference), 1, 1)
    located = Located(reference, span)
    return find_behavior(BehaviorReference(located, output.absolute().parent)).module_found


@import_app.command(
    "launch",
    epilog=examples(
        "compose import launch robot.launch.py -o systems/robot.yaml",
        "compose import launch robot.launch.xml use_sim_time:=true --system robot",
    ),
)
def import_launch(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A launch file.")],
    arguments: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME:=VALUE]...", help="Launch arguments.")
    ] = None,
    *,
    system: SystemToWrite = "imported",
    output: NewFile = None,
    timeout: Timeout = 30.0,
) -> None:
    """Describe the nodes of a launch file as a system.

    The file is evaluated with these arguments in a separate process, as 'ros2 launch' does, but
    nothing is started. Nodes become executables, and composable nodes become components, with their
    names, namespaces, parameters, remappings, environment and restarts. Launch arguments and
    conditions are kept where possible; includes and groups are resolved. Processes that are not
    nodes, event handlers, and options that systems do not have are listed and left out.

    A program may create nodes that the launch file does not name. With --output, their parameters
    are written to a parameter file next to the system.

    Launch files do not show topics, services and actions: see 'compose import live'. The packages
    launch and launch_ros must be installed.
    """
    given = arguments or []
    for argument in given:
        if ":=" not in argument:
            raise UsageError(f"'{argument}' is not a launch argument", hint="write NAME:=VALUE")
    if not file.is_file():
        raise UsageError(f"there is no file '{file}'")
    require_launch("compose import launch")
    from composer.bridges.importing.launch_file import describe_launch_file
    from composer.bridges.importing.writing import write_parameters, write_system

    arguments_of_process = [str(file.absolute()), *given]
    what = f"evaluating '{file}'"
    text = _run_user_process(what, "composer.launch.visitor", arguments_of_process, timeout)
    found = describe_launch_file(system, str(file), given, json.loads(text))
    if not found.nodes:
        _report_left_out(found.left_out)
        raise CommandError(f"'{file}' starts no node with these arguments")
    if not found.sections or output is None:
        if found.sections:
            others = f"parameters of {', '.join(found.sections)}: with --output, a file has them"
            found = replace(found, left_out=(*found.left_out, others))
        write_output(write_system(found), output)
    else:
        name = f"{output.stem}_parameters.yaml"
        texts = {output.name: write_system(found, name), name: write_parameters(found)}
        write_and_say(output.parent, texts)
    _report_left_out(found.left_out)


def why_too_large(text: str) -> str | None:
    """Return which limit of the language the text of a system exceeds, or None."""
    from composer.language.rules import TOO_LARGE
    from composer.loading import load_bytes

    diagnostics = load_bytes(text.encode(), Path.cwd(), shown="text").diagnostics
    messages = (item.message for item in diagnostics if item.rule.code == TOO_LARGE.code)
    return next(messages, None)


def _known_types() -> set[str]:
    from composer.interfaces import Interfaces
    from composer.project import Project
    from composer.project.node_types import interface_folders

    return {*Interfaces.load(interface_folders(Project.at(Path.cwd()))).names()}


def _report_left_out(left_out: tuple[str, ...]) -> None:
    if left_out:
        say(lines(["left out:", *(f"  {text}" for text in left_out)]))


def _run_user_process(what: str, module: str, arguments: Sequence[str], timeout_s: float) -> str:
    """Run a module of the composer; return what it writes to the file that is its first argument.

    ``what`` describes it, as in "evaluating 'robot.launch.py'". The user reads before it runs that
    it will. The time limit begins again when the process touches the file ``progress`` next to its
    report. Raises CommandError with the last line of its output if it fails or takes too long.
    """
    say(f"{what}: this runs its code, with all that you may do")
    with tempfile.TemporaryDirectory(prefix="compose-") as folder:
        report = Path(folder, "report")
        process = subprocess.Popen(  # noqa: S603 - a module of this very program
            # -P: do not import modules from the current folder
            [sys.executable, "-P", "-m", module, str(report), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, "TMPDIR": folder},  # removes what it leaves behind
            text=True,
            errors="replace",
        )
        progress = Path(folder, "progress")
        while True:
            touched = progress.stat().st_mtime_ns if progress.exists() else 0
            try:
                shown, _ = process.communicate(timeout=timeout_s)
                break
            except subprocess.TimeoutExpired:
                if progress.exists() and progress.stat().st_mtime_ns != touched:
                    continue
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
                raise CommandError(
                    f"{what} did not end within {timeout_s:g} s",
                    hint="its code must not wait or spin; --timeout sets another limit",
                ) from None
        if process.returncode != 0 or not report.is_file():
            if os.environ.get("COMPOSE_DEBUG"):
                say(shown.rstrip())
            last = shown.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
            text = _OWN_EXCEPTION.sub("", last[0])
            raise CommandError(f"{what} failed: {text}", hint="COMPOSE_DEBUG=1 shows its output")
        return report.read_text(encoding="utf-8")

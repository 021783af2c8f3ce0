"""``compose doctor``: check the ROS 2 setup of this computer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.characters import counted
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, Timeout, examples
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import ShowWarnings, complete_system, runnable_system
from composer.cli.support.terminal import as_json, lines, say, write

if TYPE_CHECKING:
    from composer.client.doctor import CheckResult
    from composer.model import System

EPILOG = examples(
    "compose doctor",
    "compose doctor robot.yaml   check the discovery of a system as well",
    "compose doctor --json",
    "compose doctor --strict     treat warnings as errors, for CI",
)
_RETRY = "fix the errors above, then run 'compose doctor' again"
_LEVEL_WIDTH, _AREA_WIDTH = 7, 11


def doctor(
    system: Annotated[
        str | None,
        typer.Argument(
            metavar="[SYSTEM]",
            help="Check the discovery of this system too: its file or name.",
            autocompletion=complete_system,
        ),
    ] = None,
    arguments: Arguments = None,
    *,
    strict: Annotated[bool, typer.Option("--strict", help="Treat warnings as errors.")] = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Check the ROS 2 setup and the ROS graph.

    The command checks versions, environment variables, the network, discovery, interface packages,
    and the types and QoS policies of running nodes. Each problem is reported with a remedy. Without
    ROS, the ROS graph is not checked.

    With a system, the command uses and checks its 'discovery': addresses, interfaces, and whether
    nodes discover each other through the server. If necessary, it starts the server for this check.

    Exit code 1 if there are errors, or warnings with --strict.
    """
    from composer.client.doctor import Level

    results = []
    declared = (
        None
        if system is None
        else runnable_system(system, arguments, warnings=ShowWarnings.NONE).system
    )
    for result in _check_all(declared, timeout):
        results.append(result)
        if not json:
            write(result_text(result))
    if json:
        write(as_json([asdict(result) for result in results], indent=2))
    errors, warnings = (
        sum(result.level is level for result in results) for level in (Level.ERROR, Level.WARNING)
    )
    say(f"{counted(errors, 'error')}, {counted(warnings, 'warning')}")
    if errors or (strict and warnings):
        raise typer.Exit(FAILED)


def _check_all(system: System | None, timeout: float) -> Iterator[CheckResult]:
    from composer.client.doctor import Level, note
    from composer.client.doctor.installation import (
        check_environment,
        check_versions,
        discovery_range,
    )
    from composer.client.doctor.network import check_declared_discovery, check_network
    from composer.runtime.middleware.environment import complete_environment, use_discovery
    from composer.runtime.middleware.local_resources import SHARED_MEMORY

    yield from check_versions()
    if system is not None and system.discovery is not None:
        yield from check_declared_discovery(system.discovery, os.environ)
        use_discovery(system.discovery, os.environ)
    variables = dict(os.environ)
    complete_environment(variables)
    environment = list(check_environment(variables))
    yield from environment
    reach = discovery_range(os.environ)
    # With LOCALHOST, rmw_fastrtps selects the transports itself, including shared memory.
    transports = os.environ.get("FASTDDS_BUILTIN_TRANSPORTS")
    uses_shared_memory = reach == "LOCALHOST" or transports != "UDPv4"
    if os.environ.get("ROS_DISCOVERY_SERVER"):
        reach = "server"  # neither multicast nor interfaces matter
    yield from check_network(reach, shared_memory=SHARED_MEMORY if uses_shared_memory else None)
    yield from _check_interfaces(system)
    if any(result.level is Level.ERROR for result in environment):
        yield note("graph", "not checked: the environment does not let ROS start", _RETRY)
    elif find_spec("rclpy") is None:
        yield note("graph", "not checked: rclpy is not installed", _RETRY)
    else:
        with _started_server(system):
            yield from _check_live_graph(timeout)


def _started_server(system: System | None) -> AbstractContextManager[None]:
    """Return a block with the discovery server that 'compose run' would start."""
    from composer.client.doctor.network import starts_server
    from composer.runtime.children.discovery_server import discovery_servers

    discovery = None if system is None else system.discovery
    if discovery is None or not starts_server(discovery, os.environ):
        return nullcontext()
    return discovery_servers(discovery, os.environ, lambda *_: None)


def _check_interfaces(system: System | None) -> Iterator[CheckResult]:
    """Check the interface packages of the project, and those that the system uses."""
    from composer.client.doctor.installation import check_interfaces
    from composer.interfaces import Interfaces
    from composer.interfaces.sources import find_packages
    from composer.project import Project
    from composer.project.node_types import interface_folders

    project = Project.at(Path.cwd())
    folders = interface_folders(project)  # with those of the examples
    nodes = () if system is None else system.nodes
    used = {
        port.interface.value.partition("/")[0] for node in nodes for port in node.all_ports
    } & find_packages(folders).packages()
    own = find_packages(project.interface_folders).packages()
    yield from check_interfaces(own | used, Interfaces.load(folders), Interfaces.load())


def _check_live_graph(timeout: float) -> Iterator[CheckResult]:
    from composer.client.doctor import error

    try:
        with ros_session("compose doctor", timeout, carries_messages=True) as (session, deadline):
            from composer.client.doctor.graph import (
                check_delivery,
                check_discovery,
                check_graph,
                check_middleware,
            )

            yield check_middleware()
            yield check_delivery(session)
            yield check_discovery(session, deadline)
            yield from check_graph(session, deadline)
    except CommandError as problem:
        yield error("middleware", problem.message, problem.hint or _RETRY)
    except (ImportError, RuntimeError) as problem:  # rclpy's own errors are RuntimeErrors
        yield error(
            "middleware",
            f"ROS does not start: {problem}",
            'reinstall it (pip install --force-reinstall "ros2-composer[ros]"), or source'
            " /opt/ros/jazzy/setup.bash in a new terminal, but not both",
        )


def result_text(result: CheckResult) -> str:
    """Return what a check has found, with its remedy."""
    head = f"{result.level.value:<{_LEVEL_WIDTH}}  {result.area:<{_AREA_WIDTH}}  "
    remedy = () if result.remedy is None else (f"{' ' * len(head)}-> {result.remedy}",)
    return lines([head + result.message, *remedy])

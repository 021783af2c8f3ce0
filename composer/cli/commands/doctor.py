"""``compose doctor``: what keeps ROS 2 from working here, each with its remedy."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import FINDINGS
from composer.cli.support.help import examples
from composer.cli.support.listing import Json
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import say, write
from composer.cli.support.values import as_json

if TYPE_CHECKING:
    from composer.doctor.finding import Finding, Level

EPILOG = examples(
    "compose doctor",
    "compose doctor --json",
    "compose doctor --strict                     in CI: warnings count, too",
)
_SEE_ABOVE = "do what is said above, then run this again"
_LEVEL_WIDTH, _AREA_WIDTH = 7, 11


def doctor(
    *,
    strict: Annotated[bool, typer.Option("--strict", help="Warnings count as errors do.")] = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Look at the environment, the network, versions and the live ROS graph.

    It finds nodes that cannot meet, publishers and subscriptions whose QoS or type does not fit,
    interfaces that are not built; and says what to do. Without ROS it looks at the rest.

    Exit code 1 when there is an error (with --strict: or a warning).
    """
    from composer.doctor.finding import Level

    found = []
    for finding in _findings(timeout):
        found.append(finding)
        if not json:
            write(_text(finding))
    if json:
        write(as_json([asdict(finding) for finding in found], indent=2))
    errors, warnings = (_count(found, level) for level in (Level.ERROR, Level.WARNING))
    say(f"{_counted(errors, 'error')}, {_counted(warnings, 'warning')}")
    if errors or (strict and warnings):
        raise typer.Exit(FINDINGS)


def _findings(timeout: float) -> Iterator[Finding]:
    from composer.doctor.environment import discovery_range, look_at_environment
    from composer.doctor.finding import Level, note
    from composer.doctor.network import look_at_network
    from composer.doctor.versions import look_at_versions
    from composer.report.tool import tool_version
    from composer.runtime.process.environment import complete_environment
    from composer.runtime.process.shared_memory import SHARED_MEMORY

    yield from look_at_versions(tool_version())
    variables = dict(os.environ)
    complete_environment(variables)
    environment = list(look_at_environment(variables))
    yield from environment
    reach = discovery_range(os.environ)
    # For LOCALHOST rmw_fastrtps chooses the transports itself, shared memory among them.
    transports = os.environ.get("FASTDDS_BUILTIN_TRANSPORTS")
    uses_shared_memory = reach == "LOCALHOST" or transports != "UDPv4"
    yield from look_at_network(reach, shared_memory=SHARED_MEMORY if uses_shared_memory else None)
    yield from _interface_findings()
    if any(finding.level is Level.ERROR for finding in environment):
        yield note("graph", "not looked at: the environment does not let ROS start", _SEE_ABOVE)
    elif find_spec("rclpy") is None:
        yield note("graph", "not looked at: that needs rclpy", _SEE_ABOVE)
    else:
        yield from _live_findings(timeout)


def _interface_findings() -> Iterator[Finding]:
    from composer.doctor.interfaces import look_at_interfaces
    from composer.interfaces import Interfaces
    from composer.interfaces.sources import find_packages
    from composer.node_types import interface_folders
    from composer.project import Project

    folders = interface_folders(Project.at(Path.cwd()))
    yield from look_at_interfaces(
        find_packages(folders).packages(), Interfaces.load(folders), Interfaces.load()
    )


def _live_findings(timeout: float) -> Iterator[Finding]:
    from composer.doctor.finding import error

    try:
        with ros_session("compose doctor", timeout, carries_messages=True) as (session, deadline):
            from composer.doctor.graph import (
                look_at_delivery,
                look_at_discovery,
                look_at_graph,
                look_at_middleware,
            )

            yield look_at_middleware()
            yield look_at_delivery(session)
            yield look_at_discovery(session, deadline)
            yield from look_at_graph(session, deadline)
    except (ImportError, RuntimeError) as problem:  # rclpy's own errors are RuntimeErrors
        yield error(
            "middleware",
            f"ROS does not start: {problem}",
            'install it anew (pip install --force-reinstall "ros2-composer[ros]"), or source'
            " /opt/ros/jazzy/setup.bash in a new terminal; not both",
        )


def _text(finding: Finding) -> str:
    head = f"{finding.level.value:<{_LEVEL_WIDTH}}  {finding.area:<{_AREA_WIDTH}}  "
    line = head + finding.message
    return line if finding.remedy is None else f"{line}\n{' ' * len(head)}-> {finding.remedy}"


def _count(found: list[Finding], level: Level) -> int:
    return sum(finding.level is level for finding in found)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"

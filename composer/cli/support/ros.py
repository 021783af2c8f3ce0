"""What commands that need ROS share: checks before the start, and a session in the ROS graph."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from composer.cli.support.errors import CONFIG, CommandError
from composer.cli.support.terminal import keep_stdout_for_data, say

if TYPE_CHECKING:
    from composer.client.session import Deadline, Session
    from composer.model import System
    from composer.runtime.protocol.requests import NameAndTypes


def require_ros(command: str, system: System | None = None) -> None:
    """Raise CommandError if rclpy is not installed or the environment does not let ROS start.

    Call it before anything imports rclpy, which may end the process. It sets what this process
    needs to discover other nodes: as ``system`` declares it, or else as the systems that run on
    this computer do.
    """
    if find_spec("rclpy") is None:
        raise CommandError(
            f"'{command}' needs ROS 2, and rclpy is not installed in this Python",
            hint='pip install "ros2-composer[ros]"   or: source /opt/ros/jazzy/setup.bash',
        )
    keep_stdout_for_data()
    gc.freeze()  # what is there now is not garbage
    gc.enable()
    from composer.runtime.middleware.environment import adopt_discovery, prepare_environment
    from composer.runtime.process import StartRefused

    try:
        prepare_environment(None if system is None else system.discovery)
    except StartRefused as refusal:
        raise CommandError(str(refusal), hint=refusal.hint) from refusal
    warning = adopt_discovery(os.environ) if system is None else None
    if warning is not None:
        say(f"warning: {warning}")


def announce_discovery(system: System) -> None:
    """Print what other tools of ROS need to discover the system, if that is not the default."""
    from composer.runtime.middleware.environment import as_assignments, discovery_conflict

    if system.discovery is None:
        return
    conflict = discovery_conflict(system.discovery, os.environ)
    variables = system.discovery.variables
    if conflict is not None:
        say(f"warning: {conflict}")
    elif variables:
        say(f"to discover this system with other tools: export {as_assignments(variables)}")


def require_launch(command: str) -> None:
    """Raise CommandError if launch or launch_ros is not installed."""
    require_ros(command)
    for package in ("launch", "launch_ros"):
        if find_spec(package) is None:
            raise CommandError(
                f"'{command}' needs {package}, which is not installed in this Python",
                hint="it is part of ROS 2: source /opt/ros/jazzy/setup.bash",
            )


def require_interfaces(system: System) -> None:
    """Raise CommandError if Python lacks an interface package that a port of the system uses."""
    from composer.model.interface_packages import how_to_build, used_packages

    for package, node in used_packages(system).items():
        if find_spec(package) is None:
            raise CommandError(
                f"interface package '{package}' of node '{node.name}' is not installed for"
                " this Python",
                hint=how_to_build(package, _interface_sources().get(package)),
                exit_code=CONFIG,
            )


def require_modules(system: System) -> None:
    """Import the classes of the system's own nodes; raise CommandError if a module is missing.

    What else an import raises is reported when the node is configured.
    """
    from composer.model.interface_packages import how_to_build, how_to_get

    for node in system.nodes:
        if node.hosted_class is None or not node.in_process:
            continue
        from composer.runtime.hosting.hosted_node import missing_module

        missing = missing_module(node.hosted_class.reference)
        if missing is not None:
            package = missing.partition(".")[0]
            source = _interface_sources().get(package)
            raise CommandError(
                f"class '{node.hosted_class.reference.text}' of node '{node.name}' imports"
                f" '{missing}', which is not installed for this Python",
                hint=how_to_get(missing) if source is None else how_to_build(package, source),
                exit_code=CONFIG,
            )


def _interface_sources() -> Mapping[str, Path]:
    """Return the folders of the project's interface packages, by name."""
    from composer.interfaces.sources import find_packages
    from composer.project import Project
    from composer.project.node_types import interface_folders

    return find_packages(interface_folders(Project.at(Path.cwd()))).folders


@contextmanager
def ros_session(
    command: str, timeout_s: float, *, carries_messages: bool = False
) -> Iterator[tuple[Session, Deadline]]:
    """Join the ROS graph for the length of a ``with`` block; a RosError becomes a CommandError.

    What is not valid in the graph is skipped, and a warning is printed at the end.

    Set ``carries_messages`` if the command publishes or subscribes to topics: messages may be
    large.
    """
    require_ros(command)
    from composer.client.session import Deadline, RosError, Session, use_command_profile

    if not carries_messages:
        use_command_profile()
    deadline = Deadline(timeout_s)
    try:
        with Session() as session:
            try:
                yield session, deadline
            finally:
                _warn_of_skipped(session)
    except RosError as error:
        raise CommandError(str(error), hint=error.hint) from error


def graph_names(
    command: str, kind: str, timeout_s: float, *, hidden: bool = False
) -> tuple[NameAndTypes, ...]:
    """Return the names of all nodes, topics, services or actions in the ROS graph, and their types.

    A running system on this computer answers at once; without one, join the ROS graph.
    """
    require_ros(command)
    from composer.client.systems.local_queries import local_names

    found = local_names(kind, timeout_s, hidden=hidden)
    if found is not None:
        return found
    with ros_session(command, timeout_s) as (session, deadline):
        from composer.client.graph_names import GraphNames

        return GraphNames(session, deadline).names(kind, hidden=hidden)


def _warn_of_skipped(session: Session) -> None:
    from composer.base.characters import visible

    for warning in session.graph.skipped.warnings():
        say(f"warning: {visible(warning)}")

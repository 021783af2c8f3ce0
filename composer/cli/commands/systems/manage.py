"""``compose up``, ``down``, ``pause``, ``resume`` and ``reset``: commands to a running system."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.hosts import (
    check_workspaces,
    load_for_hosts,
    process_logs,
    reported_problems,
    require_hosts,
)
from composer.cli.support.options import (
    AllOrNothing,
    AutostartTo,
    LogLevelOption,
    Namespace,
    Settings,
    Timeout,
    UseSimTime,
    examples,
    options_of_run,
)
from composer.cli.support.output.terminal import lines, say, write
from composer.cli.support.process import compose_command
from composer.cli.support.ros import require_ros, ros_session
from composer.cli.support.system_arguments import RunningSystem, running_system_name

if TYPE_CHECKING:
    from composer.loading import LoadResult
    from composer.model import System

#: As long as a transition may take by default, with a margin.
_TIMEOUT_S = 15.0
_ALL_OR_NOTHING = ("--all-or-nothing",)
_HINT = "see the log of the system; 'compose ps' shows the state of every node"


def _epilog(command: str, note: str = "") -> str:
    first = f"compose {command} pipeline"
    return examples(
        f"{first}{note.rjust(len(note) + 10)}" if note else first,
        f"compose {command} systems/pipeline.yaml",
        f"compose {command} /robot1/pipeline",
    )


EPILOGS = {
    "up": examples(
        "compose up pipeline               after 'compose reset' or 'compose run --autostart ...'",
        "compose up /robot1/pipeline",
        "compose up robot.yaml --hosts     start it here and on its other computers",
        "compose up robot.yaml --hosts --set planner.max_velocity=0.5",
    ),
    "down": _epilog("down"),
    "pause": _epilog("pause"),
    "resume": _epilog("resume"),
    "reset": _epilog("reset", "then: compose up pipeline"),
}


def up(
    system: RunningSystem,
    *,
    hosts: Annotated[
        bool,
        typer.Option(
            "--hosts", help="Start the system, and its processes on other computers, by ssh."
        ),
    ] = False,
    settings: Settings = None,
    namespace: Namespace = None,
    use_sim_time: UseSimTime = False,
    autostart: AutostartTo = None,
    log_level: LogLevelOption = None,
    all_or_nothing: AllOrNothing = False,
    timeout: Timeout = _TIMEOUT_S,
) -> None:
    """Bring up the nodes of a running system.

    Each node is brought up to its autostart state. If a node fails, its 'on_failure' applies, and
    the cause is reported. Nodes that failed before are retried. Use 'compose run' to start the
    process of a system.

    YAML and parameter files are not read again. To apply changes, restart the system: 'compose
    down', then 'compose run'.

    With --hosts, nothing needs to run: the system is started in the foreground, with each process
    on its computer, until Ctrl-C. Versions, interfaces and files of all computers must be the same.
    The options of 'compose run' apply to all processes.
    """
    start = options_of_run(
        settings or (), namespace, autostart, log_level, use_sim_time=use_sim_time
    )
    if hosts:
        require_hosts("compose up --hosts")
        loaded = load_for_hosts(system, settings or (), namespace, use_sim_time=use_sim_time)
        _up_on_hosts(loaded, [*start, *_ALL_OR_NOTHING] if all_or_nothing else start)
        return
    if start:
        raise UsageError(
            f"{start[0]} needs --hosts: without it, 'compose up' starts no system",
            hint="give it to 'compose run'",
        )
    service = _service("startup", all_or_nothing=all_or_nothing)
    _command("up", service, system, timeout, failure="did not come up")


def down(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Shut down a running system and its process.

    The nodes are shut down in the reverse order of the bring-up.
    """
    name = running_system_name(system)
    with ros_session("compose down", timeout) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        message = systems.shut_down(found)
    write(lines([f"{found}: {message}"]))


def pause(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Deactivate all nodes of a running system.

    The nodes are deactivated in the reverse order of the bring-up.
    """
    _command("pause", "pause", system, timeout, failure="did not pause")


def resume(
    system: RunningSystem,
    *,
    all_or_nothing: AllOrNothing = False,
    timeout: Timeout = _TIMEOUT_S,
) -> None:
    """Activate the inactive nodes of a running system.

    The nodes are activated in the order of the bring-up.
    """
    service = _service("resume", all_or_nothing=all_or_nothing)
    _command("resume", service, system, timeout, failure="did not resume")


def reset(system: RunningSystem, timeout: Timeout = _TIMEOUT_S) -> None:
    """Reset all nodes of a running system.

    All nodes return to the state unconfigured, and failures are cleared. Use 'compose up' to bring
    them up again.

    Parameters keep their values, and YAML and parameter files are not read again. To apply
    changes, restart the system: 'compose down', then 'compose run'.
    """
    _command("reset", "reset", system, timeout, failure="did not reset")


def _service(name: str, *, all_or_nothing: bool) -> str:
    from composer.runtime.ros.manager_protocol import ALL_OR_NOTHING

    return f"{name}{ALL_OR_NOTHING}" if all_or_nothing else name


def _command(command: str, service: str, text: str, timeout_s: float, *, failure: str) -> None:
    """Call a service of the manager of a system and print its response. Raises CommandError."""
    name = running_system_name(text)
    with ros_session(f"compose {command}", timeout_s) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        found = systems.find(name)
        success, message = systems.command(found, service)
    if not success:
        raise CommandError(f"{found} {failure}: {message}", hint=_HINT)
    write(lines([f"{found}: {message}"]))


def _up_on_hosts(loaded: tuple[LoadResult, System, Path], start: Sequence[str]) -> None:
    """Start a system on all its computers, each process with the options ``start``.

    Raises CommandError, typer.Exit.
    """
    result, system, relative = loaded
    require_ros("compose up --hosts", system)
    from composer.client.hosts.deployment import DeploymentOptions
    from composer.client.hosts.start import remote_processes, run_on_hosts
    from composer.client.hosts.used_files import question_about

    processes = remote_processes(system)
    check_workspaces([item.host for item in processes])
    question = question_about(system, result.project.root / relative, result.project)
    with reported_problems(), process_logs(system, processes) as log:
        root = result.project.root
        options = DeploymentOptions(root, str(relative), start, compose_command(), say, log)
        code = run_on_hosts(processes, options, question)
    if code:
        raise typer.Exit(code)

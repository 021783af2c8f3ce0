"""``compose hosts``: run a system on several computers."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.characters import counted
from composer.cli.support.errors import CONFIG, FAILED, CommandError, UsageError
from composer.cli.support.hosts import (
    check_workspaces,
    files_to_copy,
    load_for_hosts,
    process_logs,
    reported_problems,
    require_hosts,
    write_staying,
)
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import (
    START_OPTIONS,
    AllOrNothing,
    AutostartTo,
    LogLevelOption,
    Namespace,
    Settings,
    UseSimTime,
    command_group,
    examples,
    given_options,
)
from composer.cli.support.process import compose_command
from composer.cli.support.ros import require_ros
from composer.cli.support.system_arguments import ShowWarnings, SystemName, runnable_system
from composer.cli.support.terminal import lines, say, write
from composer.model.names import PROGRAM_LOGGER

if TYPE_CHECKING:
    from composer.model import Discovery, Host

_POLL_S = 0.02

hosts_app = command_group(
    """Run a system on several computers.

    The system declares its 'hosts', and which process runs on which host.
    """
)


@hosts_app.command(
    "run",
    epilog=examples(
        "compose hosts run robot.yaml",
        "compose hosts run robot.yaml --set planner.max_velocity=0.5",
    ),
)
def run(
    context: typer.Context,
    system: SystemName,
    arguments: Arguments = None,
    *,
    settings: Settings = None,
    namespace: Namespace = None,
    use_sim_time: UseSimTime = False,
    autostart: AutostartTo = None,  # noqa: ARG001 - given_options passes them on
    log_level: LogLevelOption = None,  # noqa: ARG001
    all_or_nothing: AllOrNothing = False,  # noqa: ARG001
) -> None:
    """Run a system on all of its hosts.

    Processes on other computers are started by ssh. The system runs in the foreground until Ctrl-C.
    Versions, interfaces and files of all computers
    must be the same. The options apply to all processes.
    """
    require_hosts("compose hosts run")
    result, declared, relative = load_for_hosts(
        system, arguments, settings=settings, namespace=namespace, use_sim_time=use_sim_time
    )
    require_ros("compose hosts run", declared)
    from composer.client.hosts.deployment import DeploymentOptions
    from composer.client.hosts.start import question_about, remote_processes, run_on_hosts

    options = given_options(context, (*START_OPTIONS, "all_or_nothing"))
    start = [*declared.arguments, *options]
    processes = remote_processes(declared)
    check_workspaces([item.host for item in processes])
    question = question_about(declared, result.project.root / relative, result.project)
    with reported_problems(), process_logs(declared, processes) as log:
        root = result.project.root
        deployment = DeploymentOptions(root, str(relative), start, compose_command(), say, log)
        code = run_on_hosts(processes, deployment, question)
    if code:
        raise typer.Exit(code)


@hosts_app.command(
    "sync",
    epilog=examples(
        "compose hosts sync systems/robot.yaml",
        "compose hosts sync robot --dry-run               list what would be copied",
        "compose hosts sync robot --host jetson --delete  remove files that are not in the project",
    ),
)
def sync(
    system: SystemName,
    arguments: Arguments = None,
    *,
    names: Annotated[
        list[str] | None,
        typer.Option(
            "--host",
            metavar="NAME",
            help="Only to this host. Repeatable.",
            show_default="all hosts of the system",
        ),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="List the files that would be copied, deleted or left."),
    ] = False,
    delete: Annotated[
        bool,
        typer.Option(
            "--delete", help="Delete files in the workspaces that are not in the project."
        ),
    ] = False,
) -> None:
    """Copy the project to the hosts of a system.

    Copies the folder of the project to the workspace of each host, with rsync over ssh, except for
    environments, builds, logs, .git, private keys, .env files, and what .gitignore or .dockerignore
    exclude. The command writes only to the workspaces, and refuses a folder with files that it has
    not copied.
    """
    require_hosts("compose hosts sync", "rsync", "ssh")
    result, declared, _ = load_for_hosts(system, arguments)
    from composer.client.hosts.start import sync_hosts
    from composer.client.hosts.sync import SyncOptions
    from composer.runtime.process.computer import is_this_computer

    root = result.project.root
    others = [host for host in declared.hosts if not is_this_computer(host.address.value)]
    chosen = _chosen(others, names or [], declared.name.value)
    check_workspaces(chosen)
    files = files_to_copy(declared, root)
    if dry_run:
        write_staying(files)
    with reported_problems():
        sync_hosts(
            chosen,
            SyncOptions(root, delete, dry_run, files.rsync_patterns),
            lambda host, changes: _report(host, changes, dry_run=dry_run),
        )


def _chosen(hosts: list[Host], names: list[str], system: str) -> list[Host]:
    from composer.base.diagnostics import suggestion

    by_name = {host.name.value: host for host in hosts}
    for name in names:
        if name not in by_name:
            hint = suggestion(name, list(by_name))
            raise UsageError(f"'{name}' is not another host of system '{system}'", hint=hint)
    if not hosts:
        raise CommandError(f"all hosts of system '{system}' are this computer")
    return [by_name[name] for name in dict.fromkeys(names)] if names else hosts


def _report(host: Host, changes: Sequence[str], *, dry_run: bool) -> None:
    if dry_run:
        words = {"send": "copy", "del.": "delete"}
        for change in changes:
            what, _, name = change.partition(" ")
            write(lines([f"{host.name}: {words.get(what, what)} {name}"]))
    deleted = sum(change.startswith("del.") for change in changes)
    copied = len(changes) - deleted
    verb = "would be " if dry_run else ""
    parts = [f"{counted(copied, 'file')} {verb}copied"] if copied else []
    parts += [f"{counted(deleted, 'file')} {verb}deleted"] if deleted else []
    write(lines([f"{host.name}: {', '.join(parts) or 'up to date'}"]))


@hosts_app.command(
    "discovery-server",
    epilog=examples(
        "compose hosts discovery-server robot            until Ctrl-C",
        "compose hosts discovery-server robot --ready    does it run?",
    ),
)
def discovery_server(
    system: SystemName,
    arguments: Arguments = None,
    *,
    ready: Annotated[
        bool,
        typer.Option(
            "--ready", help="Start nothing; exit with 0 if the server runs here, with 1 if not."
        ),
    ] = False,
) -> None:
    """Run the discovery server of a system.

    With 'start: true', 'compose run' starts the discovery server of Fast DDS, or uses a server that
    already runs. This command runs the server on its own, so that it does not end with the system,
    and restarts it if it ends. If the system has several servers, the command runs those with an
    address of this computer.
    """
    discovery = _discovery(system, arguments)
    if ready:
        if not _is_running(discovery):
            say(f"no discovery server runs here at {_listed(discovery)}")
            raise typer.Exit(FAILED)
        return
    _run_server(discovery)


def _discovery(text: str, arguments: list[str] | None) -> Discovery:
    """Return the discovery of a system, with servers to be started. Raises CommandError."""
    from composer.model import DiscoveryKind

    system = runnable_system(text, arguments, warnings=ShowWarnings.NONE, exit_code=CONFIG).system
    discovery = system.discovery
    if discovery is None or discovery.kind.value is not DiscoveryKind.SERVER:
        raise CommandError(
            f"system '{system.name}' uses no discovery server",
            hint="set 'discovery: {kind: server, address: ...}'",
            exit_code=CONFIG,
        )
    return replace(discovery, start=True)


def _run_server(discovery: Discovery) -> None:
    """Run the servers until a signal. Raises CommandError."""
    from composer.model import LogLevel
    from composer.runtime.children.discovery_server import discovery_servers
    from composer.runtime.clock import COMPUTER
    from composer.runtime.process import StartRefused
    from composer.runtime.process.signals import (
        READY,
        STOPPING,
        ServiceManager,
        WakeupSocket,
        stop_signals,
    )

    require_ros("compose hosts discovery-server")
    manager, wakeup = ServiceManager(), WakeupSocket(COMPUTER)
    received: list[str] = []

    def stop(name: str) -> None:
        received.append(name)
        wakeup.wake()

    def is_stopping(until_s: float) -> bool:
        while not received and wakeup.wait(until_s):
            pass
        return bool(received)

    def write_log(level: LogLevel, logger: str, text: str) -> None:
        say(f"[{level.upper()}] [{logger}] {text}")

    servers = discovery_servers(discovery, os.environ, write_log, is_stopping, shared=False)
    try:
        with stop_signals(stop, wakeup, ends_process=True), servers:
            while not received and not _is_running(discovery):
                wakeup.wait(time.monotonic() + _POLL_S)
            if not received:
                write_log(LogLevel.INFO, PROGRAM_LOGGER, f"running at {_listed(discovery)}")
                manager.send(READY)
            while not received:
                wakeup.wait()
            manager.send(STOPPING)
    except StartRefused as refusal:
        raise CommandError(str(refusal), hint=refusal.hint) from refusal


def _is_running(discovery: Discovery) -> bool:
    """Return whether all servers with addresses of this computer run, and there is one."""
    from composer.runtime.process.computer import PortState, port_state, resolve

    states = []
    for host, port in discovery.servers:
        address = resolve(host)
        states.append(PortState.UNKNOWN if address is None else port_state(address, port))
    return PortState.IN_USE in states and PortState.FREE not in states


def _listed(discovery: Discovery) -> str:
    return ", ".join(f"{host}:{port}" for host, port in discovery.servers)

"""What commands do with hosts, as one call each: compare, start and end, copy."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import AsyncExitStack
from pathlib import Path

from composer.base.source import SourceFile
from composer.client.hosts.check import HostsDiffer, compare_all, connect_all
from composer.client.hosts.connection import HostError
from composer.client.hosts.deployment import Deployment, DeploymentOptions, RemoteProcess
from composer.client.hosts.inventory import Question, take_inventory
from composer.client.hosts.sync import SyncOptions, copy_project, prepare_workspace
from composer.model import BehaviorReference, Executable, Host, Process, System
from composer.project import SETTINGS_FILE, Project
from composer.python_code.lookup import find_behavior
from composer.runtime.process.computer import is_this_computer
from composer.runtime.process.signals import STOP_SIGNALS

_LONGEST_NAME = 256  # of a file, for Linux


def question_about(system: System, path: Path, project: Project) -> Question:
    """Return what other computers must have in common with this one to run the system in ``path``.

    The files are those of the project: YAML, parameters, Python code, programs and settings. What
    is installed is compared by its version.
    """
    names = {
        str(found.resolve().relative_to(project.root))
        for found in (path, *_files(system, project))
        if project.holds(found) and found.is_file()
    }
    interfaces = {port.interface.value for node in system.nodes for port in node.all_ports}
    return Question(tuple(sorted(names)), tuple(sorted(interfaces)))


def _files(system: System, project: Project) -> Iterator[Path]:
    for source in _sources(system):
        yield Path(source.path)
    for node in system.nodes:
        yield from node.type_files
        if node.executable is not None:
            yield from _words_of(node.executable)
    seen: set[tuple[str, Path]] = set()
    for reference in _references(system):
        key = (reference.text.value, reference.folder)
        if key not in seen:
            seen.add(key)
            yield from (module.path for module in find_behavior(reference).own_modules)
    yield project.root / SETTINGS_FILE


def _words_of(executable: Executable) -> Iterator[Path]:
    """Yield the words of the command of a program, as files: a script may be any of them."""
    folder = executable.folder
    if executable.working_directory is not None:
        folder /= executable.working_directory.value
    for word in executable.command:
        if len(word.value) < _LONGEST_NAME:
            yield folder / word.value


def _sources(system: System) -> Iterator[SourceFile]:
    """Yield the YAML files in which something of the system is written."""
    spans = [node.span for node in system.nodes]
    spans += [process.span for process in system.processes]
    spans += [host.span for host in system.hosts]
    spans += [executor.span for executor in system.executors]
    yield from {system.source, *system.parameter_files, *(span.file for span in spans)}


def _references(system: System) -> Iterator[BehaviorReference]:
    for node in system.nodes:
        if node.behavior is not None:
            yield node.behavior
        if node.hosted_class is not None:
            yield node.hosted_class.reference


def remote_processes(system: System) -> tuple[RemoteProcess, ...]:
    """Return the processes of a system that belong to other computers."""
    hosts = {host.name.value: host for host in system.hosts}
    return tuple(
        RemoteProcess(process, hosts[process.host.value], _nodes(system, process))
        for process in system.processes
        if process.host is not None
        and not is_this_computer(hosts[process.host.value].address.value)
    )


def _nodes(system: System, process: Process) -> tuple[str, ...]:
    """Return the full names of the nodes of a process."""
    return tuple(
        node.full_name
        for node in system.nodes
        if node.process is not None and node.process.value == process.name.value
    )


def run_on_hosts(
    processes: Sequence[RemoteProcess], options: DeploymentOptions, question: Question
) -> int:
    """Compare all hosts, start everything, and return the exit code of the system at its end.

    Raises HostsDiffer.
    """

    async def run() -> int:
        async with AsyncExitStack() as stack:
            hosts = list({item.host.name.value: item.host for item in processes}.values())
            connections = await connect_all(hosts, options.root, stack)
            here = take_inventory(options.root, question)
            await compare_all(hosts, connections, question, here)
            deployment = Deployment(processes, options)
            loop = asyncio.get_running_loop()
            for number in STOP_SIGNALS:
                loop.add_signal_handler(number, deployment.end)
            try:
                return await deployment.run(connections)
            except HostError as error:
                raise HostsDiffer([(str(error), error.hint)]) from error

    return asyncio.run(run())


def sync_hosts(
    hosts: Sequence[Host], options: SyncOptions, report: Callable[[Host, Sequence[str]], None]
) -> None:
    """Copy the project to all hosts, one after the other; nothing if one of them is not ready.

    Raises HostsDiffer.
    """

    async def run() -> None:
        async with AsyncExitStack() as stack:
            connections = await connect_all(hosts, options.root, stack)
            try:
                targets = [
                    await prepare_workspace(
                        host, connections[host.name.value], dry_run=options.dry_run
                    )
                    for host in hosts
                ]
                for host, target in zip(hosts, targets, strict=True):
                    report(host, await asyncio.to_thread(copy_project, host, target, options))
            except HostError as error:
                raise HostsDiffer([(str(error), error.hint)]) from error

    asyncio.run(run())

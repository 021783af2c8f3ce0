"""What commands do with hosts, as one call each: connect and compare, start and end, copy."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AsyncExitStack
from enum import Enum
from pathlib import Path

import asyncssh

from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile
from composer.client.hosts.connection import (
    HostError,
    HostsError,
    Problem,
    connect,
    failure_of,
    load_keys,
    run_command,
    shown,
)
from composer.client.hosts.deployment import Deployment, DeploymentOptions, RemoteProcess
from composer.client.hosts.inventory import (
    Inventory,
    Question,
    read_answer,
    take_inventory,
    written_question,
)
from composer.client.hosts.remote_command import python_command
from composer.client.hosts.sync import SyncOptions, copy_project, prepare_workspace
from composer.model import BehaviorReference, Executable, Host, Process, System
from composer.project import SETTINGS_FILE, Project
from composer.python_code.lookup import find_behavior
from composer.runtime.process.computer import is_this_computer
from composer.runtime.process.watchdog import STOP_SIGNALS

_HASH_CHARACTERS = 14  # of RIHS01_ and the digest: enough to compare by eye
_INVENTORY_WITHIN_S = 30.0
_MOST_LINES = 12  # of one host and one kind: the reason for hundreds is the first few's
_LONGEST_NAME = 256  # of a file, for Linux


class Kind(Enum):
    """What differs, with what to do about it."""

    VERSION = "install the same versions on all computers"
    INTERFACE = "build it there from the same definitions: compose interface build"
    FILE = "copy the project with 'compose hosts sync'"


@dataclass(frozen=True, slots=True)
class Difference:
    """Something that another computer has, or not, unlike this one."""

    kind: Kind
    text: str


def differences(here: Inventory, there: Inventory) -> tuple[Difference, ...]:
    """Return how ``there`` differs from ``here``; nothing if it can run the system."""
    return (*_versions(here, there), *_interfaces(here, there), *_files(here, there))


def _versions(here: Inventory, there: Inventory) -> Iterator[Difference]:
    if there.python != here.python:
        yield Difference(Kind.VERSION, f"Python is {there.python} there, {here.python} here")
    # A package on one computer only is not a difference: systems need the interfaces of packages.
    for name in sorted(here.packages.keys() & there.packages.keys()):
        ours, theirs = here.packages[name], there.packages[name]
        if ours != theirs:
            yield Difference(Kind.VERSION, f"{name} is {theirs} there, {ours} here")


def _interfaces(here: Inventory, there: Inventory) -> Iterator[Difference]:
    for name, ours, theirs in _unlike(here.interfaces, there.interfaces):
        if theirs is None:
            yield Difference(Kind.INTERFACE, f"interface {name} is not built there")
        elif ours is None:
            yield Difference(Kind.INTERFACE, f"interface {name} is not built here")
        else:
            hashes = f"{theirs[:_HASH_CHARACTERS]} there, {ours[:_HASH_CHARACTERS]} here"
            yield Difference(Kind.INTERFACE, f"interface {name} differs: {hashes}")


def _files(here: Inventory, there: Inventory) -> Iterator[Difference]:
    for name, _, theirs in _unlike(here.files, there.files):
        text = f"{name} is not there" if theirs is None else f"{name} differs"
        yield Difference(Kind.FILE, text)


def _unlike(
    here: Mapping[str, str | None], there: Mapping[str, str | None]
) -> Iterator[tuple[str, str | None, str | None]]:
    for name, ours in here.items():
        theirs = there.get(name)
        if ours != theirs:
            yield name, ours, theirs


async def connect_all(
    hosts: Sequence[Host], root: Path, stack: AsyncExitStack
) -> Mapping[str, asyncssh.SSHClientConnection]:
    """Connect to all hosts at once, until ``stack`` ends. Raises HostsError with all errors."""

    async def attempt(host: Host) -> asyncssh.SSHClientConnection:
        load_keys(host, root)
        connection = await connect(host, root)
        stack.callback(connection.abort)
        return connection

    results = await asyncio.gather(*map(attempt, hosts), return_exceptions=True)
    _raise_problems(results)
    return {
        host.name.value: result
        for host, result in zip(hosts, results, strict=True)
        if isinstance(result, asyncssh.SSHClientConnection)
    }


async def compare_all(
    hosts: Sequence[Host],
    connections: Mapping[str, asyncssh.SSHClientConnection],
    question: Question,
    here: Inventory,
) -> None:
    """Compare the inventories of all hosts with this computer's. Raises HostsError."""

    async def compare(host: Host) -> list[Problem]:
        there = await _ask(host, connections[host.name.value], question)
        return _described(host, here, there)

    results = await asyncio.gather(*map(compare, hosts), return_exceptions=True)
    _raise_problems(results)
    found = [item for result in results if isinstance(result, list) for item in result]
    if found:
        raise HostsError(found)


async def _ask(
    host: Host, connection: asyncssh.SSHClientConnection, question: Question
) -> Inventory:
    command = python_command(host, ("-m", "composer.client.hosts.inventory"), os.environ)
    stdin = written_question(question)
    done = await run_command(host, connection, command, stdin=stdin, within_s=_INVENTORY_WITHIN_S)
    if done.status != 0:
        raise failure_of(host, done.status, done.text + done.errors)
    try:
        return read_answer(done.text)
    except ValueError as error:
        raise HostError(
            host,
            "ros2-composer there answers in another way",
            "install the same version of ros2-composer there",
        ) from error


def _described(host: Host, here: Inventory, there: Inventory) -> list[Problem]:
    found = differences(here, there)
    described: list[Problem] = []
    for kind in Kind:
        texts = [shown(item.text) for item in found if item.kind is kind]
        lines = [f"{host.name} ({host.login}): {text}" for text in texts]
        more = len(lines) - _MOST_LINES
        if more > 0:
            lines[_MOST_LINES:] = [f"{host.name} ({host.login}): and {more} more like this"]
        described += [(line, None) for line in lines[:-1]]
        described += [(line, kind.value) for line in lines[-1:]]
    return described


def _raise_problems(results: Sequence[object]) -> None:
    problems: list[Problem] = []
    for result in results:
        if isinstance(result, HostError):
            problems += result.problems
        elif isinstance(result, BaseException):
            raise result
    if problems:
        raise HostsError(problems)


def question_about(system: System, path: Path, project: Project) -> Question:
    """Return what other computers must have in common with this one to run the system in ``path``.

    The files are those of the project: YAML, parameters, Python code, programs and settings. What
    is installed is compared by its version.
    """
    names = {
        str(found.resolve().relative_to(project.root))
        for found in (path, *_files_of_system(system, project))
        if project.holds(found) and found.is_file()
    }
    interfaces = {port.interface.value for node in system.nodes for port in node.all_ports}
    return Question(tuple(sorted(names)), tuple(sorted(interfaces)))


def _files_of_system(system: System, project: Project) -> Iterator[Path]:
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

    Raises HostsError.
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
            return await deployment.run(connections)

    return asyncio.run(run())


def sync_hosts(
    hosts: Sequence[Host], options: SyncOptions, report: Callable[[Host, Sequence[str]], None]
) -> None:
    """Copy the project to all hosts, one after the other; nothing if one of them is not ready.

    Raises HostsError.
    """

    async def run() -> None:
        async with AsyncExitStack() as stack:
            connections = await connect_all(hosts, options.root, stack)
            targets = [
                await prepare_workspace(host, connections[host.name.value], dry_run=options.dry_run)
                for host in hosts
            ]
            for host, target in zip(hosts, targets, strict=True):
                report(host, await asyncio.to_thread(copy_project, host, target, options))

    asyncio.run(run())

"""The commands: ``compose hosts run`` and ``compose hosts sync`` as one call each."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack

from composer.client.hosts.check import HostsDiffer, compare_all, connect_all
from composer.client.hosts.connection import HostError
from composer.client.hosts.deployment import Deployment, DeploymentOptions, RemoteProcess
from composer.client.hosts.inventory import Question, take_inventory
from composer.client.hosts.sync import SyncOptions, copy_project, prepare_workspace
from composer.model import Host, Process, System
from composer.runtime.process.addresses import is_this_computer
from composer.runtime.process.signals import STOP_SIGNALS


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

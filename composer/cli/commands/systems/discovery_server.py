"""``compose discovery-server``: the discovery server of a system, as a service of its own."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CONFIG, FAILED, CommandError
from composer.cli.support.options import examples
from composer.cli.support.output.terminal import say
from composer.cli.support.system_arguments import ShowWarnings, SystemName, runnable_system
from composer.model.names import PROGRAM_LOGGER

if TYPE_CHECKING:
    from composer.model import Discovery

_POLL_S = 0.02

EPILOGS = {
    "discovery-server": examples(
        "compose discovery-server robot            until Ctrl-C",
        "compose discovery-server robot --ready    does it run?",
    )
}


def discovery_server(
    system: SystemName,
    *,
    ready: Annotated[
        bool,
        typer.Option("--ready", help="Only exit with 0 if the server runs here, with 1 if not."),
    ] = False,
) -> None:
    """Run the discovery server of a system.

    'compose run' starts the server itself with 'start: true', and uses one that runs already. Run
    it by this command if it shall not end with the system. It is the server of Fast DDS, started
    again if it ends. Of several servers, those with addresses of this computer are run.
    """
    discovery = _discovery(system)
    if ready:
        if not _is_running(discovery):
            say(f"no discovery server runs here at {_listed(discovery)}")
            raise typer.Exit(FAILED)
        return
    _run(discovery)


def _discovery(text: str) -> Discovery:
    """Return the discovery of a system, with servers to be started. Raises CommandError."""
    from composer.model import DiscoveryKind

    system = runnable_system(text, warnings=ShowWarnings.NONE, exit_code=CONFIG).system
    discovery = system.discovery
    if discovery is None or discovery.kind.value is not DiscoveryKind.SERVER:
        raise CommandError(
            f"system '{system.name}' uses no discovery server",
            hint="set 'discovery: {kind: server, address: ...}'",
            exit_code=CONFIG,
        )
    return replace(discovery, start=True)


def _run(discovery: Discovery) -> None:
    """Run the servers until a signal. Raises CommandError."""
    from composer.cli.support.ros import require_ros
    from composer.model import LogLevel
    from composer.runtime.children.discovery_server import discovery_servers
    from composer.runtime.process import StartRefused
    from composer.runtime.process.service_manager import READY, STOPPING, ServiceManager
    from composer.runtime.process.signals import WakeupPipe, stop_signals

    require_ros("compose discovery-server")
    manager, wakeup = ServiceManager(), WakeupPipe()
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
    from composer.runtime.process.addresses import PortState, port_state, resolve

    states = []
    for host, port in discovery.servers:
        address = resolve(host)
        states.append(PortState.UNKNOWN if address is None else port_state(address, port))
    return PortState.IN_USE in states and PortState.FREE not in states


def _listed(discovery: Discovery) -> str:
    return ", ".join(f"{host}:{port}" for host, port in discovery.servers)

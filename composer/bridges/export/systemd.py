"""Units with which systemd runs a system: a service for each process, and a target for several."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from composer.base.fast_dataclass import dataclass
from composer.bridges.export.deployment import (
    STOP_WITHIN_S,
    Service,
    is_restarted,
    ros_variables,
    services,
)
from composer.bridges.templates import filled
from composer.model import Host, OnFailure, RestartBudget, System

#: The folders of a sourced workspace.
_FOLDERS = ("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "ROS_DISTRO")
#: ROS reads these as well: files of this computer, and what is in one of them.
_FILES = (
    "CYCLONEDDS_URI",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "RMW_FASTRTPS_USE_QOS_FROM_XML",
    "ROS_SECURITY_KEYSTORE",
)
#: The wheels of ROS from PyPI set it when Python starts, and mark that.
_LIBRARIES, _OF_WHEELS = "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
#: Much longer than the second after which a process reports again that it is alive.
_WATCHDOG_S = 30
_RESTART_S = 2.0

#: The service manager of a user does not know it.
_NETWORK = "Wants=network-online.target\nAfter=network-online.target\n"

_START_SYSTEM = f"""\
# READY=1 follows the bring-up, whose transitions have limits of their own.
Type=notify
TimeoutStartSec=infinity
WatchdogSec={_WATCHDOG_S}
"""
_START_SERVER = """\
# READY=1 follows the start of the server.
Type=notify
"""
#: Exit codes of usage errors, of errors in files, and of what is missing on another computer.
_FINAL, _FINAL_THERE = "2 78", "2 71 72 73 78"


_END_OF_TARGET = """\
# 'on_failure: shutdown' of the system: all processes end with the one that coordinates them.
BindsTo={first}
After={first}
"""


@dataclass(frozen=True, slots=True)
class Installation:
    """How services are started.

    ``python`` is the command that starts compose here. Of ``environment``, the variables that ROS
    reads become part of the units. ``remote`` returns the command that runs a service on
    another computer, in its workspace: the name of a shell and its arguments. ``user`` is who runs
    services, unless their computer names another one; None for the user of the service manager.
    systemd sets HOME only with a user, also for root.
    """

    python: Sequence[str]
    environment: Mapping[str, str]
    remote: Callable[[Host, Service], Sequence[str]]
    user: str | None = None


def units(
    system: System, path: Path, installation: Installation, *, user: bool
) -> dict[PurePosixPath, str]:
    """Return the units of the system in ``path``, by their file names.

    Without other processes, that is one service. Services of another computer are in a folder with
    its name.

    Units of another computer have its paths, if its workspace is known. With ``user``, units are
    for the service manager of a user.
    """
    name = system.name.value
    listed = services(system)
    boot = "default.target" if user else "multi-user.target"
    target = f"{listed[0].label}.target" if len(listed) > 1 else None
    here = [service for service in listed if service.host is None]
    found: dict[PurePosixPath, str] = {}
    if target is not None:
        found[PurePosixPath(target)] = filled(
            "systemd/target",
            system=name,
            description=_description(system),
            wants=" ".join(_unit(service) for service in here),
            end="" if is_restarted(system) else _END_OF_TARGET.format(first=_unit(here[0])),
            target=boot,
        )
    for service in listed:
        order = f"PartOf={target}\n" if target is not None and service.host is None else ""
        order += _order(service, [item for item in listed if item.host == service.host])
        there = _computer(system, service)
        if there is None:
            command, place = _here(service, path.resolve(), installation)
        else:
            command, place = _there(service, there, installation, user=user)
        found[PurePosixPath(service.host or "", _unit(service))] = filled(
            "systemd/service",
            system=name,
            origin="" if len(listed) == 1 else f"# {service.origin}\n",
            description=_description(system, service),
            order=order,
            network="" if user else _NETWORK,
            limit="" if service.is_server else _start_limit(system),
            command=" ".join(_quoted(word.replace("$", "$$")) for word in command),
            start=_START_SERVER if service.is_server else _START_SYSTEM,
            compose="compose hosts discovery-server" if service.is_server else "compose run",
            place=place,
            environment=_environment(service.environment),
            resources=_resources(service),
            stop_s=str(STOP_WITHIN_S),
            restart=_restart(system, service, _FINAL if there is None else _FINAL_THERE),
            target=boot if target is None or service.host is not None else target,
        )
    return found


def _here(service: Service, path: Path, installation: Installation) -> tuple[Sequence[str], str]:
    """Return the command of a service, and the lines about its user, folder and environment."""
    environment = installation.environment
    variables = {**_set(environment), **ros_variables(environment, service)}
    folder = f"WorkingDirectory={_escaped(str(path.parent))}\n"
    command = [*installation.python, *service.command(str(path))]
    place = _login(installation.user) + folder
    return command, place + _environment(dict(sorted(variables.items())))


def _there(
    service: Service, host: Host, installation: Installation, *, user: bool
) -> tuple[Sequence[str], str]:
    """Return the same for another computer, whose shell finds the workspace and Python."""
    shell, *words = installation.remote(host, service)
    login = installation.user if host.user is None else host.user.value  # as ssh does
    return [f"/bin/{shell}", *words], _login(None if user else login)


def _login(name: str | None) -> str:
    return "" if name is None else f"User={_escaped(name)}\n"


def _unit(service: Service) -> str:
    return f"{service.label}.service"


def _order(service: Service, here: Sequence[Service]) -> str:
    """Return what starts before a service, and stops after it."""
    servers = [_unit(item) for item in here if item.is_server]
    if service.is_server or len(here) == 1:
        return ""
    before = [_unit(item) for item in here if service.is_coordinator and item is not service]
    order = f"Wants={' '.join(servers)}\n" if servers else ""
    after = before or servers
    return order + (f"After={' '.join(after)}\n" if after else "")


def _computer(system: System, service: Service) -> Host | None:
    """Return the other computer of a service, if its workspace is known."""
    for host in system.hosts:
        if host.name.value == service.host and host.workspace is not None:
            return host
    return None


def _description(system: System, service: Service | None = None) -> str:
    part = ""
    if service is not None and service.is_server:
        part = ", discovery server"
    elif service is not None and service.process is not None:
        part = f", process {service.process.name}"
    text = f": {system.description}" if system.description and not part else ""
    line = " ".join(f"ROS 2 system {system.name}{part}{text}".split())
    return _escaped(line.rstrip("\\ "))  # one at the end would continue the line


def _set(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the folders of the workspace that is sourced now, and the files that are set."""
    names = (*_FOLDERS, *_FILES)
    found = {name: environment[name] for name in names if environment.get(name)}
    if _OF_WHEELS in environment:
        found.pop(_LIBRARIES, None)
    return found


def _environment(variables: Mapping[str, str]) -> str:
    return "".join(
        f"Environment={_quoted(f'{name}={value}')}\n" for name, value in variables.items()
    )


def _resources(service: Service) -> str:
    lines = []
    if service.cpus:
        lines.append(f"CPUAffinity={' '.join(map(str, service.cpus))}")
    if service.memory_bytes is not None:
        lines.append(f"MemoryMax={service.memory_bytes}")
    if service.priority is not None:
        lines.append(f"LimitRTPRIO={service.priority}")
    return "".join(f"{line}\n" for line in lines)


def _budget(system: System) -> RestartBudget | None:
    """Return the limits of restarts, if the system restarts nodes that fail."""
    policy = system.supervision.policy
    return system.supervision.restart if policy is OnFailure.RESTART else None


def _start_limit(system: System) -> str:
    budget = _budget(system)
    if budget is None:
        return ""
    return (
        "# As the nodes: 'lifecycle.restart' of the system.\n"
        f"StartLimitIntervalSec={_seconds(budget.window_ms)}\n"
        f"StartLimitBurst={budget.max_attempts + 1}\n"
    )


def _restart(system: System, service: Service, final: str) -> str:
    if not is_restarted(system) and not service.is_server:
        return "# 'on_failure: shutdown' of the system: a failure ends it.\nRestart=no\n"
    budget = None if service.is_server else _budget(system)
    wait = f"{_RESTART_S:g}" if budget is None else _seconds(budget.backoff_ms)
    return (
        "# Not retried: usage errors (2) and errors in files (78).\n"
        f"Restart=on-failure\nRestartSec={wait}\nRestartPreventExitStatus={final}\n"
    )


def _seconds(value_ms: float) -> str:
    return f"{max(1, round(value_ms)) / 1000:g}"


def _quoted(word: str) -> str:
    """Return a word for a command line or an assignment, as systemd reads it."""
    text = _escaped(word)
    if text and all(character.isalnum() or character in "/._-=:+,@" for character in text):
        return text
    inner = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(map(_printable, inner)) + '"'


def _printable(character: str) -> str:
    if character.isprintable():
        return character
    return "".join(f"\\x{byte:02x}" for byte in os.fsencode(character))


def _escaped(text: str) -> str:
    return text.replace("%", "%%")

"""A file with which docker compose runs a system: one service for each process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from composer.bridges.export.container_image import WRITABLE, Contents
from composer.bridges.export.deployment import (
    STOP_WITHIN_S,
    Service,
    is_restarted,
    ros_variables,
    services,
)
from composer.bridges.export.yaml_text import without_variables, yaml_text
from composer.model import System

_HEAD = """\
# Written by 'compose export docker-compose' for the system {system}.
#
#   docker compose up --build       docker compose ps       docker compose logs -f
"""
_END = """\
#
# 'on_failure: shutdown' of the system: let all processes end with the first one that ends.
#
#   docker compose up --abort-on-container-exit
"""
_HOST = (
    "ROS nodes of one computer exchange messages by shared memory. Containers do as well if they\n"
    "share network and IPC with the computer, and run as the same user as its other nodes."
)


def compose_file(
    system: System,
    contents: Contents,
    image: str,
    build: Mapping[str, str],
    environment: Mapping[str, str],
) -> str:
    """Return the compose file of a system.

    ``build`` has the keys ``context`` and ``dockerfile``; if it is empty, the image is only used.
    Docker builds in parallel, and fails if two services build the same image: the first service of
    each computer does, for all.
    Of ``environment``, the variables that ROS reads become part of the file.
    """
    listed = services(system)
    common = {
        "init": True,
        "#1": _HOST,
        "network_mode": "host",
        "ipc": "host",
        "read_only": True,
        "tmpfs": [WRITABLE],
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "stop_grace_period": f"{STOP_WITHIN_S}s",
    }
    found: dict[str, Any] = {}
    hosts: set[str | None] = set()
    for number, service in enumerate(listed):
        if len(listed) > 1:
            found[f"#{number}"] = service.origin
        builds = build and service.host not in hosts
        hosts.add(service.host)
        found[service.label] = {
            "image": image,
            **({"build": dict(build)} if builds else {}),
            **common,
            "command": ["compose", *service.command(str(contents.file))],
            **_conditional(system, service, listed),
            **_limits(service),
            "environment": ros_variables(environment, service) | service.environment,
            "healthcheck": {
                "test": ["CMD", "compose", *service.readiness(str(contents.file))],
                "interval": "10s",
                "timeout": "8s",
                "retries": 3,
                "start_period": "60s",
            },
        }
        if not found[service.label]["environment"]:
            del found[service.label]["environment"]
    document = {"name": listed[0].label, "services": found}
    end = _END if len(listed) > 1 and not is_restarted(system) else ""
    return _HEAD.format(system=system.name) + end + yaml_text(without_variables(document))


def _conditional(system: System, service: Service, listed: tuple[Service, ...]) -> dict[str, Any]:
    here = [item for item in listed if item.host == service.host]
    others = [item for item in here if item is not service]
    found: dict[str, Any] = {}
    servers = {item.label: {"condition": "service_healthy"} for item in others if item.is_server}
    members: list[str] = []
    if service.is_coordinator:
        members = [item.label for item in others if not item.is_server]
    if members:
        found["#2"] = "It is stopped before the others, whose nodes it takes down in order."
    if servers and not service.is_server:
        found["depends_on"] = servers | {name: {"condition": "service_started"} for name in members}
    elif members:
        found["depends_on"] = members
    if service.host is not None:
        labels = " ".join(item.label for item in here)
        found["#3"] = f"On {service.host}: docker compose up --build {labels}"
        found["profiles"] = [service.host]
    if is_restarted(system) or service.is_server:
        found["restart"] = "unless-stopped"
    else:
        found["#4"] = "'on_failure: shutdown' of the system: a failure ends it."
        found["restart"] = "no"
    return found


def _limits(service: Service) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if service.cpus:
        found["cpuset"] = ",".join(map(str, service.cpus))
    if service.memory_bytes is not None:
        found["deploy"] = {"resources": {"limits": {"memory": f"{service.memory_bytes}b"}}}
    if service.priority is not None:
        found["ulimits"] = {"rtprio": service.priority}
    return found

"""Manifests with which Kubernetes runs a system: a pod for each computer, a container a process.

The containers of a pod share its network and its shared memory, as processes of one computer do.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from composer.bridges.export.container_image import USER_ID, WRITABLE, Contents
from composer.bridges.export.deployment import (
    STOP_WITHIN_S,
    Service,
    has_outside_nodes,
    is_restarted,
    ros_variables,
    services,
    without_variables,
    yaml_text,
)
from composer.model import System
from composer.model.hosts import is_loopback

_HEAD = """\
# Written by 'compose export kubernetes' for the system {system}.
#
# Build the image {image} with the Containerfile from the root of the project, and push it
# to a registry of the cluster. Then: kubectl apply -f FILE
"""
_SHARED_MEMORY, _TEMPORARY = "shared-memory", "temporary"
_OUTSIDE = (
    "Nodes outside the pod take part: it discovers them in the network of the computer, and\n"
    "exchanges messages by its shared memory. Namespaces with restricted pods do not allow this."
)
_ADDRESS = (
    "The pod belongs on the computer with the address of the discovery server. Name that\n"
    "in 'hosts' of the system, which binds the server to it, or add a nodeSelector."
)
_PROBES = "It has started once it responds, and is ready once its nodes are up."
_PRIORITY = "It needs real-time priority {priority}, which Kubernetes only grants to the user root."


def manifests(
    system: System, contents: Contents, image: str, environment: Mapping[str, str]
) -> str:
    """Return the manifests of a system, as one file.

    Of ``environment``, the variables that ROS reads become part of the containers.
    """
    listed = services(system)
    hosts = sorted({service.host for service in listed if service.host is not None})
    is_open = bool(hosts) or has_outside_nodes(system)
    found = []
    for host in (None, *hosts):
        here = [service for service in listed if service.host == host]
        containers = {
            service: {
                "name": service.label,
                **({"#1": service.origin} if len(listed) > 1 else {}),
                "image": image,
                "imagePullPolicy": "IfNotPresent",
                **_container(service, contents, environment, shares_memory=not is_open),
            }
            for service in here
        }
        place = _place(system, here)
        pod = place | _pod(containers, ends=not is_restarted(system), is_open=is_open)
        found.append(yaml_text(_workload(system, here[0], pod)))
    return _HEAD.format(system=system.name, image=image) + "---\n".join(found)


def _workload(system: System, first: Service, pod: dict[str, Any]) -> dict[str, Any]:
    """Return the object that keeps a pod running."""
    labels = {
        "app.kubernetes.io/name": first.label,
        "app.kubernetes.io/part-of": system.name.value[:63].strip("_.-"),
    }
    template = {"metadata": {"labels": labels}, "spec": pod}
    metadata = {"name": first.label, "labels": labels}
    if not is_restarted(system):
        pod["restartPolicy"] = "Never"
        return {
            "#1": "'on_failure: shutdown' of the system: a failure ends it.",
            "apiVersion": "batch/v1",
            "kind": "Job",
            "metadata": metadata,
            "spec": {"backoffLimit": 0, "template": template},
        }
    return {
        "apiVersion": "apps/v1",
        "kind": "Deployment",
        "metadata": metadata,
        "spec": {
            "replicas": 1,
            "#1": "Never two at the same time: their nodes would have the same names.",
            "strategy": {"type": "Recreate"},
            "selector": {"matchLabels": {"app.kubernetes.io/name": first.label}},
            "template": template,
        },
    }


def _place(system: System, here: Sequence[Service]) -> dict[str, Any]:
    """Return what binds the pod of these services to a computer."""
    if here[0].host is not None:
        return {"nodeSelector": {"kubernetes.io/hostname": here[0].host}}
    discovery = system.discovery
    if discovery is None or not any(service.is_server for service in here):
        return {}
    return {} if all(is_loopback(host) for host, _ in discovery.servers) else {"#0": _ADDRESS}


def _pod(
    containers: Mapping[Service, dict[str, Any]], *, ends: bool, is_open: bool
) -> dict[str, Any]:
    """Return a pod; ``is_open`` is whether it takes part in the graph of its computer.

    If the system ``ends``, the pod does so with the coordinating process.
    """
    first = next(iter(containers))
    main = [item for item in containers if not item.is_server]
    if ends and first.is_coordinator:
        main = [first]
    sidecars = [item for item in containers if item not in main] if main else []
    sidecars.sort(key=lambda item: not item.is_server)
    pod: dict[str, Any] = {}
    if is_open:
        pod |= {
            "#1": _OUTSIDE,
            "hostNetwork": True,
            "hostIPC": True,
            "dnsPolicy": "ClusterFirstWithHostNet",
        }
    pod |= {
        "automountServiceAccountToken": False,
        "enableServiceLinks": False,
        "terminationGracePeriodSeconds": STOP_WITHIN_S,
        "securityContext": {
            "runAsNonRoot": True,
            "runAsUser": USER_ID,
            "runAsGroup": USER_ID,
            "fsGroup": USER_ID,
            "seccompProfile": {"type": "RuntimeDefault"},
        },
        **(
            {"initContainers": [_as_sidecar(containers[item]) for item in sidecars]}
            if sidecars
            else {}
        ),
        "containers": [containers[item] for item in main or containers],
        "volumes": list(_volumes(shares_memory=not is_open)),
    }
    return pod


def _as_sidecar(container: dict[str, Any]) -> dict[str, Any]:
    """Return a container that has started before the others start, and runs as long as they do."""
    name = container["name"]
    comment = "It runs as long as others do (Kubernetes 1.29), which start after it."
    return {"name": name, "#0": comment, **container, "restartPolicy": "Always"}


def _container(
    service: Service, contents: Contents, environment: Mapping[str, str], *, shares_memory: bool
) -> dict[str, Any]:
    variables = [
        {"name": name, "value": without_variables(value)}
        for name, value in (ros_variables(environment, service) | service.environment).items()
    ]
    priority = service.priority
    mounts = [{"name": _TEMPORARY, "mountPath": WRITABLE}]
    if shares_memory:
        mounts.append({"name": _SHARED_MEMORY, "mountPath": "/dev/shm"})  # noqa: S108
    file = str(contents.file)
    ready = ["compose", *service.readiness(file)]
    alive = ready if service.is_server else ready[:-1]
    return {
        **({} if priority is None else {"#2": _PRIORITY.format(priority=priority)}),
        "command": without_variables(["compose", *service.command(file)]),
        **({"env": variables} if variables else {}),
        **({"resources": limits} if (limits := _limits(service)) else {}),
        **({} if service.is_server else {"#3": _PROBES}),
        "startupProbe": _probe(alive, period_s=2, failures=60),
        "readinessProbe": _probe(ready, period_s=10, failures=1),
        "livenessProbe": _probe(alive, period_s=30, failures=3),
        "securityContext": {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        },
        "volumeMounts": mounts,
    }


def _limits(service: Service) -> dict[str, Any]:
    limits: dict[str, Any] = {}
    if service.cpus:
        limits["cpu"] = str(len(service.cpus))
    if service.memory_bytes is not None:
        limits["memory"] = str(service.memory_bytes)
    return {"limits": limits, "requests": dict(limits)} if limits else {}


def _probe(command: list[str], *, period_s: int, failures: int) -> dict[str, Any]:
    return {
        "exec": {"command": command},
        "periodSeconds": period_s,
        "timeoutSeconds": 8,
        "failureThreshold": failures,
    }


def _volumes(*, shares_memory: bool) -> Iterable[dict[str, Any]]:
    yield {"name": _TEMPORARY, "emptyDir": {}}
    if shares_memory:
        yield {
            "name": _SHARED_MEMORY,
            "#1": "What a process writes there counts as memory of its container.",
            "emptyDir": {"medium": "Memory"},
        }

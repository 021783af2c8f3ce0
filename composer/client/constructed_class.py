"""Constructs a node class once, in a process of its own, and prints what it has.

Run as ``python -P -m composer.client.constructed_class REPORT MODULE:CLASS FOLDER``: user code runs
in it. The description goes to the file REPORT as JSON.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile

from composer.base.source import Located, SourceFile, Span
from composer.client.parameters import settings_of
from composer.model import BehaviorReference
from composer.project import Project
from composer.runtime.middleware.environment import ROS_ARGUMENTS, prepare_environment
from composer.runtime.node.behavior_loader import behavior_class
from composer.runtime.ros.parameter_values import description

#: Of names below it, the class has given the relative form.
_NAMESPACE = "/compose_import_class"
_INFINITE_NS = 0x7FFFFFFFFFFFFFFF


def main(report: Path, text: str, folder: Path) -> None:
    """Construct the class, write its description, and end the process."""
    prepare_environment()
    rclpy.init(args=[*ROS_ARGUMENTS, "-r", f"__ns:={_NAMESPACE}"])
    span = Span(SourceFile("", text), 1, 1, len(text))
    folders = Project.at(folder).node_folders
    kind = behavior_class(BehaviorReference(Located(text, span), folder, folders))
    if not issubclass(kind, Node):
        raise TypeError(f"{text} is not derived from rclpy.node.Node")
    constructor: Callable[[], Node] = kind
    report.write_text(json.dumps(_description(constructor())), encoding="utf-8")
    os._exit(0)  # whatever threads the node has started


def _description(node: Node) -> dict[str, Any]:
    ports = [
        *(
            _port("publisher", end.topic_name, end.msg_type, end.qos_profile)
            for end in node.publishers
        ),
        *(
            _port("subscription", end.topic_name, end.msg_type, end.qos_profile)
            for end in node.subscriptions
        ),
        *(_port("service", end.service_name, end.srv_type) for end in node.services),
        *(_port("client", end.service_name, end.srv_type) for end in node.clients),
        *_actions(node),
    ]
    names = node.list_parameters([], 0).names
    return {
        "name": node.get_name(),
        "namespace": node.get_namespace(),
        "ports": ports,
        "parameters": {
            name: {
                "value": _plain(node.get_parameter(name)),
                **settings_of(description(name, node.describe_parameter(name))),
            }
            for name in names
        },
    }


def _actions(node: Node) -> list[dict[str, Any]]:
    found = []
    waitables: list[Any] = list(node.waitables)
    for waitable in waitables:
        kind = {"ActionServer": "action_server", "ActionClient": "action_client"}.get(
            type(waitable).__name__
        )
        if kind is not None:
            name = getattr(waitable, "_action_name", "")
            found.append(_port(kind, node.resolve_service_name(name), waitable._action_type))
    return found


def _port(kind: str, name: str, interface: Any, qos: QoSProfile | None = None) -> dict[str, Any]:
    module = interface.__module__.split(".")  # std_msgs.msg._string
    port: dict[str, Any] = {
        "kind": kind,
        "name": name,
        "type": f"{module[0]}/{module[1]}/{interface.__name__}",
    }
    if qos is not None:
        port["qos"] = {
            "history": qos.history.name.lower(),
            "depth": qos.depth,
            "reliability": qos.reliability.name.lower(),
            "durability": qos.durability.name.lower(),
            "deadline_ms": _milliseconds(qos.deadline.nanoseconds),
            "lifespan_ms": _milliseconds(qos.lifespan.nanoseconds),
            "liveliness": qos.liveliness.name.lower(),
            "liveliness_lease_duration_ms": _milliseconds(
                qos.liveliness_lease_duration.nanoseconds
            ),
        }
    return port


def _milliseconds(nanoseconds: int) -> float | None:
    """Return a duration; None if it is unlimited, which is 0 or the largest one."""
    return None if nanoseconds in (0, _INFINITE_NS) else nanoseconds * 1e-6


def _plain(parameter: Parameter) -> Any:
    value = parameter.value
    if isinstance(value, list | tuple) or hasattr(value, "tolist"):
        return [item[0] if isinstance(item, bytes) else item for item in value]
    return value


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))

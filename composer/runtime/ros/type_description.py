"""Limits the requests of the service ``get_type_description`` that rclpy adds to a node."""

from __future__ import annotations

from functools import partial
from typing import Any

from rclpy.node import Node
from type_description_interfaces.srv import GetTypeDescription

from composer.runtime.ros.limited_requests import TooLarge, limited


def limit_type_descriptions(node: Node) -> None:
    """Refuse requests with long texts, which rcl would print. Call it before the node is served."""
    for service in node.services:
        if service.srv_type is GetTypeDescription:
            service.srv_type = limited(GetTypeDescription)
            service.callback = partial(_respond, service.callback)


def _respond(callback: Any, request: Any, response: Any) -> Any:
    if not isinstance(request, TooLarge):
        return callback(request, response)
    response.successful = False
    response.failure_reason = request.reason
    return response

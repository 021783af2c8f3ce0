"""Sends requests of a size that no tool sends to the standard services of a node.

Prints ``ready``, then a line of JSON for each request: the service and what it responded. With
``forever`` as second argument, it starts again after the last one.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from type_description_interfaces.srv import GetTypeDescription

NAMES = 100_000
PARAMETERS = 20_000
DOUBLES = 1_500_000  # 12 MB


def requests() -> Iterator[tuple[Any, str, dict[str, Any]]]:
    names = ["speed"] * NAMES
    changes = [
        Parameter(name="speed", value=ParameterValue(type=3, double_value=1.0 + n / PARAMETERS))
        for n in range(PARAMETERS)
    ]
    array = ParameterValue(type=8, double_array_value=[0.0] * DOUBLES)
    text = ParameterValue(type=4, string_value="x" * DOUBLES)
    yield GetParameters, "get_parameters", {"names": names}
    yield GetParameterTypes, "get_parameter_types", {"names": names}
    yield DescribeParameters, "describe_parameters", {"names": names}
    yield ListParameters, "list_parameters", {"prefixes": names}
    yield SetParameters, "set_parameters", {"parameters": changes}
    yield SetParametersAtomically, "set_parameters_atomically", {"parameters": changes}
    for value in (array, text):
        yield SetParameters, "set_parameters", {"parameters": [Parameter(name="x", value=value)]}
    long = "x" * DOUBLES
    yield ChangeState, "change_state", {"transition": Transition(label=long)}
    yield GetTypeDescription, "get_type_description", {"type_name": long, "type_hash": long}


def outcome(response: Any) -> str:
    if hasattr(response, "results"):
        return "; ".join(result.reason for result in response.results)
    if isinstance(response, SetParametersAtomically.Response):
        return str(response.result.reason)
    if isinstance(response, ChangeState.Response):
        return str(response.success)
    if isinstance(response, GetTypeDescription.Response):
        return str(response.failure_reason)
    if isinstance(response, ListParameters.Response):
        return str(len(response.result.names))
    return str(len(next(getattr(response, name) for name in response.get_fields_and_field_types())))


def main() -> None:
    target, repeats = sys.argv[1], "forever" in sys.argv
    rclpy.init()
    node = rclpy.create_node("huge")
    print("ready", flush=True)
    prepared = [(kind, name, kind.Request(**fields)) for kind, name, fields in requests()]
    while True:
        for kind, name, request in prepared:
            client = node.create_client(kind, f"{target}/{name}")
            client.wait_for_service()
            for _ in range(3):  # the server may discover the client later than the request
                future = client.call_async(request)
                rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
                if future.done():
                    break
            answer = outcome(future.result()) if future.done() else "no response"
            print(json.dumps([name, answer]), flush=True)
            node.destroy_client(client)
        if not repeats:
            return


if __name__ == "__main__":
    main()

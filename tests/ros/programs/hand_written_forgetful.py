"""A plain rclpy process that loses the first request to each of its services.

Node /lab/forgetful has the lifecycle and parameter services of nodes, the
service /lab/switch (SetBool), and subscribes to /lab/in (String) reliably. Prints ``ready`` at the
start, and the last part of a service's name for each request.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import rclpy
from lifecycle_msgs.msg import State, Transition, TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool

SPEED = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=1.5)
CONFIGURE = TransitionDescription(
    transition=Transition(id=Transition.TRANSITION_CONFIGURE, label="configure"),
    goal_state=State(id=State.TRANSITION_STATE_CONFIGURING, label="configuring"),
)
UNCONFIGURED = State(id=State.PRIMARY_STATE_UNCONFIGURED, label="unconfigured")
DESCRIPTOR = ParameterDescriptor(name="speed", type=SPEED.type)
#: The type of each service below the node, and what it answers.
SERVICES = {
    "get_state": (GetState, {"current_state": UNCONFIGURED}),
    "get_available_transitions": (GetAvailableTransitions, {"available_transitions": [CONFIGURE]}),
    "change_state": (ChangeState, {"success": True}),
    "list_parameters": (ListParameters, {"result": ListParametersResult(names=["speed"])}),
    "describe_parameters": (DescribeParameters, {"descriptors": [DESCRIPTOR]}),
    "get_parameters": (GetParameters, {"values": [SPEED]}),
    "set_parameters": (SetParameters, {"results": [SetParametersResult(successful=True)]}),
}


class Forgotten(Exception):
    """Leaves ``spin``, so that rclpy sends no answer."""


class Forgetful(Node):
    def __init__(self) -> None:
        super().__init__("forgetful", namespace="/lab", start_parameter_services=False)
        self.asked: set[str] = set()
        for name, (kind, fields) in SERVICES.items():
            answer = partial(self.answer, name, kind.Response(**fields))
            self.create_service(kind, f"~/{name}", answer)
        answer = partial(self.answer, "switch", SetBool.Response(success=True))
        self.create_service(SetBool, "switch", answer)
        self.create_subscription(String, "in", lambda _: None, 10)

    def answer(self, name: str, response: Any, *_: Any) -> Any:
        print(name, flush=True)
        if name not in self.asked:
            self.asked.add(name)
            raise Forgotten
        return response


def main() -> None:
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(Forgetful())
    print("ready", flush=True)
    while True:
        try:
            executor.spin()
        except Forgotten:
            continue
        except (KeyboardInterrupt, ExternalShutdownException):
            sys.exit(0)


if __name__ == "__main__":
    main()

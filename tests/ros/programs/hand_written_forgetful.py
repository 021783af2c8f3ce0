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
#: By the name of a service: its type, and what it answers.
SERVICES = {
    "forgetful/get_state": (
        GetState,
        GetState.Response(
            current_state=State(id=State.PRIMARY_STATE_UNCONFIGURED, label="unconfigured")
        ),
    ),
    "forgetful/get_available_transitions": (
        GetAvailableTransitions,
        GetAvailableTransitions.Response(available_transitions=[CONFIGURE]),
    ),
    "forgetful/change_state": (ChangeState, ChangeState.Response(success=True)),
    "forgetful/list_parameters": (
        ListParameters,
        ListParameters.Response(result=ListParametersResult(names=["speed"])),
    ),
    "forgetful/describe_parameters": (
        DescribeParameters,
        DescribeParameters.Response(
            descriptors=[ParameterDescriptor(name="speed", type=SPEED.type)]
        ),
    ),
    "forgetful/get_parameters": (GetParameters, GetParameters.Response(values=[SPEED])),
    "forgetful/set_parameters": (
        SetParameters,
        SetParameters.Response(results=[SetParametersResult(successful=True)]),
    ),
    "switch": (SetBool, SetBool.Response(success=True)),
}


class Forgotten(Exception):
    """Leaves ``spin``, so that rclpy sends no answer."""


class Forgetful(Node):
    def __init__(self) -> None:
        super().__init__("forgetful", namespace="/lab", start_parameter_services=False)
        self.asked: set[str] = set()
        for name, (service, response) in SERVICES.items():
            self.create_service(service, name, partial(self.answer, name, response))
        self.create_subscription(String, "in", lambda _: None, 10)

    def answer(self, name: str, response: Any, *_: Any) -> Any:
        print(name.rpartition("/")[2], flush=True)
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

"""systems/pipeline.yaml, written by hand: the benchmark's nodes as rclpy lifecycle nodes.

They have their publishers, subscriptions, services and timers while they are configured, and their
timers run while they are active.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer
from rclpy.lifecycle import LifecycleNodeMixin, TransitionCallbackReturn

from benchmarks import baseline_pipeline
from tests.ros.programs.spinning import spin

#: In m/s, as in nodes/planner.yaml.
MAX_VELOCITY = ParameterDescriptor(
    description="Speed limit of every plan. [m/s]",
    floating_point_range=[FloatingPointRange(from_value=0.01, to_value=5.0)],
)


class Managed(LifecycleNodeMixin):
    """The transitions of all nodes of the pipeline."""

    def __init__(self) -> None:
        super(LifecycleNodeMixin, self).__init__()
        LifecycleNodeMixin.__init__(self)
        self.kept = {destroy: len(entities) for destroy, entities in self.entities()}

    def entities(self) -> list[tuple[Callable[[Any], object], list[Any]]]:
        return [
            (self.destroy_publisher, list(self.publishers)),
            (self.destroy_subscription, list(self.subscriptions)),
            (self.destroy_service, list(self.services)),
            (self.destroy_client, list(self.clients)),
            (self.destroy_timer, list(self.timers)),
        ]

    def on_configure(self, state: Any) -> TransitionCallbackReturn:
        self.create_entities()
        return self.on_deactivate(state)

    def on_activate(self, _: Any) -> TransitionCallbackReturn:
        for timer in self.timers:
            timer.reset()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, _: Any) -> TransitionCallbackReturn:
        for timer in self.timers:
            timer.cancel()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, _: Any) -> TransitionCallbackReturn:
        for server in [entity for entity in self.waitables if isinstance(entity, ActionServer)]:
            server.destroy()
        for destroy, entities in self.entities():
            for entity in entities[self.kept[destroy] :]:
                destroy(entity)
        return TransitionCallbackReturn.SUCCESS

    on_shutdown = on_cleanup


class SensorSimulator(Managed, baseline_pipeline.SensorSimulator): ...


class Planner(Managed, baseline_pipeline.Planner):
    def declare_parameter(self, name: str, value: Any, *arguments: Any) -> Any:
        if name == "max_velocity":
            arguments = (MAX_VELOCITY,)
        return super().declare_parameter(name, value, *arguments)


class MotorController(Managed, baseline_pipeline.MotorController):
    def create_entities(self) -> None:
        super().create_entities()
        self.navigate.register_execute_callback(self.on_goal)

    def on_goal(self, goal: Any) -> Navigate.Result:
        """Publish feedback twice, and arrive."""
        for _ in range(2):
            goal.publish_feedback(Navigate.Feedback(current_position=self.position))
            time.sleep(0.1)
        goal.succeed()
        return Navigate.Result(success=True, message="arrived")


if __name__ == "__main__":
    rclpy.init()
    nodes = [SensorSimulator(), Planner(), MotorController()]
    for node in nodes:
        node.trigger_configure()
        node.trigger_activate()
    spin(*nodes)

"""A project with a typed behavior and its stubs, for language servers and type checkers."""

from __future__ import annotations

from pathlib import Path

from tests.cli.compose import compose

#: Every line with a mistake ends with this comment.
WRONG = "# wrong"

_NODE_TYPE = """\
node: tracker
description: Tracks a pose.
behavior: tracker:Tracker
parameters:
  gain: {type: double, default: 1.0, unit: 1/s, description: The gain.}
  frame: {type: string, default: map}
publishers:
  target: {type: geometry_msgs/msg/PoseStamped, qos: command, external: true}
subscriptions:
  odometry: {type: nav_msgs/msg/Odometry, qos: sensor_data, external: true}
clients:
  enable: {type: std_srvs/srv/SetBool, external: true}
action_clients:
  navigate: {type: composer_interfaces/action/Navigate, external: true}
services:
  reset: {type: std_srvs/srv/Trigger, external: true}
timers:
  tick: {rate_hz: 1}
"""

RIGHT = '''\
"""The behavior of the node type tracker."""

from composer_interfaces.action import Navigate
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool, Trigger

from composer.behavior import CallError
from composer.typed import TrackerBehavior


class Tracker(TrackerBehavior):
    """Tracks a pose."""

    def on_activate(self) -> None:
        """Forget what was received."""
        self.odometry = Odometry()

    def on_odometry(self, message: Odometry) -> None:
        """Store the odometry."""
        self.odometry = message

    def on_tick(self) -> None:
        """Publish the pose."""
        target = PoseStamped()
        target.header.frame_id = self.parameters.frame
        target.pose.position.x = self.odometry.pose.pose.position.x * self.parameters.gain
        self.odometry.pose.covariance = [0.0] * 36
        self.publishers.target.publish(target)

    async def on_reset(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Call the server."""
        try:
            answer = await self.clients.enable.call(SetBool.Request(data=True), timeout_ms=100.0)
            sent = await self.action_clients.navigate.send_goal(Navigate.Goal(max_velocity=1.0))
            final = await sent.result()
        except CallError as error:
            self.log.warn(f"no answer: {error}")
            return response
        response.success = answer.success and final.result.success
        response.message = f"{final.result.distance_traveled:.1f} m"
        return response
'''

MISTAKES = '''\
"""Mistakes in a behavior of the node type tracker."""

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool, Trigger

from composer.typed import TrackerBehavior


class Tracker(TrackerBehavior):
    """Has mistakes."""

    def on_odometry(self, message: Odometry) -> None:
        """Use fields."""
        print(message.pose.position)  # wrong
        PoseStamped(heder=message.header)  # wrong

    def on_tick(self) -> None:
        """Use ports and parameters."""
        target = PoseStamped()
        target.pose.position.w = 1.0  # wrong
        target.pose.position.x = "a"  # wrong
        self.publishers.targt.publish(target)  # wrong
        self.publishers.target.publish(Odometry())  # wrong
        self.parameters.gian.hex()  # wrong
        name: str = self.parameters.gain  # wrong
        self.log.warning(name)  # wrong

    async def on_reset(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Call the server."""
        answer = await self.clients.enable.call(SetBool.Request(data=True))
        response.success = answer.succes  # wrong
        await self.clients.enable.call(Trigger.Request())  # wrong
        return response
'''


def wrong_lines(text: str) -> list[int]:
    """Return the numbers of the lines with a mistake, counted from 1."""
    return [number for number, line in enumerate(text.splitlines(), 1) if line.endswith(WRONG)]


def make_project(folder: Path) -> Path:
    """Create a project with a typed behavior, ``nodes/tracker.py``, and its stubs."""
    assert compose("new", "project", "my_robot").code == 0
    root = folder / "my_robot"
    (root / "nodes/tracker.yaml").write_text(_NODE_TYPE)
    (root / "nodes/tracker.py").write_text(RIGHT)
    done = compose("stubs", str(root))
    assert done.code == 0, done.err
    return root

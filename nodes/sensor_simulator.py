"""A point robot in the plane: commanded velocity in, odometry out."""

from __future__ import annotations

import math

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from composer.typed import SensorSimulatorBehavior


class SensorSimulator(SensorSimulatorBehavior):
    """Integrate the commanded velocity under an acceleration limit."""

    def on_activate(self) -> None:
        """Place the robot at its start position, at rest."""
        self.x, self.y = self.parameters.start
        self.velocity_x = self.velocity_y = 0.0
        self.command = Twist()
        self.commanded_at_s = self.stepped_at_s = self.clock.now()

    def on_motor_commands(self, message: Twist) -> None:
        """Store the commanded velocity."""
        self.command = message
        self.commanded_at_s = self.clock.now()

    def on_step(self) -> None:
        """Integrate over the time since the last step and publish the odometry."""
        now_s = self.clock.now()
        elapsed_s, self.stepped_at_s = now_s - self.stepped_at_s, now_s
        self._accelerate(elapsed_s, now_s)
        self.x += self.velocity_x * elapsed_s
        self.y += self.velocity_y * elapsed_s
        self.publishers.sensor_data.publish(self._odometry())

    def _accelerate(self, elapsed_s: float, now_s: float) -> None:
        is_fresh = (now_s - self.commanded_at_s) * 1000.0 <= self.parameters.command_timeout_ms
        target = self.command.linear if is_fresh else Twist().linear
        change_x, change_y = target.x - self.velocity_x, target.y - self.velocity_y
        change = math.hypot(change_x, change_y)
        possible = self.parameters.max_acceleration * elapsed_s
        share = 1.0 if change <= possible else possible / change
        self.velocity_x += share * change_x
        self.velocity_y += share * change_y

    def _odometry(self) -> Odometry:
        message = Odometry()
        message.header.stamp = self.clock.stamp()
        message.header.frame_id = "odom"
        message.child_frame_id = "base_link"
        message.pose.pose.position.x = self.x
        message.pose.pose.position.y = self.y
        message.pose.pose.orientation.w = 1.0
        message.twist.twist.linear.x = self.velocity_x
        message.twist.twist.linear.y = self.velocity_y
        return message

"""A closed-loop path follower."""

from __future__ import annotations

import math
from bisect import bisect_right

from composer_interfaces.action import Navigate
from composer_interfaces.srv import PlanTrajectory
from geometry_msgs.msg import Point, Twist
from nav_msgs.msg import Odometry, Path

from composer.behavior import CallCancelled, CallError, Goal
from composer.typed import MotorControllerBehavior

ODOMETRY_TIMEOUT_S = 2.0  # a goal may arrive before the first odometry
RETRY_S = 1.0  # pause before the next request after the planner has refused one


class MotorController(MotorControllerBehavior):
    """Track a path: command the velocity of the path plus a position correction."""

    def on_activate(self) -> None:
        """Start with the first waypoint."""
        self.position: Point | None = None
        self.reference: Reference | None = None
        self.navigating: Goal | None = None
        self.next_waypoint = 0
        self.distance_traveled = 0.0

    def on_sensor_data(self, message: Odometry) -> None:
        """Store the position and add to the distance traveled."""
        position = message.pose.pose.position
        if self.position is not None:
            self.distance_traveled += _distance(self.position, position)
        self.position = position

    def on_control(self) -> None:
        """Publish the velocity that keeps the robot on the path, or zero without a path."""
        command = Twist()
        if self.reference is not None and self.position is not None:
            command.linear.x, command.linear.y = self._velocity(self.reference, self.position)
        self.publishers.motor_commands.publish(command)

    async def on_plan(self) -> None:
        """Request a path to the next waypoint once the last one is reached."""
        waypoints = self.parameters.waypoints
        if self.navigating is not None or self.position is None or len(waypoints) < 2:
            return
        if self.reference is not None:
            if not self._arrived(self.reference):
                return
            self.next_waypoint += 1
        index = self.next_waypoint % (len(waypoints) // 2)
        goal = Point(x=waypoints[2 * index], y=waypoints[2 * index + 1])
        reference, reason = await self._plan(goal, self.parameters.max_velocity)
        if self.navigating is not None:
            return  # a goal was accepted while waiting for the planner
        self.reference = reference
        if reference is None:
            self.log.warn(f"no path to ({goal.x:.2f}, {goal.y:.2f}): {reason}")
            await self.clock.sleep(RETRY_S)
        else:
            self.log.info(f"driving to ({goal.x:.2f}, {goal.y:.2f}): {reason}")

    def accept_navigate(self, request: Navigate.Goal) -> bool:
        """Accept one goal at a time, if its target is finite and its velocity positive."""
        target = request.target
        finite = all(math.isfinite(value) for value in (target.x, target.y, target.z))
        return self.navigating is None and request.max_velocity > 0.0 and finite

    async def on_navigate(self, goal: Goal) -> Navigate.Result:
        """Drive to the target and publish feedback at 10 Hz."""
        self.navigating = goal
        try:
            return await self._navigate(goal)
        finally:
            self.navigating = None
            self.reference = None

    async def _navigate(self, goal: Goal) -> Navigate.Result:
        target: Point = goal.request.target
        started_at_m = self.distance_traveled
        self.reference, reason = await self._plan(target, goal.request.max_velocity)
        if self.reference is None or self.position is None:
            goal.abort()
            return Navigate.Result(message=reason)
        length = max(_distance(self.position, target), self.parameters.tolerance)
        while not goal.is_cancel_requested and not self._arrived(self.reference):
            share = 1.0 - _distance(self.position, target) / length
            goal.publish_feedback(
                Navigate.Feedback(
                    progress_percent=100.0 * min(max(share, 0.0), 1.0),
                    current_position=self.position,
                )
            )
            await self.clock.sleep(0.1)
        traveled = self.distance_traveled - started_at_m
        if goal.is_cancel_requested:
            goal.canceled()
            return Navigate.Result(message="canceled on the way", distance_traveled=traveled)
        return Navigate.Result(success=True, message="arrived", distance_traveled=traveled)

    async def _plan(self, goal: Point, max_velocity: float) -> tuple[Reference | None, str]:
        await self._wait_for_odometry()
        if self.position is None:
            return None, f"no odometry within {ODOMETRY_TIMEOUT_S:g} s"
        limit = min(max_velocity, self.parameters.max_velocity)
        cruise = self.parameters.cruise_share * limit
        request = PlanTrajectory.Request(start=self.position, goal=goal, max_velocity=cruise)
        try:
            response = await self.clients.plan_trajectory.call(request)
        except CallCancelled:
            raise  # this node is being deactivated
        except CallError as error:
            return None, str(error)
        if not response.success:
            return None, response.message
        return Reference(response.path, limit), response.message

    async def _wait_for_odometry(self) -> None:
        deadline_s = self.clock.now() + ODOMETRY_TIMEOUT_S
        while self.position is None and self.clock.now() < deadline_s:
            await self.clock.sleep(0.02)

    def _velocity(self, reference: Reference, position: Point) -> tuple[float, float]:
        target, velocity_x, velocity_y = reference.at(self.clock.now())
        gain = self.parameters.position_gain
        velocity_x += gain * (target.x - position.x)
        velocity_y += gain * (target.y - position.y)
        excess = math.hypot(velocity_x, velocity_y) / reference.max_velocity
        if excess > 1.0:
            velocity_x, velocity_y = velocity_x / excess, velocity_y / excess
        return velocity_x, velocity_y

    def _arrived(self, reference: Reference) -> bool:
        if self.position is None:
            return False
        return _distance(self.position, reference.end) <= self.parameters.tolerance


class Reference:
    """The position and velocity that a planned path prescribes at a given time."""

    def __init__(self, path: Path, max_velocity: float) -> None:
        self.points = [pose.pose.position for pose in path.poses]
        self.times_s = [
            pose.header.stamp.sec + pose.header.stamp.nanosec * 1e-9 for pose in path.poses
        ]
        self.end = self.points[-1]
        self.max_velocity = max_velocity

    def at(self, time_s: float) -> tuple[Point, float, float]:
        """Return the target position and velocity (x, y, in m/s) at ``time_s``."""
        index = bisect_right(self.times_s, time_s)
        if index == 0:
            return self.points[0], 0.0, 0.0
        if index == len(self.points):
            return self.end, 0.0, 0.0
        before, after = self.points[index - 1], self.points[index]
        period_s = self.times_s[index] - self.times_s[index - 1]
        share = (time_s - self.times_s[index - 1]) / period_s
        step_x, step_y = after.x - before.x, after.y - before.y
        target = Point(x=before.x + share * step_x, y=before.y + share * step_y)
        return target, step_x / period_s, step_y / period_s


def _distance(first: Point, second: Point) -> float:
    return math.hypot(second.x - first.x, second.y - first.y)

"""A straight-line planner."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Time
from composer_interfaces.srv import PlanTrajectory
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Odometry, Path

from composer.typed import PlannerBehavior

NANOSECONDS = 1_000_000_000
MAX_POINTS = 10_000


class Planner(PlannerBehavior):
    """Sample the line from start to goal, evenly in time, at the maximum velocity allowed."""

    def on_activate(self) -> None:
        """Discard odometry from before the activation."""
        self.odometry: Odometry | None = None

    def on_sensor_data(self, message: Odometry) -> None:
        """Store the latest odometry."""
        self.odometry = message

    def on_plan_trajectory(
        self, request: PlanTrajectory.Request, response: PlanTrajectory.Response
    ) -> PlanTrajectory.Response:
        """Return a path, or the reason why there is none."""
        if self.odometry is None:
            response.message = "no odometry received yet: the frame of the path is unknown"
            return response
        reason = _refusal(request) or self._too_many_points(request)
        if reason is None:
            response.path = self._path(request, self.odometry.header.frame_id)
            response.success = True
            response.message = f"{len(response.path.poses)} points"
        else:
            response.message = reason
        return response

    def _too_many_points(self, request: PlanTrajectory.Request) -> str | None:
        if self._duration_s(request) <= MAX_POINTS * self._period_s:
            return None
        return f"at this velocity, the path has more than {MAX_POINTS} points"

    def _duration_s(self, request: PlanTrajectory.Request) -> float:
        start, goal = request.start, request.goal
        velocity = min(request.max_velocity, self.parameters.max_velocity)
        return math.dist((start.x, start.y, start.z), (goal.x, goal.y, goal.z)) / velocity

    @property
    def _period_s(self) -> float:
        return self.parameters.sample_period_ms / 1000.0

    def _path(self, request: PlanTrajectory.Request, frame_id: str) -> Path:
        start, goal = request.start, request.goal
        period_s = self._period_s
        steps = max(1, math.ceil(self._duration_s(request) / period_s))
        yaw = math.atan2(goal.y - start.y, goal.x - start.x)
        path = Path()
        path.header.frame_id = frame_id
        path.header.stamp = self.clock.stamp()
        for step in range(steps + 1):
            pose = PoseStamped()
            pose.header.frame_id = path.header.frame_id
            pose.header.stamp = _later(path.header.stamp, step * period_s)
            pose.pose.position = _between(start, goal, step / steps)
            pose.pose.orientation.z = math.sin(yaw / 2.0)
            pose.pose.orientation.w = math.cos(yaw / 2.0)
            path.poses.append(pose)
        return path


def _refusal(request: PlanTrajectory.Request) -> str | None:
    if not request.max_velocity > 0.0:
        return f"max_velocity must be above 0 m/s, not {request.max_velocity}"
    points = (request.start, request.goal)
    if not all(math.isfinite(value) for p in points for value in (p.x, p.y, p.z)):
        return "start and goal must be finite"
    return None


def _between(start: Point, goal: Point, share: float) -> Point:
    return Point(
        x=start.x + share * (goal.x - start.x),
        y=start.y + share * (goal.y - start.y),
        z=start.z + share * (goal.z - start.z),
    )


def _later(stamp: Time, seconds: float) -> Time:
    nanoseconds = stamp.sec * NANOSECONDS + stamp.nanosec + round(seconds * NANOSECONDS)
    return Time(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)

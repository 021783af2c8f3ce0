"""An action server that moves a point to its target."""

from __future__ import annotations

import math

from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point

from composer.behavior import Goal
from composer.typed import NavigatorBehavior


class Navigator(NavigatorBehavior):
    """Move at the goal's velocity, publish feedback after each step, and stop when canceled."""

    def on_activate(self) -> None:
        """Start at the origin."""
        self.position = Point()

    def accept_navigate(self, request: Navigate.Goal) -> bool:
        """Accept a goal within the maximum distance if its velocity is positive."""
        distance = _distance(self.position, request.target)
        return request.max_velocity > 0.0 and distance <= self.parameters.max_distance

    async def on_navigate(self, goal: Goal) -> Navigate.Result:
        """Move in equal steps; their duration follows from the velocity."""
        start, target = self.position, goal.request.target
        distance = _distance(start, target)
        steps = self.parameters.steps
        for step in range(1, steps + 1):
            await self.clock.sleep(distance / goal.request.max_velocity / steps)
            if goal.is_cancel_requested:
                goal.canceled()
                traveled = _distance(start, self.position)
                return Navigate.Result(message="canceled on the way", distance_traveled=traveled)
            share = step / steps
            self.position = Point(
                x=start.x + share * (target.x - start.x), y=start.y + share * (target.y - start.y)
            )
            goal.publish_feedback(
                Navigate.Feedback(progress_percent=100.0 * share, current_position=self.position)
            )
        return Navigate.Result(success=True, message="arrived", distance_traveled=distance)


def _distance(first: Point, second: Point) -> float:
    return math.hypot(second.x - first.x, second.y - first.y)

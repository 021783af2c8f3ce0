"""An action client: goal, feedback, cancel, result and failures."""

from __future__ import annotations

from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point
from std_msgs.msg import String

from composer.behavior import CallError, GoalRejected, SentGoal
from composer.typed import NavigateClientBehavior


class NavigateClient(NavigateClientBehavior):
    """Send one goal after each activation and publish its outcome."""

    def on_activate(self) -> None:
        """Prepare to send the goal."""
        self.sent = False
        self.progress_percent = 0.0

    async def on_send(self) -> None:
        """Send the goal once and wait for its outcome."""
        if self.sent:
            return
        self.sent = True
        try:
            outcome = await self._navigate()
        except GoalRejected:
            outcome = "rejected"
        except CallError as error:
            self.log.error(str(error))
            outcome = "failed"
        self.log.info(f"goal {outcome}")
        self.publishers.outcome.publish(String(data=outcome))

    async def _navigate(self) -> str:
        x, y = self.parameters.target
        goal = Navigate.Goal(target=Point(x=x, y=y), max_velocity=self.parameters.max_velocity)
        sent = await self.action_clients.navigate.send_goal(goal, on_feedback=self._on_feedback)
        self.log.info(f"goal accepted: driving to ({x:.1f}, {y:.1f})")
        if self.parameters.cancel_at_percent > 0.0:
            await self._cancel_on_the_way(sent)
        ended = await sent.result()
        self.log.info(f"{ended.result.message} after {ended.result.distance_traveled:.2f} m")
        return str(ended.status)

    async def _cancel_on_the_way(self, sent: SentGoal) -> None:
        while self.progress_percent < self.parameters.cancel_at_percent:
            await self.clock.sleep(0.02)
        if not await sent.cancel():
            self.log.warn("the server rejected the cancel request")

    def _on_feedback(self, feedback: Navigate.Feedback) -> None:
        self.progress_percent = feedback.progress_percent
        self.log.info(f"{feedback.progress_percent:.0f} % of the way")

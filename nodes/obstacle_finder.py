"""Finds out where obstacles are on the map."""

from __future__ import annotations

from geometry_msgs.msg import PointStamped

from composer.behavior import TransformError
from composer.typed import ObstacleFinderBehavior


class ObstacleFinder(ObstacleFinderBehavior):
    """Transform each detection from the frame of its sensor to the map."""

    async def on_detections(self, message: PointStamped) -> None:
        """Wait until the pose of the sensor is known for the time of the detection."""
        header = message.header
        try:
            await self.transforms.wait("map", header.frame_id, stamp=header.stamp, timeout_ms=200)
        except TransformError as error:
            self.log.warn(f"ignored an obstacle: {error}")
            return
        obstacle = self.transforms.transform(message, "map")
        self.publishers.obstacles.publish(obstacle)
        self.log.info(f"obstacle at x {obstacle.point.x:.1f} m, y {obstacle.point.y:.1f} m")

"""The example system with frames of tf2."""

from __future__ import annotations

import math
import os

import pytest
from geometry_msgs.msg import PointStamped

from tests.ros.support.system_process import ExternalNode, RunningSystem

if os.environ.get("CI") != "true":
    pytest.importorskip("tf2_msgs", reason="make test builds it")


def test_an_obstacle_is_found_on_the_map(external: ExternalNode) -> None:
    found = external.listen(PointStamped, "/obstacles")
    with RunningSystem("systems/frames.yaml") as system:
        external.spin_until(lambda: len(found) >= 2)
        system.wait_for(r"obstacle_finder.*obstacle at x")
    for obstacle in found:
        assert obstacle.header.frame_id == "map"
        assert obstacle.point.z == pytest.approx(0.3)
        # The robot drives around this point, which is always 2 m to its left.
        distance_m = math.hypot(obstacle.point.x - 10.0, obstacle.point.y - 7.0)
        assert distance_m == pytest.approx(math.hypot(0.2, 1.5 - 2.0), abs=1e-3)
    assert found[0].point != found[1].point

"""The generated classes have exactly the fields that systems and people rely on."""

from __future__ import annotations

from composer_interfaces.action import Navigate
from composer_interfaces.srv import PlanTrajectory


def _fields(message) -> dict[str, str]:
    return message.get_fields_and_field_types()


def test_plan_trajectory() -> None:
    assert _fields(PlanTrajectory.Request) == {
        "start": "geometry_msgs/Point",
        "goal": "geometry_msgs/Point",
        "max_velocity": "double",
    }
    assert _fields(PlanTrajectory.Response) == {
        "path": "nav_msgs/Path",
        "success": "boolean",
        "message": "string",
    }


def test_navigate() -> None:
    assert _fields(Navigate.Goal) == {"target": "geometry_msgs/Point", "max_velocity": "double"}
    assert _fields(Navigate.Result) == {
        "success": "boolean",
        "message": "string",
        "distance_traveled": "double",
    }
    assert _fields(Navigate.Feedback) == {
        "progress_percent": "double",
        "current_position": "geometry_msgs/Point",
    }

"""Expressions over real messages: properties, numpy arrays, array.array, bytes, constants."""

from __future__ import annotations

from array import array
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Image
from std_msgs.msg import ByteMultiArray

from composer.language.expressions import EvaluationError, compile_expression
from composer.language.expressions.expression import message_fields


def odometry() -> Odometry:
    message = Odometry()
    message.twist.twist.linear.x = 4.0
    message.pose.covariance[7] = 0.25
    message.child_frame_id = "base"
    message.header.stamp.sec = 12
    return message


def scope() -> dict[str, Any]:
    path = Path(poses=[PoseStamped(), PoseStamped()])
    path.poses[1].pose.position.y = 2.5
    return {
        "message": odometry(),
        "path": path,
        "image": Image(data=array("B", [1, 2, 255])),
        "diagnostics": DiagnosticArray(status=[DiagnosticStatus(level=DiagnosticStatus.ERROR)]),
        "raw": ByteMultiArray(data=[b"\x07"]),
    }


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("message.twist.twist.linear.x * 0.5", 2.0),
        ("message.pose.covariance[7] * 2", 0.5),
        ("message.pose.covariance[-1]", 0.0),
        ("max(message.pose.covariance)", 0.25),
        ("len(message.pose.covariance)", 36),
        ("0.25 in message.pose.covariance", True),
        ("message.child_frame_id == 'base'", True),
        ("message.header.stamp.sec // 5", 2),
        ("path.poses[-1].pose.position.y", 2.5),
        ("len(path.poses)", 2),
        ("image.data[2] + 1", 256),
        ("min(image.data)", 1),
        ("diagnostics.status[0].level >= 2", True),
        ("diagnostics.status[0].level", 2),
        ("raw.data[0] * 2", 14),
    ],
)
def test_value(source: str, expected: object) -> None:
    value = compile_expression(source).evaluate(scope())
    assert value == expected
    assert type(value) is type(expected)


def test_a_whole_message_is_the_very_message() -> None:
    values = scope()
    assert compile_expression("message").evaluate(values) is values["message"]
    assert compile_expression("path.poses").evaluate(values) is values["path"].poses


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("message.get_fields_and_field_types", "Odometry has no field"),
        ("message.SLOT_TYPES", "Odometry has no field 'SLOT_TYPES'"),
        ("diagnostics.status[0].ERROR", "DiagnosticStatus has no field 'ERROR'"),
        ("image.data.tolist", "a list has no field 'tolist'"),
        ("message.pose.covariance.size", "a list has no field 'size'"),
        ("message.pose.covariance[36]", "there is no element 36 in a list of 36"),
        ("message.pose.covariance > 1", "a list cannot be compared"),
        ("message.pose.covariance * 2", "a list where a number is expected"),
        ("not message.pose.covariance", "not defined for this value"),
        ("str(message)", "Odometry cannot be compared"),
    ],
)
def test_attributes_other_than_fields_are_refused(source: str, reason: str) -> None:
    with pytest.raises(EvaluationError) as caught:
        compile_expression(source).evaluate(scope())
    assert reason in str(caught.value)


def test_the_fields_of_a_class_are_those_it_declares() -> None:
    assert message_fields(Odometry) == frozenset(Odometry.get_fields_and_field_types())

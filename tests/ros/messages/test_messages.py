"""Template values become ROS messages; expressions over real messages, and their rates."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Duration, Time
from composer_interfaces.srv import PlanTrajectory
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovariance, Quaternion
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from sensor_msgs.msg import BatteryState, Image, JointState
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Bool, Byte, ByteMultiArray, Float64, Header, Int8, String, UInt64

from composer.client.messages.topics import RateStatistics, RateWindow
from composer.client.messages.values import InvalidValueError, build_message
from composer.language.document import parse_bytes
from composer.language.expressions import EvaluationError, compile_expression
from composer.language.expressions.expression import message_fields
from composer.language.templates import Template, compile_template
from composer.runtime.ros.messages import (
    MessageError,
    compile_message,
    interface_class,
)

WHERE = "'publish' to 'output'"
AHEAD = Pose(position=Point(x=7.0))
TURNED = Pose(position=Point(x=7.0), orientation=Quaternion(z=1.0))
QUARTER = Header(stamp=Time(nanosec=250_000_000))


def template(text: str) -> Template:
    tree, _, diagnostics = parse_bytes(f"value: {text}".encode(), "test.yaml")
    assert tree is not None, diagnostics
    value = tree.get("value")
    assert value is not None
    compiled, problems = compile_template(value)
    assert compiled is not None, problems
    return compiled


def message(text: str, kind: Any, **scope: Any) -> Any:
    return compile_message(template(text), kind, WHERE)(scope)


@pytest.mark.parametrize(
    ("text", "kind", "expected"),
    [
        ("{data: 3}", Float64, Float64(data=3.0)),
        ("{data: '{x * 2}'}", Float64, Float64(data=14.0)),
        ("{data: 'x is {x:03d}'}", String, String(data="x is 007")),
        ("{data: '{x > 6}'}", Bool, Bool(data=True)),
        ("{data: -128}", Int8, Int8(data=-128)),
        ("{data: 18446744073709551615}", UInt64, UInt64(data=2**64 - 1)),
        ("{data: 7}", Byte, Byte(data=b"\x07")),
        ("{stamp: 1.5}", Header, Header(stamp=Time(sec=1, nanosec=500_000_000))),
        ("{stamp: {sec: 3}}", Header, Header(stamp=Time(sec=3))),
        ("{sec: '{x}'}", Duration, Duration(sec=7)),
        ("{position: [1, '{x}']}", JointState, JointState(position=[1.0, 7.0])),
        ("{}", Odometry, Odometry()),
        (
            "{pose: {pose: {position: {x: '{x}'}, orientation: {z: 1}}}, header: {frame_id: odom}}",
            Odometry,
            Odometry(header=Header(frame_id="odom"), pose=PoseWithCovariance(pose=TURNED)),
        ),
        (
            "{poses: [{pose: {position: {x: '{x}'}}}, {header: {stamp: 0.25}}]}",
            PathMessage,
            PathMessage(poses=[PoseStamped(pose=AHEAD), PoseStamped(header=QUARTER)]),
        ),
    ],
)
def test_values_become_fields(text: str, kind: Any, expected: Any) -> None:
    assert message(text, kind, x=7) == expected


def test_numbers_of_messages_need_not_be_finite() -> None:
    built = build_message("{position: [.inf, -.inf, .nan]}", JointState, "the message")
    assert [str(item) for item in built.position] == ["inf", "-inf", "nan"]
    with pytest.raises(InvalidValueError, match="takes an integer, not float nan"):
        build_message("{sec: .nan}", Time, "the message")


def test_a_whole_message_is_passed_unchanged_and_others_are_new_objects() -> None:
    received = Image(data=array("B", b"\x01\x02"), width=2)
    assert message("'{message}'", Image, message=received) is received
    assert message("{data: '{message.data}'}", Image, message=received).data == received.data
    build = compile_message(template("{frame_id: map}"), Header, WHERE)
    build({}).frame_id = "changed"
    assert build({}).frame_id == "map"


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        ("{data: text}", Float64, "field data takes a number, not str 'text'"),
        ("{data: true}", Float64, "field data takes a number, not bool True"),
        ("{data: 1.0}", Int8, "field data takes an integer, not float 1.0"),
        ("{data: 128}", Int8, "field data takes an integer from -128 to 127, not 128"),
        ("{data: 1}", Bool, "field data takes a boolean, not int 1"),
        ("{data: 1}", String, "field data takes a string, not int 1"),
        ("{data: '{x}'}", String, "field data takes a string, not int 7"),
        ("{dat: 1}", Float64, "std_msgs/Float64 has no field 'dat'"),
        ("{data: {a: 1}}", Float64, "field data is a double, not a map of fields"),
        ("{data: [1]}", Float64, "field data is a double, not a list"),
        ("{header: 1}", Odometry, "field header takes a std_msgs/Header, not int 1"),
        ("{header: {frame_id: 1}}", Odometry, "field header.frame_id takes a string"),
        ("{stamp: soon}", Header, "field stamp takes a builtin_interfaces/Time, not str 'soon'"),
        ("{stamp: 1.0e12}", Header, "field stamp takes seconds from -2147483648 to 2147483647"),
        ("{stamp: true}", Header, "field stamp takes seconds"),
        ("{poses: [{pose: 1}]}", PathMessage, "field poses[0].pose takes a geometry_msgs/Pose"),
        ("{covariance: [1, 2]}", PoseWithCovariance, "field covariance takes 36 items, not 2"),
        ("{dimensions: [1, 2, 3, 4]}", SolidPrimitive, "field dimensions takes up to 3 items"),
        ("{position: [1, x]}", JointState, "field position[1] takes a number"),
        ("{name: abc}", JointState, "field name takes a list, not str 'abc'"),
        ("'{x}'", Float64, "takes a std_msgs/Float64, not int 7"),
        ("text", Float64, "std_msgs/Float64 is made of a map of fields"),
    ],
)
def test_values_that_do_not_fit_are_errors_with_the_name_of_the_field(
    text: str, kind: Any, words: str
) -> None:
    with pytest.raises(MessageError) as error:
        message(text, kind, x=7)
    assert str(error.value).startswith(WHERE)
    assert words in str(error.value)


def test_constants_are_checked_when_the_template_is_compiled() -> None:
    with pytest.raises(MessageError):
        compile_message(template("{cell_voltage: [1, x]}"), BatteryState, WHERE)({})
    with pytest.raises(MessageError):
        compile_message(template("{present: 1}"), BatteryState, WHERE)


def test_plain_data_becomes_a_message() -> None:
    plain = {"start": {"x": 1}, "max_velocity": 2}
    request = message("'{plain}'", PlanTrajectory.Request, plain=plain)
    assert (request.start.x, request.max_velocity) == (1.0, 2.0)
    with pytest.raises(MessageError, match=r"goal\.z takes a number"):
        message("'{plain}'", PlanTrajectory.Request, plain={"goal": {"z": "up"}})


def test_a_missing_interface_is_an_error(tmp_path: Path) -> None:
    assert interface_class("std_msgs/msg/String") is String
    for name in ("nowhere/msg/String", "std_msgs/msg/Strin", "std_msgs/srv/String", "String"):
        with pytest.raises(MessageError, match=f"'{name}'"):
            interface_class(name)


def test_only_packages_in_the_ament_index_are_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any node in the ROS graph can announce a topic of any type."""
    package = tmp_path / "trap_msgs"
    package.mkdir()
    imported = tmp_path / "imported"
    package.joinpath("__init__.py").write_text(f"open({str(imported)!r}, 'w')", encoding="utf-8")
    package.joinpath("msg.py").write_text("class Any: pass", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    names = (
        "trap_msgs/msg/Any",
        "trap_msgs/../Any",
        "/msg/Any",
        "std_msgs.msg/msg/String",
        "a\n/b/c",
    )
    for name in names:
        with pytest.raises(MessageError):
            interface_class(name)
    assert not imported.exists()


def rate_of(size: int, times_s: Iterable[float]) -> RateStatistics:
    """Return what a window of this size measures in the end."""
    window = RateWindow(size)
    assert window.statistics() is None
    for at_s in times_s:
        window.add(at_s)
    rate = window.statistics()
    assert rate is not None
    return rate


def test_rates() -> None:
    rate = rate_of(100, (10.0, 10.1, 10.2, 10.5))
    assert rate.average_hz == pytest.approx(3 / 0.5)
    assert (rate.shortest_s, rate.longest_s) == (pytest.approx(0.1), pytest.approx(0.3))
    assert rate.deviation_s == pytest.approx(0.0942809)
    assert rate.window == 3
    # A window keeps the last messages.
    rate = rate_of(2, (0.0, 100.0, 100.5, 101.0))
    assert (rate.average_hz, rate.window) == (2.0, 2)
    rate = rate_of(3, (number / 1000 for number in range(1000)))
    assert (rate.average_hz, rate.window) == (pytest.approx(1000.0, rel=0.02), 3)


def test_bursts_have_the_rate_of_their_messages() -> None:
    for size in (1, 4, 7, 100):
        window = RateWindow(size)
        for second in range(12):
            for at_s in (second, second + 0.0004):
                window.add(at_s)
                rate = window.statistics()
                assert (rate is None) == (second == 0)
                assert rate is None or rate.average_hz == pytest.approx(2.0)


def odometry() -> Odometry:
    message = Odometry()
    message.twist.twist.linear.x = 4.0
    message.pose.covariance[7] = 0.25
    message.child_frame_id = "base"
    message.header.stamp.sec = 12
    return message


def scope() -> dict[str, Any]:
    path = PathMessage(poses=[PoseStamped(), PoseStamped()])
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

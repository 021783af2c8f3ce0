"""The field checker accepts exactly the values that the runtime accepts, for random messages."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from composer.interfaces import Interfaces
from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.types import INTEGER, NUMBER, STRING, Scope, type_of
from composer.language.expressions import EvaluationError
from composer.runtime.ros.messages import MessageError, compile_message, interface_class
from tests.examples import examples
from tests.unit.support.field_types import template

INTERFACES = Interfaces.load()
MESSAGES = (
    *(f"std_msgs/msg/{name}" for name in ("Bool", "Byte", "Char", "Int8", "UInt8", "Int16")),
    *(f"std_msgs/msg/{name}" for name in ("UInt64", "Int64", "Float32", "Float64", "String")),
    *(f"std_msgs/msg/{name}" for name in ("Header", "UInt8MultiArray", "ByteMultiArray", "Empty")),
    "builtin_interfaces/msg/Duration",
    "geometry_msgs/msg/Point",
    "geometry_msgs/msg/PoseWithCovariance",
    "geometry_msgs/msg/Polygon",
    "nav_msgs/msg/Path",
    "rcl_interfaces/msg/ParameterDescriptor",
    "shape_msgs/msg/SolidPrimitive",
    "type_description_interfaces/msg/FieldType",
)
SCOPE: Scope = {
    "count": INTEGER,
    "now": NUMBER,
    "node": STRING,
    "state": {"last": type_of(1.0), "on": type_of(True)},
}
VALUES: dict[str, Any] = {
    "count": 7,
    "now": 2.5,
    "node": "/a",
    "state": {"last": 2.5, "on": True},
}

SCALARS = st.one_of(
    st.sampled_from([True, 0, 1, -1, 255, 256, 2**31, -(2**63), 2**64 - 1, 2**64]),
    # Not beyond float32: the runtime lets rclpy turn that into infinity, the checker refuses it.
    st.sampled_from([0.0, 2.5, -1e38, 3e38, 1e10]),
    st.sampled_from(["", "text", "a" * 256, "{node}", "{node}!", "{now} s"]),
    st.sampled_from(["{count}", "{now}", "{count / 2}", "{count > 1}", "{state.on}"]),
    st.sampled_from(["{round(now)}", "{str(count)}", "{state.last * 2}", "{'a' in node}"]),
)
FIELDS = st.sampled_from(
    (
        *("data", "x", "y", "z", "points", "poses", "pose", "position", "covariance", "header"),
        *("stamp", "frame_id", "sec", "nanosec", "name", "type", "read_only", "step", "layout"),
        *("floating_point_range", "from_value", "type_id", "capacity", "nested_type_name"),
        *("dimensions", "polygon"),
    )
)
CONTENT = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(FIELDS, inner, min_size=1, max_size=2)
    ),
    max_leaves=8,
)


def taken_by_the_runtime(value: Any, name: str) -> bool:
    try:
        compile_message(template(value), interface_class(name), "'test'")(VALUES)
    except (MessageError, EvaluationError):
        return False
    return True


@examples(400)
@given(st.dictionaries(FIELDS, CONTENT, max_size=2), st.sampled_from(MESSAGES))
def test_checker_and_runtime_agree(value: dict[str, Any], name: str) -> None:
    message = INTERFACES.message(name)
    assert message is not None
    problems = list(FieldChecker(INTERFACES, SCOPE).template(template(value), message))
    assert taken_by_the_runtime(value, name) == (not problems), problems


@examples(400)
@given(CONTENT, st.sampled_from(MESSAGES), st.data())
def test_checker_and_runtime_agree_on_fields(value: Any, name: str, data: st.DataObject) -> None:
    message = INTERFACES.message(name)
    assert message is not None
    if not message.fields:
        return
    field = data.draw(st.sampled_from(message.field_names))
    problems = list(FieldChecker(INTERFACES, SCOPE).template(template({field: value}), message))
    assert taken_by_the_runtime({field: value}, name) == (not problems), problems

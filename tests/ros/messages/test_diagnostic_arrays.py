"""Serialized arrays of statuses are written and read as rclpy does it; others are refused."""

from __future__ import annotations

import struct
from contextlib import suppress

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time

from composer.runtime.ros.diagnostic_arrays import Status, read_array, write_array

#: DDS strings have no zeros.
TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
STATUSES = st.lists(
    st.builds(Status, st.integers(0, 255), TEXTS, TEXTS, TEXTS, st.dictionaries(TEXTS, TEXTS)),
    max_size=4,
)
STAMP_NS = 7_250_000_000
#: A message of another order of bytes: the time 1.5 s, no frame id, and one status.
BIG_ENDIAN = (
    bytes((0, 0, 0, 0))
    + struct.pack(">iI", 1, 500_000_000)
    + struct.pack(">I4s", 1, b"")
    + struct.pack(">I", 1)
    + struct.pack(">B3xI4s", 3, 2, b"n")
    + struct.pack(">I4s", 2, b"m")
    + struct.pack(">I4sI", 1, b"", 1)
    + struct.pack(">I4sI4s", 4, b"key", 3, b"is")
)


def serialized(statuses: list[Status], frame: str = "") -> bytes:
    """Return what rclpy makes of the statuses."""
    message = DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=bytes((item.level,)),
                name=item.name,
                message=item.message,
                hardware_id=item.hardware_id,
                values=[KeyValue(key=key, value=value) for key, value in item.values.items()],
            )
            for item in statuses
        ]
    )
    message.header.frame_id = frame
    message.header.stamp = Time(nanoseconds=STAMP_NS).to_msg()
    return serialize_message(message)


@given(STATUSES)
def test_statuses_are_written_as_rclpy_does_it(statuses: list[Status]) -> None:
    # Not compared as bytes: what rclpy leaves between aligned values is not always zero.
    written, expected = write_array(STAMP_NS, statuses), serialized(statuses)
    assert len(written) == len(expected)
    assert deserialize_message(written, DiagnosticArray) == deserialize_message(
        expected, DiagnosticArray
    )


@given(STATUSES, TEXTS)
def test_what_rclpy_has_written_is_read(statuses: list[Status], frame: str) -> None:
    assert read_array(serialized(statuses, frame)) == (7.25, statuses)


def test_texts_that_dds_lacks_end_or_are_replaced() -> None:
    content = write_array(0, [Status(0, "a\0b", "\ud800", "", {"key": "one\0two"})])
    assert read_array(content)[1] == [Status(0, "a", "?", "", {"key": "one"})]
    assert deserialize_message(content, DiagnosticArray).status[0].message == "?"


def test_the_order_of_bytes_is_that_of_the_message() -> None:
    assert read_array(BIG_ENDIAN) == (1.5, [Status(3, "n", "m", "", {"key": "is"})])


@given(st.binary(max_size=80).map(lambda end: bytes((0, 1, 0, 0)) + end))
def test_other_bytes_are_read_or_refused(content: bytes) -> None:
    with suppress(ValueError):
        read_array(content)


@pytest.mark.parametrize("content", [b"", b"\0\1", b"\0\7\0\0" + bytes(40), b"\0\1\0\0" + bytes(8)])
def test_anything_but_plain_cdr_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"it (is not serialized as CDR|ends early)"):
        read_array(content)

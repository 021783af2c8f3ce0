"""Frames, schemas and channels of the Foxglove protocol, without ROS."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.dashboard.foxglove.catalog import changes
from composer.dashboard.foxglove.encoding import (
    ClientMessage,
    Schemas,
    ServiceCall,
    message_data,
    parse_binary,
    parse_text,
    service_response,
    time_frame,
)
from composer.dashboard.protocol.messages import BadRequestError
from composer.interfaces import Interfaces

BETWEEN = "=" * 80


def test_frames_of_the_server() -> None:
    assert (
        message_data(7, 2**40, b"cdr") == b"\x01\x07\0\0\0" + (2**40).to_bytes(8, "little") + b"cdr"
    )
    assert time_frame(5) == b"\x02\x05" + bytes(7)
    call = ServiceCall(1, 2, "cdr", b"")
    assert service_response(call, b"x") == b"\x03\x01\0\0\0\x02\0\0\0\x03\0\0\0cdrx"


MALFORMED = (
    (b"", "an empty message is not known"),
    (b"\x03abc", "a binary message with opcode 3 is not known"),
    (b"\x01ab", "a binary message with opcode 1 ends after 3 bytes"),
    (b"\x02" + bytes(8), "a binary message with opcode 2 ends after 9 bytes"),
    (b"\x02" + struct.pack("<III", 1, 2, 9) + b"cdr", "ends after 16 bytes"),
)


def test_frames_of_clients() -> None:
    assert parse_binary(b"\x01\x05\0\0\0abc") == ClientMessage(5, b"abc")
    frame = b"\x02" + struct.pack("<III", 1, 2, 3) + b"cdrdata"
    assert parse_binary(frame) == ServiceCall(1, 2, "cdr", b"data")
    for malformed, reason in MALFORMED:
        with pytest.raises(BadRequestError, match=reason):
            parse_binary(malformed)


@given(st.binary(max_size=40) | st.text(max_size=60))
def test_any_message_is_understood_or_refused(message: bytes | str) -> None:
    with suppress(BadRequestError):
        parse_binary(message) if isinstance(message, bytes) else parse_text(message)


def schemas(tmp_path: Path, **files: str) -> Schemas:
    """Return the schemas of a package ``own`` with these files; ``__`` in a name is a slash."""
    (tmp_path / "package.xml").write_text("<package><name>own</name></package>")
    for name, text in files.items():
        path = tmp_path / (name.replace("__", "/") + (".srv" if name.startswith("srv") else ".msg"))
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return Schemas(Interfaces.load([tmp_path]))


def test_a_schema_has_everything_in_it_once(tmp_path: Path) -> None:
    found = schemas(
        tmp_path,
        msg__Outer="Inner a  # relative\nInner[<=3] b\nstd_msgs/Header header\n",
        msg__Inner="string<=5 name\n",
    )
    assert found.message("own/msg/Outer") == (
        "own/Inner a\nown/Inner[<=3] b\nstd_msgs/Header header\n"
        f"{BETWEEN}\nMSG: own/Inner\nstring<=5 name\n"
        f"{BETWEEN}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
        f"{BETWEEN}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    )


def test_constants_and_defaults(tmp_path: Path) -> None:
    text = (
        "uint8 LOW=1\nstring TEXT='a \"b\"'\nbool ON=true\n"
        'string name "x"\nfloat64[2] pair [1.0, 2.5]\nbool flag true\n'
    )
    assert schemas(tmp_path, msg__A=text).message("own/msg/A") == (
        'uint8 LOW=1\nstring TEXT="a \\"b\\""\nbool ON=true\n'
        'string name "x"\nfloat64[2] pair [1.0, 2.5]\nbool flag true\n'
    )


def test_services_have_two_schemas_and_what_is_not_known_has_none(tmp_path: Path) -> None:
    lacks = "missing_msgs/B b\n"
    found = schemas(
        tmp_path, srv__S="bool a\n---\nstring b\n", msg__A=lacks, srv__T=f"bool a\n---\n{lacks}"
    )
    assert found.service("own/srv/S") == ("bool a\n", "string b\n")
    assert found.message("own/msg/A") is None
    assert found.message("own/msg/Missing") is None
    assert found.service("own/srv/T") is None
    assert found.service("own/msg/A") is None


def test_changes() -> None:
    assert changes({1: "a", 2: "b"}, {2: "b", 3: "c"}) == ([1], ["c"])

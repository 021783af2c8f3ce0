"""Files that are missing, are none, or are not text."""

from __future__ import annotations

import os
import socket
import tempfile
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.language.document import parse_bytes, read_document
from composer.language.document.limits import MAX_BYTES


def diagnostic_for(path: Path) -> Diagnostic:
    tree, _, (diagnostic,) = read_document(path, "robot.yaml")
    assert tree is None
    return diagnostic


def test_reads_a_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("a: 1\n")
    tree, source, diagnostics = read_document(path)
    assert tree is not None
    assert (source.path, source.text, diagnostics) == (str(path), "a: 1\n", [])


def test_shows_the_given_name(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("a: [")
    diagnostic = diagnostic_for(tmp_path / "robot.yaml")
    assert str(diagnostic.primary) == "robot.yaml:1:4"


def test_follows_a_symbolic_link(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("a: 1")
    link = tmp_path / "link.yaml"
    link.symlink_to("robot.yaml")
    assert read_document(link)[2] == []


def test_missing_file_names_a_similar_one(tmp_path: Path) -> None:
    (tmp_path / "pipeline.yaml").touch()
    diagnostic = diagnostic_for(tmp_path / "pipline.yaml")
    assert diagnostic.message == "there is no such file"
    assert str(diagnostic.hint).endswith("pipeline.yaml'?")
    assert diagnostic_for(tmp_path / "nowhere" / "x.yaml").hint is None


def test_folder(tmp_path: Path) -> None:
    assert diagnostic_for(tmp_path).message == "expected a file, found a folder"


def test_link_in_a_circle(tmp_path: Path) -> None:
    link = tmp_path / "link.yaml"
    link.symlink_to(link)
    assert diagnostic_for(link).message.startswith("this file cannot be read: ")


def test_name_that_cannot_be_one() -> None:
    assert diagnostic_for(Path("a\0b")).rule.name == "unreadable-file"
    assert diagnostic_for(Path("a" * 5000)).rule.name == "unreadable-file"


def test_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    assert diagnostic_for(tmp_path / "pipe.yaml").message == "expected a file, found a pipe"


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null", "/dev/tty"])
def test_device_is_not_opened(device: str) -> None:
    assert diagnostic_for(Path(device)).message == "expected a file, found a device"


def test_socket() -> None:
    # In a folder of its own with a short name: socket names have 107 characters at most.
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as server:
        server.bind(f"{folder}/s.yaml")
        assert diagnostic_for(Path(folder) / "s.yaml").message == "expected a file, found a socket"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_no_permission(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.touch(mode=0)
    assert diagnostic_for(path).message == "this file cannot be read: Permission denied"


def test_large_file_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    with path.open("wb") as file:
        file.truncate(100_000_000_000)  # holes: takes no room
    diagnostic = diagnostic_for(path)
    assert (diagnostic.rule.name, str(diagnostic.primary)) == ("too-large", "robot.yaml:1:1")


def test_largest_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_bytes(b"a: 1 #".ljust(MAX_BYTES, b"x"))
    assert read_document(path)[2] == []
    path.write_bytes(b"a: 1 #".ljust(MAX_BYTES + 1, b"x"))
    assert diagnostic_for(path).rule.name == "too-large"


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="there is no /proc")
def test_file_that_says_it_is_empty_and_is_not() -> None:
    _, source, _ = read_document(Path("/proc/self/status"))
    assert source.text.startswith("Name:")


@pytest.mark.parametrize(
    ("data", "place", "message"),
    [
        (b"a: caf\xe9", "f:1:7", "the byte 0xe9 is not UTF-8"),
        ("a: é\nb: ".encode() + b"\xff", "f:2:4", "the byte 0xff is not UTF-8"),
        (b"\xef\xbb\xbfa: \x80", "f:1:4", "the byte 0x80 is not UTF-8"),
        (b"a: \xc3", "f:1:4", "the byte 0xc3 is not UTF-8"),
        (b"a: \xed\xa0\x80", "f:1:4", "the byte 0xed is not UTF-8"),
        ("a: 1".encode("utf-16"), "f:1:1", "this file is UTF-16, not UTF-8"),
        (b"\xfe\xff\x00a", "f:1:1", "this file is UTF-16, not UTF-8"),
        ("a: é".encode("utf-16-le"), "f:1:7", "the byte 0xe9 is not UTF-8"),
    ],
)
def test_not_utf8(data: bytes, place: str, message: str) -> None:
    tree, _, (diagnostic,) = parse_bytes(data, "f")
    assert tree is None
    assert (diagnostic.rule.name, str(diagnostic.primary), diagnostic.message) == (
        "unreadable-file",
        place,
        message,
    )

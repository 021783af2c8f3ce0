"""Files that are missing, are none, or are not text."""

from __future__ import annotations

import os
import socket
import tempfile
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.language.document import parse_bytes, read_document
from composer.language.rules import MAX_BYTES


def diagnostic_for(path: Path) -> Diagnostic:
    tree, _, (diagnostic,) = read_document(path, "robot.yaml")
    assert tree is None
    return diagnostic


def test_reads_a_file_and_follows_a_symbolic_link(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("a: 1\n")
    (tmp_path / "link.yaml").symlink_to("robot.yaml")
    for name in (path, tmp_path / "link.yaml"):
        tree, source, diagnostics = read_document(name)
        assert tree is not None
        assert (source.path, source.text, diagnostics) == (str(name), "a: 1\n", [])
    path.write_text("a: [")
    assert str(diagnostic_for(path).primary) == "robot.yaml:1:4"


def test_missing_file_names_a_similar_one(tmp_path: Path) -> None:
    (tmp_path / "pipeline.yaml").touch()
    diagnostic = diagnostic_for(tmp_path / "pipline.yaml")
    assert diagnostic.message == "there is no such file"
    assert str(diagnostic.hint).endswith("pipeline.yaml'?")
    assert diagnostic_for(tmp_path / "nowhere" / "x.yaml").hint is None


def test_folders_pipes_and_devices_are_not_opened(tmp_path: Path) -> None:
    assert diagnostic_for(tmp_path).message == "expected a file, found a folder"
    os.mkfifo(tmp_path / "pipe.yaml")
    assert diagnostic_for(tmp_path / "pipe.yaml").message == "expected a file, found a pipe"
    for device in ("/dev/zero", "/dev/null", "/dev/tty"):
        assert diagnostic_for(Path(device)).message == "expected a file, found a device"
    link = tmp_path / "link.yaml"
    link.symlink_to(link)
    assert diagnostic_for(link).message.startswith("this file cannot be read: ")
    for name in ("a\0b", "a" * 5000):
        assert diagnostic_for(Path(name)).rule.name == "unreadable-file"


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


def test_a_file_may_be_as_large_as_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_bytes(b"a: 1 #".ljust(MAX_BYTES, b"x"))
    assert read_document(path)[2] == []
    for size in (MAX_BYTES + 1, 100_000_000_000):
        with path.open("r+b") as file:
            file.truncate(size)  # holes: takes no room, and is not read
        diagnostic = diagnostic_for(path)
        assert (diagnostic.rule.name, str(diagnostic.primary)) == ("too-large", "robot.yaml:1:1")


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
    tree, _, [found] = parse_bytes(data, "f")
    assert tree is None
    assert (found.rule.name, str(found.primary), found.message) == (
        "unreadable-file",
        place,
        message,
    )

from __future__ import annotations

import os
import resource
import socket
from pathlib import Path

import pytest

from composer.base import folders
from composer.base.files import FileTooLargeError, NotRegularError, read_regular, write_whole


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "text").write_bytes(b"12345")
    (tmp_path / "link").symlink_to("text")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "zeros").symlink_to("/dev/zero")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
    return tmp_path


@pytest.mark.parametrize("name", ["text", "link"])
def test_regular_files_are_read(folder: Path, name: str) -> None:
    assert read_regular(folder / name, 5) == b"12345"
    with pytest.raises(FileTooLargeError, match="larger than 4 bytes"):
        read_regular(folder / name, 4)


@pytest.mark.parametrize(
    ("name", "kind"),
    [("pipe", "a pipe"), ("zeros", "a device"), ("folder", "a folder"), ("socket", "a socket")],
)
def test_nothing_else_is_opened(folder: Path, name: str, kind: str) -> None:
    with pytest.raises(NotRegularError, match=f"expected a file, found {kind}"):
        read_regular(folder / name, 5)


@pytest.mark.parametrize("name", ["nowhere", "dangling", "loop", "text/below"])
def test_a_path_that_leads_nowhere(folder: Path, name: str) -> None:
    with pytest.raises(OSError, match=name):
        read_regular(folder / name, 5)


def test_a_full_disk_leaves_no_part_of_a_file(folder: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OSError, match=r"File too large: '.*new'"):
            write_whole(folder / "new", "x" * 20_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not (folder / "new").exists()


def test_the_share_folder_of_a_wheel_wins_over_folders_next_to_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "site-packages" / "composer"
    for folder in (package / "share" / "nodes", package.parent / "nodes"):
        folder.mkdir(parents=True)
    monkeypatch.setattr(folders, "PACKAGE", package)
    assert folders.nodes_folder() == package / "share" / "nodes"

"""Files that commands write: all or none."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.bridges import scaffolding
from composer.cli.commands.interface import complete_package
from composer.cli.support.errors import CommandError
from composer.cli.support.new_files import write_files


def contents(root: Path) -> dict[str, str]:
    """Return all files below a folder, with hidden ones; folders have an empty name at the end."""
    return {
        f"{path.relative_to(root)}{'/' * path.is_dir()}": "" if path.is_dir() else path.read_text()
        for path in sorted(root.rglob("*"))
    }


def test_new_files_are_written_with_their_folders(tmp_path: Path) -> None:
    write_files(tmp_path, {"a/b/c.yaml": "c", "d.yaml": "d"}, replace=False)
    assert contents(tmp_path) == {"a/": "", "a/b/": "", "a/b/c.yaml": "c", "d.yaml": "d"}
    mask = os.umask(0)
    os.umask(mask)
    assert (tmp_path / "d.yaml").stat().st_mode & 0o777 == 0o666 & ~mask


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("file/x.yaml", r"cannot write '.*file/x.yaml': Not a directory"),
        ("link", "link' exists already"),  # exists() says no: it appears meanwhile
    ],
)
def test_nothing_is_left_if_a_new_file_cannot_be_written(
    tmp_path: Path, name: str, problem: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(CommandError, match=problem):
        write_files(tmp_path, {"a/b/c.yaml": "c", name: "x"}, replace=False)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "link"]
    assert (tmp_path / "file").read_text() == "in the way"


def test_exports_replace_all_files_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"first": "new", "sub/second": "new", "third": "new"}
    (tmp_path / "first").write_text("old")
    (tmp_path / "sub").write_text("in the way")
    with pytest.raises(CommandError, match=r"cannot write '.*: Not a dir"):
        write_files(tmp_path, files, replace=True)
    assert contents(tmp_path) == {"first": "old", "sub": "in the way"}
    (tmp_path / "sub").unlink()
    replace = Path.replace

    def fails(path: Path, target: Path) -> Path:
        if target.name == "third":
            raise OSError(28, "No space left on device")
        return replace(path, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", fails)
        with pytest.raises(CommandError, match=r"cannot write '.*: No space"):
            write_files(tmp_path, files, replace=True)
    assert contents(tmp_path) == {"first": "old"}
    write_files(tmp_path, files, replace=True)
    assert contents(tmp_path) == {**files, "sub/": ""}


@pytest.mark.parametrize(
    "name", ["../x", "a/../../x", "{outside}/x", "link/x", "link/new/x", "a/..", "..", "."]
)
def test_files_outside_the_folder_are_not_written(tmp_path: Path, name: str) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    root.mkdir()
    outside.mkdir()
    (root / "link").symlink_to(outside)
    before = contents(tmp_path)
    with pytest.raises(CommandError, match=r"is not in the folder '.*root'"):
        write_files(root, {"first": "x", name.format(outside=outside): "x"}, replace=True)
    assert contents(tmp_path) == before
    write_files(root / "link", {"x": "x"}, replace=True)  # the user has named the link
    assert (outside / "x").read_text() == "x"


@pytest.mark.parametrize("replace", [False, True])
def test_folders_and_devices_are_not_replaced(tmp_path: Path, replace: bool) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "device").symlink_to("/dev/zero")  # endless if it is read
    for name in ("folder", "device"):
        with pytest.raises(CommandError, match=f"{name}': it is not a regular file"):
            write_files(tmp_path, {"first": "new", name: "new"}, replace=replace)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["device", "folder"]


def test_an_interface_package_stays_if_it_cannot_be_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "build" / "tf2_msgs"
    complete_package("tf2_msgs", None, target, for_pip=False)
    (target / "old").touch()
    before = contents(tmp_path)

    class Package:
        def files(self, _: object) -> dict[str, str]:
            return {"a": "a", "a/b": "b"}  # no folder and file of one name

    monkeypatch.setattr(scaffolding, "bundled_package", lambda _: Package())
    with pytest.raises(CommandError, match="cannot complete package 'tf2_msgs'"):
        complete_package("tf2_msgs", None, target, for_pip=False)
    assert contents(tmp_path) == before
    monkeypatch.undo()
    complete_package("tf2_msgs", None, target, for_pip=False)
    del before["build/tf2_msgs/old"]
    assert contents(tmp_path) == before

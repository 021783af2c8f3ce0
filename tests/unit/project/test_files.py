from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.project.files import find_files
from tests.unit.support.checking import write_files


@pytest.mark.parametrize(
    ("name", "text", "ours"),
    [
        ("a.yaml", "system: a\n", True),
        ("a.yml", "node: a\n", True),
        ("a.yaml", "# licence\n\n%YAML 1.2\n---\nsystem: a\n", True),
        ("a.yaml", '{"system": a, nodes: {}}', True),
        ("a.yaml", "\ufeffsystem: a\n", True),
        ("a.yaml", "system: [broken\n", True),
        ("a.yaml", "description: the last\nsystem: a\n", True),
        ("a.yaml", "version: 3\nsystem: {os: linux}\n", False),
        ("a.yaml", "version: 3\nnode:\n  - a\n", False),
        ("a.yaml", "systems: a\n", False),
        ("a.yaml", "nodes:\n  a: {publishers: {b: {type: std_msgs/msg/String}}}\n", True),
        ("a.yaml", "nodes:\n  - {role: worker, type: t3.large}\n", False),
        ("a.yaml", "topics:\n  b: {type: std_msgs/msg/String}\n", False),
        ("a.yaml", "- system: a\n", False),
        ("a.yaml", "", False),
        ("a.yaml", "\x00\xff", False),
        ("a.txt", "system: a\n", False),
    ],
)
def test_a_folder_gives_only_what_is_ours(tmp_path: Path, name: str, text: str, ours: bool) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert find_files([tmp_path]).files == ((tmp_path / name,) if ours else ())


def test_a_folder_is_searched_below_in_order_and_hidden_folders_are_not(tmp_path: Path) -> None:
    names = ["a.yaml", "b/a/e.yaml", "b/c.yaml"]
    hidden = [".venv/d.yaml", "b/.hidden.yaml"]
    write_files(tmp_path, dict.fromkeys([*names, *hidden], "system: a\n"))
    (tmp_path / "loop").symlink_to(tmp_path)
    found = find_files([tmp_path]).files
    assert [str(path.relative_to(tmp_path)) for path in found] == names


def test_what_is_named_is_returned_as_it_is_and_once(tmp_path: Path) -> None:
    foreign = tmp_path / "compose.yaml"
    foreign.write_text("services: {}\n")
    missing = tmp_path / "missing.yaml"
    too_long = Path("a" * 5000)
    assert find_files([foreign, missing, foreign, too_long]).files == (foreign, missing, too_long)


@pytest.mark.parametrize("mark", ["COLCON_IGNORE", "AMENT_IGNORE", "pyvenv.cfg"])
def test_a_folder_that_is_marked_is_left_alone(tmp_path: Path, mark: str) -> None:
    write_files(tmp_path, {f"made/{mark}": "", "made/a.yaml": "system: a\n"})
    assert find_files([tmp_path]).files == ()
    named = tmp_path / "made"
    assert find_files([named]).files == (named / "a.yaml",), "who names it, means it"


def test_installed_packages_and_files_of_other_programs_are_not_checked(tmp_path: Path) -> None:
    for folder in ("node_modules", "lib/site-packages"):
        write_files(tmp_path, {f"{folder}/a.yaml": "system: a\n"})
    foreign = {
        "other.yaml": "services: {}\n",
        # Parameter files of nodes with such names.
        "p1.yaml": "node:\n  ros__parameters: {a: 1}\n",
        "p2.yaml": "# all\nsystem: {ros__parameters: {a: 1}}\n",
    }
    write_files(tmp_path, {**foreign, "composer.yaml": "strict: true\n"})
    found = find_files([tmp_path])
    assert (found.files, found.foreign) == ((), tuple(tmp_path / name for name in foreign))


def test_links_in_the_project_only(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    secret = tmp_path_factory.mktemp("elsewhere") / "secret.yaml"
    secret.write_text("system: secret\n")
    (tmp_path / "a.yaml").write_text("system: a\n")
    (tmp_path / "b.yaml").symlink_to(tmp_path / "a.yaml")
    (tmp_path / "c.yaml").symlink_to(secret)
    (tmp_path / "d.yaml").symlink_to(tmp_path / "d.yaml")
    found = find_files([tmp_path])
    assert found.files == (tmp_path / "a.yaml", tmp_path / "b.yaml")
    (diagnostic,) = found.diagnostics
    assert (str(diagnostic.primary), diagnostic.rule.name) == (
        f"{tmp_path}/c.yaml:1:1",
        "unreadable-file",
    )


def test_pipes_and_sockets_are_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "folder.yaml").mkdir()
    assert find_files([tmp_path]).files == ()


def test_folders_are_searched_at_any_depth(tmp_path: Path) -> None:
    folder = tmp_path
    for _ in range(1000):
        folder /= "d"
        folder.mkdir()
    (folder / "a.yaml").write_text("system: a\n")
    try:
        assert find_files([tmp_path]).files == (folder / "a.yaml",)
    finally:  # pytest's own cleanup is recursive
        (folder / "a.yaml").unlink()
        while folder != tmp_path:
            folder.rmdir()
            folder = folder.parent

"""Systems by name: those of the project, and those that come with the composer."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.cli.support.errors import UsageError
from composer.cli.support.system_arguments import complete_system, example_systems, system_file
from tests.cli.compose import write_files

OWN = "system: robot\nnodes:\n  one: {on_activate: {log: started}}\n"


@pytest.fixture
def root(folder: Path) -> Path:
    """Return the root of a project with the system ``robot``; it is the current folder."""
    (folder / "nodes").mkdir()
    write_files({"systems/robot.yaml": OWN})
    return folder


def test_a_system_of_the_project_comes_before_an_example(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert system_file("robot") == Path("systems/robot.yaml")
    note = "compose: 'robot' is 'systems/robot.yaml'; the example system of that name is"
    assert capsys.readouterr().err == f"{note} '{example_systems()['robot']}'\n"
    assert system_file("pipeline") == example_systems()["pipeline"]
    assert capsys.readouterr().err == ""


def test_it_is_found_from_every_folder_of_the_project(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (root / "nodes" / "deep").mkdir()
    (root / "systems" / "mine.yml").write_text(OWN)
    monkeypatch.chdir(root / "nodes" / "deep")
    assert system_file("robot") == root / "systems" / "robot.yaml"
    assert system_file("mine") == root / "systems" / "mine.yml"
    assert "mine" in complete_system("mi")


@pytest.mark.parametrize(
    ("text", "hint"),
    [("robt", "did you mean 'robot'?"), ("node", "example systems: "), ("", "None")],
)
def test_a_hint_names_no_folder(root: Path, text: str, hint: str) -> None:
    with pytest.raises(UsageError) as raised:
        system_file(text)
    assert str(raised.value.hint).startswith(hint)
    (root / "pipeline").mkdir()
    assert system_file("pipeline") == example_systems()["pipeline"]
    with pytest.raises(UsageError, match="'nodes' is a folder"):
        system_file("nodes")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_system_of_another_user_is_not_found_by_its_name(root: Path) -> None:
    os.chown(root / "systems" / "robot.yaml", 65534, 65534)
    with pytest.raises(UsageError, match="belongs to another user"):
        system_file("robot")
    assert system_file("systems/robot.yaml") == Path("systems/robot.yaml")

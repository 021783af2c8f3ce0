"""What other users place in parent folders is not part of a project."""

from __future__ import annotations

import os
import pwd
from pathlib import Path

import pytest

from composer.project import Project

OTHER_USER, THIRD_USER = 65534, 65533
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Return a folder of this user, in a folder that everyone can write to."""
    folder = tmp_path / "mine" / "systems"
    folder.mkdir(parents=True)
    return folder


def give_away(path: Path, owner: int = OTHER_USER) -> Path:
    os.chown(path, owner, owner, follow_symlinks=False)
    return path


@needs_root
@pytest.mark.parametrize("name", ["nodes", "interfaces", "composer.yaml"])
def test_files_of_another_user_in_a_parent_folder(tmp_path: Path, mine: Path, name: str) -> None:
    found = tmp_path / name
    if name == "composer.yaml":
        (tmp_path / "nodes").mkdir()
        found.write_text("strict: true\n")
    else:
        found.mkdir()
    give_away(found)
    project = Project.at(mine)
    assert (project.root, project.settings.strict) == (mine.parent, False)
    assert project.node_folders == project.interface_folders == ()
    [diagnostic] = project.diagnostics
    assert (diagnostic.rule.name, Path(diagnostic.primary.file.path).name) == (
        "foreign-owner",
        name,
    )
    user = f"user '{pwd.getpwuid(OTHER_USER).pw_name}'"
    assert diagnostic.message == f"'{name}' is not used: {user} controls it"
    assert str(diagnostic.hint).endswith(f"set COMPOSE_SAFE_FOLDERS={tmp_path}")


@needs_root
@pytest.mark.parametrize("given", ["the parent folder", "a link"])
def test_folders_and_links_of_another_user_are_not_used(
    tmp_path: Path, mine: Path, given: str
) -> None:
    (tmp_path / "drafts").mkdir()
    if given == "a link":
        (tmp_path / "nodes").symlink_to(tmp_path / "drafts")
        give_away(tmp_path / "nodes")
    else:
        (tmp_path / "nodes").mkdir()
        give_away(tmp_path)
    project = Project.at(mine)
    assert (project.node_folders, len(project.diagnostics)) == ((), 1)
    # A project below is complete.
    nodes = mine.parent / "nodes"
    nodes.mkdir()
    project = Project.at(mine)
    assert (project.root, project.node_folders) == (mine.parent, (nodes,))
    assert project.diagnostics == ()


@needs_root
def test_root_may_use_a_project_whose_owner_is_another_user(tmp_path: Path, mine: Path) -> None:
    """As in a container, where a mounted project belongs to a user of the host."""
    nodes = tmp_path / "nodes"
    nodes.mkdir()
    for path in (tmp_path, nodes, mine.parent, mine):
        give_away(path)
    assert Project.at(mine).node_folders == (nodes,)
    give_away(nodes, THIRD_USER)
    assert Project.at(mine).node_folders == ()


@needs_root
@pytest.mark.parametrize(
    ("variable", "value", "is_used"),
    [
        ("SUDO_UID", str(OTHER_USER), True),
        ("SUDO_UID", str(THIRD_USER), False),
        ("SUDO_UID", "65534 ", False),
        ("SUDO_UID", "", False),
        ("COMPOSE_SAFE_FOLDERS", "/opt:{}", True),
        ("COMPOSE_SAFE_FOLDERS", "*", True),
        ("COMPOSE_SAFE_FOLDERS", "{}/nodes", False),
    ],
)
def test_the_user_who_called_sudo_is_trusted_and_folders_can_be_declared_safe(
    variable: str,
    value: str,
    is_used: bool,
    tmp_path: Path,
    mine: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nodes = tmp_path / "nodes"
    nodes.mkdir()
    give_away(nodes)
    monkeypatch.setenv(variable, value.replace("{}", str(tmp_path)))
    assert Project.at(mine).node_folders == ((nodes,) if is_used else ())

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load
from composer.project import Project
from tests.unit.support.checking import load_project, write_files

TALKER = "system: talker\nnodes:\n  one: {publishers: {chatter: {type: std_msgs/msg/String}}}\n"


def reported(diagnostics: Iterable[Diagnostic]) -> list[tuple[int, int, str]]:
    return [(item.primary.line, item.primary.column, item.message) for item in diagnostics]


def test_the_root_is_where_the_nearest_settings_are(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("strict: true\n")
    deep = tmp_path / "a" / "b"
    deep.mkdir(parents=True)
    project = Project.at(deep)
    assert (project.root, project.settings.strict) == (tmp_path, True)
    (tmp_path / "a" / "composer.yaml").write_text("# nothing yet\n")
    project = Project.at(deep)
    assert (project.root, project.settings.strict) == (tmp_path / "a", False)
    assert project.diagnostics == ()


@pytest.mark.parametrize(
    ("folders", "start", "root", "nodes", "interfaces"),
    [
        ((), "", "", (), ()),
        (("systems/indoor",), "systems/indoor", "", (), ()),
        (("systems",), "", "", (), ()),
        (("nodes", "systems"), "systems", "", ("nodes",), ()),
        (("interfaces", "systems"), "systems", "", (), ("interfaces",)),
        # Interfaces outside the project are not used.
        (("interfaces", "robot/nodes"), "robot", "robot", ("robot/nodes",), ()),
    ],
)
def test_without_settings_the_root_is_above_the_folders_of_a_project(
    folders: tuple[str, ...],
    start: str,
    root: str,
    nodes: tuple[str, ...],
    interfaces: tuple[str, ...],
    tmp_path: Path,
) -> None:
    for name in folders:
        (tmp_path / name).mkdir(parents=True)
    project = Project.at(tmp_path / start)
    assert project.root == tmp_path / root
    assert project.node_folders == tuple(tmp_path / name for name in nodes)
    assert project.interface_folders == tuple(tmp_path / name for name in interfaces)
    if root:
        (tmp_path / root / "composer.yaml").touch()
        assert Project.at(tmp_path / start).interface_folders == ()


def test_settings_override_the_defaults(tmp_path: Path) -> None:
    for name in ("nodes", "types", "messages", "interfaces"):
        (tmp_path / name).mkdir()
    (tmp_path / "composer.yaml").write_text("nodes: [types, nodes]\ninterfaces: [messages]\n")
    project = Project.at(tmp_path)
    assert project.diagnostics == ()
    assert project.node_folders == (tmp_path / "types", tmp_path / "nodes")
    assert project.interface_folders == (tmp_path / "messages",)


MANY = f"ignore: [{'qos-implicit, ' * 501}]"


@pytest.mark.parametrize(
    ("text", "line", "column", "message"),
    [
        ("nodes: [../elsewhere]", 1, 9, "'../elsewhere' is outside the project"),
        ("nodes: [link]", 1, 9, "'link' is outside the project"),
        ("nodes:\n  - missing", 2, 5, "'missing' does not exist"),
        ("nodes: [a.yaml]", 1, 9, "'a.yaml' is not a folder"),
        ('nodes: ["\\t"]', 1, 9, "'\\t' does not exist"),
        ("nodes: nodes", 1, 8, "expected a list for 'nodes', found the string 'nodes'"),
        ("select: [1]", 1, 10, "expected a string in 'select', found the number 1"),
        ("ignore: [no-rule-at-all]", 1, 10, "there is no rule 'no-rule-at-all'"),
        ("ignore: [unknown-node]", 1, 10, "'unknown-node' is an error, which cannot be ignored"),
        ("severity: {RC202: info}", 1, 12, "'RC202' is an error, which cannot be made an info"),
        ("severity: {RC2: info}", 1, 12, "there is no rule 'RC2'"),
        (MANY, 1, 7010, "'ignore' has more than 500 entries; there are fewer rules"),
        ("[", 1, 1, "this '[' is not closed"),
    ],
)
def test_wrong_settings(tmp_path: Path, text: str, line: int, column: int, message: str) -> None:
    root = tmp_path / "project"
    write_files(root, {"composer.yaml": text, "a.yaml": "system: a\nnodes: {one: {}}\n"})
    (tmp_path / "elsewhere").mkdir()
    (root / "link").symlink_to(tmp_path / "elsewhere")
    found = load(root / "a.yaml").diagnostics
    assert reported(found) == [(line, column, message)]
    assert str(found[0].primary).endswith(f"composer.yaml:{line}:{column}")


def test_settings_may_be_looked_at_alone(tmp_path: Path) -> None:
    settings = "strict: true\nignore: [nothing-of-the-kind]\n"
    diagnostics = load_project(tmp_path, {"composer.yaml": settings}).diagnostics
    assert reported(diagnostics) == [(2, 10, "there is no rule 'nothing-of-the-kind'")]
    assert load_project(tmp_path, {"composer.yaml": "strict: true\n"}).diagnostics == []


def test_settings_are_of_the_project(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    secret = tmp_path_factory.mktemp("elsewhere") / "secret"
    secret.write_text("password: secret\n")
    (tmp_path / "composer.yaml").symlink_to(secret)
    (diagnostic,) = Project.at(tmp_path).diagnostics
    assert diagnostic.message == "this is a symbolic link out of the project"
    assert diagnostic.primary.file.text == ""


PUBLISHER, IMPLICIT = ("publisher-without-subscription", "info"), ("qos-implicit", "info")


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ("", {PUBLISHER, IMPLICIT}),
        ("ignore: [RC5]", {PUBLISHER}),
        ("select: [qos-implicit]", {IMPLICIT}),
        ("severity: {qos-implicit: error}\nignore: [RC3]", {("qos-implicit", "error")}),
    ],
)
def test_rules_are_selected(settings: str, expected: set[tuple[str, str]], tmp_path: Path) -> None:
    files = {"talker.yaml": TALKER, "composer.yaml": settings}
    diagnostics = load_project(tmp_path, files).diagnostics
    assert len(diagnostics) == len(expected)
    assert {(item.rule.name, item.severity.value) for item in diagnostics} == expected
    files["talker.yaml"] = TALKER.replace("String", "Strin")
    diagnostics = load_project(tmp_path, files).diagnostics
    assert ("unknown-interface", "error") in {(i.rule.name, i.severity.value) for i in diagnostics}


def test_no_settings_apply_to_own_systems(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment of a project is often in a folder of the project."""
    share = tmp_path / ".venv" / "share"
    for name in ("systems", "nodes"):
        (share / name).mkdir(parents=True)
    (tmp_path / "composer.yaml").write_text("nodes: []\nstrict: true\n")
    monkeypatch.setattr("composer.project.data_folder", lambda: share)
    project = Project.at(share / "systems")
    assert (project.root, project.settings.strict) == (share, False)
    assert project.node_folders == (share / "nodes",)

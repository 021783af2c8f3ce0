from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load
from composer.project import Project

TALKER = "system: talker\nnodes:\n  one: {publishers: {chatter: {type: std_msgs/msg/String}}}\n"


def reported(diagnostics: tuple[Diagnostic, ...] | list[Diagnostic]) -> list[tuple[int, int, str]]:
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


def test_without_settings_it_is_the_folder_above_nodes(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "systems").mkdir()
    assert Project.at(tmp_path / "systems").root == tmp_path
    assert Project.at(tmp_path / "systems").node_folders == (tmp_path / "nodes",)


def test_without_both_it_is_the_folder_above_systems(tmp_path: Path) -> None:
    folder = tmp_path / "systems" / "indoor"
    folder.mkdir(parents=True)
    assert Project.at(folder).root == tmp_path
    assert Project.at(tmp_path).root == tmp_path


def test_without_anything_it_is_the_folder_itself(tmp_path: Path) -> None:
    assert Project.at(tmp_path).root == tmp_path
    assert Project.at(tmp_path).node_folders == ()


def test_settings_override_the_defaults(tmp_path: Path) -> None:
    for name in ("nodes", "types", "messages", "interfaces"):
        (tmp_path / name).mkdir()
    (tmp_path / "composer.yaml").write_text("nodes: [types, nodes]\ninterfaces: [messages]\n")
    project = Project.at(tmp_path)
    assert project.diagnostics == ()
    assert project.node_folders == (tmp_path / "types", tmp_path / "nodes")
    assert project.interface_folders == (tmp_path / "messages",)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("nodes: [../elsewhere]", (1, 9, "'../elsewhere' is outside the project")),
        ("nodes: [link]", (1, 9, "'link' is outside the project")),
        ("nodes:\n  - missing", (2, 5, "'missing' does not exist")),
        ("nodes: [a.yaml]", (1, 9, "'a.yaml' is not a folder")),
        ('nodes: ["\\t"]', (1, 9, "'\\t' does not exist")),
        ("nodes: nodes", (1, 8, "expected a list for 'nodes', found the string 'nodes'")),
        ("select: [1]", (1, 10, "expected a string in 'select', found the number 1")),
        ("ignore: [no-rule-at-all]", (1, 10, "there is no rule 'no-rule-at-all'")),
        (
            "ignore: [unknown-node]",
            (1, 10, "'unknown-node' is an error, which cannot be ignored"),
        ),
        (
            "severity: {RC202: info}",
            (1, 12, "'RC202' is an error, which cannot be made an info"),
        ),
        ("severity: {RC2: info}", (1, 12, "there is no rule 'RC2'")),
        (
            f"ignore: [{'qos-implicit, ' * 501}]",
            (1, 7010, "'ignore' has more than 500 entries; there are fewer rules"),
        ),
        ("[", (1, 1, "this '[' is not closed")),
    ],
)
def test_a_wrong_setting_is_a_diagnostic_at_its_place(
    tmp_path: Path, text: str, place: tuple[int, int, str]
) -> None:
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "elsewhere").mkdir()
    (root / "link").symlink_to(tmp_path / "elsewhere")
    (root / "composer.yaml").write_text(text)
    (root / "a.yaml").write_text("system: a\nnodes: {one: {}}\n")
    found = load(root / "a.yaml").diagnostics
    assert reported(found) == [place]
    assert str(found[0].primary).endswith(f"composer.yaml:{place[0]}:{place[1]}")


def test_settings_may_be_looked_at_alone(tmp_path: Path) -> None:
    path = tmp_path / "composer.yaml"
    path.write_text("strict: true\nignore: [nothing-of-the-kind]\n")
    assert reported(load(path).diagnostics) == [(2, 10, "there is no rule 'nothing-of-the-kind'")]
    path.write_text("strict: true\n")
    assert load(path).diagnostics == []


def test_settings_are_not_read_from_elsewhere(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    secret = tmp_path_factory.mktemp("elsewhere") / "secret"
    secret.write_text("password: secret\n")
    (tmp_path / "composer.yaml").symlink_to(secret)
    (diagnostic,) = Project.at(tmp_path).diagnostics
    assert diagnostic.message == "this is a symbolic link out of the project"
    assert diagnostic.primary.file.text == ""


def test_rules_are_ignored_selected_and_weighed_but_errors_stay(tmp_path: Path) -> None:
    path = tmp_path / "talker.yaml"

    def found(settings: str, text: str = TALKER) -> list[tuple[str, str]]:
        (tmp_path / "composer.yaml").write_text(settings)
        path.write_text(text)
        return [(item.rule.name, item.severity.value) for item in load(path).diagnostics]

    everything = [("publisher-without-subscription", "info"), ("qos-implicit", "info")]
    assert sorted(found("")) == sorted(everything)
    assert found("ignore: [RC5]") == [("publisher-without-subscription", "info")]
    assert found("select: [qos-implicit]") == [("qos-implicit", "info")]
    assert found("severity: {qos-implicit: error}\nignore: [RC3]") == [("qos-implicit", "error")]
    broken = TALKER.replace("String", "Strin")
    assert ("unknown-interface", "error") in found("select: [RC5]\nignore: [RC3]", broken)


def test_interfaces_outside_the_project_are_not_used(tmp_path: Path) -> None:
    (tmp_path / "interfaces").mkdir()
    (tmp_path / "robot" / "nodes").mkdir(parents=True)
    assert Project.at(tmp_path / "robot").interface_folders == ()
    (tmp_path / "robot" / "composer.yaml").touch()
    assert Project.at(tmp_path / "robot").interface_folders == ()


def test_without_nodes_the_root_is_the_folder_above_interfaces(tmp_path: Path) -> None:
    (tmp_path / "interfaces").mkdir()
    (tmp_path / "systems").mkdir()
    project = Project.at(tmp_path / "systems")
    assert (project.root, project.interface_folders) == (tmp_path, (tmp_path / "interfaces",))


def test_no_settings_apply_to_what_comes_with_the_composer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The environment of a project is often in a folder of the project."""
    share = tmp_path / ".venv" / "share"
    for name in ("systems", "nodes"):
        (share / name).mkdir(parents=True)
    (tmp_path / "composer.yaml").write_text("nodes: []\nstrict: true\n")
    monkeypatch.setattr("composer.project.data_folder", lambda: share)
    project = Project.at(share / "systems")
    assert (project.root, project.settings.strict) == (share, False)
    assert project.node_folders == (share / "nodes",)

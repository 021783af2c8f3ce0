from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic, Severity
from composer.loading import load
from composer.project import Project
from composer.project.toml import read_table
from composer.source import SourceFile
from tests.unit.support.growth import assert_linear

PYPROJECT = """\
[project]
name = "robot"
dependencies = ["ros2-composer"]

[tool.composer]
nodes = ["parts", 'more "parts"']  # two
strict = true
ignore = [
  "qos-implicit",
  "RC9",
]

[tool.composer.severity]
publisher-without-subscription = "warning"
RC412 = "eror"

[tool.ruff]
ignore = ["RC9"]
"""
TALKER = "system: talker\nnodes:\n  one: {publishers: {chatter: {type: std_msgs/msg/String}}}\n"


def reported(diagnostics: tuple[Diagnostic, ...] | list[Diagnostic]) -> list[tuple[int, int, str]]:
    return [(item.primary.line, item.primary.column, item.message) for item in diagnostics]


def test_the_root_is_where_the_nearest_settings_are(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("strict: true\n")
    deep = tmp_path / "a" / "b"
    deep.mkdir(parents=True)
    (tmp_path / "a" / "pyproject.toml").write_text("[project]\nname = 'no table of ours'\n")
    project = Project.at(deep)
    assert (project.root, project.settings.strict) == (tmp_path, True)
    (tmp_path / "a" / "pyproject.toml").write_text("[tool.composer]\n")
    project = Project.at(deep)
    assert (project.root, project.settings.strict) == (tmp_path / "a", False)


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


def test_a_table_in_pyproject_says_the_same_with_places(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(PYPROJECT)
    for name in ("parts", 'more "parts"'):
        (tmp_path / name).mkdir()
    project = Project.at(tmp_path)
    settings = project.settings
    assert settings.nodes == (tmp_path / "parts", tmp_path / 'more "parts"')
    assert settings.strict
    assert [(text.value, str(text.span).rpartition(".toml:")[2]) for text in settings.ignore] == [
        ("qos-implicit", "9:3"),
        ("RC9", "10:3"),
    ]
    assert [(text.value, severity) for text, severity in settings.severity] == [
        ("publisher-without-subscription", Severity.WARNING)
    ]
    ((line, column, message),) = reported(project.diagnostics)
    assert (line, column) == (15, 9)
    assert message.endswith("for 'RC412', found the string 'eror'")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("nodes: [../elsewhere]", (1, 9, "'../elsewhere' is outside the project")),
        ("nodes: [link]", (1, 9, "'link' is outside the project")),
        ("nodes:\n  - missing", (2, 5, "'missing' is not a folder")),
        ("nodes: [a.yaml]", (1, 9, "'a.yaml' is not a folder")),
        ('nodes: ["\\t"]', (1, 9, "'\\t' is not a folder")),
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


def test_a_table_next_to_a_file_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("# nothing yet\n")
    (tmp_path / "pyproject.toml").write_text("[tool.composer]\nstrict = true\n")
    project = Project.at(tmp_path)
    assert not project.settings.strict
    assert [diagnostic.message for diagnostic in project.diagnostics] == [
        "the table [tool.composer] is ignored: the folder also has a composer.yaml"
    ]


@pytest.mark.parametrize(
    ("text", "line"), [("[tool.composer]\nstrict = yes\n", 2), ("[tool.composer]\n[[[\n", 2)]
)
def test_broken_toml_is_a_diagnostic(tmp_path: Path, text: str, line: int) -> None:
    (tmp_path / "pyproject.toml").write_text(text)
    (diagnostic,) = Project.at(tmp_path).diagnostics
    assert diagnostic.message.startswith("this is not TOML: ")
    assert diagnostic.primary.line == line


@pytest.mark.parametrize(
    "text",
    [
        "a = '''\n[tool.composer]\n'''\n",
        "[tool.composers]\nstrict = true\n",
        "[project]\ndependencies = ['ros2-composer']\n",
        "# [tool.composer]\n",
        "[tool.ruff]\nbroken = [[[\n",
        "\x00\x01",
    ],
)
def test_other_tables_are_none_of_ours(tmp_path: Path, text: str) -> None:
    (tmp_path / "pyproject.toml").write_text(text)
    assert Project.at(tmp_path).settings.source is None


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


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("strict = " + "1" * 5000, 2, "this number does not fit into 64 bits"),
        ("strict = 0x" + "f" * 5000, 2, "this number does not fit into 64 bits"),
        (".".join("a" * 700) + " = 1", 2, "tables and arrays are nested more than 32 levels deep"),
        (f"a = {'[' * 700}{']' * 700}", 2, "tables and arrays are nested more than 32 levels deep"),
        (f"a = {'[' * 200_000}", 2, "tables and arrays are nested more than 32 levels deep"),
        ("[tool.composer." + ".".join("a" * 700) + "]", 2, "tables and arrays are nested more"),
        ("strict = " + '\\"' * 400_000, 2, "this is not TOML: Invalid value"),
        ('"\\z" = 1', 2, "this is not TOML: Unescaped"),
    ],
    ids=["digits", "hexadecimal", "dotted", "arrays", "open", "header", "quotes", "escape"],
)
def test_toml_beyond_limits_is_a_diagnostic(
    tmp_path: Path, text: str, line: int, message: str
) -> None:
    (tmp_path / "pyproject.toml").write_text(f"[tool.composer]\n{text}\n")
    diagnostic = Project.at(tmp_path).diagnostics[0]
    assert diagnostic.message.startswith(message)
    assert diagnostic.primary.line == line


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[tool]\ncomposer = 3\n", (2, 1)),
        ("tool.composer = 'strict'\n", (1, 6)),
        ("x = '''\n[tool.composer]\n'''\n[[tool.composer]]\nstrict = true\n", (4, 8)),
    ],
)
def test_a_setting_in_place_of_the_table_is_a_diagnostic(
    tmp_path: Path, text: str, place: tuple[int, int]
) -> None:
    (tmp_path / "pyproject.toml").write_text(text)
    assert reported(Project.at(tmp_path).diagnostics) == [
        (*place, "'tool.composer' must be a table")
    ]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[tool]\ncomposer = {strict = true, ignore = ['RC9x']}\n", (2, 38)),
        ('tool.composer.ignore = ["qos-implicit", "RC9x"]\n', (1, 41)),
        ("[ 'tool' . \"composer\" ] # 'a\n\"ign\\u006fre\" = [\n# ]\n 'RC9x' ]\n", (4, 2)),
        ("a = '''\n[tool.composer]\n\"\"\"'''\n[tool.composer]\nignore = ['RC9x']\n", (5, 11)),
        ("[[a]]\nb = 1.5e3\nc = 07:32:00\n[tool.composer]\nignore=['RC9x',]\n", (5, 9)),
    ],
)
def test_the_table_may_be_written_in_any_way(
    tmp_path: Path, text: str, place: tuple[int, int]
) -> None:
    (tmp_path / "pyproject.toml").write_text(text)
    (tmp_path / "a.yaml").write_text("system: a\nnodes: {one: {on_activate: {log: hi}}}\n")
    found = load(tmp_path / "a.yaml").diagnostics
    assert reported(found) == [(*place, "there is no rule 'RC9x'")]


def test_keys_are_found_below_their_own_table(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(
        "[[tool.composer.odd]]\na = {strict = 1}\n[[tool.composer.odd]]\nstrict = 1\n"
        "[tool.composer.odd.more]\nnodes = 1\n[tool.composer]\nstrict = 1\n"
    )
    found = [item for item in Project.at(tmp_path).diagnostics if "'strict'" in item.message]
    assert [str(item.primary).rpartition(".toml:")[2] for item in found] == ["8:10"]


def test_many_keys_take_linear_time(tmp_path: Path) -> None:
    def read(count: int) -> None:
        keys = "".join(f"k{number} = {number}\n" for number in range(count))
        source = SourceFile("pyproject.toml", f"[tool.composer]\n{keys}")
        table = read_table(source)
        assert table is not None
        assert table[0] is not None
        assert table[0].entries[-1].key.span.line == count + 1

    assert_linear(read, 200, 1600)


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

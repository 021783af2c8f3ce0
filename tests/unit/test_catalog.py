from __future__ import annotations

from pathlib import Path

import pytest

from composer.catalog import Catalog, find_files, interface_folders, shown_path
from composer.resources import interfaces_folder, nodes_folder


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "systems" / "deep").mkdir(parents=True)
    (tmp_path / "nodes" / "camera.yaml").write_text("node: camera\n")
    return tmp_path


def test_types_come_from_the_project_and_from_the_composer(project: Path) -> None:
    catalog = Catalog.for_file(project / "systems" / "deep" / "robot.yaml")
    assert catalog.find("camera") == project / "nodes" / "camera.yaml"
    assert catalog.find("relay") == nodes_folder() / "relay.yaml"
    assert {"camera", "relay"} <= set(catalog.names())


def test_the_projects_own_type_wins(project: Path) -> None:
    (project / "nodes" / "relay.yaml").write_text("node: relay\n")
    found = Catalog.for_file(project / "robot.yaml").find("relay")
    assert found == project / "nodes" / "relay.yaml"


def test_the_nearest_nodes_folder_is_the_projects(project: Path) -> None:
    nearer = project / "systems" / "nodes"
    nearer.mkdir()
    catalog = Catalog.for_file(project / "systems" / "robot.yaml")
    assert catalog.folders == (nearer, nodes_folder())
    assert catalog.find("camera") is None


@pytest.mark.parametrize(
    "name", ["", "..", "../secret", "/etc/passwd", "a.b", "camera\n", "a" * 5000, "ca mera", "\0"]
)
def test_a_type_name_never_leads_out_of_the_folder(project: Path, name: str) -> None:
    (project / "secret.yaml").write_text("node: secret\n")
    assert Catalog.for_file(project / "robot.yaml").find(name) is None


def test_a_link_does_not_lead_out_of_the_folder(project: Path) -> None:
    (project / "secret.yaml").write_text("node: secret\n")
    (project / "nodes" / "secret.yaml").symlink_to(project / "secret.yaml")
    assert Catalog.for_file(project / "robot.yaml").find("secret") is None


def test_a_file_without_project_sees_the_composers_types(tmp_path: Path) -> None:
    assert Catalog.for_file(tmp_path / "robot.yaml").folders == (nodes_folder(),)


def test_interfaces_of_the_project_come_first(project: Path) -> None:
    (project / "interfaces").mkdir()
    folders = interface_folders(project / "systems")
    assert folders == (project / "interfaces", interfaces_folder())


@pytest.mark.parametrize(
    ("name", "text", "ours"),
    [
        ("a.yaml", "system: a\n", True),
        ("a.yml", "node: a\n", True),
        ("a.yaml", "# licence\n\n%YAML 1.2\n---\nsystem: a\n", True),
        ("a.yaml", '{"system": a, nodes: {}}', True),
        ("a.yaml", "\ufeffsystem: a\n", True),
        ("a.yaml", "system: [broken\n", True),
        ("a.yaml", "version: 3\nsystem: a\n", False),
        ("a.yaml", "systems: a\n", False),
        ("a.yaml", "- system: a\n", False),
        ("a.yaml", "", False),
        ("a.yaml", "\x00\xff", False),
        ("a.txt", "system: a\n", False),
    ],
)
def test_a_folder_gives_only_what_is_ours(tmp_path: Path, name: str, text: str, ours: bool) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert find_files([tmp_path]) == ((tmp_path / name,) if ours else ())


def test_a_folder_is_searched_below_in_order_and_hidden_folders_are_not(tmp_path: Path) -> None:
    for name in ("b/c.yaml", "a.yaml", ".venv/d.yaml", "b/a/e.yaml"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("system: a\n")
    (tmp_path / "loop").symlink_to(tmp_path)
    names = [str(path.relative_to(tmp_path)) for path in find_files([tmp_path])]
    assert names == ["a.yaml", "b/a/e.yaml", "b/c.yaml"]


def test_what_is_named_is_returned_as_it_is_and_once(tmp_path: Path) -> None:
    foreign = tmp_path / "compose.yaml"
    foreign.write_text("services: {}\n")
    missing = tmp_path / "missing.yaml"
    too_long = Path("a" * 5000)
    assert find_files([foreign, missing, foreign, too_long]) == (foreign, missing, too_long)


def test_paths_are_shown_relative_to_where_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert shown_path(tmp_path / "nodes" / "a.yaml") == "nodes/a.yaml"
    assert shown_path(Path("/elsewhere/a.yaml")) == "/elsewhere/a.yaml"

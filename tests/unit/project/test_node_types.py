from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.resources import interfaces_folder, nodes_folder
from composer.project import Project
from composer.project.node_types import NodeTypes, interface_folders


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "systems" / "deep").mkdir(parents=True)
    (tmp_path / "nodes" / "camera.yaml").write_text("node: camera\n")
    return tmp_path


def test_types_come_from_the_project_and_from_the_composer(project: Path) -> None:
    node_types = NodeTypes.of(Project.at(project / "systems" / "deep"))
    assert node_types.find("camera") == project / "nodes" / "camera.yaml"
    assert node_types.find("relay") == nodes_folder() / "relay.yaml"
    assert {"camera", "relay"} <= set(node_types.names())


def test_the_projects_own_type_wins(project: Path) -> None:
    (project / "nodes" / "relay.yaml").write_text("node: relay\n")
    found = NodeTypes.of(Project.at(project)).find("relay")
    assert found == project / "nodes" / "relay.yaml"


def test_the_nearest_nodes_folder_is_the_projects(project: Path) -> None:
    nearer = project / "systems" / "nodes"
    nearer.mkdir()
    node_types = NodeTypes.of(Project.at(project / "systems"))
    assert node_types.folders == (nearer, nodes_folder())
    assert node_types.find("camera") is None


@pytest.mark.parametrize(
    "name", ["", "..", "../secret", "/etc/passwd", "a.b", "camera\n", "a" * 5000, "ca mera", "\0"]
)
def test_a_type_name_never_leads_out_of_the_folder(project: Path, name: str) -> None:
    (project / "secret.yaml").write_text("node: secret\n")
    assert NodeTypes.of(Project.at(project)).find(name) is None


def test_a_link_may_lead_about_in_the_project(project: Path) -> None:
    (project / "shared.yaml").write_text("node: shared\n")
    link = project / "nodes" / "shared.yaml"
    link.symlink_to(project / "shared.yaml")
    node_types = NodeTypes.of(Project.at(project))
    assert node_types.find("shared") == link
    assert node_types.find_outside_project("shared") is None


def test_a_link_does_not_lead_out_of_the_project(
    project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    secret = tmp_path_factory.mktemp("elsewhere") / "secret.yaml"
    secret.write_text("node: relay\n")
    # Not the composer's own of that name either: it is not what is meant.
    link = project / "nodes" / "relay.yaml"
    link.symlink_to(secret)
    node_types = NodeTypes.of(Project.at(project))
    assert node_types.find("relay") is None
    assert node_types.find_outside_project("relay") == link


def test_a_folder_of_node_types_does_not_lead_out_of_the_project_either(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "secret.yaml").write_text("node: secret\n")
    (tmp_path / "nodes").symlink_to(elsewhere)
    assert NodeTypes.of(Project.at(tmp_path)).find("secret") is None


def test_a_file_without_project_sees_the_composers_types(tmp_path: Path) -> None:
    assert NodeTypes.of(Project.at(tmp_path)).folders == (nodes_folder(),)


def test_interfaces_of_the_project_come_first(project: Path) -> None:
    (project / "interfaces").mkdir()
    folders = interface_folders(Project.at(project / "systems"))
    assert folders == (project / "interfaces", interfaces_folder())

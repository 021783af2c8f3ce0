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
    # The project's own type wins, and the nearest folder of types.
    (project / "nodes" / "relay.yaml").write_text("node: relay\n")
    assert NodeTypes.of(Project.at(project)).find("relay") == project / "nodes" / "relay.yaml"
    nearer = project / "systems" / "nodes"
    nearer.mkdir()
    node_types = NodeTypes.of(Project.at(project / "systems"))
    assert node_types.folders == (nearer, nodes_folder())
    assert node_types.find("camera") is None


def test_a_type_name_never_leads_out_of_the_folder(project: Path) -> None:
    (project / "secret.yaml").write_text("node: secret\n")
    node_types = NodeTypes.of(Project.at(project))
    for name in ("", "..", "../secret", "/etc/passwd", "a.b", "camera\n", "ca mera", "\0"):
        assert node_types.find(name) is None
    assert node_types.find("a" * 5000) is None


def test_links_may_lead_about_in_the_project_only(
    project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")  # it has the composer's types only
    assert NodeTypes.of(Project.at(elsewhere)).folders == (nodes_folder(),)
    (elsewhere / "secret.yaml").write_text("node: relay\n")
    (project / "shared.yaml").write_text("node: shared\n")
    shared, relay = (project / "nodes" / name for name in ("shared.yaml", "relay.yaml"))
    shared.symlink_to(project / "shared.yaml")
    relay.symlink_to(elsewhere / "secret.yaml")
    node_types = NodeTypes.of(Project.at(project))
    assert node_types.find("shared") == shared
    assert node_types.find_outside_project("shared") is None
    # Not the composer's own of that name either: it is not what is meant.
    assert node_types.find("relay") is None
    assert node_types.find_outside_project("relay") == relay
    other = project / "systems" / "deep"
    (other / "nodes").symlink_to(elsewhere)
    assert NodeTypes.of(Project.at(other)).find("secret") is None


def test_interfaces_of_the_project_come_first(project: Path) -> None:
    (project / "interfaces").mkdir()
    folders = interface_folders(Project.at(project / "systems"))
    assert folders == (project / "interfaces", interfaces_folder())

"""Node types and systems of a project, of the composer, and of packages in the ament index."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.base.folders import interfaces_folder, nodes_folder
from composer.project import Project
from composer.project.node_types import (
    NodeTypes,
    installed_projects,
    installed_systems,
    interface_folders,
)
from tests.cli.compose import compose
from tests.unit.support.checking import valid_system, write_files


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


def test_links_in_the_project_only(project: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
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


def install(prefix: Path, package: str, *, registered: bool = True) -> Path:
    """Create an installed package with the node type 'blinker' and the system 'blink'."""
    share = prefix / "share" / package
    files = {
        "nodes/blinker.yaml": f"node: blinker\ndescription: of {package}\n"
        "behavior: blinker:Blinker\ntimers: {tick: {period_ms: 100}}\n",
        "nodes/blinker.py": "class Blinker:\n    def on_tick(self): pass\n",
        "systems/blink.yaml": "system: blink\nnodes: {a: {type: blinker}}\n",
    }
    write_files(share, files)
    if registered:
        index = "share/ament_index/resource_index/ros2_composer"
        write_files(prefix, {f"{index}/{package}": ""})
    return share


@pytest.fixture
def prefixes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    overlay, underlay = tmp_path / "overlay", tmp_path / "underlay"
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{overlay}{os.pathsep}{underlay}")
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir(home)
    return overlay, underlay


def test_packages_of_overlays_come_first(prefixes: tuple[Path, Path]) -> None:
    overlay, underlay = prefixes
    install(underlay, "lamps")
    install(underlay, "others", registered=False)
    over = install(overlay, "lamps")
    install(underlay, "beacons")
    assert [project.package for project in installed_projects()] == ["lamps", "beacons"]
    assert installed_projects()[0].folder == over
    assert sorted(installed_systems()) == ["beacons/blink", "blink", "lamps/blink"]
    assert installed_systems()["blink"] == over / "systems" / "blink.yaml"


def test_types_of_packages_are_before_built_in_ones(
    prefixes: tuple[Path, Path], tmp_path: Path
) -> None:
    share = install(prefixes[0], "lamps")
    (share / "nodes" / "relay.yaml").write_text("node: relay\non_activate: {log: hello}\n")
    project = tmp_path / "project"
    (project / "nodes").mkdir(parents=True)
    types = NodeTypes.of(Project.at(project))
    assert types.find("blinker") == share / "nodes" / "blinker.yaml"
    assert types.find("relay") == share / "nodes" / "relay.yaml"
    assert "blinker" in types.names()
    own = project / "nodes" / "blinker.yaml"
    own.write_text("node: blinker\n")
    assert types.find("blinker") == own


def test_a_system_uses_an_installed_type(prefixes: tuple[Path, Path], tmp_path: Path) -> None:
    install(prefixes[0], "lamps")
    text = "system: own\nnodes: {lamp: {type: blinker}}\n"
    (node,) = valid_system(tmp_path / "home", {"own.yaml": text}).nodes
    assert node.description == "of lamps"
    done = compose("run", "lamps/blink", "--dry-run")
    assert done.code == 0, done.err
    assert "activate /a" in done.out
    assert "did you mean 'lamps/blink'?" in compose("run", "lamps/blnk", "--dry-run").err


def test_links_of_a_symlink_install_are_followed(
    prefixes: tuple[Path, Path], tmp_path: Path
) -> None:
    share = install(prefixes[0], "lamps")
    sources = tmp_path / "src"
    sources.mkdir()
    for file in (*share.glob("nodes/*"), *share.glob("systems/*")):
        file.rename(sources / file.name)
        file.symlink_to(sources / file.name)
    assert NodeTypes.of(Project.at(tmp_path)).find("blinker") == sources / "blinker.yaml"
    done = compose("run", "blink", "--dry-run")
    assert done.code == 0, done.err


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may change owners")
def test_packages_of_other_users(
    prefixes: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    share = install(prefixes[0], "lamps")
    os.chown(share, 4242, -1)
    assert installed_projects() == ()
    monkeypatch.setenv("COMPOSE_SAFE_FOLDERS", str(share.parent))
    assert [project.package for project in installed_projects()] == ["lamps"]

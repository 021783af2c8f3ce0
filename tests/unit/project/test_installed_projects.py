"""Node types and systems of packages in the ament index."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.project import Project
from composer.project.node_types import NodeTypes, installed_projects, installed_systems
from tests.cli.compose import compose
from tests.unit.support.checking import valid_system, write_files


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


def test_types_are_found_after_those_of_the_project_and_before_built_in_ones(
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


def test_a_system_uses_an_installed_type_with_its_behavior(
    prefixes: tuple[Path, Path], tmp_path: Path
) -> None:
    install(prefixes[0], "lamps")
    text = "system: own\nnodes: {lamp: {type: blinker}}\n"
    (node,) = valid_system(tmp_path / "home", {"own.yaml": text}).nodes
    assert node.description == "of lamps"
    done = compose("run", "lamps/blink", "--dry-run")
    assert done.code == 0, done.err
    assert "activate /a" in done.out
    assert "did you mean 'lamps/blink'?" in compose("run", "lamps/blnk", "--dry-run").err


def test_links_of_a_symlink_install_lead_to_the_sources(
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
def test_packages_of_other_users_are_not_used(
    prefixes: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    share = install(prefixes[0], "lamps")
    os.chown(share, 4242, -1)
    assert installed_projects() == ()
    monkeypatch.setenv("COMPOSE_SAFE_FOLDERS", str(share.parent))
    assert [project.package for project in installed_projects()] == ["lamps"]

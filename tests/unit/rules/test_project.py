"""Rules that check several files together."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load
from composer.loading.reported import project_diagnostics
from tests.unit.support.checking import write_files

FILES = {
    "nodes/planner.yaml": "node: planner\non_activate: {log: ready}\n",
    "nodes/old_planner.yaml": "node: old_planner\non_activate: {log: ready}\n",
    "systems/pipeline.yaml": "system: pipeline\nnodes: {planner: {type: planner}}\n",
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_files(tmp_path, FILES)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def together(*names: str) -> list[Diagnostic]:
    return project_diagnostics([load(Path(name)) for name in names])


def test_an_unused_node_type_is_reported(project: Path) -> None:
    [diagnostic] = together(*FILES)
    assert diagnostic.rule.name == "unused-declaration"
    assert str(diagnostic.primary) == "nodes/old_planner.yaml:1:7"


def test_a_node_type_with_a_wrong_name_is_not_reported_again(project: Path) -> None:
    (project / "nodes" / "old_planner.yaml").write_text("node: {old: planner}\n")
    assert together(*FILES) == []


def test_node_types_without_a_system_are_not_checked(project: Path) -> None:
    assert together("nodes/planner.yaml", "nodes/old_planner.yaml") == []


def test_a_type_of_the_same_name_elsewhere_does_not_count(project: Path) -> None:
    other = project / "other" / "nodes"
    other.mkdir(parents=True)
    (other / "planner.yaml").write_text(FILES["nodes/planner.yaml"], encoding="utf-8")
    [diagnostic] = together("other/nodes/planner.yaml", "systems/pipeline.yaml")
    assert str(diagnostic.primary) == "other/nodes/planner.yaml:1:7"


def test_it_can_be_ignored(project: Path) -> None:
    path = project / "nodes" / "old_planner.yaml"
    comment = "# compose: ignore[unused-declaration] for other projects\n"
    path.write_text(comment + FILES["nodes/old_planner.yaml"], encoding="utf-8")
    assert together(*FILES) == []

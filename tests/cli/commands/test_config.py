from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.compose import compose


def test_includes_are_resolved(tmp_path: Path) -> None:
    done = compose("config", "systems/fleet.yaml")
    assert (done.code, done.err) == (0, "")
    for gone in ("include", "for_each", "${", "arguments: {start"):
        assert gone not in done.out
    assert "alpha_controller" in done.out
    resolved = tmp_path / "one.yaml"
    resolved.write_text(done.out, encoding="utf-8")
    assert compose("validate", str(resolved)).code == 0
    again = compose("config", str(resolved))
    assert (again.out, again.err) == (done.out, "")


def test_json_output() -> None:
    done = compose("config", "fleet", "--json")
    nodes = json.loads(done.out)["nodes"]
    assert nodes["beta_planner"] == {
        "type": "planner",
        "namespace": "beta",
        "parameters": {"max_velocity": 0.5},
    }


def test_extends_is_resolved(tmp_path: Path) -> None:
    (tmp_path / "quick.yaml").write_text(
        "node: quick\nextends: watchdog\nparameters: {timeout_ms: 10.0}\n"
    )
    done = compose("config", str(tmp_path / "quick.yaml"))
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("node: quick\ndescription: Publishes true")
    assert "default: 10.0" in done.out
    assert "extends" not in done.out


def test_arguments_are_listed_unless_the_file_has_errors(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "system: a\narguments: {lidar: {choices: [x, y], default: x}}\nnodes: {c: {}}\n"
    )
    done = compose("run", str(path), "--help-arguments")
    assert (done.code, done.out) == (0, 'lidar (string)\n    default: "x"; one of: x, y\n')
    path.write_text("system: a\narguments: {lidar: 1}\nnodes: {c_${lidar}: {}}\n")
    done = compose("run", str(path), "--help-arguments")
    assert (done.code, done.out) == (1, "")
    assert "key-without-value" in done.err


def test_a_file_with_errors_prints_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("system: a\ninclude: [b.yaml]\nnodes: {c: {}}\n")
    done = compose("config", str(tmp_path / "a.yaml"))
    assert (done.code, done.out) == (1, "")
    assert "invalid-include" in done.err


def test_files_next_to_an_included_file_are_noted(tmp_path: Path) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "a.yaml").write_text("system: a\ninclude: [arm/arm.yaml]\n")
    (tmp_path / "arm" / "arm.yaml").write_text("system: arm\nnodes: {arm: {behavior: 'arm:Arm'}}\n")
    (tmp_path / "arm" / "arm.py").write_text(
        "from composer.behavior import Behavior\nclass Arm(Behavior):\n    pass\n"
    )
    done = compose("config", str(tmp_path / "a.yaml"))
    assert done.code == 0
    assert "note:" in done.err


@pytest.mark.parametrize("report", ["text", "json", "sarif", "github"])
def test_reports_name_the_included_file(
    tmp_path: Path, report: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "parts").mkdir()
    (tmp_path / "a.yaml").write_text("system: a\ninclude: [parts/b.yaml]\n")
    (tmp_path / "parts" / "b.yaml").write_text("system: b\nnodes: {c: {typ: relay}}\n")
    done = compose("validate", "a.yaml", "--format", report)
    assert done.code == 1
    found = {
        "text": "--> parts/b.yaml:2:13",
        "json": '"file": "parts/b.yaml"',
        "sarif": '"uri": "parts/b.yaml"',
        "github": "file=parts/b.yaml,line=2,endLine=2,col=13",
    }
    assert found[report] in done.out, done.out
    assert "a.yaml" in done.out

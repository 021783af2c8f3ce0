from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.compose import compose, refused, write_files


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
    nodes = json.loads(compose("config", "fleet", "--json").out)["nodes"]
    assert nodes["beta_planner"] == {
        "type": "planner",
        "namespace": "beta",
        "parameters": {"max_velocity": 0.5},
    }


def test_extends_is_resolved(folder: Path) -> None:
    text = "node: quick\nextends: watchdog\nparameters: {timeout_ms: 10.0}\n"
    write_files({"quick.yaml": text})
    done = compose("config", "quick.yaml")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("node: quick\ndescription: Publishes true")
    assert "default: 10.0" in done.out
    assert "extends" not in done.out


def test_arguments_are_listed_unless_the_file_has_errors(folder: Path) -> None:
    text = "system: a\narguments: {lidar: {choices: [x, y], default: x}}\nnodes: {c: {}}\n"
    write_files({"a.yaml": text})
    done = compose("run", "a.yaml", "--help-arguments")
    assert (done.code, done.out) == (0, 'lidar (string)\n    default: "x"; one of: x, y\n')
    write_files({"a.yaml": "system: a\narguments: {lidar: 1}\nnodes: {c_${lidar}: {}}\n"})
    for words in (("run", "a.yaml", "--help-arguments"), ("config", "a.yaml")):
        assert "key-without-value" in refused(1, *words)


def test_files_next_to_an_included_file_are_noted(folder: Path) -> None:
    write_files(
        {
            "a.yaml": "system: a\ninclude: [arm/arm.yaml]\n",
            "arm/arm.yaml": "system: arm\nnodes: {arm: {behavior: 'arm:Arm'}}\n",
            "arm/arm.py": "from composer.behavior import Behavior\nclass Arm(Behavior): ...\n",
        }
    )
    done = compose("config", "a.yaml")
    assert done.code == 0
    assert "note:" in done.err


@pytest.mark.parametrize(
    ("report", "place"),
    [
        ("text", "--> parts/b.yaml:2:13"),
        ("json", '"file": "parts/b.yaml"'),
        ("sarif", '"uri": "parts/b.yaml"'),
        ("github", "file=parts/b.yaml,line=2,endLine=2,col=13"),
    ],
)
def test_reports_name_the_included_file(folder: Path, report: str, place: str) -> None:
    write_files(
        {
            "a.yaml": "system: a\ninclude: [parts/b.yaml]\n",
            "parts/b.yaml": "system: b\nnodes: {c: {typ: relay}}\n",
        }
    )
    done = compose("validate", "a.yaml", "--format", report)
    assert done.code == 1
    assert place in done.out, done.out
    assert "a.yaml" in done.out

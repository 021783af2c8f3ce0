from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.compose import compose
from tests.unit.support.fleets import fleet_text


def test_the_default_is_mermaid_of_the_nodes_on_stdout() -> None:
    done = compose("graph", "pipeline")
    assert (done.code, done.err) == (0, "")
    assert "flowchart LR" in done.out
    assert "/sensor_data" in done.out


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("p.svg", "<svg "),
        ("p.DOT", "digraph "),
        ("p.json", "{\n"),
        ("p.mmd", "---\n"),
        ("p.html", "<!DOCTYPE html>\n"),
    ],
)
def test_the_ending_of_the_file_says_as_what(name: str, begin: str, tmp_path: Path) -> None:
    target = tmp_path / name
    done = compose("graph", "pipeline", "-o", str(target))
    assert (done.code, done.out, done.err) == (0, "", f"wrote {target}\n")
    assert target.read_text(encoding="utf-8").startswith(begin)


def test_an_ending_that_says_nothing_is_a_usage_error(tmp_path: Path) -> None:
    done = compose("graph", "pipeline", "-o", str(tmp_path / "p.doc"))
    assert done.code == 2
    assert ".svg" in done.err


def test_the_format_may_be_said_instead(tmp_path: Path) -> None:
    target = tmp_path / "p.txt"
    assert compose("graph", "pipeline", "-o", str(target), "-f", "dot").code == 0
    assert target.read_text(encoding="utf-8").startswith("digraph ")


def test_a_file_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    done = compose("graph", "pipeline", "-o", str(tmp_path / "no" / "p.svg"))
    assert done.code == 1
    assert "No such file or directory" in done.err


def test_views() -> None:
    done = compose("graph", "pipeline", "--view", "lifecycle", "-f", "json")
    edges = json.loads(done.out)["edges"]
    assert [(edge["source"], edge["target"]) for edge in edges] == [
        ("node:/planning/planner", "node:/control/motor_controller")
    ]


def test_a_system_with_errors_is_drawn_with_the_errors_marked(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n")
    done = compose("graph", str(path))
    assert done.code == 0
    assert "class v1 wrong" in done.out
    assert "error[" in done.err


def test_a_file_that_is_no_system_at_all_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("[")
    done = compose("graph", str(path))
    assert (done.code, done.out) == (1, "")


def test_an_unknown_system_lists_the_examples() -> None:
    done = compose("graph", "pipelin")
    assert done.code == 2
    assert "did you mean 'pipeline'?" in done.err
    assert "talker_listener" in done.err


def test_several_systems_make_one_picture() -> None:
    done = compose("graph", "minimal", "talker_listener", "-f", "json")
    data = json.loads(done.out)
    assert data["title"] == "minimal + talker_listener"
    assert {"node:/talker", "node:/listener"} <= {vertex["key"] for vertex in data["vertices"]}


def test_something_must_be_named_to_be_drawn() -> None:
    for arguments in ([], ["pipeline", "--live"]):
        done = compose("graph", *arguments)
        assert (done.code, done.out) == (2, "")
        assert "--live" in done.err


def test_graphviz_that_is_asked_for_and_missing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    done = compose("graph", "pipeline", "-f", "svg", "--layout", "graphviz")
    assert (done.code, done.out) == (1, "")
    assert "Graphviz is not installed" in done.err
    assert "--layout bundled" in done.err
    assert compose("graph", "pipeline", "-f", "svg").out.startswith("<svg ")


def test_a_diagram_that_mermaid_would_refuse_is_told(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(fleet_text(300))
    done = compose("graph", str(path))
    assert done.code == 0
    assert "Mermaid's viewers refuse a diagram of this size" in done.err

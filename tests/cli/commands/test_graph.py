from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest

from tests.cli.compose import compose, refused, write_files
from tests.unit.support.fleets import fleet_text

PIPELINE = "systems/pipeline.yaml"
PIPELINE_FILE = str(Path(PIPELINE).resolve())


def test_the_output_is_mermaid_or_a_view_of_one_or_several_systems() -> None:
    done = compose("graph", PIPELINE)
    assert (done.code, done.err) == (0, "")
    assert "flowchart LR" in done.out
    assert "/sensor_data" in done.out
    done = compose("graph", PIPELINE, "--view", "lifecycle", "-f", "json")
    (edge,) = json.loads(done.out)["edges"]
    ends = ("node:/planning/planner", "node:/control/motor_controller")
    assert (edge["source"], edge["target"]) == ends
    done = compose("graph", "systems/minimal.yaml", "talker_listener", "-f", "json")
    data = json.loads(done.out)
    assert data["title"] == "minimal + talker_listener"
    assert {"node:/talker", "node:/listener"} <= {vertex["key"] for vertex in data["vertices"]}


@pytest.mark.parametrize(
    ("name", "options", "begin"),
    [
        ("p.svg", (), "<svg "),
        ("p.JSON", (), "{\n"),
        ("p.mmd", (), "---\n"),
        ("p.html", (), "<!DOCTYPE html>\n"),
        ("p.txt", ("-f", "json"), "{\n"),
        ("itself.svg", (), "<svg "),
        ("link.svg", (), "<svg "),
    ],
)
def test_the_file_suffix_or_an_option_selects_the_format(
    name: str, options: tuple[str, ...], begin: str, folder: Path
) -> None:
    Path("itself.svg").symlink_to("itself.svg")
    Path("link.svg").symlink_to("target.svg")
    done = compose("graph", PIPELINE_FILE, "-o", name, *options)
    assert (done.code, done.out, done.err) == (0, "", f"wrote {name}\n")
    assert Path(name).read_text(encoding="utf-8").startswith(begin)
    assert Path("itself.svg").is_symlink() == (name != "itself.svg")
    assert Path("target.svg").exists() == (name == "link.svg")


def test_a_file_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    assert ".svg" in refused(2, "graph", PIPELINE, "-o", str(tmp_path / "p.doc"))
    message = refused(1, "graph", PIPELINE, "-o", str(tmp_path / "no" / "p.svg"))
    assert "No such file or directory" in message
    done = compose("graph", PIPELINE, "-f", "svg", "-o", "/dev/null")
    assert (done.code, done.err) == (0, "wrote /dev/null\n")


def test_a_failed_write_leaves_the_file_as_it_was(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    target = tmp_path / "p.svg"
    target.write_text("before", encoding="utf-8")

    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("composer.cli.support.new_files.os.replace", fail)
    message = refused(1, "graph", PIPELINE, "-o", str(target))
    assert f"cannot write '{target}': No space left on device" in message
    assert list(tmp_path.iterdir()) == [target]
    assert target.read_text(encoding="utf-8") == "before"


def test_a_system_with_errors_is_drawn_if_there_is_one(folder: Path) -> None:
    write_files(
        {"a.yaml": "system: a\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n", "b.yaml": "["}
    )
    done = compose("graph", "a.yaml")
    assert done.code == 0
    assert "class v1 wrong" in done.out
    assert "error[" in done.err
    assert refused(1, "graph", "b.yaml")


def test_a_diagram_too_large_for_mermaid_prints_a_warning(folder: Path) -> None:
    write_files({"large.yaml": fleet_text(300)})
    done = compose("graph", "large.yaml")
    assert done.code == 0
    assert "Mermaid refuses to render a diagram of this size" in done.err


@pytest.mark.parametrize("command", [("graph",), ("run", "--dry-run"), ("export", "launch")])
def test_warnings_are_counted_and_errors_printed(folder: Path, command: tuple[str, ...]) -> None:
    text = "system: s\nnodes:\n  b: {on_activate: {log: hi}}  # compose: ignore[qos-implicit]\n"
    write_files({"s.yaml": text})
    done = compose(*command, "s.yaml")
    assert (done.code, done.err) == (0, "1 warning: see 'compose validate s.yaml'\n")
    write_files({"s.yaml": f"{text}  c: {{lifecycle: {{depends_on: [d]}}}}\n"})
    done = compose(*command, "s.yaml")
    assert "error[RC202 unknown-node]" in done.err
    assert "warning[" not in done.err

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest

from tests.cli.compose import compose
from tests.unit.support.fleets import fleet_text

PIPELINE = "systems/pipeline.yaml"


def test_the_default_is_a_mermaid_diagram_on_stdout() -> None:
    done = compose("graph", PIPELINE)
    assert (done.code, done.err) == (0, "")
    assert "flowchart LR" in done.out
    assert "/sensor_data" in done.out


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("p.svg", "<svg "),
        ("p.JSON", "{\n"),
        ("p.mmd", "---\n"),
        ("p.html", "<!DOCTYPE html>\n"),
    ],
)
def test_the_file_suffix_selects_the_format(name: str, begin: str, tmp_path: Path) -> None:
    target = tmp_path / name
    done = compose("graph", PIPELINE, "-o", str(target))
    assert (done.code, done.out, done.err) == (0, "", f"wrote {target}\n")
    assert target.read_text(encoding="utf-8").startswith(begin)


def test_an_unknown_file_suffix_is_a_usage_error(tmp_path: Path) -> None:
    done = compose("graph", PIPELINE, "-o", str(tmp_path / "p.doc"))
    assert done.code == 2
    assert ".svg" in done.err


def test_the_format_option_overrides_the_suffix(tmp_path: Path) -> None:
    target = tmp_path / "p.txt"
    assert compose("graph", PIPELINE, "-o", str(target), "-f", "json").code == 0
    assert target.read_text(encoding="utf-8").startswith("{\n")


def test_an_unwritable_file_is_reported(tmp_path: Path) -> None:
    done = compose("graph", PIPELINE, "-o", str(tmp_path / "no" / "p.svg"))
    assert done.code == 1
    assert "No such file or directory" in done.err


def test_a_link_to_itself_is_replaced(tmp_path: Path) -> None:
    target = tmp_path / "p.svg"
    target.symlink_to(target.name)
    done = compose("graph", PIPELINE, "-o", str(target))
    assert (done.code, done.err) == (0, f"wrote {target}\n")
    assert target.read_text(encoding="utf-8").startswith("<svg ")


def test_a_failed_write_leaves_the_file_as_it_was(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    target = tmp_path / "p.svg"
    target.write_text("before", encoding="utf-8")

    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("composer.cli.support.new_files.os.replace", fail)
    done = compose("graph", PIPELINE, "-o", str(target))
    assert (done.code, done.out) == (1, "")
    assert f"cannot write '{target}': No space left on device" in done.err
    assert [(path.name, path.read_text(encoding="utf-8")) for path in tmp_path.iterdir()] == [
        ("p.svg", "before")
    ]


def test_a_diagram_goes_to_a_device_or_through_a_link(tmp_path: Path) -> None:
    done = compose("graph", PIPELINE, "-f", "svg", "-o", "/dev/null")
    assert (done.code, done.err) == (0, "wrote /dev/null\n")
    (tmp_path / "link.svg").symlink_to("p.svg")
    assert compose("graph", PIPELINE, "-o", str(tmp_path / "link.svg")).code == 0
    assert (tmp_path / "link.svg").is_symlink()
    assert (tmp_path / "p.svg").read_text(encoding="utf-8").startswith("<svg ")


def test_views() -> None:
    done = compose("graph", PIPELINE, "--view", "lifecycle", "-f", "json")
    edges = json.loads(done.out)["edges"]
    assert [(edge["source"], edge["target"]) for edge in edges] == [
        ("node:/planning/planner", "node:/control/motor_controller")
    ]


def test_errors_are_marked_in_the_diagram(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n")
    done = compose("graph", str(path))
    assert done.code == 0
    assert "class v1 wrong" in done.out
    assert "error[" in done.err


def test_a_file_that_is_not_a_system_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("[")
    done = compose("graph", str(path))
    assert (done.code, done.out) == (1, "")


def test_an_unknown_system_name_lists_the_examples() -> None:
    done = compose("graph", "pipelin")
    assert done.code == 2
    assert "did you mean 'pipeline'?" in done.err
    assert "talker_listener" in done.err


def test_several_systems_are_drawn_in_one_diagram() -> None:
    done = compose("graph", "systems/minimal.yaml", "talker_listener", "-f", "json")
    data = json.loads(done.out)
    assert data["title"] == "minimal + talker_listener"
    assert {"node:/talker", "node:/listener"} <= {vertex["key"] for vertex in data["vertices"]}


def test_systems_and_live_are_mutually_exclusive() -> None:
    for arguments in ([], ["pipeline", "--live"]):
        done = compose("graph", *arguments)
        assert (done.code, done.out) == (2, "")
        assert "--live" in done.err


def test_a_diagram_too_large_for_mermaid_prints_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(fleet_text(300))
    done = compose("graph", str(path))
    assert done.code == 0
    assert "Mermaid refuses to render a diagram of this size" in done.err


@pytest.mark.parametrize("command", [("graph",), ("run", "--dry-run"), ("export", "launch")])
def test_warnings_are_counted_and_errors_printed(tmp_path: Path, command: tuple[str, ...]) -> None:
    system = tmp_path / "s.yaml"
    text = "system: s\nnodes:\n  b: {on_activate: {log: hi}}  # compose: ignore[qos-implicit]\n"
    system.write_text(text)
    done = compose(*command, str(system))
    assert (done.code, done.err) == (0, f"1 warning: see 'compose validate {system}'\n")
    system.write_text(f"{text}  c: {{lifecycle: {{depends_on: [d]}}}}\n")
    done = compose(*command, str(system))
    assert "error[RC202 unknown-node]" in done.err
    assert "warning[" not in done.err

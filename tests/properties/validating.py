"""What holds for everything that ``compose validate`` can be given."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from composer.diagnostics import Diagnostic
from composer.document import read_document
from composer.interfaces import Interfaces
from composer.loading import load_bytes
from composer.report import github, sarif, text
from composer.report import json as report
from composer.resources import interfaces_folder, nodes_folder, systems_folder
from composer.source import Span
from composer.tree import plain

ROOT = Path(__file__).parents[2]
INTERFACES = Interfaces.load([interfaces_folder()])
SHIPPED = tuple(
    path for folder in (systems_folder(), nodes_folder()) for path in sorted(folder.glob("*.yaml"))
)
#: What no shipped file says.
OTHERS = (
    {
        "node": "loud_watchdog",
        "extends": "watchdog",
        "variables": {"message_type": {"default": "std_msgs/msg/String"}},
        "parameters": {"timeout_ms": 50.0},
        "timers": {"raise_alarm": {"log": {"level": "error", "message": "silent"}}},
    },
    {
        "system": "corridor",
        "include": [
            {"file": "robot.yaml", "for_each": {"i": 2}, "prefix": "r${i}_", "namespace": "r${i}"},
            {"file": "executors.yaml", "variables": {}, "overrides": {
                "nodes": {"observer": {"lifecycle": {"timeout_ms": 10}}},
                "executors": {"control": {"kind": "events"}},
            }},
        ],
        "connections": [{"topic": "/all", "from": "r*_simulator.sensor_data"}],
    },
)  # fmt: skip
RENDERERS = (report.render, sarif.render, github.render, text.render)


def contents() -> list[Any]:
    """Return what the shipped systems and node types say, and what none of them says."""
    trees = (read_document(path)[0] for path in SHIPPED)
    return [*(plain(tree) for tree in trees if tree is not None), *OTHERS]


def validate_and_check(data: bytes) -> list[Diagnostic]:
    """Validate ``data`` as a file of this project, and hold the findings to their promises."""
    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        found = load_bytes(data, ROOT, shown="systems/it.yaml", interfaces=INTERFACES).diagnostics
    assert said.getvalue() == ""
    hold(found)
    return found


def hold(found: list[Diagnostic]) -> None:
    """Hold findings to what is promised of them: their places, their order, their reports."""
    assert found == sorted(found, key=lambda finding: finding.sort_key)
    for finding in found:
        _hold(finding)
    for render in RENDERERS:
        _hold_text(render(found))


def _hold(finding: Diagnostic) -> None:
    for told in (finding.message, finding.hint or ""):
        assert "\n" not in told
        assert len(told) < 2000
    for span in (finding.primary, *(label.span for label in finding.related)):
        _hold_place(span)


def _hold_place(span: Span) -> None:
    line = span.file.line(span.line)
    assert 1 <= span.line <= max(len(span.file.lines), 1)
    assert 1 <= span.column <= len(line) + 1
    assert span.length >= 1


def _hold_text(rendered: str) -> None:
    assert all(character.isprintable() or character == "\n" for character in rendered)

"""Checks of the diagnostics of arbitrary files."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.base.folders import interfaces_folder, nodes_folder, systems_folder
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.language.document import read_document
from composer.language.tree import plain
from composer.loading import load_bytes
from composer.report import machine, text

ROOT = Path(__file__).parents[2]
INTERFACES = Interfaces.load([interfaces_folder()])
SHIPPED = tuple(
    path for folder in (systems_folder(), nodes_folder()) for path in sorted(folder.glob("*.yaml"))
)
SCENARIOS = tuple(sorted((ROOT / "scenarios").glob("*.yaml")))
#: Features that no shipped file uses.
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
            {"file": "executors.yaml", "arguments": {}, "overrides": {
                "nodes": {"observer": {"lifecycle": {"timeout_ms": 10}}},
                "executors": {"control": {"kind": "events"}},
            }},
        ],
        "connections": [{"topic": "/all", "from": "r*_simulator.sensor_data"}],
    },
    {
        "system": "rover",
        "discovery": {"kind": "server", "address": "192.168.1.10", "start": True},
        "hosts": {"jetson": {"address": "192.168.1.20", "user": "robot", "workspace": "~/rover"}},
        "processes": {"vision": {"nodes": ["camera", "mast"], "host": "jetson"}},
        "nodes": {
            "camera": {"class": "rover.camera:Camera", "arguments": {"width": 640}},
            "driver": {"executable": {"command": ["rover_driver", "--port", "/dev/ttyUSB0"]}},
            "planner": {"external": True, "publishers": {"path": {"type": "nav_msgs/msg/Path"}}},
            "mast": {"transforms": {"static": {
                "mast": {"parent": "base_link", "translation_m": {"z": 0.2}},
            }}},
        },
    },
)  # fmt: skip
RENDERERS = (*machine.RENDERERS.values(), text.render)


def contents() -> list[Any]:
    """Return the contents of the shipped systems and node types, and of OTHERS."""
    trees = (read_document(path)[0] for path in (*SHIPPED, *SCENARIOS))
    return [*(plain(tree) for tree in trees if tree is not None), *OTHERS]


def validate_and_check(data: bytes) -> list[Diagnostic]:
    """Validate ``data`` as a file of this project and check its diagnostics."""
    output = io.StringIO()
    with redirect_stdout(output), redirect_stderr(output):
        loading = load_bytes(data, ROOT, shown="systems/it.yaml", interfaces=INTERFACES)
    assert output.getvalue() == ""
    check_diagnostics(loading.diagnostics)
    return loading.diagnostics


def check_diagnostics(diagnostics: list[Diagnostic]) -> None:
    """Check the locations, the order and the rendering of diagnostics."""
    assert diagnostics == sorted(diagnostics, key=lambda diagnostic: diagnostic.sort_key)
    for diagnostic in diagnostics:
        _check(diagnostic)
    for render in RENDERERS:
        _check_text(render(diagnostics))


def _check(diagnostic: Diagnostic) -> None:
    for text_part in (diagnostic.message, diagnostic.hint or ""):
        assert "\n" not in text_part
        assert len(text_part) < 2000
    for span in (diagnostic.primary, *(label.span for label in diagnostic.related)):
        _check_span(span)


def _check_span(span: Span) -> None:
    line = span.file.line(span.line)
    assert 1 <= span.line <= max(len(span.file.lines), 1)
    assert 1 <= span.column <= len(line) + 1
    assert span.length >= 1


def _check_text(rendered: str) -> None:
    assert all(character.isprintable() or character == "\n" for character in rendered)

"""SARIF logs match the OASIS schema, in the form of the package pydantic-sarif.

The package is generated from ``sarif-schema-2.1.0.json``. It checks required, unknown properties,
types, enumerations and minimum values. What a schema does not cover, such as URIs and indexes, is
tested in test_machine_formats.py.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from composer.loading import load_files
from composer.report.machine import render_sarif
from tests.programs import require_module

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "tests" / "golden" / "err").glob("*.yaml"))


def check(log: Any) -> None:
    """Raise ValueError if the log does not match."""
    # Not above: importing it takes longer than collecting a hundred files of tests.
    model = require_module("pydantic_sarif.model")
    model.StaticAnalysisResultsFormatSarifVersion210JsonSchema.model_validate_json(json.dumps(log))


def logs_of(paths: Sequence[Path]) -> list[Any]:
    return [json.loads(render_sarif(result.diagnostics)) for result in load_files(paths)]


def test_diagnostics_match_the_schema() -> None:
    for path, log in zip(EXAMPLES, logs_of(EXAMPLES), strict=True):
        assert log["runs"][0]["results"], path
        check(log)


def test_an_empty_log_matches_the_schema() -> None:
    check(json.loads(render_sarif([])))


def _in_result(change: Callable[[Any], None]) -> Any:
    [log] = logs_of([ROOT / "tests/golden/err/ten_mistakes.yaml"])
    change(log["runs"][0]["results"][0])
    return log


@pytest.mark.parametrize(
    "change",
    [
        lambda result: result.pop("message"),
        lambda result: result.update(level="fatal"),
        lambda result: result.update(rule="RC202"),
        lambda result: result.update(ruleIndex=-2),
        lambda result: result["locations"][0]["physicalLocation"]["region"].update(startLine=0),
        lambda result: result["locations"][0].update(file="a.yaml"),
    ],
    ids=["no message", "a level", "a property", "an index", "a line", "a place"],
)
def test_invalid_logs_do_not_match_the_schema(change: Callable[[Any], None]) -> None:
    with pytest.raises(ValueError, match="validation error"):
        check(_in_result(change))

"""Every example system does what its scenario says, twice the same; JUnit XML reports it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from junitparser import JUnitXml, TestCase

ROOT = Path(__file__).parents[3]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, TestCase]:
    """The results of the second runs of all scenarios, by file."""
    report = tmp_path_factory.mktemp("report") / "junit.xml"
    options = ("--repeat", "2", "-j", "2", "--junit", str(report))
    command = [sys.executable, "-m", "composer", "test", *options]
    subprocess.run(command, cwd=ROOT, capture_output=True, check=False, timeout=170)
    [suite] = JUnitXml.fromfile(str(report))
    assert suite.tests == 2 * len(SCENARIOS)
    return {str(case.classname): case for case in suite}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_example(path: Path, results: dict[str, TestCase]) -> None:
    case = results[str(path.relative_to(ROOT))]
    assert [item.text for item in case.result] == []


def test_every_example_has_a_scenario() -> None:
    systems = {path.stem for path in (ROOT / "systems").glob("*.yaml")}
    assert {path.stem for path in SCENARIOS} == systems

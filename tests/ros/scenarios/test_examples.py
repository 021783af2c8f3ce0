"""Examples, the project in the guide and new projects pass their own scenarios and tests."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from junitparser import JUnitXml, TestCase

from tests.ros.support.commands import output_of

ROOT = Path(__file__).parents[3]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))
#: A file of a project in the guide to testing.
FILE = re.compile(r"```(?:yaml|python)\n# (\S+)\n(.*?)```", re.DOTALL)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, TestCase]:
    """The results of the second runs of all scenarios, by file; JUnit XML reports them."""
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


def output_of_tests(folder: Path, *arguments: str) -> list[str]:
    """Run the tests of a project; return the lines of the output."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=150
    )
    return done.stdout.splitlines() or [done.stderr]


def test_the_tests_in_the_guide_pass_and_a_scenario_fails(tmp_path: Path) -> None:
    guide = ROOT / "docs" / "guides" / "testing.md"
    files = FILE.findall(guide.read_text(encoding="utf-8"))
    assert len(files) == 5
    system = "system: s\nnodes: {a: {on_activate: {log: started}}}\n"
    wrong = "scenario: wrong\nsystem: ../s.yaml\nfor_s: 1\nexpect: [{log: 'b<'}]\n"
    files += [("composer.yaml", ""), ("s.yaml", system), ("scenarios/wrong.yaml", wrong)]
    for name, text in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    output = output_of_tests(tmp_path, "--rootdir=.", "tests", "scenarios")
    assert output[-1].startswith("1 failed, 4 passed"), output
    assert "a line 'b<' in the log" in "\n".join(output)


def test_the_tests_of_a_new_project_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    output_of("new", "project", "my_robot")
    monkeypatch.chdir(tmp_path / "my_robot")
    output_of("new", "node", "gripper")
    output = output_of_tests(tmp_path / "my_robot")
    assert output[-1].startswith("4 passed"), output

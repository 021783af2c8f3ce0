"""Every file in err/ gives the report next to it, and every example system its plan in plan/.

After an intended change, run ``pytest tests/golden --update-golden`` and review the diff.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from composer.base.diagnostics import Rule
from composer.base.folders import systems_folder
from composer.loading import load, load_files, load_models
from composer.loading.reported import LoadResult
from composer.plan import bring_up, tear_down
from composer.python_code.problems import Family
from composer.report.machine import render_sarif
from composer.report.text import render
from composer.rules import all_checks
from tests.unit.support.reporting import check_sarif

ROOT = Path(__file__).parents[2]
ERRORS = Path("tests/golden/err")
PLANS = ROOT / "tests/golden/plan"
SYSTEMS = sorted(systems_folder().glob("*.yaml"))
CASES = sorted(path.name for path in (ROOT / ERRORS).glob("*.yaml"))
CODE = re.compile(r"^\w+\[(RC\d+) ", re.MULTILINE)


@pytest.fixture(scope="module")
def results() -> dict[str, LoadResult]:
    """What is found in all files. All at once: the type checker starts once."""
    with pytest.MonkeyPatch.context() as current:
        current.chdir(ROOT)
        return dict(zip(CASES, load_files(ERRORS / name for name in CASES), strict=True))


@pytest.mark.parametrize("name", CASES)
def test_report_matches_the_golden_file(
    name: str,
    results: dict[str, LoadResult],
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    report = render(results[name].diagnostics)
    expected = ERRORS / f"{Path(name).stem}.txt"
    if request.config.getoption("--update-golden"):
        expected.write_text(report, encoding="utf-8")
    assert report == expected.read_text(encoding="utf-8")
    assert CODE.search(report), "every file in err/ has a mistake"
    assert str(ROOT) not in report, "reports contain no absolute paths"


def test_every_report_matches_the_schema_of_sarif(results: dict[str, LoadResult]) -> None:
    for name, result in results.items():
        log = json.loads(render_sarif(result.diagnostics))
        assert log["runs"][0]["results"], name
        check_sarif(log)


def test_every_report_has_its_file() -> None:
    reports = sorted(path.stem for path in (ROOT / ERRORS).glob("*.txt"))
    assert reports == [Path(name).stem for name in CASES]


def test_every_check_has_a_report() -> None:
    reported = set()
    for path in (ROOT / ERRORS).glob("*.txt"):
        reported |= set(CODE.findall(path.read_text(encoding="utf-8")))
    modules = [module for name, module in sys.modules.items() if name.startswith("composer.rules.")]
    rules = [item for module in modules for item in vars(module).values() if isinstance(item, Rule)]
    # RC214 needs a folder outside of a project: tests/unit/rules/test_examples.py. RC307 needs an
    # installed package: tests/unit/rules/test_projects.py. RC437 needs another Python.
    rules += [family.value for family in Family]
    assert all_checks()
    assert {rule.code for rule in rules} - reported == {"RC214", "RC307", "RC437"}


def test_ten_mistakes_give_ten_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    diagnostics = load(ERRORS / "ten_mistakes.yaml").diagnostics
    assert len(diagnostics) == len({diagnostic.message for diagnostic in diagnostics}) == 10


@pytest.mark.parametrize("path", SYSTEMS, ids=[path.stem for path in SYSTEMS])
def test_plan(path: Path) -> None:
    system = load_models([path])[0].system
    assert system is not None
    printed = f"# up\n{bring_up(system)}\n# down\n{tear_down(system)}\n"
    assert printed == (PLANS / f"{path.stem}.txt").read_text(encoding="utf-8")


def test_every_expected_plan_belongs_to_a_system() -> None:
    assert {path.stem for path in PLANS.glob("*.txt")} == {path.stem for path in SYSTEMS}

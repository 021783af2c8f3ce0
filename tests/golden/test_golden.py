"""Every file in err/ gives exactly the report beside it.

pytest tests/golden --update-golden    writes the reports anew: read the difference
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.loading import load
from composer.report.text import render
from composer.rules import all_checks

ROOT = Path(__file__).parents[2]
ERRORS = Path("tests/golden/err")
CASES = sorted(path.name for path in (ROOT / ERRORS).glob("*.yaml"))
CODE = re.compile(r"^\w+\[(RC\d+) ", re.MULTILINE)


@pytest.mark.parametrize("name", CASES)
def test_findings_are_those_written_down(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    report = render(load(ERRORS / name).diagnostics)
    expected = ERRORS / f"{Path(name).stem}.txt"
    if request.config.getoption("--update-golden"):
        expected.write_text(report, encoding="utf-8")
    assert report == expected.read_text(encoding="utf-8")
    assert CODE.search(report), "a file in err/ has something wrong with it"
    assert str(ROOT) not in report, "a report names no folder of one machine"


def test_every_report_has_its_file() -> None:
    reports = sorted(path.stem for path in (ROOT / ERRORS).glob("*.txt"))
    assert reports == [Path(name).stem for name in CASES]


def test_every_check_has_a_report() -> None:
    reported = set()
    for path in (ROOT / ERRORS).glob("*.txt"):
        reported |= set(CODE.findall(path.read_text(encoding="utf-8")))
    checked = {check.__globals__["RULE"].code for check in all_checks()}
    assert checked - reported == set()


def test_ten_mistakes_give_ten_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    findings = load(ERRORS / "ten_mistakes.yaml").diagnostics
    rules = [finding.rule.code for finding in findings]
    assert len(rules) == 10
    assert len(set(rules)) == 10

"""JSON, SARIF and GitHub annotations."""

from __future__ import annotations

import json
import textwrap
from dataclasses import replace
from typing import Any

import pytest
from jsonschema import Draft7Validator

from composer.base.diagnostics import Diagnostic, Label, Severity
from composer.base.folders import schemas_folder
from composer.base.source import SourceFile, Span
from composer.report.machine import fingerprints, render_github, render_json, render_sarif
from tests.unit.support.reporting import check_sarif, diagnostic, rule

TEXT = "system: demo\nnodes: {talker: {type: relai}}\n"


def example() -> list[Diagnostic]:
    first = diagnostic(TEXT, "relai", "there is no 'relai'", line=2, hint="did you mean 'relay'?")
    label = Label(first.primary.part(0, 2), "this one")
    second = replace(first, rule=rule(Severity.INFO, "RC242", "hint"), related=(label,), hint=None)
    return [first, replace(first, message="again"), second]


def test_json_is_complete_and_matches_its_schema() -> None:
    schema = json.loads((schemas_folder() / "report.schema.json").read_text(encoding="utf-8"))
    Draft7Validator.check_schema(schema)
    for diagnostics in ([], example()):
        report = json.loads(render_json(diagnostics))
        assert list(Draft7Validator(schema).iter_errors(report)) == []
    assert report["summary"] == {"errors": 2, "warnings": 0, "infos": 1}
    assert report["diagnostics"][0] == {
        "code": "RC202",
        "rule": "made-up",
        "severity": "error",
        "message": "there is no 'relai'",
        "hint": "did you mean 'relay'?",
        "location": {"file": "systems/demo.yaml", "line": 2, "column": 24, "end_column": 29},
        "related": [],
        "fingerprint": fingerprints(example())[0],
    }
    assert [label["message"] for label in report["diagnostics"][2]["related"]] == ["this one"]


def sarif_results(diagnostics: list[Diagnostic]) -> list[dict[str, Any]]:
    return json.loads(render_sarif(diagnostics))["runs"][0]["results"]


def test_sarif_has_the_places_the_level_and_the_hint() -> None:
    found = example()
    results = sarif_results(found)
    for shown, result in zip(found, results, strict=True):
        spans = [shown.primary, *(label.span for label in shown.related)]
        places = [*result["locations"], *result.get("relatedLocations", ())]
        assert [place["physicalLocation"]["region"] for place in places] == [
            {
                "startLine": span.line,
                "startColumn": span.column,
                "endColumn": span.column + span.length,
            }
            for span in spans
        ]
        assert [place.get("id") for place in places] == [None, *range(1, len(places))]
    assert [result["level"] for result in results] == ["error", "error", "note"]
    assert results[0]["message"]["text"] == "there is no 'relai'\ndid you mean 'relay'?"


@pytest.mark.parametrize(
    ("path", "uri"),
    [
        ("systems/demo.yaml", "systems/demo.yaml"),
        ("./demo.yaml", "demo.yaml"),
        ("my robot/naïve%.yaml", "my%20robot/na%C3%AFve%25.yaml"),
        ("/robots/demo.yaml", "file:///robots/demo.yaml"),
        ("caf\udce9.yaml", "caf%E9.yaml"),
    ],
)
def test_sarif_paths_are_uri_references(path: str, uri: str) -> None:
    [result] = sarif_results([diagnostic(TEXT, "demo", path=path)])
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == uri


def moved(found: Diagnostic) -> Diagnostic:
    """Return the diagnostic as it is in a file with more lines above and deeper indentation."""
    span = found.primary
    text = "\n" * 7 + textwrap.indent(span.file.text, "    ")
    file = SourceFile(span.file.path, text)
    return replace(found, primary=Span(file, span.line + 7, span.column + 4, span.length))


def test_fingerprints_survive_lines_added_above_and_deeper_indentation() -> None:
    before = example()
    assert fingerprints(before) == fingerprints([moved(found) for found in before])


def test_fingerprints_are_unique() -> None:
    same = diagnostic(TEXT, "relai", line=2)
    others = [
        replace(same, message="another"),
        replace(same, rule=rule(code="RC242")),
        diagnostic(TEXT.replace("relai", "rely"), "rely", line=2),
        diagnostic(TEXT, "relai", line=2, path="another.yaml"),
    ]
    prints = fingerprints([same, same, *others])
    assert len(set(prints)) == len(prints)


def test_github_commands_have_the_location_and_the_message() -> None:
    [line] = render_github(example()[:1]).splitlines()
    assert line == (
        "::error file=systems/demo.yaml,line=2,endLine=2,col=24,endColumn=29,"
        "title=RC202 made-up::there is no 'relai'%0Ahint: did you mean 'relay'?"
    )


def test_github_commands_are_escaped() -> None:
    found = diagnostic(
        TEXT, "demo", "100%\n::error::gotcha\r", path="a,line=1::b%.yaml", hint="x\x1b[2J"
    )
    [line] = render_github([found]).splitlines()
    assert "file=a%2Cline=1%3A%3Ab%25.yaml,line=1" in line
    assert "100%25\\n::error::gotcha\\r" in line
    assert "\x1b" not in line


def test_github_commands_follow_the_severity() -> None:
    made_by = [rule(severity) for severity in Severity]
    lines = render_github(diagnostic("a", "a", made_by=item) for item in made_by).splitlines()
    assert [line.split()[0] for line in lines] == ["::error", "::warning", "::notice"]


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ([], {"message": None}),
        ([], {"level": "fatal"}),
        ([], {"rule": "RC202"}),
        ([], {"ruleIndex": -2}),
        (["locations", 0, "physicalLocation", "region"], {"startLine": 0}),
        (["locations", 0], {"file": "a.yaml"}),
    ],
)
def test_invalid_logs_do_not_match_the_schema(
    part: list[str | int], change: dict[str, object]
) -> None:
    check_sarif(json.loads(render_sarif([])))
    log = json.loads(render_sarif(example()))
    check_sarif(log)
    changed = log["runs"][0]["results"][0]
    for key in part:
        changed = changed[key]
    changed.update(change)
    with pytest.raises(ValueError, match="validation error"):
        check_sarif(log)

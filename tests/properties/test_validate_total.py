"""Any file can be validated, and its diagnostics are well-formed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from composer.assembly.canonical import canonical
from composer.document.writer import write_document
from composer.loading import collect_diagnostics, load
from tests.examples import examples
from tests.properties.mutation import mutated
from tests.properties.validating import (
    INTERFACES,
    SHIPPED,
    check_diagnostics,
    contents,
    validate_and_check,
)

CONTENTS = contents()
TEXTS = [path.read_text(encoding="utf-8") for path in SHIPPED]


@st.composite
def spliced(draw: st.DrawFn) -> str:
    """Draw a shipped file with lines removed, duplicated, moved and indented."""
    lines = draw(st.sampled_from(TEXTS)).splitlines(keepends=True)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(lines)))
        end = draw(st.integers(start, min(start + 4, len(lines))))
        piece = lines[start:end]
        match draw(st.sampled_from(["remove", "duplicate", "move", "indent", "insert"])):
            case "remove":
                lines[start:end] = []
            case "duplicate":
                lines[start:start] = piece
            case "move":
                lines[start:end] = []
                place = draw(st.integers(0, len(lines)))
                lines[place:place] = piece
            case "indent":
                lines[start:end] = [f"  {line}" for line in piece]
            case "insert":
                other = draw(st.sampled_from(TEXTS)).splitlines(keepends=True)
                lines[start:start] = draw(st.lists(st.sampled_from(other), max_size=3))
    return "".join(lines)


#: Shipped files with mutated values, and with mutated text.
MUTATED = (
    st.sampled_from(CONTENTS).flatmap(mutated).map(lambda content: json.dumps(content).encode())
)
SPLICED = spliced().map(str.encode)


@examples(150)
@given(MUTATED)
def test_mutated_files(data: bytes) -> None:
    validate_and_check(data)


@examples(100)
@given(SPLICED)
@example(b"")
@example(b"system: a\nnodes: {b: {type: [x]}}\n")
def test_spliced_files(data: bytes) -> None:
    validate_and_check(data)


#: Includes part.yaml twice.
WHOLE = """\
system: whole
include:
  - {file: part.yaml, for_each: {i: 2}, prefix: "p${i}_", namespace: "p${i}"}
nodes:
  one: {type: child}
  two: {lifecycle: {depends_on: ["*_*"]}}
"""
CHILD = """\
node: child
extends: base
variables: {message_type: {default: std_msgs/msg/String}, qos: {default: state}}
parameters: {rate_hz: 2.0}
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("project")
    (folder / "nodes").mkdir()
    (folder / "whole.yaml").write_text(WHOLE, encoding="utf-8")
    (folder / "nodes" / "child.yaml").write_text(CHILD, encoding="utf-8")
    return folder


@examples(60)
@given(part=MUTATED | SPLICED, base=MUTATED | SPLICED)
def test_errors_in_included_and_extended_files(project: Path, part: bytes, base: bytes) -> None:
    (project / "part.yaml").write_bytes(part)
    (project / "nodes" / "base.yaml").write_bytes(base)
    names = ["whole.yaml", "part.yaml", "nodes/child.yaml"]
    loadings = [load(project / name, shown=name, interfaces=INTERFACES) for name in names]
    for loading in loadings:
        check_diagnostics(loading.diagnostics)
        if loading.tree is not None:
            write_document(canonical(loading.tree))
    collected = collect_diagnostics(loadings)
    check_diagnostics(collected)
    assert {diagnostic.rule for loading in loadings for diagnostic in loading.diagnostics} == {
        diagnostic.rule for diagnostic in collected if diagnostic.rule.name != "unused-node-type"
    }


def test_shipped_files_are_clean() -> None:
    for text in TEXTS:
        assert validate_and_check(text.encode("utf-8")) == []

"""Any file can be validated, and its diagnostics are well-formed."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import example, given

from composer.language.document.writer import canonical, write_document
from composer.language.rules import UNUSED_DECLARATION
from composer.loading import load
from composer.loading.reported import collect_diagnostics
from tests.examples import examples
from tests.properties.surfaces import SURFACES, TEXTS
from tests.properties.validating import INTERFACES, check_diagnostics, validate_and_check

FILES = SURFACES["values"].inputs | SURFACES["lines"].inputs


@examples(150)
@given(SURFACES["values"].inputs)
def test_mutated_files(data: bytes) -> None:
    validate_and_check(data)


@examples(100)
@given(SURFACES["lines"].inputs)
@example(b"")
@example(b"system: a\nnodes: {b: {type: [x]}}\n")
def test_spliced_files(data: bytes) -> None:
    validate_and_check(data)


@pytest.mark.parametrize("name", ["settings", "definitions", "parameter files", "graphs"])
def test_other_inputs(name: str) -> None:
    surface = SURFACES[name]

    @examples(30)
    @given(surface.inputs)
    def holds(data: bytes) -> None:
        surface.check(data)

    holds()


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
@given(part=FILES, base=FILES)
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
    single = {diagnostic.rule for loading in loadings for diagnostic in loading.diagnostics}
    # That a node type is unused is known of all files together only.
    assert single | {UNUSED_DECLARATION} == {item.rule for item in collected} | {UNUSED_DECLARATION}


def test_shipped_files_are_clean() -> None:
    for text in TEXTS:
        found = validate_and_check(text.encode("utf-8"))
        # All are validated under one name of a file.
        assert [item for item in found if item.rule.name != "node-type-name"] == []

"""``compose config`` prints a file that is equivalent to its input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.base.folders import systems_folder
from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.document.writer import canonical, write_document
from composer.language.tree import Mapping, plain
from composer.loading import gives_same_model, load, load_models
from composer.loading.reported import LoadResult
from tests.examples import examples
from tests.properties.mutation import maps, trees
from tests.properties.validating import SHIPPED

#: Systems that can be included anywhere, with arguments and nodes to override.
PARTS: dict[str, dict[str, Any]] = {
    "robot.yaml": {"arguments": {"start": [1.0, 2.5]}, "nodes": {"planner": {"executor": "slow"}}},
    "fleet.yaml": {"nodes": {"tower": {"lifecycle": {"timeout_ms": 10}}}},
    "toolbox.yaml": {"nodes": {"source": {"parameters": {"rate_hz": 2.5}}}},
    "navigation.yaml": {},
    "talker_listener.yaml": {"nodes": {"talker": {"timers": {"tick": {"rate_hz": 5}}}}},
}


@st.composite
def fleets(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a system that includes shipped ones, with all features of includes."""
    includes = []
    for number in range(draw(st.integers(1, 3))):
        file = draw(st.sampled_from(sorted(PARTS)))
        changes = dict(PARTS[file])
        include: dict[str, Any] = {"file": file, "prefix": f"p{number}_${{i}}_"}
        include["for_each"] = {"i": draw(st.sampled_from([1, 2, ["a", "b"], [True]]))}
        if draw(st.booleans()):
            include["namespace"] = draw(st.sampled_from(["/hall", "hall", "hall/${i}", "a_${i}"]))
        if draw(st.booleans()) and "arguments" in changes:
            include["arguments"] = changes["arguments"]
        if draw(st.booleans()) and "nodes" in changes:
            include["overrides"] = {"nodes": changes["nodes"]}
        includes.append(include)
    text = draw(
        st.sampled_from(["plain", "$${literal}", "a: b # c", "null", "0o17", "'\"", "é\t\n"])
    )
    own = {"on_activate": {"log": text}, "lifecycle": {"depends_on": ["p0_*"]}}
    return {
        "system": "drawn",
        "description": text,
        **({"namespace": "/robots"} if draw(st.booleans()) else {}),
        "executors": {"slow": {"kind": "single_threaded"}},
        "include": includes,
        "nodes": {"own_${n}": {"for_each": {"n": draw(st.integers(1, 3))}, **own}},
    }


def check_round_trip(loading: LoadResult) -> None:
    """Check that the expanded file is equivalent to its input and a fixed point."""
    assert loading.tree is not None
    text = write_document(canonical(loading.tree))
    assert gives_same_model(loading, text)
    tree, diagnostics = parse_document(SourceFile("it", text))
    assert diagnostics == []
    assert tree is not None
    if tree.entry("system") is not None:
        assert all(entry.name not in {"include", "arguments"} for entry in tree)
        assert plain(canonical(loading.tree)) == plain(tree)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_shipped_file(path: Path) -> None:
    check_round_trip(load_models([path])[0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleets")
    for path in systems_folder().glob("*.yaml"):
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


@examples(40)
@given(fleet=fleets())
def test_drawn_system(folder: Path, fleet: dict[str, Any]) -> None:
    path = folder / "drawn.yaml"
    path.write_text(json.dumps(fleet), encoding="utf-8")
    loading = load(path)
    assert loading.system is not None
    assert {item.rule.name for item in loading.diagnostics} & {"unknown-key", "wrong-type"} == set()
    check_round_trip(loading)


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(exclude_categories=["Cc", "Cs", "Cf", "Co", "Cn"]), max_size=12),
    st.text("abz019_./~{}()[]'\"+-*% :#&!|>@`,?\t\n", max_size=8),
    st.sampled_from(["yes", "NO", "null", "~", "1e3", "0x1f", "08", "22:22", "- a", "a: b", "<<"]),
)
names = st.text("abz019_./~{} :#*-é\t", min_size=1, max_size=8)


@examples(200)
@given(tree=maps(names, trees(names, scalars, 5, 30), 5))
def test_any_tree_round_trips(tree: Mapping) -> None:
    if not tree.entries:
        return
    read, diagnostics = parse_document(SourceFile("it", write_document(tree)))
    assert [item.message for item in diagnostics] == []
    assert read is not None
    assert repr(plain(read)) == repr(plain(tree))

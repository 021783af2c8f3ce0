"""Any tree can be expanded and checked against the schemas."""

from __future__ import annotations

import json

from hypothesis import example, given
from hypothesis import strategies as st

from composer.language.expand import expand, missing_names
from composer.language.expand.arguments import measure
from composer.language.rules import MAX_VALUES
from composer.language.schema import SCHEMAS, check_schema, schema
from composer.language.tree import Mapping, Plain, plain
from tests.examples import examples
from tests.unit.support import resolving

KEYS = sorted(
    {
        key
        for name in SCHEMAS
        for part in (schema(name), *schema(name)["definitions"].values())
        for key in part.get("properties", ())
    }
    | {"a", "b", "default", "typ", "frequency", "topc"}
)
TEXTS = ["${a}", "${b}", "x${a}", "$${a}", "${", "{message}", "active", "reliable", "relay", ""]

values: st.SearchStrategy[Plain] = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats(-1, 1) | st.sampled_from(TEXTS),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=5)
    ),
    max_leaves=40,
)


@st.composite
def files(draw: st.DrawFn) -> Mapping:
    """Draw a file with some valid top-level keys."""
    kind = draw(st.sampled_from(SCHEMAS))
    properties = schema(kind)["properties"]
    content = draw(st.dictionaries(st.sampled_from(sorted(properties)), values, max_size=6))
    return tree_of({kind: "a", **content})


def tree_of(content: Plain) -> Mapping:
    return resolving.tree_of(json.dumps(content))


@examples(150)
@given(files(), st.dictionaries(st.sampled_from(["a", "b", "c"]), values, max_size=2))
@example(tree_of({"node": "a", "timers": {"t": {"rate_hz": 1, "period_ms": 1}}}), {})
@example(tree_of({"system": "a", "nodes": {"a": {"typ": {}}}, "connections": [{"topc": 1}]}), {})
def test_any_tree(tree: Mapping, arguments: dict[str, Plain]) -> None:
    trees = {entry.name: entry for entry in tree_of(arguments)} if arguments else {}
    missing_names(tree, trees)
    expanded, diagnostics, *_ = expand(tree, trees)
    assert measure(expanded).values <= 2 * MAX_VALUES
    for kind in SCHEMAS:
        diagnostics += check_schema(expanded, kind)
    for diagnostic in diagnostics:
        line = diagnostic.primary.file.line(diagnostic.primary.line)
        assert 1 <= diagnostic.primary.column <= len(line)
        assert diagnostic.message.isprintable()


@examples(100)
@given(files())
def test_expanding_a_complete_tree_again_changes_nothing(tree: Mapping) -> None:
    once, diagnostics, *_ = expand(tree, {})
    if "${" not in json.dumps(plain(once)):
        twice, *_ = expand(once, {})
        assert repr(plain(twice)) == repr(plain(once))
        assert not any(diagnostic.rule.name == "cycle" for diagnostic in diagnostics)

"""Any bytes can be parsed, and valid documents round-trip."""

from __future__ import annotations

import json
from collections.abc import Callable

from hypothesis import example, given
from hypothesis import strategies as st

from composer.base.diagnostics import MAXIMUM_VALUE_LENGTH, Diagnostic
from composer.base.source import SourceFile
from composer.language.document import parse_bytes, parse_document
from composer.language.rules import MAX_INTEGER, MIN_INTEGER
from composer.language.tree import Mapping, Plain, Scalar, Sequence, Tree, plain
from tests.examples import examples
from tests.unit.support import resolving

#: Tokens of YAML, which get further than random characters.
PIECES = st.sampled_from(
    [*"[]{},:?-#&*!|>'\"%@`\t \n\r\\~$", ": ", "- ", "a", "b: ", "<<", "*a", "&a ", "!!int ",
     "---\n", "...\n", "%YAML 1.1\n", "\n  ", "\n    ", '"\\x', "\\u", "é", "\ud800", "\x00",
     "\x85", "\u2028", "\ufeff", "1e999", ".nan", "0x", "null", "true", "{x}",
     "${x}", "system: a\n"]
)  # fmt: skip


def check(tree: Tree | None, source: SourceFile, diagnostics: list[Diagnostic]) -> None:
    assert tree is not None or diagnostics
    for diagnostic in diagnostics:
        place = diagnostic.primary
        assert place.file == source
        assert 1 <= place.line <= len(source.lines)
        assert 1 <= place.column <= len(source.line(place.line)) + 1
        assert diagnostic.message.isprintable()
        assert len(diagnostic.message) < 2 * MAXIMUM_VALUE_LENGTH + 100
        assert diagnostic.hint is None or diagnostic.hint.isprintable()


@examples(300)
@given(st.binary(max_size=200))
@example(b"\xff\xfe\x00")
@example(b"%YAML 1." + b"9" * 5000)
@example(b'"\\U00110000"')
def test_any_bytes(data: bytes) -> None:
    check(*parse_bytes(data, "f"))


@examples(500)
@given(st.lists(PIECES, max_size=30).map("".join))
@example("%YAML 1.1\n\t")
def test_any_text(text: str) -> None:
    source = SourceFile("f", text)
    tree, diagnostics = parse_document(source)
    check(tree, source, diagnostics)


characters = st.characters(
    codec="utf-8",
    exclude_categories=("Cc", "Cf", "Cs", "Cn", "Zl", "Zp"),
    include_characters="\t\n",
)
texts = st.text(characters, max_size=12)
scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(MIN_INTEGER, MAX_INTEGER),
    st.floats(allow_nan=False, allow_infinity=False),
    texts,
)
values: st.SearchStrategy[Plain] = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=20,
)
documents = st.dictionaries(texts, values, min_size=1, max_size=4)


def quoted(value: Plain) -> str:
    return json.dumps(value, ensure_ascii=False)


def as_blocks(value: Plain, indent: str = "") -> str:
    """Return ``value`` in block style: maps and lists over several lines."""
    if isinstance(value, dict) and value:
        lines = (f"{indent}{quoted(key)}:{_below(item, indent)}" for key, item in value.items())
        return "\n".join(lines)
    if isinstance(value, list) and value:
        return "\n".join(f"{indent}-{_below(item, indent)}" for item in value)
    return f"{indent}{quoted(value)}"


def _below(value: Plain, indent: str) -> str:
    if isinstance(value, (dict, list)) and value:
        return "\n" + as_blocks(value, indent + "  ")
    return f" {quoted(value)}"


def scalars_in(tree: Tree) -> list[Scalar]:
    match tree:
        case Scalar():
            return [tree]
        case Sequence():
            return [scalar for item in tree.items for scalar in scalars_in(item)]
        case Mapping():
            keys = [entry.key for entry in tree]
            return keys + [scalar for entry in tree for scalar in scalars_in(entry.value)]


@examples(300)
@given(documents, st.sampled_from([quoted, as_blocks]))
def test_round_trip(document: dict[str, Plain], write: Callable[[Plain], str]) -> None:
    tree = resolving.tree_of(write(document))
    assert repr(plain(tree)) == repr(document)
    for scalar in scalars_in(tree):
        if isinstance(scalar.value, str):
            assert resolving.quoted(scalar.span) == quoted(scalar.value)
            if scalar.verbatim:
                whole = scalar.part(0, len(scalar.value))
                assert resolving.quoted(whole).removesuffix('"') == scalar.value

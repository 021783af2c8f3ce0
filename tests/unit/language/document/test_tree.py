"""From text to tree: structure, places, and plain scalars by the core schema of YAML 1.2."""

from __future__ import annotations

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_bytes, parse_document
from composer.language.tree import Mapping, Plain, Scalar, ScalarValue, Sequence, Tree, plain
from tests.unit.support.resolving import quoted, tree_of


def parsed(text: str) -> Mapping:
    return tree_of(text, "robot.yaml")


def value_at(tree: Tree, *path: str | int) -> Tree:
    for step in path:
        if isinstance(step, int):
            assert isinstance(tree, Sequence)
            tree = tree.items[step]
        else:
            assert isinstance(tree, Mapping)
            found = tree.get(step)
            assert found is not None
            tree = found
    return tree


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 1", {"a": 1}),
        ("a:", {"a": None}),
        ("---\na: 1\n...\n", {"a": 1}),
        ("%YAML 1.2\n---\na: 1", {"a": 1}),
        ("a: {b: [1, x, {c: null}]}", {"a": {"b": [1, "x", {"c": None}]}}),
        ("a:\n  - 1\n  - b: 2\n    c: 3", {"a": [1, {"b": 2, "c": 3}]}),
        ("a:\n- 1\n-\n", {"a": [1, None]}),
        ("a: []\nb: {}", {"a": [], "b": {}}),
        ("a: |\n  one\n  two\n", {"a": "one\ntwo\n"}),
        ("a: >-\n  one\n  two\n", {"a": "one two"}),
        ("a: 'it''s'", {"a": "it's"}),
        ('a: "x\\ty\\u00e9"', {"a": "x\tyé"}),
        ("a: ${name}", {"a": "${name}"}),
        ("a: # a comment\n  b: 1 # another", {"a": {"b": 1}}),
        ('"": x\n"a b": y', {"": "x", "a b": "y"}),
        ("a: &rate 10\nb: *rate\nc: [*rate]", {"a": 10, "b": 10, "c": [10]}),
        ("a: &m {x: [1]}\nb: *m", {"a": {"x": [1]}, "b": {"x": [1]}}),
        ("a: &x 1\nb: &x 2\nc: *x", {"a": 1, "b": 2, "c": 2}),
    ],
)
def test_values(text: str, value: Plain) -> None:
    assert plain(parsed(text)) == value


@pytest.mark.parametrize(
    ("text", "path", "place", "covered"),
    [
        ("a: 1", ("a",), "1:4", "1"),
        ("a:\n  - 10\n  - {b: xyz}", ("a", 1, "b"), "3:9", "xyz"),
        ("a: 'x y'   # z", ("a",), "1:4", "'x y'"),
        ('a: "x\\ty"', ("a",), "1:4", '"x\\ty"'),
        ("a: x y  ", ("a",), "1:4", "x y"),
        ("日本: 値段", ("日本",), "1:5", "値段"),
        ("e\u0301: x", ("e\u0301",), "1:5", "x"),
        ("a:\tx", ("a",), "1:4", "x"),
        ("😀: {b: 😀}", ("😀", "b"), "1:8", "😀"),
        ("x: 1\r\na: y\r\n", ("a",), "2:4", "y"),
        ("x: 1\ra: y", ("a",), "2:4", "y"),
        # Of several lines the first counts.
        ("a: one\n  two", ("a",), "1:4", "one"),
        ('a: "one\n  two"', ("a",), "1:4", '"one'),
        ("a: |  \n  one\n", ("a",), "1:4", "|"),
        # Maps and lists: the bracket or, in block style, the first item.
        ("a: {b: 1}", ("a",), "1:4", "{"),
        ("a: [1]", ("a",), "1:4", "["),
        ("a:\n  bcd: 1\n\n\nx: 1", ("a",), "2:3", "bcd"),
        ("a:\n  - xyz\n\n\nx: 1", ("a",), "2:5", "xyz"),
        # Nothing is behind the colon.
        ("a:\nb: 1", ("a",), "1:3", ""),
    ],
)
def test_places(text: str, path: tuple[str | int, ...], place: str, covered: str) -> None:
    found = value_at(parsed(text), *path)
    assert str(found.span) == f"robot.yaml:{place}"
    assert quoted(found.span) == covered


def test_place_of_key() -> None:
    tree = parsed("nodes:\n  'my node': {x: 1}")
    nodes = tree.get("nodes")
    assert isinstance(nodes, Mapping)
    key = nodes.entries[0].key
    assert (str(key.span), key.span.length, quoted(key.span)) == ("robot.yaml:2:3", 9, "'my node'")


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("a: x y {z}", 0),
        ("a: 'x y {z}'", 1),
        ('a: "x y {z}"', 1),
        ("a: 'x y ''{z}'", None),
        ('a: "x y {\\u007a}"', None),
        ("a: x\n  y {z}", None),
        ("a: |\n  x y {z}", None),
    ],
)
def test_parts_of_a_scalar_have_places_if_it_is_verbatim(text: str, offset: int | None) -> None:
    scalar = value_at(parsed(text), "a")
    assert isinstance(scalar, Scalar)
    assert scalar.verbatim is (offset is not None)
    if offset is not None:
        assert scalar.content_offset == offset
        assert quoted(scalar.part(4, 3)) == "{z}"


def test_an_alias_is_the_very_value_that_it_repeats() -> None:
    tree = parsed("a: &x [1]\nb: *x")
    assert value_at(tree, "b") is value_at(tree, "a")


def test_source_keeps_the_text_without_a_byte_order_mark() -> None:
    tree, source, diagnostics = parse_bytes("\ufeffa: 1".encode(), "robot.yaml")
    assert (diagnostics, source.text) == ([], "a: 1")
    assert tree.entries[0].key.span.column == 1
    _, source, _ = parse_bytes(b"a: 1\nb: [", "robot.yaml")
    assert source.lines == ("a: 1", "b: [")


#: Texts, also those which YAML 1.1 reads as truth values, sexagesimals, octals or dates.
TEXTS = ("nULL", "tRUE", "NO", "on", "y", "22:22", "1_000", "0b11", "2024-13-01", "0o18", "-0x1F")
TEXTS += (".", "--", "1.2.3", "1e", "e3", "inf", "nan", "=", "<<")
TEXTS += ("١٢",)  # digits, but not the digits of YAML


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((text, None) for text in ("~", "null", "Null", "NULL")),
        *((text, text) for text in TEXTS),
        ("true", True),
        ("False", False),
        ("TRUE", True),
        ("0755", 755),
        ("08", 8),
        ("0o17", 15),
        ("0x1F", 31),
        ("0", 0),
        ("-7", -7),
        ("+7", 7),
        ("1.0", 1.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.5", -0.5),
        ("1e3", 1000.0),
        ("1.5E-3", 0.0015),
        ("18446744073709551615", 2**64 - 1),
        ("-9223372036854775808", -(2**63)),
        ("'1'", "1"),
        ('"true"', "true"),
        ("'~'", "~"),
        ("''", ""),
    ],
)
def test_scalar(text: str, value: ScalarValue) -> None:
    assert repr(plain(tree_of(f"a: {text}").get("a"))) == repr(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((text, f"'{text}' is not a finite number") for text in (".nan", ".NaN", ".inf", "-.Inf")),
        ("1e999", "'1e999' is larger than a double can hold"),
        ("18446744073709551616", "'18446744073709551616' does not fit into 64 bits"),
        ("-9223372036854775809", "'-9223372036854775809' does not fit into 64 bits"),
        ("0xFFFFFFFFFFFFFFFFF", "'0xFFFFFFFFFFFFFFFFF' does not fit into 64 bits"),
        ("9" * 5000, f"'{'9' * 77}...' has more than 100 digits"),
        ("0." + "3" * 5000, f"'0.{'3' * 75}...' has more than 100 digits"),
    ],
)
def test_refused_number(text: str, message: str) -> None:
    _, [found] = parse_document(SourceFile("f", f"a: {text}"))
    assert (found.rule.name, found.message) == ("bad-number", message)
    assert (found.primary.column, found.primary.length) == (4, len(text))

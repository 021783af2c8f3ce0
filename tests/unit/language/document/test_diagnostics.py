"""Diagnostics of YAML syntax, with their locations, from either parser."""

from __future__ import annotations

import importlib

import pytest
import yaml

from composer.base.diagnostics import Diagnostic
from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.tree import plain

PARSERS = [yaml.SafeLoader]
if yaml.__with_libyaml__:
    PARSERS.append(yaml.CSafeLoader)


@pytest.fixture(params=PARSERS, ids=lambda parser: parser.__name__)
def parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of the parsers that PyYAML may have in turn."""
    events = importlib.import_module("composer.language.document.builder")
    monkeypatch.setattr(events, "LOADER", request.param)


def diagnostics_in(text: str) -> list[Diagnostic]:
    return parse_document(SourceFile("f", text))[1]


def located(diagnostic: Diagnostic) -> str:
    return f"{diagnostic.primary} {diagnostic.message}"


@pytest.mark.usefixtures("parser")
@pytest.mark.parametrize(
    ("text", "expected", "hint"),
    [
        ("a:\n\tb: 1", "f:2:1 this line is indented with a tab", "indent with spaces"),
        ("a:\n  b: 1\n\tc: 2", "f:3:1 this line is indented with a tab", "indent with spaces"),
        ("a:\n  b: 1\n \tc: 2", "f:3:2 this line is indented with a tab", "indent with spaces"),
        ("a: 'x", "f:1:4 this quote is never closed", "end the text with another '"),
        ('a: "x\nb: 1\n', "f:1:4 this quote is never closed", 'end the text with another "'),
        ("a: [1, 2", "f:1:4 this '[' is not closed", "close it with ']'"),
        ("a: {b: 1", "f:1:4 this '{' is not closed", "close it with '}'"),
        ("a: [", "f:1:4 this '[' is not closed", "close it with ']'"),
        ("a: [b, {c: [d],", "f:1:8 this '{' is not closed", "close it with '}'"),
        ("a: [1,\nb: 2\n\n", "f:1:4 this '[' is not closed", "close it with ']'"),
        ("a: {b: 1 ]", "f:1:10 expected ',' or '}' here", "commas separate items"),
        ("a: {t: ${x}}", "f:1:9 '${...}' needs quotes here", 'write "${name}"'),
        ("log: Received: {m}", "f:1:14 a second ':' in one value", "whole text in quotes"),
        ("- a: b: c", "f:1:7 a second ':' in one value", "whole text in quotes"),
        ("a\nbcd: 1", "f:2:1 a key is not allowed here", "align it"),
        ("a: b\n  cd: 1", "f:2:3 a key is not allowed here", "align it"),
        ("a: 1\nb:2\nc: 3", "f:2:2 there is no space after this colon", "'key: value'"),
        ("a: 1\nb\nc: 3", "f:2:1 this line has no key, or its key no ':'", "'key: value'"),
        (
            "a:\n   b: 1\n  c: 1",
            "f:3:3 this line is not in line with the keys it stands among",
            "the same indentation",
        ),
        ("a: 1\n- b", "f:2:1 a list item stands among keys", "under the key it belongs to"),
        ("a: [b]]", "f:1:7 this ']' closes nothing", "delete it"),
        ('a: "x" y', "f:1:8 this stands behind a finished value", "whole text in quotes"),
        ("- a\nb: 1", "f:2:1 this line is in a list, but is not an item of the list", "'- '"),
        ("a: @x", "f:1:4 a value cannot start with '@'", "whole text in quotes"),
        ("a: `x`", "f:1:4 a value cannot start with '`'", "whole text in quotes"),
        ("a: %x", "f:1:4 a value cannot start with '%'", "whole text in quotes"),
        ("a: ]", "f:1:4 expected a value, found ']'", "whole text in quotes"),
        ("a: {b: 1,, c: 2}", "f:1:10 expected a value, found ','", "whole text in quotes"),
        ('a: "\\q"', "f:1:5 this backslash does not start a YAML escape", "single quotes"),
        ('a: "xy\\x9"', "f:1:7 this backslash does not start a YAML escape", "single"),
        ("a: |x\n b", "f:1:5 unexpected text after '|' or '>'", "end of the line"),
        ("'a':1", "f:1:4 the YAML ends before this", "space after the colon"),
        ("a: 1\n...\nfoo", "f:3:1 the YAML ends before this", "one map"),
    ],
)
def test_syntax(text: str, expected: str, hint: str) -> None:
    (diagnostic,) = diagnostics_in(text)
    assert located(diagnostic) == expected
    assert diagnostic.rule.name == "yaml-syntax"
    assert hint in str(diagnostic.hint)


@pytest.mark.usefixtures("parser")
@pytest.mark.parametrize(
    ("text", "rule", "expected"),
    [
        ("", "yaml-syntax", "f:1:1 this file is empty"),
        ("# only a comment\n", "yaml-syntax", "f:1:1 this file is empty"),
        ("---\n", "yaml-syntax", "f:1:1 this file is empty"),
        ("- a", "yaml-syntax", "f:1:3 expected keys and values, found a list"),
        ("a:b", "yaml-syntax", "f:1:1 expected keys and values, found the string 'a:b'"),
        ("7", "yaml-syntax", "f:1:1 expected keys and values, found the number 7"),
        ("a: 1\n---\nb: 2", "yaml-syntax", "f:2:1 a second document starts here"),
        ("a: !!str 5", "unsupported-yaml", "f:1:4 the tag '!!str' is not supported"),
        ("a: !env x", "unsupported-yaml", "f:1:4 the tag '!env' is not supported"),
        ("a: !!python/object:os.system {}", "unsupported-yaml", "f:1:4 the tag"),
        ("a: 1\nb: 2\na: 3", "duplicate-key", "f:3:1 duplicate key 'a'"),
        ("x: {a: 1, 'a': 3}", "duplicate-key", "f:1:11 duplicate key 'a'"),
        ("1: x", "unsupported-yaml", "f:1:1 a key must be a string, found the number 1"),
        ("true: x", "unsupported-yaml", "f:1:1 a key must be a string, found true"),
        ("x: {null: y}", "unsupported-yaml", "f:1:5 a key must be a string, found nothing"),
        ("x: {[a]: b}", "unsupported-yaml", "f:1:5 a key must be a string, found a list"),
        ("x: {{a: 1}: b}", "unsupported-yaml", "f:1:5 a key must be a string, found a map"),
        ("x: {? : y}", "unsupported-yaml", "f:1:"),  # one parser says 6, the other 7
        ("x: {<<: {a: 1}}", "unsupported-yaml", "f:1:5 YAML merge keys are not supported"),
        ("a: *x", "unsupported-yaml", "f:1:4 '*x' is an alias, but no value before it is marked"),
        ("a: &x [*x]", "unsupported-yaml", "f:1:8 '*x' is part of the value that it repeats"),
        ("a: &x b\nc: {*x : 1}", "unsupported-yaml", "f:2:5 found the alias '*x', expected a key"),
        ("log: {message.data}", "key-without-value", "f:1:7 '{message.data}' is a map whose key"),
        ("log: {data} read", "key-without-value", "f:1:7 '{data}' is a map whose key"),
        ("nodes: {a_${i}: {}}", "key-without-value", "f:1:9 '${...}' needs quotes here"),
        ("t: {rate_hz:10}", "key-without-value", "f:1:5 there is no space after the colon of"),
        ("a: \x1b[2J", "forbidden-character", "f:1:4 the character U+001B is not allowed"),
        ("a: 1\nb: \x00", "forbidden-character", "f:2:4 the character U+0000 is not allowed"),
        ("a: \x85", "forbidden-character", "f:1:4 the character U+0085 is not allowed"),
        ("# \u202e", "forbidden-character", "f:1:3 the character U+202E (RIGHT-TO-LEFT OVERRIDE)"),
        ("a: x\u2028y", "forbidden-character", "f:1:5 the character U+2028 (LINE SEPARATOR)"),
        ("a: \ufeff", "forbidden-character", "f:1:4 the character U+FEFF"),
        ("a: \ud800", "forbidden-character", "f:1:4 the character U+D800"),
        ('a: "\\e]0;pwn\\a"', "forbidden-character", "f:1:4 this text contains the character"),
        ('a: "\\u202e"', "forbidden-character", "f:1:4 this text contains the character U+202E"),
        ('a: "\\r"', "forbidden-character", "f:1:4 this text contains the character U+000D"),
    ],
)
def test_diagnostic(text: str, rule: str, expected: str) -> None:
    (diagnostic,) = diagnostics_in(text)
    assert diagnostic.rule.name == rule
    assert located(diagnostic).startswith(expected)


@pytest.mark.usefixtures("parser")
@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("x: 1\na:\n  b: 1\n c: 2", ["f:1:1 the map begins here"]),
        ("x:\n  a: 1\n  b: 2\n  a: 3", ["f:2:3 first here"]),
    ],
)
def test_related_places(text: str, labels: list[str]) -> None:
    (diagnostic,) = diagnostics_in(text)
    assert [f"{label.span} {label.message}" for label in diagnostic.related] == labels


@pytest.mark.parametrize(
    "text", ["a: 😀👩‍🚀", "a: م", "a: 1 # ✓ é", 'a: "tab\\t line\\n"', "a: m/s²"]
)
def test_characters_people_write(text: str) -> None:
    assert diagnostics_in(text) == []


def test_all_diagnostics_in_one_run() -> None:
    text = "a: .nan\nb: !x 1\nc: 1\nc: 2\n5: x\nd: {<<: 1}\ne: {x}"
    assert [diagnostic.rule.code for diagnostic in diagnostics_in(text)] == [
        "RC014", "RC010", "RC011", "RC010", "RC010", "RC016",
    ]  # fmt: skip


@pytest.mark.usefixtures("parser")
def test_the_hint_about_a_missing_space_is_short_however_long_the_value_is() -> None:
    (diagnostic,) = diagnostics_in(f"set: {{silent:{'9' * 3000} false}}")
    assert str(diagnostic.hint).startswith("write 'silent: 999")
    assert len(str(diagnostic.hint)) < 200


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 1\na: 2\nb: 3", {"a": 1, "b": 3}),  # the first counts
        ("t: {rate_hz:10}", {"t": {"rate_hz": 10}}),
        ("log: {message.data}", {"log": "{message.data}"}),
        ("a: {<<: {b: 1}, c: 2}", {"a": {"c": 2}}),
        ("1: {b: 2}", {"1": {"b": 2}}),
        ('a: "x\\e[0my"', {"a": "x[0my"}),
        ("a: !x 5", {"a": "5"}),
    ],
)
def test_the_value_is_still_read(text: str, value: object) -> None:
    tree, diagnostics = parse_document(SourceFile("f", text))
    assert len(diagnostics) == 1
    assert tree is not None
    assert plain(tree) == value

"""Input that was made to do harm: one diagnostic with a place, at once."""

from __future__ import annotations

import time

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_bytes, parse_document
from composer.language.rules import MAX_BYTES, MAX_DEPTH, MAX_ERRORS, MAX_VALUES

#: Of CPU time, so that a busy machine makes no difference.
SECONDS_ALLOWED = 20.0


FULL = MAX_BYTES


def attacks() -> dict[str | None, dict[str, str]]:
    """Return texts of up to two megabytes by the rule that is reported, and by their names."""
    return {
        "too-large": {
            "brackets": "[" * FULL,
            "braces": "{" * FULL,
            "lists in one line": "- " * (FULL // 2),
            "keys in one line": "? " * (FULL // 2),
            "lists and maps": "[{a: " * (FULL // 5),
            "indented maps": "\n".join(f"{' ' * level}a:" for level in range(1300)),
            "many keys": "".join(f"k{number}: 1\n" for number in range(MAX_VALUES // 2)),
        },
        "unsupported-yaml": {
            "alias of itself": "a: &a [*a]",
            "a long tag": "a: !" + "x" * (FULL - 4),
        },
        "duplicate-key": {"one key again and again": "a: 1\n" * MAX_ERRORS},
        "yaml-syntax": {
            "blanks": " " * FULL,
            "empty lines": "\n" * FULL,
            "a comment": "#" * FULL,
            "quotes": "a: '" + "'" * (FULL - 4),
            "colons": ":" * FULL,
            "commas": "[a" + "," * (FULL - 2),
            "a long key": "k" * 500_000 + ": 1",
            "a long directive": "%YAML 1." + "9" * 10_000 + "\n---\na: 1",
        },
        "forbidden-character": {"terminal escapes": "\x1b]0;pwned\x07" * (FULL // 11)},
        "bad-number": {
            "a long integer": "a: " + "9" * (FULL - 3),
            "a long float": "a: 1." + "9" * (FULL - 5),
        },
        None: {
            "a long anchor": "a: &" + "x" * (FULL - 4),
            "a long text": "a: " + "x" * (FULL - 3),
            "a text of many lines": "a: x\n" + "  y\n" * (FULL // 4 - 2),
            "a text of many escapes": 'a: "' + "\\n" * (FULL // 2 - 3) + '"',
            "nearly a number": "a: " + "9" * (FULL - 4) + "x",
        },
    }


def test_attacks() -> None:
    for rule, texts in attacks().items():
        for name, text in texts.items():
            started = time.process_time()
            _, diagnostics = parse_document(SourceFile("f", text))
            assert time.process_time() - started < SECONDS_ALLOWED, name
            assert {item.rule.name for item in diagnostics} == ({rule} if rule else set()), name
            assert all(len(item.message) < 300 for item in diagnostics), name


def test_size_is_looked_at_before_the_text() -> None:
    _, _, diagnostics = parse_bytes(b"\xff" * (MAX_BYTES + 1), "f")
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["too-large"]
    _, diagnostics = parse_document(SourceFile("f", " " * (MAX_BYTES + 1)))
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["too-large"]


def lists(depth: int, inside: str = "") -> str:
    return "[" * depth + inside + "]" * depth


@pytest.mark.parametrize(
    ("text", "fits"),
    [
        # The file itself is a map.
        (f"a: {lists(MAX_DEPTH - 1)}", True),
        (f"a: {lists(MAX_DEPTH)}", False),
        # Through an alias.
        (f"a: &a {lists(16)}\nb: {lists(15, '*a')}", True),
        (f"a: &a {lists(16)}\nb: {lists(16, '*a')}", False),
        # Values through aliases count again.
        (f"a: &a [{','.join('x' * (MAX_VALUES // 11))}]\nb: [{', '.join(['*a'] * 9)}]", True),
        (f"a: &a [{','.join('x' * (MAX_VALUES // 10))}]\nb: [{', '.join(['*a'] * 9)}]", False),
    ],
    ids=["deep", "too deep", "deep alias", "too deep alias", "values", "too many values"],
)
def test_depth_and_number_of_values(text: str, fits: bool) -> None:
    tree, diagnostics = parse_document(SourceFile("f", text))
    assert (tree is not None, diagnostics == []) == (fits, fits)


def test_errors() -> None:
    tree, diagnostics = parse_document(SourceFile("f", "a: 1\n" * 20_000))
    assert tree is None
    assert len(diagnostics) == MAX_ERRORS + 1
    last = diagnostics[-1]
    assert (last.rule.name, str(last.primary)) == ("too-large", f"f:{MAX_ERRORS + 2}:1")

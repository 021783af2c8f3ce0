"""Input that was made to do harm: one diagnostic with a place, at once, and without much memory."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_bytes, parse_document
from composer.language.document.limits import MAX_BYTES, MAX_DEPTH, MAX_ERRORS, MAX_VALUES

#: Of CPU time, so that a busy machine makes no difference.
SECONDS_ALLOWED = 20.0


def laughs() -> str:
    lines = ["a: &a [x, x, x, x, x, x, x, x, x]"]
    lines += [
        f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]"
        for before, name in zip("abcdefgh", "bcdefghi", strict=True)
    ]
    return "\n".join(lines)


def nested_blocks(levels: int) -> str:
    return "\n".join(f"{' ' * level}a:" for level in range(levels))


FULL = MAX_BYTES
ATTACKS = {
    "200 000 brackets": ("[" * 200_000, "too-large"),
    "brackets": ("[" * FULL, "too-large"),
    "braces": ("{" * FULL, "too-large"),
    "lists in one line": ("- " * (FULL // 2), "too-large"),
    "keys in one line": ("? " * (FULL // 2), "too-large"),
    "lists and maps": ("[{a: " * (FULL // 5), "too-large"),
    "indented maps": (nested_blocks(1300), "too-large"),
    "billion laughs": (laughs(), "too-large"),
    "small maps": ("- {a: 1}\n" * (FULL // 9), "too-large"),
    "many keys": (
        "".join(f"k{number}: 1\n" for number in range(MAX_VALUES // 2)),
        "too-large",
    ),
    "alias of itself": ("a: &a [*a]", "unsupported-yaml"),
    "one key again and again": ("a: 1\n" * MAX_ERRORS, "duplicate-key"),
    "blanks": (" " * FULL, "yaml-syntax"),
    "empty lines": ("\n" * FULL, "yaml-syntax"),
    "a comment": ("#" * FULL, "yaml-syntax"),
    "quotes": ("a: '" + "'" * (FULL - 4), "yaml-syntax"),
    "colons": (":" * FULL, "yaml-syntax"),
    "commas": ("[a" + "," * (FULL - 2), "yaml-syntax"),
    "a long anchor": ("a: &" + "x" * (FULL - 4), None),
    "a long tag": ("a: !" + "x" * (FULL - 4), "unsupported-yaml"),
    "a long key": ("k" * 500_000 + ": 1", "yaml-syntax"),
    "a long text": ("a: " + "x" * (FULL - 3), None),
    "a text of many lines": ("a: x\n" + "  y\n" * (FULL // 4 - 2), None),
    "a text of many escapes": ('a: "' + "\\n" * (FULL // 2 - 3) + '"', None),
    "terminal escapes": ("\x1b]0;pwned\x07" * (FULL // 11), "forbidden-character"),
    "a long integer": ("a: " + "9" * (FULL - 3), "bad-number"),
    "a long float": ("a: 1." + "9" * (FULL - 5), "bad-number"),
    "nearly a number": ("a: " + "9" * (FULL - 4) + "x", None),
    "a long directive": ("%YAML 1." + "9" * 10_000 + "\n---\na: 1", "yaml-syntax"),
}


@pytest.mark.parametrize(("text", "rule"), ATTACKS.values(), ids=ATTACKS)
def test_attack(text: str, rule: str | None) -> None:
    started = time.process_time()
    _, diagnostics = parse_document(SourceFile("f", text))
    assert time.process_time() - started < SECONDS_ALLOWED
    if rule is None:
        assert diagnostics == []
    else:
        assert {diagnostic.rule.name for diagnostic in diagnostics} == {rule}
        assert all(len(diagnostic.message) < 300 for diagnostic in diagnostics)


def test_size_is_looked_at_before_the_text() -> None:
    _, _, diagnostics = parse_bytes(b"\xff" * (MAX_BYTES + 1), "f")
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["too-large"]
    _, diagnostics = parse_document(SourceFile("f", " " * (MAX_BYTES + 1)))
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["too-large"]


@pytest.mark.parametrize(("depth", "fits"), [(MAX_DEPTH, True), (MAX_DEPTH + 1, False)])
def test_depth(depth: int, fits: bool) -> None:
    lists = depth - 1  # within one map
    tree, diagnostics = parse_document(SourceFile("f", f"a: {'[' * lists}{']' * lists}"))
    assert (tree is not None, diagnostics == []) == (fits, fits)


@pytest.mark.parametrize(("lists", "fits"), [(15, True), (16, False)])
def test_depth_through_an_alias(lists: int, fits: bool) -> None:
    brackets = "[" * 16, "]" * 16
    text = f"a: &a {brackets[0]}{brackets[1]}\nb: {'[' * lists}*a{']' * lists}"
    tree, diagnostics = parse_document(SourceFile("f", text))
    assert (tree is not None, diagnostics == []) == (fits, fits)


@pytest.mark.parametrize(("items", "fits"), [(MAX_VALUES // 10, False), (MAX_VALUES // 11, True)])
def test_values_through_aliases_count_again(items: int, fits: bool) -> None:
    repeated = ", ".join(["*a"] * 9)
    text = f"a: &a [{','.join('x' * items)}]\nb: [{repeated}]"
    tree, diagnostics = parse_document(SourceFile("f", text))
    assert (tree is not None, diagnostics == []) == (fits, fits)


@pytest.mark.slow  # reads as much as a file may have
def test_memory() -> None:
    program = (
        "import re\n"
        "from composer.language.document import parse_document\n"
        "from composer.base.source import SourceFile\n"
        f"parse_document(SourceFile('f', '- {{a: 1}}\\n' * {MAX_BYTES // 9}))\n"
        # Not ru_maxrss, which begins with what the process had that started this one.
        "status = open('/proc/self/status').read()\n"
        "print(re.search(r'VmHWM:\\s*(\\d+)', status)[1])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=100, check=True
    )
    assert int(ran.stdout) < 200_000  # kilobytes


def test_errors() -> None:
    tree, diagnostics = parse_document(SourceFile("f", "a: 1\n" * 20_000))
    assert tree is None
    assert len(diagnostics) == MAX_ERRORS + 1
    last = diagnostics[-1]
    assert (last.rule.name, str(last.primary)) == ("too-large", f"f:{MAX_ERRORS + 2}:1")

"""Malicious includes and copies: validation must report one rule and stay within limits."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.test_hostile import PLACE, validate

pytestmark = pytest.mark.slow

LOUD = "on_activate: {log: here}"


def twice(name: str, following: str) -> str:
    entries = [f"{{file: {following}.yaml, prefix: {prefix}_}}" for prefix in "ab"]
    return f"system: {name}\ninclude: [{', '.join(entries)}]\n"


def often(name: str, following: str, copies: int) -> str:
    entry = f"{{for_each: {{i: {copies}}}, file: {following}.yaml, prefix: 'a${{i}}_'}}"
    return f"system: {name}\ninclude:\n  - {entry}\n"


MANY = f"system: many\nnodes:\n  n_${{i}}: {{for_each: {{i: 2000}}, {LOUD}}}\n"
FEW = f"system: s\nnodes: {{n: {{{LOUD}}}}}\n"
PATTERNS = ", ".join(f"n*{number}.p" for number in range(2000))
PADDING = f"# {'x' * 1000}\n" * 900
BOMBS: dict[str, tuple[dict[str, str], str, str]] = {
    "two of two of two, and so on": (
        {f"s{number}": twice(f"s{number}", f"s{number + 1}") for number in range(20)},
        "too-large", "s16.yaml:2:18"),
    "a few of very many": (
        {"s0": often("s0", "s1", 40), "s1": often("s1", "many", 40), "many": MANY},
        "too-large", "s1.yaml:3:31"),
    "very many of few": (
        {"s0": often("s0", "s1", 99), "s1": often("s1", "s2", 99), "s2": FEW},
        "too-large", "s0.yaml:3:31"),
    "large files": (
        {"s0": "system: s\ninclude: [s1.yaml, s2.yaml, s3.yaml]\n",
         **{f"s{number}": FEW.replace("n:", f"n{number}:") + PADDING for number in (1, 2, 3)}},
        "too-large", "s0.yaml:2:29"),
    "a cycle": ({"s0": twice("s0", "s1"), "s1": "system: s\ninclude: [s0.yaml]\n"},
                 "cycle", "s0.yaml:2:18"),
    "itself": ({"s0": "system: s\ninclude: [s0.yaml]\n"}, "cycle", "s0.yaml:2:11"),
    "a billion copies": ({"s0": MANY.replace("2000", "1000000000")},
                         "too-large", "s0.yaml:3:22"),
    "copies of copies": ({"s0": MANY.replace("2000", "1000, j: 1000, k: 1000")},
                         "too-large", "s0.yaml:3:22"),
    "patterns": (
        {"s0": f"{MANY}connections:\n  - topic: /t\n    from: [{PATTERNS}]\n"},
        "too-large", "s0.yaml:6:2152"),
    "a long pattern": (
        {"s0": f"{MANY}connections:\n  - {{topic: /t, from: 'n{'*_' * 100_000}.p'}}\n"},
        "too-large", "s0.yaml:5:23"),
    "patterns for all": (
        {"s0": MANY.replace("2000", "1900")
         + "connections:\n  - {for_each: {i: 100}, topic: '/t${i}', from: '*.p'}\n"},
        "too-large", "s0.yaml:5:49"),
}  # fmt: skip


@pytest.mark.parametrize(("files", "rule", "place"), BOMBS.values(), ids=BOMBS)
def test_bomb(tmp_path: Path, files: dict[str, str], rule: str, place: str) -> None:
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    result = validate(tmp_path, "s0.yaml")
    assert (result.code, set(result.rules)) == (1, {rule}), result.out
    assert PLACE.findall(result.out)[0] == place


def test_only_files_in_the_project_are_included(tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("system: secret\nsecret: confidential\n")
    project = tmp_path / "project"
    project.mkdir()
    os.mkfifo(project / "pipe.yaml")
    (project / "link.yaml").symlink_to(secret)
    (project / "loop.yaml").symlink_to(project / "loop.yaml")
    names = ["../secret.yaml", str(secret), "link.yaml", "loop.yaml", "pipe.yaml", "/dev/zero"]
    names += [".", "x" * 5000, "~/a.yaml", "http://127.0.0.1:9/a.yaml"]
    written = ", ".join(f'"{name}"' for name in names)
    (project / "a.yaml").write_text(f"system: a\ninclude: [{written}]\n")
    result = validate(project, "a.yaml")
    assert (result.code, result.rules) == (1, ["invalid-include"] * len(names)), result.out
    assert "confidential" not in result.out + result.err

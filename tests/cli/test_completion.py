"""Shell completion, with the protocol of bash."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from composer.cli.support.system_arguments import complete_system


def complete(*words: str) -> list[str]:
    environment = {
        **os.environ,
        "_COMPOSE_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(["compose", *words]),
        "COMP_CWORD": str(len(words)),
    }
    code = "import sys; from composer.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_commands_options_and_choices_are_completed() -> None:
    assert complete("gra") == ["graph"]
    assert complete("lifecycle", "s") == ["set"]
    assert complete("run", "--auto") == ["--autostart"]
    assert complete("run", "pipeline", "--autostart", "in") == ["inactive"]


def test_the_names_of_example_systems_are_completed() -> None:
    assert complete("run", "pi") == ["pipeline"]


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("", ["deep/", "here.yaml"]),
        ("./h", ["./here.yaml"]),
        ("de", ["deep/"]),
        ("deep/", ["deep/inner.yml"]),
        ("deep/in", ["deep/inner.yml"]),
        ("deep/x", []),
    ],
)
def test_paths_of_systems_are_completed(
    typed: str, offered: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("deep").mkdir()
    for name in ("here.yaml", "notes.txt", ".hidden.yaml", "deep/inner.yml"):
        Path(name).touch()
    examples = complete_system(typed)[: -len(offered) or None] if typed == "" else []
    assert complete_system(typed) == [*examples, *offered]

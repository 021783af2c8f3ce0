"""Run the command line in this process, like typer's CliRunner, including the exit code."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from composer.cli import main


@dataclass(frozen=True, slots=True)
class Done:
    """The exit code and output of a command."""

    code: int
    out: str
    err: str


class _Stream(io.TextIOWrapper):
    """A stream in memory with a binary buffer, like a real one."""

    def text(self) -> str:
        self.flush()
        return self.buffer.getvalue().decode()  # type: ignore[attr-defined]


def compose(*arguments: str) -> Done:
    """Run ``compose`` with the arguments."""
    out, err = (_Stream(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(list(arguments))
    assert sys.stdout is not out
    return Done(code, out.text(), err.text())


def refused(code: int, *arguments: str) -> str:
    """Run a command that must fail and print nothing to stdout; return what it says."""
    done = compose(*arguments)
    assert (done.code, done.out) == (code, ""), done.err
    return done.err


def run_python(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a new interpreter; return its result, whatever the exit code."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    command = [sys.executable, *arguments]
    return subprocess.run(command, text=True, timeout=100, check=False, **options)


def write_files(files: dict[str, str], folder: Path = Path()) -> None:
    """Write texts by the names of their files, in new folders if need be."""
    for name, text in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

"""Record docs/pictures/terminal.svg: commands of the README in a terminal, with their real output.

The picture plays once, and shows the whole output where nothing is animated. Its times are those of
the recording, so ``make pictures`` takes it, not ``make generate``.
"""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "pictures" / "terminal.svg"
#: What is typed, with the seconds after which Ctrl-C is pressed.
SESSION = (
    ("compose validate systems nodes", None),
    ("compose run systems/pipeline.yaml", 5.0),
)
_WIDTH, _LINE, _LETTER, _LEFT, _TOP = 930, 19, 7.8, 16, 30
#: In seconds: before each command is typed, and for each letter of it.
_PAUSE, _KEY = 0.8, 0.03
_TEXT, _BACKGROUND = "#e6edf3", "#0d1117"
_COLORS = {"2": "#8b949e", "31": "#ff7b72", "32": "#7ee787", "33": "#d29922", "36": "#79c0ff"}
_STYLED = re.compile(r"\x1b\[([0-9;]*)m")
_CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-ln-z]|\r")


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the terminal that appears ``at`` that many seconds."""

    at: float
    text: str


def record() -> list[Line]:
    """Run the commands in a pseudo-terminal and return what it shows."""
    lines = []
    now = 0.0
    for command, interrupt_after in SESSION:
        now += _PAUSE
        lines.append(Line(now, f"\x1b[32m$\x1b[0m {command}"))
        now += _KEY * len(command)
        output, took = _run(command.split(), interrupt_after)
        lines += [Line(now + line.at, line.text) for line in output]
        now += took
    return lines


def _run(command: list[str], interrupt_after: float | None) -> tuple[list[Line], float]:
    """Run one command; return its lines, with times since its start, and how long it took."""
    main_side, its_side = pty.openpty()
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "TERM": "xterm-256color", "COLUMNS": "120"}
    start = time.monotonic()
    process = subprocess.Popen(
        command, stdin=its_side, stdout=its_side, stderr=its_side, cwd=ROOT, env=environment
    )
    os.close(its_side)
    lines, rest = [], ""
    while True:
        passed = time.monotonic() - start
        if interrupt_after is not None and passed > interrupt_after:
            process.send_signal(signal.SIGINT)
            interrupt_after = None
        if not select.select([main_side], [], [], 0.02)[0]:
            continue
        try:
            rest += os.read(main_side, 65536).decode()
        except OSError:  # the command has closed its side
            break
        *complete, rest = _CONTROL.sub("", rest).split("\n")
        lines += [Line(passed, text) for text in complete]
    os.close(main_side)
    if process.wait() not in {0, 130}:
        shown = "\n".join(line.text for line in lines)
        raise SystemExit(f"{' '.join(command)} failed with {process.returncode}:\n{shown}")
    return lines, time.monotonic() - start


def draw(lines: list[Line]) -> str:
    """Return the picture as SVG."""
    height = _TOP + _LINE * len(lines) + 12
    shapes = [f'<rect width="{_WIDTH}" height="{height}" rx="8" fill="{_BACKGROUND}"/>']
    for number, line in enumerate(lines):
        spans = "".join(
            f'<tspan x="{_LEFT + _LETTER * column:g}" fill="{color}">{escape(text)}</tspan>'
            for column, text, color in _spans(line.text)
        )
        hidden = f'<set attributeName="visibility" to="hidden" begin="0s" end="{line.at:.2f}s"/>'
        y = _TOP + _LINE * number
        shapes.append(f'<text y="{y}" xml:space="preserve">{hidden}{spans}</text>')
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" '
        f'height="{height}" font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" '
        'font-size="13">'
    )
    return "\n".join((head, *shapes, "</svg>", ""))


def _spans(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the column, text and color of each piece of a line with ANSI styles."""
    column, color = 0, _TEXT
    pieces = _STYLED.split(text)
    for index, piece in enumerate(pieces):
        if index % 2:
            styles = [_COLORS[style] for style in piece.split(";") if style in _COLORS]
            color = styles[-1] if styles else _TEXT
        elif piece:
            yield column, piece, color
            column += len(piece)


def main() -> None:
    """Write the picture."""
    PICTURE.write_text(draw(record()), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Draw docs/pictures/editor-python.svg: what basedpyright's language server answers in a behavior.

Needs Node.js and ``npm ci --prefix tests/language_server``, so it is not part of ``make generate``:
``make pictures``.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import chdir
from dataclasses import dataclass
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from composer.cli import main as compose  # noqa: E402 - found by the line above
from tests.language_server.client import Cursor, LanguageServer  # noqa: E402

PICTURE = ROOT / "docs" / "pictures" / "editor-python.svg"
SERVER = ROOT / "tests/language_server/node_modules/basedpyright/langserver.index.js"
_SETTINGS = {"basedpyright": {"analysis": {"typeCheckingMode": "standard"}}}
_CODE = """\
from nav_msgs.msg import Odometry

from composer.typed import MotorControllerBehavior


class MotorController(MotorControllerBehavior):
    def on_sensor_data(self, message: Odometry) -> None:
        position = message.pose.position
        limit = self.parameters.|
"""
_WIDTH, _LINE, _LETTER, _LEFT, _TOP = 990, 22, 8.4, 56, 34
#: Colors of words, and of all other text.
_COLORS = {"from": "#8250df", "import": "#8250df", "class": "#8250df", "def": "#8250df"}
_COLORS |= {"self": "#0550ae", "None": "#0550ae"}
_TEXT, _GRAY, _RED, _BLUE = "#1f2328", "#656d76", "#cf222e", "#0969da"


@dataclass(frozen=True, slots=True)
class Answers:
    """What the language server says about the code.

    ``offered`` are the completions at the cursor with their types, ``errors`` the messages by line.
    """

    offered: Mapping[str, str]
    errors: Mapping[int, tuple[int, int, str]]


def ask() -> Answers:
    """Return the answers for a behavior in a copy of this project, with its stubs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        for part in ("nodes", "interfaces"):
            shutil.copytree(ROOT / part, folder / part)
        with chdir(folder):
            compose(["stubs"])
        server = LanguageServer(SERVER, folder, _SETTINGS)
        try:
            return answers(server, folder / "nodes/shown.py")
        finally:
            server.close()


def answers(server: LanguageServer, path: Path) -> Answers:
    """Return what a server says about the behavior as ``path``, in a project with these stubs."""
    cursor = server.open_python(path, _CODE)
    names = [name for name in server.complete(cursor) if not name.startswith("_")]
    offered = {}
    for name in names:
        whole = server.open_python(path.with_stem(f"shown_{name}"), _CODE.replace("|", f"{name}|"))
        offered[name] = server.hover(_before(whole)).split("\n")[0].rpartition(": ")[2]
    return Answers(offered, dict(_errors(server, cursor)))


def _before(cursor: Cursor) -> Cursor:
    return Cursor(cursor.uri, cursor.line, cursor.character - 1)


def _errors(server: LanguageServer, cursor: Cursor) -> Iterator[tuple[int, tuple[int, int, str]]]:
    for item in server.awaited_diagnostics(cursor):
        start, end = item["range"]["start"], item["range"]["end"]
        if item["severity"] == 1 and start["line"] != cursor.line:
            message = item["message"].split("\n")[0]
            yield start["line"], (start["character"], end["character"], message)


def draw(said: Answers) -> str:
    """Return the picture as SVG."""
    lines = _CODE.replace("|", "").splitlines()
    height = _TOP + _LINE * (len(lines) + len(said.offered)) + 26
    shapes = [
        f'<rect width="{_WIDTH}" height="{height}" rx="8" fill="#ffffff" stroke="#d0d7de"/>',
        _text(16, 24, "nodes/motor_controller.py", _GRAY),
        f'<line x1="0" y1="36" x2="{_WIDTH}" y2="36" stroke="#d0d7de"/>',
    ]
    for number, line in enumerate(lines):
        y = _y(number)
        shapes += [_text(_LEFT - 28, y, str(number + 1), _GRAY), _code(line, y)]
    for number, (start, end, message) in said.errors.items():
        shapes += [_squiggle(start, end, _y(number) + 4)]
        shapes += [_text(_x(len(lines[number]) + 3), _y(number), message, _RED)]
    shapes += _list(said.offered, len(lines[-1]), len(lines))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" '
        f'height="{height}" font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" '
        'font-size="14">'
    )
    return "\n".join((head, *shapes, "</svg>", ""))


def _list(offered: Mapping[str, str], column: int, line: int) -> Iterator[str]:
    x, y = _x(column), _y(line) - 15
    width = 340
    yield f'<rect x="{x - 1.5:g}" y="{y - _LINE + 1}" width="2" height="18" fill="{_TEXT}"/>'
    yield (
        f'<rect x="{x:g}" y="{y}" width="{width}" height="{_LINE * len(offered) + 8}" rx="4" '
        'fill="#f6f8fa" stroke="#d0d7de"/>'
    )
    for number, (name, type_) in enumerate(offered.items()):
        at = y + 20 + _LINE * number
        if number == 0:
            yield (
                f'<rect x="{x + 4:g}" y="{at - 16}" width="{width - 8}" height="{_LINE}" rx="3" '
                'fill="#ddf4ff"/>'
            )
        yield _text(x + 12, at, name, _BLUE)
        yield _text(x + width - 12 - _LETTER * len(type_), at, type_, _GRAY)


def _code(line: str, y: float) -> str:
    words = line.replace("(", " ( ").replace(",", " , ").replace(".", " . ").split()
    spans = []
    at = 0
    for word in words:
        start = line.index(word, at)
        color = _COLORS.get(word, _TEXT)
        spans.append(f'<tspan x="{_x(start):g}" fill="{color}">{escape(word)}</tspan>')
        at = start + len(word)
    return f'<text y="{y}">{"".join(spans)}</text>'


def _text(x: float, y: float, text: str, color: str) -> str:
    return f'<text x="{x:g}" y="{y}" fill="{color}">{escape(text)}</text>'


def _squiggle(start: int, end: int, y: int) -> str:
    waves = "l2 -3 l2 3 " * int((_x(end) - _x(start)) // 4)
    return f'<path d="M{_x(start):g} {y} {waves}" fill="none" stroke="{_RED}"/>'


def _x(column: int) -> float:
    return round(_LEFT + _LETTER * column, 1)


def _y(line: int) -> int:
    return _TOP + _LINE * (line + 1) + 4


def main() -> None:
    """Write the picture."""
    PICTURE.write_text(draw(ask()), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Type checkers on the command line agree about a project with stubs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

import pytest

from tests.language_server.robot import MISTAKES, make_project, wrong_lines
from tests.programs import require_module, require_package

HERE = Path(__file__).parent
#: The settings that docs/guides/editor.md shows.
SETTINGS = {
    "pyrefly.toml": 'search-path = ["typings", "nodes"]\n',
    "ty.toml": '[environment]\nextra-paths = ["typings"]\nroot = ["nodes", "."]\n',
    "mypy.ini": "[mypy]\nmypy_path = typings:nodes\n",
    "pyrightconfig.json": '{"typeCheckingMode": "standard"}\n',
}
_LINE = re.compile(r"\b(\w+)\.py:(\d+)\b")


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checked")
    with chdir(folder):
        root = make_project(folder)
    (root / "nodes/mistakes.py").write_text(MISTAKES)
    for name, text in SETTINGS.items():
        (root / name).write_text(text)
    return root


def mypy() -> list[str]:
    require_module("mypy")
    return [sys.executable, "-m", "mypy", "nodes"]


def pyrefly() -> list[str]:
    options = ["--output-format", "min-text", "--python-interpreter-path", sys.executable]
    return [sys.executable, "-m", "pyrefly", "check", *options, "nodes"]


def ty() -> list[str]:
    require_module("ty")
    options = ["--output-format", "concise", "--python", sys.prefix]
    return [sys.executable, "-m", "ty", "check", *options, "nodes"]


def basedpyright() -> list[str]:
    require_package(HERE, "basedpyright")
    program = HERE / "node_modules/basedpyright/index.js"
    return ["node", str(program), "--pythonpath", sys.executable, "--level", "error", "nodes"]


@pytest.mark.slow
@pytest.mark.parametrize("command", [mypy, pyrefly, ty, basedpyright])
def test_all_mistakes_are_reported_and_nothing_else(
    root: Path, command: Callable[[], list[str]]
) -> None:
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        command(), cwd=root, env=environment, capture_output=True, text=True, check=False
    )
    places = _LINE.findall(done.stdout)
    assert {name for name, _ in places} == {"mistakes"}, done.stdout + done.stderr
    assert sorted({int(line) for _, line in places}) == wrong_lines(MISTAKES), done.stdout

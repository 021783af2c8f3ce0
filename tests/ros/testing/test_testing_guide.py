"""The files in the guide to testing are a project whose tests and scenarios pass."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "testing.md"
FILES = re.compile(r"```(?:yaml|python)\n# (\S+)\n(.*?)```", re.DOTALL)


def test_the_tests_of_the_guide_pass(tmp_path: Path) -> None:
    files = FILES.findall(GUIDE.read_text(encoding="utf-8"))
    assert len(files) == 5
    (tmp_path / "composer.yaml").touch()
    for name, text in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--rootdir=.",
        "tests",
        "scenarios",
    ]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.stdout.splitlines()[-1].startswith("4 passed"), ran.stdout + ran.stderr

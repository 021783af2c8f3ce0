from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

CODE = """
import os, sys, time
from composer.runtime.process.computer import process_start_s
if len(sys.argv) == 1:
    os.execv(sys.executable, [sys.executable, __file__, "again"])
print(process_start_s(), time.monotonic())
"""


def test_a_process_starts_once_although_python_starts_twice(tmp_path: Path) -> None:
    script = tmp_path / "a (b) c.py"
    script.write_text(CODE)
    before_s = time.monotonic()
    done = subprocess.run(
        [sys.executable, script], check=True, capture_output=True, text=True, timeout=100
    )
    start_s, end_s = map(float, done.stdout.split())
    assert before_s - 0.02 <= start_s <= end_s
    assert start_s - before_s < (end_s - before_s) / 2  # before Python has started once

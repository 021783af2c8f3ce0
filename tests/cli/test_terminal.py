"""stdout contains only the data that a command writes."""

from __future__ import annotations

import subprocess
import sys

NOISY = """
import os
from composer.cli.support.terminal import keep_stdout_for_data, say, write
keep_stdout_for_data()
keep_stdout_for_data()
write("data")
os.write(1, b"noise of a library\\n")
say("talk")
write("more data")
"""


def test_output_of_libraries_goes_to_stderr() -> None:
    done = subprocess.run(
        [sys.executable, "-c", NOISY], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout == "data\nmore data\n"
    assert done.stderr == "noise of a library\ntalk\n"

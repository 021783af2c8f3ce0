"""stdout contains only the data that a command writes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

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
        [sys.executable, "-c", NOISY], capture_output=True, text=True, check=True, timeout=100
    )
    assert done.stdout == "data\nmore data\n"
    assert done.stderr == "noise of a library\ntalk\n"


@pytest.mark.parametrize("target", ["full disk", "closed pipe"])
def test_messages_that_cannot_be_written_do_not_change_the_exit_code(target: str) -> None:
    if target == "full disk":
        writing = os.open("/dev/full", os.O_WRONLY)
    else:
        reading, writing = os.pipe()
        os.close(reading)
    command = [sys.executable, "-m", "composer", "validate", "no_such_file.yaml"]
    done = subprocess.run(command, stderr=writing, check=False, timeout=100)
    os.close(writing)
    assert done.returncode == 2

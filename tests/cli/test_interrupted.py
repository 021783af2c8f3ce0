"""Ctrl-C at any moment of the start of a command: no traceback from our code."""

from __future__ import annotations

import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import composer

COMMANDS = (("--version",), ("validate", "systems"), ("dashboard", "--port", "0"))
WITHIN_S = 0.3
TIMES = 6
INTERRUPTED = 130
PACKAGE = Path(composer.__file__).parent
COMPOSE = Path(sys.executable).with_name("compose")
PATIENCE_S = 60.0


@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[0])
def test_ctrl_c_in_the_first_moments(words: tuple[str, ...]) -> None:
    """Before our first line, Python itself prints where it was: see decision 0012."""
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    for _ in range(TIMES):
        delay_s = chance.uniform(0.0, WITHIN_S)
        with subprocess.Popen(
            [COMPOSE, *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            time.sleep(delay_s)  # the moment is what is tested
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=PATIENCE_S)
        case = f"{delay_s:.3f} s, seed {seed}: exit code {process.returncode}\n{errors}"
        files = {Path(name) for name in re.findall(r'File "(/.+?)"', errors)}
        assert not any(file.is_relative_to(PACKAGE) for file in files), case
        assert process.returncode in (0, 1, INTERRUPTED, -signal.SIGINT), case

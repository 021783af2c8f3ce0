"""A system in the background that never says it is up."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.cli.support.background import run_in_background
from composer.cli.support.failure import Failure


def test_a_process_that_says_nothing_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    # Read by Python at its start: the process hangs, however late somebody looks at it.
    (tmp_path / "sitecustomize.py").write_text("import time\ntime.sleep(60.0)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(Failure, match=r"did not come up within 0\.01 s and was killed") as why:
        run_in_background("minimal", ["minimal"], 0.01)
    (log,) = tmp_path.glob("minimal-*.log")
    assert f"all of it: {log}" in why.value.text()
    assert why.value.exit_code == 1


def test_a_process_that_ends_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    with pytest.raises(Failure, match=re.escape("did not come up (exit code 2)")) as why:
        run_in_background("nothing", ["nothing"], 60.0)
    assert "nothing" in why.value.text()

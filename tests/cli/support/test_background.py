"""Systems in the background that do not come up."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from composer.cli.support.errors import CommandError
from composer.cli.support.process import run_in_background
from tests.cli.compose import run_python


@pytest.fixture(autouse=True)
def log_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))


@pytest.mark.parametrize(
    ("before", "limit_s"),
    [("", 0.01), ("os.write(int(os.environ['COMPOSE_READY_FD']), b'3 of')", 1.0)],
    ids=["no report", "half a report"],
)
def test_a_process_that_does_not_report_is_killed(
    before: str, limit_s: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Imported when Python starts, so the process always hangs.
    hang = f"import os, time\n{before}\ntime.sleep(60.0)\n"
    (tmp_path / "sitecustomize.py").write_text(hang)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(
        CommandError, match=rf"did not come up within {limit_s:g} s and was killed"
    ) as raised:
        run_in_background("minimal", ["minimal"], limit_s)
    (log,) = tmp_path.glob("minimal-*.log")
    assert f"full log: {log}" in raised.value.text()
    assert raised.value.exit_code == 1


def test_a_process_that_ends_early_is_reported_at_once(folder: Path) -> None:
    """It imports nothing from the current folder."""
    (folder / "signal.py").write_text("import sys\nsys.exit('imported')\n")
    with pytest.raises(CommandError, match=re.escape("did not come up (exit code 2)")) as raised:
        run_in_background("nothing", ["nothing"], 60.0)
    assert "there is no file 'nothing'" in raised.value.text()


def test_a_log_folder_that_cannot_be_created_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file" / "log"))
    with pytest.raises(CommandError, match="cannot write the log of the system to ") as raised:
        run_in_background("minimal", ["minimal"], 60.0)
    assert "set ROS_LOG_DIR to a writable folder" in raised.value.text()


#: A user id without an account, as in a container.
WITHOUT_HOME = """
import os
from composer.cli.support.process import run_in_background
from composer.cli.support.errors import CommandError
from composer.runtime.middleware import environment
del os.environ["HOME"]
os.environ.pop("ROS_LOG_DIR", None)
os.environ.pop("ROS_HOME", None)
os.setuid(4242)
try:
    run_in_background("minimal", ["minimal"], 60.0)
except CommandError as error:
    print(error.message)
    print(error.hint)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_without_a_folder_for_the_log_the_variables_are_named() -> None:
    done = run_python("-c", WITHOUT_HOME)
    assert done.stdout == (
        "there is no folder for the log: neither ROS_LOG_DIR nor HOME is set, and user 4242 has no"
        " home folder\nset ROS_LOG_DIR to a writable folder\n"
    )

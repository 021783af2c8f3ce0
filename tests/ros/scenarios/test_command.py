"""``compose test`` with processes: a run that hangs or crashes, repetitions, JUnit XML, pytest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from junitparser import Failure, JUnitXml

from composer.bags.reader import open_bag

CRASHING = """\
import os

from composer.behavior import Behavior


class Crashing(Behavior):
    def on_tick(self) -> None:
        print("going down\\x1b[2J\\r\\n[FATAL] [compose] forged")
        os.abort()


class Hanging(Behavior):
    def on_tick(self) -> None:
        while True:
            pass
"""
UNSEEDED = """\
import os

from composer.behavior import Behavior


class Unseeded(Behavior):
    def on_activate(self) -> None:
        self.log.info(os.urandom(8).hex())
"""
SYSTEM = "system: s\nnodes: {bad: {behavior: 'bad:NAME', timers: {tick: {rate_hz: 10}}}}\n"


def _command(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )


def _write(folder: Path, name: str, text: str) -> None:
    (folder / "composer.yaml").touch()
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")


def test_a_run_that_ends_by_itself_or_never(tmp_path: Path) -> None:
    _write(tmp_path, "bad.py", CRASHING)
    for name in ("Crashing", "Hanging"):
        _write(tmp_path, f"{name}.yaml", SYSTEM.replace("NAME", name))
        scenario = f"scenario: {name}\nsystem: ../{name}.yaml\nfor_s: 1\n"
        _write(tmp_path, f"scenarios/{name}\n[FATAL] [compose] \udcff\x1b.yaml", scenario)
    words = ("--timeout", "3", "-j2", "--junit", "out/j.xml", "--bag-on-failure")
    done = _command(tmp_path, "composer", "test", *words)
    assert done.returncode == 1
    [suite] = JUnitXml.fromfile(str(tmp_path / "out" / "j.xml"))
    crashed, hung = (case.result[0] for case in suite)
    assert isinstance(crashed, Failure)
    assert "signal 6 has ended it" in crashed.message
    assert "going down" in crashed.text
    assert "still running at the time limit" in hung.message
    assert "in on_tick" in hung.text
    assert "2 failed" in done.stderr
    assert "  | going down\\x1b[2J\\r\n  | [FATAL] [compose] forged\n" in done.stdout
    assert "/Hanging\\n[FATAL] [compose] \\udcff\\x1b.yaml: Hanging failed\n" in done.stdout
    assert not any(line.startswith("[FATAL]") for line in done.stdout.splitlines())
    assert done.stdout.replace("\n", "").isprintable()
    [folder] = (tmp_path / "bags").iterdir()
    for name in ("1-Crashing", "2-Hanging"):
        assert f"recorded until the process ended: bags/{folder.name}/{name}" in done.stdout
        assert open_bag(folder / name).warnings


def test_repetitions_and_pytest(tmp_path: Path) -> None:
    _write(tmp_path, "s.yaml", "system: s\nnodes: {a: {on_activate: {log: 'a< & é'}}}\n")
    _write(tmp_path, "scenarios/a.yaml", "scenario: a\nsystem: ../s.yaml\nfor_s: 1\n")
    wrong = "scenario: wrong\nsystem: ../s.yaml\nfor_s: 1\nexpect: [{log: 'b<'}]\n"
    _write(tmp_path, "scenarios/wrong.yaml", wrong)
    _write(tmp_path, "bad.py", UNSEEDED)
    _write(tmp_path, "u.yaml", "system: u\nnodes: {a: {behavior: 'bad:Unseeded'}}\n")
    _write(tmp_path, "scenarios/unseeded.yaml", "scenario: u\nsystem: ../u.yaml\nfor_s: 1\n")
    done = _command(tmp_path, "composer", "test", "--repeat", "3", "--junit", "j.xml")
    assert done.stdout.count("other ones from 0.000 s on: something depends on more than") == 2
    assert done.stdout.count("passed  scenarios/a.yaml: a[") == 3
    assert "scenarios/wrong.yaml:4:16" in done.stdout
    [suite] = JUnitXml.fromfile(str(tmp_path / "j.xml"))
    assert (suite.tests, suite.failures, suite.errors) == (9, 5, 0)
    done = _command(tmp_path, "pytest", "-p", "no:cacheprovider")
    assert "1 failed, 2 passed" in done.stdout
    assert "a line 'b<' in the log" in done.stdout

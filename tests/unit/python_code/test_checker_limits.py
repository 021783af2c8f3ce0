"""A type checker that crashes, prints rubbish or never ends costs a note, never the run."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic, Severity
from composer.python_code.checker import check as check_module
from composer.python_code.checker import pyrefly
from tests.unit.support.checking import load_project
from tests.unit.support.growth import assert_linear

SYSTEM = """\
system: demo
nodes:
  counter: {behavior: "code:Counter", timers: {tick: {rate_hz: 1}}}
"""
CODE = """\
class Counter:
    def on_tick(self):
        self.log.inform("%s")
"""
NO_OUTPUT = "it failed: exit code 0, and no output"
BAD_CHECKERS = {
    "crashes": ("os.kill(os.getpid(), signal.SIGSEGV)", "it was ended by SIGSEGV"),
    "fails": ("sys.exit('out of luck')", "it failed: out of luck"),
    "prints half of it": ("print('{')", NO_OUTPUT),
    "prints another form": ("print('{\"errors\": [{}]}')", NO_OUTPUT),
    "prints deep JSON": ("print('{\"errors\":' + '[' * 100_000)", NO_OUTPUT),
    "never ends": ("time.sleep(600)", "it took longer than 2 s"),
    "computes": ("signal.raise_signal(signal.SIGXCPU)", "it needed too much processor time"),
    "wants memory": ("time.sleep(0.2); bytearray(3_000_000_000)", "it failed: MemoryError"),
    "fills the disk": (
        "signal.signal(signal.SIGXFSZ, signal.SIG_DFL); time.sleep(0.2);"
        "os.write(1, b'x' * 16_000_000); os.write(1, b'x')",
        "it was ended by SIGXFSZ",
    ),
}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is kept of other tests."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def diagnostics_of(code: str, folder: Path) -> list[Diagnostic]:
    return load_project(folder, {"system.yaml": SYSTEM, "code.py": code}).diagnostics


def rules_of(code: str, folder: Path) -> list[str]:
    return [item.rule.name for item in diagnostics_of(code, folder)]


@pytest.mark.parametrize("name", BAD_CHECKERS)
def test_failing_checker_is_a_note(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, reason = BAD_CHECKERS[name]
    program = tmp_path / "bin" / "pyrefly"
    program.parent.mkdir()
    program.write_text(f"#!{sys.executable}\nimport os, signal, sys, time\n{code}\n")
    program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program.with_name("python")))
    if "took longer" in reason:  # the others end by themselves
        monkeypatch.setattr(pyrefly, "TIME_LIMIT_S", 2.0)
    [found] = diagnostics_of(CODE % name, tmp_path)
    assert (found.rule.name, found.severity) == ("not-checked", Severity.INFO)
    assert reason in found.message


def test_rules_apply_without_the_checker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    rules = rules_of("class Counter:\n    def on_tik(self):\n        pass\n", tmp_path)
    assert sorted(rules) == ["missing-handler", "not-checked"]


def test_problems_of_same_files_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = diagnostics_of(CODE % "kept", tmp_path)
    assert [item.rule.name for item in found] == ["unknown-attribute"]
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))  # without the checker
    assert diagnostics_of(CODE % "kept", tmp_path) == found
    (entry,) = (tmp_path / "ros2-composer" / "checks").iterdir()
    content = entry.read_bytes()
    for damaged in (b"", b"\xff", content[:-1], content[:40] + b"x" + content[41:]):
        entry.write_bytes(damaged)
        assert rules_of(CODE % "kept", tmp_path) == ["not-checked"]


@pytest.mark.skipif(sys.version_info >= (3, 12), reason="this Python parses the file")
def test_a_file_for_a_newer_python_is_a_note(tmp_path: Path) -> None:
    code = "class Counter:\n    def on_tick(self):\n        self.log.info(f'{self.a['b']}')\n"
    [found] = diagnostics_of(code, tmp_path)
    assert (found.rule.name, found.severity) == ("not-checked", Severity.INFO)
    assert "cannot parse the file, which needs a newer one" in found.message
    assert found.primary.line == 3


#: By name: the begin of a file, and a line with a problem that is repeated with numbers for ``#``.
PROBLEMS = {
    "attributes": ("    def on_tick(self):\n", "        self.a# = self.b#\n"),
    "one attribute": ("    def on_tick(self):\n", "        self.a = self.b#\n"),
    "fields": (
        "    def on_tick(self):\n        message = String()\n",
        "        message.dta# = 1\n",
    ),
    "names": ("", "    def m#(self): undefined_name_#()\n"),
    "none": ("    def __init__(self):\n        self.a = None\n", "    def m#(self): self.a.b#()\n"),
    "imports": ("    def on_tick(self):\n", "        import no_module_#\n"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "line"), PROBLEMS.values(), ids=PROBLEMS)
def test_many_problems(begin: str, line: str, tmp_path: Path) -> None:
    def check(count: int) -> None:
        head = "from std_msgs.msg import String\nclass Counter:\n"
        lines = "".join(line.replace("#", str(number)) for number in range(count))
        code = f"{head}{begin}{lines}# {time.monotonic_ns()}\n"
        found = diagnostics_of(code, tmp_path)
        is_limited = any("the rest is not shown" in item.message for item in found)
        assert is_limited == (count > check_module.MAX_FINDINGS)

    assert_linear(check, 100, 1_000)

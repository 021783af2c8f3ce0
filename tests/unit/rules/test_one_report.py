"""One mistake in the files of a small project gives one report, where the mistake is."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load

TALK = "{type: std_msgs/msg/String, qos: command"
ECHO = f"""\
system: echo
nodes:
  source:
    publishers: {{out: {TALK}}}}}
    timers: {{tick: {{period_ms: 1000, publish: {{out: {{data: a}}}}}}}}
  echo:
    subscriptions: {{in: {TALK}, topic: out, when: count > 1, publish: {{out: '{{message}}'}}}}}}
    publishers: {{out: {TALK}}}}}
"""
RESTART = """\
system: a
lifecycle: {watch: {max_errors: 2}}
nodes:
  n:
    on_activate: {log: a}
    lifecycle: {restart: {%s}}
"""
HELPER = """\
system: a
nodes:
  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}
"""
CODE = "from %s import step\n\n\nclass Code:\n    def on_tick(self):\n        step()\n"
#: The files of a project, and the only reports: rule, file and line.
MISTAKES: dict[str, tuple[dict[str, str], list[tuple[str, str, int]]]] = {
    "a condition does not end a loop through one topic": (
        {"system.yaml": ECHO},
        [("own-publisher", "system.yaml", 7)],
    ),
    "errors are counted in the window only": (
        {"system.yaml": RESTART % "max_attempts: 3"},
        [("unused-restart", "system.yaml", 6)],
    ),
    "a window for errors": ({"system.yaml": RESTART % "window_ms: 300"}, []),
    "a module that a package of the project lacks": (
        {
            "system.yaml": HELPER,
            "code.py": CODE % "drive.controller",
            "drive/__init__.py": "",
            "drive/control.py": "def step(): ...\n",
        },
        [("unknown-import", "code.py", 1)],
    ),
    "a module of a package of the project": (
        {
            "system.yaml": HELPER,
            "code.py": CODE % "drive.control",
            "drive/__init__.py": "",
            "drive/control.py": "def step(): ...\n",
        },
        [],
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_reported_once(name: str, tmp_path: Path) -> None:
    files, expected = MISTAKES[name]
    for path, text in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    found = load(tmp_path / "system.yaml").diagnostics
    assert [
        (item.rule.name, Path(item.primary.file.path).name, item.primary.line)
        for item in found
        if item.severity.value != "info"
    ] == expected

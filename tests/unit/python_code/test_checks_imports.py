"""Imports that fail, that may fail elsewhere, and those that need not succeed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load
from tests.unit.support.checking import write_files

FILES = {
    "motor.py": "SPEED = 1\n\n\ndef start(): ...\n",
    "arms/__init__.py": "LEFT = 1\n",
    "arms/grip.py": "",
    #: A package may have interfaces and modules.
    "std_srvs/__init__.py": "",
    "fast/__init__.py": "",
    "fast/core.pyx": "",
    "fast/solver.py": "",
    "system.yaml": (
        "system: a\nnodes: {n: {behavior: 'code:Robot', timers: {tick: {period_ms: 100}}}}\n"
    ),
}
BEHAVIOR = "class Robot:\n    def on_tick(self): ...\n"

#: Statements, the text that is underlined and the hint.
FAIL = [
    ("import nmpy", "nmpy", "did you mean 'numpy'?"),
    ("import moter", "moter", "did you mean 'motor'?"),
    ("import os.pth", "pth", None),
    ("import xml.etre", "etre", None),
    ("import arms.grp", "grp", "did you mean 'grip'?"),
    ("from .mottor import SPEED", "mottor", "did you mean 'motor'?"),
    ("from . import motr", "motr", "did you mean 'motor'?"),
    ("from arms import LEFTT", "LEFTT", "did you mean 'LEFT'?"),
    ("import sensr_msg.msg", "sensr_msg", "did you mean 'sensor_msgs'?"),
    ("from motor import SPED", "SPED", "did you mean 'SPEED'?"),
    ("from .motor import SPEDE", "SPEDE", "did you mean 'SPEED'?"),
    ("from std_msgs.mgs import String", "mgs", "did you mean 'msg'?"),
    ("from std_msgs.msg import Strin", "Strin", "did you mean 'String'?"),
    ("from std_msgs.msg import Twist", "Twist", "import it from 'geometry_msgs.msg'"),
    ("from std_srvs.msg import Trigger", "Trigger", "import it from 'std_srvs.srv'"),
    ("import geometry_msg.msg", "geometry_msg", "did you mean 'geometry_msgs'?"),
    ("from composer.behavior import CallCanceled", "CallCanceled", "did you mean 'CallCancelled'?"),
    ("from rclpy.nod import Node", "nod", "did you mean 'node'?"),
    ("import rclpy.qso", "qso", "did you mean 'qos'?"),
    ("from composer.behavor import Goal", "behavor", "did you mean 'behavior'?"),
]  # fmt: skip
ELSEWHERE = [
    (code, marked, "install it, or correct the name")
    for code, marked in {
        "import fastkalman": "fastkalman",
        "from mars_msgs.msg import Crater": "mars_msgs",
        "import bson": "bson",
        "import ntplib": "ntplib",
        "import cma": "cma",
        "import arms.gripper": "gripper",
        "from . import generated": "generated",
        "from arms import made": "made",
        "from .written import parameters": "written",
        "import maths": "maths",
    }.items()
]
SUCCEED = """\
from std_srvs.srv import Trigger
import std_srvs.srv
from fast import core
import fast.core
from composer.typed import DriverBehavior
import math, os.path, collections.abc, xml.etree, motor, arms
from motor import SPEED, start
from . import motor
from .motor import start
from arms import LEFT, __doc__
import rclpy, numpy.linalg, tf2_ros
import rclpy.action.client
from std_srvs.srv import Trigger, Trigger_Request
from std_msgs.msg import *
from composer.behavior import Goal, Changes
from contextlib import suppress
from typing import TYPE_CHECKING
try:
    import quick
except ImportError:
    quick = None
with suppress(ImportError):
    import quick
if TYPE_CHECKING:
    import quick
if os.environ.get('OLD'):
    from motor import SPED
else:
    import quick
"""


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Mapping[tuple[str, int], Diagnostic]:
    """Return what is reported about imports, by file and line; one check reads all files."""
    folder = tmp_path_factory.mktemp("imports")
    codes = {
        "fails": "\n".join(code for code, *_ in FAIL),
        "elsewhere": "\n".join(code for code, *_ in ELSEWHERE),
        "succeeds": SUCCEED,
        "searching": "import sys\nsys.path.insert(0, '/opt/tools')\nimport meter\n",
        "loading": "import importlib\nimportlib.import_module('a')\nimport motoor\n",
    }
    imports = "".join(f"import {name}\n" for name in codes)
    files = {**FILES, "code.py": imports + BEHAVIOR}
    write_files(folder, files | {f"{name}.py": code for name, code in codes.items()})
    diagnostics = load(folder / "system.yaml").diagnostics
    return {(Path(x.primary.file.path).stem, x.primary.line): x for x in diagnostics}


@pytest.mark.parametrize(
    ("file", "line", "rule", "case"),
    [("fails", line, "unknown-import", case) for line, case in enumerate(FAIL, 1)]
    + [("elsewhere", line, "not-installed", x) for line, x in enumerate(ELSEWHERE, 1)],
)
def test_imports_that_fail(
    file: str,
    line: int,
    rule: str,
    case: tuple[str, str, str | None],
    reported: Mapping[tuple[str, int], Diagnostic],
) -> None:
    code, text, hint = case
    item = reported[file, line]
    assert (item.rule.name, item.primary.text, item.hint) == (rule, text, hint), code


def test_imports_that_succeed_or_need_not(reported: Mapping[tuple[str, int], Diagnostic]) -> None:
    for place, text in ((("searching", 3), "meter"), (("loading", 3), "motoor")):
        found = reported[place]
        assert (found.rule.name, found.primary.text) == ("not-installed", text)
        assert "did you mean" not in str(found.hint)
    rules = {"unknown-import", "not-installed"}
    assert [
        x for (file, _), x in reported.items() if file == "succeeds" and x.rule.name in rules
    ] == []
    assert ("code", 1) not in reported

"""Imports that fail, that may fail elsewhere, and those that need not succeed."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from composer.interfaces import Interfaces
from composer.python_code.checks.imports import import_problems
from composer.python_code.problems import Family
from composer.python_code.syntax import read_module


@cache
def interfaces() -> Interfaces:
    return Interfaces.load()


HELPERS = {
    "motor.py": "SPEED = 1\n\n\ndef start(): ...\n",
    "arms/__init__.py": "LEFT = 1\n",
    "arms/grip.py": "",
}
#: A package may have interfaces and modules.
INTERFACES = {"std_srvs/__init__.py": ""}
COMPILED = {"fast/__init__.py": "", "fast/core.pyx": "", "fast/solver.py": ""}


def found(code: str, folder: Path) -> list[tuple[Family, str, str | None]]:
    for name, text in {**HELPERS, **COMPILED, **INTERFACES, "code.py": code}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    module = read_module(folder / "code.py", "code.py")
    problems = import_problems(module, folder, interfaces())
    return [(item.family, item.span.text, item.hint) for item in problems]


FAIL = [
    ("import nmpy", "nmpy", "did you mean 'numpy'?"),
    ("import moter", "moter", "did you mean 'motor'?"),
    ("import os.pth", "pth", None),
    ("import xml.etre", "etre", None),
    ("import arms.grp", "grp", "did you mean 'grip'?"),
    ("from .moter import SPEED", "moter", "did you mean 'motor'?"),
    ("from . import moter", "moter", "did you mean 'motor'?"),
    ("from arms import LEFTT", "LEFTT", "did you mean 'LEFT'?"),
    ("import sensr_msg.msg", "sensr_msg", "did you mean 'sensor_msgs'?"),
    ("from motor import SPED", "SPED", "did you mean 'SPEED'?"),
    ("from .motor import SPED", "SPED", "did you mean 'SPEED'?"),
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


@pytest.mark.parametrize(("code", "text", "hint"), FAIL)
def test_imports_that_fail(code: str, text: str, hint: str | None, tmp_path: Path) -> None:
    assert found(code, tmp_path) == [(Family.IMPORT, text, hint)]


@pytest.mark.parametrize(
    "code",
    [
        "import fastkalman",
        "from mars_msgs.msg import Crater",
        "import bson",
        "import ntplib",
        "import cma",
        "import arms.gripper",
        "from . import generated",
        "from arms import generated",
        "from .generated import parameters",
        "import sys\nsys.path.insert(0, '/opt/tools')\nimport meter",
        "import importlib\nimportlib.import_module('a')\nimport moter",
    ],
)
def test_modules_that_may_be_elsewhere(code: str, tmp_path: Path) -> None:
    [(family, _, hint)] = found(code, tmp_path)
    assert family is Family.NOT_INSTALLED
    assert "did you mean" not in str(hint)


def test_a_module_like_one_of_the_standard_library(tmp_path: Path) -> None:
    hint = "did you mean 'math'?"
    assert found("import maths", tmp_path) == [(Family.NOT_INSTALLED, "maths", hint)]


def test_an_internal_module(tmp_path: Path) -> None:
    [(family, text, _)] = found("from composer.model.names import join", tmp_path)
    assert (family, text) == (Family.INTERNAL, "composer.model")


@pytest.mark.parametrize(
    "code",
    [
        "from std_srvs.srv import Trigger\nimport std_srvs.srv",
        "from fast import solvr, other",
        "import fast.slver",
        "from composer.typed import Driver",
        "import math, os.path, collections.abc, xml.etree, motor, arms",
        "from motor import SPEED, start",
        "from . import motor",
        "from .motor import start",
        "from arms import LEFT, __doc__",
        "import rclpy, numpy.linalg, tf2_ros",
        "from rclpy import init, qos, shutdwn\nimport rclpy.action.client",  # names: type checker
        "from std_srvs.srv import Trigger, Trigger_Request",
        "from std_msgs.msg import *",
        "from composer.behavior import Goal, Changes",
        "from composer.typed import DriverBehavior",
        "try:\n    import quick\nexcept ImportError:\n    quick = None",
        "from contextlib import suppress\nwith suppress(ImportError):\n    import quick",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import quick",
        "import os\nif os.environ.get('OLD'):\n    from motor import SPED\nelse:\n    import quick",
    ],
)
def test_imports_that_succeed_or_need_not(code: str, tmp_path: Path) -> None:
    assert found(code, tmp_path) == []

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from composer.base.source import Located, SourceFile, Span
from composer.model import BehaviorReference
from composer.python_code.lookup import BehaviorSource, find_behavior
from tests.unit.support.checking import write_files


def find(text: str, folder: Path) -> BehaviorSource:
    span = Span(SourceFile("robot.yaml"), 1, 1)
    return find_behavior(BehaviorReference(Located(text, span), folder))


def read(folder: Path, text: str, **modules: str) -> BehaviorSource:
    """Find the class ``Robot`` in a text, next to other modules."""
    write_files(folder, {"robot.py": text} | {f"{name}.py": it for name, it in modules.items()})
    return find("robot:Robot", folder)


def test_methods_have_names_spans_and_arguments(tmp_path: Path) -> None:
    text = """\
class Robot:
    def on_scan(self, message): ...
    async  def on_drive(self, goal, *, speed): ...
    def on_ask(self, request, response=None, *more): ...
    ä = "ö"; on_tick = print
    @staticmethod
    def on_static(message): ...
    @classmethod
    def on_class(cls): ...
    @timed(3)
    def on_hidden(self): ...
"""
    source = read(tmp_path, text)
    assert (source.module_found, source.class_found, source.complete) == (True, True, True)
    assert source.class_names == ("Robot",)
    methods = {method.name: method for method in source.methods}
    scan, drive, ask = (methods[name] for name in ("on_scan", "on_drive", "on_ask"))
    assert (scan.arguments, scan.is_async) == (("message",), False)
    assert (scan.span.line, scan.span.column, scan.span.length) == (2, 9, 7)
    assert (drive.is_async, drive.span.column) == (True, 16)
    assert [scan.accepts(count) for count in (0, 1, 2)] == [False, True, False]
    assert not drive.accepts(1)
    assert [ask.accepts(count) for count in (0, 1, 2, 5)] == [False, True, True, True]
    # Columns count characters.
    assert (methods["on_tick"].span.line, methods["on_tick"].span.column) == (5, 14)
    assert methods["on_static"].arguments == ("message",)
    assert methods["on_class"].arguments == ()
    # Signatures that are hidden are unknown.
    for name in ("on_hidden", "on_tick"):
        assert not methods[name].known
        assert methods[name].accepts(7)


def test_bases_are_followed_within_the_folder(tmp_path: Path) -> None:
    text = """\
import wheels as w
from base import Base as Root
from composer.behavior import Behavior
class Middle(Root, Behavior):
    def on_middle(self): ...
class Robot(Middle, w.Wheels):
    async def on_middle(self): ...
    def on_robot(self): ...
"""
    base = "class Base:\n    def on_base(self): ...\n"
    wheels = "class Wheels:\n    def on_wheels(self): ...\n"
    source = read(tmp_path, text, base=base, wheels=wheels)
    assert source.complete
    names = [method.name for method in source.methods]
    assert names == ["on_middle", "on_robot", "on_base", "on_wheels"]
    assert source.method("on_middle").is_async  # the nearest definition


@pytest.mark.parametrize(
    ("text", "complete"),
    [
        # A base of the typed module has no handlers.
        ("from composer.typed import RobotBehavior\nclass Robot(RobotBehavior): ...\n", True),
        ("from nowhere import Base\nclass Robot(Base): ...\n", False),
        ("class Robot(make()): ...\n", False),
        ("@dataclass\nclass Robot: ...\n", False),
        ("class Robot(metaclass=Meta): ...\n", False),
        ("class Robot:\n    def __getattr__(self, name): ...\n", False),
        # A class that may exist is not missing.
        ("Robot = make()\n", False),
        ("from nowhere import Robot\n", False),
        ("from nowhere import *\n", False),
        ("def __getattr__(name): ...\n", False),
    ],
)
def test_dynamic_classes_are_incomplete(tmp_path: Path, text: str, complete: bool) -> None:
    source = read(tmp_path, text)
    assert (source.class_found, source.complete) == (True, complete)


def test_alternative_imports_have_no_single_origin(tmp_path: Path) -> None:
    text = """\
import time
if time.time() > 0:
    from old import Base
else:
    from new import Base
import time
class Robot(Base): ...
"""
    base = "class Base:\n    def on_base(self): ...\n"
    source = read(tmp_path, text, old=base, new=base)
    assert not source.complete
    module = source.classes[0][0]
    assert sorted(module.alternatives) == ["Base"]
    assert module.names == {"time": "time"}
    assert {item.path.stem for item in source.own_modules} == {"robot", "old", "new"}


def test_broken_modules_have_their_place_and_text(tmp_path: Path) -> None:
    for text in ("import helper\nclass Robot: ...\n", "from helper import Robot\n"):
        (broken,) = read(tmp_path, text, helper="def help(:\n").broken
        assert broken.path == tmp_path / "helper.py"
        assert broken.span.file.text == "def help(:\n"
        assert broken.message.startswith("module 'helper' is not Python: ")
    source = read(tmp_path, "class Robot(:\n")
    assert [item.path for item in source.broken] == [tmp_path / "robot.py"]
    assert source.problem is not None


def test_relative_imports_are_followed(tmp_path: Path) -> None:
    files = {
        "robots/__init__.py": "from .arm import Arm\nfrom . import leg\n",
        "robots/arm.py": "from . import leg\nclass Arm(leg.Leg):\n    def on_arm(self): ...\n",
        "robots/leg.py": "class Leg:\n    def on_leg(self): ...\n",
    }
    write_files(tmp_path, files)
    source = find("robots:Arm", tmp_path)
    assert source.complete
    assert [method.name for method in source.methods] == ["on_arm", "on_leg"]
    assert find("robots.arm:Arm", tmp_path).complete


def test_conditional_classes_are_found_and_cyclic_bases_end(tmp_path: Path) -> None:
    text = (
        "try:\n    import fast\nexcept ImportError:\n"
        "    if True:\n        class Robot:\n            def on_tick(self): ...\n"
    )
    assert [method.name for method in read(tmp_path, text).methods] == ["on_tick"]
    other = "from robot import Robot\nclass Other(Robot): ...\n"
    text = "from other import Other\nclass Robot(Other): ...\n"
    assert read(tmp_path, text, other=other).class_found


def test_the_nodes_folder_of_the_project_is_searched_last(tmp_path: Path) -> None:
    nodes, systems = tmp_path / "nodes", tmp_path / "systems"
    systems.mkdir()
    for folder in (nodes, systems):
        write_files(folder, {"robot.py": "class Robot: ...\n"})
        assert find("robot:Robot", systems).path == folder / "robot.py"


def test_installed_modules_are_found_without_importing_them(tmp_path: Path) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] in ("mailbox", "wsgiref")]:
        del sys.modules[name]
    source = find("mailbox:Maildir", tmp_path)
    assert source.class_found
    assert source.method("add") is not None
    assert find("wsgiref.handlers:CGIHandler", tmp_path).class_found
    assert not any(name.startswith(("mailbox", "wsgiref")) for name in sys.modules)
    # A compiled module is not missing.
    source = find("sys:Robot", tmp_path)
    assert (source.module_found, source.class_found, source.complete) == (True, True, False)


@pytest.mark.parametrize(
    "text", ["nothing_here:Robot", "..:Robot", "../robot:Robot", "a b:C", ":Robot", "", "json.no:X"]
)
def test_an_unknown_module_is_missing(tmp_path: Path, text: str) -> None:
    (tmp_path.parent / "robot.py").write_text("class Robot: ...\n")
    assert not find(text, tmp_path).module_found


def test_a_missing_class_is_reported_with_the_existing_ones(tmp_path: Path) -> None:
    (tmp_path / "robot.py").write_text("class Rover: ...\nclass Arm: ...\n")
    for text in ("robot:Robot", "robot"):
        source = find(text, tmp_path)
        assert (source.module_found, source.class_found) == (True, False)
        assert source.class_names == ("Rover", "Arm")
    # Changes of the file are noticed.
    assert read(tmp_path, "class Robot: ...\n").class_found


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"class Robot:\n\x00", "is not Python"),
        (b"class Robot(:\n", "is not Python: "),
        (b"\xff\xfe", "is not text"),
        (b"# coding: punycode\n" + b"a" * 1000, "has the encoding 'punycode'"),
        (b"# coding: nonsense\n", "is not text"),
        (b"x = " + b"(" * 100_000, "is not Python"),  # test_syntax.py has other deep texts
        (b"#" * 300_000, "is larger than"),
    ],
)
def test_no_content_raises(tmp_path: Path, content: bytes, problem: str) -> None:
    (tmp_path / "robot.py").write_bytes(content)
    source = find("robot:Robot", tmp_path)
    assert source.module_found
    assert str(source.problem).startswith(problem)


def test_a_folder_with_the_name_of_the_file_is_not_a_module(tmp_path: Path) -> None:
    (tmp_path / "robot.py").mkdir()
    assert find("robot:Robot", tmp_path).problem == "is not a regular file"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_module_of_another_user_is_refused(tmp_path: Path) -> None:
    text = "class Robot: ...\n"
    write_files(tmp_path, {"robot/__init__.py": text, "robot.py": text})
    os.chown(tmp_path / "robot.py", 65534, 65534)
    assert find("robot:Robot", tmp_path).problem == "belongs to another user"

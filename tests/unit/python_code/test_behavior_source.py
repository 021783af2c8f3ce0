from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from composer.base.source import Located, SourceFile, Span
from composer.model import BehaviorReference
from composer.python_code.lookup import BehaviorSource, find_behavior


def find(text: str, folder: Path) -> BehaviorSource:
    span = Span(SourceFile("robot.yaml"), 1, 1)
    return find_behavior(BehaviorReference(Located(text, span), folder))


def read(folder: Path, text: str) -> BehaviorSource:
    (folder / "robot.py").write_text(text, encoding="utf-8")
    return find("robot:Robot", folder)


def test_methods_have_names_spans_and_arguments(tmp_path: Path) -> None:
    source = read(
        tmp_path,
        "class Robot:\n"
        "    def on_scan(self, message): ...\n"
        "    async  def on_drive(self, goal, *, speed): ...\n"
        "    def on_ask(self, request, response=None, *more): ...\n",
    )
    assert source.module_found
    assert source.class_found
    assert source.complete
    assert source.class_names == ("Robot",)
    scan, drive, ask = source.methods
    assert (scan.name, scan.arguments, scan.is_async) == ("on_scan", ("message",), False)
    assert (scan.span.line, scan.span.column, scan.span.length) == (2, 9, 7)
    assert (drive.is_async, drive.span.column) == (True, 16)
    assert [scan.accepts(count) for count in (0, 1, 2)] == [False, True, False]
    assert not drive.accepts(1)
    assert [ask.accepts(count) for count in (0, 1, 2, 5)] == [False, True, True, True]


def test_columns_count_characters(tmp_path: Path) -> None:
    source = read(tmp_path, 'class Robot:\n    ä = "ö"; on_tick = print\n')
    method = source.method("on_tick")
    assert method is not None
    assert (method.span.line, method.span.column) == (2, 14)


def test_static_and_class_methods_have_their_arguments(tmp_path: Path) -> None:
    source = read(
        tmp_path,
        "class Robot:\n"
        "    @staticmethod\n"
        "    def on_scan(message): ...\n"
        "    @classmethod\n"
        "    def on_tick(cls): ...\n",
    )
    assert [method.arguments for method in source.methods] == [("message",), ()]


def test_hidden_signatures_are_unknown(tmp_path: Path) -> None:
    source = read(
        tmp_path,
        "class Robot:\n    @timed(3)\n    def on_scan(self): ...\n    on_tick = make_handler()\n",
    )
    assert [method.known for method in source.methods] == [False, False]
    assert all(method.accepts(7) for method in source.methods)


def test_bases_are_followed_within_the_folder(tmp_path: Path) -> None:
    (tmp_path / "base.py").write_text("class Base:\n    def on_base(self): ...\n")
    (tmp_path / "wheels.py").write_text("class Wheels:\n    def on_wheels(self): ...\n")
    source = read(
        tmp_path,
        "import wheels as w\n"
        "from base import Base as Root\n"
        "from composer.behavior import Behavior\n"
        "class Middle(Root, Behavior):\n    def on_middle(self): ...\n"
        "class Robot(Middle, w.Wheels):\n    def on_robot(self): ...\n",
    )
    assert source.complete
    names = [method.name for method in source.methods]
    assert names == ["on_robot", "on_middle", "on_base", "on_wheels"]


def test_the_nearest_definition_of_a_method_counts(tmp_path: Path) -> None:
    source = read(
        tmp_path,
        "class Base:\n    def on_tick(self): ...\n"
        "class Robot(Base):\n    async def on_tick(self): ...\n",
    )
    assert [method.is_async for method in source.methods] == [True]


@pytest.mark.parametrize(
    "text",
    [
        "from nowhere import Base\nclass Robot(Base): ...\n",
        "class Robot(make()): ...\n",
        "@dataclass\nclass Robot: ...\n",
        "class Robot(metaclass=Meta): ...\n",
        "class Robot:\n    def __getattr__(self, name): ...\n",
    ],
)
def test_dynamic_classes_are_incomplete(tmp_path: Path, text: str) -> None:
    source = read(tmp_path, text)
    assert source.class_found
    assert not source.complete


@pytest.mark.parametrize(
    "text",
    [
        "Robot = make()\n",
        "from nowhere import Robot\n",
        "from nowhere import *\n",
        "def __getattr__(name): ...\n",
    ],
)
def test_a_class_that_may_exist_is_not_missing(tmp_path: Path, text: str) -> None:
    source = read(tmp_path, text)
    assert source.class_found
    assert not source.complete


def test_a_base_of_the_typed_module_has_no_handlers(tmp_path: Path) -> None:
    source = read(
        tmp_path, "from composer.typed import RobotBehavior\nclass Robot(RobotBehavior): ...\n"
    )
    assert source.complete


def test_alternative_imports_have_no_single_origin(tmp_path: Path) -> None:
    (tmp_path / "old.py").write_text("class Base:\n    def on_old(self): ...\n")
    (tmp_path / "new.py").write_text("class Base:\n    def on_new(self): ...\n")
    source = read(
        tmp_path,
        "import time\nif time.time() > 0:\n    from old import Base\n"
        "else:\n    from new import Base\nimport time\nclass Robot(Base): ...\n",
    )
    assert not source.complete
    module = source.classes[0][0]
    assert sorted(module.alternatives) == ["Base"]
    assert module.names == {"time": "time"}
    assert {item.path.stem for item in source.own_modules} == {"robot", "old", "new"}


def test_broken_modules_have_their_place_and_text(tmp_path: Path) -> None:
    (tmp_path / "helper.py").write_text("def help(:\n")
    for text in ("import helper\nclass Robot: ...\n", "from helper import Robot\n"):
        (broken,) = read(tmp_path, text).broken
        assert broken.path == tmp_path / "helper.py"
        assert broken.span.file.text == "def help(:\n"
        assert broken.message.startswith("module 'helper' is not Python: ")
    source = read(tmp_path, "class Robot(:\n")
    assert [item.path for item in source.broken] == [tmp_path / "robot.py"]
    assert source.problem is not None


def test_relative_imports_are_followed(tmp_path: Path) -> None:
    package = tmp_path / "robots"
    package.mkdir()
    (package / "__init__.py").write_text("from .arm import Arm\nfrom . import leg\n")
    (package / "arm.py").write_text(
        "from . import leg\nclass Arm(leg.Leg):\n    def on_arm(self): ...\n"
    )
    (package / "leg.py").write_text("class Leg:\n    def on_leg(self): ...\n")
    source = find("robots:Arm", tmp_path)
    assert source.complete
    assert [method.name for method in source.methods] == ["on_arm", "on_leg"]
    assert find("robots.arm:Arm", tmp_path).complete


def test_conditional_classes_are_found(tmp_path: Path) -> None:
    text = (
        "try:\n    import fast\nexcept ImportError:\n"
        "    if True:\n        class Robot:\n            def on_tick(self): ...\n"
    )
    assert [method.name for method in read(tmp_path, text).methods] == ["on_tick"]


def test_cyclic_bases_end(tmp_path: Path) -> None:
    (tmp_path / "other.py").write_text("from robot import Robot\nclass Other(Robot): ...\n")
    source = read(tmp_path, "from other import Other\nclass Robot(Other): ...\n")
    assert source.class_found


def test_the_nodes_folder_of_the_project_is_searched_last(tmp_path: Path) -> None:
    nodes = tmp_path / "nodes"
    systems = tmp_path / "systems"
    nodes.mkdir()
    systems.mkdir()
    (nodes / "robot.py").write_text("class Robot: ...\n")
    assert find("robot:Robot", systems).path == nodes / "robot.py"
    (systems / "robot.py").write_text("class Robot: ...\n")
    assert find("robot:Robot", systems).path == systems / "robot.py"


def test_installed_modules_are_found_without_importing_them(tmp_path: Path) -> None:
    sys.modules.pop("mailbox", None)
    source = find("mailbox:Maildir", tmp_path)
    assert source.class_found
    assert source.method("add") is not None
    assert "mailbox" not in sys.modules


def test_an_installed_package_is_not_imported_for_its_modules(tmp_path: Path) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "wsgiref"]:
        del sys.modules[name]
    assert find("wsgiref.handlers:CGIHandler", tmp_path).class_found
    assert not any(name.startswith("wsgiref") for name in sys.modules)


def test_a_compiled_module_is_not_missing(tmp_path: Path) -> None:
    source = find("sys:Robot", tmp_path)
    assert source.module_found
    assert source.class_found
    assert not source.complete


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
        assert source.module_found
        assert not source.class_found
        assert source.class_names == ("Rover", "Arm")


def test_changes_of_the_file_are_noticed(tmp_path: Path) -> None:
    assert read(tmp_path, "class Rover: ...\n").class_found is False
    assert read(tmp_path, "class Robot: ...\n").class_found is True


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"class Robot:\n\x00", "is not Python"),
        (b"class Robot(:\n", "is not Python: "),
        (b"\xff\xfe", "is not text"),
        (b"# coding: punycode\n" + b"a" * 1000, "has the encoding 'punycode'"),
        (b"# coding: nonsense\n", "is not text"),
        (b"x = " + b"(" * 100_000, "is not Python"),
        (b"x = " + b"-" * 100_000 + b"1", "is not Python"),
        (b"x = a" + b".a" * 100_000, "is not Python"),
        (b"x = 1" + b"+1" * 100_000, "is not Python"),
        (b"#" * 300_000, "is larger than"),
        (b"x = " + b"9" * 6000, "is not Python"),
    ],
)
def test_no_content_raises(tmp_path: Path, content: bytes, problem: str) -> None:
    (tmp_path / "robot.py").write_bytes(content)
    source = find("robot:Robot", tmp_path)
    assert source.module_found
    assert source.problem is not None
    assert source.problem.startswith(problem)


def test_a_folder_with_the_name_of_the_file_is_not_a_module(tmp_path: Path) -> None:
    (tmp_path / "robot.py").mkdir()
    assert find("robot:Robot", tmp_path).problem == "is not a regular file"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_module_of_another_user_is_refused(tmp_path: Path) -> None:
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "__init__.py").write_text("class Robot: ...\n")
    (tmp_path / "robot.py").write_text("class Robot: ...\n")
    os.chown(tmp_path / "robot.py", 65534, 65534)
    source = find("robot:Robot", tmp_path)
    assert source.problem == "belongs to another user"

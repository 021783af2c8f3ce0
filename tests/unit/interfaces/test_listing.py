"""The text of interfaces, and the lists of files of the composer's own package."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.base.folders import interfaces_folder
from composer.interfaces import Interfaces
from composer.interfaces.index import listing
from tests.unit.interfaces.test_index import package, prefix

OUTER = """\
# outside

Inner[2] inner  # below
string name 'a'
int8 LIMIT=1
"""
INNER = """\
# inside

int32 x 3  # of it
bool[] flags
"""


@pytest.fixture
def interfaces(tmp_path: Path) -> Interfaces:
    definitions = {"msg_Inner": INNER, "msg_Outer": OUTER}
    package(tmp_path, "my_msgs", **definitions, srv_Ask="Inner what\n---\n# why\nbool ok\n")
    return Interfaces.load([tmp_path])


WITH_COMMENTS = """\
# outside

Inner[2] inner  # below
\tint32 x 3
\tbool[] flags
string name 'a'
int8 LIMIT=1"""
WITHOUT_COMMENTS = """\
Inner[2] inner
\tint32 x 3
\tbool[] flags
string name 'a'
int8 LIMIT=1"""


def test_comments_and_nested_messages(
    interfaces: Interfaces, monkeypatch: pytest.MonkeyPatch
) -> None:
    for comments, expected in ((True, WITH_COMMENTS), (False, WITHOUT_COMMENTS)):
        assert "\n".join(listing("my_msgs/msg/Outer", interfaces, comments=comments)) == expected
    shown = list(listing("my_msgs/srv/Ask", interfaces))
    assert shown == ["Inner what", "\tint32 x 3", "\tbool[] flags", "---", "# why", "bool ok"]
    # A definition without text is written from its description.
    monkeypatch.setattr(interfaces, "text", lambda _: None)
    assert list(listing("my_msgs/msg/Outer", interfaces)) == [
        "int8 LIMIT=1",
        "my_msgs/msg/Inner[2] inner",
        "\tint32 x 3",
        "\tbool[] flags",
        "string name a",
    ]


def test_a_message_that_contains_itself_is_expanded_once(tmp_path: Path) -> None:
    installed = prefix(tmp_path, "my_msgs", msg_Tree="Leaf leaf\n", msg_Leaf="Tree tree\n")
    shown = list(listing("my_msgs/msg/Tree", Interfaces([installed])))
    assert shown == ["Leaf leaf", "\tTree tree"]


FOLDER = interfaces_folder()


def test_the_ament_package_lists_every_interface() -> None:
    """It lists its files by hand, in a place that is easily forgotten."""
    cmake = (FOLDER / "CMakeLists.txt").read_text("utf-8")
    listed = re.findall(r'"(\w+/\w+\.(?:msg|srv|action))"', cmake)
    files = [path for kind in ("msg", "srv", "action") for path in FOLDER.glob(f"*/*.{kind}")]
    assert sorted(listed) == sorted(path.relative_to(FOLDER).as_posix() for path in files)


def test_ament_and_pip_have_the_same_name_and_version_and_pinned_wheels() -> None:
    package = ElementTree.parse(FOLDER / "package.xml").getroot()
    settings = tomllib.loads((FOLDER / "pyproject.toml").read_text("utf-8"))
    assert package.findtext("name") == settings["project"]["name"].replace("-", "_")
    assert package.findtext("version") == settings["project"]["version"]
    requires = settings["build-system"]["requires"]
    wheels = [requirement for requirement in requires if requirement.startswith("ros-")]
    assert wheels
    assert [wheel for wheel in wheels if "==" not in wheel] == []

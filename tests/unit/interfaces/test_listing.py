from __future__ import annotations

from pathlib import Path

import pytest

from composer.interfaces import Interfaces
from composer.interfaces.listing import listing
from composer.interfaces.sources import Prefix

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
    (tmp_path / "msg").mkdir()
    (tmp_path / "srv").mkdir()
    (tmp_path / "package.xml").write_text("<package><name>my_msgs</name></package>")
    (tmp_path / "msg" / "Inner.msg").write_text(INNER)
    (tmp_path / "msg" / "Outer.msg").write_text(OUTER)
    (tmp_path / "srv" / "Ask.srv").write_text("Inner what\n---\n# why\nbool ok\n")
    return Interfaces.load([tmp_path])


@pytest.mark.parametrize(
    ("comments", "expected"),
    [
        (
            True,
            "# outside\n\nInner[2] inner  # below\n\tint32 x 3\n\tbool[] flags\nstring name 'a'\n"
            "int8 LIMIT=1",
        ),
        (
            False,
            "Inner[2] inner\n\tint32 x 3\n\tbool[] flags\nstring name 'a'\nint8 LIMIT=1",
        ),
    ],
)
def test_comments_and_nested_messages(
    interfaces: Interfaces, comments: bool, expected: str
) -> None:
    assert "\n".join(listing("my_msgs/msg/Outer", interfaces, comments=comments)) == expected


def test_services_keep_their_separator(interfaces: Interfaces) -> None:
    shown = list(listing("my_msgs/srv/Ask", interfaces))
    assert shown == ["Inner what", "\tint32 x 3", "\tbool[] flags", "---", "# why", "bool ok"]


def test_a_definition_without_text_is_written_from_its_description(
    interfaces: Interfaces, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interfaces, "text", lambda _: None)
    assert list(listing("my_msgs/msg/Outer", interfaces)) == [
        "int8 LIMIT=1",
        "my_msgs/msg/Inner[2] inner",
        "\tint32 x 3",
        "\tbool[] flags",
        "string name a",
    ]


def test_a_message_that_contains_itself_is_expanded_once(tmp_path: Path) -> None:
    folder = tmp_path / "share" / "my_msgs" / "msg"
    index = tmp_path / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"
    folder.mkdir(parents=True)
    index.mkdir(parents=True)
    (index / "my_msgs").touch()
    (folder / "Tree.msg").write_text("Leaf leaf\n")
    (folder / "Leaf.msg").write_text("Tree tree\n")
    interfaces = Interfaces([Prefix(tmp_path)])
    shown = list(listing("my_msgs/msg/Tree", interfaces))
    assert shown == ["Leaf leaf", "\tTree tree"]

"""The index: where definitions come from, which one wins, and what is read when."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from composer.interfaces import Action, FieldType, Interfaces, Message, Service, parts
from composer.interfaces.index import similar_interface
from composer.interfaces.sources import (
    Bundle,
    Prefix,
    find_packages,
    installed_prefixes,
    read_description,
)
from tests.unit.support.checking import write_files

BUNDLED = Interfaces([Bundle()])


def package(folder: Path, name: str, **files: str) -> Path:
    """Write an interface package; ``msg_Demo="bool on"`` becomes msg/Demo.msg."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    for key, text in files.items():
        kind, stem = key.split("_")
        (folder / kind).mkdir(exist_ok=True)
        (folder / kind / f"{stem}.{kind}").write_text(text)
    return folder


def prefix(root: Path, name: str, **files: str) -> Prefix:
    """Write a package as it is installed."""
    package(root / "share" / name, name, **files)
    index = "share/ament_index/resource_index/rosidl_interfaces"
    write_files(root, {f"{index}/{name}": ""})
    return Prefix(root)


def test_the_snapshot_has_what_systems_are_made_of() -> None:
    message = BUNDLED.find("geometry_msgs/msg/Twist")
    assert isinstance(message, Message)
    assert message.field_names == ("linear", "angular")
    service = BUNDLED.find("composer_interfaces/srv/PlanTrajectory")
    assert isinstance(service, Service)
    assert service.response.field_names == ("path", "success", "message")
    action = BUNDLED.find("composer_interfaces/action/Navigate")
    assert isinstance(action, Action)
    assert action.feedback.field_names == ("progress_percent", "current_position")
    constants = BUNDLED.message("diagnostic_msgs/msg/DiagnosticStatus").constants
    values = {constant.name: constant.value for constant in constants}
    assert values == {"OK": 0, "WARN": 1, "ERROR": 2, "STALE": 3}
    unknown = ("std_msgs/msg/Strin", "nowhere_msgs/msg/A", "std_msgs/String", "../../etc/msg/A")
    for name in (*unknown, "", "a/b"):
        assert (BUNDLED.find(name), BUNDLED.problem(name)) == (None, None), name


def test_every_definition_of_the_snapshot_can_be_read_and_is_complete() -> None:
    for folder in ("msg", "srv", "action"):
        for name in BUNDLED.names(folder):
            found = BUNDLED.find(name)
            assert found is not None, BUNDLED.problem(name)
            for message in parts(found).values():
                for field in message.fields:
                    assert field.type.is_primitive or BUNDLED.message(field.type.name), field


def test_project_wins_over_installed_wins_over_the_snapshot(tmp_path: Path) -> None:
    project = find_packages([package(tmp_path / "a", "std_msgs", msg_String="bool ours")])
    installed = prefix(tmp_path / "b", "std_msgs", msg_String="bool theirs", msg_Bool="bool theirs")
    interfaces = Interfaces([project, installed, Bundle()])
    for name, first_field in (("String", "ours"), ("Bool", "theirs"), ("Int8", "data")):
        assert interfaces.message(f"std_msgs/msg/{name}").fields[0].name == first_field


def test_packages_are_found_below_a_folder_but_not_where_builds_are(tmp_path: Path) -> None:
    package(tmp_path / "src" / "one", "one_msgs", msg_A="bool a", srv_B="---", action_C="---\n---")
    package(tmp_path / "src" / "one" / "inner", "inner_msgs", msg_A="bool a")
    package(tmp_path / "build" / "one", "stale_msgs", msg_A="bool a")
    package(tmp_path / ".hidden", "hidden_msgs", msg_A="bool a")
    package(tmp_path / "code_only", "code_only")
    (tmp_path / "link").symlink_to(tmp_path / "src")
    found = find_packages([tmp_path])
    assert found.packages() == {"one_msgs"}
    assert Interfaces([found]).names("msg") == ("one_msgs/msg/A",)
    assert Interfaces([found]).names("srv") == ("one_msgs/srv/B",)
    assert Interfaces([found]).names("action") == ("one_msgs/action/C",)
    assert find_packages([tmp_path / "missing"]).packages() == frozenset()


@pytest.mark.parametrize(
    ("content", "reason"),
    [(b"bool \xff", "it is not UTF-8"), (b"#" * 1_000_001, "it is larger than 1,000,000 bytes")],
)
def test_a_file_that_is_unreadable_is_a_problem(
    tmp_path: Path, content: bytes, reason: str
) -> None:
    folder = package(tmp_path, "demo_msgs", msg_A="bool ok")
    (folder / "msg" / "A.msg").write_bytes(content)
    interfaces = Interfaces([find_packages([tmp_path])])
    assert interfaces.find("demo_msgs/msg/A") is None
    assert interfaces.text("demo_msgs/msg/A") is None
    problem = interfaces.problem("demo_msgs/msg/A")
    assert str(problem) == f"the definition of 'demo_msgs/msg/A' cannot be read: {reason}"


def test_only_requested_packages_are_read(tmp_path: Path) -> None:
    installed = prefix(tmp_path, "demo_msgs", msg_A="bool a", msg_B="bool b")
    interfaces = Interfaces([installed])
    messages = tmp_path / "share" / "demo_msgs" / "msg"
    (messages / "B.msg").write_text("nonsense")
    assert interfaces.find("demo_msgs/msg/A") is not None
    (messages / "A.msg").write_text("nonsense")
    assert interfaces.problem("demo_msgs/msg/A") is None  # read once
    assert interfaces.problem("demo_msgs/msg/B") is not None


def test_prefixes_are_of_the_environment_then_of_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/overlay::/opt/ros/jazzy")
    roots = [prefix.root for prefix in installed_prefixes()]
    assert roots == [Path("/opt/overlay"), Path("/opt/ros/jazzy"), Path(sys.prefix)]


def test_a_package_without_msg_text_is_read_from_its_type_description(tmp_path: Path) -> None:
    installed = prefix(tmp_path, "idl_msgs", msg_Other="bool a")

    def field(name: str, type_id: int, default: str = "", **more: object) -> dict[str, object]:
        kind = {"type_id": type_id, "capacity": 0, "string_capacity": 0, "nested_type_name": ""}
        return {"name": name, "type": kind | more, "default_value": default}

    fields = [
        field("plain", 11, "1.5"),
        field("fixed", 59, capacity=3),
        field("bounded", 97, capacity=2, nested_type_name="idl_msgs/msg/Other"),
        field("texts", 165, string_capacity=8),
        field("data", 147),
    ]
    description = {"type_name": "idl_msgs/msg/Demo", "fields": fields}
    content = {"type_description": description, "referenced_type_descriptions": []}
    (tmp_path / "share" / "idl_msgs" / "msg" / "Demo.json").write_text(
        json.dumps({"type_description_msg": content})
    )
    interfaces = Interfaces([installed])
    assert interfaces.names("msg") == ("idl_msgs/msg/Demo", "idl_msgs/msg/Other")
    message = interfaces.message("idl_msgs/msg/Demo")
    assert {field.name: str(field.type) for field in message.fields} == {
        "plain": "float64",
        "fixed": "float64[3]",
        "bounded": "idl_msgs/msg/Other[<=2]",
        "texts": "string<=8[]",
        "data": "uint8[]",
    }
    assert message.fields[0].default == 1.5
    assert message.fields[1].type.element == FieldType("float64")


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"type_description_msg": 3}', "[" * 100_000])
def test_other_json_is_not_a_type_description(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_description("a_msgs/msg/A", text)


UNKNOWN = "field '{}' has the unknown type"


@pytest.mark.parametrize(
    ("text", "message", "line", "hint"),
    [
        ("# an a\nbool on\nOthr a\n", UNKNOWN.format("a"), 3, "did you mean 'demo_msgs/Other'?"),
        ("std_msgs/Heder a\n", UNKNOWN.format("a"), 1, "did you mean 'std_msgs/Header'?"),
        ("std_msg/Header a\n", UNKNOWN.format("a"), 1, "did you mean 'std_msgs/Header'?"),
        ("Header a\n", UNKNOWN.format("a"), 1, "did you mean 'std_msgs/Header'?"),
        ("bool on\nint33 x\n", "'int33' is neither a primitive type", 2, "did you mean 'int32'?"),
        ("sting name", "'sting' is neither a primitive", 1, "did you mean 'string'?"),
        ("double x", "'double' is neither a primitive", 1, "did you mean 'float64'?"),
        ("time x", "'time' is neither a primitive", 1, "did you mean 'builtin_interfaces/Time'?"),
        ("bool on\nbool Not\n", "'Not' is not a field name", 2, None),
        ("bool on\nstd_msgs/msg/Header h\n", "types are named without 'msg'", 2, None),
        ("bool on\n---\nbool off\n", "a .msg file has 0 lines with '---'", 2, None),
        ("int8 small 300", "300 is outside the range of int8", 1, None),
        ("bool on\nOther other\n", None, 0, None),
        ("elsewhere_msgs/Other other\n", None, 0, None),
        ("std_msg/Elsewhere header\n", None, 0, None),
    ],
)
def test_mistakes_in_definitions(
    tmp_path: Path, text: str, message: str | None, line: int, hint: str | None
) -> None:
    folder = package(tmp_path / "demo", "demo_msgs", msg_Demo=text, msg_Other="")
    interfaces = Interfaces.load([tmp_path])
    problem = interfaces.problem("demo_msgs/msg/Demo")
    assert (interfaces.find("demo_msgs/msg/Demo") is None) == (message is not None)
    assert interfaces.problem("demo_msgs/msg/Other") is None
    if message is None:
        assert problem is None
    else:
        assert problem.message.startswith(message)
        assert (problem.path, problem.line) == (str(folder / "msg" / "Demo.msg"), line)
        assert problem.place.endswith(f"demo/msg/Demo.msg:{line}")
        assert problem.hint == hint


def test_an_error_in_the_type_of_a_field_is_found_where_it_is(tmp_path: Path) -> None:
    package(tmp_path / "demo", "demo_msgs", msg_Demo="Other other", msg_Other="bool on\nint33 x")
    problem = Interfaces.load([tmp_path]).problem("demo_msgs/msg/Demo")
    assert problem.place.endswith("demo/msg/Other.msg:2")
    assert (problem.span.line, problem.span.column, problem.span.length) == (2, 1, 7)


@pytest.mark.parametrize(
    ("source", "outdated"),
    [
        ({"msg_Demo": "bool on\nOther other", "msg_Other": "int8 x"}, None),
        ({"msg_Demo": "# new\nbool  on\nOther other", "msg_Other": "int8 x"}, None),
        ({"msg_Demo": "bool off\nOther other", "msg_Other": "int8 x"}, "demo_msgs/msg/Demo"),
        ({"msg_Demo": "bool on\nOther other", "msg_Other": "int16 x"}, "demo_msgs/msg/Other"),
    ],
)
def test_changes_since_the_build(
    tmp_path: Path, source: dict[str, str], outdated: str | None
) -> None:
    package(tmp_path / "source", "demo_msgs", **source)
    built = {"msg_Demo": "bool on\nOther other", "msg_Other": "int8 x"}
    installed = prefix(tmp_path / "install", "demo_msgs", **built)
    found = Interfaces([installed, Bundle()], find_packages([tmp_path / "source"]))
    assert found.outdated("demo_msgs/msg/Demo") == outdated
    assert Interfaces([installed]).outdated("demo_msgs/msg/Demo") is None
    without = Interfaces([Bundle()], find_packages([tmp_path / "source"]))
    assert without.outdated("demo_msgs/msg/Demo") is None


@pytest.mark.parametrize(
    ("first", "second", "name", "line"),
    [
        ("string id\nFirst[] parts", "bool on", "First", 2),
        ("Second inner", "bool on\nFirst outer", "Second", 2),
        ("Second a\nSecond b", "bool on", None, 0),  # may be used twice
    ],
    ids=["directly", "through another", "not at all"],
)
def test_recursive_messages(
    tmp_path: Path, first: str, second: str, name: str | None, line: int
) -> None:
    folder = package(tmp_path / "demo", "demo", msg_First=first, msg_Second=second)
    interfaces = Interfaces([], find_packages([folder]))
    problem = interfaces.problem("demo/msg/First")
    if name is None:
        assert problem is None
        assert interfaces.find("demo/msg/First") is not None
    else:
        assert (problem.name, problem.line) == (f"demo/msg/{name}", line)
        assert problem.message.endswith("makes the message contain itself")


KNOWN = ("nav_msgs/msg/Odometry", "std_msgs/msg/Empty", "std_msgs/msg/String", "std_srvs/srv/Empty")


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("std_msgs/msg/Strin", "did you mean 'std_msgs/msg/String'?"),
        ("std_msgs/String", "did you mean 'std_msgs/msg/String'?"),
        ("String", "did you mean 'std_msgs/msg/String'?"),
        ("odometri", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("nav_msg/msg/Odometry", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("Empty", "valid here: std_msgs/msg/Empty, std_srvs/srv/Empty"),
        ("std_msgs/msg/Odometry", "did you mean 'nav_msgs/msg/Odometry'?"),
        ("std_msgs/msg/Quaternion", "valid here: std_msgs/msg/Empty, std_msgs/msg/String"),
        ("acme/msg/Tile", None),
        ("Xyzzy", None),
        ("", None),
    ],
)
def test_a_similar_interface_is_found_by_package_and_name(name: str, hint: str | None) -> None:
    assert similar_interface(name, KNOWN) == hint

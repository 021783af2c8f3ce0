"""Reading .msg, .srv and .action text. tests/ros holds the parser against ROS's own."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from composer.interfaces import (
    Action,
    DefinitionError,
    Field,
    FieldType,
    Message,
    MessageConstant,
    Service,
    parse_definition,
    split_name,
)
from composer.interfaces.parser import without_comments
from tests.unit.support.growth import assert_linear

NAME = "demo_msgs/msg/Demo"


def message(text: str) -> Message:
    parsed = parse_definition(NAME, text)
    assert isinstance(parsed, Message)
    return parsed


LISTS = FieldType("int8", is_array=True)


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("bool on", Field("on", FieldType("bool"))),
        ("float64\tx", Field("x", FieldType("float64"))),
        ("  byte   b   # a comment", Field("b", FieldType("byte"))),
        ("char c", Field("c", FieldType("uint8"))),
        ("string<=5 s", Field("s", FieldType("string", string_bound=5))),
        ("int8[] a", Field("a", LISTS)),
        ("int8[3] a", Field("a", FieldType("int8", is_array=True, array_size=3))),
        ("int8[<=3] a", Field("a", FieldType("int8", is_array=True, array_bound=3))),
        (
            "wstring<=5[<=3] a",
            Field("a", FieldType("wstring", is_array=True, array_bound=3, string_bound=5)),
        ),
        ("Other o", Field("o", FieldType("demo_msgs/msg/Other"))),
        ("std_msgs/Header h", Field("h", FieldType("std_msgs/msg/Header"))),
        ("std_msgs/msg/Header h", Field("h", FieldType("std_msgs/msg/Header"))),
        ("Other[2] o", Field("o", FieldType("demo_msgs/msg/Other", is_array=True, array_size=2))),
        ("bool on true", Field("on", FieldType("bool"), True)),
        ("bool on 0", Field("on", FieldType("bool"), False)),
        ("int16 n -7", Field("n", FieldType("int16"), -7)),
        ("uint8 n 0x1F", Field("n", FieldType("uint8"), 31)),
        ("float32 f 1e-3", Field("f", FieldType("float32"), 0.001)),
        ('string s "a b"', Field("s", FieldType("string"), "a b")),
        (r"string s 'it\'s'", Field("s", FieldType("string"), "it's")),
        ("string s a b", Field("s", FieldType("string"), "a b")),
        ("int8[] a [1, -2]", Field("a", LISTS, [1, -2])),
        ("int8[] a []", Field("a", LISTS, [])),
        ("string[] a ['x, y', z]", Field("a", FieldType("string", is_array=True), ["x, y", "z"])),
        ("uint8 LEFT=1", MessageConstant("LEFT", FieldType("uint8"), 1)),
        ("uint8 LEFT_2   =   255  # comment", MessageConstant("LEFT_2", FieldType("uint8"), 255)),
        ("float64 HALF=0.5", MessageConstant("HALF", FieldType("float64"), 0.5)),
        ('string NAME="a=b"', MessageConstant("NAME", FieldType("string"), "a=b")),
        ("bool ON=True", MessageConstant("ON", FieldType("bool"), True)),
    ],
)
def test_a_line_is_a_field_or_a_constant(line: str, field: Field | MessageConstant) -> None:
    definition = message(line)
    assert (*definition.fields, *definition.constants) == (field,)


def test_fields_are_found_by_name_and_types_are_shown_as_they_are_written() -> None:
    assert message("# only\n\n   # comments\r\n") == Message(NAME)
    definition = message("bool a\nint8[<=2] b")
    assert definition.field("b") == definition.fields[1]
    assert definition.field("c") is None
    assert definition.field_names == ("a", "b")
    for text in ("bool", "string<=5", "int8[]", "int8[3]", "int8[<=3]", "string<=5[<=3]"):
        assert str(message(f"{text} a").fields[0].type) == text


def test_service_and_action_have_their_parts() -> None:
    service = parse_definition("demo_msgs/srv/Ask", "string question\n---\n# nothing\n")
    assert service == Service(
        "demo_msgs/srv/Ask",
        Message("demo_msgs/srv/Ask_Request", (Field("question", FieldType("string")),)),
        Message("demo_msgs/srv/Ask_Response"),
    )
    action = parse_definition("demo_msgs/action/Go", "Point to\n---\nbool ok\n---\n")
    assert isinstance(action, Action)
    assert action.goal.fields == (Field("to", FieldType("demo_msgs/msg/Point")),)
    assert action.result.field_names == ("ok",)
    assert action.feedback == Message("demo_msgs/action/Go_Feedback")


@pytest.mark.parametrize(
    ("line", "message_part"),
    [
        ("bool", "'bool' has no name behind the type"),
        ("bool On", "'On' is not a field name"),
        ("bool a__b", "'a__b' is not a field name"),
        ("bool a_", "'a_' is not a field name"),
        ("boolean on", "'boolean' is neither a primitive type nor a message"),
        ("time t", "'time' is neither a primitive type nor a message"),
        ("a/b/c/D d", "'a/b/c/D' is neither a primitive type nor a message"),
        ("int8[x] a", "'int8[x]' is not a type"),
        ("int8[0] a", "'int8[0]' has room for nothing"),
        ("int8<=5 a", "only strings can have a maximum length"),
        ("uint8 n 256", "256 is outside the range of uint8, 0 to 255"),
        ("int8 n 1.5", "'1.5' is not an integer"),
        ("float64 f nan", "'nan' is not a finite float64"),
        ("float64 f x", "'x' is not a number"),
        ("bool on yes", "'yes' is not a value of type bool"),
        ("string<=2 s abc", "3 characters do not fit string<=2"),
        ("string s 'it's'", "a ' within the text is written"),
        ("int8[2] a [1]", "1 values do not fit int8[2]"),
        ("int8[<=1] a [1, 2]", "2 values do not fit int8[<=1]"),
        ("int8[] a 1", "the default of an array is a list in brackets, not 1"),
        ("Other o 1", "a field of type demo_msgs/msg/Other has no default"),
        ("uint8 left=1", "'left' is not a constant's name"),
        ("uint8 LEFT=", "'' is not an integer"),
        ("uint8[] LEFT=1", "a constant has a primitive type"),
        ("bool a\nbool a", "'a' is defined twice"),
        ("---", "a .msg file has 0 lines with '---', not 1"),
    ],
)
def test_mistake_is_named_with_its_line(line: str, message_part: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_definition(NAME, f"# first\n{line}")
    assert caught.value.message.startswith(message_part)
    assert caught.value.line == line.count("\n") + 2


@pytest.mark.parametrize("line", ["--", "----", "\u2014", "==="])
def test_a_wrong_separator_is_reported_where_it_is(line: str) -> None:
    with pytest.raises(DefinitionError, match="where '---' is expected") as caught:
        parse_definition("demo_msgs/srv/Set", f"bool on\n{line}\nbool done\n")
    assert caught.value.line == 2


def test_other_names_are_not_interfaces() -> None:
    names = ("String", "std_msgs/String", "std_msgs/msg/", "/msg/A", "../msg/A", "a/idl/A")
    for name in (*names, "a/msg/a/b"):
        assert split_name(name) is None
        with pytest.raises(ValueError, match="is not the name of an interface"):
            parse_definition(name, "")


def test_without_comments_the_meaning_stays() -> None:
    text = "# head\nuint8   A = 1 # one\n\n---\n  string<=3   s  'ab'\n"
    bare = without_comments(text)
    assert bare == "uint8 A = 1\n---\nstring<=3 s  'ab'"
    name = "demo_msgs/srv/Ask"
    assert parse_definition(name, bare) == parse_definition(name, text)


LARGE: dict[str, Callable[[int], str]] = {
    "fields": lambda count: "".join(f"bool f{number}\n" for number in range(count)),
    "escaped quotes": lambda count: "string[] a [" + '\\"' * count + "]",
    "commas and quotes": lambda count: "string[] a [" + "',\"" * count + "]",
}


@pytest.mark.parametrize("text", LARGE.values(), ids=LARGE)
def test_large_definitions_take_linear_time(text: Callable[[int], str]) -> None:
    assert_linear(lambda count: message(text(count)), 500, 4000)


@pytest.mark.parametrize(
    "line", ["x" * 5000, "bool " + "X" * 5000, "int64 a " + "1" * 5000, "int64 A=0x" + "f" * 5000]
)
def test_messages_about_long_texts_are_short(line: str) -> None:
    with pytest.raises(DefinitionError) as raised:
        message(line)
    assert len(raised.value.message) < 200

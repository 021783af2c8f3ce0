"""The interfaces compared with the installed ones: parser, type descriptions and classes."""

from __future__ import annotations

import runpy
from importlib import import_module
from pathlib import Path
from typing import Any

from rosidl_adapter import parser as rosidl

from composer.interfaces import Action, Field, Interfaces, Message, Service, split_name
from composer.interfaces.sources import Bundle, installed_prefixes, read_description

PREFIXES = installed_prefixes()
INSTALLED = Interfaces(PREFIXES)
NAMES = [name for folder in ("msg", "srv", "action") for name in INSTALLED.names(folder)]
ROOT = Path(__file__).parents[3]


def parts(interface: Message | Service | Action | None) -> dict[str, Message]:
    """Return the messages an interface is made of, by the attribute rclpy has them under."""
    match interface:
        case Message():
            return {"": interface}
        case Service():
            return {"Request": interface.request, "Response": interface.response}
        case Action():
            return {
                "Goal": interface.goal,
                "Result": interface.result,
                "Feedback": interface.feedback,
            }
        case None:
            raise AssertionError


def path(name: str, suffix: str) -> Path:
    package, folder, type_name = split_name(name) or ("", "", "")
    candidates = [
        prefix.root / "share" / package / folder / f"{type_name}.{suffix or folder}"
        for prefix in PREFIXES
    ]
    return next(candidate for candidate in candidates if candidate.is_file())


def test_there_is_something_to_compare() -> None:
    assert len(NAMES) > 150


def test_the_snapshot_is_what_is_installed() -> None:
    bundle = Bundle()
    names = {name for folder in ("msg", "srv", "action") for name in bundle.names(folder)}
    packages = bundle.packages()  # others may be installed as well
    known = {name: definition.text for name in names if (definition := bundle.read(name))}
    tool = runpy.run_path(str(ROOT / "tools" / "bundle_interfaces.py"))
    definitions = tool["definitions"](known)
    assert names == {name for name in definitions if name.partition("/")[0] in packages}
    for name in names:
        definition = bundle.read(name)
        assert definition is not None
        assert definition.text == definitions[name], "run tools/bundle_interfaces.py"


def test_the_snapshot_says_the_same_as_the_installed_text() -> None:
    bundled = Interfaces([Bundle()])
    assert [name for name in NAMES if bundled.find(name) != INSTALLED.find(name)] == []


def test_text_and_type_description_say_the_same() -> None:
    for name in NAMES:
        described = parts(read_description(name, path(name, "json").read_text()))
        parsed = parts(INSTALLED.find(name))
        assert {key: part.fields for key, part in described.items()} == {
            key: part.fields for key, part in parsed.items()
        }, name


def rosidl_messages(name: str) -> list[Any]:
    """Return what ROS's own parser makes of a definition."""
    package, folder, _ = split_name(name) or ("", "", "")
    file = str(path(name, ""))
    if folder == "msg":
        return [rosidl.parse_message_file(package, file)]
    if folder == "srv":
        service = rosidl.parse_service_file(package, file)
        return [service.request, service.response]
    action = rosidl.parse_action_file(package, file)
    return [action.goal, action.result, action.feedback]


def shown(field: Field) -> tuple[str, str, object]:
    """Return a field as ROS's parser shows it."""
    type_name = field.type.name.replace("/msg/", "/")
    text = str(field.type).replace(field.type.name, type_name, 1)
    return field.name, text, field.default


def test_the_parser_agrees_with_that_of_ros() -> None:
    for name in NAMES:
        ours = list(parts(INSTALLED.find(name)).values())
        theirs = rosidl_messages(name)
        for our_part, their_part in zip(ours, theirs, strict=True):
            assert [shown(field) for field in our_part.fields] == [
                (field.name, str(field.type).replace("char", "uint8"), field.default_value)
                for field in their_part.fields
            ], name
            assert [(item.name, item.value) for item in our_part.constants] == [
                (item.name, item.value) for item in their_part.constants
            ], name


def test_the_generated_classes_have_the_same_fields() -> None:
    for name in NAMES:
        package, folder, type_name = split_name(name) or ("", "", "")
        generated = getattr(import_module(f"{package}.{folder}"), type_name)
        for key, part in parts(INSTALLED.find(name)).items():
            cls = getattr(generated, key) if key else generated
            declared = tuple(cls.get_fields_and_field_types())
            assert declared == part.field_names, (name, key)

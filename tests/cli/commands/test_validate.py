from __future__ import annotations

import io
import json
import os
from pathlib import Path

import pytest

from composer.language.schema import REPORT, SCHEMAS
from tests.cli.compose import compose, refused, write_files

FINE = "system: fine\nnodes:\n  one: {}\n"
BROKEN = """\
system: broken
nodes:
  first: {lifecycle: {depends_on: [secnd]}}
  second: {}
"""
TWISTED = """\
system: twisted
nodes:
  one: {publishers: {talk: {type: std_msgs/msg/String, topic: /talk, qos: sensor_data}}}
  two: {subscriptions: {talk: {type: std_msgs/msg/String, topic: /talk, qos: command}}}
"""


@pytest.fixture(autouse=True)
def fine_file(folder: Path) -> None:
    write_files({"fine.yaml": FINE})


def test_a_file_argument_is_always_checked() -> None:
    done = compose("validate", "fine.yaml")
    assert (done.code, done.out, done.err) == (0, "", "1 file checked: no problems found\n")
    write_files({"other.yaml": "services: {}\n"})
    done = compose("validate", "other.yaml")
    assert done.code == 1
    assert "other.yaml:1:1" in done.out


@pytest.mark.parametrize("paths", [[], ["."]])
def test_a_folder_is_searched_for_systems_and_node_types_only(paths: list[str]) -> None:
    write_files(
        {
            "nodes/camera.yaml": "node: camera\n",
            "fine.yaml": "system: fine\nnodes:\n  one: {type: camera}\n",
            ".github/workflow.yaml": "on: push\n",
            "compose.yaml": "services: {}\n",
        }
    )
    done = compose("validate", *paths)
    assert done.code == 0
    assert done.err == (
        "2 files checked: no problems found\n"
        "skipped, without 'system:', 'node:' or 'scenario:': compose.yaml\n"
    )


@pytest.mark.parametrize("is_absolute", [False, True])
def test_problems_of_a_shared_node_type_are_reported_once(folder: Path, is_absolute: bool) -> None:
    write_files({"nodes/odd.yaml": "node: odd\nports: {}\n"})
    for name in ("first", "second"):
        write_files({f"{name}.yaml": f"system: {name}\nnodes: {{one: {{type: odd}}}}\n"})
    done = compose("validate", "--format", "json", str(folder) if is_absolute else ".")
    files = [item["location"]["file"] for item in json.loads(done.out)["diagnostics"]]
    assert [file for file in files if file.endswith("odd.yaml")] == ["nodes/odd.yaml"]


def test_stdin_can_have_a_file_name(monkeypatch: pytest.MonkeyPatch) -> None:
    write_files({"robot/nodes/wheel.yaml": "node: wheel\n"})
    text = "system: robot\nnodes:\n  left: {type: wheel}\n  right: {type: whel}\n"
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    done = compose("validate", "-", "--stdin-name", "robot/unsaved.yaml")
    assert done.code == 1
    assert "robot/unsaved.yaml:4:17" in done.out
    assert "'whel'" in done.out
    assert "'wheel', which" not in done.out
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(BROKEN.encode())))
    assert "<stdin>:3:36" in compose("validate", "-").out


def test_arguments_are_given_as_to_run() -> None:
    arguments = "arguments: {far: {choices: [x, y]}}\n"
    write_files({"a.yaml": f"system: a\n{arguments}nodes:\n  one: {{if: far == 'y', typ: x}}\n"})
    assert compose("validate", "a.yaml", "far=x").code == 0
    assert compose("validate", "a.yaml", "far=y").code == 1
    assert "write far=y" in refused(2, "validate", "a.yaml", "far:=y")


def test_project_settings_apply() -> None:
    write_files(
        {
            "composer.yaml": "strict: true\nignore: [RC5]\nseverity: {RC231: info}\n",
            "deep.yaml": "system: deep\nnodes:\n  one: {namespace: a/b/c/d/e}\n",
        }
    )
    done = compose("validate", "deep.yaml")
    assert done.code == 0
    assert done.out.startswith("info[RC231 deep-namespace]")
    write_files({"composer.yaml": "strict: true\n"})
    assert compose("validate", "deep.yaml").code == 1
    relaxed = compose("validate", "deep.yaml", "--no-strict", "--format", "json")
    assert [item["severity"] for item in json.loads(relaxed.out)["diagnostics"]] == ["warning"]
    assert relaxed.code == 0
    Path("composer.yaml").unlink()
    assert compose("validate", "deep.yaml").code == 0
    assert compose("validate", "deep.yaml", "--strict").code == 1
    Path("empty").mkdir()
    assert compose("validate", "empty").code == 2


def test_wrong_settings_are_reported_once() -> None:
    write_files({"other.yaml": FINE, "composer.yaml": "ignore: [qos-implict]\nstrickt: true\n"})
    done = compose("validate", "fine.yaml", "other.yaml", "--format", "json")
    found = [
        (item["rule"], item["location"]["file"], item["location"]["line"], item["hint"])
        for item in json.loads(done.out)["diagnostics"]
    ]
    assert found == [
        ("bad-setting", "composer.yaml", 1, "did you mean 'qos-implicit'?"),
        ("unknown-key", "composer.yaml", 2, "did you mean 'strict'?"),
    ]


@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("nothing.yaml", ""),
        ("fin.yaml", "did you mean 'fine.yaml'?"),
        ("fine", "did you mean 'fine.yaml'?"),
        ("sytems", "did you mean 'systems'?"),
        ("sytems/robt.yaml", "did you mean 'systems/robot.yaml'?"),
        ("robot", "did you mean 'systems/robot.yaml'?"),  # not the example system of that name
        ("pipeline", "/pipeline.yaml'?"),  # the example system
    ],
)
def test_a_path_that_does_not_exist_is_a_usage_error(written: str, hint: str) -> None:
    write_files({"systems/robot.yaml": FINE})
    message = refused(2, "validate", written)
    assert message.startswith(f"compose: there is no file or folder '{written}'\n")
    assert message.endswith(f"{hint}\n")
    if written.endswith(".yaml"):
        assert hint in compose("run", "--dry-run", written).err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_unreadable_files_are_reported() -> None:
    Path("secret").mkdir(mode=0)
    Path("other.yaml").touch(mode=0)
    done = compose("validate", ".")
    assert done.code == 1
    assert "this folder cannot be read: Permission denied\n --> secret:1:1" in done.out
    assert "this file cannot be read: Permission denied\n --> other.yaml:1:1" in done.out
    for command in ("validate", "run", "config"):
        done = compose(command, "secret/robot.yaml")
        assert "Permission denied" in done.out + done.err


def test_an_invalid_interface_definition_is_reported_with_its_location() -> None:
    definition = "interfaces/arm/msg/Grip.msg"
    port = "{type: arm/msg/Grip, qos: command, external: true}"
    write_files(
        {
            definition: "# How firm.\nflaot64 force\n",
            "interfaces/arm/package.xml": "<package><name>arm</name></package>",
            "composer.yaml": "interfaces: [interfaces]\n",
            "arm.yaml": f"system: arm\nnodes: {{arm: {{subscriptions: {{a: {port}}}}}}}\n",
        }
    )
    for done in (compose("validate", "arm.yaml"), compose("interface", "show", "arm/msg/Grip")):
        assert done.code == 1
        text = done.out + done.err
        assert "the definition of 'arm/msg/Grip' cannot be read: 'flaot64' is" in text
        assert f"{definition}:2" in text


def test_rules_can_be_selected_and_ignored() -> None:
    write_files({"twisted.yaml": TWISTED})
    (found,) = json.loads(compose("validate", "twisted.yaml", "--format", "json").out)[
        "diagnostics"
    ]
    assert found["rule"] == "qos-incompatible"
    for rule in (found["code"], found["code"][:3], found["rule"]):
        assert compose("validate", "twisted.yaml", "--select", rule).code == 1
        assert compose("validate", "twisted.yaml", "--ignore", rule).code == 0
    assert compose("validate", "twisted.yaml", "--select", "RC0").code == 0
    message = refused(2, "validate", "fine.yaml", "--ignore", "unknown-nod")
    assert message == "compose: no rule is named 'unknown-nod'\n  did you mean 'unknown-node'?\n"


def test_the_environment_selects_the_format_and_colors(monkeypatch: pytest.MonkeyPatch) -> None:
    write_files({"broken.yaml": BROKEN})
    log = json.loads(compose("validate", "broken.yaml", "-f", "sarif").out)
    assert log["version"] == "2.1.0"
    assert len(log["runs"][0]["results"]) == 1
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    assert compose("validate", "broken.yaml").out.startswith("::error file=broken.yaml,line=3")
    assert compose("validate", "broken.yaml", "--format", "text").out.startswith("error[")
    monkeypatch.delenv("GITHUB_ACTIONS")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    assert "\x1b[" not in compose("validate", "broken.yaml").out
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert "\x1b[" in compose("validate", "broken.yaml").out
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[" not in compose("validate", "broken.yaml").out


@pytest.mark.parametrize(
    ("options", "shown"),
    [((), 200), (("--max-diagnostics", "7"), 7), (("--max-diagnostics", "0"), 0)],
)
def test_text_has_a_maximum_of_diagnostics(options: tuple[str, ...], shown: int) -> None:
    write_files({"repeated.yaml": "system: a\nnodes: {b: {}}\n" + "nodes: {}\n" * 300})
    done = compose("validate", "repeated.yaml", *options)
    assert done.code == 1
    assert done.out.count("error[RC011 ") == (shown or 300)
    assert done.out.endswith(
        f"found 300 errors; showing {shown} of 300\n" if shown else "found 300 errors\n"
    )
    assert ("use --max-diagnostics 0" in done.err) == bool(shown)
    done = compose("validate", "repeated.yaml", *options, "--format", "json")
    assert len(json.loads(done.out)["diagnostics"]) == 300


def test_rules_are_explained_by_code_or_name_and_listed_by_prefix() -> None:
    for name in ("RC202", "rc202", "unknown-node"):
        done = compose("validate", "--explain", name)
        assert done.code == 0
        assert done.out.startswith("RC202 unknown-node (error)\n")
        assert "Use instead" in done.out
    lines = compose("validate", "--explain", "RC").out.splitlines()
    assert ["RC202", "error", "unknown-node"] in [line.split() for line in lines]
    assert lines == sorted(lines)
    some = compose("validate", "--explain", "rc32").out.splitlines()
    assert some == [line for line in lines if line.startswith("RC32")]


@pytest.mark.parametrize("name", [*SCHEMAS, REPORT])
def test_a_schema_is_printed_as_json(name: str) -> None:
    content = json.loads(compose("export", "schema", name).out)
    assert "draft-07" in content["$schema"]

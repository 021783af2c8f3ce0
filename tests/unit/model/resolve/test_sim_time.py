"""``use_sim_time``: where it may be set, and what takes precedence."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.language.tree import Plain
from composer.loading import load
from composer.model import USE_SIM_TIME, System
from composer.model.resolve import OverrideOptions

TYPE = """\
node: typed
parameters: {use_sim_time: {type: bool, default: false}}
"""
PLAIN_TYPE = "node: plain\n"


def loaded(folder: Path, text: str, overrides: OverrideOptions, **files: str) -> System:
    (folder / "nodes").mkdir(exist_ok=True)
    (folder / "composer.yaml").write_text("{}\n", encoding="utf-8")
    (folder / "nodes" / "typed.yaml").write_text(TYPE, encoding="utf-8")
    (folder / "nodes" / "plain.yaml").write_text(PLAIN_TYPE, encoding="utf-8")
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(content, encoding="utf-8")
    path = folder / "system.yaml"
    path.write_text(text, encoding="utf-8")
    loading = load(path, overrides=overrides)
    assert [item.message for item in loading.diagnostics] == []
    assert loading.system is not None
    return loading.system


def values(folder: Path, text: str, *settings: str, option: bool = False, **files: str) -> object:
    """Return what the parameter is for each node; None where it has no value."""
    system = loaded(folder, text, OverrideOptions(settings, use_sim_time=option), **files)
    return {node.name.value: value(system, node.name.value) for node in system.nodes}


def value(system: System, name: str) -> Plain:
    node = system.node(name)
    assert node is not None
    parameter = node.parameter(USE_SIM_TIME)
    if parameter is None:
        return None
    assert (parameter.type.value, parameter.value is not None) == ("bool", True)
    return parameter.value.value if parameter.value is not None else None


def test_any_node_may_say_it_though_its_type_does_not_declare_it(tmp_path: Path) -> None:
    text = """\
system: s
nodes:
  inline: {parameters: {use_sim_time: true}}
  other: {type: plain, parameters: {use_sim_time: true}}
"""
    assert values(tmp_path, text) == {"inline": True, "other": True}


NODES = """\
nodes:
  silent: {}
  of_type: {type: typed}
  own: {parameters: {use_sim_time: false}}
  given: {type: plain, parameters: {use_sim_time: false}}
"""
OF_ALL = {"silent": True, "of_type": True, "own": False, "given": False}


def test_the_system_says_it_for_all_that_say_nothing(tmp_path: Path) -> None:
    text = f"system: s\nuse_sim_time: true\n{NODES}"
    assert values(tmp_path, text) == OF_ALL
    assert loaded(tmp_path, text, OverrideOptions()).use_sim_time


def test_the_command_line_says_the_same(tmp_path: Path) -> None:
    text = f"system: s\nuse_sim_time: false\n{NODES}"
    assert values(tmp_path, text, option=True) == OF_ALL
    assert loaded(tmp_path, text, OverrideOptions(use_sim_time=True)).use_sim_time
    assert not loaded(tmp_path, text, OverrideOptions()).use_sim_time


def test_a_setting_overrides_everything(tmp_path: Path) -> None:
    text = f"system: s\nuse_sim_time: true\n{NODES}"
    found = values(tmp_path, text, "silent.use_sim_time=false", "given.use_sim_time=true")
    assert found == OF_ALL | {"silent": False, "given": True}


@pytest.mark.parametrize("section", ["/silent", "/**", "/*"])
def test_a_parameter_file_may_say_it_for_one_or_all(tmp_path: Path, section: str) -> None:
    content = f"{section}: {{ros__parameters: {{use_sim_time: true}}}}\n"
    text = "system: s\nparameter_files: [all.yaml]\nnodes: {silent: {}, other: {type: plain}}\n"
    others = None if section == "/silent" else True
    assert values(tmp_path, text, all=content) == {"silent": True, "other": others}


def test_what_an_included_file_says_holds_for_its_own_nodes(tmp_path: Path) -> None:
    robot = f"system: robot\nuse_sim_time: true\n{NODES}"
    text = "system: s\ninclude: [robot.yaml]\nnodes: {outside: {}}\n"
    assert values(tmp_path, text, robot=robot) == OF_ALL | {"outside": None}
    assert not loaded(tmp_path, text, OverrideOptions(), robot=robot).use_sim_time

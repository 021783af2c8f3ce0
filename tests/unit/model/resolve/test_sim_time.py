"""``use_sim_time``: where it may be set, and what takes precedence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from composer.language.tree import Plain
from composer.model import USE_SIM_TIME, System
from composer.model.resolve import OverrideOptions
from tests.unit.support.checking import valid_system

FILES = {
    "composer.yaml": "{}\n",
    "nodes/typed.yaml": "node: typed\nparameters: {use_sim_time: {type: bool, default: false}}\n",
    "nodes/plain.yaml": "node: plain\n",
}


def loaded(
    folder: Path,
    text: str,
    *settings: str,
    option: bool = False,
    files: Mapping[str, str] | None = None,
) -> System:
    overrides = OverrideOptions(settings, use_sim_time=option)
    all_files = {"system.yaml": text, **FILES, **(files or {})}
    return valid_system(folder, all_files, overrides=overrides)


def values(system: System) -> dict[str, Plain]:
    """Return the value of the parameter for each node; None where it has no value."""
    found = {node.name.value: node.parameter(USE_SIM_TIME) for node in system.nodes}
    assert {item.type.value for item in found.values() if item} == {"bool"}
    return {name: item and item.value.value for name, item in found.items()}


NODES = """\
nodes:
  silent: {}
  of_type: {type: typed}
  own: {parameters: {use_sim_time: false}}
  given: {type: plain, parameters: {use_sim_time: false}}
"""
OF_ALL = {"silent": True, "of_type": True, "own": False, "given": False}


@pytest.mark.parametrize(
    ("text", "option", "expected"),
    [
        # Any node may set it, though its type does not declare it.
        (
            "nodes:\n  a: {parameters: {use_sim_time: true}}\n"
            "  b: {type: plain, parameters: {use_sim_time: true}}\n",
            False,
            {"a": True, "b": True},
        ),
        (f"use_sim_time: true\n{NODES}", False, OF_ALL),
        (f"use_sim_time: false\n{NODES}", True, OF_ALL),
    ],
    ids=["nodes", "the system", "the command line"],
)
def test_a_node_is_before_the_system(
    text: str, option: bool, expected: dict[str, bool], tmp_path: Path
) -> None:
    system = loaded(tmp_path, f"system: s\n{text}", option=option)
    assert values(system) == expected
    assert system.use_sim_time is (expected is OF_ALL)


def test_a_setting_overrides_everything(tmp_path: Path) -> None:
    settings = ("silent.use_sim_time=false", "given.use_sim_time=true")
    system = loaded(tmp_path, f"system: s\nuse_sim_time: true\n{NODES}", *settings)
    assert values(system) == OF_ALL | {"silent": False, "given": True}


@pytest.mark.parametrize(("section", "others"), [("/silent", None), ("/**", True), ("/*", True)])
def test_a_parameter_file_may_set_it_for_one_or_all(
    section: str, others: bool | None, tmp_path: Path
) -> None:
    content = f"{section}: {{ros__parameters: {{use_sim_time: true}}}}\n"
    text = "system: s\nparameter_files: [all.yaml]\nnodes: {silent: {}, other: {type: plain}}\n"
    system = loaded(tmp_path, text, files={"all.yaml": content})
    assert values(system) == {"silent": True, "other": others}


def test_an_included_file_sets_it_for_its_own_nodes(tmp_path: Path) -> None:
    robot = f"system: robot\nuse_sim_time: true\n{NODES}"
    text = "system: s\ninclude: [robot.yaml]\nnodes: {outside: {}}\n"
    system = loaded(tmp_path, text, files={"robot.yaml": robot})
    assert values(system) == OF_ALL | {"outside": None}
    assert not system.use_sim_time

"""Inputs of every kind, and the checks that each must pass whatever it contains.

The property tests take a few examples of each; ``make fuzz`` takes new ones until its time is over.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from hypothesis import strategies as st

from composer.base.diagnostics import in_order, registered_rules
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.interfaces import Interfaces
from composer.interfaces.sources import Bundle, Definition
from composer.language.document import parse_bytes
from composer.loading import load_bytes
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
from composer.project.settings import SettingsSource, check_rule_settings, read_settings
from tests.properties.mutation import mutated, spliced
from tests.properties.validating import (
    INTERFACES,
    ROOT,
    SCENARIOS,
    SHIPPED,
    check_diagnostics,
    contents,
    validate_and_check,
)

CONTENTS = contents()
TEXTS = [path.read_text(encoding="utf-8") for path in (*SHIPPED, *SCENARIOS)]
SETTINGS = [
    "nodes: [nodes]\ninterfaces: [interfaces, more]\nstrict: true\n"
    "select: [RC3]\nignore: [qos-implicit, RC412]\n"
    "severity: {publisher-without-subscription: warning}\n",
]
DEFINITIONS = [
    path.read_text(encoding="utf-8") for path in sorted((ROOT / "interfaces").glob("*/*.*"))
] + [
    'int8 ONE=1\nstring<=5[<=3] a [\'x\', "y\\""]\nuint8[2] b [1, 0x2]\nfloat32 f -1e3\n'
    "std_msgs/Header header # a comment\n---\nOther[] others\nwstring w 'it\\'s'\n",
]
#: Small, so that a mutation often concerns a name.
DRAWN = [
    {
        "system": "small",
        "nodes": {
            "talker": {
                "namespace": "left",
                "publishers": {"out": {"type": "std_msgs/msg/String", "topic": "/chatter"}},
                "timers": {"tick": {"rate_hz": 1, "publish": {"out": {"data": "hello"}}}},
            },
            "listener": {
                "subscriptions": {"input": {"type": "std_msgs/msg/String", "topic": "/chatter"}},
                "lifecycle": {"depends_on": ["talker"]},
            },
        },
    },
    {"system": "smaller", "nodes": {"one": {"services": {"ask": {"type": "std_srvs/srv/Empty"}}}}},
]
PARAMETER_FILES = [
    """\
/**:
  ros__parameters:
    use_sim_time: true
/robot/driver:
  ros__parameters:
    rate_hz: 10.0
    limits: {low: -1, names: [a, b], flags: [true, false]}
"driver":
  ros__parameters: {gains: [1.0, 2.0], "camera.fps": 30}
""",
]


@dataclass(frozen=True, slots=True)
class Surface:
    """A kind of input: examples, and the check."""

    inputs: st.SearchStrategy[bytes]
    check: Callable[[bytes], object]


class _InMemory:
    """A source with one definition of each kind, for :class:`Interfaces`."""

    def __init__(self, text: str) -> None:
        self.text = text

    def packages(self) -> frozenset[str]:
        return frozenset({"demo_msgs"})

    def names(self, folder: str) -> Iterator[str]:
        yield f"demo_msgs/{folder}/Demo"

    def read(self, name: str) -> Definition | None:
        return Definition(self.text, "Demo.msg") if name.startswith("demo_msgs/") else None


def _check_definition(data: bytes) -> None:
    interfaces = Interfaces([_InMemory(data.decode(errors="replace")), Bundle()])
    for folder in ("msg", "srv", "action"):
        name = f"demo_msgs/{folder}/Demo"
        problem = interfaces.problem(name)
        assert (problem is None) == (interfaces.find(name) is not None)
        if problem is not None:
            assert 1 <= problem.line <= len(data.splitlines()) + 1
            assert len(str(problem)) < 1000
            assert str(problem).isprintable()


def _check_settings(data: bytes) -> None:
    tree, source, diagnostics = parse_bytes(data, "composer.yaml")
    settings, found = read_settings(SettingsSource(ROOT, source, tree, ()))
    found += check_rule_settings(settings, tuple(registered_rules()))
    check_diagnostics(in_order([*diagnostics, *found]))


def _check_parameter_file(data: bytes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".yaml") as file:
        file.write(data)
        file.flush()
        files = ParameterFiles()
        check_diagnostics(in_order(read_parameter_file(Path(file.name), files)))
        files.given("/robot/driver", frozenset({"rate_hz"}))


def _check_graph(data: bytes) -> None:
    loading = load_bytes(data, ROOT, shown="systems/it.yaml", interfaces=INTERFACES)
    if loading.system is None or loading.system.node_type:
        return
    scene = scene_of([loading.system], loading.diagnostics)
    graphs = [build_graph(scene, view) for view in View]
    for number in range(len(graphs)):
        ElementTree.fromstring(render(graphs, Format.SVG, number))
        json.loads(render(graphs, Format.JSON, shown=number))
        assert render(graphs, Format.MERMAID, shown=number).decode().endswith("\n")
    assert render(graphs, Format.HTML).startswith(b"<!DOCTYPE html>")


def _mutations(some: list[Any]) -> st.SearchStrategy[bytes]:
    return st.sampled_from(some).flatmap(mutated).map(lambda value: json.dumps(value).encode())


_MUTATED = _mutations(CONTENTS)
SURFACES = {
    "values": Surface(_MUTATED, validate_and_check),
    "lines": Surface(spliced(TEXTS).map(str.encode), validate_and_check),
    "settings": Surface(spliced(SETTINGS).map(str.encode), _check_settings),
    "definitions": Surface(spliced(DEFINITIONS).map(str.encode), _check_definition),
    "parameter files": Surface(spliced(PARAMETER_FILES).map(str.encode), _check_parameter_file),
    "graphs": Surface(_mutations(DRAWN) | _MUTATED, _check_graph),
}

"""What a behavior is loaded from and what it gets."""

from __future__ import annotations

import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from composer.base.source import Located, SourceFile, Span
from composer.model import BehaviorReference
from composer.runtime.executors.tracebacks import report_of
from composer.runtime.node.behavior_loader import ParameterValues, behavior_class

SPAN = Span(SourceFile("system.yaml", ""), 1, 1, 1)


def reference(name: str, *folders: Path) -> BehaviorReference:
    """Return a reference to a class in the first folder, or in the folders of node types."""
    return BehaviorReference(Located(name, SPAN), folders[0], folders[1:])


def test_threads_that_import_a_module_at_the_same_time_share_it(tmp_path: Path) -> None:
    module = "import time\ntime.sleep(0.1)\nclass Late:\n    pass\n"
    tmp_path.joinpath("late.py").write_text(module, encoding="utf-8")
    with ThreadPoolExecutor(4) as threads:
        classes = list(threads.map(behavior_class, [reference("late:Late", tmp_path)] * 4))
    assert len(set(classes)) == 1


def test_parameters_are_read_only_attributes_and_follow_changes() -> None:
    values: dict[str, Any] = {"max_velocity": 1.0, "a.b": 2}
    parameters = ParameterValues(values)
    assert (parameters.max_velocity, parameters["a.b"]) == (1.0, 2)
    values.update(max_velocity=0.5)
    assert parameters.max_velocity == 0.5
    assert dir(parameters) == ["a.b", "max_velocity"]
    with pytest.raises(AttributeError, match="no parameter 'velocity'; available: "):
        _ = parameters.velocity
    with pytest.raises(AttributeError, match="'max_velocity' cannot be assigned"):
        parameters.max_velocity = 2.0
    with pytest.raises(AttributeError, match="'max_velocity' cannot be deleted"):
        del parameters.max_velocity
    assert values == {"max_velocity": 0.5, "a.b": 2}


def test_a_behavior_does_not_shadow_the_standard_library(tmp_path: Path) -> None:
    tmp_path.joinpath("signal.py").write_text("class Light:\n    pass\n", encoding="utf-8")
    before = list(sys.path)
    found = behavior_class(reference("signal:Light", tmp_path))
    assert found.__name__ == "Light"
    assert sys.modules["signal"] is signal
    assert sys.path == before


def test_an_exception_of_a_behavior_is_reported_under_the_name_of_its_module(
    tmp_path: Path,
) -> None:
    module = (
        "class Jam(Exception): ...\nclass Arm:\n    def move(self):\n        raise Jam('wrist')\n"
    )
    tmp_path.joinpath("arm.py").write_text(module, encoding="utf-8")
    found = behavior_class(reference("arm:Arm", tmp_path))
    with pytest.raises(Exception, match="wrist") as caught:
        found().move()
    assert report_of(caught.value).splitlines()[-1] == "arm.Jam: wrist"


HELPED = """\
from importlib import import_module

import helper
import tools.geometry
from helper import text as shown
from tools import geometry as g
from tools.units import METERS


class Planner:
    def on_tick(self):
        from late import LATE

        by_name = import_module("helper"), import_module("tools.units")
        assert by_name == (helper, tools.units)
        return helper.NAME, tools.geometry.AREA, g.AREA, METERS, shown(), LATE, helper.signal
"""


#: Of these, other tests may have imported their own, such as the project's ``tools``.
LOCAL_MODULES = {"helper", "late", "tools", "planner"}


def test_modules_next_to_a_behavior_are_imported_for_it_alone(tmp_path: Path) -> None:
    for folder in ("first", "second"):
        files = {
            "planner.py": HELPED,
            "helper.py": f"import signal\nimport late\nNAME = '{folder}'\ntext = lambda: NAME\n",
            "late.py": f"LATE = '{folder}'\n",
            "signal.py": "raise ImportError('not the one of the standard library')\n",
            "tools/__init__.py": "",
            "tools/geometry.py": "from .units import METERS\nAREA = METERS * 2\n",
            "tools/units.py": "METERS = 3\n",
        }
        for path, text in files.items():
            file = tmp_path / folder / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
    before = list(sys.path), set(sys.modules) & LOCAL_MODULES
    for name in ("first", "second"):
        planner = behavior_class(reference("planner:Planner", tmp_path / name))()
        assert planner.on_tick() == (name, 6, 6, 3, name, name, signal)
    assert (list(sys.path), set(sys.modules) & LOCAL_MODULES) == before


def test_a_behavior_and_its_helpers_share_the_modules_of_the_node_types(tmp_path: Path) -> None:
    nodes = tmp_path / "nodes"
    (nodes / "drivers").mkdir(parents=True)
    (nodes / "drivers" / "__init__.py").touch()
    (tmp_path / "systems").mkdir()
    (nodes / "drivers" / "camera.py").write_text(
        "from base import Base\nimport lens\nclass Camera(Base):\n    LENS = lens\n"
    )
    (nodes / "drivers" / "lens.py").write_text("from drivers import camera\n")
    (nodes / "base.py").write_text("class Base:\n    pass\n")
    (tmp_path / "systems" / "own.py").write_text(
        "from base import Base\nclass Own(Base):\n    pass\n"
    )
    folders = (tmp_path / "systems", nodes)
    camera: Any = behavior_class(reference("drivers.camera:Camera", *folders))
    own = behavior_class(reference("own:Own", *folders))
    assert camera.__mro__[1] is own.__mro__[1]
    assert camera.LENS.camera.Camera is camera


def test_a_module_that_cannot_be_imported_is_named(tmp_path: Path) -> None:
    (tmp_path / "planner.py").write_text("import nothing_of_that_name\nclass Planner: pass\n")
    planner = reference("planner:Planner", tmp_path)
    with pytest.raises(ModuleNotFoundError, match="No module named 'nothing_of_that_name'"):
        behavior_class(planner)
    (tmp_path / "planner.py").write_text("class Planner: pass\n")
    assert behavior_class(planner).__name__ == "Planner"

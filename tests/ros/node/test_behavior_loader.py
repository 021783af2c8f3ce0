"""What a behavior is loaded from and what it gets."""

from __future__ import annotations

import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from composer.model import BehaviorReference
from composer.runtime.node.behavior_loader import behavior_class
from composer.runtime.node.parameters import ParameterValues
from composer.source import Located, SourceFile, Span


def test_threads_that_import_a_module_at_the_same_time_share_it(tmp_path: Path) -> None:
    module = "import time\ntime.sleep(0.1)\nclass Late:\n    pass\n"
    tmp_path.joinpath("late.py").write_text(module, encoding="utf-8")
    span = Span(SourceFile("system.yaml", ""), 1, 1, 1)
    reference = BehaviorReference(Located("late:Late", span), tmp_path)
    with ThreadPoolExecutor(4) as threads:
        classes = list(threads.map(lambda _: behavior_class(reference), range(4)))
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
    span = Span(SourceFile("system.yaml", ""), 1, 1, 1)
    before = list(sys.path)
    found = behavior_class(BehaviorReference(Located("signal:Light", span), tmp_path))
    assert found.__name__ == "Light"
    assert sys.modules["signal"] is signal
    assert sys.path == before

"""A behavior's file is imported once, even by several threads at the same time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from composer.model import BehaviorReference
from composer.runtime.node.behavior_loader import behavior_class
from composer.source import Located, SourceFile, Span


def test_threads_that_import_a_module_at_the_same_time_share_it(tmp_path: Path) -> None:
    module = "import time\ntime.sleep(0.1)\nclass Late:\n    pass\n"
    tmp_path.joinpath("late.py").write_text(module, encoding="utf-8")
    span = Span(SourceFile("system.yaml", ""), 1, 1, 1)
    reference = BehaviorReference(Located("late:Late", span), tmp_path)
    with ThreadPoolExecutor(4) as threads:
        classes = list(threads.map(lambda _: behavior_class(reference), range(4)))
    assert len(set(classes)) == 1

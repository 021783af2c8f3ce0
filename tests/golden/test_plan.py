"""The plans of the example systems, with ``plan/<system>.txt`` as expected output."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.resources import systems_folder
from composer.loading import load
from composer.plan import bring_up, tear_down

EXPECTED = Path(__file__).parent / "plan"


SYSTEMS = sorted(systems_folder().glob("*.yaml"))


@pytest.mark.parametrize("path", SYSTEMS, ids=[path.stem for path in SYSTEMS])
def test_plan(path: Path) -> None:
    system = load(path).system
    assert system is not None
    printed = f"# up\n{bring_up(system)}\n# down\n{tear_down(system)}\n"
    assert printed == (EXPECTED / f"{path.stem}.txt").read_text(encoding="utf-8")


def test_every_expected_plan_belongs_to_a_system() -> None:
    expected = {path.stem for path in EXPECTED.glob("*.txt")}
    assert expected == {path.stem for path in SYSTEMS}

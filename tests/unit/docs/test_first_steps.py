"""What a new user does first works with what was installed until then."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.loading import load
from composer.model.interface_packages import NOT_IN_WHEELS, used_packages

ROOT = Path(__file__).parents[3]


def test_make_run_builds_the_interfaces_of_the_examples() -> None:
    built = re.search(
        r"^UNPUBLISHED := (.+)$", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE
    )
    assert built is not None
    needed: set[str] = set()
    for path in (ROOT / "systems").glob("*.yaml"):
        system = load(path).system
        assert system is not None, path
        needed |= used_packages(system).keys() & NOT_IN_WHEELS
    assert "tf2_msgs" in needed
    assert needed <= {"composer_interfaces", *built[1].split()}


@pytest.mark.parametrize(
    "path",
    ["docs/guides/projects.md", "composer/bridges/templates/project/README.md.in"],
)
def test_pytest_is_installed_before_it_runs(path: str) -> None:
    text = (ROOT / path).read_text("utf-8")
    assert -1 < text.find("pip install pytest") < text.find("python -m pytest")

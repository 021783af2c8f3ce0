"""The pinned environments fit the ranges in pyproject.toml, and every package has hashes."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[3]
ENVIRONMENTS = runpy.run_path(str(ROOT / "tools" / "pin_requirements.py"))["environments"]()
_PIN = re.compile(r"^(?P<name>[\w.-]+)==(?P<version>[^\s;\\]+)", re.MULTILINE)


def ranges(extras: list[str]) -> list[Requirement]:
    """Return the dependencies of the project with these extras, extras of extras included."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = [Requirement(text) for text in project["dependencies"]]
    for extra in extras:
        for text in project["optional-dependencies"][extra]:
            requirement = Requirement(text)
            own = requirement.name == project["name"]
            found += ranges(sorted(requirement.extras)) if own else [requirement]
    return found


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_pins_fit(name: str) -> None:
    extras, others = ENVIRONMENTS[name]
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    pins: dict[str, list[str]] = {}
    for match in _PIN.finditer(text):
        pins.setdefault(canonicalize_name(match["name"]), []).append(match["version"])

    for requirement in [*(ranges(extras) if extras else []), *map(Requirement, others)]:
        versions = pins[canonicalize_name(requirement.name)]
        assert all(requirement.specifier.contains(version) for version in versions), requirement


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_every_pin_has_hashes_and_nothing_else(name: str) -> None:
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    for block in re.split(r"\n(?=\S)", re.sub(r"^ *#.*\n", "", text, flags=re.MULTILINE)):
        assert _PIN.match(block), block
        assert " --hash=sha256:" in block
    assert "://" not in text

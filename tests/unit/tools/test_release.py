"""What a release consists of: its notes, pinned packages and actions, and a supported Python."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[3]
TOOLS = ROOT / "tools"
ENVIRONMENTS = runpy.run_path(str(TOOLS / "pin_requirements.py"))["environments"]()
WORKFLOWS = [ROOT / "action.yml", *sorted((ROOT / ".github" / "workflows").glob("*.yml"))]
CHANGELOG = """# Changelog

## [Unreleased]

- Not yet.

## [0.2.0] - 2026-05-01

### Added

- Second.

## [0.1.0] - 2026-04-01

- First.

[0.1.0]: https://example.org
"""
_PIN = re.compile(r"^(?P<name>[\w.-]+)==(?P<version>[^\s;\\]+)", re.MULTILINE)
#: At a commit, with the version in a comment for readers and Dependabot.
_PINNED_ACTION = re.compile(r"[\w-]+/[\w.-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")


@pytest.mark.parametrize(
    ("version", "notes"),
    [("0.2.0", "### Added\n\n- Second."), ("0.1.0", "- First."), ("0.3.0", None)],
)
def test_the_notes_of_a_release_are_its_section_of_the_changelog(
    version: str, notes: str | None
) -> None:
    section = runpy.run_path(str(TOOLS / "release_notes.py"))["section"]
    assert section(CHANGELOG, version) == notes


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
def test_pins_fit_and_have_hashes(name: str) -> None:
    extras, others = ENVIRONMENTS[name]
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    pins: dict[str, list[str]] = {}
    for match in _PIN.finditer(text):
        pins.setdefault(canonicalize_name(match["name"]), []).append(match["version"])
    for requirement in [*(ranges(extras) if extras else []), *map(Requirement, others)]:
        versions = pins[canonicalize_name(requirement.name)]
        assert all(requirement.specifier.contains(version) for version in versions), requirement
    for block in re.split(r"\n(?=\S)", re.sub(r"^ *#.*\n", "", text, flags=re.MULTILINE)):
        assert _PIN.match(block), block
        assert " --hash=sha256:" in block
    assert "://" not in text


@pytest.mark.parametrize("file", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned(file: Path) -> None:
    used = re.findall(r"^\s*- uses: (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    assert [item for item in used if item != "./" and not _PINNED_ACTION.fullmatch(item)] == []


def test_missing_requirements_are_reported_with_what_to_do() -> None:
    tool = runpy.run_path(str(TOOLS / "create_environment.py"))
    python_problem, platform_problem = tool["python_problem"], tool["platform_problem"]
    for version in ((3, 11, 0), (3, 12, 7), (3, 14, 1)):
        assert python_problem(version, []) is None
    assert python_problem((3, 10, 13), [(3, 12), (3, 13)]) == (
        "Python 3.11 to 3.14 is required, but this is Python 3.10; run: make run PYTHON=python3.12"
    )
    assert python_problem((3, 15, 0), []) == (
        "Python 3.11 to 3.14 is required, but this is Python 3.15; "
        "install one and run: make run PYTHON=/path/to/python"
    )
    assert platform_problem("Linux", "x86_64") is None
    assert "not for Linux aarch64" in platform_problem("Linux", "aarch64")
    assert tool["compiler_problem"](True) is None
    assert tool["compiler_problem"](False).endswith("sudo apt install g++")

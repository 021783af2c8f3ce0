"""The guides are complete, their examples are valid, and what they name exists."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import composer
from composer import behavior
from composer.loading import load_files, load_models
from composer.model.interface_packages import NOT_IN_WHEELS, used_packages
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
from tests.unit.support.checking import write_files

ROOT = Path(__file__).parents[3]
#: The package as it is installed: the tests of a wheel have no other.
PACKAGE = Path(composer.__file__).parent
CLASSES = [
    item
    for name, item in vars(behavior).items()
    if inspect.isclass(item) and item.__module__ == behavior.__name__
]


def text_of(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize("item", CLASSES, ids=lambda item: item.__name__)
def test_the_guide_to_behaviors_documents_exceptions_attributes_and_methods(item: type) -> None:
    text = text_of("docs/guides/behaviors.md")
    if issubclass(item, Exception):
        assert f"`{item.__name__}`" in text
        return
    names = vars(item) if item is not behavior.Behavior else behavior.Behavior.__annotations__
    public = [name for name in names if not name.startswith("_")]
    assert [name for name in public if f"{name}" not in text] == []


#: The files in the guide to composing systems, and the beginnings that it leaves out.
PARAMETERS = "config/robot.yaml"
COMPOSING = {
    "fleet.yaml": "",
    "robot.yaml": "",
    PARAMETERS: "",
    "changed.yaml": "system: changed\nexecutors: {slow: {}}\n",
    "cameras.yaml": "",
    "mapping.yaml": "",
    "nodes/slow_planner.yaml": "",
}


def test_the_files_in_the_guide_to_composing_are_valid(tmp_path: Path) -> None:
    blocks = re.findall(r"```yaml\n(.*?)```", text_of("docs/guides/composing.md"), re.DOTALL)
    parts = zip(COMPOSING.items(), blocks, strict=True)
    write_files(tmp_path, {name: head + block for (name, head), block in parts})
    for name in COMPOSING.keys() - {PARAMETERS}:
        [result] = load_files([tmp_path / name])
        assert [item.message for item in result.diagnostics] == [], name
    files = ParameterFiles()
    assert read_parameter_file(tmp_path / PARAMETERS, files) == []
    assert [section.name.value for section in files.sections] == ["/**", "/alpha/planner"]


def test_make_run_builds_the_interfaces_of_the_examples() -> None:
    built = re.search(r"^UNPUBLISHED := (.+)$", text_of("Makefile"), re.MULTILINE)
    assert built is not None
    needed: set[str] = set()
    for loading in load_models((ROOT / "systems").glob("*.yaml")):
        assert loading.system is not None, loading.source.path
        needed |= used_packages(loading.system).keys() & NOT_IN_WHEELS
    assert "tf2_msgs" in needed
    assert needed <= {"composer_interfaces", *built[1].split()}


@pytest.mark.parametrize(
    "path", ["docs/guides/projects.md", "composer/bridges/templates/project/README.md.in"]
)
def test_pytest_is_installed_before_it_runs(path: str) -> None:
    text = text_of(path)
    assert -1 < text.find("pip install pytest") < text.find("python -m pytest")


PAGES = ["ARCHITECTURE.md", "CONTRIBUTING.md", *(ROOT / "docs" / "decisions").glob("*.md")]
_PATH = re.compile(r"`([\w./-]+/|[\w./-]+\.(?:py|yaml|yml|txt|xml|json|toml|md))`")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: Path(path).name)
def test_documents_for_contributors_name_files_that_exist(page: str | Path) -> None:
    # Paths may leave out the first folders: `supervision/events.py`, `loading.py`.
    missing = [path for path in set(_PATH.findall(text_of(str(page)))) if not _exists(path)]
    assert missing == []


def _exists(path: str) -> bool:
    inner = path.removeprefix("composer/")
    return (ROOT / path).exists() or any(PACKAGE.rglob(f"**/{inner}"))

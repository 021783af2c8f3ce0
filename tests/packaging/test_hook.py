"""The pre-commit hook, run by pre-commit in a repository that uses it."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.packaging.installation import SITES, without_ros

ROOT = Path(__file__).parents[2]
HAS_PRE_COMMIT = importlib.util.find_spec("pre_commit") is not None
pytestmark = pytest.mark.skipif(
    not HAS_PRE_COMMIT and os.environ.get("CI") != "true", reason="pre-commit is not installed"
)


def git(folder: Path, *arguments: str) -> str:
    identity = ("-c", "user.name=Tester", "-c", "user.email=tester@example.org")
    done = subprocess.run(
        ["git", *identity, *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def committed(folder: Path) -> str:
    """Commit ``folder`` as a git repository and return the commit."""
    git(folder, "init", "--quiet")
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "all")
    return git(folder, "rev-parse", "HEAD")


@pytest.fixture(scope="module")
def user(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository that uses the hook of this working tree.

    The hook is published without its dependencies, which test_installation installs, and uses the
    packages of this Python.
    """
    published = tmp_path_factory.mktemp("published")
    for name in git(ROOT, "ls-files", "--cached", "--others", "--exclude-standard").splitlines():
        if (ROOT / name).is_file() and not name.startswith(("tests/", "benchmarks/")):
            (published / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, published / name)
    project = (published / "pyproject.toml").read_text(encoding="utf-8")
    project = re.sub(r"(?ms)^dependencies = \[$.*?^\]$", "dependencies = []", project)
    (published / "pyproject.toml").write_text(project, encoding="utf-8")
    revision = committed(published)
    folder = tmp_path_factory.mktemp("user")
    configuration = f"""\
repos:
  - repo: {published}
    rev: {revision}
    hooks:
      - id: compose-validate
"""
    (folder / ".pre-commit-config.yaml").write_text(configuration)
    (folder / "nodes").mkdir()
    (folder / "nodes" / "wheel.yaml").write_text("node: wheel\n")
    (folder / "robot.yaml").write_text("system: robot\nnodes: {left: {type: wheel}}\n")
    committed(folder)
    return folder


def pre_commit(
    folder: Path, home: Path, *arguments: str, **variables: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pre_commit", *arguments, "--color", "never"],
        cwd=folder,
        env=without_ros() | {"PRE_COMMIT_HOME": str(home), "GITHUB_ACTIONS": "false"} | variables,
        capture_output=True,
        text=True,
        check=False,
    )


def run_hook(folder: Path, home: Path) -> subprocess.CompletedProcess[str]:
    return pre_commit(folder, home, "run", "--all-files", PYTHONPATH=SITES)


def test_the_hook_passes_valid_files_and_fails_on_errors(
    user: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    home = tmp_path_factory.mktemp("pre_commit")
    done = pre_commit(user, home, "install-hooks")
    assert done.returncode == 0, done.stdout
    done = run_hook(user, home)
    assert done.returncode == 0, done.stdout
    assert "compose validate" in done.stdout
    assert "Passed" in done.stdout
    (user / "nodes" / "wheel.yaml").rename(user / "nodes" / "wheels.yaml")
    git(user, "add", "--all")
    done = run_hook(user, home)
    assert done.returncode == 1
    assert "RC201 unknown-node-type" in done.stdout
    assert " --> robot.yaml:2:" in done.stdout

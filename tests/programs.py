"""Programs that some tests need. Without them, these tests are skipped, but in CI they fail."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest


def require(is_installed: object, missing: str) -> None:
    """Skip the test, or fail in CI, if something is not installed; ``missing`` says what."""
    if is_installed:
        return
    if os.environ.get("CI") == "true":
        pytest.fail(missing, pytrace=False)
    pytest.skip(missing)


def require_package(folder: Path, package: str) -> None:
    """Require Node.js and the npm packages of a folder of tests, ``package`` among them."""
    is_installed = shutil.which("node") and (folder / "node_modules" / package).exists()
    require(is_installed, f"{package} is not installed: npm ci --prefix tests/{folder.name}")


def run_node(folder: Path, script: str, data: object) -> Any:
    """Run a script of Node.js, which reads the data as JSON and prints JSON; return that."""
    done = subprocess.run(
        ["node", script],
        cwd=folder,
        input=json.dumps(data),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def require_module(name: str) -> Any:
    """Import a module of a package in the extra ``dev``, which few tests need."""
    try:
        return importlib.import_module(name)
    except ImportError:
        require(False, f"{name} is not installed: it is in the extra 'dev'")
        raise

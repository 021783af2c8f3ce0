"""Folders of data files, and the prefixes in which ROS packages are installed.

Data files are JSON Schemas, node types, systems, interfaces and pages of rules.

A wheel has them in ``composer/share/`` (see pyproject.toml). In a checkout or an editable install,
they are next to the package.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]


def data_folder() -> Path:
    """Return the folder that the other ones are in."""
    share = PACKAGE / "share"
    # The wheel first: `nodes` next to an installed package would belong to another distribution.
    return share if share.is_dir() else PACKAGE.parent


def schemas_folder() -> Path:
    """Return the folder of the JSON Schemas."""
    return data_folder() / "schemas"


def nodes_folder() -> Path:
    """Return the folder of the node types that come with the composer."""
    return data_folder() / "nodes"


def systems_folder() -> Path:
    """Return the folder of the example systems."""
    return data_folder() / "systems"


def interfaces_folder() -> Path:
    """Return the source of the ament package composer_interfaces (.srv and .action files)."""
    return data_folder() / "interfaces"


def rules_folder() -> Path:
    """Return the folder of the pages about rules, ``docs/rules`` in a checkout."""
    in_wheel = data_folder() / "rules"
    return in_wheel if in_wheel.is_dir() else data_folder() / "docs/rules"


def ament_prefixes(environment: Mapping[str, str] = os.environ) -> list[Path]:
    """Return the prefixes that ROS searches: ``AMENT_PREFIX_PATH``, then this Python's."""
    listed = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [Path(prefix) for prefix in dict.fromkeys((*filter(None, listed), sys.prefix))]

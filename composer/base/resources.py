"""Folders of data files: JSON Schemas, node types, systems, interfaces, pages of rules.

A wheel has them in ``composer/share/`` (see pyproject.toml). In a checkout or an editable install,
they are next to the package.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder() -> Path:
    """Return the folder that the other ones are in."""
    share = _PACKAGE / "share"
    # The wheel first: `nodes` next to an installed package would belong to another distribution.
    return share if share.is_dir() else _PACKAGE.parent


def _folder(name: str) -> Path:
    return data_folder() / name


def schemas_folder() -> Path:
    """Return the folder of the JSON Schemas."""
    return _folder("schemas")


def nodes_folder() -> Path:
    """Return the folder of the node types that come with the composer."""
    return _folder("nodes")


def systems_folder() -> Path:
    """Return the folder of the example systems."""
    return _folder("systems")


def interfaces_folder() -> Path:
    """Return the source of the ament package composer_interfaces (.srv and .action files)."""
    return _folder("interfaces")


def rules_folder() -> Path:
    """Return the folder of the pages about rules, ``docs/rules`` in a checkout."""
    in_wheel = _folder("rules")
    return in_wheel if in_wheel.is_dir() else _folder("docs/rules")

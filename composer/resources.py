"""Where the files that are not Python are: JSON Schemas, node types, systems, interfaces.

A wheel carries them in ``composer/share/`` (pyproject.toml puts them there); in a checkout, and in
an editable install of one, they stand beside the package.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    share = _PACKAGE / "share"
    # The wheel first: beside an installed package, `nodes` would be some other distribution's.
    return (share if share.is_dir() else _PACKAGE.parent) / name


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

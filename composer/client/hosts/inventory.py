"""What has to be the same on all computers of a system: versions, interfaces and files.

``python -m composer.client.hosts.inventory`` takes it in the current folder: it reads a question
from standard input and prints an answer, each a line of JSON.
"""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.files import open_regular, read_regular
from composer.interfaces.sources import installed_prefixes

_MAX_DESCRIPTION_BYTES = 4_000_000
#: The wheels of ROS begin with it; a sourced ROS installs rclpy under that name.
_ROS_PREFIX = "ros-"
_PACKAGES = ("ros2-composer", "rclpy")


@dataclass(frozen=True, slots=True)
class Question:
    """The files, relative to the root of the project, and the interfaces that a system uses."""

    files: Sequence[str]
    interfaces: Sequence[str]


@dataclass(frozen=True, slots=True)
class Inventory:
    """The state of one computer.

    ``python`` is major and minor version; ``packages`` are versions by name. ``interfaces`` are
    type hashes, ``files`` SHA-256 digests, each by name: None if it is not there.
    """

    python: str
    packages: Mapping[str, str]
    interfaces: Mapping[str, str | None]
    files: Mapping[str, str | None]


def take_inventory(root: Path, question: Question) -> Inventory:
    """Return what this computer has; ``root`` is the root of the project."""
    return Inventory(
        python=".".join(platform.python_version_tuple()[:2]),
        packages=_packages(),
        interfaces={name: _type_hash(name) for name in question.interfaces},
        files={name: _digest(root / name) for name in question.files},
    )


def written_question(question: Question) -> str:
    """Return a question as a line of JSON."""
    return f"{json.dumps(asdict(question))}\n"


def read_answer(text: str) -> Inventory:
    """Return the inventory in the output of the program. Raises ValueError if there is none.

    Other lines come from start-up files of the shell.
    """
    line = next((line for line in reversed(text.splitlines()) if line.startswith("{")), "")
    try:
        found = json.loads(line)
        facts = (found["packages"], found["interfaces"], found["files"])
        return Inventory(str(found["python"]), *map(_texts, facts))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("not an inventory") from error


def _texts(facts: Mapping[str, str | None]) -> dict[str, Any]:
    """Return texts by name, None for what is not there. Raises ValueError, AttributeError."""
    if not all(value is None or isinstance(value, str) for value in facts.values()):
        raise ValueError("not only texts")
    return dict(facts)


def _packages() -> dict[str, str]:
    found: dict[str, str] = {}
    for distribution in distributions():
        metadata = distribution.metadata
        if "Name" not in metadata:  # an installation was interrupted
            continue
        name = metadata["Name"].lower().replace("_", "-")
        if name in _PACKAGES or name.startswith(_ROS_PREFIX):
            found.setdefault(name, metadata["Version"] or "unknown")
    return found


def _type_hash(name: str) -> str | None:
    """Return the hash of an interface as it is built, which DDS compares as well."""
    for prefix in installed_prefixes():
        path = prefix.root / "share" / f"{name}.json"
        try:
            described = json.loads(read_regular(path, _MAX_DESCRIPTION_BYTES))["type_hashes"]
        except (OSError, ValueError, KeyError, TypeError):
            continue
        return next((item["hash_string"] for item in described if item["type_name"] == name), None)
    return None


def _digest(path: Path) -> str | None:
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def _main() -> None:
    question = Question(**json.loads(sys.stdin.readline()))
    found = take_inventory(Path.cwd(), question)
    sys.stdout.write(f"\n{json.dumps(asdict(found))}\n")


if __name__ == "__main__":
    _main()

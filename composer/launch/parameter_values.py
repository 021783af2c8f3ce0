"""The parameters that a launch file gives to a node, from files and from values."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.tree import Plain, plain
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
from composer.model.resolve.parameter_sections import is_pattern

_EVERY_NODE = "/**"


def parameter_values(sources: Iterable[tuple[str, bool]], full_name: str) -> dict[str, Any]:
    """Return the parameters of a node by name, and the problems; later sources take precedence.

    ``sections`` are the parameters of the other nodes that the files name: the program may create
    them. A source is the path of a parameter file and True, or ``name:=value`` and False.
    """
    problems: list[str] = []
    given: list[ParameterFiles | dict[str, Plain]] = []
    for text, is_file in sources:
        if is_file:
            files = ParameterFiles()
            # launch_ros writes values into files with random names.
            is_written = Path(text).is_relative_to(gettempdir())
            where = full_name if is_written else f"{full_name} in {text}"
            problems += [
                f"parameters of {where}: {problem.message}"
                for problem in read_parameter_file(Path(text), files)
            ]
            given.append(files)
            continue
        name, _, value_text = text.partition(":=")
        tree, _ = parse_document(SourceFile("", f"value: {value_text}\n"))
        value = None if tree is None else tree.get("value")
        if value is None:
            problems.append(f"parameter of {full_name}: {text}")
        else:
            given.append({name: plain(value)})
    read = [item for item in given if isinstance(item, ParameterFiles)]
    own = {full_name, *(name for item in read for name in item.names_for(full_name))}
    named = [name for item in read for name, _ in item.joined() if _is_of_one_name(name)]
    return {
        "parameters": _values(given, full_name),
        "sections": {name: _values(given, name) for name in named if name not in own},
        "problems": problems,
    }


def _is_of_one_name(name: str) -> bool:
    """Return whether a section is for nodes with one name: ``/a/b``, or ``/**/b``."""
    return not is_pattern(name.rpartition("/")[2])


def _values(given: Iterable[ParameterFiles | dict[str, Plain]], name: str) -> dict[str, Plain]:
    """Return the values for a node, or for the nodes of a pattern."""
    values: dict[str, Plain] = {}
    for item in given:
        if not isinstance(item, ParameterFiles):
            values |= item
        elif is_pattern(name):
            sections = (entries for key, entries in item.joined() if key in (_EVERY_NODE, name))
            values |= {entry.name: plain(entry.value) for section in sections for entry in section}
        else:
            values |= {key: plain(entry.value) for key, entry in item.given(name).items()}
    return values

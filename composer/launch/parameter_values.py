"""The parameters that a launch file gives to a node, from files and from values."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from composer.document import parse_document
from composer.resolve.parameter_files import ParameterFiles, read_parameter_file
from composer.source import SourceFile
from composer.tree import Plain, plain


def parameter_values(
    sources: Iterable[tuple[str, bool]], full_name: str
) -> tuple[dict[str, Plain], list[str]]:
    """Return the parameters of a node and the problems; later sources take precedence.

    A source is the path of a parameter file and True, or ``name:=value`` and False.
    """
    values: dict[str, Plain] = {}
    problems: list[str] = []
    for text, is_file in sources:
        if is_file:
            files = ParameterFiles()
            problems += [
                f"parameters of {full_name} in {text}: {problem.message}"
                for problem in read_parameter_file(Path(text), files)
            ]
            entries = files.given(full_name)
            values |= {name: plain(entry.value) for name, entry in entries.items()}
            continue
        name, _, value_text = text.partition(":=")
        tree, _ = parse_document(SourceFile("", f"value: {value_text}\n"))
        value = None if tree is None else tree.get("value")
        if value is None:
            problems.append(f"parameter of {full_name}: {text}")
        else:
            values[name] = plain(value)
    return values, problems

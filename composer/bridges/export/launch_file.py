"""A launch file that runs a system, with the arguments of the system as its own."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from composer.bridges.templates import filled
from composer.language.expand.arguments import Declared
from composer.language.tree import Scalar, plain, word
from composer.model import System

#: The arguments of every such launch file. They hide arguments of the system with the same names.
_OF_LAUNCH = frozenset({"log_level", "namespace", "use_sim_time"})


def launch_file(
    system: System, arguments: Mapping[str, Declared], path: Path, output: Path | None
) -> str:
    """Return the launch file of a system in ``path``.

    Each of its ``arguments`` is a launch argument, with the value that was given as its default. If
    the launch file is written to ``output``, it names the system relative to itself.
    """
    absolute = path.resolve()
    if output is None:
        place = f"Path({str(absolute)!r})"
    else:
        relative = os.path.relpath(absolute, output.resolve().parent)
        place = f"(Path(__file__).parent / {relative!r}).resolve()"
    given = dict(text.split("=", 1) for text in system.arguments)
    own = {name: item for name, item in arguments.items() if name not in _OF_LAUNCH}
    passed = [f'["{name}=", LaunchConfiguration("{name}")],' for name in own]
    passed += [f"{_quoted(text)}," for text in system.arguments if text.split("=", 1)[0] not in own]
    words = ["arguments=[", *(f"    {text}" for text in passed), "],"] if passed else []
    return filled(
        "launch_file.py",
        name=system.name.value,
        system=place,
        declarations="".join(_lines(8, _declarations(own, given))),
        arguments="".join(_lines(12, words)),
    )


def _declarations(arguments: Mapping[str, Declared], given: Mapping[str, str]) -> Iterator[str]:
    for name, declared in arguments.items():
        default = given.get(name, _text(declared))
        choices = [word(item) for item in declared.choices]
        yield "DeclareLaunchArgument("
        yield f'    "{name}",'
        if default is not None:
            yield f"    default_value={_quoted(default)},"
        if declared.description:
            yield f"    description={_quoted(declared.description)},"
        if choices:
            yield f"    choices=[{', '.join(map(_quoted, choices))}],"
        yield "),"


def _text(declared: Declared) -> str | None:
    """Return the default of an argument as a command line gives it, None without one."""
    if declared.value is None or isinstance(declared.value, Scalar):
        return None if declared.value is None else word(declared.value)
    return json.dumps(plain(declared.value))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _lines(indentation: int, texts: Iterable[str]) -> Iterator[str]:
    yield from (f"{' ' * indentation}{text}\n" for text in texts)

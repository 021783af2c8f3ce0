"""Declarations of the arguments of a system, and of the variables of a node type.

For example, in ``arguments``::

    lidar: {choices: [velodyne, ouster], default: velodyne, description: The driver to start.}
    simulation: false

A map declares; any other value is a default. The type is declared, or follows from the default and
the choices. A bool is also written as in launch files: ``True``, ``1``, ``'false'``.
"""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.language import rules
from composer.language.tree import (
    Mapping,
    Scalar,
    Sequence,
    Tree,
    describe,
    is_opaque,
    items,
    plain,
)

#: The section that declares the names of a file, by the kind of the file.
SECTIONS = {"system": "arguments", "node": "variables"}
_SPELLINGS = {"true": True, "1": True, "false": False, "0": False}
#: Any number, unchanged: a default of 1 does not say that 0.5 is wrong.
_NUMBER = "number"


@dataclass(frozen=True, slots=True)
class Declared:
    """A declared name; ``value`` is None if one must be given.

    ``type`` is a type of ROS parameters, ``number``, or empty for any value.
    """

    key: Scalar
    value: Tree | None
    type: str = ""
    choices: tuple[Scalar, ...] = ()
    description: str = ""

    @property
    def alternatives(self) -> tuple[Scalar, ...]:
        """The values that the declaration allows, if it lists them; both values of a bool."""
        if self.choices or self.type != "bool":
            return self.choices
        return tuple(Scalar(value, self.key.span, verbatim=False) for value in (False, True))


def section_name(kind: str | None) -> str:
    """Return the name of the section that declares names in a file of this kind."""
    return SECTIONS.get(kind or "", "arguments")


def read_declarations(tree: Mapping, kind: str | None) -> dict[str, Declared] | None:
    """Return the declarations of a file by name; None if the section is malformed."""
    section = tree.get(section_name(kind))
    if section is None:
        return {}
    if not isinstance(section, Mapping):
        return None
    return {entry.name: _declared(entry.key, entry.value) for entry in section}


def _declared(key: Scalar, written: Tree) -> Declared:
    if not isinstance(written, Mapping):
        return Declared(key, written, _type_of(written))
    default, given = written.get("default"), written.get("type")
    choices = tuple(item for item in items(written.get("choices")) if isinstance(item, Scalar))
    named = given.value if isinstance(given, Scalar) else None
    first = next(iter((*choices, *([] if default is None else [default]))), None)
    kind = named if isinstance(named, str) else _type_of(first)
    typed = [_as_type(item, kind) for item in choices]
    description = written.get("description")
    return Declared(
        key,
        None if default is None else _as_type(default, kind) or default,
        kind,
        tuple(item for item in typed if isinstance(item, Scalar)),
        str(plain(description)) if isinstance(description, Scalar) else "",
    )


def _type_of(tree: Tree | None) -> str:
    match tree:
        case Scalar(value=bool()):
            return "bool"
        case Scalar(value=int() | float()):
            return _NUMBER
        case Scalar(value=str() as text) if not is_opaque(text):
            return "string"
        case _:
            return ""


def typed(tree: Tree, declared: Declared, word: str) -> tuple[Tree, Diagnostic | None]:
    """Return a value as the declared type; the value itself and a diagnostic if it has another.

    ``word`` is what the file calls a declared name.
    """
    if isinstance(tree, Scalar) and isinstance(tree.value, str) and is_opaque(tree.value):
        return tree, None
    name = shown(str(declared.key.value))
    label = Label(declared.key.span, "declared here")
    converted = _as_type(tree, declared.type)
    if converted is None:
        kind = "a number" if declared.type == _NUMBER else f"of type {shown(declared.type)}"
        what = f"'{shown(plain(tree))}'" if isinstance(tree, Scalar) else describe(tree)
        message = f"{word} '{name}' is {kind}, not {what}"
        hint = "write a list: [..., ...]" if declared.type.endswith("_array") else None
        return tree, Diagnostic(rules.WRONG_TYPE, message, tree.span, (label,), hint)
    values = [plain(item) for item in declared.choices]
    if values and plain(converted) not in values:
        text = shown(plain(converted))
        listed = ", ".join(f"'{shown(value)}'" for value in values)
        hint = suggestion(text, map(shown, values), limit=0) or f"use one of {listed}"
        message = f"'{text}' is not a choice of {word} '{name}'"
        return converted, Diagnostic(rules.UNKNOWN_WORD, message, tree.span, (label,), hint)
    return converted, None


def default_problems(declarations: dict[str, Declared], word: str) -> Iterator[Diagnostic]:
    """Yield diagnostics for defaults that have another type than declared, or are no choice."""
    for declared in declarations.values():
        if declared.value is not None:
            _, problem = typed(declared.value, declared, word)
            if problem is not None:
                yield problem


def _as_type(tree: Tree, kind: str) -> Tree | None:
    """Return a value as a type; None if it has another one."""
    element = kind.removesuffix("_array")
    if element != kind:
        converted = [_as_type(item, element) for item in items(tree)]
        if not isinstance(tree, Sequence) or None in converted:
            return None
        return Sequence(tuple(item for item in converted if item is not None), tree.span)
    if kind not in ("bool", "integer", "double", "string", _NUMBER):
        return tree
    return _scalar_as_type(tree, kind) if isinstance(tree, Scalar) else None


def _scalar_as_type(scalar: Scalar, kind: str) -> Scalar | None:
    value = scalar.value
    match kind:
        case "string" if value is not None and not isinstance(value, str):
            return Scalar(scalar.span.text, scalar.span)  # as it is written: 1.10
        case "string":
            return None if value is None else scalar
        case "bool" if isinstance(value, bool):
            return scalar
        case "bool":
            spelled = as_bool(value)
            return None if spelled is None else Scalar(spelled, scalar.span, verbatim=False)
        case "double" if isinstance(value, int) and not isinstance(value, bool):
            return Scalar(float(value), scalar.span, verbatim=False)
        case _:
            numbers = int if kind == "integer" else float if kind == "double" else (int, float)
            return scalar if isinstance(value, numbers) and not isinstance(value, bool) else None


def as_bool(value: object) -> bool | None:
    """Return a value as true or false, spelled as in YAML or in launch files; None for others."""
    if isinstance(value, bool):
        return value
    return _SPELLINGS.get(str(value).strip().lower()) if isinstance(value, str | int) else None

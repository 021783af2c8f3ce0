"""Visits a launch file with several values of its arguments, to learn what depends on them.

A launch file is a program: what its conditions and substitutions do is observed, not interpreted.
An argument that is true or false, has choices, or is compared with constants takes all of these
values. Any other argument takes a mark, which is then in all that the argument becomes a part of.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from math import prod
from typing import Any, NamedTuple

from composer.language.document.scalars import NumberRefused, resolve_plain
from composer.model.names import join_node_name

MAX_VISITS = 64
_MARK = "COMPOSE_ARGUMENT_{}_END"
_MARKED = re.compile(r"COMPOSE_ARGUMENT_(\w+?)_END")
_OPPOSITES = {"true": "false", "false": "true", "True": "False", "False": "True"}

#: The report of a visit: ``nodes``, ``left_out``, ``arguments``, and ``compared`` constants.
Visit = dict[str, Any]


def identifier(name: str) -> str:
    """Return the name of a launch argument as a system has it."""
    return re.sub(r"\W", "_", name, flags=re.ASCII)


def mark(name: str) -> str:
    """Return a text that stands for the value of an argument."""
    return _MARK.format(identifier(name))


def marked_names(tree: Any) -> set[str]:
    """Return the arguments that a report refers to, as a system has them."""
    return set(_MARKED.findall(json.dumps(tree)))


def with_references(text: str) -> str:
    """Return a text with ``${name}`` in place of marks."""
    return _MARKED.sub(r"${\1}", text)


def all_visits(visit: Callable[[Mapping[str, str]], Visit], given: Mapping[str, str]) -> Visit:
    """Return the visits for each combination of values of the arguments that matter.

    ``values`` of a visit has the arguments with several values. ``resolved`` has the arguments that
    keep their values, with the reason if there is one: the launch file needs the value before it
    has nodes, or fails with other values.
    """
    base = visit(given)
    tried = _tried_values(visit, given, base)
    values, problems = tried.values, tried.problems
    declared = {item["name"]: item for item in base["arguments"]}
    marks: dict[str, str] = {}
    for name, item in declared.items():
        found = _attempted(visit, {**given, name: mark(name)})
        if name in problems or isinstance(found, str):
            continue
        if identifier(name) in marked_names(inner_sections(found["nodes"])):
            problems[name] = "nodes inside a program have parameters that depend on it"
        elif name in tried.compared:
            if not item["choices"] and item["value"] not in _OPPOSITES:
                values[name] = _with_any_other(name, item["value"], tried.compared[name])
        elif all(_is_kept(each, found, name, text) for text, each in tried.visits_of(name, base)):
            marks[name] = mark(name)
    several = sorted(values, key=lambda name: name not in tried.deciding)
    while prod(len(values[name]) for name in several) > MAX_VISITS:
        # Rather an argument that only appears in values than one that decides.
        several.remove(next((name for name in reversed(several) if name in marks), several[-1]))
    alone = {name: text for name, text in marks.items() if name not in several}
    chosen = {name: values[name] for name in several}
    visits = _combined_visits(lambda each: visit({**given, **each}), chosen, alone)
    needed = [name for name, item in declared.items() if item["value"] == mark(name)]
    kept = {*chosen, *alone, *needed}
    return {
        "arguments": [
            {**item, "values": values.get(item["name"], [])}
            for item in declared.values()
            if item["name"] in kept
        ],
        "visits": visits or [{"values": {}, **base}],
        "base": base["nodes"],
        "resolved": {
            name: problems.get(name, "")
            for name, item in declared.items()
            if item["value"] and name not in kept
        },
    }


def _with_any_other(name: str, value: str, compared: Collection[str]) -> list[str]:
    """Return constants with a mark for any value that is not compared; first what ``value`` is."""
    first = value if value in compared else mark(name)
    return list(dict.fromkeys([first, *sorted(compared), mark(name)]))


class _Tried(NamedTuple):
    """What visits with one other value each have shown of the arguments.

    ``values`` has the values of arguments with several, ``problems`` say why others are left
    out. ``compared`` are the constants in conditions, ``deciding`` the arguments of which a value
    changes which nodes there are.
    """

    values: dict[str, list[str]]
    problems: dict[str, str]
    compared: dict[str, set[str]]
    deciding: set[str]
    visits: dict[tuple[str, str], Visit]

    def visits_of(self, name: str, base: Visit) -> Iterator[tuple[str, Visit]]:
        """Yield the values of an argument that work, each with its visit."""
        for item in base["arguments"]:
            if item["name"] == name:
                yield item["value"], base
        for (argument, text), found in self.visits.items():
            if argument == name:
                yield text, found


def _tried_values(
    visit: Callable[[Mapping[str, str]], Visit], given: Mapping[str, str], base: Visit
) -> _Tried:
    """Visit with each other value of each argument that is known to have several."""
    tried = _Tried(_alternatives(base), {}, {}, set(), {})
    values, refused = tried.values, set()
    for name, texts in tuple(values.items()):
        for other in texts[1:]:  # a branch may compare other arguments
            found = _attempted(visit, {**given, name: other})
            decides = not isinstance(found, str) and _node_names(found) != _node_names(base)
            if decides:
                tried.deciding.add(name)
            problem = found if isinstance(found, str) else _dependent_section(found, base)
            if isinstance(found, str) or (problem and not decides):
                refused.add((name, other))
                tried.problems[name] = f"with '{other}', {problem}"
                continue
            tried.visits[name, other] = found
            for key, more in _alternatives(found, base).items():
                values[key] = list(dict.fromkeys([*values.get(key, ()), *more]))
    for name in tried.problems:
        values[name] = [text for text in values[name] if (name, text) not in refused]
    for each in (base, *tried.visits.values()):
        for name, constants in each["compared"].items():
            tried.compared.setdefault(name, set()).update(constants)
    for name in [name for name, texts in values.items() if len(texts) == 1]:
        del values[name]
    return tried


def _node_names(visit: Visit) -> list[str | None]:
    return [item["name"] for item in visit["nodes"]]


def _dependent_section(found: Visit, base: Visit) -> str:
    """Return that parameters of a node inside a program differ: they are in a file, as they are."""
    others = inner_sections(base["nodes"])
    for name, sections in inner_sections(found["nodes"]).items():
        if name in others and sections != others[name]:
            return f"{name} inside a program has other parameters"
    return ""


def inner_sections(nodes: Iterable[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Return the different parameters that nodes which the launch file does not name are given."""
    named = {join_node_name(item["namespace"], item["name"]) for item in nodes if item["name"]}
    found: dict[str, list[Mapping[str, Any]]] = {}
    for item in nodes:
        for name, values in item["sections"].items():
            if name not in named and values not in found.setdefault(name, []):
                found[name].append(values)
    return {name: sections for name, sections in found.items() if sections}


def _combined_visits(
    visit: Callable[[Mapping[str, str]], Visit], values: dict[str, list[str]], marks: dict[str, str]
) -> list[Visit]:
    """Return a visit for each combination of values; remove values and marks until all work."""
    while values or marks:
        visits = []
        for chosen in product(*values.values()):
            combination = dict(zip(values, chosen, strict=True))
            found = _attempted(visit, marks | combination)
            if not isinstance(found, dict):
                break
            visits.append({"values": combination, **found})
        else:
            return visits
        others = [name for name, text in combination.items() if text != values[name][0]]
        if others:
            del values[others[-1]]
        elif marks:
            marks.clear()
        else:
            values.clear()
    return []


def _attempted(
    visit: Callable[[Mapping[str, str]], Visit], values: Mapping[str, str]
) -> Visit | str:
    """Return a visit, or why it has failed."""
    try:
        return visit(values)
    except Exception as error:  # whatever the code of the launch file raises for a value
        text = error.args[0] if isinstance(error, KeyError) and error.args else error
        return f"{type(error).__name__}: {text}".splitlines()[0]


def _alternatives(visit: Visit, base: Visit | None = None) -> dict[str, list[str]]:
    """Return the values of each argument that is known to have several, its own first."""
    found = {}
    for item in (base or visit)["arguments"]:
        value = item["value"]
        others = [*item["choices"], *visit["compared"].get(item["name"], ())]
        others += [_OPPOSITES[value]] if value in _OPPOSITES else []
        values = list(dict.fromkeys([value, *others]))
        if len(values) > 1:
            found[item["name"]] = values
    return found


def _is_kept(base: Visit, found: Visit, name: str, default: str) -> bool:
    """Return whether a mark is where the value was, and nothing else has changed."""
    try:
        return _without_mark(found["nodes"], base["nodes"], name, default)
    except NumberRefused:
        return False


def _without_mark(found: Any, base: Any, name: str, default: str) -> bool:
    if isinstance(found, dict) and isinstance(base, dict):
        filled = {key.replace(mark(name), default): value for key, value in found.items()}
        return filled.keys() == base.keys() and all(
            _without_mark(value, base[key], name, default) for key, value in filled.items()
        )
    if isinstance(found, list) and isinstance(base, list):
        pairs = zip(found, base, strict=False)
        return len(found) == len(base) and all(
            _without_mark(one, other, name, default) for one, other in pairs
        )
    if found == mark(name) and isinstance(base, bool):
        return str(base).lower() == default.lower()
    if found == mark(name) and default:
        return bool(base in (default, resolve_plain(default)))
    return bool((found.replace(mark(name), default) if isinstance(found, str) else found) == base)


class Differs(Exception):
    """Several descriptions of a node cannot be one description with references."""


def _unified(
    trees: Sequence[Any], values: Sequence[Mapping[str, str]], switches: Collection[str]
) -> Any:
    """Return one tree for several, with marks where they have the values of an argument.

    ``switches`` are the arguments that are true or false. Raises Differs.
    """
    first = trees[0]
    if any(type(tree) is not type(first) for tree in trees):
        raise Differs
    if all(tree == first for tree in trees):
        return first
    if all(isinstance(tree, dict) and tree.keys() == first.keys() for tree in trees):
        return {key: _unified([tree[key] for tree in trees], values, switches) for key in first}
    if all(isinstance(tree, list) and len(tree) == len(first) for tree in trees):
        return [_unified(items, values, switches) for items in zip(*trees, strict=True)]
    for name in values[0]:
        texts = [item[name] for item in values]
        if _are_values(trees, texts, is_switch=name in switches):
            return mark(name)
        if isinstance(first, str) and all(texts):
            pairs = zip(trees, texts, strict=True)
            marked = {tree.replace(text, mark(name)) for tree, text in pairs}
            if len(marked) == 1:
                return marked.pop()
    raise Differs


def _are_values(trees: Sequence[Any], texts: Sequence[str], *, is_switch: bool) -> bool:
    if isinstance(trees[0], bool):
        return is_switch and [str(tree).lower() for tree in trees] == [t.lower() for t in texts]
    return [*trees] == [*texts]


def unified_groups(
    trees: Mapping[int, Any], values: Sequence[Mapping[str, str]]
) -> list[tuple[Any, list[int]]]:
    """Merge the trees of several visits into as few as possible; return each with its visits.

    ``values`` has the arguments of all visits.
    """
    switches = frozenset(name for name in values[0] if is_switch(item[name] for item in values))

    def together(numbers: Sequence[int]) -> Any:
        return _unified([trees[n] for n in numbers], [values[n] for n in numbers], switches)

    with suppress(Differs):
        return [(together([*trees]), [*trees])]
    groups: list[tuple[Any, list[int]]] = []
    for number in trees:
        for position, (_, numbers) in enumerate(groups):
            with suppress(Differs):
                groups[position] = together([*numbers, number]), [*numbers, number]
                break
        else:
            groups.append((trees[number], [number]))
    return groups


def is_switch(texts: Iterable[str]) -> bool:
    """Return whether an argument with these values is true or false."""
    return all(text.lower() in ("true", "false") for text in texts)

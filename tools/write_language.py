"""Write docs/language.md from the JSON Schemas: a section per kind of map, a row per key.

The descriptions of keys come from ``schemas/parts``, the introduction from
``tools/language_introduction.md``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from composer.language.expressions import CONSTANTS, FUNCTIONS
from composer.language.schema import SCHEMAS, schema

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "language.md"
INTRODUCTION = Path(__file__).with_name("language_introduction.md")

Part = dict[str, Any]

#: Headings of maps whose titles are ambiguous.
_HEADINGS = {
    "#lifecycle": "Lifecycle of the system",
    "inline_node": "Inline node",
    "node_lifecycle": "Lifecycle of a node",
    "node_with_type": "Node with a type",
    "watch": "Watch of a node",
    "watch_all": "Watch of the system",
}
_FILES = {
    "system": "System",
    "node": "Node type",
    "project": "Project",
    "scenario": "Scenario",
}
#: The schema of a connection without a name lists the keys of all three kinds.
_NOT_SHOWN = {"unnamed_connection"}
#: Definitions that are described in the introduction or by a short phrase.
_NAMES = {"fields": "[fields](#fields)", "parameter_value": "value of a parameter"}
_WORDS = {
    "object": "map",
    "array": "list",
    "string": "string",
    "number": "number",
    "integer": "integer",
    "boolean": "boolean",
    "null": "null",
}
#: A cell of a table has the first sentence, and further ones up to this number of words.
_WORDS_IN_CELL = 18
#: Keys of many maps, in the tables of the first maps that have them; the introduction names them.
_EVERYWHERE = ("description", "for_each", "if", "unless")
_SUBSTITUTION = r"\$\{"
_EXPRESSION = r"\{"


@dataclass(frozen=True, slots=True)
class Section:
    """A kind of map: its heading and its keys.

    Keys in ``required`` are always required; those in ``declared`` only where a port is declared,
    not where a system overrides the port of a node type.
    """

    heading: str
    part: Part
    required: frozenset[str]
    declared: frozenset[str] = frozenset()

    def merged_with(self, other: Section) -> Section:
        """Return the section combined with another use of the same map."""
        always = self.required & other.required
        sometimes = self.required | self.declared | other.required
        return replace(self, required=always, declared=sometimes - always)


@dataclass(slots=True)
class Schema:
    """One schema, and its sections in order of appearance."""

    name: str
    definitions: Part
    sections: dict[str, Section] = field(default_factory=dict)

    def collect_sections(self, whole: Part) -> None:
        """Collect the sections of the schema, each before the sections of its keys."""
        waiting = [self._section(_FILES[self.name], whole, frozenset())]
        while waiting:
            section = waiting.pop(0)
            known = self.sections.get(section.heading)
            self.sections[section.heading] = known.merged_with(section) if known else section
            if known is not None:
                continue
            waiting += [
                inner
                for key, part in section.part["properties"].items()
                for inner in self.maps(part, f"#{key}")
            ]

    def maps(self, part: Part, name: str, required: frozenset[str] = frozenset()) -> list[Section]:
        """Return the kinds of map that ``part`` allows, directly or as values or items."""
        required |= frozenset(part.get("required", ()))
        if "$ref" in part:
            definition = _definition(part)
            if definition in _NOT_SHOWN:
                return []
            return self.maps(self.definitions[definition], definition, required)
        if "properties" in part:
            return [self._section(self._heading(name, part), part, required)]
        inner = [*part.get("allOf", ()), *_branches(part)]
        inner += [part[key] for key in ("additionalProperties", "items") if _is_part(part, key)]
        return [section for one in inner for section in self.maps(one, name, required)]

    def kind(self, part: Part, key: str) -> str:
        """Return a description of the values allowed for ``key``, with links to sections."""
        if "$ref" in part:
            definition = _definition(part)
            return _NAMES.get(definition) or self.kind(self.definitions[definition], definition)
        if "enum" in part:
            return _either([f"`{word}`" for word in part["enum"]])
        choices = [one for one in part.get("oneOf", ()) if "enum" in one]
        if choices:
            return self.kind(choices[0], key)
        types = part.get("type", [])
        words = [
            word
            for name in ([types] if isinstance(types, str) else types)
            for word in self._words(name, part, key, alone=isinstance(types, str))
        ]
        text, limits = _either(words), _limits(part)
        return text if text.endswith(limits) else text + limits

    def described(self, part: Part) -> Part:
        """Return ``part`` merged with the definition that it references."""
        if "$ref" not in part:
            return part
        return {**self.described(self.definitions[_definition(part)]), **part}

    def _words(self, name: str, part: Part, key: str, *, alone: bool) -> Iterator[str]:
        if name == "string" and not alone and part.get("pattern") == _SUBSTITUTION:
            return  # the introduction explains that variables are allowed everywhere
        if name == "string" and part.get("pattern") == _EXPRESSION:
            yield "`{expression}`"
        elif name == "object":
            yield self._map(part, key)
        elif name == "array" and _is_part(part, "items"):
            yield f"list of {self._plural(part['items'], key)}"
        else:
            yield _WORDS[name]

    def _map(self, part: Part, key: str) -> str:
        if _is_part(part, "additionalProperties"):
            held = part["additionalProperties"]
            return f"map of names to {self._links(held, key) or self.kind(held, key)}"
        return self._links(part, key) or "map"

    def _plural(self, part: Part, key: str) -> str:
        kind = self._links(part, key) or self.kind(part, key)
        return re.sub(r"\b(string|number|boolean|integer)\b", r"\1s", kind)

    def _links(self, part: Part, key: str) -> str:
        if _NAMES.get(_definition(part)):
            return ""
        return _either([_link(section.heading) for section in self.maps(part, key)])

    def _section(self, heading: str, part: Part, required: frozenset[str]) -> Section:
        return Section(heading, part, required | frozenset(part.get("required", ())))

    def _heading(self, name: str, part: Part) -> str:
        title: str = part["title"]
        return _HEADINGS.get(name, f"{title[0].upper()}{title[1:]}")


def page() -> str:
    """Return the page."""
    details = Details()
    parts = [INTRODUCTION.read_text(encoding="utf-8").replace("FUNCTIONS", _functions())]
    known: set[str] = set()
    for name in SCHEMAS:
        whole = schema(name)
        document = Schema(name, whole["definitions"])
        document.collect_sections(whole)
        for section in document.sections.values():
            if section.heading not in known:
                known.add(section.heading)
                parts.append(_rendered(section, document, details))
    return "\n".join(parts)


@dataclass(slots=True)
class Details:
    """What the cells of the tables leave out: below the first table that has the key."""

    headings: dict[tuple[str, str], str] = field(default_factory=dict)
    rows: set[str] = field(default_factory=set)

    def has_shown(self, row: str) -> bool:
        """Return whether an earlier table has the row; note it."""
        has_shown = row in self.rows
        self.rows.add(row)
        return has_shown

    def lines(self, heading: str, texts: dict[str, str]) -> Iterator[str]:
        """Yield a list of the texts by key, and where the ones are that an earlier section has."""
        elsewhere: dict[str, list[str]] = {}
        for key, text in texts.items():
            first = self.headings.setdefault((key, text), heading)
            if first == heading:
                yield from _detail(key, text)
            else:
                elsewhere.setdefault(first, []).append(f"`{key}`")
        for first, keys in elsewhere.items():
            yield f"- {', '.join(keys)}: see {_link(first)}"


def _detail(key: str, text: str) -> Iterator[str]:
    """Yield the lines of a list item; the values of an enumeration are items of their own."""
    choices = re.search(r"(?:^|(?<=\s))\w+: [^;.]*(?:; \w+: [^;.]*)+\.", text)
    if choices is None:
        yield f"- `{key}`: {text}"
        return
    before, after = text[: choices.start()].strip(), text[choices.end() :].strip()
    yield f"- `{key}`: {' '.join(part for part in (before, after) if part)}".rstrip(": ")
    for choice in choices[0].removesuffix(".").split("; "):
        value, _, meaning = choice.partition(": ")
        yield f"    - `{value}`: {meaning}"


def _cell_and_details(text: str) -> tuple[str, str]:
    """Return the sentences of a description that a cell has, and the others."""
    first, *others = re.split(r"(?<=\.)\s+(?=[A-Z`a-z])", text)
    while (
        others and len(f"{first} {others[0]}".split()) <= _WORDS_IN_CELL and ": " not in others[0]
    ):
        first = f"{first} {others.pop(0)}"
    return first, " ".join(others)


def _rendered(section: Section, document: Schema, details: Details) -> str:
    level = "##" if section.heading in _FILES.values() else "###"
    lines = [f"{level} {section.heading}", ""]
    if "description" in section.part:
        lines += [section.part["description"], ""]
    lines += ["| Key | Description | Value | Example |", "|---|---|---|---|"]
    texts = {}
    for key, part in section.part["properties"].items():
        described = document.described(part)
        cell, text = _cell_and_details(described.get("description", "").strip())
        row = _row(key, part, cell, section, document)
        if key in _EVERYWHERE and details.has_shown(row):
            continue
        lines.append(row)
        if text:
            texts[key] = text
    if texts:
        lines += ["", *details.lines(section.heading, texts)]
    alternatives = [choice["required"] for choice in section.part.get("anyOf", ())]
    if alternatives:
        names = _either([f"`{name}`" for choice in alternatives for name in choice])
        lines += ["", f"At least one of {names} is required."]
    return "\n".join([*lines, ""])


def _row(key: str, part: Part, what: str, section: Section, document: Schema) -> str:
    described = document.described(part)
    if key in section.required:
        what = f"**Required.** {what}"
    elif key in section.declared:
        what = f"**Required** unless set by a node type. {what}"
    kind = document.kind(part, f"#{key}")
    if "default" in described and key not in section.required:
        kind += f"; default: `{_flow(described['default'])}`"
    example = f"`{_flow(described['examples'][0])}`" if described.get("examples") else ""
    cells = [f"`{key}`", what, kind, example]
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _functions() -> str:
    names = [f"`{name}()`" for name in FUNCTIONS]
    return ", ".join([*names, *(f"`{name}`" for name in CONSTANTS)])


def _branches(part: Part) -> list[Part]:
    return [part[key] for key in ("then", "else") if key in part]


def _is_part(part: Part, key: str) -> bool:
    return isinstance(part.get(key), dict)


def _definition(part: Part) -> str:
    return str(part.get("$ref", "")).rpartition("/")[2]


def _limits(part: Part) -> str:
    if "minimum" in part and "maximum" in part:
        return f", from {_flow(part['minimum'])} to {_flow(part['maximum'])}"
    if "minimum" in part:
        return f", at least {_flow(part['minimum'])}"
    if "exclusiveMinimum" in part:
        return f", above {_flow(part['exclusiveMinimum'])}"
    return ""


def _either(words: list[str]) -> str:
    *most, last = dict.fromkeys(words) or [""]
    return f"{', '.join(most)} or {last}" if most else last


def _link(heading: str) -> str:
    text = heading if heading.startswith("QoS") else heading[0].lower() + heading[1:]
    return f"[{text}](#{heading.lower().replace(' ', '-')})"


def _flow(value: Any) -> str:
    """Return a value as YAML in one line."""
    if isinstance(value, dict | list):
        text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000)
        return text.strip()
    return value if isinstance(value, str) else json.dumps(value)


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Write docs/language.md from the JSON Schemas: a section for a kind of map, a row for a key.

What is said of a key is its description in ``schemas/parts``; the words around it are in
``tools/language_introduction.md``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from composer.expressions import CONSTANTS, FUNCTIONS
from composer.schema import SCHEMAS, schema

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "language.md"
INTRODUCTION = Path(__file__).with_name("language_introduction.md")

Part = dict[str, Any]

#: Headings of maps whose titles are not enough to tell them apart.
_HEADINGS = {
    "#lifecycle": "Lifecycle of the system",
    "inline_node": "Inline node",
    "node_lifecycle": "Lifecycle of a node",
    "node_with_type": "Node with a type",
    "watch": "Watch of a node",
    "watch_all": "Watch of the system",
}
_FILES = {"system": "System", "node": "Node type", "project": "Project"}
#: A key of a connection that names nothing could mean any of the three kinds.
_NOT_SHOWN = {"unnamed_connection"}
#: What the introduction tells about, or what a word says better than its parts.
_NAMES = {"fields": "[fields](#fields)", "parameter_value": "value of a parameter"}
_WORDS = {
    "object": "map",
    "array": "list",
    "string": "text",
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
    "null": "null",
}
_SUBSTITUTION = r"\$\{"
_EXPRESSION = r"\{"


@dataclass(frozen=True, slots=True)
class Section:
    """A kind of map: its heading and its keys.

    ``required`` must be there; ``declared`` must be there too, but for maps that only change what a
    node type has.
    """

    heading: str
    part: Part
    required: frozenset[str]
    declared: frozenset[str] = frozenset()

    def met_again(self, other: Section) -> Section:
        """Return the section with what another place wants of the same map."""
        always = self.required & other.required
        sometimes = self.required | self.declared | other.required
        return replace(self, required=always, declared=sometimes - always)


@dataclass(slots=True)
class Schema:
    """One schema, and the sections found in it so far, in the order they are come to."""

    name: str
    definitions: Part
    sections: dict[str, Section] = field(default_factory=dict)

    def look_through(self, whole: Part) -> None:
        """Find the sections of the schema, each before those of its own keys."""
        waiting = [self._section(_FILES[self.name], whole, frozenset())]
        while waiting:
            section = waiting.pop(0)
            known = self.sections.get(section.heading)
            self.sections[section.heading] = known.met_again(section) if known else section
            if known is not None:
                continue
            waiting += [
                inner
                for key, part in section.part["properties"].items()
                for inner in self.maps(part, f"#{key}")
            ]

    def maps(self, part: Part, name: str, required: frozenset[str] = frozenset()) -> list[Section]:
        """Return the kinds of map that ``part`` is, holds by name, or lists."""
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
        return [found for one in inner for found in self.maps(one, name, required)]

    def kind(self, part: Part, key: str) -> str:
        """Return what may stand under ``key``, or in what does, with links to sections."""
        if "$ref" in part:
            definition = _definition(part)
            return _NAMES.get(definition) or self.kind(self.definitions[definition], definition)
        if "enum" in part:
            return _either([f"`{word}`" for word in part["enum"]])
        choices = [one for one in _branches(part) if "enum" in one]
        if choices and "type" not in part:
            return self.kind(choices[0], key)
        types = part.get("type", [])
        words = [
            word
            for name in ([types] if isinstance(types, str) else types)
            for word in self._words(name, part, key, alone=isinstance(types, str))
        ]
        return _either(words) + _limits(part)

    def described(self, part: Part) -> Part:
        """Return ``part`` with what its definition says beside what it says itself."""
        if "$ref" not in part:
            return part
        return {**self.described(self.definitions[_definition(part)]), **part}

    def _words(self, name: str, part: Part, key: str, *, alone: bool) -> Iterator[str]:
        if name == "string" and not alone and part.get("pattern") == _SUBSTITUTION:
            return  # that a variable may stand anywhere is said once, in the introduction
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
        return {"text": "texts"}.get(kind, kind)

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
    parts = [INTRODUCTION.read_text(encoding="utf-8").replace("FUNCTIONS", _functions())]
    known: set[str] = set()
    for name in SCHEMAS:
        whole = schema(name)
        found = Schema(name, whole["definitions"])
        found.look_through(whole)
        for section in found.sections.values():
            if section.heading not in known:
                known.add(section.heading)
                parts.append(_rendered(section, found))
    return "\n".join(parts)


def _rendered(section: Section, found: Schema) -> str:
    level = "##" if section.heading in _FILES.values() else "###"
    lines = [f"{level} {section.heading}", ""]
    if "description" in section.part:
        lines += [section.part["description"], ""]
    lines += ["| key | what it says | what stands there | for example |", "|---|---|---|---|"]
    for key, part in section.part["properties"].items():
        lines.append(_row(key, part, section, found))
    alternatives = [choice["required"] for choice in section.part.get("anyOf", ())]
    if alternatives:
        names = _either([f"`{name}`" for choice in alternatives for name in choice])
        lines += ["", f"At least {names} must be there."]
    return "\n".join([*lines, ""])


def _row(key: str, part: Part, section: Section, found: Schema) -> str:
    described = found.described(part)
    what = described.get("description", "").strip()
    if key in section.required:
        what = f"**Must be there.** {what}"
    elif key in section.declared:
        what = f"**Must be there**, unless a node type has said it. {what}"
    kind = found.kind(part, f"#{key}")
    if "default" in described:
        kind += f"; `{_flow(described['default'])}` by default"
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
    """Return a value as YAML in one line, in JSON's way where that is as short."""
    if isinstance(value, dict | list):
        text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000)
        return text.strip()
    return value if isinstance(value, str) else json.dumps(value)


def main() -> None:
    """Write the page anew."""
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Statements in ``tests/unit/rules/statements``: what a mistake in Python code breaks."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from composer.base.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_of_each

FOLDER = Path(__file__).parents[1] / "rules" / "statements"


@dataclass(frozen=True)
class Statements:
    """A system, a module ``code`` with places for statements, and the statements of each place."""

    system: str
    code: str
    mistakes: dict[str, list[tuple[str, str, str]]]
    right: dict[str, list[str]]

    @classmethod
    def read(cls, name: str) -> Statements:
        text = (FOLDER / f"{name}.yaml").read_text(encoding="utf-8")
        return cls(**yaml.load(text, yaml.CSafeLoader))

    def code_with(self, place: str = "", statement: str = "") -> str:
        """Return the code with a statement in one place, and ``pass`` in the others."""
        return self.code_with_each({place: statement})

    def code_with_each(self, statements: Mapping[str, str]) -> str:
        """Return the code with statements by place, and ``pass`` in the other places."""

        def fill(found: re.Match[str]) -> str:
            text = statements.get(found[2], "pass")
            return found[1] + text.replace("\n", f"\n{found[1]}")

        places = "|".join({*self.mistakes, *self.right})
        return re.sub(rf"^( *){{({places})}}$", fill, self.code, flags=re.MULTILINE)


def diagnostics_of(system: str, codes: Sequence[str], folder: Path) -> list[list[Diagnostic]]:
    """Return the diagnostics of each text, as module ``code`` of the same system."""
    projects = [{"system.yaml": system, "code.py": code} for code in codes]
    return diagnostics_of_each(projects, folder)

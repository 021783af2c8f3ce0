"""Statements in ``tests/unit/rules/statements``: what a mistake in Python code breaks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from composer.base.diagnostics import Diagnostic
from composer.loading import load_files

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
        return cls(**yaml.safe_load((FOLDER / f"{name}.yaml").read_text(encoding="utf-8")))

    def code_with(self, place: str = "", statement: str = "") -> str:
        """Return the code with a statement in one place, and ``pass`` in the others."""

        def fill(found: re.Match[str]) -> str:
            text = statement if found[2] == place else "pass"
            return found[1] + text.replace("\n", f"\n{found[1]}")

        places = "|".join({*self.mistakes, *self.right})
        return re.sub(rf"^( *){{({places})}}$", fill, self.code, flags=re.MULTILINE)


def diagnostics_of(system: str, codes: Sequence[str], folder: Path) -> list[list[Diagnostic]]:
    """Return the diagnostics of each text, as module ``code`` of the same system.

    All at once: the type checker starts once, which takes most of the time.
    """
    paths = []
    for index, code in enumerate(codes):
        home = folder / str(index)
        home.mkdir()
        name = f"code_{index}"
        (home / f"{name}.py").write_text(code, encoding="utf-8")
        path = home / "system.yaml"
        path.write_text(system.replace(" code:", f" {name}:"), encoding="utf-8")
        paths.append(path)
    return [result.diagnostics for result in load_files(paths)]

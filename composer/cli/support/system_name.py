"""What people call a running system: its name, or the file it was run from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from composer.cli.support.failure import Failure

RunningSystem = Annotated[
    str,
    typer.Argument(
        metavar="SYSTEM",
        help="The name of a running system (pipeline, /robot1/pipeline), or its file.",
        show_default=False,
    ),
]

#: One running system, or whichever there are.
AnyRunningSystem = Annotated[
    str | None,
    typer.Argument(metavar="[SYSTEM]", help="A running system, or its file.", show_default=False),
]


def name_of_system(text: str) -> str:
    """Return the name that ``text`` means: of a file, what it calls its system.

    Raises Failure when the file cannot be read or is no system.
    """
    if not text.endswith((".yaml", ".yml")):
        return text
    from composer.document import read_document
    from composer.tree import Scalar

    tree, _, findings = read_document(Path(text))
    name = tree.get("system") if tree is not None else None
    if isinstance(name, Scalar) and isinstance(name.value, str):
        return name.value
    why = findings[0].message if findings else "it has no key 'system'"
    hint = findings[0].hint if findings else None
    raise Failure(f"'{text}' is not a system: {why}", hint=hint)

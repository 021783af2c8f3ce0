"""What the tests of ``resolve`` share: from YAML text to the model."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from textwrap import dedent

from composer.base.diagnostics import Diagnostic
from composer.base.source import SourceFile, Span
from composer.language.document import parse_document
from composer.language.expand import expand
from composer.language.tree import Mapping
from composer.model import System
from composer.model.resolve import OverrideOptions, read_overrides, resolve
from composer.project import Project
from composer.project.node_types import NodeTypes

NOWHERE = Path("/nowhere")


def tree_of(text: str, name: str = "f") -> Mapping:
    """Parse a text that has nothing wrong in it, as the file ``name``."""
    tree, diagnostics = parse_document(SourceFile(name, dedent(text)))
    assert [diagnostic.message for diagnostic in diagnostics] == []
    assert tree is not None
    return tree


def resolve_text(
    text: str, folder: Path = NOWHERE, settings: Iterable[str] = (), namespace: str | None = None
) -> tuple[System, list[Diagnostic]]:
    """Resolve a text; node types are looked for in ``folder``."""
    tree = tree_of(text, "robot.yaml")
    source = tree.span.file
    expanded, *_ = expand(tree, {})
    overrides, found = read_overrides(OverrideOptions(tuple(settings), namespace))
    system, more = resolve(
        expanded,
        source,
        NodeTypes((folder,), Project(folder, folder)),
        folders={source.path: folder},
        overrides=overrides,
    )
    assert system is not None
    return system, [*found, *more]


def system_of(
    text: str, folder: Path = NOWHERE, settings: Iterable[str] = (), namespace: str | None = None
) -> System:
    """Resolve a text that has nothing wrong in it."""
    system, diagnostics = resolve_text(text, folder, settings, namespace)
    assert [diagnostic.message for diagnostic in diagnostics] == []
    return system


def quoted(span: Span) -> str:
    """Return the text that a span covers."""
    return span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]

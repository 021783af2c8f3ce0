"""The whole pure pipeline: from a file to its model and everything that is wrong with it.

Document, kind, what is included, variables, schema, model, checks - each stage runs on whatever the
one before left it, so that one run shows every finding.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from collections.abc import Mapping as Map
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from composer.assembly import NodeTypeFile, assemble, inherited
from composer.assembly.telling import once, with_includes
from composer.catalog import Catalog, interface_folders
from composer.diagnostics import Diagnostic, Severity, has_errors, in_order, registered_rules
from composer.document import parse_bytes, read_document
from composer.expand import expand
from composer.interfaces import Interfaces
from composer.model import System
from composer.project import SETTINGS_FILE, Project, Settings
from composer.project.choices import told, wrong_choices
from composer.resolve import NOTHING_SAID, CommandLine, Overrides, read_overrides, resolve
from composer.rules import Context, all_checks, run_checks
from composer.rules.unused_ignore import without_ignored
from composer.rules.unused_node_type import unused_node_types
from composer.schema import check_schema, kind_of, kinds
from composer.schema.kinds import check_kind
from composer.source import SourceFile, Span
from composer.tree import Mapping


@dataclass(frozen=True, slots=True)
class LoadResult:
    """What came of a file. ``system`` is None when too little of it could be read.

    ``source`` is the text, ``project`` what it belongs to; ``catalog`` and ``interfaces`` are what
    the checks knew. ``tree`` is all that the file says together with what it includes or extends.
    """

    system: System | None
    diagnostics: list[Diagnostic]
    source: SourceFile
    project: Project
    catalog: Catalog
    interfaces: Interfaces
    tree: Mapping | None = None

    @property
    def sound(self) -> bool:
        """True when there is a system or a node type, whole and without errors."""
        return self.system is not None and not has_errors(self.diagnostics)

    @property
    def runnable(self) -> bool:
        """True when there is a system, whole and without errors."""
        return self.system is not None and not self.system.node_type and self.sound


def load(
    path: Path,
    *,
    shown: str | None = None,
    said: CommandLine = NOTHING_SAID,
    interfaces: Interfaces | None = None,
) -> LoadResult:
    """Read, resolve and check the system or node type in the file ``path``.

    ``shown`` is the file's name in findings, ``said`` what a command line says on top of the file.
    ``interfaces`` may be given by who loads many files of one project: reading them is what takes
    time.
    """
    overrides, found = read_overrides(said)
    known = _Known.of(_real_folder(path), interfaces)
    return _load_file(path, shown, known, overrides, found)


def load_files(paths: Iterable[Path]) -> list[LoadResult]:
    """Load the files, each called as it is given; files of one project share its interfaces."""
    shared: dict[tuple[Path, ...], Interfaces] = {}
    by_folder: dict[Path, _Known] = {}
    loadings = []
    for path in paths:
        folder = _real_folder(path)
        if folder not in by_folder:
            by_folder[folder] = _Known.shared(folder, shared)
        loadings.append(_load_file(path, str(path), by_folder[folder]))
    return loadings


def _load_file(
    path: Path,
    shown: str | None,
    known: _Known,
    overrides: Overrides | None = None,
    found: Iterable[Diagnostic] = (),
) -> LoadResult:
    tree, source, findings = read_document(path, shown)
    if path.name == SETTINGS_FILE:  # what is wrong with it is told of its project
        tree, findings = None, []
    return _load(tree, source, [*findings, *found], known, overrides or Overrides())


def load_bytes(
    content: bytes, folder: Path, *, shown: str, interfaces: Interfaces | None = None
) -> LoadResult:
    """Do the same for what came from elsewhere, as if it were a file in ``folder``."""
    tree, source, findings = parse_bytes(content, shown)
    return _load(
        tree, source, findings, _Known.of(_real_folder(folder / shown), interfaces), Overrides()
    )


def means_the_same(loading: LoadResult, text: str) -> bool:
    """Say whether ``text`` in the place of the file that was loaded would give the same model."""
    again = load_bytes(
        text.encode(), Path.cwd(), shown=loading.source.path, interfaces=loading.interfaces
    )
    return again.system == loading.system


def findings_of(loadings: Collection[LoadResult]) -> list[Diagnostic]:
    """Return what is to be said of all files together, and of each, everything once.

    What is found in a file that is itself among them is told of it alone, and not again of the
    systems that include or use it; in another file it is told of the first of these systems.
    """
    teller: dict[_Told, LoadResult] = {}
    for loading in loadings:
        for finding in loading.diagnostics:
            if finding.primary.file == loading.source:
                teller[_told(finding)] = loading
    findings = project_findings(loadings)
    for loading in loadings:
        findings += (
            finding
            for finding in loading.diagnostics
            if teller.setdefault(_told(finding), loading) is loading
        )
    return in_order(findings)


_Told: TypeAlias = tuple[str, str]


def _told(finding: Diagnostic) -> _Told:
    """Return what tells a finding from others, whatever the system that it was found in."""
    return (finding.rule.code, str(finding.primary))


def project_findings(loadings: Collection[LoadResult]) -> list[Diagnostic]:
    """Return what is to be said of files only when they are looked at together."""
    systems = [loading.system for loading in loadings if loading.system is not None]
    settings = {loading.source.path: loading.project.settings for loading in loadings}
    findings: list[Diagnostic] = []
    for finding in unused_node_types(systems):
        kept = without_ignored([finding], finding.primary.file, complete=False)
        findings += told(kept, settings[finding.primary.file.path])
    return in_order(findings)


@dataclass(frozen=True, slots=True)
class _Known:
    """What a file may refer to."""

    folder: Path
    project: Project
    catalog: Catalog
    interfaces: Interfaces

    @classmethod
    def of(cls, folder: Path, interfaces: Interfaces | None) -> _Known:
        project = Project.at(folder)
        known = interfaces
        if known is None:
            known = Interfaces.load(interface_folders(project))
        return cls(folder, project, Catalog.of(project), known)

    @classmethod
    def shared(cls, folder: Path, shared: dict[tuple[Path, ...], Interfaces]) -> _Known:
        """Return the same with the interfaces that other folders of the project have, too."""
        project = Project.at(folder)
        folders = interface_folders(project)
        if folders not in shared:
            shared[folders] = Interfaces.load(folders)
        return cls(folder, project, Catalog.of(project), shared[folders])


def _load(
    tree: Mapping | None,
    source: SourceFile,
    found: list[Diagnostic],
    known: _Known,
    overrides: Overrides,
) -> LoadResult:
    resolved = _resolved(tree, source, known, overrides) if tree else _Resolved()
    system = resolved.system
    findings = [*found, *resolved.findings]
    if system is not None:
        refused = tuple(item.primary for item in findings if item.severity is Severity.ERROR)
        context = Context(
            system, known.interfaces, known.catalog, refused, is_partial=resolved.is_partial
        )
        findings.extend(run_checks(context))
        findings = once(findings, (node.name for node in system.nodes))
    findings = with_includes(findings, resolved.included)
    # In a node type alone much goes unsaid that its comments may be about.
    judged = system is not None and not system.node_type
    kept = without_ignored(findings, source, complete=judged)
    settings = known.project.settings
    chosen = [*told(kept, settings), *known.project.findings, *_wrong_choices(settings)]
    return LoadResult(
        system,
        in_order(chosen),
        source,
        known.project,
        known.catalog,
        known.interfaces,
        resolved.tree,
    )


def _wrong_choices(settings: Settings) -> Iterator[Diagnostic]:
    all_checks()  # their rules are known once they are imported
    return wrong_choices(settings, tuple(registered_rules()))


def _real_folder(path: Path) -> Path:
    """Return the folder that a file is in; of a link, the one of what it leads to."""
    try:
        return path.resolve().parent
    except (OSError, RuntimeError, ValueError):  # told when it is read
        return Path.cwd()


@dataclass(frozen=True, slots=True)
class _Resolved:
    """What came of a tree: all of it in one tree, and as a model."""

    tree: Mapping | None = None
    system: System | None = None
    findings: tuple[Diagnostic, ...] = ()
    included: Map[str, tuple[Span, ...]] = field(default_factory=dict)
    is_partial: bool = False


def _resolved(
    tree: Mapping,
    source: SourceFile,
    known: _Known,
    overrides: Overrides,
) -> _Resolved:
    match kind_of(tree):
        case kinds.SYSTEM:
            return _resolved_system(tree, source, known, overrides)
        case kinds.NODE:
            return _resolved_node_type(tree, source, known, overrides)
        case _:
            wrong = check_kind(tree, source)
            return _Resolved(findings=() if wrong is None else (wrong,))


def _resolved_system(
    tree: Mapping, source: SourceFile, known: _Known, overrides: Overrides
) -> _Resolved:
    whole = assemble(tree, source, known.folder, known.project)
    if whole.tree is None:
        return _Resolved(findings=tuple(whole.findings), included=whole.included)
    system, found = resolve(
        whole.tree,
        source,
        known.catalog,
        folders=whole.folders,
        overrides=overrides,
    )
    findings = (*whole.findings, *found)
    return _Resolved(whole.tree, system, findings, whole.included, whole.is_partial)


def _resolved_node_type(
    tree: Mapping, source: SourceFile, known: _Known, overrides: Overrides
) -> _Resolved:
    whole = inherited(NodeTypeFile(known.folder / Path(source.path).name, source, tree))
    if whole.tree is None:
        return _Resolved(findings=tuple(whole.findings))
    expanded, findings = expand(whole.tree, {})
    findings = [*whole.findings, *findings, *check_schema(expanded, kinds.NODE)]
    system, found = resolve(
        expanded,
        source,
        known.catalog,
        folders=whole.folders,
        overrides=overrides,
    )
    return _Resolved(whole.tree, system, (*findings, *found))

"""The interfaces of ports."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from composer.base.diagnostics import Diagnostic, Label, error, nearest, shown
from composer.base.source import shown_path
from composer.interfaces import Interfaces, InvalidDefinition
from composer.interfaces.index import similar_interface
from composer.interfaces.sources import FOLDERS
from composer.model import ChannelKind, Port
from composer.model.interface_packages import how_to_build
from composer.rules.analysis.context import KINDS_OF_INTERFACES, Context, is_unresolved
from composer.rules.analysis.formatting import a
from composer.rules.analysis.subjects import package_subjects

UNKNOWN_INTERFACE = error("RC301", "unknown-interface")
OUTDATED_INTERFACE = error("RC307", "outdated-interface")


def check_unknown_interface(context: Context) -> Iterator[Diagnostic]:
    """Look up the type of every port."""
    hints: dict[tuple[str, str], str | None] = {}
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if is_unresolved(name.value) or context.interfaces.find(name.value) is not None:
                continue
            problem = context.interfaces.problem(name.value)
            if problem is not None:
                yield _invalid_definition(context, port, problem)
                continue
            key = (name.value, port.kind.channel.interface_folder)
            if key not in hints:
                hints[key] = _interface_hint(context, port)
            yield Diagnostic(
                UNKNOWN_INTERFACE,
                f"there is no {_type_word(port.kind.channel)} type '{name}'",
                name.span,
                hint=hints[key],
                subjects=package_subjects(context.interfaces, name.value),
                relies_on=(("folder", "interfaces"),),
            )


def _invalid_definition(context: Context, port: Port, problem: InvalidDefinition) -> Diagnostic:
    """Report an error in a definition: in its file, if that is one of the project."""
    used = port.interface.span
    if context.interfaces.source_folder(problem.name) is None or not problem.path:
        return Diagnostic(
            UNKNOWN_INTERFACE, str(problem), used, hint=f"see {shown(problem.place, limit=300)}"
        )
    label = Label(used, f"'{port.name}' has this type")
    return Diagnostic(UNKNOWN_INTERFACE, str(problem), problem.span, (label,), problem.hint)


def invalid_definitions(interfaces: Interfaces, packages: Collection[str]) -> Iterator[Diagnostic]:
    """Check all definitions of some packages of a project, whether a system uses them or not."""
    for folder in FOLDERS:
        for name in interfaces.names(folder):
            if name.partition("/")[0] in packages and interfaces.find(name) is None:
                problem = interfaces.problem(name)
                if problem is not None:
                    yield Diagnostic(
                        UNKNOWN_INTERFACE, str(problem), problem.span, hint=problem.hint
                    )


def _type_word(kind: ChannelKind) -> str:
    return "message" if kind is ChannelKind.TOPIC else kind.value


def _interface_hint(context: Context, port: Port) -> str | None:
    folder = port.kind.channel.interface_folder
    name = port.interface.value
    package, slash, rest = name.partition("/")
    known = context.interfaces.names(folder)
    full = f"{package}/{folder}/{rest.rpartition('/')[2]}"
    if full in known:
        return f"write '{full}'"
    incomplete = context.interfaces.folder_without_manifest(package)
    if incomplete is not None:
        return f"'{shown_path(incomplete)}' has no package.xml: add one that names '{package}'"
    hint = similar_interface(full if slash else name, known)
    if not slash:
        return hint or f"include the package, as in std_msgs/{folder}/Name"
    packages = context.interfaces.packages()
    if hint is not None and (package in packages or nearest(package, packages) is not None):
        return hint
    source = "or put its source into the folder 'interfaces'"
    install = f"install the package '{shown(package)}', {source}"
    return install if hint is None else f"{install}; {hint}"


def check_wrong_interface_kind(context: Context) -> Iterator[Diagnostic]:
    """Check the kind of every port's type."""
    for node in context.system.nodes:
        for port in node.ports:
            found = context.interfaces.find(port.interface.value)
            kind = port.kind.channel
            actual = kind if found is None else KINDS_OF_INTERFACES[type(found)]
            if actual is kind:
                continue
            yield Diagnostic(
                UNKNOWN_INTERFACE,
                f"'{port.interface}' is {a(_type_word(actual))} type, "
                f"but {a(port.kind)} needs {a(_type_word(kind))} type",
                port.interface.span,
            )


def check_outdated_interface(context: Context) -> Iterator[Diagnostic]:
    """Compare the project's definitions of all port types with the installed ones, if any."""
    checked: set[str] = set()
    reported: set[str] = set()
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if name.value in checked or is_unresolved(name.value):
                continue
            checked.add(name.value)
            outdated = context.interfaces.outdated(name.value)
            if outdated is None or outdated in reported:
                continue
            reported.add(outdated)
            package = outdated.partition("/")[0]
            yield Diagnostic(
                OUTDATED_INTERFACE,
                f"'{outdated}' has changed since the package '{package}' was built",
                name.span,
                hint=how_to_build(package, context.interfaces.source_folder(outdated)),
            )

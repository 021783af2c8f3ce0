"""What a command line sets: ``name=value``, ``--set``, ``--namespace``, ``--use-sim-time``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from composer.base.diagnostics import Diagnostic, error, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span
from composer.language.document import parse_document
from composer.language.tree import Entry, Scalar, Tree, plain
from composer.model import USE_SIM_TIME

ARGUMENTS = "argument"
SET = "--set"
NAMESPACE = "--namespace"
USE_SIM_TIME_OPTION = "--use-sim-time"

RULE = error("RC041", "invalid-override")


@dataclass(frozen=True, slots=True)
class Override:
    """A parameter value from the command line, located there."""

    node: Located[str]
    parameter: Entry


@dataclass(frozen=True, slots=True)
class Overrides:
    """All that a command line sets, parsed."""

    arguments: Mapping[str, Entry] = field(default_factory=dict)
    parameters: tuple[Override, ...] = ()
    namespace: Located[str] | None = None
    use_sim_time: Entry | None = None
    argument_words: tuple[str, ...] = ()
    by_node: dict[str, dict[str, Entry]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        by_node: dict[str, dict[str, Entry]] = {}
        for item in self.parameters:
            by_node.setdefault(item.node.value, {})[item.parameter.name] = item.parameter
        object.__setattr__(self, "by_node", by_node)


@dataclass(frozen=True, slots=True)
class OverrideOptions:
    """Words of a command line.

    ``arguments`` are ``name=value``, ``settings`` are ``node.parameter=value``.
    """

    settings: tuple[str, ...] = ()
    namespace: str | None = None
    use_sim_time: bool = False
    arguments: tuple[str, ...] = ()


NO_OVERRIDES = OverrideOptions()


def read_overrides(options: OverrideOptions) -> tuple[Overrides, list[Diagnostic]]:
    """Parse the override options of a command line.

    Values of settings are YAML as in a file. The last one for a parameter takes effect.
    """
    texts = [setting.replace("\r", " ").replace("\n", " ") for setting in options.settings]
    source = SourceFile(SET, "\n".join(texts))
    diagnostics: list[Diagnostic] = []
    found = (_override(text, source, line, diagnostics) for line, text in enumerate(texts, start=1))
    parameters = tuple(item for item in found if item is not None)
    clock = _use_sim_time() if options.use_sim_time else None
    arguments = _arguments(options.arguments)
    namespace = _namespace(options.namespace)
    return Overrides(arguments, parameters, namespace, clock, options.arguments), diagnostics


def _arguments(words: tuple[str, ...]) -> dict[str, Entry]:
    """Return the arguments by name; a value that is not YAML is a text."""
    texts = [word.replace("\r", " ").replace("\n", " ") for word in words]
    source = SourceFile(ARGUMENTS, "\n".join(texts))
    given = {}
    for line, text in enumerate(texts, start=1):
        name, _, written = text.partition("=")
        span = Span(source, line, len(name) + 2, max(len(written), 1))
        problems: list[Diagnostic] = []
        value = _value(text, len(name) + 1, source, line, problems) if written else None
        if problems or value is None or plain(value) is None:
            value = Scalar(written, span)
        given[name] = Entry(Scalar(name, Span(source, line, 1, len(name))), value)
    return given


def _namespace(namespace: str | None) -> Located[str] | None:
    if namespace is None:
        return None
    source = SourceFile(NAMESPACE, namespace)
    return Located(namespace, Span(source, 1, 1, max(len(namespace), 1)))


def _use_sim_time() -> Entry:
    source = SourceFile(USE_SIM_TIME_OPTION, USE_SIM_TIME_OPTION)
    span = Span(source, 1, 1, len(USE_SIM_TIME_OPTION))
    return Entry(Scalar(USE_SIM_TIME, span, verbatim=False), Scalar(True, span, verbatim=False))


def _override(
    text: str, source: SourceFile, line: int, diagnostics: list[Diagnostic]
) -> Override | None:
    target, equals, _ = text.partition("=")
    node, dot, parameter = target.partition(".")
    if not (equals and dot and node and parameter):
        span = Span(source, line, 1, max(len(text), 1))
        message = f"'{shown(text)}' is not of the form node.parameter=value"
        diagnostics.append(Diagnostic(RULE, message, span))
        return None
    value = _value(text, len(target) + 1, source, line, diagnostics)
    if value is None:
        return None
    name = Scalar(parameter, Span(source, line, len(node) + 2, len(parameter)))
    return Override(Located(node, Span(source, line, 1, len(node))), Entry(name, value))


def _value(
    text: str, start: int, source: SourceFile, line: int, diagnostics: list[Diagnostic]
) -> Tree | None:
    """Return the value after the equals sign."""
    # A document with the value at the same place as in the source.
    key = "v" * (start - 2)
    document = "\n" * (line - 1) + f"{key}: {text[start:]}"
    tree, found = parse_document(source, text=document)
    diagnostics += found
    return tree.get(key) if tree is not None else None

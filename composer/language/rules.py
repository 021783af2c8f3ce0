"""The rules of reading files (YAML, schema, variables, expressions), and the limits for their size.

They allow any file written by hand and generated systems of 2 500 nodes. Checking a file of a
megabyte takes at most about 2 seconds of processor time, whatever it contains, and 200 MB.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self, SupportsIndex

from composer.base.diagnostics import Diagnostic, Severity, error, info

UNREADABLE_FILE = error("RC001", "unreadable-file")
TOO_LARGE = error("RC002", "too-large")
FORBIDDEN_CHARACTER = error("RC004", "forbidden-character")
YAML_SYNTAX = error("RC005", "yaml-syntax")
UNSUPPORTED_YAML = error("RC010", "unsupported-yaml")
DUPLICATE_KEY = error("RC011", "duplicate-key")
BAD_NUMBER = error("RC014", "bad-number")
KEY_WITHOUT_VALUE = error("RC016", "key-without-value")

UNKNOWN_KEY = error("RC101", "unknown-key")
MISSING_KEY = error("RC102", "missing-key")
WRONG_TYPE = error("RC103", "wrong-type")
UNKNOWN_WORD = error("RC104", "unknown-word")
OUT_OF_RANGE = error("RC105", "out-of-range")
KEYS_EXCLUDE_EACH_OTHER = error("RC106", "keys-exclude-each-other")
EMPTY_COLLECTION = error("RC107", "empty-collection")

UNKNOWN_VARIABLE = error("RC281", "unknown-variable")
MALFORMED_VARIABLE = error("RC282", "malformed-variable")
MISSING_VARIABLE = error("RC287", "missing-variable")
CYCLE = error("RC283", "cycle")
DUPLICATE_NAME = error("RC225", "duplicate-name")
UNUSED_DECLARATION = info("RC242", "unused-declaration")
INVALID_EXPRESSION = error("RC440", "invalid-expression")


#: Bytes in a file; checked before it is read.
MAX_BYTES = 2_000_000

#: Nesting depth of maps and lists.
MAX_DEPTH = 32

#: Keys, values, maps and lists in a file, counting values repeated by aliases again.
MAX_VALUES = 200_000

#: Nodes of a system and of the systems that it includes.
MAX_NODES = 2_500

#: Entries of another section of a system and of the systems that it includes, and of a section of
#: a node, such as its parameters.
MAX_ENTRIES = 5_000

#: Errors of one stage of checking a file.
MAX_ERRORS = 500

#: Places at which a check of every port finds something that is not an error.
MAX_FINDINGS = 1_000

#: Copies made by all ``for_each`` of one file.
MAX_COPIES = 5_000

#: Files that a system includes, counting each include.
MAX_INCLUDES = 5_000

#: Keys, values, maps and lists in all files that a system includes, again for each include.
MAX_INCLUDED_VALUES = 200_000

#: Keys and values that the nodes of a system declare; each node counts its node type again.
MAX_DECLARED_VALUES = 300_000

#: Sections of parameter files that nodes get; a program gets the sections of all its files.
MAX_PASSED_SECTIONS = 1_000_000

#: Node names that the patterns of a system stand for.
MAX_MATCHES = 50_000

#: Nesting depth of includes.
MAX_INCLUDE_DEPTH = 16

#: Characters of a number.
MAX_NUMBER_LENGTH = 100

#: The range of ROS integers: int64 and uint64.
MIN_INTEGER = -(2**63)
MAX_INTEGER = 2**64 - 1


class Stopped(Exception):
    """A stage cannot continue with a file; ``diagnostic`` says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


class TooManyErrors(Stopped):
    """A stage has found more than MAX_ERRORS errors: the ``first`` ones, and what says so."""

    def __init__(self, first: list[Diagnostic], diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic)
        self.diagnostics = [*first, diagnostic]


class LimitedDiagnostics(list[Diagnostic]):
    """The diagnostics of one stage. Raises TooManyErrors where there are too many errors.

    An error costs more time than a valid value, as the nearest names are searched for.
    """

    def __init__(self) -> None:
        super().__init__()
        self._errors = 0

    def append(self, item: Diagnostic) -> None:
        """Add a diagnostic. Raises TooManyErrors."""
        self._errors += item.severity is Severity.ERROR
        if self._errors > MAX_ERRORS:
            message = f"there are more than {MAX_ERRORS:,} errors; the rest is not checked"
            raise TooManyErrors([*self], Diagnostic(TOO_LARGE, message, item.primary))
        super().append(item)

    def __delitem__(self, index: SupportsIndex | slice) -> None:
        super().__delitem__(index)
        self._errors = sum(item.severity is Severity.ERROR for item in self)

    def __iadd__(self, items: Iterable[Diagnostic]) -> Self:  # type: ignore[misc,override]  # adds nothing else
        for item in items:
            self.append(item)
        return self

"""Rules on Python in general: imports, names, calls and types."""

from __future__ import annotations

from composer.diagnostics import error, info, warning
from composer.rules.python.definitions import on_tick

_FAILING = on_tick(
    'raise TransitionFailed("why")', head="from composer.behavior import TransitionFailed"
)

UNKNOWN_IMPORT = error(
    code="RC444",
    name="unknown-import",
    summary="A file imports a module or a name that does not exist.",
    why="The node cannot be created if an import of its module fails.",
    bad=_FAILING.replace("Failed", "Faild"),
    good=_FAILING,
)
MODULE_NOT_INSTALLED = info(
    code="RC445",
    name="module-not-installed",
    summary="A file imports a module that is not found on this computer.",
    why=(
        "The node cannot be created on a computer without the module. If it is installed "
        "where the system runs, or found at run time, ignore this."
    ),
    bad=on_tick("fastkalman.predict()", head="import fastkalman"),
    good=on_tick("gc.collect()", head="import gc"),
)
INTERNAL_IMPORT = warning(
    code="RC446",
    name="internal-import",
    summary="A behavior imports an internal module of the composer.",
    why=(
        "Only composer.behavior and composer.typed are an API: other modules change without "
        "notice, and may not work outside the process that they were written for."
    ),
    bad=on_tick("print(join(self.name, self.name))", head="from composer.names import join"),
    good=on_tick("print(self.name)"),
)
UNDEFINED_NAME = warning(
    code="RC447",
    name="undefined-name",
    summary="A name is neither defined nor imported.",
    why="The line raises NameError when it is reached.",
    bad=on_tick("count = 1", "print(cuont)"),
    good=on_tick("count = 1", "print(count)"),
)
MISSING_ATTRIBUTE = warning(
    code="RC458",
    name="missing-attribute",
    summary="An object does not have the attribute.",
    why="The line raises AttributeError when it is reached.",
    bad=on_tick("print(math.sqroot(2.0))", head="import math"),
    good=on_tick("print(math.sqrt(2.0))", head="import math"),
)
CALL_ARGUMENTS = warning(
    code="RC452",
    name="call-arguments",
    summary="A call does not fit the parameters of the function.",
    why="The call raises TypeError, or passes a value that contradicts the annotation.",
    bad=on_tick("print(math.sqrt())", head="import math"),
    good=on_tick("print(math.sqrt(2.0))", head="import math"),
)
TYPE_ERROR = warning(
    code="RC455",
    name="type-error",
    summary="The types of values do not allow an operation.",
    why="The line raises TypeError, or a value has another type than its annotation says.",
    bad=on_tick('print("count: " + 1)'),
    good=on_tick('print("count: " + str(1))'),
)
MISSING_SELF = error(
    code="RC449",
    name="missing-self",
    summary="A method lacks its first argument 'self'.",
    why=(
        "Python passes the object as the first argument of every method. Without 'self', "
        "the call raises TypeError, or the arguments are shifted by one."
    ),
    bad=on_tick("pass").replace("(self)", "()"),
    good=on_tick("pass"),
)
UNUSED_RESULT = warning(
    code="RC453",
    name="unused-result",
    summary="A statement is without effect.",
    why=(
        "'self.count == 0' compares and forgets the result: assign with '='. 'self.report' "
        "names a method without calling it."
    ),
    bad=on_tick("count = 1", "count == 0"),
    good=on_tick("count = 0"),
)
NOT_CHECKED = info(
    code="RC437",
    name="not-checked",
    summary="Python code was not checked, or not completely.",
    why="Mistakes in it are only found when the code runs.",
    bad="""\
print(f"rate {rate["hz"]}")  # Python 3.11 reads the file, and this needs 3.12
""",
    good="""\
print(f"rate {rate['hz']}")
""",
)

PYTHON_SYNTAX = error(
    code="RC441",
    name="python-syntax",
    summary="The module of a behavior or class is not valid Python.",
    why=(
        "The node cannot be created. The module is parsed and not executed; the type checker "
        "finds what only Python's compiler refuses, such as 'await' outside an async function."
    ),
    bad=on_tick("await self.clock.sleep(0.05)"),
    good=on_tick("await self.clock.sleep(0.05)", is_async=True),
)

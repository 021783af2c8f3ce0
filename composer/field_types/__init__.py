"""Do the values fit? Types of field paths, of expressions and of templates, before anything runs.

How a check uses it::

    scope = {"message": definition, "count": INTEGER, "now": NUMBER, "node": TEXT,
             "parameters": {"rate_hz": parameter_type("double")},
             "state": {"last_s": type_of(0.0)}}
    judge = Judge(context.interfaces, scope)
    yield from judge.template(send.content, definition)   # publish, call, respond, result
    yield from judge.text(reaction.log)                   # log: only the expressions in it
    yield from judge.condition(reaction.when, span)       # when, accept: true or false
    yield from judge.expression(expression, span)         # anything else

Each yields ``Problem(message, span, hint)``. A scope maps the names an expression may use to their
types: a ``Message``, a ``FieldType``, a map of names to types, or ``ANYTHING`` where it is not
known. What is not known is never a problem, and one mistake gives one problem.
"""

from composer.field_types.judge import Judge
from composer.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    TEXT,
    Anything,
    PathProblem,
    Problem,
    Scope,
    ValueType,
    parameter_type,
    resolve_path,
    type_of,
)

__all__ = [
    "ANYTHING",
    "BOOL",
    "INTEGER",
    "NUMBER",
    "TEXT",
    "Anything",
    "Judge",
    "PathProblem",
    "Problem",
    "Scope",
    "ValueType",
    "parameter_type",
    "resolve_path",
    "type_of",
]

"""Static types of field paths, expressions and templates.

Example::

    scope = {"message": definition, "count": INTEGER, "now": NUMBER, "node": STRING,
             "parameters": {"rate_hz": parameter_type("double")},
             "state": {"last_s": type_of(0.0)}}
    checker = FieldChecker(context.interfaces, scope)
    yield from checker.template(send.content, definition)   # publish, call, respond, result
    yield from checker.text(reaction.log)                   # log: checks only the expressions
    yield from checker.condition(reaction.when, span)       # when, accept: true or false
    yield from checker.expression(expression, span)         # anything else

Each yields ``Problem(message, span, hint)``. A scope maps the names that an expression can use to
their types: a ``Message``, a ``FieldType``, a map of names to types, or ``ANYTHING`` if the type is
unknown. Unknown types never cause a problem, and one mistake causes one problem.
"""

from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.constants import (
    constant_problem,
    enumerator_problem,
    enumerators,
)
from composer.interfaces.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STATUS,
    STRING,
    Anything,
    PathProblem,
    Problem,
    Scope,
    ValueType,
    Word,
    described,
    fields_of,
    is_bool,
    is_number,
    is_string,
    parameter_type,
    resolve_path,
    type_of,
)

__all__ = [
    "ANYTHING",
    "BOOL",
    "INTEGER",
    "NUMBER",
    "STATUS",
    "STRING",
    "Anything",
    "FieldChecker",
    "PathProblem",
    "Problem",
    "Scope",
    "ValueType",
    "Word",
    "constant_problem",
    "described",
    "enumerator_problem",
    "enumerators",
    "fields_of",
    "is_bool",
    "is_number",
    "is_string",
    "parameter_type",
    "resolve_path",
    "type_of",
]

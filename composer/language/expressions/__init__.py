"""The language of ``{...}`` and ``when:``, small enough to be safe and compiled to be fast.

An expression reads fields (``message.twist.linear.x``, ``message.poses[-1].pose``), compares,
combines with ``and``, ``or``, ``not``, calculates with ``+ - * / // %`` on numbers, chooses with
``a if condition else b``, tests ``x in ('a', 'b')`` and calls the functions in
``operations.FUNCTIONS``. There is nothing else: what is not listed is refused when it is compiled.

How safety is kept: ``syntax`` lets through ASCII names, numbers, texts and a few operators only;
``builder`` builds a *new* syntax tree that calls nothing but the functions of ``operations``;
those look at the type of a value before they touch it and bound every number.
"""

from composer.language.expressions.builder import compile_expression, path_of
from composer.language.expressions.expression import (
    EvaluationError,
    Expression,
    ExpressionError,
    FieldPath,
    map_key,
)
from composer.language.expressions.operations import CONSTANTS, FUNCTIONS
from composer.language.expressions.syntax import MAXIMUM_LENGTH, MAXIMUM_NODES

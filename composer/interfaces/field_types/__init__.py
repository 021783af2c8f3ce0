"""Static types of field paths, expressions and templates.

Example::

    scope = {"message": definition, "count": INTEGER, "now": NUMBER, "node": STRING,
             "parameters": {"rate_hz": parameter_type("double")},
             "state": {"last_s": type_of(0.0)}}
    checker = FieldChecker(context.interfaces, scope)
    yield from checker.template(send.content, definition)   # publish, call, respond, result
    yield from checker.text(reaction.log)                   # log: checks only the expressions
    yield from checker.condition(expression, span)          # when, accept: true or false
    yield from checker.expression(expression, span)         # anything else

Each yields diagnostics. A scope maps the names that an expression can use to
their types: a ``Message``, a ``FieldType``, a map of names to types, or ``ANYTHING`` if the type is
unknown. Unknown types never cause a problem, and one mistake causes one problem.
"""

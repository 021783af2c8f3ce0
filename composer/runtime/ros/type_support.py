"""How Python loads the type support of messages, without the generator of message classes.

Every message class imports ``rosidl_generator_py``, which also imports its generator, with a parser
and a template engine: 50 ms of CPU time. The package leaves out a generator that cannot be
imported, as is the case where only what programs need at run time is installed. Import this module
before the first type support is loaded. See docs/decisions/0014-start-up.md.
"""

from __future__ import annotations

import sys

_GENERATOR = "rosidl_generator_py.generate_py_impl"
_is_hidden = _GENERATOR not in sys.modules
if _is_hidden:
    sys.modules[_GENERATOR] = None  # type: ignore[assignment]  # importlib: it cannot be imported
from rosidl_generator_py.import_type_support_impl import UnsupportedTypeSupport  # noqa: E402

if _is_hidden:
    del sys.modules[_GENERATOR]

__all__ = ["UnsupportedTypeSupport"]

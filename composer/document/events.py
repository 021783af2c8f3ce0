"""YAML events, from libyaml where PyYAML was built with it, else from PyYAML's own parser.

Only events are taken: a composer builds recursively, and libyaml's crashes the process on deep
input. The events come one by one, so that a reader which has seen enough stops the parser too.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing

import yaml

from composer.document.limits import MAX_DEPTH, MAX_VALUES
from composer.document.spans import Mark

_LOADER: type[yaml.SafeLoader | yaml.CSafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def parse_events(text: str) -> Generator[yaml.Event, None, None]:
    """Yield the events of ``text``. Raises yaml.YAMLError; PyYAML's own parser also ValueError."""
    loader = _LOADER(text)
    try:
        while (event := loader.get_event()) is not None:
            yield event
    finally:
        loader.dispose()


def excess(text: str) -> Mark | None:
    """Return where the first value stands that is one too many; None where there is none.

    Events alone are had in a tenth of the time that the tree takes. Whatever else is wrong with
    the text, and the values that aliases repeat, is found in building the tree.
    """
    if len(text) < 2 * MAX_VALUES:  # a value takes a character, and one between it and the next
        return None
    values = depth = 0
    with closing(parse_events(text)) as stream:
        for event in stream:
            if isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
            elif isinstance(event, yaml.NodeEvent):
                values += 1
                depth += isinstance(event, yaml.CollectionStartEvent)
            if values > MAX_VALUES:
                return event.start_mark
            if depth > MAX_DEPTH:
                return None
    return None

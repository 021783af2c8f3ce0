"""YAML events, from libyaml where PyYAML was built with it, else from PyYAML's own parser.

This reads events only: YAML composers are recursive, and libyaml's crashes the process on deeply
nested input. Events come one by one, so that a consumer can stop the parser early.
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


def first_excess_value(text: str) -> Mark | None:
    """Return the location of the first value beyond MAX_VALUES, or None.

    Reading the events takes a tenth of the time of building the tree. Other errors, and values
    repeated by aliases, are found when the tree is built.
    """
    if len(text) < 2 * MAX_VALUES:  # each value takes a character and a separator
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

"""YAML events, from libyaml where PyYAML was built with it, else from PyYAML's own parser.

Only events are taken: a composer builds recursively, and libyaml's crashes the process on deep
input. The events come one by one, so that a reader which has seen enough stops the parser too.
"""

from __future__ import annotations

from collections.abc import Generator

import yaml

_LOADER: type[yaml.SafeLoader | yaml.CSafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def parse_events(text: str) -> Generator[yaml.Event, None, None]:
    """Yield the events of ``text``. Raises yaml.YAMLError; PyYAML's own parser also ValueError."""
    yield from yaml.parse(text, Loader=_LOADER)

"""Write composer/interfaces/jazzy.json from the interfaces installed in this environment.

Run it in an environment with ROS 2 Jazzy and composer_interfaces when either of them changes::

    python tools/bundle_interfaces.py

Packages that this environment lacks keep their definitions. These are not on PyPI; the snapshot has
the fields and constants of the versions for Jazzy: composition_interfaces 2.0.3,
control_msgs 5.8.0, example_interfaces 0.12.0, geographic_msgs 1.0.5, nav2_msgs 1.3.13,
tf2_msgs 0.36.4 and vision_msgs 4.1.1.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from composer.interfaces.parser import without_comments
from composer.interfaces.sources import FOLDERS, installed_prefixes

TARGET = Path(__file__).parent.parent / "composer" / "interfaces" / "jazzy.json"


def definitions(known: Mapping[str, str]) -> dict[str, str]:
    """Return all installed definitions without comments, by name.

    Those of packages that are not installed are taken from ``known``.
    """
    installed = frozenset().union(*(prefix.packages() for prefix in installed_prefixes()))
    texts = {name: text for name, text in known.items() if name.split("/")[0] not in installed}
    for prefix in installed_prefixes():
        for folder in FOLDERS:
            for name in prefix.names(folder):
                definition = prefix.read(name)
                if definition is not None and not definition.is_json:
                    texts.setdefault(name, without_comments(definition.text))
    return dict(sorted(texts.items()))


def main() -> None:
    """Write the snapshot if it changes: make compiles the interfaces again after it was written."""
    before = TARGET.read_text(encoding="utf-8")
    text = json.dumps(definitions(json.loads(before)), indent=0, ensure_ascii=False) + "\n"
    if text != before:
        TARGET.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

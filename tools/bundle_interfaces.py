"""Write composer/interfaces/jazzy.json from the interfaces installed in this environment.

Run it in an environment with ROS 2 Jazzy and composer_interfaces when either of them changes::

    python tools/bundle_interfaces.py
"""

from __future__ import annotations

import json
from pathlib import Path

from composer.interfaces.parser import without_comments
from composer.interfaces.sources import FOLDERS, installed_prefixes

TARGET = Path(__file__).parent.parent / "composer" / "interfaces" / "jazzy.json"


def definitions() -> dict[str, str]:
    """Return all installed definitions without comments, by name."""
    texts: dict[str, str] = {}
    for prefix in installed_prefixes():
        for folder in FOLDERS:
            for name in prefix.names(folder):
                definition = prefix.read(name)
                if definition is not None and not definition.is_json:
                    texts.setdefault(name, without_comments(definition.text))
    return dict(sorted(texts.items()))


def main() -> None:
    """Write the snapshot."""
    text = json.dumps(definitions(), indent=0, ensure_ascii=False)
    TARGET.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Write docs/rules.md, the list of the rules."""

from __future__ import annotations

from pathlib import Path

from composer.report.rules import all_rules, index

PAGE = Path(__file__).parents[1] / "docs" / "rules.md"


def main() -> None:
    """Write the page."""
    PAGE.write_text(index(all_rules()), encoding="utf-8")


if __name__ == "__main__":
    main()

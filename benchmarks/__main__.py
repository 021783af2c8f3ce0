"""Run every benchmark and print its table."""

from __future__ import annotations

from benchmarks import start_up, validation


def main() -> None:
    start_up.main()
    print()
    validation.main()


if __name__ == "__main__":
    main()

"""Run every benchmark and print its table."""

from __future__ import annotations

from benchmarks import start_up


def main() -> None:
    start_up.main()


if __name__ == "__main__":
    main()

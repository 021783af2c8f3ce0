"""Fuzz ``compose validate``: ``make fuzz``.

Hypothesis generates inputs with errors, as in the property tests: systems, node types, settings,
interface definitions and parameter files, and systems to draw. If atheris is installed, it also
generates files and expressions guided by coverage. Inputs that cause a failure are stored in
``build/fuzz``: turn them into tests before fixing the code. ``--seed`` makes the inputs
reproducible, for CI.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import itertools
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUTPUT = ROOT / "build" / "fuzz"
TARGETS = ("file", "expression")
EXAMPLES_PER_ROUND = 500


def main() -> None:
    """Run the fuzzers; exit with status 1 on a failure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="total time (default: 600)")
    parser.add_argument(
        "--seed", type=int, default=time.time_ns() % 2**31, help="seed of the random generator"
    )
    parser.add_argument("--target", choices=TARGETS, help=argparse.SUPPRESS)
    options, rest = parser.parse_known_args()
    sys.path.insert(0, str(ROOT))
    OUTPUT.mkdir(parents=True, exist_ok=True)
    if options.target is not None:
        _guided(options.target, rest)
        return
    with_atheris = importlib.util.find_spec("atheris") is not None
    share_s = options.seconds / (1 + len(TARGETS) * with_atheris)
    _mutations(share_s, options.seed)
    if not with_atheris:
        print("atheris is not installed: fuzzing without coverage guidance", file=sys.stderr)
        return
    for target in TARGETS:
        _start_guided(target, share_s, options.seed)


def _mutations(seconds: float, first: int) -> None:
    """Run the property tests of validation with new examples until the time is over."""
    from hypothesis import given, seed, settings  # noqa: PLC0415

    from tests.properties.surfaces import SURFACES, Surface  # noqa: PLC0415

    def check_surface(surface: Surface, first: int) -> None:
        """Check new inputs of one kind."""

        @many
        @seed(first)
        @given(surface.inputs)
        def hold(data: bytes) -> None:
            surface.check(data)

        hold()

    many = settings(max_examples=EXAMPLES_PER_ROUND, deadline=None, database=None)
    end_s = time.monotonic() + seconds
    for number, name in enumerate(itertools.cycle(SURFACES)):
        check_surface(SURFACES[name], first + number)
        done = (number + 1) * EXAMPLES_PER_ROUND
        print(f"{done} inputs with errors, last: {name}", file=sys.stderr, flush=True)
        if time.monotonic() > end_s:
            return


def _start_guided(target: str, seconds: float, seed: int) -> None:
    """Run libFuzzer in a separate process, since it takes over its process."""
    corpus = OUTPUT / f"corpus_{target}"
    corpus.mkdir(exist_ok=True)
    for number, text in enumerate(_seeds(target)):
        (corpus / f"seed_{number}").write_text(text, encoding="utf-8")
    command = [sys.executable, __file__, "--target", target, str(corpus)]
    limits = ["-rss_limit_mb=1000", "-timeout=10", f"-artifact_prefix={OUTPUT}/{target}_"]
    ended = subprocess.run(
        [*command, f"-max_total_time={int(seconds)}", f"-seed={seed}", *limits],
        cwd=ROOT,
        env={**os.environ, "PYTHONHASHSEED": "0"},  # reproducible coverage
        check=False,
    )
    if ended.returncode:
        raise SystemExit(1)


def _seeds(target: str) -> Iterable[str]:
    texts = [path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("[sn]*s/*.yaml"))]
    if target == "file":
        return texts
    return (match[1] for text in texts for match in re.finditer(r"\{([^{}:]+)\}", text))


def _guided(target: str, arguments: list[str]) -> None:
    import atheris  # type: ignore[import-not-found]  # noqa: PLC0415

    with atheris.instrument_imports(include=["composer"]):
        run_one = {"file": _file, "expression": _expression}[target]()
    atheris.Setup([sys.argv[0], *arguments], run_one)
    atheris.Fuzz()


def _file() -> Callable[[bytes], None]:
    from tests.properties.validating import validate_and_check  # noqa: PLC0415

    def run_one(data: bytes) -> None:
        validate_and_check(data)

    return run_one


def _expression() -> Callable[[bytes], None]:
    from composer.language.expressions import (  # noqa: PLC0415
        EvaluationError,
        ExpressionError,
        compile_expression,
    )

    scope = {"parameters": {"a": 1, "b": 2.5}, "state": {"s": "x"}, "count": 3, "now": 1.5}

    def run_one(data: bytes) -> None:
        text = data.decode("utf-8", errors="replace")
        with contextlib.suppress(ExpressionError, EvaluationError):
            compile_expression(text).evaluate(scope)

    return run_one


if __name__ == "__main__":
    main()

"""Look for inputs that ``compose validate`` cannot take: ``make fuzz``, for as long as you like.

Two ways, in turns: hypothesis with files that have mistakes in them, as the tests have but without
end; and atheris, where it is installed, with bytes and expressions, guided by what code they reach.
What breaks a promise ends this with the input in ``build/fuzz``: make it a test, then mend it.
With ``--seed`` the inputs are the same each time, as CI wants them; what is new is found without.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOUND = ROOT / "build" / "fuzz"
TARGETS = ("file", "expression")
EXAMPLES_PER_ROUND = 2000


def main() -> None:
    """Run what the command line asks for; exit code 1 when something was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="for how long (600)")
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**31, help="where to begin")
    parser.add_argument("--target", choices=TARGETS, help=argparse.SUPPRESS)
    options, rest = parser.parse_known_args()
    sys.path.insert(0, str(ROOT))
    FOUND.mkdir(parents=True, exist_ok=True)
    if options.target is not None:
        _guided(options.target, rest)
        return
    with_atheris = importlib.util.find_spec("atheris") is not None
    share_s = options.seconds / (1 + len(TARGETS) * with_atheris)
    _mutations(share_s, options.seed)
    if not with_atheris:
        print("atheris is not installed: nothing is guided by coverage", file=sys.stderr)
        return
    for target in TARGETS:
        _start_guided(target, share_s, options.seed)


def _mutations(seconds: float, first: int) -> None:
    """Validate what the property tests validate, again and again, each time other examples."""
    from hypothesis import given, seed, settings  # noqa: PLC0415

    from tests.properties.test_validate_total import MISTAKEN, MISWRITTEN  # noqa: PLC0415
    from tests.properties.validating import judge  # noqa: PLC0415

    def hold(data: bytes) -> None:
        judge(data)

    many = settings(max_examples=EXAMPLES_PER_ROUND, deadline=None, database=None)
    end_s = time.monotonic() + seconds
    examples = 0
    while time.monotonic() < end_s:
        for inputs in (MISTAKEN, MISWRITTEN):
            many(seed(first + examples)(given(inputs)(hold)))()
            examples += EXAMPLES_PER_ROUND
            print(f"{examples} files with mistakes", file=sys.stderr, flush=True)


def _start_guided(target: str, seconds: float, seed: int) -> None:
    """Run libFuzzer in a process of its own, for it takes over the one it is in."""
    corpus = FOUND / f"corpus_{target}"
    corpus.mkdir(exist_ok=True)
    for number, text in enumerate(_seeds(target)):
        (corpus / f"seed_{number}").write_text(text, encoding="utf-8")
    command = [sys.executable, __file__, "--target", target, str(corpus)]
    limits = ["-rss_limit_mb=1000", "-timeout=10", f"-artifact_prefix={FOUND}/{target}_"]
    ended = subprocess.run(
        [*command, f"-max_total_time={int(seconds)}", f"-seed={seed}", *limits],
        cwd=ROOT,
        env={**os.environ, "PYTHONHASHSEED": "0"},  # the same branches for the same input
        check=False,
    )
    if ended.returncode:
        raise SystemExit(1)


def _seeds(target: str) -> Iterable[str]:
    texts = [path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("[sn]*s/*.yaml"))]
    if target == "file":
        return texts
    return (found[1] for text in texts for found in re.finditer(r"\{([^{}:]+)\}", text))


def _guided(target: str, arguments: list[str]) -> None:
    import atheris  # type: ignore[import-not-found]  # noqa: PLC0415

    with atheris.instrument_imports(include=["composer"]):
        take = {"file": _file, "expression": _expression}[target]()
    atheris.Setup([sys.argv[0], *arguments], take)
    atheris.Fuzz()


def _file() -> Callable[[bytes], None]:
    from tests.properties.validating import judge  # noqa: PLC0415

    def take(data: bytes) -> None:
        judge(data)

    return take


def _expression() -> Callable[[bytes], None]:
    from composer.expressions import (  # noqa: PLC0415
        EvaluationError,
        ExpressionError,
        compile_expression,
    )

    scope = {"parameters": {"a": 1, "b": 2.5}, "state": {"s": "x"}, "count": 3, "now": 1.5}

    def take(data: bytes) -> None:
        text = data.decode("utf-8", errors="replace")
        with contextlib.suppress(ExpressionError, EvaluationError):
            compile_expression(text).evaluate(scope)

    return take


if __name__ == "__main__":
    main()

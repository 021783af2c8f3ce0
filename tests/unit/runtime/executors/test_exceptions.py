"""What user code raises is described whatever its methods do."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import pytest

from composer.behavior import CallError
from composer.runtime.executors.tracebacks import (
    describe,
    is_closing,
    printable,
    report_of,
    shown,
    text_of,
)


class Odd(Exception):
    """An exception whose text is what a function returns or raises."""

    def __init__(self, text: Callable[[], Any]) -> None:
        super().__init__()
        self._text = text

    def __str__(self) -> str:
        return self._text()


def no_text() -> str:
    raise ValueError("no text")


class Text(str):
    __slots__ = ()

    def split(self, *_: Any) -> Any:
        raise RuntimeError

    def __format__(self, _: str) -> str:
        raise RuntimeError


class NameRaises(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise RuntimeError


class KindWithoutName(Exception, metaclass=NameRaises):
    pass


class NotesRaise(Exception):
    @property
    def __notes__(self) -> Any:
        raise RuntimeError


class ReprRaises:
    def __repr__(self) -> str:
        raise KeyboardInterrupt


def raised(error: BaseException) -> BaseException:
    """Return ``error`` with a traceback."""
    try:
        raise error  # noqa: TRY301
    except BaseException as caught:
        return caught


FAILED = "<its text is not available: __str__ failed>"


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ValueError("two\nlines"), "ValueError: two lines"),
        (ValueError(), "ValueError"),
        (KeyError("a"), "KeyError: 'a'"),
        (GeneratorExit("out"), "GeneratorExit: out"),
        (Odd(no_text), f"Odd: {FAILED}"),
        (Odd(sys.exit), f"Odd: {FAILED}"),
        (Odd(lambda: 3), f"Odd: {FAILED}"),
        (Odd(lambda: Text("a strange text")), "Odd: a strange text"),
        (KindWithoutName("why"), "exception: why"),
        (NotesRaise("why"), "NotesRaise: why"),
        (ValueError("\udc80"), "ValueError: \\udc80"),
    ],
)
def test_every_exception_has_a_line_and_a_report(error: BaseException, text: str) -> None:
    line = describe(error)
    assert line == text
    assert type(line) is str
    assert report_of(raised(error)).startswith(f"{text}\n")
    report_of(raised(error)).encode()


def test_a_huge_text_is_cut() -> None:
    error = raised(ValueError("x" * 10_000_000))
    assert len(describe(error)) < 1_100
    assert "characters omitted" in describe(error)
    assert len(report_of(error)) < 25_000


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (text_of(CallError("no server")), "no server"),
        (text_of(CallError()), "CallError"),
        (text_of(Odd(no_text)), f"Odd: {FAILED}"),
        (shown([1, 2]), "[1, 2]"),
        (shown(ReprRaises()), "a ReprRaises whose __repr__ failed"),
        (f"{len(shown('x' * 10_000))}", "80"),
        (printable("Grüße"), "Grüße"),
        (printable("\udc80"), "\\udc80"),
        (printable(Text("a")), "a"),
        (printable(3), "3"),
    ],
)
def test_texts_of_exceptions_and_values(found: str, expected: str) -> None:
    assert found == expected
    assert type(found) is str


def test_a_report_has_the_frames_of_user_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COMPOSE_DEBUG", raising=False)
    with pytest.raises(ValueError, match="no text") as caught:
        printable(Odd(no_text))
    assert 'test_exceptions.py", line' in report_of(caught.value)
    assert "executors/tracebacks.py" not in report_of(caught.value)
    assert report_of(ValueError("never raised")) == "ValueError: never raised"
    monkeypatch.setenv("COMPOSE_DEBUG", "1")
    assert "executors/tracebacks.py" in report_of(caught.value)


def test_closing_differs_from_a_generator_exit_of_user_code() -> None:
    found: list[bool] = []

    class Wait:
        def __await__(self) -> Any:
            yield None

    async def user_code(*, raises: bool) -> None:
        if raises:
            raise GeneratorExit
        await Wait()

    async def caller(*, raises: bool) -> None:
        try:
            await user_code(raises=raises)
        except BaseException as error:
            found.append(is_closing(error))
            raise

    waiting = caller(raises=False)
    waiting.send(None)
    waiting.close()
    with pytest.raises(GeneratorExit):
        caller(raises=True).send(None)
    assert found == [True, False]

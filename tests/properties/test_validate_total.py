"""The whole of validating takes whatever people, programs and accidents make of a file."""

from __future__ import annotations

import json

from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.properties.mutation import mutated
from tests.properties.validating import SHIPPED, contents, judge

CONTENTS = contents()
TEXTS = [path.read_text(encoding="utf-8") for path in SHIPPED]


@st.composite
def spliced(draw: st.DrawFn) -> str:
    """Draw a shipped file with pieces lost, doubled, moved and changed."""
    lines = draw(st.sampled_from(TEXTS)).splitlines(keepends=True)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(lines)))
        end = draw(st.integers(start, min(start + 4, len(lines))))
        piece = lines[start:end]
        match draw(st.sampled_from(["lose", "double", "move", "indent", "insert"])):
            case "lose":
                lines[start:end] = []
            case "double":
                lines[start:start] = piece
            case "move":
                lines[start:end] = []
                place = draw(st.integers(0, len(lines)))
                lines[place:place] = piece
            case "indent":
                lines[start:end] = [f"  {line}" for line in piece]
            case "insert":
                other = draw(st.sampled_from(TEXTS)).splitlines(keepends=True)
                lines[start:start] = draw(st.lists(st.sampled_from(other), max_size=3))
    return "".join(lines)


#: A shipped file that says something else here and there; and one that is written otherwise.
MISTAKEN = st.sampled_from(CONTENTS).flatmap(mutated).map(lambda said: json.dumps(said).encode())
MISWRITTEN = spliced().map(str.encode)


@settings(max_examples=150, deadline=None)
@given(MISTAKEN)
def test_files_with_mistakes(data: bytes) -> None:
    judge(data)


@settings(max_examples=100, deadline=None)
@given(MISWRITTEN)
@example(b"")
@example(b"system: a\nnodes: {b: {type: [x]}}\n")
def test_files_with_pieces_out_of_place(data: bytes) -> None:
    judge(data)


def test_shipped_files_are_clean() -> None:
    for text in TEXTS:
        assert judge(text.encode("utf-8")) == []

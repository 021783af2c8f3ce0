"""Names, messages and parameters of other processes do not control the terminal."""

from __future__ import annotations

import json
from io import StringIO
from types import SimpleNamespace
from typing import Any

import pytest
import yaml

from composer.base.characters import is_safe
from composer.cli.commands import diff, doctor, nodes, ps
from composer.cli.commands.topic import info_text
from composer.cli.support.progress import Progress
from composer.cli.support.terminal import as_json, as_yaml, columns, lines, say, write
from composer.client.doctor import warning
from composer.model import LogLevel
from composer.plan.drift.drift import Drift, DriftKind
from composer.runtime.supervision.events import Logged, Stopping
from tests.cli.compose import compose

#: Sets the title of the terminal, forges a line, turns the direction of the text, and reports CSI.
HOSTILE = "a\x1b]0;b\x07\n[ERROR] forged\r\u202ec\x9b2J"


def test_what_is_written_is_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    write(HOSTILE)
    say(HOSTILE)
    out, err = capsys.readouterr()
    assert out == err == "a\\x1b]0;b\\x07\n[ERROR] forged\\r\\u202ec\\x9b2J\n"
    assert lines([HOSTILE, "next"]).split("\n")[1] == "next"


def test_columns_stay_aligned() -> None:
    table = columns([("name", "state"), (HOSTILE, "x"), ("\u4e16\u754c", "y"), ("e\u0301", "z")])
    head, hostile, wide, combined = table.split("\n")
    column = head.index("state")
    assert hostile.index("x", column) == column
    assert wide == "\u4e16\u754c".ljust(column - 2) + "y"
    assert combined == "e\u0301".ljust(column + 1) + "z"
    numbers = columns([("\u4e16", "1"), ("b", "10")], numbers_from=1)
    assert numbers.split("\n") == ["\u4e16   1", "b   10"]
    rows = [("node", "sent"), ("/a/long/name", "7"), ("/b", "123")]
    assert columns(rows, numbers_from=1) == (
        "node          sent\n/a/long/name     7\n/b             123"
    )
    assert columns([("a", "b"), ("cc", "")]) == "a   b\ncc"


@pytest.mark.parametrize("options", [(), ("--show-types",)])
def test_a_hostile_name_is_one_line_of_a_list(
    options: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(nodes, "graph_names", lambda *_, **__: [(HOSTILE, (HOSTILE,))])
    done = compose("topic", "list", *options)
    assert done.code == 0
    assert is_safe(done.out)
    assert done.out.count("\n") == 1


@pytest.mark.parametrize("value", [HOSTILE, "\u202e", "\x7f", "\ud800", "\u2028", "caf\xe9"])
def test_data_is_escaped_without_loss(value: str) -> None:
    data: dict[str, Any] = {value: [value]}
    text, shown = as_json(data), as_yaml(data)
    assert is_safe(text)
    assert is_safe(shown)
    assert json.loads(text) == data
    if value != "\ud800":  # PyYAML reads no surrogates
        assert yaml.safe_load(shown) == data


def test_texts_that_are_not_ascii_are_shown_as_they_are() -> None:
    assert as_yaml({"name": "\u4e16 caf\xe9"}) == "name: \u4e16 caf\xe9"
    assert as_json({"name": "\u4e16 caf\xe9"}) == '{"name": "\u4e16 caf\xe9"}'


def test_what_commands_print_of_others_has_the_usual_lines(
    capsys: pytest.CaptureFixture[str],
) -> None:
    drift = Drift(DriftKind.EXTRA_NODE, HOSTILE, hint=HOSTILE)
    write(diff.event_text("drift", drift, json=False))
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert len(doctor.result_text(warning("graph", HOSTILE, HOSTILE)).split("\n")) == 2
    found = {"types": [HOSTILE], "publishers": [], "subscriptions": []}
    assert len(info_text(found, verbose=True).split("\n")) == 3
    report: Any = SimpleNamespace(
        activity="up", message=HOSTILE, host=HOSTILE, pid="1", nodes=(), processes={}
    )
    titles = (ps.system_text(HOSTILE, None), ps.system_text("/robot", report))
    for title in (titles[0], titles[1].partition("\nnode ")[0]):
        assert is_safe(title)
        assert "\n" not in title


def test_a_message_in_the_log_starts_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    stream = StringIO()
    progress = Progress(stream)
    progress.show(Logged(1.0, "planner", LogLevel.INFO, HOSTILE))
    progress.show(Stopping(1.0, HOSTILE))
    shown = stream.getvalue()
    assert is_safe(shown)
    assert [line[:7] for line in shown.splitlines()] == ["[1.000]", "  [ERRO", "[1.000]", "  [ERRO"]

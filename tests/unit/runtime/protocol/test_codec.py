"""Whatever is sent arrives unchanged, and whatever else arrives is refused with a text."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
from contextlib import suppress
from importlib.metadata import version
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from composer.runtime.members.kept_goals import SystemGoals
from composer.runtime.protocol import codec, reports, requests
from composer.runtime.protocol.codec import OtherVersionError, ProtocolError, decode, encode
from composer.runtime.protocol.reports import (
    NodeReport,
    SystemReport,
    TimingReport,
    is_signed,
    signed,
    split_signature,
)
from composer.runtime.protocol.requests import ChangeStates, Restart, Step

KINDS: list[Any] = [
    kind
    for module in (reports, requests)
    for _, kind in inspect.getmembers(module, dataclasses.is_dataclass)
    if kind.__module__ == module.__name__
]
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | NUMBERS | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)
MAPPING = st.dictionaries(st.text(), PLAIN, max_size=3)
st.register_type_strategy(float, NUMBERS)
REPORT = SystemReport("robot", "running", (NodeReport("/arm", "active"),), "vm", "7")
#: Of every dataclass that is sent. A change needs another version of the protocol.
VERSION_OF_FIELDS = (3, "6f32ae85d809")


def values(kind: Any) -> st.SearchStrategy[Any]:
    """Return a strategy for a dataclass; ``Any`` is plain data."""
    hints = inspect.get_annotations(kind, eval_str=True)
    plain = {name: PLAIN for name, hint in hints.items() if hint is Any}
    if kind is requests.DetailsAnswer:
        plain = {"details": st.dictionaries(st.text(), PLAIN)}
    if kind is requests.ParametersAnswer:
        described = st.tuples(st.from_type(requests.ParameterDescription), PLAIN)
        plain = {"nodes": st.dictionaries(st.text(), st.lists(described, max_size=2).map(tuple))}
    if kind is requests.CallNodes:
        plain = {"calls": st.lists(values(requests.NodeCall), max_size=2).map(tuple)}
    if kind is requests.NodeCall:
        plain = {"request": MAPPING}
    if kind is requests.NodeResponses:
        plain = {"responses": st.lists(st.none() | MAPPING, max_size=2).map(tuple)}
    return st.builds(kind, **plain)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_every_dataclass_arrives_unchanged(kind: Any, data: st.DataObject) -> None:
    value = data.draw(values(kind))
    assert decode(encode(value), *KINDS) == value


@given(st.binary(max_size=200) | PLAIN.map(lambda plain: json.dumps(plain).encode()))
def test_any_bytes_give_a_message(content: bytes) -> None:
    with pytest.raises(ProtocolError):
        decode(content, *KINDS)


@given(st.sampled_from(KINDS), PLAIN)
def test_any_content_is_read_or_gives_a_message(kind: Any, content: Any) -> None:
    with suppress(ProtocolError):
        decode(document(type=kind.__name__, content=content), *KINDS)


def document(**changes: Any) -> str:
    return json.dumps({**json.loads(encode(REPORT)), **changes})


def report(**changes: Any) -> str:
    return document(content={**json.loads(encode(REPORT))["content"], **changes})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it is not JSON, or nested too deeply"),
        ("[" * 100_000, "it is not JSON, or nested too deeply"),
        ("[]", "it is not a document of ros2-composer"),
        (document(version="1"), "version: expected an integer, not '1'"),
        (document(type="Restart"), "expected SystemReport or TimingReport, not 'Restart'"),
        (document(type=["x"]), "expected SystemReport or TimingReport, not a list"),
        (document(content=3), "expected an object, not 3"),
        (report(color="red"), "unknown field 'color'"),
        (document(content={"name": "robot"}), "no field 'activity'"),
        (report(pid=7), "pid: expected a text, not 7"),
        (report(number=True), "number: expected an integer, not True"),
        (report(at_s=float("nan")), "at_s: expected a number, not nan"),
        (report(at_s="1e999"), "at_s: expected a number, not '1e999'"),
        (report(at_s=10**400), "at_s: expected a number, not a very large integer"),
        (report(nodes={}), "nodes: expected a list, not an object"),
        (report(nodes=[{"node": "/arm"}]), "nodes[0]: no field 'desired'"),
        (
            report(nodes=[{"node": "/arm", "desired": "active", "sent": {"/a\x1b": "5"}}]),
            r"nodes[0].sent['/a\x1b']: expected an integer, not '5'",
        ),
    ],
)
def test_anything_else_is_refused_with_its_place(text: str, message: str) -> None:
    with pytest.raises(ProtocolError) as problem:
        decode(text, SystemReport, TimingReport)
    assert str(problem.value) == message


def test_an_unknown_value_of_an_enumeration_is_refused() -> None:
    content = {"activity": "paused", "goals": {"/arm": "up"}}
    with pytest.raises(ProtocolError) as problem:
        decode(document(type="SystemGoals", content=content), SystemGoals)
    expected = "goals['/arm']: expected one of unconfigured, inactive, active, not 'up'"
    assert str(problem.value) == expected


@pytest.mark.parametrize(
    ("number", "older"), [(codec.VERSION - 1, "the other one"), (codec.VERSION + 1, "this one")]
)
def test_another_version_says_what_to_update(number: int, older: str) -> None:
    with pytest.raises(OtherVersionError) as problem:
        decode(document(version=number, release="0.9.0\x1b", content={"new": 1}), SystemReport)
    assert str(problem.value) == (
        rf"it is of ros2-composer '0.9.0\x1b' (protocol {number}), this is '{codec.RELEASE}'"
        f" (protocol {codec.VERSION}): update {older}"
    )


def test_the_release_is_that_of_the_project() -> None:
    assert version("ros2-composer") == codec.RELEASE


def test_a_change_of_a_dataclass_is_another_version() -> None:
    """If this fails, increase the version of the protocol, and take the new fingerprint."""
    sent = [*KINDS, SystemGoals]
    fields = {kind.__name__: [(f.name, f.type) for f in dataclasses.fields(kind)] for kind in sent}
    fingerprint = hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()[:12]
    assert (codec.VERSION, fingerprint) == VERSION_OF_FIELDS


def test_the_size_is_limited_and_texts_can_be_cleaned() -> None:
    text = encode(Restart(("/a\x1b[31m",)))
    assert decode(text, Restart, clean=lambda part: part.replace("\x1b", "")) == (
        Restart(("/a[31m",))
    )
    with pytest.raises(ProtocolError, match=r"it has \d+ characters, at most 20 are read"):
        decode(text, Restart, limit=20)


def test_defaults_are_left_out() -> None:
    request = ChangeStates("", "me", 3, (Step(1, "activate", "/arm"),))
    assert json.loads(encode(request))["content"] == {
        "participant": "",
        "sender": "me",
        "seen_report": 3,
        "steps": [{"number": 1, "transition": "activate", "node": "/arm"}],
    }


def test_only_the_key_of_a_report_confirms_it() -> None:
    text = signed(encode(REPORT), "key")
    assert is_signed(text, "key")
    assert decode(split_signature(text)[1], SystemReport) == REPORT
    for forged in (text.replace("vm", "vn"), encode(REPORT), "", f"é{text}", text[1:]):
        assert not is_signed(forged, "key")
    assert not is_signed(text, "other")
    assert not is_signed(encode(REPORT), "")
    assert signed(encode(REPORT), "") == encode(REPORT)

"""Mistakes in files that are included many times: one cause is reported once."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load

MISSPELLED = {
    "argumnets": "system: part\nargumnets: {text: hello}\n"
    + "nodes:\n  a: {log: x}\n".replace("{log: x}", "{on_activate: {log: '${text}'}}"),
    "nodse": "system: part\nnodse: {a: {on_activate: {log: hello}}}\n",
    "executers": "system: part\nexecuters: {fast: {kind: events}}\nnodes: {a: {executor: fast}}\n",
    "qos_profile": "system: part\nqos_profile: {odom: {depth: 3}}\nnodes:\n"
    "  a: {publishers: {p: {type: std_msgs/msg/String, qos: odom, external: true}}}\n",
}


@pytest.mark.parametrize(("key", "text"), MISSPELLED.items(), ids=MISSPELLED)
def test_a_misspelled_section_is_the_only_report(tmp_path: Path, key: str, text: str) -> None:
    (tmp_path / "part.yaml").write_text(text)
    lines = [
        f"  - {{file: part.yaml, prefix: p{n}_, overrides: {{nodes: {{a: {{description: x}}}}}}}}\n"
        for n in range(31)
    ]
    depends = ", ".join(f"p{number}_a" for number in range(31))
    whole = f"system: whole\ninclude:\n{''.join(lines)}nodes:\n"
    whole += f"  last: {{lifecycle: {{depends_on: [{depends}]}}}}\n"
    (tmp_path / "whole.yaml").write_text(whole)
    [diagnostic] = load(tmp_path / "whole.yaml").diagnostics
    assert diagnostic.message == f"'{key}' is not a key of a system"
    assert diagnostic.hint is not None
    assert diagnostic.hint.startswith("did you mean '")


SAID_OF_COPIES = {
    "a cycle": "nodes:\n  a: {lifecycle: {depends_on: [b]}}\n  b: {lifecycle: {depends_on: [a]}}\n",
    "a relative name": "nodes:\n  a: {services: {ask: {type: std_srvs/srv/Trigger, "
    "service: ask/, external: true, respond: {success: true}}}}\n",
}


@pytest.mark.parametrize("text", SAID_OF_COPIES.values(), ids=SAID_OF_COPIES)
def test_one_cause_is_reported_once(tmp_path: Path, text: str) -> None:
    (tmp_path / "part.yaml").write_text(f"system: part\n{text}")
    [alone] = load(tmp_path / "part.yaml").diagnostics
    include = "{file: part.yaml, prefix: p%d_, namespace: ns%d}"
    whole = "".join(f"  - {include}\n" % (number, number) for number in range(31))
    (tmp_path / "whole.yaml").write_text(f"system: whole\ninclude:\n{whole}")
    [diagnostic] = load(tmp_path / "whole.yaml").diagnostics
    assert diagnostic.rule == alone.rule

"""The JSON Schemas in ajv, a validator for editors: valid files pass, others fail."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from jsonschema import Draft7Validator

from composer.base.folders import nodes_folder, systems_folder
from composer.base.source import SourceFile
from composer.language.document import parse_document, read_document
from composer.language.schema import REPORT, SCHEMAS, check_schema, kind_of, schema
from composer.language.tree import plain
from composer.report.machine import render_json
from tests.programs import require_package, run_node
from tests.properties.mutation import mutated

HERE = Path(__file__).parent
NAMES = (*SCHEMAS, REPORT)
Ajv = Callable[[list[tuple[str, Any]]], list[list[str]]]

INVALID = [
    "nodes: {one: {}}",
    "system: a",
    "system: a\nnodes: {}",
    "system: a\nnodes: [one]",
    "system: a\nnods: {one: {}}\nnodes: {one: {}}",
    "system: 5\nnodes: {one: {}}",
    "system: a\nnodes: {one: 5}",
    "system: a\nnodes: {one: {typ: relay}}",
    "system: a\nnodes: {one: {type: relay, behavior: a:B}}",
    "system: a\nnodes: {one: {type: 5}}",
    "system: a\nnodes: {one: {namespace: [a]}}",
    "system: a\nnodes: {one: {publishers: {p: {}}}}",
    "system: a\nnodes: {one: {publishers: {p: {type: std_msgs/msg/String, service: /a}}}}",
    "system: a\nnodes: {one: {publishers: {p: {type: std_msgs/msg/String, external: 'no'}}}}",
    "system: a\nnodes: {one: {subscriptions: {s: {type: std_msgs/msg/String, wen: x}}}}",
    "system: a\nnodes: {one: {subscriptions: {s: {type: std_msgs/msg/String, publish: [a]}}}}",
    "system: a\nnodes: {one: {subscriptions: {s: {type: a/msg/B, log: {level: loud}}}}}",
    "system: a\nnodes: {one: {services: {s: {type: std_srvs/srv/Trigger, when: x}}}}",
    "system: a\nnodes: {one: {clients: {c: {type: std_srvs/srv/Trigger, timeout_ms: 0}}}}",
    "system: a\nnodes: {one: {timers: {t: {log: x}}}}",
    "system: a\nnodes: {one: {timers: {t: {rate_hz: 1, period_ms: 1, log: x}}}}",
    "system: a\nnodes: {one: {timers: {t: {rate_hz: fast, log: x}}}}",
    "system: a\nnodes: {one: {timers: {t: {period_ms: true, log: x}}}}",
    "system: a\nnodes: {one: {parameters: {p: {type: float}}}}",
    "system: a\nnodes: {one: {lifecycle: {depends_on: {b: running}}}}",
    "system: a\nnodes: {one: {lifecycle: {autostart: yes}}}",
    "system: a\nqos_profiles: {q: {depth: -1}}\nnodes: {one: {}}",
    "system: a\nqos_profiles: {q: {reliability: perhaps}}\nnodes: {one: {}}",
    "system: a\nqos_profiles: {q: {deadline: 10}}\nnodes: {one: {}}",
    "system: a\nexecutors: {e: {kind: fast}}\nnodes: {one: {}}",
    "system: a\nexecutors: {e: {threads: 0}}\nnodes: {one: {}}",
    "system: a\nnodes: {one: {}}\nconnections: {topic: /a}",
    "system: a\nnodes: {one: {}}\nconnections: [{from: one.a, to: one.b}]",
    "system: a\nnodes: {one: {}}\nconnections: [{topic: /a, server: one.a}]",
    "system: a\nnodes: {one: {}}\nconnections: [{topic: /a, service: /b, from: one.a}]",
    "system: a\nnodes: {one: {}}\nconnections: [{topic: /a, from: []}]",
    "node: 5",
    "node: a\nnodes: {}",
    "node: a\nvariables: [message_type]",
    "node: a\nvariables: {message_type: {defalt: 5}}",
    "node: a\npublishers: {p: {typ: std_msgs/msg/String}}",
    "node: a\naction_servers: {s: {type: a/action/B, feedback: {count: 0, period_ms: 1}}}",
]


@pytest.fixture(scope="module")
def ajv() -> Ajv:
    require_package(HERE, "ajv")

    def check(documents: list[tuple[str, Any]]) -> list[list[str]]:
        schemas = {name: schema(name) for name in NAMES}
        errors = run_node(HERE, "check.mjs", {"schemas": schemas, "documents": documents})
        return list(errors)

    return check


def document(text: str) -> tuple[str, Any]:
    tree, diagnostics = parse_document(SourceFile("f", text))
    assert tree is not None
    assert diagnostics == []
    return str(kind_of(tree) or "system"), plain(tree)


def shipped() -> list[tuple[str, Any]]:
    folders = (systems_folder(), nodes_folder())
    paths = [path for folder in folders for path in sorted(folder.glob("*.yaml"))]
    return [document(path.read_text(encoding="utf-8")) for path in paths]


def test_shipped_files_and_reports_are_valid(ajv: Ajv) -> None:
    tree, _, diagnostics = read_document(Path("/no/such/file"))
    assert tree is None
    valid = [*shipped(), (REPORT, json.loads(render_json(diagnostics)))]
    *passed, failed = ajv([*valid, (REPORT, {"version": 1, "diagnostics": []})])
    assert passed == [[]] * len(valid)
    assert failed != []


@pytest.mark.parametrize("text", INVALID)
def test_the_composer_rejects_invalid_files(text: str) -> None:
    tree, _ = parse_document(SourceFile("f", text))
    assert tree is not None
    assert check_schema(tree, document(text)[0]) != []


def test_ajv_rejects_invalid_files(ajv: Ajv) -> None:
    errors = ajv(list(map(document, INVALID)))
    assert [text for text, found in zip(INVALID, errors, strict=True) if not found] == []


def test_both_validators_agree_on_mutated_files(ajv: Ajv) -> None:
    documents: list[tuple[str, Any]] = []

    @settings(
        max_examples=400,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.sampled_from(shipped()).flatmap(lambda it: st.tuples(st.just(it[0]), mutated(it[1]))))
    def collect(made: tuple[str, Any]) -> None:
        documents.append(made)

    collect()
    validators = {name: Draft7Validator(schema(name)) for name in SCHEMAS}
    expected = [validators[name].is_valid(content) for name, content in documents]
    actual = [errors == [] for errors in ajv(documents)]
    assert 0 < sum(expected) < len(expected)
    assert actual == expected

"""The access control policy of a system covers all that it does when it runs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.bridges.export.sros2 import SELF_TEST_TOPICS
from composer.runtime.intra_process import ignore_local_publications
from tests.ros.support.commands import Running, listed, output_of, repeated_until, running

#: The sections of 'compose node info', and the rules of a policy.
RULES = {
    "publishers": ("topics", "publish"),
    "subscriptions": ("topics", "subscribe"),
    "services": ("services", "reply"),
    "clients": ("services", "request"),
    "action_servers": ("actions", "execute"),
    "action_clients": ("actions", "call"),
}


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Iterator[Running]:
    folder: Path = tmp_path_factory.mktemp("pipeline")
    with running(folder / "log.txt", "systems/pipeline.yaml") as run:
        run.wait_for("3 of 3 nodes active")
        yield run
        assert run.stop()[0] == 0


#: What is used at the start, with simulated time, or if another process runs the system.
UNUSED = [
    SELF_TEST_TOPICS,
    SELF_TEST_TOPICS,
    "/clock",
    "/pipeline/manager/_instance_*",
]


def rules_of(profile: ElementTree.Element) -> dict[str, set[str]]:
    """Return the rules of a node's policy by the sections of 'compose node info'."""
    return {
        section: {
            element.text or ""
            for group in profile.findall(kind)
            if group.get(attribute) == "ALLOW"
            for element in group
        }
        for section, (kind, attribute) in RULES.items()
    }


def differences(rules: Mapping[str, set[str]], text: str) -> tuple[list[str], list[str]]:
    """Return the endpoints in the output of 'compose node info' without rules, and unused rules."""
    refused: list[str] = []
    unused: list[str] = []
    for section, patterns in rules.items():
        found = {item for item, _ in json.loads(text)[section] if "/_action/" not in item}
        refused += [item for item in found if not any(fnmatchcase(item, r) for r in patterns)]
        unused += [r for r in patterns if not any(fnmatchcase(item, r) for item in found)]
    return refused, unused


def test_the_policy_allows_every_endpoint_and_no_other(pipeline: Running) -> None:
    root = ElementTree.fromstring(output_of("export", "sros2", "systems/pipeline.yaml"))
    profiles = {
        f"{item.get('ns', '').rstrip('/')}/{item.get('node')}": rules_of(item)
        for item in root.findall("enclaves/enclave/profiles/profile")
    }
    assert sorted(profiles) == listed(tuple(profiles), "node", "list").split()
    all_unused = []
    for name, rules in profiles.items():

        def is_complete(text: str) -> bool:
            return set(differences(rules, text)[1]) <= set(UNUSED)  # noqa: B023

        info = repeated_until(is_complete, "node", "info", name, "--json", "-a")
        refused, unused = differences(rules, info)
        assert refused == [], name
        all_unused += unused
    assert sorted(all_unused) == UNUSED


def test_the_topics_of_the_self_test_are_those_of_the_policy() -> None:
    assert f"/{ignore_local_publications.TEST_NODE}/*" == SELF_TEST_TOPICS

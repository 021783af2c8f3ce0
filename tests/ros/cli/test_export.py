"""The access control policy of a system covers all that it does when it runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.export.sros2 import SELF_TEST_TOPICS
from composer.runtime.intra_process import ignore_local_publications
from tests.ros.support.commands import Running, output_of, running

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


def test_the_policy_allows_every_endpoint_and_no_other(pipeline: Running) -> None:
    root = ElementTree.fromstring(output_of("export", "sros2", "systems/pipeline.yaml"))
    profiles = root.findall("enclaves/enclave/profiles/profile")
    names = [f"{item.get('ns', '').rstrip('/')}/{item.get('node')}" for item in profiles]
    assert sorted(names) == sorted(output_of("node", "list").split())
    unused = []
    for name, profile in zip(names, profiles, strict=True):
        info = json.loads(output_of("node", "info", name, "--json", "-a"))
        for section, (kind, attribute) in RULES.items():
            found = {item for item, _ in info[section] if "/_action/" not in item}
            rules = {
                element.text or ""
                for group in profile.findall(kind)
                if group.get(attribute) == "ALLOW"
                for element in group
            }
            refused = [item for item in found if not any(fnmatchcase(item, r) for r in rules)]
            assert refused == [], f"{name} {section}"
            unused += [r for r in rules if not any(fnmatchcase(item, r) for item in found)]
    # What is used at the start, with simulated time, or if another process runs the system.
    assert sorted(unused) == [
        SELF_TEST_TOPICS,
        SELF_TEST_TOPICS,
        "/clock",
        "/pipeline/manager/_instance_*",
        "/pipeline/manager/change_state",
        "/pipeline/manager/change_states",
    ]


def test_the_topics_of_the_self_test_are_those_of_the_policy() -> None:
    assert f"/{ignore_local_publications._TEST_NODE}/*" == SELF_TEST_TOPICS

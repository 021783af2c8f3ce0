"""``compose logs`` with runs in several ROS domains."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from composer.client.run_log import RotatingFile, RunFolder
from composer.client.run_log.reading import Record
from tests.cli.compose import compose


@pytest.fixture(autouse=True)
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs in domain 3, the older of which goes on, and the newest one in domain 4."""
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    for number, (domain, system) in enumerate([("03", "/robot"), ("3", "/arm"), ("4", "/robot")]):
        monkeypatch.setenv("ROS_DOMAIN_ID", domain)
        folder = RunFolder(tmp_path, system)
        folder.path = folder.path.rename(folder.path.with_name(f"2026-03-01-08-3{number}-00-000-7"))
        file = RotatingFile(folder.path)
        file.write(Record(number, "info", "n", "/n", f"in domain {domain}").to_line().encode())
        file.close()
        folder.close()


@pytest.mark.parametrize(
    ("domain", "options", "message", "heading"),
    [
        ("3", (), "in domain 3", "==> /arm, domain 3, started 2026-03-01 "),
        ("4", (), "in domain 4", "==> /robot, domain 4, started 2026-03-01 "),
        ("3", ("--system", "robot"), "in domain 03", "==> /robot, domain 3, started 2026-03-01 "),
        ("", (), "in domain 4", "==> /robot, domain 4, started "),  # none: the newest of all
    ],
)
def test_the_newest_run_in_the_domain_is_printed_below_its_heading(
    domain: str,
    options: tuple[str, ...],
    message: str,
    heading: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    done = compose("logs", *options)
    assert (done.code, done.out.rstrip().endswith(message)) == (0, True)
    assert done.err.startswith(heading)
    assert ", ended (run 2026-03-01-08-3" in done.err


def test_the_list_has_the_domain_of_each_run_and_json_has_no_heading() -> None:
    listed = json.loads(compose("logs", "--list", "--json").out)
    assert [run["domain"] for run in listed] == ["3", "3", "4"]
    assert "system  domain  started" in compose("logs", "--list").out
    done = compose("logs", "--json")
    assert (json.loads(done.out)["message"], done.err) == ("in domain 4", "")

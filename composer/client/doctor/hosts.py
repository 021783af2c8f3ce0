"""The doctor on the other computers of a system, by ssh."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Iterable, Sequence
from contextlib import AsyncExitStack
from pathlib import Path

import asyncssh

from composer.client.doctor import CheckResult, Level, error
from composer.client.hosts.connection import HostError, failure_of, run_command, shown
from composer.client.hosts.remote_command import python_command
from composer.client.hosts.start import connect_all
from composer.model import Host

AREA = "host"
#: How long the checks may take besides those that wait for the ROS graph.
_STARTS_WITHIN_S = 30.0
#: The exit codes of a doctor that has reported its results.
_REPORTED = (0, 1)


def check_hosts(
    hosts: Sequence[Host], root: Path, system: Path, timeout_s: float
) -> list[CheckResult]:
    """Run the doctor on all hosts at once; return the results of each, one after the other.

    ``system`` is relative to ``root``, the root of the project. Raises HostsDiffer if it cannot log
    in to all of them.
    """

    async def run() -> list[CheckResult]:
        async with AsyncExitStack() as stack:
            connections = await connect_all(hosts, root, stack)
            reports = await asyncio.gather(
                *(_check(host, connections[host.name.value], system, timeout_s) for host in hosts)
            )
        return [result for results in reports for result in results]

    return asyncio.run(run())


def read_results(host: Host, text: str) -> Iterable[CheckResult]:
    """Return the results in the JSON of a doctor. Raises ValueError, KeyError, TypeError."""
    return [
        CheckResult(
            shown(str(item["area"])),
            Level(item["level"]),
            shown(f"{host.name}: {item['message']}"),
            None if item["remedy"] is None else shown(str(item["remedy"])),
        )
        for item in json.loads(text)
    ]


async def _check(
    host: Host, connection: asyncssh.SSHClientConnection, system: Path, timeout_s: float
) -> Iterable[CheckResult]:
    words = ("-m", "composer", "doctor", "--json", "--timeout", f"{timeout_s:g}", "--", str(system))
    command = python_command(host, words, os.environ)
    try:
        within_s = timeout_s + _STARTS_WITHIN_S
        done = await run_command(host, connection, command, within_s=within_s)
        if done.status not in _REPORTED or not done.text.startswith("["):
            raise failure_of(host, done.status, done.text + done.errors)
        return read_results(host, done.text)
    except HostError as problem:
        remedy = problem.hint or f"run 'compose doctor {system}' there"
        return [error(AREA, str(problem), remedy)]
    except (ValueError, KeyError, TypeError, RecursionError) as problem:
        message = f"{host.name} ({host.login}): the doctor there has not reported: {problem!s:.200}"
        return [error(AREA, message, f"run 'compose doctor {system}' there")]

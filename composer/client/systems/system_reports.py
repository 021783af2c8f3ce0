"""What managers report about their systems, as it arrives by a topic or the Unix socket."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from composer.base.characters import visible
from composer.runtime.metrics.figures import merged_chains
from composer.runtime.protocol.codec import decode
from composer.runtime.protocol.reports import SystemReport, split_signature

#: None stands for a system that did not respond.
AnyReport = TypeVar("AnyReport", SystemReport, SystemReport | None)


def parse_state(name: str, text: str) -> SystemReport:
    """Return the report of the system ``name`` in a message, which any node may have published.

    Its texts are without control characters. Raises ProtocolError.
    """
    return of_system(name, decode(split_signature(text)[1], SystemReport, clean=visible))


def of_system(name: str, report: SystemReport) -> SystemReport:
    """Return a report with the full name of the system, and the host of each node."""
    nodes = (node if node.host else replace(node, host=report.host) for node in report.nodes)
    return replace(report, name=name, nodes=tuple(nodes))


def with_processes(report: SystemReport, others: Mapping[str, SystemReport]) -> SystemReport:
    """Return a report with the callbacks and chains of other processes, by their names."""
    of_others = (callback for other in others.values() for callback in other.callbacks)
    chains = (chain for other in others.values() for chain in other.chains)
    return replace(
        report,
        callbacks=(*report.callbacks, *of_others),
        chains=merged_chains(report.chains, chains),
        processes_at_s={name: other.callbacks_at_s for name, other in others.items()},
    )


def of_whole_systems(reports: Mapping[str, AnyReport]) -> dict[str, AnyReport]:
    """Return reports by their names, without those of processes whose nodes another one has."""
    answered = [report for report in reports.values() if report is not None]
    others = {name for report in answered for name in report.processes.values()}
    return {name: report for name, report in reports.items() if name not in others}


def with_callbacks_of_processes(reports: Mapping[str, SystemReport]) -> dict[str, SystemReport]:
    """Return reports by their names, each with the callbacks of other processes of its system."""
    found = {}
    for name, report in reports.items():
        known = {
            process: reports[other]
            for process, other in report.processes.items()
            if other in reports
        }
        found[name] = with_processes(report, known)
    return found

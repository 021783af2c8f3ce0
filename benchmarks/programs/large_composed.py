"""Start and stop N idle nodes with the composer."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import yaml

from benchmarks.programs.phases import Phases, size_from_arguments
from benchmarks.programs.work import print_result
from composer.loading import load
from composer.plan import bring_up, tear_down
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import BroughtUp, Event, Stopping

LEAN = dict.fromkeys(("parameters", "rosout", "type_description", "lifecycle_services"), False)


def main() -> None:
    """Bring the system up and down, and print the timings."""
    size = size_from_arguments()
    tree: dict[str, Any] = {
        "system": "large",
        "nodes": {f"node_{index}": {} for index in range(size.nodes)},
    }
    if size.lean:
        tree["introspection"] = LEAN
    phases = Phases()

    def on_event(event: Event) -> None:
        if isinstance(event, BroughtUp):
            phases.has_started()
        elif isinstance(event, Stopping):
            phases.stops()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "large.yaml")
        path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
        phases.starts()
        system = load(path).system
        if system is None:
            sys.exit("the system is not valid")
        options = HostOptions(run_for_s=0.0, stop_within_s=60.0, ends_process=True)
        outcome = Host(system, bring_up(system), tear_down(system), options, on_event).run()
        phases.has_stopped()
    if outcome.exit_code:
        sys.exit(outcome.reason)
    print_result(phases.figures)


if __name__ == "__main__":
    main()

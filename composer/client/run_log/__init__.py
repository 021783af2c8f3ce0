"""The log files of runs: written by ``compose run``, read by ``compose logs``.

::

    <ROS log folder>/compose/robot1.pipeline/2026-03-01-08-30-00-125-4711/   one run, named in UTC
        run.json                     the system, and its process, which holds a lock on this file
        log-000001.jsonl             the oldest file that is left, one JSON object per line
        log-000002.jsonl             written to now

See docs/decisions/0010-output-never-blocks.md.
"""

from composer.client.run_log.reading import Record, Selection, SystemLog, last_records, parse_since
from composer.client.run_log.runs import (
    RotatingFile,
    Run,
    RunFolder,
    current_domain,
    find_parts,
    find_runs,
)

__all__ = [
    "Record",
    "RotatingFile",
    "Run",
    "RunFolder",
    "Selection",
    "SystemLog",
    "current_domain",
    "find_parts",
    "find_runs",
    "last_records",
    "parse_since",
]

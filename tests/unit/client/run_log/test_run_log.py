"""Log files of runs: rotation, runs, reading and selecting."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from composer.cli.support.console import OutputQueue
from composer.client.run_log import (
    FOLDER,
    MAX_RUNS,
    RotatingFile,
    Run,
    RunFolder,
    find_runs,
    log_files,
)
from composer.client.run_log.reading import Record, Selection, SystemLog, parse_line, parse_since

NOW = datetime(2026, 3, 1, 12, 0, 0, tzinfo=UTC)


def record(message: str = "text", level: str = "info", node: str = "/a/planner") -> Record:
    logger = node.strip("/").replace("/", ".")
    return Record(1_772_366_400_123_456_000, level, logger, node, message)


@pytest.mark.parametrize(
    "message", ["plain", "two\nlines", '"', "ä 日本", "\udc80", "\x1b[31m", ""]
)
def test_a_record_is_read_as_it_was_written(message: str) -> None:
    line = record(message).to_line().encode(errors="backslashreplace")
    assert line.count(b"\n") == 1
    assert parse_line(line) == record(message)
    forged = record(message, "info\n[FATAL]", "/x\n[ERROR] [compose]\x1b[2J")
    read = parse_line(forged.to_line().encode(errors="backslashreplace"))
    assert read is not None
    assert (read.level, read.node) == ("info\\n[FATAL]", "/x\\n[ERROR] [compose]\\x1b[2J")


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{",
        b"[1]",
        b'{"time": 1}',
        b"\xff\xfe",
        b"[" * 100_000,
        record().to_line()[:-5].encode(),
        record().to_line().replace('"text"', "7").encode(),
        record().to_line().replace("2026", "9999").encode(),
        record().to_line().replace("2026", "0001").replace("Z", "+23:59").encode(),
    ],
)
def test_what_is_not_a_record_is_skipped(line: bytes) -> None:
    assert parse_line(line) is None


def test_anything_may_be_in_the_log_folder(tmp_path: Path) -> None:
    """Pipes, devices, links to nowhere, dates that are none, and very many entries."""
    logs = tmp_path / FOLDER
    name = "2026-03-01-12-00-00-000-1"
    for system in ("pipes", "devices", "folders", "brackets", "line"):
        (logs / system / name).mkdir(parents=True)
    for file in ("run.json", "log-000001.jsonl"):
        os.mkfifo(logs / "pipes" / name / file)
        (logs / "devices" / name / file).symlink_to("/dev/zero")
        (logs / "folders" / name / file).mkdir()
        (logs / "brackets" / name / file).write_text("[" * 100_000)
        (logs / "line" / name / file).write_text("x" * 3_000_000 + "\n" + record().to_line())
    for system in ("not a name", "two\nlines", "many"):
        (logs / system / name).mkdir(parents=True)
    for number in range(3_000):
        (logs / "many" / f"2026-13-45-99-99-99-999-{number}").mkdir()
    os.mkfifo(logs / "pipe")
    (logs / "loop").symlink_to(logs)
    runs = find_runs(tmp_path)
    assert [run.system for run in runs] == [
        "/brackets", "/devices", "/folders", "/line", "/many", "/pipes"
    ]  # fmt: skip
    for run in runs:
        assert (run.domain, run.is_running(), run.started.year) == ("", False, 2026)
        with SystemLog(tmp_path, run) as log:
            assert [*log.new()] == ([record()] if run.system == "/line" else [])


def test_files_are_rotated_between_lines_and_the_oldest_is_removed(tmp_path: Path) -> None:
    file = RotatingFile(tmp_path, max_bytes=100, max_files=3)
    lines = [f"line {number:03} {'x' * 20}\n".encode() for number in range(50)]
    data = b"".join(lines)
    while data:  # as OutputQueue writes: several lines at once
        data = data[file.write(data[:333]) :]
    file.close()
    files = log_files(tmp_path)
    assert len(files) == 3
    assert all(100 <= path.stat().st_size < 130 for path in files[:-1])
    left = b"".join(path.read_bytes() for path in files)
    assert b"".join(lines).endswith(left)
    assert left.startswith(b"line ")


def test_a_full_disk_loses_lines_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_full, was_refused = True, threading.Event()

    def write(fd: int, data: bytes) -> int:
        if is_full:
            was_refused.set()
            raise OSError(errno.ENOSPC, "No space left on device")
        return real_write(fd, data)

    real_write = os.write
    monkeypatch.setattr(os, "write", write)
    queue = OutputQueue(RotatingFile(tmp_path), lambda count: f"{count} missing\n")
    queue.put("lost\n")
    assert was_refused.wait(60.0)
    is_full = False
    queue.put("kept\n")
    queue.close()
    assert log_files(tmp_path)[-1].read_text() == "1 missing\nkept\n"


def test_runs_are_found_by_system_in_order_and_the_oldest_removed(tmp_path: Path) -> None:
    for system in ("/pipeline", "/robot1/pipeline"):
        parent = tmp_path / FOLDER / system.strip("/").replace("/", ".")
        for day in range(1, MAX_RUNS + 5):
            (parent / f"2026-01-{day:02}-00-00-00-000-77").mkdir(parents=True)
    foreign = tmp_path / FOLDER / "pipeline" / "notes"
    foreign.mkdir()
    kept = tmp_path / FOLDER / "pipeline" / "2026-01-01-00-00-00-000-77" / "kept.txt"
    kept.touch()
    started = RunFolder(tmp_path, "/pipeline")
    runs = [run for run in find_runs(tmp_path, "pipeline") if run.system == "/pipeline"]
    assert len(runs) == MAX_RUNS + 1  # and the one that holds another file
    assert runs[0].folder == kept.parent
    assert runs[-1].folder == started.path
    assert runs[-1].pid == str(os.getpid())
    assert abs(runs[-1].started - datetime.now().astimezone()) < timedelta(minutes=1)
    assert foreign.is_dir()
    assert len(find_runs(tmp_path, "/robot1/pipeline")) == MAX_RUNS + 4
    assert find_runs(tmp_path)[-1] == runs[-1]
    assert find_runs(tmp_path, "line") == []
    assert find_runs(tmp_path / "nothing") == []


def test_runs_of_parts_of_systems_are_found_by_name_or_without_a_whole(tmp_path: Path) -> None:
    part = RunFolder(tmp_path, "/split/hearing", part=True)
    for name in (None, "split", "/split", "/split/hearing", "hearing"):
        assert [run.folder for run in find_runs(tmp_path, name)] == [part.path]
    whole = RunFolder(tmp_path, "/split")
    for name in (None, "split", "/split"):
        assert [run.folder for run in find_runs(tmp_path, name)] == [whole.path]
    assert [run.folder for run in find_runs(tmp_path, "/split/hearing")] == [part.path]
    whole.close()
    part.close()


def write(folder: Path, at_s: float, message: str, **fields: str) -> None:
    about = {"level": "info", "logger": "ear", "node": "/ear"} | fields
    line = Record(int(at_s * 1e9), message=message, **about).to_line()
    with (folder / "log-000001.jsonl").open("a", encoding="utf-8") as file:
        file.write(line)
    os.utime(file.name, (at_s, at_s))


def test_the_log_of_a_system_has_the_lines_of_its_processes_once(tmp_path: Path) -> None:
    whole, child, alone = (
        RunFolder(tmp_path, "/split"),
        RunFolder(tmp_path, "/split/seeing", part=True, forwarded=True),
        RunFolder(tmp_path, "/split/hearing", part=True),
    )
    (run,) = find_runs(tmp_path)
    now_s = run.started.timestamp()
    write(child.path, now_s, "not again")
    write(whole.path, now_s + 2, "second")
    write(alone.path, now_s - 1, "earlier, in the first run")
    write(alone.path, now_s + 1, "/ear active", logger="compose")
    write(alone.path, now_s + 1, "first")
    log = SystemLog(tmp_path, run)
    messages = [record.message for record in log.new()]
    assert messages == ["earlier, in the first run", "first", "second"]
    again = alone.path.with_name(f"{alone.path.name}1")  # started again, by a service manager
    again.mkdir()
    (again / "run.json").write_bytes((alone.path / "run.json").read_bytes())
    write(again, now_s + 3, "third")
    assert [record.message for record in log.new()] == ["third"]
    assert [record.message for record in log.new()] == []

    folder = whole.path.parent / "2126-03-01-08-30-00-125-1"  # the next run
    folder.mkdir()
    (folder / "run.json").write_bytes((whole.path / "run.json").read_bytes())
    next_s = Run(folder, "/split").started.timestamp()
    write(again, next_s + 1, "of the next run")
    assert [r.message for r in SystemLog(tmp_path, run).new()][-1] == "third"
    later = SystemLog(tmp_path, find_runs(tmp_path)[-1])
    assert [record.message for record in later.new()] == ["of the next run"]
    for started in (whole, child, alone):
        started.close()


WRITER = """
import sys
from pathlib import Path
from composer.client.run_log import RotatingFile, RunFolder
from composer.client.run_log.reading import Record
folder = RunFolder(Path(sys.argv[1]), "/pipeline")
file = RotatingFile(folder.path, max_bytes=1000, max_files=100)
for number in range(100):
    file.write(Record(number, "info", "node", "/node", f"line {number}").to_line().encode())
    if number in (0, 50):
        print(folder.path, flush=True)
        sys.stdin.readline()
"""


def test_a_run_is_followed_over_rotations_until_its_process_ends(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, tmp_path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        run = Run(Path(process.stdout.readline().strip()), "/pipeline")
        assert run.is_running()
        messages = []
        for found in SystemLog(tmp_path, run).follow(lambda _: None):
            messages.append(found.message)
            if found.message in ("line 0", "line 50"):
                process.stdin.write("\n")
                process.stdin.flush()
    assert messages == [f"line {number}" for number in range(100)]
    assert not run.is_running()
    assert [found.message for found in SystemLog(tmp_path, run).new()][-1] == "line 99"


@pytest.mark.parametrize(
    ("selection", "is_selected"),
    [
        (Selection(), True),
        (Selection(("planner",)), True),
        (Selection(("a/planner",)), True),
        (Selection(("/a/planner",)), True),
        (Selection(("/a/*",)), True),
        (Selection(("plan*",)), True),
        (Selection(("/a",)), True),  # a logger below it
        (Selection(("lanner",)), False),
        (Selection(("/planner",)), False),
        (Selection(("camera", "planner")), True),
        (Selection(level="info"), True),
        (Selection(level="debug"), True),
        (Selection(level="warn"), False),
        (Selection(since_ns=record().time_ns + 1), False),
    ],
)
def test_records_are_selected_by_node_level_and_time(
    selection: Selection, is_selected: bool
) -> None:
    assert (record() in selection) is is_selected


@pytest.mark.parametrize(
    ("text", "before"),
    [
        ("10m", timedelta(minutes=10)),
        ("1h30m", timedelta(minutes=90)),
        ("1.5s", timedelta(seconds=1.5)),
        ("2d", timedelta(days=2)),
        ("250ms", timedelta(milliseconds=250)),
        ("2026-03-01T11:00:00Z", timedelta(hours=1)),
        *((text, None) for text in ("", "10", "m", "10 m", "yesterday", "1e999d", "9" * 400 + "d")),
    ],
)
def test_times_and_durations(text: str, before: timedelta | None) -> None:
    expected = None if before is None else round((NOW - before).timestamp() * 1e9)
    assert parse_since(text, NOW) == expected

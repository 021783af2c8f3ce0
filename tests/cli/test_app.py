from __future__ import annotations

import os
import random
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from composer import cli
from composer.cli.app import ELSEWHERE, application
from composer.cli.program import INTERNAL
from composer.cli.support.options import examples
from tests.cli.compose import compose, refused, run_python, write_files

COMPOSE = [sys.executable, "-m", "composer"]
REPOSITORY = Path(cli.__file__).parents[2]


def test_version() -> None:
    done = compose("--version")
    assert done.code == 0
    assert done.out.startswith("compose ")


def commands() -> Iterator[tuple[list[str], Any]]:
    """Yield the words of every command, including groups and the program itself."""
    waiting: list[tuple[list[str], Any]] = [([], typer.main.get_command(application()))]
    while waiting:
        words, command = waiting.pop()
        yield words, command
        inner = getattr(command, "commands", {})
        waiting += [([*words, name], item) for name, item in inner.items()]


COMMANDS = [words for words, _ in commands()]
GROUPS = [words for words in COMMANDS if any(words == others[:-1] for others in COMMANDS if others)]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: " ".join(["compose", *words]))
def test_every_help_page_ends_with_examples_of_the_command(command: list[str]) -> None:
    done = compose(*command, "--help")
    assert done.code == 0
    options, _, lines = done.out.partition("Examples:")
    assert "--help" in options
    shown = [line.strip() for line in lines.strip().splitlines()]
    assert shown
    words = " ".join(["compose", *command])
    assert all(words in line for line in shown)


@pytest.mark.parametrize("command", ["run", "graph"])
def test_examples_set_arguments_that_their_systems_have(command: str) -> None:
    page = compose(command, "--help").out
    examples = re.findall(rf"compose {command} (\w+)((?: \w+=\w+)+)", page)
    assert examples
    for system, arguments in examples:
        done = compose("config", system, *arguments.split())
        assert done.code == 0, done.err


@pytest.mark.parametrize("group", GROUPS, ids=str)
def test_no_summary_is_truncated_at_80_columns(
    group: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    _, _, page = compose(*group, "--help").out.partition("\nCommands")
    page, _, _ = page.partition("\n  Examples:")
    listed = [line for line in page.splitlines()[1:] if line.startswith(" ")]
    assert listed
    assert [line for line in listed if line.endswith("...")] == []
    assert all(line.startswith("  ") and line[2] != " " for line in listed), "one line per command"


def test_the_help_lists_all_commands_whatever_follows() -> None:
    page = compose("--help").out
    assert [line for line in page.splitlines() if line.startswith("Commands for")] == [
        "Commands for systems:",
        "Commands for files:",
        "Commands for ROS 2:",
    ]
    assert compose("--help", "run").out == compose("-h", "nothing").out == page


@pytest.mark.parametrize("group", ["node", "topic", "service", "action", "param"])
def test_commands_that_query_the_graph_have_a_time_limit_and_json_output(group: str) -> None:
    pages = [compose(*words, "--help").out for words in COMMANDS if words[:-1] == [group]]
    assert len(pages) > 1
    for page in pages:
        assert "--timeout" in page
        assert "--json" in page


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("--bogus", "Error: "),
        ("nothing", "Error: "),
        ("valdate", "Did you mean 'validate'?"),
        ("run", "Error: "),
        ("graph -f x y", "Error: "),
        ("graph", "--live"),
        ("graph pipeline --live", "--live"),
        ("graph pipelin", "did you mean 'pipeline'?"),
        ("graph pipelin", "talker_listener"),
        ("topic echo /x --field transforms[x].header", "is not a path of fields and indices"),
        ("topic echo /x --filter 'message.data >'", "--filter: "),
        ("topic pub /x std_msgs/msg/String {} --stdin", "not both"),
        ("service call /x std_srvs/srv/Trigger {} --stdin", "not both"),
        ("lifecycle set planner", "specify a transition of 'planner'"),
        ("lifecycle set activate", "specify nodes"),
        ("top --sort name", "cannot sort by 'name'"),
        ("export schema nodes", "Error: "),
        ("validate --explain unknown-nodes", "did you mean 'unknown-node'?"),
        ("import live --system 'my driver'", "the name 'my driver' contains a space"),
        *(
            (f"run a.yaml {option} {value}", f"'{option}': ")
            for option in ("--for", "--timeout", "--grace")
            for value in ("nan", "inf", "1e300")
        ),
        *((f"{word} anything", f"Use 'compose {ours}'.") for word, ours in ELSEWHERE.items()),
    ],
)
def test_wrong_arguments_are_a_usage_error_on_stderr(line: str, message: str) -> None:
    assert message in refused(2, *shlex.split(line))


def test_names_of_commands_of_other_tools_lead_to_ours() -> None:
    for ours in ELSEWHERE.values():
        assert ours.replace(" --explain", "").split() in COMMANDS


def redirected(to: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command with redirections of a shell."""
    line = f"exec {shlex.join([*COMPOSE, *arguments])} {to}"
    return subprocess.run(
        line, shell=True, check=False, capture_output=True, text=True, timeout=100
    )


def test_standard_streams_can_be_closed() -> None:
    for closed in (">&-", "2>&-", "<&- >&- 2>&-"):
        done = redirected(closed, "run", "systems/pipeline.yaml", "--dry-run")
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    "arguments", [["validate", "--explain", "RC"], ["--help"], ["graph", "systems/pipeline.yaml"]]
)
def test_a_full_disk_is_not_an_internal_error(arguments: list[str]) -> None:
    done = redirected("> /dev/full", *arguments)
    assert done.returncode == 1
    assert done.stderr == "compose: cannot write the output: No space left on device\n"


def test_a_closed_pipe_ends_quietly() -> None:
    read, write = os.pipe()
    os.close(read)
    done = run_python("-m", "composer", "export", "schema", "system", stdout=write)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_removed_working_directory_is_reported(folder: Path) -> None:
    code = "import os, sys; os.rmdir('../gone'); os.execv(sys.executable, sys.orig_argv[4:])"
    (folder / "gone").mkdir()
    command = [sys.executable, "-P", "-m", "composer", "validate", "."]
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    done = run_python("-P", "-c", code, *command, cwd="gone", env=environment)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "compose: the current working directory does not exist anymore\n"


def test_python_m_composer_imports_nothing_from_the_current_folder(folder: Path) -> None:
    write_files({"signal.py": "import sys\nsys.exit('imported')\n"})
    done = run_python("-m", "composer", "--version")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("compose ")


@pytest.mark.parametrize("is_in_c_code", [False, True])
def test_ctrl_c_is_handled_while_a_command_is_imported(
    is_in_c_code: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The C extension of rclpy turns a KeyboardInterrupt during import into an ImportError."""

    def interrupt(*_: object) -> None:
        if not is_in_c_code:
            raise KeyboardInterrupt
        failure = ImportError("initialization failed")
        failure.__cause__ = KeyboardInterrupt()
        raise ImportError("read the guide") from failure

    monkeypatch.setattr("composer.cli.app.application", interrupt)
    done = compose("validate", ".")
    assert (done.code, done.out, done.err) == (130, "", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [["--version"], ["validate", "systems"], ["dashboard", "--port", "0"]],
    ids=lambda words: words[0],
)
def test_ctrl_c_in_the_first_moments_prints_no_traceback_of_ours(words: list[str]) -> None:
    """Before our first line, Python itself prints where it was: see decision 0012."""
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    for _ in range(6):
        delay_s = chance.uniform(0.0, 0.3)
        with subprocess.Popen(
            [Path(sys.executable).with_name("compose"), *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            time.sleep(delay_s)  # the moment is what is tested
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60.0)
        case = f"{delay_s:.3f} s, seed {seed}: exit code {process.returncode}\n{errors}"
        files = {Path(name) for name in re.findall(r'File "(/.+?)"', errors)}
        assert not any(file.is_relative_to(REPOSITORY / "composer") for file in files), case
        assert process.returncode in (0, 1, 130, -signal.SIGINT), case


def test_no_option_accepts_nan() -> None:
    found = {
        f"{' '.join(words)} {option.opts[0]}": option
        for words, command in commands()
        for option in command.params
        if option.type.name.startswith("float")
    }
    assert len(found) > 10
    assert [name for name, option in found.items() if option.callback is None] == []


def test_an_internal_error_prints_a_traceback_only_on_request(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("out of\x1b[2J\npaper")

    monkeypatch.delenv("COMPOSE_DEBUG", raising=False)
    monkeypatch.setattr("composer.loading.load_files", fail)
    write_files({"any.yaml": "system: any\n"})
    done = compose("validate", "any.yaml")
    assert done.code == INTERNAL
    assert done.err.startswith("compose: internal error: RuntimeError: out of\\x1b[2J\\npaper\n")
    assert "Traceback" not in done.err
    monkeypatch.setenv("COMPOSE_DEBUG", "1")
    assert "Traceback" in compose("validate", "any.yaml").err


@pytest.mark.parametrize(
    ("commands", "heavy", "printed"),
    [
        (
            (["--version"], ["--help"]),
            {"rclpy", "jsonschema", "yaml", "composer.loading", "composer.runtime", "rich"},
            "",
        ),
        (
            (["validate", "systems/pipeline.yaml"],),
            {"rclpy", "jsonschema", "importlib.metadata", "importlib.resources", "email", "socket"}
            | {"sysconfig", "asyncio", "rich", "composer.runtime", "composer.graph"},
            "1 file checked: no problems found\n",
        ),
    ],
    ids=["help and version", "validate"],
)
def test_only_what_is_needed_is_imported(
    commands: tuple[list[str], ...], heavy: set[str], printed: str
) -> None:
    code = (
        "import sys; from composer.cli import main\n"
        f"for words in {commands!r}: main(words)\n"
        f"print({heavy!r} & set(sys.modules), file=sys.stderr)"
    )
    assert run_python("-c", code).stderr == f"{printed}set()\n"


def test_examples_are_printed_verbatim() -> None:
    assert examples("compose a", "compose b") == "\b\nExamples:\n  compose a\n  compose b"


#: Commands that need a system without errors, with their exit codes for other files.
NEED_A_SYSTEM = [
    ("diff", 1),
    ("doctor", 1),
    ("export launch", 1),
    ("dashboard", 1),
    ("run --dry-run", 78),
    ("hosts discovery-server", 78),
]


@pytest.mark.parametrize(("command", "code"), NEED_A_SYSTEM)
def test_a_file_with_errors_or_of_a_node_type_is_rejected(
    command: str, code: int, folder: Path
) -> None:
    if command == "dashboard":
        pytest.importorskip("starlette", reason="the extra 'dashboard' is not installed")
    text = "system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n"
    write_files({"broken.yaml": text, "relay.yaml": "node: relay\n"})
    assert refused(code, *command.split(), "broken.yaml").startswith("error[")
    message = refused(code, *command.split(), "relay.yaml")
    assert "'relay.yaml' is a node type, not a system" in message

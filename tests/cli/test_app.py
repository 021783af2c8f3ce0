from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from composer import cli
from composer.cli.app import ELSEWHERE, application
from composer.cli.program import INTERNAL
from composer.cli.support.options import examples
from tests.cli.compose import compose

COMPOSE = [sys.executable, "-m", "composer"]


def test_version() -> None:
    done = compose("--version")
    assert done.code == 0
    assert done.out.startswith("compose ")


def commands() -> Iterator[list[str]]:
    """Yield the words of every command, including groups and the program itself."""
    waiting: list[tuple[list[str], Any]] = [([], typer.main.get_command(application()))]
    while waiting:
        words, command = waiting.pop()
        yield words
        inner = getattr(command, "commands", {})
        waiting += [([*words, name], item) for name, item in inner.items()]


COMMANDS = list(commands())
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
    "arguments", [["--bogus"], ["nothing"], ["run"], ["graph", "-f", "x", "y"]]
)
def test_wrong_arguments_are_a_usage_error_on_stderr(arguments: list[str]) -> None:
    done = compose(*arguments)
    assert (done.code, done.out) == (2, "")
    assert "Error: " in done.err


@pytest.mark.parametrize("option", ["--for", "--timeout", "--grace"])
@pytest.mark.parametrize("value", ["nan", "inf", "1e300"])
def test_nan_infinity_and_huge_durations_are_usage_errors(option: str, value: str) -> None:
    done = compose("run", "systems/pipeline.yaml", "--dry-run", option, value)
    assert (done.code, done.out) == (2, "")
    assert f"'{option}': " in done.err


def redirected(to: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command with redirections of a shell."""
    line = f'exec "$@" {to}'
    return subprocess.run(
        ["sh", "-c", line, "sh", *COMPOSE, *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=100,
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


def test_a_removed_working_directory_is_reported(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    python = f"{sys.executable} -P -m composer"
    done = subprocess.run(
        ["sh", "-c", f"rmdir ../gone && {python} validate ."],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "compose: the current working directory does not exist anymore\n"


def test_python_m_composer_imports_nothing_from_the_current_folder(tmp_path: Path) -> None:
    (tmp_path / "signal.py").write_text("import sys\nsys.exit('imported')\n")
    done = subprocess.run(
        [*COMPOSE, "--version"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("compose ")


def test_ctrl_c_is_handled_while_a_command_is_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("composer.cli.app.application", interrupt)
    done = compose("validate", ".")
    assert (done.code, done.out, done.err) == (130, "", "")


def test_an_import_error_caused_by_ctrl_c_is_an_interrupt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The C extension of rclpy turns a KeyboardInterrupt during import into an ImportError."""

    def interrupt(*_: object) -> None:
        failure = ImportError("initialization failed")
        failure.__cause__ = KeyboardInterrupt()
        raise ImportError("read the guide") from failure

    monkeypatch.setattr("composer.cli.app.application", interrupt)
    done = compose("validate", ".")
    assert (done.code, done.out, done.err) == (130, "", "")


def options_with_a_number() -> Iterator[tuple[str, Any]]:
    waiting: list[tuple[str, Any]] = [("compose", typer.main.get_command(application()))]
    while waiting:
        name, command = waiting.pop()
        waiting += [(f"{name} {word}", it) for word, it in getattr(command, "commands", {}).items()]
        for option in command.params:
            if option.type.name.startswith("float"):
                yield f"{name} {option.opts[0]}", option


def test_no_option_accepts_nan() -> None:
    found = dict(options_with_a_number())
    assert len(found) > 10
    assert [name for name, option in found.items() if option.callback is None] == []


def test_a_mistyped_command_gets_a_suggestion() -> None:
    assert "Did you mean 'validate'?" in compose("valdate").err


@pytest.mark.parametrize(("word", "ours"), ELSEWHERE.items())
def test_a_command_of_another_tool_gets_the_name_of_ours(word: str, ours: str) -> None:
    done = compose(word, "anything")
    assert (done.code, done.out) == (2, "")
    assert f"Use 'compose {ours}'." in done.err
    assert ours.replace(" --explain", "").split() in COMMANDS


def test_an_internal_error_prints_a_traceback_only_on_request(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("out of\x1b[2J\npaper")

    monkeypatch.delenv("COMPOSE_DEBUG", raising=False)
    monkeypatch.setattr("composer.loading.load_files", fail)
    (tmp_path / "any.yaml").write_text("system: any\n")
    done = compose("validate", str(tmp_path / "any.yaml"))
    assert done.code == INTERNAL
    assert done.err.startswith("compose: internal error: RuntimeError: out of\\x1b[2J\\npaper\n")
    assert "Traceback" not in done.err
    monkeypatch.setenv("COMPOSE_DEBUG", "1")
    assert "Traceback" in compose("validate", str(tmp_path / "any.yaml")).err


def test_a_closed_pipe_ends_quietly() -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [*COMPOSE, "export", "schema", "system"],
        check=False,
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


def test_help_and_version_import_nothing_heavy() -> None:
    code = (
        "import sys; from composer.cli import main; main(['--version']); main(['--help']);"
        "heavy = {'rclpy', 'jsonschema', 'yaml', 'composer.loading', 'composer.runtime', 'rich'};"
        "print(heavy & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == "set()\n"


def test_validate_imports_only_what_it_needs() -> None:
    code = (
        "import sys; from composer.cli import main; main(['validate', 'systems/pipeline.yaml']);"
        "heavy = {'rclpy', 'jsonschema', 'importlib.metadata', 'importlib.resources', 'email',"
        " 'socket', 'sysconfig', 'asyncio', 'rich', 'composer.runtime', 'composer.graph'};"
        "print(heavy & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == "1 file checked: no problems found\nset()\n"


def test_examples_are_printed_verbatim() -> None:
    assert examples("compose a", "compose b") == "\b\nExamples:\n  compose a\n  compose b"

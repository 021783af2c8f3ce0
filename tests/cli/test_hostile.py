"""``compose validate`` on malicious files and includes: it reports one rule, within limits."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cli.compose import compose, write_files

#: Attacks are read by processes under limits.
pytestmark = pytest.mark.slow

LIMITED = Path(__file__).with_name("limited.py")
MAX_CPU = 150  # times the reference work: 3 s if that takes 20 ms
MAX_MB = 200.0
REPORT = re.compile(r"^(?:error|warning|info)\[RC\d+ (\S+)\].*\n *--> (.+:\d+:\d+)$", re.MULTILINE)
SUBSCRIBER = """\
system: a
nodes:
  one:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, when: "%s", log: received}
"""
LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@dataclass(frozen=True, slots=True)
class Result:
    """The result of the command."""

    code: int
    out: str
    err: str
    imported: list[str]

    @property
    def reports(self) -> list[tuple[str, str]]:
        """Rules and places, sorted."""
        return sorted(REPORT.findall(self.out))

    @property
    def rules(self) -> list[str]:
        return [rule for rule, _ in self.reports]


def validate(folder: Path, *arguments: str) -> Result:
    """Run the command in ``folder``; check its time, memory and output."""
    read, write = os.pipe()
    result = subprocess.run(
        [sys.executable, str(LIMITED), str(write), "validate", *arguments],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        pass_fds=(write,),
        timeout=150,  # its CPU time has a limit of its own
        check=False,
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    assert text, result.stderr.decode()
    took = json.loads(text)
    assert took["cpu_s"] < MAX_CPU * took["reference_s"]
    assert took["peak_mb"] < MAX_MB
    out, err = result.stdout.decode(), result.stderr.decode()
    check_output(out, err)
    return Result(result.returncode, out, err, took["imported"])


def check_output(*streams: str) -> None:
    for stream in streams:
        assert re.search(r"[\x00-\x08\x0b-\x1f\x7f]", stream) is None
        assert len(stream) < 20_000


LOUD = "on_activate: {log: here}"


def twice(name: str, following: str) -> str:
    entries = [f"{{file: {following}.yaml, prefix: {prefix}_}}" for prefix in "ab"]
    return f"system: {name}\ninclude: [{', '.join(entries)}]\n"


def often(name: str, following: str, copies: int) -> str:
    entry = f"{{for_each: {{i: {copies}}}, file: {following}.yaml, prefix: 'a${{i}}_'}}"
    return f"system: {name}\ninclude:\n  - {entry}\n"


MANY = f"system: many\nnodes:\n  n_${{i}}: {{for_each: {{i: 2000}}, {LOUD}}}\n"
FEW = f"system: s\nnodes: {{n: {{{LOUD}}}}}\n"
PATTERNS = ", ".join(f"n*{number}.p" for number in range(2000))
PADDING = f"# {'x' * 1000}\n" * 900
#: By name: files, the first of which is validated, the rule that is reported, and its places.
ATTACKS: dict[str, tuple[dict[str, str], str, str]] = {
    "brackets": ({"s0": "[" * 200_000}, "too-large", "s0.yaml:1:33"),
    "billion laughs": ({"s0": LAUGHS}, "too-large", "s0.yaml:6:12"),
    "10 MB of small maps": ({"s0": "- {a: 1}\n" * 1_200_000}, "too-large", "s0.yaml:1:1"),
    "2 MB of small maps": ({"s0": "- {a: 1}\n" * 200_000}, "too-large", "s0.yaml:66667:4"),
    "title of the terminal": (
        {"s0": 'system: a\ndescription: "\\e]0;pwn\\a"\nnodes: {one: {}}\n'},
        "forbidden-character", "s0.yaml:2:14"),
    "reference to the network": (
        {"s0": 'system: a\n$ref: "http://127.0.0.1:9/x"\nnodes: {one: {}}\n'},
        "unknown-key", "s0.yaml:2:1"),
    "a long format": ({"s0": SUBSCRIBER % "'%1000000000d' % 1 == ''"},
                      "invalid-value", "s0.yaml:5:81"),
    "a sandbox escape": ({"s0": SUBSCRIBER % "().__class__.__bases__"},
                         "invalid-expression", "s0.yaml:5:81"),
    "two of two of two, and so on": (
        {f"s{number}": twice(f"s{number}", f"s{number + 1}") for number in range(20)},
        "too-large", "s16.yaml:2:18"),
    "a few of very many": (
        {"s0": often("s0", "s1", 40), "s1": often("s1", "many", 40), "many": MANY},
        "too-large", "s1.yaml:3:31"),
    "very many of few": (
        {"s0": often("s0", "s1", 99), "s1": often("s1", "s2", 99), "s2": FEW},
        "too-large", "s0.yaml:3:31"),
    "large files": (
        {"s0": "system: s\ninclude: [s1.yaml, s2.yaml, s3.yaml]\n",
         **{f"s{number}": FEW.replace("n:", f"n{number}:") + PADDING for number in (1, 2, 3)}},
        "too-large", "s0.yaml:2:29"),
    "a cycle": ({"s0": twice("s0", "s1"), "s1": "system: s\ninclude: [s0.yaml]\n"},
                 "cycle", "s0.yaml:2:18 s0.yaml:2:47"),
    "itself": ({"s0": "system: s\ninclude: [s0.yaml]\n"}, "cycle", "s0.yaml:2:11"),
    "a billion copies": ({"s0": MANY.replace("2000", "1000000000")},
                         "too-large", "s0.yaml:3:22"),
    "copies of copies": ({"s0": MANY.replace("2000", "1000, j: 1000, k: 1000")},
                         "too-large", "s0.yaml:3:22"),
    "patterns": (
        {"s0": f"{MANY}connections:\n  - topic: /t\n    from: [{PATTERNS}]\n"},
        "too-large", "s0.yaml:6:2152"),
    "a long pattern": (
        {"s0": f"{MANY}connections:\n  - {{topic: /t, from: 'n{'*_' * 100_000}.p'}}\n"},
        "too-large", "s0.yaml:5:23"),
    "patterns for all": (
        {"s0": MANY.replace("2000", "1900")
         + "connections:\n  - {for_each: {i: 100}, topic: '/t${i}', from: '*.p'}\n"},
        "too-large", "s0.yaml:5:49"),
}  # fmt: skip
#: Each of these is validated by a process of its own, all others by one.
EXPENSIVE = ("2 MB of small maps", "a few of very many", "very many of few")
OTHERS = tuple(name for name in ATTACKS if name not in EXPENSIVE)


@pytest.mark.parametrize(
    "names", [*((name,) for name in EXPENSIVE), OTHERS], ids=lambda names: names[0]
)
def test_attack(tmp_path: Path, names: tuple[str, ...]) -> None:
    for name in names:
        files = ATTACKS[name][0]
        write_files({f"{name}/{file}.yaml": text for file, text in files.items()}, tmp_path)
    result = validate(tmp_path, *(f"{name}/s0.yaml" for name in names))
    assert result.code == 1
    expected = [
        (rule, f"{name}/{place}")
        for name in names
        for _, rule, places in [ATTACKS[name]]
        for place in places.split()
    ]
    assert result.reports == sorted(expected)


def test_user_code_is_parsed_but_not_executed(tmp_path: Path) -> None:
    (tmp_path / "harm.py").write_text("open('harm', 'w')\nclass Harm:\n    pass\n")
    (tmp_path / "a.yaml").write_text("system: a\nnodes: {one: {behavior: harm:Harm}}\n")
    result = validate(tmp_path, "a.yaml")
    assert (result.code, result.imported) == (0, [])
    assert not (tmp_path / "harm").exists()


def test_pipes_and_devices_are_not_read(tmp_path: Path) -> None:
    text = """\
system: a
nodes:
  one: {type: pipe}
  two: {behavior: pipe:Pipe}
  three: {publishers: {p: {type: evil/msg/P, qos: command, external: true}}}
"""
    package = "interfaces/evil/package.xml"
    write_files({"a.yaml": text, package: "<name>evil</name>"}, tmp_path)
    for name in ("p.yaml", "nodes/pipe.yaml", "pipe.py", "interfaces/evil/msg/P.msg"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        os.mkfifo(tmp_path / name)
    result = validate(tmp_path, ".")
    assert result.code == 1
    assert result.rules == ["class-missing", "unknown-interface", "unknown-node-type"]
    result = validate(tmp_path, "p.yaml", "/dev/zero")
    assert result.code == 1
    assert result.reports == [
        ("unreadable-file", f"{name}:1:1") for name in ("/dev/zero", "p.yaml")
    ]


def test_links_out_of_the_project_are_not_followed(tmp_path: Path) -> None:
    project, secret = tmp_path / "project", tmp_path / "secret"
    text = "system: a\nnodes:\n  one: {type: secret}\n  two: {behavior: linked:Linked}\n"
    secret_text = "node: secret\nsecret: confidential\n"
    write_files({"secret": secret_text, "project/a.yaml": text}, tmp_path)
    (project / "nodes").mkdir()
    for name in ("nodes/secret.yaml", "linked.yaml", "linked.py", "composer.yaml"):
        (project / name).symlink_to(secret)
    result = validate(project, ".")
    assert result.code == 1
    unreadable = ["unreadable-file"] * 3
    assert result.rules == ["class-missing", "unknown-node-type", *unreadable]
    assert result.out.count("a symbolic link out of the project") == 5
    assert "confidential" not in result.out + result.err


def test_file_names_with_control_characters_are_escaped(folder: Path) -> None:
    names = [b"\x1b]0;pwn\x07.yaml", b"\xff\xfe.yaml", b"\xe2\x80\xae.yaml"]
    for name in names:
        (folder / os.fsdecode(name)).write_text("system: [\n")
    (folder / "\x1b[2J.yaml").write_text("foreign: true\n")
    for report in ("text", "json", "sarif", "github"):
        done = compose("validate", ".", "--format", report)
        check_output(done.out, done.err)
        assert done.code == 1
    done = compose("validate", "\x1b[2J missing.yaml")
    check_output(done.out, done.err)
    assert done.code == 2


def test_only_files_in_the_project_are_included(tmp_path: Path) -> None:
    project, secret = tmp_path / "project", tmp_path / "secret.yaml"
    names = ["../secret.yaml", str(secret), "link.yaml", "loop.yaml", "pipe.yaml", "/dev/zero"]
    names += [".", "x" * 5000, "~/a.yaml", "http://127.0.0.1:9/a.yaml"]
    written = ", ".join(f'"{name}"' for name in names)
    text = f"system: a\ninclude: [{written}]\n"
    secret_text = "system: secret\nsecret: confidential\n"
    write_files({"secret.yaml": secret_text, "project/a.yaml": text}, tmp_path)
    os.mkfifo(project / "pipe.yaml")
    (project / "link.yaml").symlink_to(secret)
    (project / "loop.yaml").symlink_to(project / "loop.yaml")
    result = validate(project, "a.yaml")
    assert (result.code, result.rules) == (1, ["invalid-include"] * len(names)), result.out
    assert "confidential" not in result.out + result.err

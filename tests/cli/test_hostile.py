"""``compose validate`` on malicious files: it must report one diagnostic and stay within limits."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

#: Each attack is a process of its own, under limits.
pytestmark = pytest.mark.slow

LIMITED = Path(__file__).with_name("limited.py")
MAX_CPU = 150  # times the reference work: 3 s if that takes 20 ms
MAX_MB = 200.0
PLACE = re.compile(r"--> (.+:\d+:\d+)$", re.MULTILINE)
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
    def rules(self) -> list[str]:
        return re.findall(r"^(?:error|warning|info)\[RC\d+ (\S+)\]", self.out, re.MULTILINE)


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
    for stream in (result.stdout, result.stderr):
        assert re.search(rb"[\x00-\x08\x0b-\x1f\x7f]", stream) is None
        assert len(stream) < 20_000
    return Result(
        result.returncode, result.stdout.decode(), result.stderr.decode(), took["imported"]
    )


ATTACKS = {
    "brackets": ("[" * 200_000, "too-large", "1:33"),
    "billion laughs": (LAUGHS, "too-large", "6:12"),
    "10 MB of small maps": ("- {a: 1}\n" * 1_200_000, "too-large", "1:1"),
    "2 MB of small maps": ("- {a: 1}\n" * 200_000, "too-large", "66667:4"),
    "title of the terminal": ('system: a\ndescription: "\\e]0;pwn\\a"\nnodes: {one: {}}\n',
                              "forbidden-character", "2:14"),
    "reference to the network": ('system: a\n$ref: "http://127.0.0.1:9/x"\nnodes: {one: {}}\n',
                                 "unknown-key", "2:1"),
    "a long format": (SUBSCRIBER % "'%1000000000d' % 1 == ''", "invalid-value", "5:81"),
    "a sandbox escape": (SUBSCRIBER % "().__class__.__bases__", "invalid-expression", "5:81"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "rule", "place"), ATTACKS.values(), ids=ATTACKS)
def test_attack(tmp_path: Path, text: str, rule: str, place: str) -> None:
    (tmp_path / "attack.yaml").write_text(text, encoding="utf-8")
    result = validate(tmp_path, "attack.yaml")
    assert (result.code, result.rules) == (1, [rule]), result.out
    assert PLACE.findall(result.out)[0] == f"attack.yaml:{place}"


def test_user_code_is_parsed_but_not_executed(tmp_path: Path) -> None:
    (tmp_path / "harm.py").write_text("open('harm', 'w')\nclass Harm:\n    pass\n")
    (tmp_path / "a.yaml").write_text("system: a\nnodes: {one: {behavior: harm:Harm}}\n")
    result = validate(tmp_path, "a.yaml")
    assert (result.code, result.imported) == (0, [])
    assert not (tmp_path / "harm").exists()


def test_pipes_and_devices_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "interfaces" / "evil" / "msg").mkdir(parents=True)
    (tmp_path / "interfaces" / "evil" / "package.xml").write_text("<name>evil</name>")
    pipes = ["p.yaml", "nodes/pipe.yaml", "pipe.py", "interfaces/evil/msg/P.msg"]
    for name in pipes:
        os.mkfifo(tmp_path / name)
    text = """\
system: a
nodes:
  one: {type: pipe}
  two: {behavior: pipe:Pipe}
  three: {publishers: {p: {type: evil/msg/P, qos: command, external: true}}}
"""
    (tmp_path / "a.yaml").write_text(text)
    result = validate(tmp_path, ".")
    assert result.code == 1
    assert sorted(result.rules) == [
        "class-missing",
        "unknown-interface",
        "unknown-node-type",
    ]
    for name in ("p.yaml", "/dev/zero"):
        result = validate(tmp_path, name)
        assert (result.code, result.rules) == (1, ["unreadable-file"])
        assert PLACE.findall(result.out) == [f"{name}:1:1"]


def test_links_out_of_the_project_are_not_followed(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("node: secret\nsecret: confidential\n")
    project = tmp_path / "project"
    (project / "nodes").mkdir(parents=True)
    for name in ("nodes/secret.yaml", "linked.yaml", "linked.py", "composer.yaml"):
        (project / name).symlink_to(secret)
    text = "system: a\nnodes:\n  one: {type: secret}\n  two: {behavior: linked:Linked}\n"
    (project / "a.yaml").write_text(text)
    result = validate(project, ".")
    assert result.code == 1
    assert sorted(result.rules) == [
        "class-missing",
        "unknown-node-type",
        "unreadable-file",
        "unreadable-file",
        "unreadable-file",
    ]
    assert result.out.count("a symbolic link out of the project") == 5
    assert "confidential" not in result.out + result.err


def test_file_names_with_control_characters_are_escaped(tmp_path: Path) -> None:
    names = [b"\x1b]0;pwn\x07.yaml", b"\xff\xfe.yaml", b"\xe2\x80\xae.yaml"]
    for name in names:
        (tmp_path / os.fsdecode(name)).write_text("system: [\n")
    (tmp_path / "\x1b[2J.yaml").write_text("foreign: true\n")
    for report in ("text", "json", "sarif", "github"):
        assert validate(tmp_path, ".", "--format", report).code == 1
    assert validate(tmp_path, "\x1b[2J missing.yaml").code == 2

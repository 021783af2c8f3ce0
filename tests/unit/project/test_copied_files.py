"""Which files of a project are copied: by what rsync and the rules of docker make of the list."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from composer.project.copied_files import copied_files, patterns_for_images
from tests.unit.support.checking import write_files

PRIVATE_KEY = "Bag Attributes\n-----BEGIN ENCRYPTED PRIVATE KEY-----\nMII\n"


def write(root: Path, files: dict[str, str], mode: int = 0o644) -> None:
    write_files(root, files)
    for name in files:
        (root / name).chmod(mode)


def staying(root: Path, *private: Path) -> set[str]:
    return {path for path, _ in copied_files(root, private).staying}


def test_what_git_and_docker_ignore_stays(tmp_path: Path) -> None:
    project = tmp_path / "repository" / "robot"
    ignores = {
        "../.gitignore": "*.bag\n/robot/maps/\n",
        ".gitignore": "*.log\n!keep.log\n/data/\n",
        "sub/.gitignore": "!kept.bag\n/local\n",
        ".dockerignore": "# of docker\nbig*\n**/*.tmp\nonly/\n!only/this\n",
    }
    stay = {"a.log", "data", "maps", "sub/b.bag", "sub/local", "big.bin", "sub/x.tmp", "only/that"}
    copied = {"keep.log", "sub/kept.bag", "sub/data/a", "local", "sub/big.bin", "only/this"}
    write(project, {".git/config": "", "build/x": "", "pkg/__pycache__/x": "", "sub/build/x": ""})
    (project / ".git").rename(project.parent / ".git")
    write(project, dict.fromkeys(stay - {"data", "maps"} | copied, "x"))
    write(project, {"data/a": "x", "maps/a": "x", **ignores})
    found = copied_files(project)
    assert {text.partition(" (")[0] for text in found.reasons} == stay
    assert set(found.copied) == copied | (ignores.keys() - {"../.gitignore"}) | {"sub/build/x"}


#: Files that stay, with their mode, and files that are copied.
SECRETS = [
    (".env", "A=1", 0o644),
    ("sub/.env.local", "A=1", 0o644),
    ("sub/id_ed25519", "x", 0o644),
    ("sub/notes.txt", PRIVATE_KEY, 0o644),
    ("keystore/key.pem", "-----BEGIN PRIVATE KEY-----\n", 0o644),
    ("putty", "PuTTY-User-Key-File-3: ssh-ed25519\n", 0o644),
    ("deploy.key", "binary", 0o600),
    ("api_token", "x", 0o400),
    ("private/hidden", '{"k": "-----BEGIN PRIVATE KEY-----"}', 0o600),
    ("secret.yaml", "k: |\n  -----BEGIN RSA PRIVATE KEY-----\n", 0o644),
    ("bom", "\ufeff-----BEGIN PRIVATE KEY-----\n", 0o644),
    ("deploykey", "x", 0o600),
    ("wifi_password.yaml", "x", 0o600),
]
OTHERS = [
    (".env.example", "A=1", 0o644),
    ("cert.pem", "-----BEGIN CERTIFICATE-----\n", 0o644),
    ("other.key", "binary", 0o644),
    ("robot.json", '{"k": "-----BEGIN PRIVATE KEY-----"}', 0o644),
    ("teleop_keys.yaml", "x", 0o600),
    ("key\n", "x", 0o600),
    ("key_teleop.py", "x", 0o600),
    ("robot.yaml", "system: r\n", 0o600),
    ("docs.md", "a line `-----BEGIN PRIVATE KEY-----`", 0o644),
]


def test_secrets_stay(tmp_path: Path) -> None:
    for name, text, mode in SECRETS + OTHERS:
        write(tmp_path, {name: text}, mode)
    assert staying(tmp_path) == {name for name, *_ in SECRETS}


def test_files_of_a_folder_that_only_its_owner_enters_are_like_keys(tmp_path: Path) -> None:
    write(tmp_path, {"closed/sub/robot.key": "x", "closed/robot.yaml": "x"})
    (tmp_path / "closed").chmod(0o700)
    assert staying(tmp_path) == {"closed/sub/robot.key"}


@pytest.mark.parametrize(
    ("file", "pattern", "ignored"),
    [
        (".gitignore", "*.key\n!certs/", {"b.key", "certs/a.key"}),
        (".gitignore", "name\\ ", {"name "}),
        (".gitignore", "!\n\\\n[b\n!/\nname*", {"name", "name "}),
        (".gitignore", "[[:alpha:]].[^a]ey", {"b.key", "certs/a.key"}),
        (".gitignore", "certs/**\n!certs/*/\n", {"certs/a.key", "certs/sub/x"}),
        (".git/info/exclude", "name", {"name"}),
        (".dockerignore", "**.key", {"b.key", "certs/a.key"}),
        (".dockerignore", "# c\n!\n[\n*\n! certs\n!n*", {"b.key"}),
        (".dockerignore", "c**a.key\n.", {"certs/a.key"}),
        (".dockerignore", "/./certs/../name\r", {"name"}),
        ("certs/.dockerignore", "a.key", set()),
    ],
)
def test_patterns(tmp_path: Path, file: str, pattern: str, ignored: set[str]) -> None:
    """Git and docker read them like that."""
    files = {"b.key", "name", "name ", "certs/a.key", "certs/sub/x"}
    write(tmp_path, dict.fromkeys(files, "x") | {".git/HEAD": "", file: pattern})
    copied = set(copied_files(tmp_path).copied) & files
    assert files - copied == ignored


@pytest.mark.parametrize(
    "written",
    ["keys/id", "./keys/../keys/id", "~/robot/keys/id", "{root}/keys/id", "link/id", "..id"],
)
def test_keys_of_hosts_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: str) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    root = tmp_path / "robot"
    write(root, {"keys/id": "SECRET", "..id": "SECRET", "robot.yaml": "x"})
    (root / "link").symlink_to("keys")
    os.link(root / "keys" / "id", root / "copy")
    (tmp_path / "project").symlink_to(root)
    key = Path(written.format(root=tmp_path / "project")).expanduser()
    expected = {"..id"} if written == "..id" else {"keys/id", "copy"}
    assert staying(tmp_path / "project", root / key, tmp_path / ".ssh" / "id") == expected
    assert staying(root, root / "later") == {"later"}


@pytest.mark.skipif(shutil.which("rsync") is None, reason="rsync is not installed")
def test_rsync_copies_exactly_what_is_listed(tmp_path: Path) -> None:
    root, there = tmp_path / "robot", tmp_path / "there"
    odd = ["a b ", "!x", "#x", "- x", "a*b", "[x]", "q?", "back\\slash", "new\nline", "ü", "-x"]
    odd.append("ab")
    write(root, {f"sub/{name}": "x" for name in odd} | {f"{name}x": "x" for name in odd})
    keys = [root / "sub" / name for name in odd[:-1]]
    write(root, dict.fromkeys([".env", ".env.example", "sub/.env.local", "build/x"], "x"))
    files = copied_files(root, keys)
    patterns = "".join(f"{pattern}\0" for pattern in files.rsync_patterns)
    write(there, {".venv/x": "", "sub/.env": "", "old": ""})
    command = ["rsync", "-r", "--delete", "--from0", "--exclude-from=-", f"{root}/", str(there)]
    subprocess.run(command, check=True, input=patterns, text=True, timeout=100)
    copied = {str(path.relative_to(there)) for path in there.rglob("*") if path.is_file()}
    assert set(files.copied) == {"sub/ab", ".env.example"} | {f"{name}x" for name in odd}
    assert copied == {*files.copied, ".venv/x", "sub/.env"}  # what only the other computer has
    assert not [pattern for pattern in files.rsync_patterns if not pattern.isprintable()]


def test_files_that_cannot_be_read_are_skipped(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / ".gitignore")
    os.mkfifo(tmp_path / "deploy.key")
    (tmp_path / "loop").symlink_to("loop")
    write(tmp_path, {"a": "x"})
    assert copied_files(tmp_path).copied == ("a", "loop")


def test_docker_reads_the_patterns_of_the_project_first(tmp_path: Path) -> None:
    write(tmp_path, {".dockerignore": "# mine\nmaps\n!.env\n"})
    patterns = list(patterns_for_images(tmp_path))
    assert patterns[:2] == ["maps", "!.env"]
    assert {"**/.env", "!**/.env.example", "/build", "**/.git"} <= set(patterns[2:])

"""ssh servers on the computers of a network, with keys made for a test."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from tests.ros.network.namespaces import PATIENCE_S, Computer, require_programs

_SSHD = "/usr/sbin/sshd"
_CONFIG = """\
Port 22
HostKey {folder}/host_key
PidFile none
AuthorizedKeysFile {folder}/authorized_keys
StrictModes no
UsePAM no
PasswordAuthentication no
PermitRootLogin prohibit-password
SetEnv {environment}
"""


class SshKeys:
    """A key to log in with, the key of all servers, and the file of known servers."""

    def __init__(self, folder: Path) -> None:
        require_programs(_SSHD, "ssh", "ssh-keygen", package="openssh-server")
        self.folder = folder
        for name in ("login_key", "host_key"):
            command = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(folder / name)]
            subprocess.run(command, check=True)
        self.login_key = folder / "login_key"
        self.known_hosts = folder / "known_hosts"
        self.known_hosts.touch()

    def trust(self, *computers: Computer) -> None:
        """Add the computers to the known hosts."""
        key = self.folder.joinpath("host_key.pub").read_text(encoding="utf-8")
        lines = (f"{computer.address} {key}" for computer in computers)
        with self.known_hosts.open("a", encoding="utf-8") as file:
            file.writelines(lines)

    def serve(self, computer: Computer, settings: str = "") -> None:
        """Start the server of a computer, with more lines of sshd_config; it ends with that."""
        login = self.folder.joinpath("login_key.pub").read_text(encoding="utf-8")
        self.folder.joinpath("authorized_keys").write_text(login, encoding="utf-8")
        environment = " ".join(f"{k}={v}" for k, v in computer.private_environment().items())
        config = self.folder / f"sshd_{computer.name}"
        text = _CONFIG.format(folder=self.folder, environment=environment) + settings
        config.write_text(text, encoding="utf-8")
        server = computer.start(_SSHD, "-D", "-e", "-f", str(config), stderr=subprocess.PIPE)
        assert server.stderr is not None
        end_s = time.monotonic() + PATIENCE_S
        while "listening" not in (line := server.stderr.readline()):
            assert line, f"the ssh server of {computer.name} did not start"
            assert time.monotonic() < end_s

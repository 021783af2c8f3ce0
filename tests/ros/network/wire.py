"""A wire that delays and loses packets, between TAP devices of two network namespaces.

``python -I -S wire.py PID DEVICE PID DEVICE DELAY_MS LOSS_PERCENT`` makes a device in the network
namespace of each process, and prints ``ready``. The kernels of many virtual machines have no netem.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import random
import select
import struct
import sys
import time
from collections import deque
from pathlib import Path

_TUNSETIFF = 0x400454CA
_IFF_TAP, _IFF_NO_PI = 0x0002, 0x1000
_LONGEST_FRAME = 65_600


def open_tap(pid: str, name: str) -> int:
    """Make the device ``name`` in the network namespace of a process, and enter that."""
    with Path(f"/proc/{pid}/ns/net").open("rb") as namespace:
        if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), 0) != 0:
            raise OSError(ctypes.get_errno(), "setns failed")
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, _TUNSETIFF, struct.pack("16sH", name.encode(), _IFF_TAP | _IFF_NO_PI))
    return device


def relay(devices: list[int], delay_s: float, loss: float) -> None:
    """Carry frames in both directions, forever."""
    other = dict(zip(devices, reversed(devices), strict=True))
    chance = random.Random(1)
    waiting: deque[tuple[float, int, bytes]] = deque()
    while True:
        left_s = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
        ready, _, _ = select.select(devices, [], [], left_s)
        for device in ready:
            frame = os.read(device, _LONGEST_FRAME)
            if chance.random() >= loss:
                waiting.append((time.monotonic() + delay_s, other[device], frame))
        while waiting and waiting[0][0] <= time.monotonic():
            _, device, frame = waiting.popleft()
            try:
                os.write(device, frame)
            except OSError:  # the device is down: the cable is cut
                continue


def main() -> None:
    pids, names = sys.argv[1:5:2], sys.argv[2:5:2]
    devices = [open_tap(pid, name) for pid, name in zip(pids, names, strict=True)]
    print("ready", flush=True)
    relay(devices, float(sys.argv[5]) / 1000.0, float(sys.argv[6]) / 100.0)


if __name__ == "__main__":
    main()

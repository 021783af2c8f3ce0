"""The page of the dashboard with a system of a hundred nodes, in a headless Chromium.

The first view is that of a dashboard that no browser has connected to before, from the start of the
navigation until all nodes are in the diagram. It is measured in a new window, while Chromium is
still busy with the window itself, and in one that has been open for two seconds. Frames are those
that Chromium presents, according to its own trace, while the diagram is dragged by a step in each
frame.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.dashboard import running_dashboard
from benchmarks.figures import Row
from benchmarks.pipeline import Side, running
from benchmarks.processes import environment
from tests.unit.support.fleets import fleet_text

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

NODES = 100
FIRST_VIEW = f"first view of {NODES} nodes, new dashboard"
IN_OPEN_WINDOW = f"first view of {NODES} nodes, new dashboard, open window"
ONE_SECOND = "1 s"
PANNING = f"panning {NODES} nodes, mean time between frames"
SIXTY_HZ = "60 Hz"
FRAME_MS = 1000 / 60
_PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FRAMES = "disabled-by-default-devtools.timeline.frame"
#: The state of a frame with what the scripts of the page have changed.
_COMPLETE = "STATE_PRESENTED_ALL"
#: No signal says that discovery is over, or Chromium at rest: they must not overlap a measurement.
_SETTLE_S = 2.0
ALL_SHOWN = f"() => document.querySelectorAll('.world [data-kind=node]').length >= {NODES}"
#: Drags the diagram for two seconds, by a step in each frame.
_PAN = """async () => {
    const picture = document.querySelector(".picture");
    const { left, top, width, height } = picture.getBoundingClientRect();
    const send = (type, x, y) => picture.dispatchEvent(new PointerEvent(type, {
        pointerId: 1, button: 0, bubbles: true,
        clientX: left + width / 2 + x, clientY: top + height / 2 + y,
    }));
    picture.setPointerCapture = () => {};  // only for real pointers
    send("pointerdown", 0, 0);
    for (let step = 0; step < 120; step += 1) {
        await new Promise(requestAnimationFrame);
        send("pointermove", (step * 3) % 240, step % 120);
    }
    send("pointerup", 0, 0);
}"""


def measure(*, long: bool) -> list[Row]:
    """Measure all rows. Raises ProgramFailed. Without Chromium and playwright, there are none."""
    program = next(filter(None, map(shutil.which, _PROGRAMS)), None)
    if program is None or find_spec("playwright") is None:
        print("Chromium or playwright is not installed")
        return []
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - not everywhere

    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        file = Path(folder, "fleet.yaml")
        file.write_text(fleet_text(NODES), encoding="utf-8")
        side = Side(
            ("-m", "composer", "run", str(file)), f"{NODES} of {NODES} nodes active", re.compile("")
        )
        variables = environment()
        stack.enter_context(running(side, variables))
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        rounds = range(15 if long else 5)
        figures = [_round(browser, variables, f"fleet_of_{NODES}") for _ in rounds]
        browser.close()
    new_ms, open_ms, frames_ms = zip(*figures, strict=True)
    limits_ms = (1000.0,) * len(rounds)
    return [
        Row(FIRST_VIEW, "wall ms", ONE_SECOND, new_ms, limits_ms),
        Row(IN_OPEN_WINDOW, "wall ms", ONE_SECOND, open_ms, limits_ms),
        Row(PANNING, "ms", SIXTY_HZ, frames_ms, (FRAME_MS,) * len(rounds)),
    ]


def _round(
    browser: Browser, variables: Mapping[str, str], system: str
) -> tuple[float, float, float]:
    """Return the times of the first views in a new and an open window, and between frames."""
    with running_dashboard(variables, system) as (_, address):
        time.sleep(_SETTLE_S)
        page = _new_window(browser)
        new_ms = _first_view(page, address.string.decode())
        time.sleep(_SETTLE_S)
        between_ms = pan(browser, page)
        page.context.close()
    with running_dashboard(variables, system) as (_, address):
        page = _new_window(browser)
        time.sleep(_SETTLE_S)
        open_ms = _first_view(page, address.string.decode())
        page.context.close()
    return new_ms, open_ms, sum(between_ms) / len(between_ms)


def _new_window(browser: Browser) -> Page:
    return browser.new_context(viewport={"width": 1280, "height": 800}).new_page()


def _first_view(page: Page, address: str) -> float:
    """Return the time from the start of the navigation until all nodes are shown, in ms."""
    page.goto(address, wait_until="commit")
    page.wait_for_function(ALL_SHOWN, polling="raf")
    shown_ms: float = page.evaluate("performance.now()")
    return shown_ms


def pan(browser: Browser, page: Page) -> list[float]:
    """Drag the diagram; return the times between the frames that were presented, in ms."""
    browser.start_tracing(page=page, categories=["-*", _FRAMES])
    page.evaluate(_PAN)
    trace = json.loads(browser.stop_tracing())
    return frame_times_ms(trace["traceEvents"])


def frame_times_ms(events: Iterable[Mapping[str, Any]]) -> list[float]:
    """Return the times between presented frames of the page, from the events of a trace."""
    is_presented: dict[tuple[int, str], bool] = {}
    at_us: defaultdict[int, list[float]] = defaultdict(list)
    for event in events:
        if event["name"] != "PipelineReporter":
            continue
        frame = (event["pid"], event["id2"]["local"])  # used again after the end of the frame
        if event["ph"] == "b":
            state = event["args"]["frame_reporter"]["state"]
            is_presented[frame] = state == _COMPLETE
        elif is_presented.pop(frame, False):
            at_us[event["pid"]].append(event["ts"])
    # The frame of the browser around the page is drawn by another process, and rarely.
    times_us = sorted(max(at_us.values(), key=len))
    return [(after - before) / 1000 for before, after in pairwise(times_us)]

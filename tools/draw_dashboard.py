"""Take the pictures of docs/guides/dashboard.md: the real page, of a running systems/pipeline.yaml.

Needs ROS, Chromium and playwright, so it is not part of ``make generate``: ``make pictures``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "pictures"
SYSTEM = "systems/pipeline.yaml"
COMPOSE = Path(sys.executable).with_name("compose")
_PLOTTED_S = 9.0
#: The rates of the first reports include the bring-up.
_SETTLED_S = 4.0
_PLANNER = "/planning/planner"
_POSITION = "/sensor_data:pose.pose.position"
#: The CPU time of a process is known only after a second measurement. Narrow pages do not show it.
_CPU = re.compile(r"CPU \d")


@dataclass(frozen=True)
class Picture:
    """A view of the page, and what must be visible before the picture is taken."""

    name: str
    path: str
    ready: str
    width: int = 1280
    height: int = 720
    dark: bool = False
    prepare: Callable[[Page, float], None] | None = None


def _plot(page: Page, plotted_s: float) -> None:
    page.get_by_label("Time shown").select_option("10")
    page.wait_for_timeout(plotted_s * 1000)


def _refuse(page: Page, _: float) -> None:
    page.locator("[data-name=max_velocity] input[type=text]").fill("50")
    page.keyboard.press("Enter")
    page.locator(".outcome[data-tone=bad]").wait_for()


PICTURES = (
    Picture("dashboard-graph.png", "/graph", '[data-label]:has-text("Hz")', height=440),
    Picture("dashboard-details.png", f"/graph{_PLANNER}", ".detail h3:has-text('Parameters')"),
    Picture("dashboard-nodes.png", f"/nodes{_PLANNER}", ".small td:has-text('Hz')", dark=True),
    Picture(
        "dashboard-plot.png",
        f"/topics/sensor_data?tab=plot&series={_POSITION}.x+{_POSITION}.y",
        ".legend",
        prepare=_plot,
    ),
    Picture(
        "dashboard-parameters.png",
        f"/parameters{_PLANNER}",
        ".parameter",
        height=420,
        prepare=_refuse,
    ),
    Picture("dashboard-phone.png", "/graph", "[data-state=active]", width=360, height=720),
)


def take(browser: Browser, url: str, folder: Path, plotted_s: float = _PLOTTED_S) -> None:
    """Write all pictures of the dashboard at ``url``, which has the token."""
    context = browser.new_context()
    context.new_page().goto(url)  # gets the cookie; while it is open, the dashboard measures
    for picture in PICTURES:
        page = context.new_page()
        page.set_viewport_size({"width": picture.width, "height": picture.height})
        page.emulate_media(color_scheme="dark" if picture.dark else "light")
        page.goto(url.partition("/?")[0] + picture.path)
        page.locator(picture.ready).first.wait_for()
        page.locator(".figures").filter(has_text=_CPU).wait_for(state="attached")
        if picture.prepare is not None:
            picture.prepare(page, plotted_s)
        page.screenshot(path=folder / picture.name)
        page.close()
    context.close()


def main() -> None:
    """Run the system and a dashboard, and take the pictures."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - slow, and tests import take()

    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    with ExitStack() as stack:
        for arguments in (["run", SYSTEM], ["dashboard", SYSTEM, "--port", "0"]):
            process = subprocess.Popen(
                [COMPOSE, *arguments], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
            )
            stack.callback(process.wait, 20)
            stack.callback(process.terminate)
        if process.stdout is None or not (url := process.stdout.readline().strip()):
            raise SystemExit("the dashboard did not start")
        playwright = stack.enter_context(sync_playwright())
        time.sleep(_SETTLED_S)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        stack.callback(browser.close)
        take(browser, url, FOLDER)


if __name__ == "__main__":
    main()

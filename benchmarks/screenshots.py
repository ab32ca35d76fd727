"""Pictures of the workbench for docs/, from the real page: `python -m benchmarks.screenshots [FOLDER_FOR_PNG]`.

The twin hides an effect (seed and effect below), a browser walks the loop as a person would, and every screen is taken
on a telephone, a small laptop, a dark monitor and a projector. Needs Debian's chromium and the package playwright.
"""

import shutil
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from tests.workbench.browser import LONG_MS, idle, next_step
from tests.workbench.served import workbench
from thrustd.twin.hide import hide

EFFECT, SEED, STRENGTH = "axial_inertia", 3, 4.0
FIRST = "bench-model"
SIGHTS = ((390, 844, "light"), (1280, 800, "light"), (1920, 1080, "dark"), (2560, 1440, "light"))
FLIGHT = Path("replay_logs/throttle-steps.mcap")
VIEWS = ("overview", "identify", "fails", "histories", "missing", "add", "flight", "live", "flighttest")


def screenshots(out: Path) -> None:
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no chromium on this machine: apt-get install chromium")
    out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "mount-campaign"
        hide((EFFECT,), SEED, STRENGTH, folder)
        (folder / "truth.json").unlink()
        add_flight(folder)
        url = stack.enter_context(workbench(folder)).url
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        walk(browser, url)
        for width, height, scheme in SIGHTS:
            take(browser, url, out, (width, height), scheme)
        browser.close()


def add_flight(folder: Path) -> None:
    """A short flight with estimates beside the recordings."""
    log = folder / "flight.mcap"
    made = folder.parent / "flown.mcap"
    thrustd = (sys.executable, "-m", "thrustd")
    if FLIGHT.exists():
        shutil.copy(FLIGHT, made)
    else:
        subprocess.run((*thrustd, "simulate", "--minutes", "4", "--seed", "7", "-o", str(made)), check=True)
    subprocess.run((*thrustd, "replay", str(made), "-o", str(log)), check=True, stdout=subprocess.DEVNULL)


def walk(browser: Any, url: str) -> None:
    """Identify, compare, ask, add, compare and ask again, pressing only the button the page offers."""
    page = browser.new_page()
    page.goto(url)
    for word in ("Identify", "Compare", "missing", "Add", "Compare", "missing"):
        next_step(page, word)
    page.close()


def take(browser: Any, url: str, out: Path, size: tuple[int, int], scheme: str) -> None:
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
    page = context.new_page()
    for view in VIEWS:
        page.goto(f"{url}#{'flight' if view == 'live' else view}")
        page.wait_for_selector("html[data-started]")
        page.wait_for_timeout(2500)
        idle(page)
        prepare(page, view)
        page.wait_for_timeout(900)
        page.screenshot(path=out / f"workbench-{view}-{size[0]}-{scheme}.png")
    context.close()


def prepare(page: Any, view: str) -> None:
    """What a person would do on this screen before looking."""
    if view not in ("flight", "live", "flighttest"):
        choose_model(page, FIRST if view in ("fails", "missing") else f"{FIRST}+{EFFECT}")
    if view == "fails":
        page.locator(".reasons button").first.click()
    if view == "flight":
        page.locator("input[type=range]").evaluate(
            "slider => { slider.value = +slider.min + 0.6 * (slider.max - slider.min);"
            " slider.dispatchEvent(new Event('input')); }"
        )
    if view == "live":
        page.get_by_role("button", name="Follow live").click()
        page.locator(".engine b").first.wait_for()
    if view == "flighttest":
        page.get_by_role("button", name="Transients").click()
        page.get_by_role("button", name="Evaluate").click()
        idle(page)
        page.locator("img.drawing").wait_for(timeout=LONG_MS)
    if view == "histories":
        page.mouse.move(700, 420)


def choose_model(page: Any, stem: str) -> None:
    """What fails is the model before the effect was added; what is kept is the one after."""
    page.locator(".context select").first.select_option(f"{stem}.json")
    page.wait_for_timeout(2500)


if __name__ == "__main__":
    screenshots(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/screenshots"))

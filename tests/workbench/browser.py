"""Debian's chromium for tests, one for all tests of a module; where there is none, the test says how to get it."""

import shutil
import time
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

PATHS = ("chromium", "chromium-browser", "google-chrome")
WAIT_MS = 60_000  # for anything else
LONG_MS = 300_000  # a fit on a busy machine


def chromium(needed):
    """Its path; skips the test, or fails it when it is needed, and says what to do, where there is none."""
    executable = next(filter(None, map(shutil.which, PATHS)), None)
    if executable is None:
        without = pytest.fail if needed else pytest.skip
        without("no chromium on this machine: apt-get install chromium, then this test runs")
    return executable


@pytest.fixture(scope="module")
def browser(pytestconfig):
    executable = chromium(pytestconfig.getoption("--need-browser"))
    from playwright import sync_api

    with sync_api.sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-dev-shm-usage"]  # as root, and where /dev/shm is small
        running = playwright.chromium.launch(executable_path=executable, args=arguments)
        yield running
        running.close()


@pytest.fixture(scope="module")
def page_of(browser):
    """`with page_of(url) as page`: a page as if of nobody else; complaints of the page's own code fail the test."""
    return partial(_page, browser, [])


@contextmanager
def _page(browser, free, url, width=1280, height=800, scheme="light"):
    """A tab that is `free`, else a new one: to open one costs more than most tests do in it."""
    complaints: list[str] = []
    page = free.pop() if free else browser.new_page()
    page.set_viewport_size({"width": width, "height": height})
    page.emulate_media(color_scheme=scheme)
    page.set_default_timeout(WAIT_MS)
    heard = {
        "pageerror": lambda problem: complaints.append(str(problem)),
        "console": lambda said: complaints.append(said.text) if said.type == "error" else None,
    }
    for event, hear in heard.items():
        page.on(event, hear)
    try:
        page.goto(url)
        yield page
    except BaseException:
        page.context.close()
        raise
    for event, hear in heard.items():
        page.remove_listener(event, hear)
    _leave(page)
    free.append(page)
    expected = ("Failed to load resource",)  # refused requests are what some tests are about
    said = [line for line in complaints if not line.startswith(expected)]
    assert said == [], said


def _leave(page):
    """Nothing of it stays for the next test: no route, no page, nothing that it kept, no pointer over a plot."""
    page.unroute_all()
    page.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
    page.goto("about:blank")
    page.mouse.move(0, 0)


def idle(page):
    """Wait until no job runs."""
    page.wait_for_selector("html[data-busy='0']", timeout=LONG_MS)


DRAWN = """async () => {
    await (await fetch("static/icon.svg")).text();
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
}"""


@contextmanager
def held(page, pattern):
    """What the server answers meanwhile waits, in this list of (route, answer); what is left in it comes at the end."""
    waiting: list[tuple[Any, Any]] = []
    page.route(pattern, lambda route: waiting.append((route, route.fetch())))
    yield waiting
    while waiting:
        let_go(page, waiting.pop(0))
    page.unroute(pattern)


def let_go(page, *answers):
    """Let answers that were held come, and wait until the page has made of them what it makes of them."""
    for route, answer in answers:
        with page.expect_request_finished(lambda request, wanted=route.request: request == wanted):
            route.fulfill(response=answer)
    page.evaluate(DRAWN)  # one more answer, and one more picture: those before are behind


def until(page, holds, *given):
    """Wait for what the page does not show; events are heard of while the browser is listened to."""
    deadline_s = time.monotonic() + WAIT_MS / 1000
    while not holds(*given):
        assert time.monotonic() < deadline_s
        page.wait_for_timeout(20)


OTHER = """word => {
    const button = document.getElementById("next");
    return !button?.textContent.includes(word) || document.querySelector(".notice.problem") !== null;
}"""


def next_step(page, word):
    """Press the guide's button, once it offers `word`; wait until the work is done and it offers something else."""
    button = page.locator("#next:not([disabled])", has_text=word)
    button.wait_for(timeout=LONG_MS)
    button.click()
    page.wait_for_function(OTHER, arg=word, timeout=LONG_MS)
    idle(page)

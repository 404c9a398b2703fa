"""A headless Chromium on pages that 'sealtwin trace' serves."""

import importlib
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from digitise.geometry.polyline import rectangle
from fixtures.generate.specimen import PAPER, make_specimen

PROBES = Path(__file__).parent / "probes.js"
FLAGS = (
    "--no-sandbox",  # the tests may run as root, in a container
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
WITHOUT_WEBGL = ("--disable-gpu",)
"""Flags with which photos are painted fastest without a graphics card."""
BY_SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Flags for WebGL without a graphics card."""
PATIENCE_MS = 30_000
"""Timeout of a wait; times that a test claims are measured by the test."""
UNREAD = "net::ERR_ABORTED"
"""Chromium reports this for every answer that a page reads in pieces, even after the last piece."""


@pytest.fixture(scope="session")
def launch():
    """Start a Chromium with further flags; one driver starts them all, since two cannot run in one thread."""
    playwright = importlib.import_module("playwright.sync_api")
    executable = shutil.which("chromium")
    assert executable, "no chromium on the PATH; 'make test-browser' installs it"
    with playwright.sync_playwright() as driver:
        yield lambda flags: driver.chromium.launch(executable_path=executable, headless=True, args=[*FLAGS, *flags])


@pytest.fixture(scope="session")
def chromium(launch):
    browser = launch(WITHOUT_WEBGL)
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def chromium_with_webgl(launch):
    browser = launch(BY_SOFTWARE)
    yield browser
    browser.close()


@pytest.fixture
def open_report(chromium_with_webgl):
    """Open a page; fail at the end if it wrote a message or requested another file."""
    contexts, complaints, wanted, asked = [], [], set(), set()

    def opened(file, width=1280, height=900, script="", **look):
        context = chromium_with_webgl.new_context(viewport={"width": width, "height": height}, **look)
        contexts.append(context)
        if script:
            context.add_init_script(script)
        page = context.new_page()
        page.on("console", lambda message: complaints.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda fault: complaints.append(f"error: {fault}"))
        page.on("dialog", lambda dialog: complaints.append(f"dialog: {dialog.message}"))
        page.on("request", lambda request: request.url.startswith("data:") or asked.add(request.url))
        wanted.add(file.as_uri())
        page.goto(file.as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert complaints == []
    assert asked == wanted


@dataclass(frozen=True)
class Shot:
    """A specimen's photo, and positions on it."""

    file: Path
    mm_per_px: float
    length_mm: float
    width_mm: float
    line_px: Any
    """Along the crack's middle, (n, 2)."""
    corners_px: Any
    """Corners of the face: lower left, lower right, upper right, upper left."""

    def along(self, share):
        """Return the point of the crack at a share of its length."""
        return tuple(self.line_px[round(share * (len(self.line_px) - 1))])


def _shot(folder, megapixels=None):
    specimen = make_specimen(1)
    image = cv2.imdecode(np.frombuffer(specimen.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    factor = 1.0 if megapixels is None else float(np.sqrt(megapixels * 1e6 / (image.shape[0] * image.shape[1])))
    larger = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    cv2.imwrite(str(folder / "crack.jpg"), larger, [cv2.IMWRITE_JPEG_QUALITY, 90])

    def seen(points_mm):
        return factor * (specimen.to_px(points_mm) + 0.5) - 0.5

    return Shot(
        file=folder / "crack.jpg",
        mm_per_px=PAPER.mm_per_px / factor,
        length_mm=PAPER.length_mm,
        width_mm=PAPER.width_mm,
        line_px=seen(specimen.centreline_mm),
        corners_px=seen(rectangle((0, 0, *PAPER.face_mm))),
    )


@pytest.fixture(scope="session")
def shot(tmp_path_factory):
    """The photo as drawn, of 2 megapixels."""
    return _shot(tmp_path_factory.mktemp("shot"))


@pytest.fixture(scope="session")
def big(tmp_path_factory):
    """The photo enlarged to 12 megapixels, as a phone takes."""
    return _shot(tmp_path_factory.mktemp("big"), megapixels=12)


@dataclass
class Bench:
    """A browser's page, and the command that serves it."""

    page: Any
    command: Any
    url: str
    complaints: list[str] = field(default_factory=list)
    visited: set[str] = field(default_factory=set)

    def at(self, point_px):
        """Return the position of a point of the photo on the screen."""
        return tuple(self.probe("onScreen", [float(place) for place in point_px]))

    def probe(self, question, *given):
        """Ask one of probes.js."""
        return self.page.evaluate("([question, given]) => window.probe[question](...given)", [question, list(given)])

    def until(self, condition, *given):
        """Wait until a JavaScript expression of ``given`` holds."""
        self.page.wait_for_function(f"(given) => {condition}", arg=list(given), timeout=PATIENCE_MS)

    def click(self, point_px):
        self.page.mouse.click(*self.at(point_px))

    def drag(self, start_px, end_px):
        self.page.mouse.move(*self.at(start_px))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(np.mean([start_px, end_px], axis=0)))
        self.page.mouse.move(*self.at(end_px))
        self.page.mouse.up()

    def give_ends(self, shot, shares=(0.05, 0.95)):
        """Click both ends of the crack, and wait for its walls."""
        for share in shares:
            self.click(shot.along(share))
        self.await_state("walls")

    def give_scale_and_depth(self):
        self.page.check("input[name=scale][value=mm_per_px]")
        self.page.fill("#mm-per-px", "0.1")
        self.page.fill("#depth-mm", "16")

    def place(self, point):
        """Return the coordinates of a point in the fields of the panel, in pixels."""
        fields = self.page.locator(f"[data-point={point}] input")
        return [float(fields.nth(axis).input_value()) for axis in (0, 1)]

    def await_state(self, *states):
        wanted = ", ".join(f"#stage[data-state={state}]" for state in states)
        self.page.wait_for_selector(wanted, timeout=PATIENCE_MS, state="attached")

    def text(self, selector):
        return self.page.inner_text(selector).strip()

    def number(self, name):
        """A figure of the panel."""
        return self.probe("number", name)

    def points(self):
        """Ids of the points on the photo, in the order of Tab."""
        return self.page.eval_on_selector_all(".point", "all => all.map(one => one.id)")


@pytest.fixture
def open_page(chromium):
    """Start the command for a target and open its page; fail at the end on a message or a foreign request."""
    benches, contexts = [], []

    def opened(target, width=1280, height=800, **look):
        command = subprocess.Popen(
            [sys.executable, "-m", "sealtwin", "trace", str(target), "--no-browser"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert command.stderr is not None
        first = command.stderr.readline()
        assert first.startswith("Trace page: http://127.0.0.1:"), first + command.stderr.read()
        url = first.removeprefix("Trace page: ").strip()
        context = chromium.new_context(viewport={"width": width, "height": height}, **look)
        context.add_init_script(path=PROBES)
        contexts.append(context)
        bench = Bench(context.new_page(), command, url)
        benches.append(bench)
        bench.page.on("console", lambda message: bench.complaints.append(f"{message.type}: {message.text}"))
        bench.page.on("pageerror", lambda fault: bench.complaints.append(f"error: {fault}"))
        bench.page.on("request", lambda request: bench.visited.add(request.url))
        bench.page.on("requestfailed", lambda request: _note_failure(bench, request))
        bench.page.goto(url)
        bench.page.wait_for_selector("#save-where:not(:empty)", timeout=PATIENCE_MS)
        return bench

    yield opened
    for context in contexts:
        context.close()
    for bench in benches:
        bench.command.terminate()
        bench.command.communicate(timeout=20)
    for bench in benches:
        assert not bench.complaints
        assert {visited for visited in bench.visited if not visited.startswith(bench.url)} == set()


@pytest.fixture
def bench(open_page, shot):
    return open_page(shot.file)


def _note_failure(bench, request):
    if request.failure != UNREAD:
        bench.complaints.append(f"{request.url}: {request.failure}")

"""The pages as a person uses them, in a headless Chromium where there is one."""

import asyncio
import re
import shutil
import socket
import threading
from collections.abc import Iterator

import pytest
import uvicorn
from playwright.sync_api import expect, sync_playwright

from wsm_data.view.browser.app import Shown, view_app
from wsm_data.view.browser.release_shelf import ReleaseShelf

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on the PATH"),
]
KEY = "synth_d435i/home_0001/000000"
SIZES = {"desktop": {"width": 1280, "height": 900}, "phone": {"width": 390, "height": 844}}


@pytest.fixture(scope="module")
def address(selected, made, tmp_path_factory) -> Iterator[str]:
    other = made.release(tmp_path_factory.mktemp("other"), {KEY: "train", "synth_zed/home_0008/000000": "train"})
    release = selected.release
    shown = Shown(
        title="<img src=x onerror=alert(1)>",
        release=ReleaseShelf(release),
        other=ReleaseShelf(other),
        refusals=release.quarantine,
    )
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(view_app(shown), log_level="warning", lifespan="off"))
        thread = threading.Thread(target=lambda: asyncio.run(server.serve(sockets=[listening])))
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        server.should_exit = True
        thread.join()


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as running:
        started = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def page(browser, address):
    """A page that fails the test where a script fails, a dialog opens, or anything but this server is asked."""
    opened, wrong = browser.new_page(viewport=SIZES["desktop"]), []
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("dialog", lambda dialog: wrong.append(dialog.message))
    opened.on("request", lambda asked: asked.url.startswith(address) or wrong.append(asked.url))
    yield opened
    opened.close()
    assert wrong == []


def go(page, to: str) -> None:
    page.goto(to)
    page.wait_for_load_state("networkidle")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("path", ["/", f"/clip?key={KEY}", "/refused", "/compare"])
def test_a_page_fits_its_window_and_runs_nothing_that_a_name_holds(page, address, path, size):
    page.set_viewport_size(SIZES[size])
    go(page, address + path)
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size]["width"]
    assert page.locator("h1").inner_text() in ("<img src=x onerror=alert(1)>", KEY)
    assert page.locator("h1 img").count() == 0


def test_clips_are_filtered_sorted_and_opened_and_the_way_back_leads_to_the_same_list(page, address):
    go(page, address)
    assert page.locator(".card").count() == 6
    page.select_option("[name='is.split']", "train")
    page.select_option("#sort", "detour_ratio")
    page.check("#descending")
    expect(page.locator(".card")).to_have_count(4)
    page.wait_for_load_state("networkidle")
    shown = page.locator(".card").all_inner_texts()
    numbers = [float(text.split("detour_ratio ")[1].split(" ")[0]) for text in shown]
    assert numbers == sorted(numbers, reverse=True)
    page.locator(".card").first.click()
    expect(page.locator("#place")).to_have_text("1 of 4")
    page.keyboard.press("Escape")
    expect(page.locator(".card")).to_have_count(4)
    assert "is.split=train" in page.url


def test_colour_depth_and_map_go_in_step_by_slider_and_keyboard(page, address):
    go(page, f"{address}/clip?key={KEY}")
    said = page.locator("#frame")
    assert said.inner_text().startswith("frame 0 of 0 to 8")
    for key, frame in (("ArrowRight", 1), ("Shift+ArrowRight", 8), ("ArrowLeft", 7), ("Home", 0), ("End", 8)):
        drawn = page.evaluate("document.querySelector('#map').toDataURL()")
        page.keyboard.press(key)
        for kind in ("rgb", "depth"):
            expect(page.locator(f"#{kind}")).to_have_attribute("src", re.compile(f"kind={kind}&number={frame}$"))
        assert said.inner_text().startswith(f"frame {frame} of")
        assert page.evaluate("document.querySelector('#map').toDataURL()") != drawn
    page.locator("#slider").fill("3")
    assert said.inner_text().startswith("frame 3 of")
    page.keyboard.press(" ")
    expect(said).to_have_text(re.compile("^frame 8 of"))


def test_the_path_is_drawn_where_the_map_has_it(page, address):
    go(page, f"{address}/clip?key={KEY}&frame=8")
    at = page.evaluate(
        """() => {
          const [x, y] = clip.map.path[4], canvas = byId("map"), scale = canvas.width / clip.map.columns;
          return [...canvas.getContext("2d").getImageData(Math.round(x * scale), Math.round(y * scale), 1, 1).data];
        }"""
    )
    assert at == [0xC9, 0x28, 0x3E, 255]  # the colour of the path


def test_refusals_are_browsed_by_reason(page, address):
    go(page, f"{address}/refused")
    assert page.locator("article").count() == 3
    page.select_option("#reason", "archive.truncated")
    expect(page.locator("article")).to_have_count(1)
    assert "ends <b>early</b>" in page.locator("article").inner_text()


def test_two_releases_stand_side_by_side(page, address):
    go(page, f"{address}/compare?where=right")
    assert page.locator("#pairs h2").all_inner_texts() == ["synth_zed/home_0008/000000"]
    assert page.locator(".absent").inner_text() == "not in this one"
    assert page.locator("#pairs img").evaluate("image => image.naturalWidth") > 0

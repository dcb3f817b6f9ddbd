import re
from html.parser import HTMLParser
from importlib.resources import files
from urllib.parse import quote

import pytest
import simplejpeg
from starlette.testclient import TestClient

from wsm_data.readers.manifest import load_dataset
from wsm_data.view.browser.app import PAGES, Shown, view_app
from wsm_data.view.browser.release_shelf import ReleaseShelf
from wsm_data.view.browser.source_shelf import SourceShelf

BASE = "http://127.0.0.1:8765"
KEY = "synth_d435i/home_0001/000000"


@pytest.fixture(scope="module")
def client(release, make_source) -> TestClient:
    source = SourceShelf(make_source(), load_dataset("synthetic"))
    shown = Shown(title="<b>t</b>", release=ReleaseShelf(release), source=source, refusals=release.quarantine)
    return TestClient(view_app(shown), base_url=BASE)


class Loaded(HTMLParser):
    """What a page loads, and whether script or style stands in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.inline: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.addresses += [given[name] for name in ("src", "href") if given.get(name)]
        self.inline += [name for name in given if name.startswith("on") or name == "style"]
        if tag == "style" or (tag == "script" and "src" not in given):
            self.inline.append(tag)


@pytest.mark.parametrize("page", ["", *PAGES])
def test_a_page_loads_from_here_alone_and_whatever_it_loads_is_there(client, page):
    answer = client.get(f"/{page}")
    assert answer.headers["content-type"].startswith("text/html")
    loaded = Loaded(answer.text)
    assert loaded.inline == []
    assert len(loaded.addresses) == 4
    for address in loaded.addresses:
        assert address.startswith("/static/")
        assert client.get(address).status_code == 200


def test_scripts_never_make_html_of_text_and_reach_no_other_machine():
    static = files("wsm_data.view.browser") / "static"
    for file in static.iterdir():
        text = file.read_text()
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function", text), (
            file
        )
        assert set(re.findall(r"https?://[^\s\"']+", text)) <= {"http://www.w3.org/2000/svg"}, file


@pytest.mark.parametrize(
    "path",
    [
        "/static/../app.py",
        "/static/%2e%2e/app.py",
        "/static/..%2fapp.py",
        "/static//etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/static/",
        "/api/map?key=../../dataset.json",
        "/api/thumbnail?key=%2fetc%2fpasswd",
        "/api/episode/frame?container=../..&key=a/b/c&kind=rgb",
        "/api/container?container=%2fetc",
    ],
)
def test_no_path_leads_out(client, path):
    answer = client.get(path)
    assert answer.status_code == 404
    assert "root:" not in answer.text


def test_html_in_names_is_served_as_json_alone(client, made):
    [clip] = [one for one in client.get("/api/clips").json()["clips"] if "script" in one["key"]]
    answer = client.get(f"/api/clip?key={quote(clip['key'], safe='')}")
    assert answer.headers["content-type"] == "application/json"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert made.hostile_scene in answer.json()["unit"]
    about = client.get("/api/about")
    assert about.headers["content-type"] == "application/json"
    assert about.json()["title"] == "<b>t</b>"


def test_errors_are_json_with_the_message(client):
    for path, status in (("clips?sort=kee", 404), ("frame?key=" + KEY + "&kind=rgb&number=x", 404), ("compare", 404)):
        answer = client.get(f"/api/{path}")
        assert answer.status_code == status
        assert answer.json()["error"]
    assert "did you mean key" in client.get("/api/clips?sort=kee").json()["error"]


def test_a_damaged_shard_is_said_and_the_rest_is_shown(made, tmp_path):
    release = made.release(tmp_path, made.units)
    for shard in (tmp_path / "release").glob("*.tar"):
        shard.write_bytes(bytes(shard.stat().st_size))
    client = TestClient(view_app(Shown(title="t", release=ReleaseShelf(release))), base_url=BASE)
    assert client.get("/api/clips").json()["total"] == 6
    answer = client.get(f"/api/thumbnail?key={KEY}")
    assert answer.status_code == 422
    assert KEY in answer.json()["error"]


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        (f"thumbnail?key={KEY}", "image/jpeg"),
        (f"frame?key={KEY}&kind=depth&number=2", "image/jpeg"),
        (f"map?key={KEY}", "image/png"),
    ],
)
def test_pictures_have_their_type(client, path, kind):
    answer = client.get(f"/api/{path}")
    assert (answer.status_code, answer.headers["content-type"]) == (200, kind)


def test_the_frame_of_a_refusal_comes_from_the_source(release, make_source):
    source = SourceShelf(make_source(), load_dataset("synthetic"))
    container = source.containers("", 0, 1)["containers"][0]["id"]
    episode = source.container(container)["episodes"][0]
    jump = {"unit": episode["unit"], "source": container, "reason": "pose.jump", "details": {"frame": 2}}
    lost = {"unit": container, "source": container, "reason": "archive.truncated", "message": "cut"}
    client = TestClient(view_app(Shown(title="t", source=source, refusals=(jump, lost))), base_url=BASE)
    assert client.get("/api/refusals").json()["refusals"][0]["frame"] == 2
    shown = client.get("/api/refusal/frame?number=0&kind=rgb").content
    assert shown == source.frame(container, episode["unit"], "rgb", 2)
    assert simplejpeg.decode_jpeg(client.get("/api/refusal/frame?number=0&kind=depth&frame=3").content).ndim == 3
    assert "no frame of it to show" in client.get("/api/refusal/frame?number=1").json()["error"]
    assert "names no image" in client.get("/api/refusal/frame?number=1&kind=damaged").json()["error"]


def test_two_releases_are_shown_side_by_side(made, release, tmp_path):
    other = made.release(tmp_path, {KEY: "train"})
    shown = Shown(title="t", release=ReleaseShelf(release), other=ReleaseShelf(other))
    client = TestClient(view_app(shown), base_url=BASE)
    assert client.get("/api/compare").json()["counts"] == {"left": 5, "right": 0, "changed": 0, "same": 1}
    assert client.get("/api/compare?where=left").json()["total"] == 5
    assert client.get("/api/clips?side=other").json()["total"] == 1


def test_without_a_release_the_first_page_is_that_of_the_source_or_of_what_was_refused(client, make_source):
    source = SourceShelf(make_source(), load_dataset("synthetic"))
    for shown, page in ((Shown(title="t", source=source), "source"), (Shown(title="t"), "refused")):
        alone = TestClient(view_app(shown), base_url=BASE)
        assert alone.get("/").text == client.get(f"/{page}").text
        assert alone.get("/api/clips").status_code == 404

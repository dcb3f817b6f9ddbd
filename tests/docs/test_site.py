"""The documentation as a site: built with warnings as errors, complete, and loading nothing from elsewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, ROOT / "docs/site/build.py", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return out


def test_every_page_of_the_documentation_has_its_place():
    listed = re.findall(r"- (docs/\w+\.md)$", (ROOT / "docs/site/mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").glob("*.md"))


def test_the_interface_is_told_from_the_docstrings(site):
    page = (site / "api/releases.html").read_text()
    for name in ("open_release", "decode", "to_pandas", "ClipDataset", "verify_release"):
        assert re.search(rf'id="wsm_data\.access\.[\w.]*{name}"', page), name
    assert "uint8 [T, H, W, 3]" in page


def test_what_pages_link_to_in_the_repository_came_along(site):
    assert (site / "docs/images/view_clip.png").read_bytes() == (ROOT / "docs/images/view_clip.png").read_bytes()
    assert (site / "bench/results/view.html").exists()


def test_no_page_loads_anything_from_elsewhere(site):
    loaded = re.compile(r"<(?:script|img|source|iframe)[^>]+src=.https?://|<link[^>]+stylesheet[^>]+https?://")
    assert [path.name for path in site.rglob("*.html") if loaded.search(path.read_text())] == []

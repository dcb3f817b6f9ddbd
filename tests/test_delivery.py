"""What is handed on: the workflow of the forge, the container file, and a wheel that works from any folder."""

import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def run(*command: object, cwd: Path = ROOT, **environment: str) -> str:
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        capture_output=True,
        text=True,
        env={**{name: value for name, value in os.environ.items() if name != "PYTHONPATH"}, **environment},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_workflow_runs_what_must_pass_before_a_change_lands_and_nothing_else():
    text = (ROOT / ".github/workflows/ci.yml").read_text()
    assert re.findall(r"^\s*- run: (.*)$", text, re.MULTILINE) == [".ci/run"]
    assert os.access(ROOT / ".ci/run", os.X_OK)
    lowest = re.search(r'requires-python = ">=([\d.]+)"', (ROOT / "pyproject.toml").read_text())[1]
    assert f'python: ["{lowest}"' in text


def test_the_container_file_has_nothing_that_hadolint_warns_of():
    run(Path(sys.executable).with_name("hadolint"), "Dockerfile")


def test_the_container_file_copies_what_is_not_ignored_and_all_that_the_wheel_is_made_of():
    copied = re.findall(r"^COPY (.*) \./?\S*$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    names = {name for line in copied for name in line.split()}
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert names == kept
    packages = re.search(r"include = \[(.*)\]", (ROOT / "pyproject.toml").read_text())[1]
    assert {word.strip('"* ') for word in packages.split(",")} <= names


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from what git tracks, as a fresh clone has it."""
    clone, out = tmp_path_factory.mktemp("clone"), tmp_path_factory.mktemp("wheel")
    names = run("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")
    for name in filter(None, names):
        if (ROOT / name).is_file():
            (clone / name).parent.mkdir(parents=True, exist_ok=True)
            (clone / name).write_bytes((ROOT / name).read_bytes())
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", out, clone)
    return next(out.glob("*.whl"))


@pytest.mark.slow
def test_the_wheel_holds_recipes_manifests_pages_and_no_test(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    data = [
        path.relative_to(ROOT).as_posix()
        for package in ("wsm_data", "wsm_model", "pipelines", "manifests")
        for path in (ROOT / package).rglob("*")
        if path.suffix in (".toml", ".html", ".js", ".css", ".svg", ".j2", ".typed")
    ]
    assert len(data) > 30
    assert set(data) - set(names) == set()
    assert [name for name in names if name.startswith(("tests/", "bench/"))] == []


@pytest.mark.slow
def test_the_installed_command_makes_a_release_and_shows_it_from_any_folder(wheel, tmp_path):
    """Its dependencies are those of this environment, which a path file lends; the project itself is the wheel's."""
    venv.create(tmp_path / "venv", with_pip=False)
    python = tmp_path / "venv/bin/python"
    [site] = (tmp_path / "venv").glob("lib/python*/site-packages")
    run(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile", "--target", site, wheel)
    lent = next(Path(path) for path in sys.path if path.endswith("site-packages"))
    (site / "lent.pth").write_text(f"{lent}\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    wsm = [python, "-m", "pipelines.cli"]
    where = run(python, "-c", "import wsm_data, pipelines; print(wsm_data.__path__, pipelines.__path__)", cwd=elsewhere)
    assert where.count(str(site)) == 2
    small = ("synth.scenes=1", "synth.trajectories=2", "synth.image_scale=0.25", "encode.clip.width=96")
    settings = [word for one in (*small, "encode.clip.height=64") for word in ("--set", one)]
    run(*wsm, "demo", "--out", "runs/demo", "--quiet", "--workers", 1, *settings, cwd=elsewhere)
    assert "whole" in run(*wsm, "verify", "runs/demo/pack/release", cwd=elsewhere)
    assert "interndata_n1" in run(*wsm, "settings", "index", cwd=elsewhere)
    assert (elsewhere / "runs/demo/report/report.html").stat().st_size > 10_000
    page = "from wsm_data.view.browser.app import PAGES, Shown, view_app; view_app(Shown(title='t')); print(PAGES)"
    assert "grid" in run(python, "-c", page, cwd=elsewhere)

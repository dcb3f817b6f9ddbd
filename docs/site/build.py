"""The documentation as a site: `python docs/site/build.py [FOLDER]`, by default `build/site`; needs the extra `docs`.

Pages link to one another and to files of the repository by relative paths, as a forge shows them. So the pages are
copied with the files that they link to, in the same places, and the site is built from there; pages of the public
interface are made from docstrings. A link to nothing, or anything else that mkdocs or griffe warns of, is an error.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIG = Path(__file__).with_name("mkdocs.yml")
API = {
    "releases": ("access.release", "access.clip_dataset", "access.verify", "clips.decoded"),
    "clips": ("schema.clip", "schema.clip_meta", "schema.camera", "schema.occupancy", "schema.depth"),
    "loaders": ("loaders.config", "loaders.loader", "schema.batch"),
    "selections": ("shards.selection", "curation.select", "curation.scores_table"),
    "sources": ("readers.source", "schema.episode", "schema.frames", "schema.dataset"),
    "errors": ("errors",),
}
_LINK = re.compile(r"(?:\]\(|^\[[^\]]+\]: *)([^()\s#]+)", re.MULTILINE)


def stage(folder: Path) -> None:
    """Copy all pages and what they link to, and write those of the interface."""
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
    waiting, staged = list(pages), set[Path]()
    while waiting:
        path = waiting.pop()
        if path in staged or not path.is_file():
            continue
        staged.add(path)
        copy = folder / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
        if path.suffix == ".md":
            links = (path.parent / link for link in _LINK.findall(path.read_text()) if "://" not in link)
            waiting += [link.resolve() for link in links if link.resolve().is_relative_to(ROOT)]
    for name, modules in API.items():
        text = "\n\n".join(f"::: wsm_data.{module}" for module in modules)
        (folder / "api").mkdir(exist_ok=True)
        (folder / "api" / f"{name}.md").write_text(f"# {name.capitalize()}\n\n{text}\n")


def build(out: Path) -> None:
    """Build the site; ends with mkdocs' exit code where it is not 0."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        stage(folder / "pages")
        text = CONFIG.read_text().replace("PACKAGES", str(ROOT))
        (folder / "mkdocs.yml").write_text(text)
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
        command += ["--config-file", str(folder / "mkdocs.yml"), "--site-dir", str(out.resolve())]
        done = subprocess.run(command, check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
    if done.returncode:
        sys.exit(done.returncode)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "site")

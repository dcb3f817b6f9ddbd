"""What is written in the repository holds on every machine and is finished."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# written so that this file does not match itself
MACHINE_PATH = re.compile(r"(?<![\w.~-])/(?:work|root|home/[a-z]\w*|Users/\w+)/")
UNFINISHED = re.compile(r"\b(?:TO[D]O|FIX[M]E|X[X]X|HAC[K])\b")
REGISTRY_HOST = re.compile(
    r"py[p]i\.org|python[h]osted\.org|registry\.np[m]js|deb\.deb[i]an\.org|download\.pyt[o]rch", re.IGNORECASE
)
MERGE_MARK = re.compile(r"^(?:<{7}|>{7}|={7}$)", re.MULTILINE)


def tracked_texts() -> dict[str, str]:
    """Text files that are tracked, or would be with the next `git add`."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    texts = {}
    for name in filter(None, listing.split("\0")):
        data = (ROOT / name).read_bytes() if (ROOT / name).is_file() else b"\0"
        if b"\0" not in data:  # pictures, arrays and archives hold zero bytes
            texts[name] = data.decode()
    return texts


@pytest.fixture(scope="module")
def texts():
    found = tracked_texts()
    assert "pyproject.toml" in found
    return found


def places(texts: dict[str, str], pattern: re.Pattern[str]) -> list[str]:
    return [
        f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]}"
        for name, text in texts.items()
        for match in pattern.finditer(text)
    ]


@pytest.mark.parametrize("pattern", [MACHINE_PATH, UNFINISHED, REGISTRY_HOST, MERGE_MARK], ids=lambda p: p.pattern[:24])
def test_no_text_holds_what_belongs_to_one_machine_or_is_not_finished(texts, pattern):
    assert places(texts, pattern) == []


@pytest.mark.parametrize(
    ("pattern", "line"),
    [
        (MACHINE_PATH, 'open("/ro' + 'ot/data")'),
        (MACHINE_PATH, "see /ho" + "me/jane/x"),
        (UNFINISHED, "# TO" + "DO later"),
        (REGISTRY_HOST, "https://pyp" + "i.org/simple"),
        (MERGE_MARK, "<<<<" + "<<< HEAD"),
    ],
)
def test_the_patterns_find_what_they_are_for(pattern, line):
    assert places({"a.py": f"first\n{line}\n"}, pattern) == [f"a.py:2: {pattern.search(line)[0]}"]


@pytest.mark.parametrize("line", ["https://example.org/{}/a", "runs/{}/x", "tests/{}/", "a / {} / b", "~/{}/x"])
def test_relative_paths_and_addresses_are_not_machine_paths(line):
    assert places({"a.py": line.format("work")}, MACHINE_PATH) == []


def test_text_files_end_in_one_newline_and_hold_no_carriage_returns(texts):
    empty_is_fine = {name for name, text in texts.items() if not text}
    assert [name for name, text in texts.items() if "\r" in text] == []
    assert [name for name, text in texts.items() if name not in empty_is_fine and not text.endswith("\n")] == []


def test_every_pinned_version_is_exact_and_without_a_local_label(texts):
    pins = texts["constraints.txt"].splitlines()
    assert pins
    assert [pin for pin in pins if not re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][A-Za-z0-9.]*", pin)] == []


def test_every_requirement_of_the_project_and_of_its_extras_is_pinned(texts):
    pinned = {re.sub(r"[-_.]+", "-", pin.split("==")[0]).lower() for pin in texts["constraints.txt"].splitlines()}
    project = tomllib.loads(texts["pyproject.toml"])["project"]
    extras = project["optional-dependencies"]
    requirements = [*project["dependencies"], *(one for extra in extras.values() for one in extra)]
    names = {re.match(r"[A-Za-z0-9._-]+", one)[0] for one in requirements} - {project["name"]}  # wsm[wan] is an extra
    assert {"numpy", "ray", "pytest", "embreex"} <= names
    assert {re.sub(r"[-_.]+", "-", name).lower() for name in names} - pinned == set()

"""The rules of the house that no linter knows. Layers are import-linter's, documentation and prints are ruff's."""

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("wsm_data", "wsm_model", "pipelines")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
EVERYTHING = [*SOURCES, *(path for folder in ("tests", "bench") for path in sorted((ROOT / folder).rglob("*.py")))]

MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 80
MAX_FOLDER_FILES = 20
MAX_SWALLOWING_HANDLERS = 3
NAMES_THAT_SAY_NOTHING = {"utils", "util", "misc", "common", "helpers", "helper", "tools", "stuff"}
SLOW_IMPORTS = {"torch", "cv2", "numba", "matplotlib", "diffusers", "trimesh"}
PICKLES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "shelve", "marshal", "joblib"}

ONLY_IMPORTED_IN = {
    "torch": (
        "wsm_data/access/clip_dataset.py",
        "wsm_data/codecs/wan.py",
        "wsm_data/loaders/",
        "wsm_model/",
        "pipelines/",
    ),
    "diffusers": ("wsm_data/codecs/wan.py", "wsm_model/"),
    "matplotlib": ("wsm_data/view/",),
    "jinja2": ("wsm_data/view/",),
    "starlette": ("wsm_data/view/browser/",),
    "uvicorn": ("pipelines/operations/clips/view.py",),
    # the peers we are measured against belong to bench/
    "casadi": (),
    "embreex": (),
    "evo": (),
    "isal": (),
    "plyfile": (),
    "skfmm": (),
}

DONE_ON_IMPORT = {
    "wsm_data/__init__.py": [  # numba decides when it is imported, by whatever module that has a kernel
        "from pathlib import Path",
        "from wsm_data.files.kernel_cache import settle_kernel_cache",
        "settle_kernel_cache(Path(__file__).parent)",
    ]
}
"""What importing a package does."""

WITHOUT_A_TEST_OF_ITS_OWN: dict[str, str] = {
    "wsm_data/codecs/base.py": "a protocol; every codec's own test holds it to that",
    "wsm_data/planners/http/fault.py": "names without behaviour; the tests of server and client ask for each",
    "wsm_data/planners/http/goal_client.py": "two names; the tests of service and server ask for both",
    "wsm_data/planners/http/handler.py": "one connection of a server; its test talks to it",
    "wsm_data/sim/world.py": "a protocol; every world's own test holds it to that",
    "wsm_data/sim/result.py": "values without behaviour; the tests of environment and scoring fill them",
}
"""Modules in wsm_data with no test of the same name, each with the reason."""


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(), filename=str(path))


def imported_packages(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.split(".")[0]


def calls_of_sources() -> Iterator[tuple[str, str, dict[str, str]]]:
    """Place, dotted name and spelled-out keyword arguments of every call in the packages."""
    for path in SOURCES:
        for node in ast.walk(parse(path)):
            if isinstance(node, ast.Call):
                keywords = {word.arg: ast.unparse(word.value) for word in node.keywords if word.arg}
                yield f"{relative(path)}:{node.lineno}", ast.unparse(node.func), keywords


def defines_something(path: Path) -> bool:
    return any(isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) for node in parse(path).body)


def mirror(path: Path) -> Path:
    """Where the test of a module stands, relative to tests/."""
    return path.relative_to(ROOT).parent / f"test_{path.name}"


def loaded_after(program: str) -> set[str]:
    program += "\nimport sys; print('LOADED', *sorted({name.split('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.rsplit("LOADED", 1)[1].split())


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_nothing_slow(package):
    loaded = loaded_after(f"import {package}")
    assert package in loaded
    assert not loaded & (SLOW_IMPORTS | {"numpy", "scipy", "pyarrow"})


def test_showing_the_help_loads_nothing_slow():
    loaded = loaded_after(
        "from pipelines.cli import app\n"
        "try: app(['--help'], prog_name='wsm')\n"
        "except SystemExit as end: assert not end.code, end.code"
    )
    assert "typer" in loaded
    assert not loaded & (SLOW_IMPORTS | {"numpy", "scipy", "pyarrow"})


@pytest.mark.parametrize("name", ONLY_IMPORTED_IN)
def test_a_heavy_or_foreign_package_is_imported_only_where_it_belongs(name):
    importers = [relative(path) for path in SOURCES if name in imported_packages(parse(path))]
    assert [importer for importer in importers if not importer.startswith(ONLY_IMPORTED_IN[name])] == []


def test_no_source_imports_a_module_that_unpickles():
    found = {relative(path): PICKLES & set(imported_packages(parse(path))) for path in SOURCES}
    assert {path: names for path, names in found.items() if names} == {}


def test_arrays_and_weights_are_loaded_without_pickles():
    unsafe = [
        f"{where} {name}"
        for where, name, keywords in calls_of_sources()
        if keywords.get("allow_pickle", "False") != "False"
        or (name == "torch.load" and keywords.get("weights_only") != "True")
    ]
    assert unsafe == []


def test_the_libraries_print_nothing_and_never_end_the_program():
    forbidden = {"print", "input", "exit", "quit", "sys.exit", "os._exit", "sys.stdout.write", "sys.stderr.write"}
    found = [f"{where} {name}" for where, name, _ in calls_of_sources() if name in forbidden]
    assert [call for call in found if not call.startswith("pipelines/")] == []


def test_files_are_of_a_readable_length():
    lengths = {relative(path): len(path.read_text().splitlines()) for path in EVERYTHING}
    assert {path: lines for path, lines in lengths.items() if lines > MAX_FILE_LINES} == {}


def _docstring_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    first = node.body[0]
    has_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return first.end_lineno - first.lineno + 1 if has_docstring else 0


def test_functions_are_of_a_readable_length():
    functions = [
        (f"{relative(path)}:{node.lineno} {node.name}", node.end_lineno - node.lineno + 1 - _docstring_lines(node))
        for path in EVERYTHING
        for node in ast.walk(parse(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    assert [found for found in functions if found[1] > MAX_FUNCTION_LINES] == []


def test_folders_are_of_a_readable_length():
    files = Counter(relative(path.parent) for path in SOURCES if path.name != "__init__.py")
    assert {folder: count for folder, count in files.items() if count > MAX_FOLDER_FILES} == {}


def test_no_module_or_folder_has_a_name_that_says_nothing():
    words = {
        relative(path): {part.removeprefix("test_") for part in Path(relative(path)).with_suffix("").parts}
        for path in EVERYTHING
    }
    assert [path for path, parts in words.items() if parts & NAMES_THAT_SAY_NOTHING] == []


def test_packages_hold_a_docstring_at_most_and_re_export_nothing():
    for path in SOURCES:
        if path.name == "__init__.py":
            tree = parse(path)
            statements = tree.body[1:] if ast.get_docstring(tree) else tree.body
            found = [ast.unparse(node) for node in statements]
            assert found == DONE_ON_IMPORT.get(relative(path), []), relative(path)


def test_few_handlers_catch_everything_and_go_on():
    swallowing = [
        f"{relative(path)}:{node.lineno}"
        for path in SOURCES
        for node in ast.walk(parse(path))
        if isinstance(node, ast.ExceptHandler)
        and (node.type is None or re.search(r"\b(Base)?Exception\b", ast.unparse(node.type)))
        and not any(isinstance(inner, ast.Raise) for inner in ast.walk(node))
    ]
    assert len(swallowing) <= MAX_SWALLOWING_HANDLERS, swallowing


def test_every_module_of_the_library_has_a_test_of_the_same_name():
    modules = [path for path in SOURCES if path.is_relative_to(ROOT / "wsm_data") and defines_something(path)]
    untested = {relative(path) for path in modules if not (ROOT / "tests" / mirror(path)).exists()}
    assert untested == set(WITHOUT_A_TEST_OF_ITS_OWN)


def test_every_test_of_a_module_stands_where_its_module_does():
    mirrored = [path for package in PACKAGES for path in (ROOT / "tests" / package).rglob("test_*.py")]
    modules = {mirror(path) for path in SOURCES}

    def stands_right(test: Path) -> bool:
        """Tests of one module may fill two files: test_encode.py and test_encode_refusals.py."""
        words = test.stem.split("_")
        stems = ["_".join(words[:count]) for count in range(2, len(words) + 1)]
        return any(test.relative_to(ROOT / "tests").with_name(f"{stem}.py") in modules for stem in stems)

    assert [relative(path) for path in mirrored if not stands_right(path)] == []

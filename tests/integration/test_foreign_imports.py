"""Commands load nothing that the project does not depend on, although it is installed."""

import os
import subprocess
import sys
from pathlib import Path

FOREIGN = ("pandas", "tensorflow", "jax", "polars", "IPython")
COMMANDS = """
import sys
from typer.testing import CliRunner
from pipelines.cli import app

for words in (["inspect", sys.argv[1]], ["verify", sys.argv[1]]):
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
print("LOADED", *sorted(sys.modules))
"""


def test_looking_at_a_release_and_verifying_it_imports_nothing_foreign(homes_release: Path, tmp_path: Path) -> None:
    for name in FOREIGN:
        (tmp_path / f"{name}.py").write_text("__version__ = '99.0'\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-c", COMMANDS, str(homes_release)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert "LOADED" in loaded
    assert loaded & set(FOREIGN) == set()

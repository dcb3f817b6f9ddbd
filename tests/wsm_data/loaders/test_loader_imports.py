"""What a first batch loads: nothing that the project does not depend on, although it is installed."""

import os
import subprocess
import sys

FOREIGN = ("pandas", "tensorflow", "jax", "polars", "IPython")
FIRST_BATCH = """
import sys
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader

config = LoaderConfig(sources=(SourceConfig(release=sys.argv[1], split=""),), order=OrderConfig(global_batch=2))
with ClipLoader(config) as loader:
    batch = next(iter(loader))
    loader.sources.tables[0].release.read_clip(batch.keys[0])
print("LOADED", *sorted(sys.modules))
"""


def test_a_first_batch_imports_nothing_that_the_project_does_not_depend_on(released, tmp_path):
    """pyarrow imports pandas in most conversions to numpy, wherever it is installed: 150 ms before the first batch."""
    for name in FOREIGN:
        (tmp_path / f"{name}.py").write_text("__version__ = '99.0'\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-c", FIRST_BATCH, str(released.folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert "LOADED" in loaded
    assert loaded & set(FOREIGN) == set()

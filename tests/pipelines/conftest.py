"""The fake stages and their fixtures; their folder is put on the path, which worker processes inherit."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "fakes"))

from fake_runs import calls, config, fakes_on_path, out, source  # noqa: F401

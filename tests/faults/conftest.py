"""The fake stages of the stage tests, for runs that are killed."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "pipelines" / "fakes"))

from fake_runs import calls, config, fakes_on_path, out, source  # noqa: F401

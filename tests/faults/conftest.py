"""The fake stages of the stage tests, for runs that are killed; the tiny release, for training that is killed."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "pipelines" / "fakes"))
sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from fake_runs import calls, config, fakes_on_path, out, source  # noqa: F401
from tiny_release import clips, make_clip, tiny  # noqa: F401

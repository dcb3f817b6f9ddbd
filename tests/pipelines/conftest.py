"""The fake stages, and the tiny release of the library's tests; their folders are put on the path, which worker
processes inherit."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "fakes"))
sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from fake_runs import calls, config, fakes_on_path, out, source  # noqa: F401
from tiny_release import clips, make_clip, packed_tiny, tiny  # noqa: F401

"""The tiny release of the library's tests, for commands that read one."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "wsm_data" / "fakes"))

from tiny_release import clips, make_clip, tiny  # noqa: F401

"""The tiny release."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

from tiny_release import clips, make_clip, packed_tiny, tiny  # noqa: F401

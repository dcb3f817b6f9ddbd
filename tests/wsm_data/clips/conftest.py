"""The rooms and drives of the stage tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "pipelines" / "fakes"))

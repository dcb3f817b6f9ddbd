"""An empty bucket of a local object store whose answers can be spoilt."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

from hub_server import hub  # noqa: F401
from remote_release import bucket, store_proxy, store_server  # noqa: F401

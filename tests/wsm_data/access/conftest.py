"""A tiny release on disk, and one behind a local object store whose answers can be spoilt."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from loader_release import expected_batch, make_loader, released  # noqa: F401
from remote_release import address, published, remote, store_proxy, store_server  # noqa: F401
from tiny_release import clips, make_clip, packed_tiny, tiny  # noqa: F401

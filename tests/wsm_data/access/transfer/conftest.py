"""A tiny release, an empty bucket of a local object store, and a stand-in of the Hugging Face Hub."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

import pytest
from hub_server import hub  # noqa: F401
from remote_release import bucket, store_proxy, store_server  # noqa: F401
from tiny_release import clips, make_clip, packed_tiny, tiny  # noqa: F401

from wsm_data.access.transfer.config import PublishConfig
from wsm_data.access.transfer.publish import publish_release


@pytest.fixture
def publish(tiny):  # noqa: F811
    """Publishes the tiny release, or another folder."""

    def to(url, folder=None, about=None, **changes):
        return publish_release(folder or tiny.folder, url, PublishConfig(**changes), about or {}, lambda count: None)

    return to


@pytest.fixture
def memory_url(tmp_path):
    return f"memory://published-{tmp_path.name}"

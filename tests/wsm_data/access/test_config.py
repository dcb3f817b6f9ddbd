"""Settings of access: those of the store, and words as users spell them."""

import pytest

from wsm_data.access.config import AccessConfig, RemoteAccess
from wsm_data.files.retries import RequestConfig
from wsm_data.loaders.config import ReadConfig


def test_requests_have_the_defaults_of_the_store():
    config, request = AccessConfig(), RequestConfig()
    assert (config.attempts, config.first_backoff_s) == (request.attempts, request.first_backoff_s)
    assert config.request_timeout_s == request.timeout_s


@pytest.mark.parametrize("config_type", [AccessConfig, ReadConfig])
def test_a_way_of_access_is_a_word(config_type):
    assert config_type(access="shards").access is RemoteAccess.SHARDS
    with pytest.raises(ValueError, match="'nearby' is not a valid RemoteAccess"):
        config_type(access="nearby")

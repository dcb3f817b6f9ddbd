import pytest

from wsm_data.access.transfer.config import PublishConfig


@pytest.mark.parametrize("changes", [{"threads": 0}, {"part_mib": 4}])
def test_settings_that_no_store_takes_are_refused(changes):
    with pytest.raises(ValueError, match="must be at least"):
        PublishConfig(**changes)

import pytest

from wsm_data.schema.read_limits import ReadLimits


@pytest.mark.parametrize("name", ["max_frames", "max_file_bytes", "max_json_bytes", "max_image_pixels"])
def test_a_limit_that_lets_nothing_through_is_refused(name):
    with pytest.raises(ValueError, match=name):
        ReadLimits(**{name: 0})

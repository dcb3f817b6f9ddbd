import json

import pytest

from wsm_data.files.json_values import from_json, to_json
from wsm_data.schema.codec import CodecInfo

INFO = CodecInfo(name="wan", digest="d", latent_mean=(0.5, 1.0), latent_std=(2.0, 3.0), settings={"posterior": "mode"})


@pytest.mark.parametrize("info", [INFO, CodecInfo(name="dct", digest="e", settings={"whitening": 0.5})])
def test_what_a_codec_says_of_itself_comes_back_from_json(info):
    assert from_json(CodecInfo, json.loads(json.dumps(to_json(info)))) == info


def test_a_codec_that_says_nothing_of_whitening_is_whitened():
    assert INFO.whitening == 1.0
    assert CodecInfo(name="dct", digest="e", settings={"whitening": 0.25}).whitening == 0.25


@pytest.mark.parametrize("whitening", [-0.1, 1.1, float("nan"), "1", 1])
def test_whitening_that_is_no_share_is_refused(whitening):
    with pytest.raises(ValueError, match=r"whitening must"):
        CodecInfo(name="dct", digest="e", settings={"whitening": whitening})

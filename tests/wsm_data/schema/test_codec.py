import json

import pytest

from wsm_data.files.json_values import from_json, to_json
from wsm_data.schema.codec import CodecInfo

INFO = CodecInfo(name="wan", digest="d", latent_mean=(0.5, 1.0), latent_std=(2.0, 3.0), settings={"posterior": "mode"})


@pytest.mark.parametrize("info", [INFO, CodecInfo(name="dct", digest="e")])
def test_what_a_codec_says_of_itself_comes_back_from_json(info):
    assert from_json(CodecInfo, json.loads(json.dumps(to_json(info)))) == info

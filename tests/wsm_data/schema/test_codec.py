import json
from dataclasses import asdict

import pytest

from wsm_data.schema.codec import CodecInfo

INFO = CodecInfo(name="wan", digest="d", latent_mean=(0.5, 1.0), latent_std=(2.0, 3.0), settings={"posterior": "mode"})


@pytest.mark.parametrize("info", [INFO, CodecInfo(name="dct", digest="e")])
def test_what_a_codec_says_of_itself_comes_back_from_json(info):
    assert CodecInfo.from_json(json.loads(json.dumps(asdict(info)))) == info


def test_a_description_with_a_field_too_few_or_too_many_is_refused():
    record = asdict(INFO)
    with pytest.raises(TypeError, match="colour"):
        CodecInfo.from_json({**record, "colour": 1})
    with pytest.raises(KeyError, match="latent_mean"):
        CodecInfo.from_json({name: value for name, value in record.items() if name != "latent_mean"})

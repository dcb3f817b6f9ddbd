import subprocess
import sys

import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.registry import CodecConfig, describe_codec, make_codec
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config


def test_the_default_is_the_built_in_codec():
    assert make_codec(CodecConfig()) == DctCodec()


@pytest.mark.parametrize(
    ("name", "near"), [("dtc", r"did you mean dct\?"), ("wan2.2", r"did you mean wan\?"), ("", "known: dct, wan")]
)
def test_an_unknown_name_is_refused_with_the_nearest(name, near):
    with pytest.raises(ConfigError, match=f"codec.name '{name}' is not known; {near}"):
        make_codec(CodecConfig(name=name))


@pytest.mark.parametrize("setting", [{"weights": "folder"}, {"dtype": "bfloat16"}, {"device": "cuda"}])
def test_settings_that_the_built_in_codec_cannot_honour_are_refused(setting):
    with pytest.raises(ConfigError, match="dct has no weights"):
        make_codec(CodecConfig(**setting))


def test_a_batch_of_no_clips_is_refused():
    with pytest.raises(ValueError, match="batch_clips must be at least 1, found 0"):
        CodecConfig(batch_clips=0)
    with pytest.raises(ConfigError, match=r"encode\.codec: batch_clips must be"):
        build_config(CodecConfig, {"batch_clips": 0}, "encode.codec")


def test_device_and_batches_do_not_change_the_digest():
    plain = make_codec(CodecConfig()).describe().digest
    assert make_codec(CodecConfig(device="cpu", batch_clips=8)).describe().digest == plain


def test_a_codec_is_described_as_it_describes_itself():
    assert describe_codec(CodecConfig()) == make_codec(CodecConfig()).describe()
    with pytest.raises(ConfigError, match=r"did you mean dct\?"):
        describe_codec(CodecConfig(name="dtc"))


def test_settings_are_read_without_torch_numba_or_opencv():
    program = (
        "import sys, wsm_data.codecs.registry;"
        "found = {'torch', 'numba', 'cv2', 'diffusers'} & set(sys.modules);"
        "sys.exit(f'imported {found}' if found else 0)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_wan_without_its_packages_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "diffusers", None)  # what Python does for a package that is not installed
    monkeypatch.delitem(sys.modules, "wsm_data.codecs.wan", raising=False)
    with pytest.raises(ConfigError, match=r"pip install 'wsm\[wan\]'"):
        make_codec(CodecConfig(name="wan", weights="folder"))
    with pytest.raises(ConfigError, match=r"pip install 'wsm\[wan\]'"):
        describe_codec(CodecConfig(name="wan", weights="folder"))

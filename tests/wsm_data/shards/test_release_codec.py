"""The codec of a release, built from what its manifest says."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.registry import CodecConfig
from wsm_data.errors import ConfigError
from wsm_data.shards.release_codec import codec_of

DCT = DctCodec().describe()


def manifest(codec):
    return SimpleNamespace(name="homes", codec=codec)


def test_the_codec_is_the_one_that_encoded():
    assert codec_of(manifest(DCT)).describe() == DCT


def test_a_codec_of_the_same_name_that_is_another_is_refused_with_both_digests():
    older = replace(DCT, digest="0123456789abcdef" * 4)
    with pytest.raises(
        ConfigError, match=f"release homes was encoded with codec dct 0123456789ab.* are {DCT.digest[:12]}"
    ):
        codec_of(manifest(older))


def test_a_codec_that_does_not_exist_here_is_refused():
    with pytest.raises(ConfigError, match=r"codec\.name 'dcd' is not known; did you mean dct"):
        codec_of(manifest(replace(DCT, name="dcd")))


def test_weights_for_a_codec_that_has_none_are_refused():
    with pytest.raises(ConfigError, match="codec dct has no weights"):
        codec_of(manifest(DCT), "some/folder")


def test_weights_and_the_releases_own_dtype_are_passed_on(monkeypatch):
    asked = []

    def make(config):
        asked.append(config)
        return DctCodec()

    monkeypatch.setattr("wsm_data.shards.release_codec.make_codec", make)
    codec_of(manifest(replace(DCT, name="wan", dtype="bfloat16")), "some/folder")
    assert asked == [CodecConfig(name="wan", dtype="bfloat16", weights="some/folder")]

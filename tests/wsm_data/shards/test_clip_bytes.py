import io
import tarfile
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.files.digest import xxh3_64
from wsm_data.schema.clip import Clip
from wsm_data.shards.clip_bytes import decode_clip, encode_clip


def test_a_clip_comes_back_to_the_bit(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip()
    data, members = encode_clip(clip)
    again = decode_clip(memoryview(data), members, "here")
    assert again.meta == clip.meta
    for name, array in clip.arrays().items():
        assert again.arrays()[name].tobytes() == array.tobytes()
        assert (again.arrays()[name].dtype, again.arrays()[name].shape) == (array.dtype, array.shape)


def test_decoded_arrays_are_read_only_views_of_the_bytes(make_clip: Callable[..., Clip]) -> None:
    data, members = encode_clip(make_clip())
    buffer = np.frombuffer(data, np.uint8)
    clip = decode_clip(memoryview(data), members, "here")
    for array in clip.arrays().values():
        assert np.shares_memory(array, buffer)
        assert not array.flags.writeable


def test_equal_clips_give_equal_bytes_whatever_their_memory_layout(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip()
    turned = replace(clip, rgb_latent=np.asfortranarray(clip.rgb_latent), poses=np.repeat(clip.poses, 2, 0)[::2])
    assert encode_clip(turned) == encode_clip(clip)


def test_numpy_reads_every_member_from_the_tar(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip()
    data, members = encode_clip(clip)
    with tarfile.open(fileobj=io.BytesIO(data + bytes(1024))) as archive:
        files = {entry.name: archive.extractfile(entry) for entry in archive}
        contents = {name: file.read() for name, file in files.items() if file is not None}
    assert list(contents) == [f"{clip.meta.key}.{member.file_name}" for member in members]
    for name, array in clip.arrays().items():
        file = io.BytesIO(contents[f"{clip.meta.key}.{name}.npy"])
        np.testing.assert_array_equal(np.load(file, allow_pickle=False), array)


def test_the_table_gives_the_checksum_of_the_array_bytes_alone(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip()
    _, members = encode_clip(clip)
    assert [member.checksum for member in members[:-1]] == [xxh3_64(a.tobytes()) for a in clip.arrays().values()]


def test_members_that_are_no_clip_are_refused(make_clip: Callable[..., Clip]) -> None:
    data, members = encode_clip(make_clip())
    damaged = bytearray(data)
    poses = next(member for member in members if member.name == "poses")
    damaged[poses.array_offset : poses.array_offset + 4] = np.float32(3).tobytes()
    with pytest.raises(IntegrityError, match="poses must start with the identity"):
        decode_clip(memoryview(damaged), members, "here")


@pytest.mark.parametrize("text", [b"{", b"[]", b"{}", b"\xff"])
def test_meta_data_that_are_not_those_of_a_clip_are_refused(make_clip: Callable[..., Clip], text: bytes) -> None:
    data, members = encode_clip(make_clip())
    damaged = bytearray(data)
    meta = members[-1]
    damaged[meta.array_offset : meta.array_offset + meta.array_size] = text.ljust(meta.array_size)
    with pytest.raises(IntegrityError, match="must form a valid clip"):
        decode_clip(memoryview(damaged), members, "here")


def test_a_scene_with_a_dot_is_stored_under_a_key_without(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip("mp3d_zed/v1.0 home/000001")
    data, members = encode_clip(clip)
    assert data.startswith(b"mp3d_zed/v1%2E0%20home/000001.rgb_latent.npy\0")
    assert decode_clip(memoryview(data), members, "here").meta.id.scene == "v1.0 home"


def test_a_name_too_long_to_store_is_refused(make_clip: Callable[..., Clip]) -> None:
    with pytest.raises(DataError) as caught:
        encode_clip(make_clip("g_zed/" + "s" * 199 + "/" + "e" * 60))
    assert caught.value.reason == Reason.EPISODE_UNSTORABLE_NAME


def test_meta_data_under_another_key_than_their_own_are_a_bug(make_clip: Callable[..., Clip]) -> None:
    with pytest.raises(ValueError, match="must be that of its id"):
        encode_clip(make_clip(key="other"))


def test_a_clip_without_depth_comes_back_without_its_members(make_clip: Callable[..., Clip]) -> None:
    clip = replace(make_clip(), depth_latent=None, depth_valid=None)
    data, members = encode_clip(clip)
    with tarfile.open(fileobj=io.BytesIO(data + bytes(1024))) as archive:
        names = [name.removeprefix(f"{clip.meta.key}.") for name in archive.getnames()]
    assert names == [
        "rgb_latent.npy",
        "poses.npy",
        "occupancy.npy",
        "geodesic_mm.npy",
        "expert_distance.npy",
        "meta.json",
    ]
    again = decode_clip(memoryview(data), members, "here")
    assert (again.depth_latent, again.depth_valid) == (None, None)
    assert np.array_equal(again.poses, clip.poses)

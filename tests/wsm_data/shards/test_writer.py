import hashlib
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import webdataset

from wsm_data.errors import IntegrityError
from wsm_data.schema.clip import Clip
from wsm_data.shards.fragment import build_fragment, write_fragment
from wsm_data.shards.shard_layout import PlacedClip, ShardLayout, lay_out_shards
from wsm_data.shards.writer import write_blocks, write_shard

# webdataset leaves the file it reads to the garbage collector
reads_with_webdataset = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture
def packed(clips: tuple[Clip, ...], tmp_path: Path) -> SimpleNamespace:
    paths = {clip.meta.key: write_fragment(tmp_path / "encode", build_fragment(clip)) for clip in clips}
    sizes = {key: path.stat().st_size for key, path in paths.items()}
    [layout] = lay_out_shards([PlacedClip(key=key, split="train", size_bytes=size) for key, size in sizes.items()])
    return SimpleNamespace(paths=paths, layout=layout, path=tmp_path / "release" / layout.name)


def test_a_shard_is_its_fragments_and_an_end_of_archive(packed: SimpleNamespace) -> None:
    info = write_shard(packed.path, packed.layout, packed.paths.__getitem__)
    data = packed.path.read_bytes()
    assert data == b"".join(packed.paths[clip.key].read_bytes() for clip in packed.layout.clips) + bytes(1024)
    assert (info.name, info.split, info.clips) == ("train-000000.tar", "train", 7)
    assert (info.bytes, info.sha256) == (len(data), hashlib.sha256(data).hexdigest())
    assert info.bytes == packed.layout.size_bytes


def test_a_release_is_unfinished_from_the_first_shard_that_is_written_again(packed: SimpleNamespace) -> None:
    packed.path.parent.mkdir()
    (packed.path.parent / "dataset.json").write_bytes(b"of an earlier release")
    write_shard(packed.path, packed.layout, packed.paths.__getitem__)
    assert [path.name for path in packed.path.parent.iterdir()] == [packed.path.name]


@reads_with_webdataset
def test_stock_webdataset_reads_every_clip_with_its_dtypes_and_shapes(
    packed: SimpleNamespace, clips: tuple[Clip, ...]
) -> None:
    write_shard(packed.path, packed.layout, packed.paths.__getitem__)
    samples = {s["__key__"]: s for s in webdataset.WebDataset(str(packed.path), shardshuffle=False).decode()}
    assert list(samples) == [clip.key for clip in packed.layout.clips]
    for clip in clips:
        sample = samples[clip.meta.key]
        assert sample["meta.json"]["id"]["scene"] == clip.meta.id.scene
        for name, array in clip.arrays().items():
            read = sample[f"{name}.npy"]
            assert (read.dtype, read.shape) == (array.dtype, array.shape)
            np.testing.assert_array_equal(read, array)


LONGEST = "g" * 90 + "_zed/" + "s" * 100 + "/" + "e" * 59  # 255 bytes


@reads_with_webdataset
@pytest.mark.parametrize("unit", [LONGEST, "mp3d_zed/v1.0 home/000001"], ids=["255 bytes", "dots and blanks"])
def test_stock_webdataset_reads_clips_of_unusual_names(
    unit: str, make_clip: Callable[..., Clip], tmp_path: Path
) -> None:
    clips = [make_clip(unit), make_clip()]
    paths = {clip.meta.key: write_fragment(tmp_path, build_fragment(clip)) for clip in clips}
    placed = [PlacedClip(key=key, split="train", size_bytes=path.stat().st_size) for key, path in paths.items()]
    [layout] = lay_out_shards(placed)
    write_shard(tmp_path / layout.name, layout, paths.__getitem__)
    read = webdataset.WebDataset(str(tmp_path / layout.name), shardshuffle=False).decode()
    samples = {sample["__key__"]: sample for sample in read}
    assert set(samples) == {clip.meta.key for clip in clips}
    for clip in clips:
        np.testing.assert_array_equal(samples[clip.meta.key]["poses.npy"], clip.poses)


def test_gnu_tar_extracts_a_shard_without_a_word(packed: SimpleNamespace, tmp_path: Path) -> None:
    write_shard(packed.path, packed.layout, packed.paths.__getitem__)
    done = subprocess.run(["tar", "-xf", packed.path, "-C", tmp_path], capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")
    key = packed.layout.clips[0].key
    assert np.load(tmp_path / f"{key}.poses.npy", allow_pickle=False).shape[1] == 7


def _write_refused(packed: SimpleNamespace) -> str:
    with pytest.raises(IntegrityError) as caught:
        write_shard(packed.path, packed.layout, packed.paths.__getitem__)
    assert not packed.path.exists()
    return str(caught.value)


def test_a_fragment_changed_since_it_was_encoded_is_named_and_no_shard_appears(packed: SimpleNamespace) -> None:
    key = packed.layout.clips[3].key
    data = bytearray(packed.paths[key].read_bytes())
    data[5000] ^= 1
    packed.paths[key].write_bytes(data)
    assert f"clip {key}: its fragment" in _write_refused(packed)


@pytest.mark.parametrize(
    "change", [lambda data: data[:-512], lambda data: data + bytes(512)], ids=["shorter", "longer"]
)
def test_a_fragment_of_another_length_is_named(packed: SimpleNamespace, change: Callable[[bytes], bytes]) -> None:
    key = packed.layout.clips[0].key
    packed.paths[key].write_bytes(change(packed.paths[key].read_bytes()))
    assert f"clip {key}: its fragment" in _write_refused(packed)


def test_a_missing_fragment_is_named(packed: SimpleNamespace) -> None:
    key = packed.layout.clips[2].key
    packed.paths[key].unlink()
    assert f"clip {key}: its fragment" in _write_refused(packed)


def test_a_fragment_encoded_again_since_the_layout_is_refused(
    packed: SimpleNamespace, make_clip: Callable[..., Clip], tmp_path: Path
) -> None:
    clip = packed.layout.clips[1]
    write_fragment(tmp_path / "encode", build_fragment(make_clip(clip.key, latents=7)))
    assert "run `wsm pack` again" in _write_refused(packed)


def test_a_fragment_of_another_clip_is_refused(packed: SimpleNamespace) -> None:
    first, second = packed.layout.clips[:2]
    packed.paths[first.key] = packed.paths[second.key]
    assert f"clip {first.key}: the layout expects" in _write_refused(packed)


def test_a_shard_under_another_name_is_a_bug(packed: SimpleNamespace) -> None:
    with pytest.raises(ValueError, match=r"train-000000\.tar must be written under its own name"):
        write_shard(packed.path.with_name("other.tar"), packed.layout, packed.paths.__getitem__)


def test_a_shard_of_nothing_is_an_end_of_archive(tmp_path: Path) -> None:
    layout = ShardLayout(name="train-000000.tar", split="train", clips=())
    assert write_shard(tmp_path / layout.name, layout, Path).bytes == 1024


def test_a_clip_of_more_or_fewer_bytes_than_laid_out_is_refused(tmp_path):
    clip = PlacedClip(key="g/s/1", split="train", size_bytes=1024)
    layout = ShardLayout(name="train-000000.tar", split="train", clips=(clip,))
    with pytest.raises(IntegrityError, match="clip g/s/1 must have 1024 bytes, found 512"):
        write_blocks(tmp_path / layout.name, layout, lambda _: [bytes(512)])
    assert list(tmp_path.iterdir()) == []

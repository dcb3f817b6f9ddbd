from collections.abc import Callable
from pathlib import Path

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_128
from wsm_data.schema.clip import Clip
from wsm_data.shards.fragment import build_fragment, fragment_path, read_fragment_info, write_fragment
from wsm_data.shards.statistics import clip_sums


def test_a_fragment_stands_under_its_key_with_a_sidecar_beside(make_clip: Callable[..., Clip], tmp_path: Path) -> None:
    fragment = build_fragment(make_clip())
    path = write_fragment(tmp_path, fragment)
    assert path == fragment_path(tmp_path, "synth_d435i/home_0001/000003")
    files = [str(file.relative_to(tmp_path)) for file in sorted(tmp_path.rglob("*")) if file.is_file()]
    assert files == ["synth_d435i/home_0001/000003.clip", "synth_d435i/home_0001/000003.json"]
    assert path.read_bytes() == fragment.data


def test_the_sidecar_says_all_that_packing_needs(make_clip: Callable[..., Clip], tmp_path: Path) -> None:
    clip = make_clip(padded_frames=2)
    fragment = build_fragment(clip)
    info = read_fragment_info(write_fragment(tmp_path, fragment))
    assert (info.meta, info.members) == (clip.meta, fragment.info.members)
    assert (info.size_bytes, info.digest) == (len(fragment.data), xxh3_128(fragment.data))
    assert info.rgb_sums.mean == clip_sums(clip)[0].mean
    assert info.depth_sums.squared_deviations == clip_sums(clip)[1].squared_deviations


def test_equal_clips_give_equal_files(make_clip: Callable[..., Clip], tmp_path: Path) -> None:
    first = write_fragment(tmp_path / "a", build_fragment(make_clip()))
    second = write_fragment(tmp_path / "b", build_fragment(make_clip()))
    assert first.read_bytes() == second.read_bytes()
    assert first.with_suffix(".json").read_bytes() == second.with_suffix(".json").read_bytes()


def test_a_fragment_without_sidecar_is_unfinished(make_clip: Callable[..., Clip], tmp_path: Path) -> None:
    path = write_fragment(tmp_path, build_fragment(make_clip()))
    path.with_suffix(".json").unlink()
    with pytest.raises(IntegrityError, match="unfinished; encode it again"):
        read_fragment_info(path)


def test_a_kill_between_the_two_files_leaves_no_sidecar_of_older_bytes(
    make_clip: Callable[..., Clip], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_fragment(tmp_path, build_fragment(make_clip()))

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("wsm_data.shards.fragment.write_text", killed)
    with pytest.raises(KeyboardInterrupt):
        write_fragment(tmp_path, build_fragment(make_clip(latents=4)))
    with pytest.raises(IntegrityError, match="unfinished"):
        read_fragment_info(path)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"fragment_version": 99}'])
def test_a_sidecar_of_another_form_is_refused(make_clip: Callable[..., Clip], tmp_path: Path, text: str) -> None:
    path = write_fragment(tmp_path, build_fragment(make_clip()))
    path.with_suffix(".json").write_text(text)
    with pytest.raises(IntegrityError, match="must be the sidecar of a fragment"):
        read_fragment_info(path)

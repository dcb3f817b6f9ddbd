from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from wsm_data.access.verify_clip import check_clip
from wsm_data.files.digest import xxh3_64
from wsm_data.schema.clip import Clip
from wsm_data.schema.depth import DepthRange
from wsm_data.shards.clip_bytes import encode_clip
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.fragment import build_fragment
from wsm_data.shards.index.row import IndexRow, index_row
from wsm_data.shards.manifest import ReleaseManifest

START = 512 * 1000


@dataclass(frozen=True)
class Stored:
    """A clip as it stands in a shard, with the release it belongs to."""

    data: bytes
    row: IndexRow
    manifest: ReleaseManifest

    def check(self, data: bytes | None = None, **changes: object) -> list[Finding]:
        """Check the clip, or other bytes in its place, against its row with changes."""
        return check_clip(memoryview(self.data if data is None else data), replace(self.row, **changes), self.manifest)


def _stored(clip: Clip, manifest: ReleaseManifest) -> Stored:
    fragment = build_fragment(clip)
    row = index_row(fragment.info, split="train", shard="train-000000.tar", position=0, clip_offset=START)
    return Stored(fragment.data, row, manifest)


@pytest.fixture
def stored(make_clip: Callable[..., Clip], tiny: SimpleNamespace) -> Stored:
    return _stored(make_clip(), tiny.manifest)


def _only(findings: list[Finding], kind: FindingKind) -> str:
    [finding] = findings
    assert (finding.kind, finding.shard, finding.clip) == (kind, "train-000000.tar", "synth_d435i/home_0001/000003")
    return finding.message


def test_a_sound_clip_has_no_findings(stored: Stored) -> None:
    assert stored.check() == []


def test_every_changed_header_or_padding_byte_is_found_where_it_is(stored: Stored) -> None:
    for member in stored.row.members:
        for kind, start, end in (
            (FindingKind.CLIP_HEADER, member.header_offset, member.array_offset),
            (FindingKind.CLIP_PADDING, member.data_offset + member.data_size, member.end_offset),
        ):
            for place in range(start, end, 7):
                damaged = bytearray(stored.data)
                damaged[place] ^= 0x01
                message = _only(stored.check(damaged), kind)
                assert member.file_name in message
                assert kind != FindingKind.CLIP_HEADER or f"at byte {START + place} of the shard" in message


def test_tar_and_npy_headers_are_told_apart(stored: Stored) -> None:
    member = stored.row.members[0]
    for place, name in ((member.header_offset + 3, "tar"), (member.data_offset + 20, "npy")):
        damaged = bytearray(stored.data)
        damaged[place] ^= 0xFF
        assert f"the {name} header of rgb_latent.npy" in _only(stored.check(damaged), FindingKind.CLIP_HEADER)


def test_every_changed_payload_byte_is_found_in_its_member(stored: Stored) -> None:
    for member in stored.row.members:
        for place in range(member.array_offset, member.array_offset + member.array_size, 97):
            damaged = bytearray(stored.data)
            damaged[place] ^= 0x80
            message = _only(stored.check(damaged), FindingKind.CLIP_PAYLOAD)
            assert f"the checksum of {member.file_name}" in message


def test_a_cut_at_any_length_is_described_by_where_it_falls(stored: Stored) -> None:
    assert "the shard ends before the clip" in _only(stored.check(b""), FindingKind.CLIP_LOST)
    for member in stored.row.members:
        cuts = {
            f"before {member.file_name}": member.header_offset,
            f"inside the header of {member.file_name}": member.header_offset + 100,
            f"inside {member.file_name}": member.array_offset + 5,
        }
        for place, length in cuts.items():
            if length:
                message = _only(stored.check(stored.data[:length]), FindingKind.CLIP_CUT)
                assert f"the shard ends {place}" in message


def test_members_that_form_no_valid_clip_are_found_though_their_checksums_fit(stored: Stored) -> None:
    damaged = bytearray(stored.data)
    poses = next(member for member in stored.row.members if member.name == "poses")
    damaged[poses.array_offset + 12 : poses.array_offset + 16] = np.float32(0.5).tobytes()
    content = bytes(damaged[poses.array_offset : poses.array_offset + poses.array_size])
    members = tuple(
        replace(member, checksum=xxh3_64(content)) if member.name == "poses" else member
        for member in stored.row.members
    )
    message = _only(stored.check(damaged, members=members), FindingKind.CLIP_INVALID)
    assert "poses must start with the identity" in message


@pytest.mark.parametrize(
    "change",
    [
        {"source_digest": "other"},
        {"dataset": "other"},
        {"padded_frames": 1},
        {"camera": "zed"},
        {"physical_scene": "synth/home_0002"},
        {"episode": "000004"},
    ],
)
def test_a_row_that_disagrees_with_the_meta_data_is_found(stored: Stored, change: dict[str, object]) -> None:
    assert "as in the index" in _only(stored.check(**change), FindingKind.CLIP_MISMATCH)


def test_a_clip_of_another_codec_is_found_in_index_and_meta_data(
    make_clip: Callable[..., Clip], tiny: SimpleNamespace
) -> None:
    findings = _stored(make_clip(codec_digest="0ther"), tiny.manifest).check()
    assert [finding.kind for finding in findings] == [FindingKind.CLIP_CODEC] * 2
    assert all("digest c0dec as in dataset.json, found 0ther" in finding.message for finding in findings)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"depth_range": DepthRange(max_m=7.0)}, "the depth range must be"),
        ({"encoded_width_px": 320}, "the image size must be"),
    ],
)
def test_a_clip_of_other_settings_than_the_release_is_found(
    stored: Stored, changes: dict[str, object], what: str
) -> None:
    findings = replace(stored, manifest=replace(stored.manifest, **changes)).check()
    assert {finding.kind for finding in findings} == {FindingKind.CLIP_MISMATCH}
    assert what in findings[0].message


def test_latents_of_another_shape_than_the_codec_gives_are_found(stored: Stored, tiny: SimpleNamespace) -> None:
    manifest = replace(stored.manifest, codec=replace(tiny.codec, channels=16))
    message = _only(replace(stored, manifest=manifest).check(), FindingKind.CLIP_MISMATCH)
    assert "the shape of a latent must be (16, 6, 10) as in dataset.json, found (48, 6, 10)" in message


@pytest.mark.parametrize(("last_m", "sound"), [(0.0, True), (0.001, True), (0.0011, False), (-0.001, False)])
def test_the_expert_must_arrive_within_a_millimetre(
    make_clip: Callable[..., Clip], tiny: SimpleNamespace, last_m: float, sound: bool
) -> None:
    clip = make_clip()
    distance = clip.expert_distance.copy()
    distance[-1] = np.float32(last_m)
    findings = _stored(replace(clip, expert_distance=distance), tiny.manifest).check()
    assert [finding.kind for finding in findings] == ([] if sound else [FindingKind.CLIP_GOAL])


def test_a_map_whose_origin_is_elsewhere_has_no_goal_where_it_must_be(
    make_clip: Callable[..., Clip], tiny: SimpleNamespace
) -> None:
    # six cells of 0.05 m are more than the goal radius of 0.2 m and half a cell's diagonal
    findings = _stored(make_clip(map_origin_cell=(6, 0)), tiny.manifest).check()
    assert "geodesic_mm must be 0 in the goal region" in _only(findings, FindingKind.CLIP_GOAL)


def test_values_that_no_map_holds_are_found(make_clip: Callable[..., Clip], tiny: SimpleNamespace) -> None:
    clip = make_clip()
    occupancy = clip.occupancy.copy()
    occupancy[0, 0] = 7
    findings = _stored(replace(clip, occupancy=occupancy), tiny.manifest).check()
    assert "occupancy must be 0, 1 or 255, found [0, 1, 7, 255]" in _only(findings, FindingKind.CLIP_INVALID)


def test_a_way_through_an_occupied_cell_is_found(make_clip: Callable[..., Clip], tiny: SimpleNamespace) -> None:
    clip = make_clip()
    geodesic_mm = np.where(clip.occupancy == 1, 10, clip.geodesic_mm).astype(np.uint16)
    findings = _stored(replace(clip, geodesic_mm=geodesic_mm), tiny.manifest).check()
    count = int((clip.occupancy == 1).sum())
    message = _only(findings, FindingKind.CLIP_INVALID)
    assert f"must be 65535 in occupied cells, found {count} others" in message


def test_the_bytes_of_the_fixture_are_those_of_the_encoder(make_clip: Callable[..., Clip], stored: Stored) -> None:
    assert stored.data == encode_clip(make_clip())[0]

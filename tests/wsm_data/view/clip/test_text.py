import numpy as np
import pytest

from wsm_data.schema.clip import MEMBERS
from wsm_data.view.clip.text import describe_clip


def row(text, name):
    return next(line for line in text.splitlines() if line.split("  ")[0] == name).split()


def test_every_member_stands_with_dtype_shape_and_statistics(clip):
    text = describe_clip(clip)
    for name in MEMBERS:
        assert row(text, name)[1] == str(getattr(clip, name).dtype)
    # fields of the row: name, dtype, axes, "4 x 48 x 2 x 4", size with unit, then min, mean, max, std
    assert row(text, "rgb_latent")[3:10] == ["4", "x", "48", "x", "2", "x", "4"]
    distance = clip.expert_distance.astype(np.float64)
    numbers = [float(word) for word in row(text, "expert_distance")[6:10]]
    assert numbers == pytest.approx([distance.min(), distance.mean(), distance.max(), distance.std()], rel=1e-4)


def test_unreachable_cells_are_no_distances(clip):
    assert float(row(describe_clip(clip), "geodesic_mm")[10]) < 65535


def test_a_map_from_which_nothing_can_be_reached_has_no_statistics(made):
    clip = made.clip(geodesic_mm=np.full((40, 60), 65535, np.uint16))
    assert row(describe_clip(clip), "geodesic_mm")[8:12] == ["-", "-", "-", "-"]


def test_facts_and_provenance_are_there_with_units(clip):
    text = describe_clip(clip)
    assert row(text, "path length")[-1] == "m"
    assert row(text, "codec_digest")[-1] == clip.meta.codec_digest
    assert row(text, "id.scene")[-1] == "home_0001"
    assert row(text, "notes")[-1] == "none"
    assert "T_world_camera0 [3]" in text


def test_a_scene_name_that_is_no_text_can_be_printed(made):
    clip = made.clip("synth_d435i/home\udcff/000001")
    assert "home\\udcff" in describe_clip(clip)
    describe_clip(clip).encode()

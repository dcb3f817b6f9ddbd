import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.maps.arrays_file import save_arrays
from wsm_data.maps.scene_map import build_scene_map, floor_levels, load_scene_map, save_scene_map, scene_map_digest
from wsm_data.schema.dataset import Robot
from wsm_data.schema.surface import SurfaceVoxels


def voxels_of(cells, origin="cloud"):
    cells = np.array(sorted(cells), np.int16).reshape(-1, 3)
    return SurfaceVoxels(cells=cells, obstacle=cells[:, 2] % 2 == 1, origin=origin)


def random_voxels(seed=0):
    cells = np.unique(np.random.default_rng(seed).integers([-9, 4, -60], [7, 12, 700], (900, 3)), axis=0)
    return voxels_of(cells.tolist())


def test_floors_a_storey_apart_are_levels_of_their_own():
    assert floor_levels([0.001, 3.02, -0.003, 2.98]) == (0.0, 3.0)


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=8), st.randoms())
def test_levels_depend_on_neither_order_nor_the_other_floors(floors, random):
    shuffled = list(floors)
    random.shuffle(shuffled)
    assert floor_levels(shuffled) == floor_levels(floors)
    assert set(floor_levels(floors[:1])) <= set(floor_levels(floors))
    assert floor_levels(floor_levels(floors)) == floor_levels(floors)


@given(st.integers(-20, 20), st.floats(-0.04, 0.04))
def test_centimetres_do_not_move_a_floor_that_is_near_its_level(step, jitter_m):
    assert floor_levels([step * 0.5 + jitter_m]) == (step * 0.5,)


def test_a_level_keeps_the_boxes_a_robot_on_it_could_meet_cell_by_cell():
    voxels = random_voxels()
    scene_map = build_scene_map(voxels, (0.0, 3.0), Robot(), 2.0)
    assert [level.floor_z_m for level in scene_map.levels] == [0.0, 3.0]
    for level in scene_map.levels:
        floor = round(level.floor_z_m * 100)
        # floors up to 0.25 m off, 0.15 m of ground below the lowest, 2.0 m of robot above the highest
        needed = {tuple(c) for c in voxels.cells.tolist() if floor - 25 - 15 <= c[2] < floor + 25 + 200}
        kept = {}
        for cell in range(level.shape[0] * level.shape[1]):
            column = cell % level.shape[1] + level.origin_cell[0]
            row = cell // level.shape[1] + level.origin_cell[1]
            boxes = slice(level.first[cell], level.first[cell + 1])
            assert (np.diff(level.layers[boxes].astype(int)) > 0).all()
            kept.update(
                {
                    (column, row, int(z)): bool(m)
                    for z, m in zip(level.layers[boxes], level.obstacle[boxes], strict=True)
                }
            )
        assert needed <= set(kept) <= {tuple(c) for c in voxels.cells.tolist()}
        assert all(marked == (z % 2 == 1) for (_, _, z), marked in kept.items())


def test_a_level_without_boxes_is_an_empty_map():
    scene_map = build_scene_map(random_voxels(), (30.0,), Robot(), 2.0)
    assert scene_map.levels[0].shape == (0, 0)


def test_a_map_wider_than_any_home_is_refused_with_its_size():
    with pytest.raises(DataError) as refused:
        build_scene_map(voxels_of([(-30000, -30000, 0), (30000, 30000, 0)]), (0.0,), Robot(), 2.0)
    assert refused.value.reason is Reason.MAP_TOO_LARGE
    assert (refused.value.details["columns"], refused.value.details["rows"]) == (60001, 60001)
    assert "3000 m x 3000 m" in refused.value.message


def test_a_map_survives_the_disk_and_equal_maps_have_equal_files(tmp_path):
    scene_map = build_scene_map(random_voxels(), (0.0, 3.0, 30.0), Robot(), 2.0)
    save_scene_map(tmp_path / "a.npz", scene_map)
    loaded = load_scene_map(tmp_path / "a.npz")
    save_scene_map(tmp_path / "b.npz", loaded)
    assert scene_map_digest(loaded) == scene_map_digest(scene_map)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert [level.shape for level in loaded.levels] == [level.shape for level in scene_map.levels]
    assert loaded.origin == "cloud"


def test_another_storey_leaves_the_digest_of_a_floor_as_it_is():
    one = build_scene_map(random_voxels(), (0.0,), Robot(), 2.0)
    both = build_scene_map(random_voxels(), (0.0, 3.0), Robot(), 2.0)
    assert scene_map_digest(one) != scene_map_digest(both)
    assert scene_map_digest(one, 0.02) == scene_map_digest(both, -0.01)
    assert scene_map_digest(both, 3.1) != scene_map_digest(both, 0.0)


def test_a_floor_the_map_was_not_built_for_is_a_bug_of_the_caller():
    with pytest.raises(ValueError, match=r"no level at 1\.5 m"):
        build_scene_map(random_voxels(), (0.0,), Robot(), 2.0).level_at(1.4)


@pytest.mark.parametrize("damage", ["layers", "first_box", "shape"])
def test_arrays_that_disagree_with_one_another_are_an_integrity_error(tmp_path, damage):
    save_scene_map(tmp_path / "a.npz", build_scene_map(random_voxels(), (0.0, 3.0), Robot(), 2.0))
    with np.load(tmp_path / "a.npz") as stored:
        arrays = dict(stored)
    arrays[damage] = arrays[damage][:-1] if damage != "shape" else arrays[damage] + 1
    save_arrays(tmp_path / "a.npz", arrays)
    with pytest.raises(IntegrityError, match="does not hold a scene map"):
        load_scene_map(tmp_path / "a.npz")

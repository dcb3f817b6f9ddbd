import pytest

from wsm_data.errors import IntegrityError
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader
from wsm_data.readers.tum.reader import TUM


@pytest.mark.parametrize("name", ["tum_rgbd", "bonn_rgbd", "icl_nuim", "replica_sequences", "scannet_sequences"])
def test_the_variants_are_manifests_of_one_reader(name):
    dataset = load_dataset(name)
    assert source_reader(dataset).name == TUM.name
    assert dataset.motion.carried_by == "hand"


def test_frames_are_the_files_of_the_sequence_and_a_changed_one_is_found(hand_held, tmp_path):
    source, _ = hand_held
    dataset = load_dataset("tum_rgbd")
    (container,) = TUM.find_containers(source, dataset)
    records = TUM.scan(source, container, dataset, 3).records
    ((record, frames),) = TUM.iter_frames(source, container, dataset, records)
    folder = source / container.id
    assert frames.rgb[2] == (folder / record.rgb_members[2]).read_bytes()
    assert frames.depth[2] == (folder / record.depth_members[2]).read_bytes()
    first = folder / record.rgb_members[0]
    before = first.read_bytes()
    try:
        first.write_bytes(before + b"x")
        with pytest.raises(IntegrityError, match="other bytes"):
            list(TUM.iter_frames(source, container, dataset, records))
        first.unlink()
        with pytest.raises(IntegrityError, match="run `wsm index` again"):
            list(TUM.iter_frames(source, container, dataset, records))
    finally:
        first.write_bytes(before)

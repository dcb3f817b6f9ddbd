"""The same content gives the same release, however it is stored and whoever does the work."""

from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def reference(make_source, run_pipeline, file_digests, tmp_path_factory):
    out = tmp_path_factory.mktemp("reference")
    run_pipeline(make_source(layout="scene_archive", matrices="nested"), out)
    return file_digests(out / "pack" / "release")


@pytest.mark.parametrize(
    ("layout", "matrices", "workers"),
    [
        ("scene_archive", "flat", 1),
        ("scene_folder", "nested", 1),
        ("scene_folder", "flat", 2),
        ("trajectory_folder", "nested", 2),
        ("trajectory_folder", "flat", 1),
    ],
)
def test_layouts_matrices_and_workers_do_not_change_a_byte_of_the_release(
    layout, matrices, workers, reference, make_source, run_pipeline, file_digests, tmp_path
):
    run_pipeline(make_source(layout=layout, matrices=matrices), tmp_path, workers=workers)
    assert file_digests(tmp_path / "pack" / "release") == reference


def test_a_release_depends_neither_on_when_nor_on_where_it_was_made(
    reference, make_source, run_pipeline, file_digests, tmp_path
):
    run_pipeline(make_source(layout="scene_archive", matrices="nested"), tmp_path / "elsewhere")
    assert file_digests(tmp_path / "elsewhere" / "pack" / "release") == reference
    assert str(tmp_path) not in (tmp_path / "elsewhere" / "pack" / "release" / "dataset.json").read_text()


def test_layouts_may_be_mixed_in_one_tree(reference, make_source, run_pipeline, file_digests, tmp_path):
    import shutil

    source = tmp_path / "source"
    shutil.copytree(make_source(layout="scene_archive") / "synth_d435i", source / "synth_d435i")
    shutil.copytree(make_source(layout="trajectory_folder") / "synth_zed", source / "synth_zed")
    run_pipeline(source, tmp_path / "run")
    assert file_digests(Path(tmp_path / "run" / "pack" / "release")) == reference

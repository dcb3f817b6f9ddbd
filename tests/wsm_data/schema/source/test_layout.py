import pytest

from wsm_data.files.typed_toml import convert
from wsm_data.schema.source.layout import Layout
from wsm_data.synth.config import SynthConfig


def test_a_recipe_names_the_layouts_as_stage_records_do():
    assert [convert(Layout, name, "layout") for name in ("scene_archive", "scene_folder", "trajectory_folder")] == [
        *Layout
    ]


@pytest.mark.parametrize("layout", Layout)
def test_every_layout_that_is_read_can_be_generated(layout):
    assert SynthConfig(layout=layout).layout is layout

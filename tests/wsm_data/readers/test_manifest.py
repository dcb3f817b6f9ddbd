import pytest

from wsm_data.errors import ConfigError
from wsm_data.readers.manifest import MANIFEST_FOLDER, load_dataset
from wsm_data.schema.dataset import CameraModel

SMALLEST = 'name = "mine"\nlicence = "CC0"\n[depth]\nmetres_per_unit = 0.001\ninvalid_codes = [0]\n'


def load(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return load_dataset(path)


def test_the_published_facts_of_interndata_n1_are_in_its_manifest():
    """The numbers are those of the data set's description."""
    dataset = load_dataset("interndata_n1")
    assert dataset.camera_axes == "opengl"
    assert dataset.depth.metres_per_unit == 1e-4
    assert dataset.depth.invalid_codes == (0, 65535)
    assert sum(dataset.expected_episodes.values()) == 85_124
    assert len(dataset.expected_episodes) == 12
    assert dataset.cameras["d435i"] == CameraModel(width=480, height=270, fx=355.81, fy=351.69, cx=240.0, cy=135.0)
    assert dataset.cameras["zed"] == CameraModel()  # nothing is published
    assert "NC" in dataset.licence
    assert "publisher" in dataset.licence


def test_every_shipped_manifest_loads_under_its_own_name():
    names = [path.stem for path in MANIFEST_FOLDER.glob("*.toml")]
    assert "synthetic" in names
    for name in names:
        assert load_dataset(name).name == name


def test_synthetic_data_keeps_the_conventions_of_interndata_n1():
    ours, theirs = load_dataset("synthetic"), load_dataset("interndata_n1")
    for field in ("camera_axes", "depth", "robot", "cloud"):
        assert getattr(ours, field) == getattr(theirs, field)
    assert ours.cameras["d435i"] == theirs.cameras["d435i"]


def test_a_manifest_of_ones_own_is_loaded_by_path(tmp_path):
    dataset = load(tmp_path, SMALLEST)
    assert (dataset.name, dataset.depth.metres_per_unit, dataset.robot.radius_m) == ("mine", 0.001, 0.25)
    assert load_dataset(str(tmp_path / "mine.toml")) == dataset


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(ConfigError, match="nearest: 'interndata_n1'"):
        load_dataset("interndata")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camera_axis = 'opengl'\n" + SMALLEST, "unknown key 'camera_axis' .nearest: 'camera_axes'"),
        (SMALLEST + "[robot]\nradius = 1.0\n", r"\[robot\] has an unknown key 'radius' .nearest: 'radius_m'"),
        (SMALLEST + "[cameras.zed]\nf = 1.0\n", r"\[cameras.zed\] has an unknown key"),
        ("min_frames = 5.5\n" + SMALLEST, "min_frames must be"),
        ("min_frames = true\n" + SMALLEST, "min_frames must be"),
        ("max_pitch_deg = 'steep'\n" + SMALLEST, "max_pitch_deg must be"),
        (SMALLEST + "[cloud]\nobstacle_rgb = [0.0, 0.5]\n", "obstacle_rgb must be"),
        ("robot = 3\n" + SMALLEST, "robot must be"),
        ("cameras = 3\n" + SMALLEST, "cameras must be"),
        ("camera_axes = 'nasa'\n" + SMALLEST, "camera_axes must be"),
        (SMALLEST.replace("0.001", "1000.0"), "metres_per_unit must lie"),
        ('licence = "CC0"\n', "lacks a required key; absent are name"),
        ("name = \n", "not valid TOML"),
    ],
)
def test_a_wrong_word_in_a_manifest_is_an_error_that_says_where(tmp_path, text, message):
    with pytest.raises(ConfigError, match=message):
        load(tmp_path, text)


def test_a_manifest_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_dataset(tmp_path / "absent.toml")

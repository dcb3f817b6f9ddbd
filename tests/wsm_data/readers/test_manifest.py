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


def test_limits_of_the_checks_are_differences_from_the_defaults(tmp_path):
    checks = load(tmp_path, SMALLEST + "[checks]\nmax_roll_deg = 20.0\n").checks
    assert (checks.max_roll_deg, checks.max_pitch_up_deg) == (20.0, 2.0)


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(ConfigError, match=r"there is no data set 'interndata'; did you mean interndata_n1\?"):
        load_dataset("interndata")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camera_axis = 'opengl'\n" + SMALLEST, r"unknown key camera_axis; did you mean camera_axes\?"),
        (SMALLEST + "[robot]\nradius = 1.0\n", r"unknown key robot.radius; did you mean robot.radius_m\?"),
        (SMALLEST + "[cameras.zed]\nwide = 1\n", r"unknown key cameras.zed.wide; did you mean cameras.zed.width\?"),
        ("min_frames = 5.5\n" + SMALLEST, "min_frames takes a whole number, found 5.5"),
        ("min_frames = true\n" + SMALLEST, "min_frames takes a whole number, found True"),
        ("max_pitch_deg = 'steep'\n" + SMALLEST, "max_pitch_deg takes a number, found 'steep'"),
        ("max_pitch_deg = nan\n" + SMALLEST, "max_pitch_deg must be finite, found nan"),
        (SMALLEST + "[checks]\nmax_roll = 9.0\n", r"unknown key checks.max_roll; did you mean checks.max_roll_deg\?"),
        (SMALLEST + "[checks]\nmax_roll_deg = -1.0\n", "checks: max_roll_deg must be finite and not negative"),
        (SMALLEST + "[cloud]\nobstacle_rgb = [0.0, 0.5]\n", "cloud.obstacle_rgb takes 3 values, found 2"),
        (SMALLEST.replace("[0]", "0"), "depth.invalid_codes takes a list in brackets, found 0"),
        ("robot = 3\n" + SMALLEST, "robot is a section, found the value 3"),
        ("cameras = 3\n" + SMALLEST, "cameras is a section, found the value 3"),
        (
            SMALLEST + "[expected_episodes]\nours = 'many'\n",
            "expected_episodes.ours takes a whole number, found 'many'",
        ),
        ("camera_axes = 'nasa'\n" + SMALLEST, "camera_axes must be 'opengl' or 'opencv', found 'nasa'"),
        (SMALLEST.replace("0.001", "1000.0"), "depth: metres_per_unit must lie"),
        ('licence = "CC0"\n', "name has no default: give it as name=..."),
        ("name = \n", "is not valid TOML"),
    ],
)
def test_a_wrong_word_in_a_manifest_is_an_error_that_says_where(tmp_path, text, message):
    with pytest.raises(ConfigError, match=rf"^{tmp_path}/mine.toml:? {message}"):
        load(tmp_path, text)


def test_a_manifest_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match=r"absent.toml does not exist"):
        load_dataset(tmp_path / "absent.toml")

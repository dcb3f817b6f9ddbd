"""A plan of a source of analytic rooms, and the run that it speaks of."""

import json

import pytest
from box_room import MANIFEST_TOML, along_x, scene_files, write_folder
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.planning.plan import make_plan
from pipelines.operations.run_recipe import run_recipe
from pipelines.running.options import RunOptions, StageRequest
from wsm_data.errors import ConfigError
from wsm_data.files.folder_bytes import folder_bytes

SCENES = 5


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """Five scenes; what is asked of a run over them."""
    root = tmp_path_factory.mktemp("planned")
    (root / "rooms.toml").write_text(MANIFEST_TOML)
    for number in range(SCENES):
        write_folder(root / f"source/box_d435i/room{number}", scene_files({0: along_x(frames=6 + number)}, True))
    settings = {"index.dataset": root / "rooms.toml", "encode.clip.width": 64, "encode.clip.height": 32}
    settings |= {"report.survey.max_clips": 1, "report.survey.pictures": 1, "report.survey.scenes": 1}
    words = tuple(f"{name}={value}" for name, value in {**settings, "report.survey.thumbnails": 1}.items())
    options = RunOptions(quiet=True, max_refused=1000)
    return root, StageRequest(out=root / "run", assignments=words, options=options)


def test_a_plan_of_all_that_there_is_names_the_bytes_that_the_run_then_writes(planned, capsys):
    root, request = planned
    plan = make_plan(str(root / "source"), "interndata", request, 1.0, None)
    assert plan.sampled_containers == plan.containers == SCENES
    assert plan.bytes_in == plan.sampled_bytes == folder_bytes(root / "source")
    run = request.out
    source = (f"source={root / 'source'}",)
    run_recipe(
        "interndata", StageRequest(out=run, assignments=(*request.assignments, *source), options=request.options)
    )
    assert plan.bytes_out.low == plan.bytes_out.high == folder_bytes(run / "pack/release")
    assert plan.peak_disk_bytes.value == pytest.approx(
        folder_bytes(run), rel=0.01
    )  # paths and times are in the records
    capsys.readouterr()


def test_a_part_of_it_is_run_and_nothing_is_left_but_the_plan_that_the_report_then_shows(planned, tmp_path):
    root, request = planned
    words = [word for one in request.assignments for word in ("--set", one)]
    source = str(root / "source")
    asked = ["plan", source, *words, "-w", "1", "--json", "--work", str(tmp_path), "--out", str(tmp_path / "run")]
    said = CliRunner().invoke(app, asked)
    assert said.exit_code == 0, said.output
    plan = json.loads(said.stdout)
    assert (plan["containers"], plan["sampled_containers"], plan["workers"]) == (SCENES, 3, 1)
    for name in ("bytes_out", "hours", "peak_disk_bytes"):
        assert 0 < plan[name]["low"] <= plan[name]["value"] <= plan[name]["high"]
    assert [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")] == ["run", "run/plan.json"]
    ran = ["run", "interndata", "--set", f"source={source}", *words, "-w", "1", "-q", "--out", str(tmp_path / "run")]
    assert CliRunner().invoke(app, ran).exit_code == 0
    page = (tmp_path / "run/report/report.html").read_text()
    for name in ("index, s", "encode, s", "release, MiB", "run folder, MiB"):
        assert f'<th scope="row">{name}</th>' in page


def test_a_recipe_that_reads_no_source_has_no_plan(planned):
    root, request = planned
    with pytest.raises(ConfigError, match="a recipe that turns a source into a release, which demo does not"):
        make_plan(str(root / "source"), "demo", request, 0.5, None)


def test_more_than_all_cannot_be_run(tmp_path):
    said = CliRunner().invoke(app, ["plan", str(tmp_path), "--share", "1.5"])
    assert said.exit_code == 2
    assert "--share must lie in (0, 1], found 1.5" in said.output

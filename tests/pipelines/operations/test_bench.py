"""`wsm bench loader`: what it prints, and what it refuses."""

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.errors import ConfigError

SMALL = ["--set", "order.global_batch=2", "--batches", "2"]


@pytest.fixture
def bench(tiny):
    def run(*words, release=tiny.folder):
        return CliRunner().invoke(app, ["bench", "loader", str(release), *words], catch_exceptions=False)

    return run


def test_it_prints_rates_the_limit_where_the_time_goes_and_a_sentence(bench):
    done = bench(*SMALL)
    assert done.exit_code == 0
    for word in ("samples", "MB/s as stored", "limit", "first batch", "reading from the store", "comparing checksums"):
        assert word in done.stdout
    assert done.stdout.rstrip().endswith(".")
    assert "4 in" in done.stdout  # two batches of two clips


def test_settings_are_those_of_the_loader(bench):
    done = bench(*SMALL, "--set", "read.threads=0", "--set", "source.split=test", "--set", "order.global_batch=1")
    assert done.exit_code == 0
    assert "time of 1 caller" in done.stdout


def test_rank_0_of_some_ranks_is_measured(bench):
    done = bench(*SMALL, "--ranks", "2")
    assert "measured on rank 0 of 2" in done.stdout
    assert "2 in" in done.stdout  # two batches of its one row


def test_a_sweep_compares_numbers_of_threads(bench):
    done = bench(*SMALL, "--sweep")
    rows = [line.split() for line in done.stdout.splitlines()]
    first = next(i for i, words in enumerate(rows) if words[:2] == ["threads", "clips/s"])
    assert [words[0] for words in rows[first + 1 : first + 4]] == ["1", "2", "4"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "read.thread=2"], "unknown key read.thread; did you mean read.threads?"),
        (["--set", "order.global_batch=0"], "global_batch must be at least 1"),
        (["--set", "source.weight=-1"], "weight must be finite and above 0"),
    ],
)
def test_wrong_settings_are_refused_before_anything_is_read(bench, words, said, capsys):
    with pytest.raises(SystemExit) as ended:
        app(["bench", "loader", "absent", *words], standalone_mode=False)
    assert ended.value.code == ConfigError.exit_code
    assert said in capsys.readouterr().err

"""What a run logs arrives where it was asked for, and nowhere twice."""

import logging

import pytest
from fake_runs import ANY
from fake_stages import COPY

from pipelines.running import progress
from pipelines.running.logs import log_table, logged
from pipelines.running.options import RunOptions, StageRequest
from pipelines.running.runner import run_stage
from wsm_data.errors import ConfigError


def run(config, out, **options):
    asked = RunOptions(max_refused=100, **options)
    with logged(StageRequest(options=asked, log_file=out.parents[1] / "run.log")):
        run_stage(COPY, config, out, asked)
        log_table("the table")


@pytest.fixture
def terminal(monkeypatch):
    """Standard error is one."""
    monkeypatch.setattr(progress, "in_lines", lambda options: options.verbose)


def warn_and_fail(log):
    with logged(StageRequest(options=ANY, log_file=log)):
        logging.getLogger("any").warning("careful")
        raise ConfigError("no such thing")


def units(text):
    """Beginnings of the lines about units, without times."""
    return [
        line.rsplit("copy ", 1)[1].split(" s")[0].rsplit(" ", 1)[0] for line in text.splitlines() if " copy " in line
    ]


def test_where_there_is_no_terminal_every_unit_is_one_line(config, source, out, capsys):
    (source / "a2.txt").write_text("bad")
    run(config, out)
    said = capsys.readouterr().err
    assert "\r" not in said
    assert units(said) == ["1/3 a1 done", "2/3 a2 refused", "3/3 b1 done"]
    assert "frame.empty: a2 is bad" in said


def test_a_terminal_has_a_bar_and_with_verbose_lines(config, out, capsys, terminal):
    run(config, out)
    said = capsys.readouterr().err
    assert units(said) == []
    assert "3/3" in said  # the bar's own count
    run(config, out.with_name("again"), verbose=True)
    assert units(capsys.readouterr().err) == ["1/3 a1 done", "2/3 a2 done", "3/3 b1 done"]


def test_a_log_file_has_units_tables_warnings_and_errors_however_quiet_the_run_is(config, out, capsys):
    run(config, out, quiet=True)
    assert capsys.readouterr().err == ""
    log = out.parents[1] / "run.log"
    with pytest.raises(ConfigError):
        warn_and_fail(log)
    text = log.read_text()
    assert units(text) == ["1/3 a1 done", "2/3 a2 done", "3/3 b1 done"]
    assert [line.split(" ", 3)[-1] for line in text.splitlines()[3:]] == ["the table", "careful", "no such thing"]
    assert capsys.readouterr().err == "WARNING careful\n"  # an error is told by whoever ends the program


def test_a_log_file_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="--log-file"), logged(StageRequest(log_file=tmp_path / "no" / "log")):
        pass


def test_handlers_are_those_of_before_afterwards(config, out):
    before = list(logging.getLogger().handlers)
    run(config, out, quiet=True)
    assert logging.getLogger().handlers == before

"""A model that was trained for a step, and the release of its clips."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from pipelines.cli import app


@pytest.fixture(scope="session")
def wsm() -> Callable[..., tuple[int, str]]:
    """Runs a command; exit code and output."""

    def run(*words: object) -> tuple[int, str]:
        done = CliRunner().invoke(app, [str(word) for word in words])
        return done.exit_code, done.output

    return run


@pytest.fixture(scope="session")
def trained(wsm, homes_release, tmp_path_factory) -> SimpleNamespace:
    """A run of one step, which measured a held-out clip at its end, and the words that measure likewise."""
    run = tmp_path_factory.mktemp("trained")
    held_out = ("session.chunk_size=2", "flow_steps=2", "max_latents=5")
    settings = ("order.global_batch=2", "order.max_latents=3", "training.max_steps=1", "training.precision=float32")
    settings += ("held_out.clips=2", *(f"held_out.{one}" for one in held_out))
    code, text = wsm("train", homes_release, "--out", run, *_set(settings), "--quiet")
    assert code == 0, text
    return SimpleNamespace(run=run, model=run / "model", release=homes_release, likewise=_set(held_out))


@pytest.fixture
def of_other_latents(trained, tmp_path) -> Path:
    """The trained model, whose card names another digest of the codec."""
    folder = Path(shutil.copytree(trained.model, tmp_path / "other"))
    card = json.loads((folder / "model.json").read_text())
    card["standard"]["codec_digest"] = "0" * 64
    (folder / "model.json").write_text(json.dumps(card))
    return folder


def _set(settings: tuple[str, ...]) -> list[str]:
    return [word for one in settings for word in ("--set", one)]

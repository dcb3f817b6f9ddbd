"""A run of the two fake stages, as `wsm run` makes it."""

import pytest
from fake_wsm import use_fake_stages

from pipelines import recipe, registry
from pipelines.operations.run_recipe import run_recipe
from pipelines.operations.runs import clean, retry
from pipelines.running.options import RunOptions, StageRequest


@pytest.fixture(autouse=True)
def fake_registry(monkeypatch):
    monkeypatch.setattr(registry, "STAGES", registry.STAGES)  # both are put back afterwards
    monkeypatch.setattr(registry, "load_stage_module", registry.load_stage_module)
    use_fake_stages()
    monkeypatch.setattr(recipe, "_NAMES", ("copy", "join"))
    monkeypatch.setattr(clean, "_KNOWN", {"copy", "join"})
    monkeypatch.setattr(retry, "STAGES", registry.STAGES)


@pytest.fixture
def run(tmp_path, source, calls):
    """Runs both stages into `run`; returns what `copy` worked on."""
    path = tmp_path / "both.toml"
    path.write_text(f'stages = ["copy", "join"]\n[copy]\nsource = "{source}"\n')

    def go(**options):
        asked = RunOptions(**{"quiet": True, "max_refused": 100, **options})
        run_recipe(str(path), StageRequest(out=tmp_path / "run", options=asked))
        return calls()

    return go

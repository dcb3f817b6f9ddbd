"""`wsm` with the fake stages in place of the real ones: run as `python -m fake_wsm`."""

import fake_stages

from pipelines import registry


def use_fake_stages() -> None:
    """Put the fake stages where the registry's readers find them; before the first import of `pipelines.recipe`."""
    registry.STAGES = tuple(
        registry.StageEntry(name=stage.name, summary=f"Fake {stage.name}.")
        for stage in (fake_stages.COPY, fake_stages.JOIN)
    )
    modules = {"copy": fake_stages.CopyModule, "join": fake_stages.JoinModule}
    registry.load_stage_module = modules.__getitem__


if __name__ == "__main__":
    use_fake_stages()
    from pipelines.cli import app

    app(prog_name="wsm")

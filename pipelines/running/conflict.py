"""Whether a stage may write into a folder: only with the settings that it was begun with."""

from pathlib import Path

from pipelines.running.folder import read_stage_record
from pipelines.running.settings import settings_of
from pipelines.running.stage import ConfigT, Stage
from wsm_data.files.differences import differences
from wsm_data.files.digest import digest_json


def fingerprint(stage: Stage[ConfigT], config: ConfigT) -> str:
    """Digest of what decides the bytes of a stage beside its inputs: name, version and settings."""
    return digest_json({"name": stage.name, "version": stage.version, "settings": settings_of(config)})


def conflict(stage: Stage[ConfigT], config: ConfigT, out: Path) -> str:
    """Why the stage may not go on in a folder, for a person; empty where it may.

    Raises:
        IntegrityError: the folder's record is unreadable.
    """
    old = read_stage_record(out)
    if old is None or old.fingerprint == fingerprint(stage, config):
        return ""
    if old.name != stage.name:
        return f"{out} holds the output of `wsm {old.name}`, not of `wsm {stage.name}`; use another --out"
    changes = differences(
        {"version of the stage": old.version, **old.settings},
        {"version of the stage": stage.version, **settings_of(config)},
    )
    return (
        f"{out} was written with other settings of `wsm {stage.name}`:\n  "
        + "\n  ".join(changes)
        + "\nUse the old settings, another --out, or --fork to write beside it."
    )

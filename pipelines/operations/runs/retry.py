"""`wsm retry`: units that were refused for a reason, once more, and all that follows from them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pipelines.operations.engine import engine_of
from pipelines.operations.runs.in_order import run_in_order
from pipelines.registry import STAGES, load_stage
from pipelines.running.conflict import conflict
from pipelines.running.options import StageRequest
from pipelines.running.quarantine import QUARANTINE_FILE, read_quarantine
from pipelines.running.stage_status import read_stage_folders
from wsm_data.errors import ConfigError, Reason
from wsm_data.files.typed_toml import build_config, did_you_mean


def retry(run: Path, reasons: Sequence[str], request: StageRequest) -> None:
    """Run the stages of a run with their recorded settings; units of which something was refused so are done again.

    Raises:
        ConfigError: there is no such reason, nothing in the run was refused for it, or the settings of a stage are not
            those of this version.
    """
    unknown = [one for one in reasons if one not in list(Reason)]
    if unknown:
        raise ConfigError(f"{unknown[0]!r} is no reason code; {did_you_mean(unknown[0], list(Reason))}")
    records = {folder.name: (folder, record) for folder, record in read_stage_folders(run).items()}
    names = [entry.name for entry in STAGES if entry.name in records and records[entry.name][0].parent == run]
    if not names:
        raise ConfigError(f"{run} must be the folder of a run, found no folder of a stage in it")
    _require_refused(run, names, reasons)
    configs = {name: build_config(load_stage(name).config_type, records[name][1].config) for name in names}
    changed = [found for name in names if (found := conflict(load_stage(name), configs[name], run / name))]
    if changed:
        raise ConfigError("\n".join(changed))
    options = replace(request.options, retry_reasons=tuple(reasons))
    with engine_of(request) as run_engine:
        run_in_order(configs, run, lambda _: options, run_engine)


def _require_refused(run: Path, names: Sequence[str], reasons: Sequence[str]) -> None:
    found = {refusal.reason.value for name in names for refusal in read_quarantine(run / name / QUARANTINE_FILE)}
    if not found & set(reasons):
        known = f"what was refused was so for {', '.join(sorted(found))}" if found else "nothing was refused"
        raise ConfigError(f"nothing in {run} was refused for {', '.join(reasons)}; {known}")

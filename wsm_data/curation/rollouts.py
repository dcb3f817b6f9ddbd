"""The table of rollouts that evaluation writes, and the scores of clips that follow from it.

One row per query: a policy dreams several futures from one latent of a clip. Evaluation of a policy writes the table;
what it must hold is fixed here (docs/curation.md has the table of columns).
"""

from functools import partial
from pathlib import Path

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.errors import ConfigError
from wsm_data.files.tables import opened_table, read_statement, require_columns, with_statement
from wsm_data.schema.arrays import Float64Array
from wsm_data.shards.index.table import IndexTable

ROLLOUTS_VERSION = 2
_STATEMENT = "wsm.rollouts"
_QUERY = ("key", "replan_latent", "policy")
_NUMBERS = ("unsafe_share", "mean_cost_m2", "ate_rmse_sim3_m", "fm_loss")
_SCHEMA = pa.schema(
    [
        ("key", pa.string()),
        ("replan_latent", pa.int32()),
        ("policy", pa.string()),
        ("dreams", pa.int32()),
        *((name, pa.float64()) for name in _NUMBERS),
    ]
)

_NO_ROLLOUTS = "the clip was not rolled out"
ROLLOUT_SCORES: tuple[ScorerInfo, ...] = (
    ScorerInfo(
        name="rollout_unsafe_share",
        unit="share",
        direction=Direction.HIGHER,
        summary="share of unsafe dreams, mean over queries",
        absent=_NO_ROLLOUTS,
    ),
    ScorerInfo(
        name="rollout_all_unsafe",
        unit="0 or 1",
        direction=Direction.NEUTRAL,
        summary="1 where every dream of every query of every policy is unsafe",
        absent=_NO_ROLLOUTS,
    ),
    ScorerInfo(
        name="rollout_mean_cost_m2",
        unit="m^2",
        direction=Direction.HIGHER,
        summary="cost C of the paper's reward, mean over the safe dreams of a query, then over queries",
        absent=f"{_NO_ROLLOUTS}, or no dream was safe",
    ),
    ScorerInfo(
        name="rollout_ate_rmse_sim3_m",
        unit="m",
        direction=Direction.HIGHER,
        summary="absolute trajectory error (RMSE) of the SLAM expert after Sim(3) alignment, mean over queries",
        absent=_NO_ROLLOUTS,
    ),
    ScorerInfo(
        name="rollout_fm_loss",
        unit="1",
        direction=Direction.HIGHER,
        summary="flow-matching loss, mean over queries",
        absent=_NO_ROLLOUTS,
    ),
)
"""The scores that follow from rollouts, in the order of their columns."""


def rollout_schema(release_digest: str) -> pa.Schema:
    """Columns and metadata of a table of rollouts of one release."""
    return with_statement(_SCHEMA, _STATEMENT, {"version": ROLLOUTS_VERSION, "release_digest": release_digest})


def read_rollouts(location: str | Path, release_digest: str, index: IndexTable) -> pa.Table:
    """Read and check the rollouts of a release.

    Args:
        location: path or URL of the file.
        release_digest: digest of the release they must have been made on.
        index: its index.

    Raises:
        ConfigError: there is no such file, it is of another release, a row speaks of a clip or latent that the release
            does not have, a query stands there twice, a share lies outside [0, 1], or a number is NaN, infinite, below
            zero or missing; names the row's clip, latent and policy.
        IntegrityError: the file is damaged, or no table of rollouts of this version.
    """
    where = str(location)
    table = _load(where, release_digest)
    for name in (one for one in table.column_names if one != "mean_cost_m2"):
        _refuse_where(pc.is_null(table[name]), table, where, f"{name} must be there")
    known = pc.index_in(table["key"], value_set=index.columns(["key"])["key"])
    _refuse_where(pc.is_null(known), table, where, "a row must be of a clip of the release")
    latents = pa.array(index.numbers("latents")[known.to_numpy()])
    inside = pc.and_(pc.greater_equal(table["replan_latent"], 0), pc.less(table["replan_latent"], latents))
    _refuse_where(pc.invert(inside), table, where, "replan_latent must be one of the clip's latents")
    _refuse_where(pc.less(table["dreams"], 1), table, where, "dreams must be at least 1")
    _refuse_where(_is_repeated(table), table, where, "a query (key, replan_latent, policy) must stand there once")
    for name in _NUMBERS:
        _check_numbers(name, table, where)
    return table


def rollout_scores(rollouts: pa.Table, keys: pa.ChunkedArray) -> dict[str, Float64Array]:
    """Scores of clips from rollouts: means over the queries of all policies, each of which counts the same.

    Args:
        rollouts: what `read_rollouts` gives.
        keys: keys of all clips, text [N].

    Returns:
        By the names of `ROLLOUT_SCORES`, float64 [N]; NaN where a clip has none.
    """
    wanted = [(name, "mean") for name in _NUMBERS] + [("unsafe_share", "min")]
    by_clip = rollouts.group_by("key", use_threads=False).aggregate(wanted)
    rows = pc.index_in(keys, value_set=by_clip["key"])
    names = [f"{name}_{how}" for name, how in wanted]
    aggregated = {name: by_clip[name].take(rows).to_numpy().astype(np.float64) for name in names}
    never_safe = aggregated["unsafe_share_min"]
    values = (
        aggregated["unsafe_share_mean"],
        np.where(np.isnan(never_safe), np.nan, never_safe == 1),
        aggregated["mean_cost_m2_mean"],
        aggregated["ate_rmse_sim3_m_mean"],
        aggregated["fm_loss_mean"],
    )
    return dict(zip((one.name for one in ROLLOUT_SCORES), values, strict=True))


def _load(where: str, release_digest: str) -> pa.Table:
    try:
        must_be = f"{where} must be a table of rollouts"
        with opened_table(partial(fsspec.open, where, "rb"), must_be, "write it again") as file:
            found = read_statement(file.schema_arrow, _STATEMENT, ROLLOUTS_VERSION)["release_digest"]
            require_columns(file.schema_arrow, _SCHEMA)
            table = file.read()
    except FileNotFoundError as error:
        raise ConfigError(f"there are no rollouts at {where}; evaluate a policy on this release first") from error
    if found != release_digest:
        raise ConfigError(
            f"{where} must be of this release, with digest {release_digest}, found {found}; evaluate on this release"
        )
    return table


def _check_numbers(name: str, table: pa.Table, where: str) -> None:
    """A number is finite and not negative; a cost is missing just where no dream was safe."""
    values = table[name]
    if name == "mean_cost_m2":
        missing, nothing_safe = pc.is_null(values), pc.equal(table["unsafe_share"], 1.0)
        _refuse_where(pc.xor(missing, nothing_safe), table, where, f"{name} must be null just where no dream is safe")
    sound = pc.and_(pc.is_finite(values), pc.greater_equal(values, 0.0))
    if name == "unsafe_share":
        sound = pc.and_(sound, pc.less_equal(values, 1.0))
    what = f"{name} must lie in [0, 1]" if name == "unsafe_share" else f"{name} must be a number of at least 0"
    _refuse_where(pc.invert(pc.fill_null(sound, True)), table, where, what, name)


def _is_repeated(table: pa.Table) -> pa.ChunkedArray:
    """Rows whose query stands in the table another time, before them."""
    order = table.select(_QUERY).append_column("row", pa.array(np.arange(len(table))))
    first = order.group_by(list(_QUERY), use_threads=False).aggregate([("row", "min")])["row_min"]
    return pc.invert(pc.is_in(order["row"], value_set=first))


def _refuse_where(bad: pa.ChunkedArray, table: pa.Table, where: str, must: str, column: str = "") -> None:
    """Raise a `ConfigError` that names the first bad row, where there is one."""
    if not pc.any(bad).as_py():
        return
    row = table.slice(pc.index(bad, True).as_py(), 1).to_pylist()[0]
    found = f", found {row[column]}" if column else ""
    raise ConfigError(
        f"{where}: {must}{found}, in the row of clip {row['key']}, replan_latent {row['replan_latent']}, policy "
        f"{row['policy']!r} with {row['dreams']} dreams; {pc.sum(bad).as_py()} rows are like this"
    )

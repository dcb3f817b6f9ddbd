"""What scores.parquet says of itself: its version, and which release its scores are of."""

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from wsm_data.files.sealed import sealed, unsealed
from wsm_data.files.tables import read_statement, with_statement

SCORES_VERSION = 3
_STATEMENT = "wsm.scores"


def with_scores_statement(schema: pa.Schema, release_digest: str, scorers: object) -> pa.Schema:
    """The columns with the statement in their metadata, under a checksum: parquet has those for its pages alone.

    Args:
        schema: the columns.
        release_digest: of the release that was scored.
        scorers: what the scores say of themselves; JSON values.
    """
    stated = {"version": SCORES_VERSION, "release_digest": release_digest, "scorers": scorers}
    return with_statement(schema, _STATEMENT, sealed(stated))


def read_scores_statement(schema: pa.Schema) -> Mapping[str, Any]:
    """Inverse of `with_scores_statement`: `release_digest` and `scorers`, by these names.

    Raises:
        ValueError: there is none, it is of another version, or was changed.
    """
    return unsealed(read_statement(schema, _STATEMENT, SCORES_VERSION))

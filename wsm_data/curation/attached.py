"""Scores and selections that stand in a release: `verify` holds them to their checksums and to the release."""

import logging
from collections.abc import Iterator
from functools import partial

import numpy as np

from wsm_data.access.release import Release
from wsm_data.curation.scores_table import read_paths, read_scores, stated_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.stores import Store
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.selection import parse_selection, selection_names, selection_path

_LOG = logging.getLogger(__name__)


def attached_names(store: Store) -> list[str]:
    """Names of the scores and selections in a release, relative to its folder."""
    scores = [SCORES_NAME] if store.exists(SCORES_NAME) else []
    return [*scores, *map(selection_path, selection_names(store))]


def check_attached(release: Release, name: str) -> Iterator[Finding]:
    """Find what is damaged of scores or of a selection.

    What was made from another release is warned of and is no damage: a release that is packed again keeps the files
    beside it, and who reads them is told.

    Args:
        release: the release.
        name: one of `attached_names`.
    """
    where = f"{release.store.root}/{name}"
    check = _check_scores if name == SCORES_NAME else partial(_check_selection, name=name)
    try:
        made_from = check(release, where)
    except (ConfigError, IntegrityError) as error:
        yield Finding(kind=FindingKind.ATTACHED_CHANGED, message=str(error))
        return
    if made_from != release.digest:
        _LOG.warning("%s was made from the release with digest %s, not from this one; make it again", where, made_from)


def _check_scores(release: Release, where: str) -> str:
    made_from = stated_release(where)
    if made_from == release.digest:
        keys = release.index.columns(["key"])["key"]
        read_scores(where, release_digest=release.digest, release_keys=keys)
        read_paths(where, np.arange(len(keys)))
    return made_from


def _check_selection(release: Release, where: str, name: str) -> str:
    selection = parse_selection(release.store.read(name), where)
    if selection.release_digest == release.digest:
        selection.rows_of(release.index)
    return selection.release_digest

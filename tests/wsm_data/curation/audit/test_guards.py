import numpy as np
import pytest

from wsm_data.access.release import open_release
from wsm_data.curation.audit.finding import Check, Severity
from wsm_data.curation.audit.guards import AuditConfig, audit_release, count_findings
from wsm_data.curation.split import SplitBy


@pytest.fixture
def audit(tiny, tmp_path):
    """Audits a release of the tiny one's clips and others, of which the last two scenes are held out."""

    def go(*extra, config=None):
        tiny.pack(tmp_path / "audited", [*tiny.clips, *extra], shard_bytes=1 << 30)
        return audit_release(open_release(tmp_path / "audited"), config)

    return go


def test_a_release_of_scenes_that_share_nothing_is_clean(audit):
    """The clips are random walks of different scenes, with the same made-up map digest."""
    assert [one for one in audit() if one.check is not Check.DISTANCE_CONFLICT] == []


def test_all_guards_look_at_a_release(audit, make_clip, tiny):
    source = tiny.clips[-1]  # held out
    extra = make_clip(
        "synth_d435i/home_0003/000099", latents=source.latent_count, source_digest=source.meta.source_digest
    )
    extra = type(extra)(meta=extra.meta, **source.arrays())
    found = audit(extra, config=AuditConfig(split_by=SplitBy.SCENE))
    counts = count_findings(found)
    assert list(counts) == list(Check)
    assert counts[Check.SCENE_IN_SPLITS] == counts[Check.CONTENT_TWICE] == 1
    assert counts[Check.PATH_IN_SPLITS] >= 1
    assert found[0].severity is Severity.ERROR


def test_every_clip_is_reported_as_read(tiny):
    release, read = open_release(tiny.folder), []
    audit_release(release, on_clip=lambda: read.append(1))
    assert len(read) == len(release.index)


def test_the_same_release_has_the_same_findings(tiny):
    release = open_release(tiny.folder)
    assert audit_release(release) == audit_release(release)
    assert np.all([one.message for one in audit_release(release)])

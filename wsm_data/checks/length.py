"""Is the trajectory long enough to make a clip of?"""

from wsm_data.errors import Reason
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict


def check_length(record: EpisodeRecord, min_frames: int) -> Verdict:
    """Refuse a trajectory of fewer than `min_frames` frames (`episode.too_short`): a clip is 1 + 4k frames, k >= 1."""
    measured, limits = {"frames": record.frame_count}, {"min_frames": min_frames}
    if record.frame_count >= min_frames:
        return Verdict(measured=measured, limits=limits)
    message = f"{record.id.text}: a trajectory must have at least {min_frames} frames, found {record.frame_count}"
    return Verdict(reason=Reason.EPISODE_TOO_SHORT, message=message, measured=measured, limits=limits)

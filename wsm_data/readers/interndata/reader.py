"""InternData-N1 in the three layouts it is published in, and whatever is stored the same way."""

from wsm_data.readers.interndata.containers import EXPECTS, find_containers
from wsm_data.readers.interndata.frames import iter_episode_frames
from wsm_data.readers.interndata.preflight import preflight_container
from wsm_data.readers.interndata.scan import scan_container
from wsm_data.readers.source import SourceReader

INTERNDATA = SourceReader(
    name="interndata",
    expects=EXPECTS,
    find_containers=find_containers,
    scan=scan_container,
    iter_frames=iter_episode_frames,
    preflight=preflight_container,
)

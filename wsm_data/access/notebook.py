"""What a notebook shows of a release: its facts, and the first frame of some clips."""

import base64
from html import escape
from typing import TYPE_CHECKING

import cv2
import numpy as np

from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import Uint8Array

if TYPE_CHECKING:
    from wsm_data.access.release import Release

_SHOWN_CLIPS = 8
_WIDTH_PX = 200


def release_html(release: "Release") -> str:
    """A short piece of HTML: a line of facts, and a contact sheet of clips that are spread over the release."""
    rows = np.unique(np.linspace(0, len(release) - 1, min(_SHOWN_CLIPS, len(release))).round().astype(int)).tolist()
    keys = list(release.index.values(["key"], np.array(rows, np.int64))[0])
    try:
        figures = "".join(_figure(key, release.decode(key, frames=(0,)).rgb[0]) for key in keys)
    except ConfigError as error:  # a codec whose weights are not here
        figures = f"<p>{escape(str(error))}</p>"
    return f"<p>{escape(repr(release))}</p><div style='display:flex;flex-wrap:wrap;gap:8px'>{figures}</div>"


def _figure(key: str, rgb: Uint8Array) -> str:
    done, data = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    if not done:
        raise OSError(f"OpenCV cannot write the first frame of {key} as PNG")
    source = f"data:image/png;base64,{base64.b64encode(data.tobytes()).decode()}"
    return (
        f"<figure style='margin:0;width:{_WIDTH_PX}px'><img src='{source}' alt='' style='width:100%'>"
        f"<figcaption style='font-size:11px;overflow-wrap:anywhere'>{escape(key)}</figcaption></figure>"
    )

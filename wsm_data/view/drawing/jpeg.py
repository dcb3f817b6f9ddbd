"""Pictures as JPEG, for pages and recordings."""

import cv2
import numpy as np
import simplejpeg

from wsm_data.schema.arrays import Uint8Array

_QUALITY = 88
_THUMBNAIL_PX = 320


def jpeg(picture_u8: Uint8Array, quality: int = _QUALITY) -> bytes:
    """JPEG of a picture, uint8 [H, W, 3]."""
    return bytes(simplejpeg.encode_jpeg(np.ascontiguousarray(picture_u8), quality, "RGB", "444"))


def thumbnail(picture_u8: Uint8Array) -> bytes:
    """JPEG of a picture, uint8 [H, W, 3], made at most 320 px wide."""
    height, width = picture_u8.shape[:2]
    if width > _THUMBNAIL_PX:
        size = (_THUMBNAIL_PX, max(1, round(height * _THUMBNAIL_PX / width)))
        picture_u8 = np.asarray(cv2.resize(picture_u8, size, interpolation=cv2.INTER_AREA), np.uint8)
    return jpeg(picture_u8)

"""Small videos and image files that the codec tests share."""

import cv2
import numpy as np
import pytest
import simplejpeg

SMOOTHNESS_PX = 12


@pytest.fixture
def smooth_video():
    """Float32 [13, 64, 96, 3] in [-1, 1]: a coloured pattern that drifts in both directions."""
    rng = np.random.default_rng(5)
    texture = cv2.GaussianBlur(rng.normal(size=(160, 200, 3)), (0, 0), SMOOTHNESS_PX)
    texture = 0.8 * texture / np.abs(texture).max()
    return np.stack([texture[t : t + 64, 2 * t : 2 * t + 96] for t in range(13)]).astype(np.float32)


@pytest.fixture
def noise_video():
    """Float32 [9, 32, 64, 3], uniform noise in [-1, 1]: nothing about it is easy."""
    return np.random.default_rng(6).uniform(-1, 1, (9, 32, 64, 3)).astype(np.float32)


@pytest.fixture
def rgb_frames():
    """Three JPEG files of 96 x 54 px."""
    rng = np.random.default_rng(7)
    images = [cv2.resize(rng.integers(0, 256, (9, 16, 3), np.uint8), (96, 54)) for _ in range(3)]
    return [simplejpeg.encode_jpeg(image, quality=95) for image in images]


@pytest.fixture
def depth_images():
    """Three uint16 [54, 96] depth images in 0.1 mm with some pixels of both invalid codes."""
    rng = np.random.default_rng(8)
    images = rng.integers(1_000, 60_000, (3, 54, 96)).astype(np.uint16)
    images[:, 10:20, 10:40] = 0
    images[:, 30:40, 50:70] = 65535
    return images


@pytest.fixture
def depth_frames(depth_images):
    """The depth images as PNG files."""
    return [cv2.imencode(".png", image)[1].tobytes() for image in depth_images]

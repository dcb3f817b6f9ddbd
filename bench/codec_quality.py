"""What the built-in codec keeps and how fast it is: PSNR of colour, metres of depth error by range, frames per second.

Videos are generated (noise of the sensor, JPEG, area resize to 320 x 192, as the pipeline does) and the latents pass
through float16, as in a release. Beside PSNR against the noisy input stands PSNR against the same video without noise:
48 of 3072 numbers cannot hold noise, and should not. For comparison stands what as many numbers give without a codec:
the mean of four frames, resized to a quarter (4 x 4 pixels of three colours a cell), and enlarged again.
Run as `python bench/codec_quality.py`.
"""

import itertools
import statistics
import time
from functools import reduce

import cv2
import numpy as np
import simplejpeg
from generated_room import room_video, sensor
from reporting import machine, machine_line, table, write_results

from wsm_data.codecs.clip_video import depth_video, rgb_video
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.codecs.quality import DEPTH_EDGES_M, DepthErrors, depth_error_by_range, psnr_db
from wsm_data.schema.depth import DepthEncoding, DepthRange

WIDTH, HEIGHT = 320, 192
FRAMES = 33
ROUNDS = 7
SPEED_FRAMES = 169  # the median episode of InternData-N1
ENCODING = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
RANGE = DepthRange()
CODEC = DctCodec()
MOTIONS = {
    "slow": {"speed_m": 0.01, "turn_rad": 0.004},
    "navigation speed": {},
    "fast turn": {"turn_rad": 0.04},
}
NOISE_LEVELS = (0.0, 4.0, 8.0)
SEEDS = (1, 2, 3)


def through_codec(video):
    return CODEC.decode(CODEC.encode(video).astype(np.float16).astype(np.float32))


def through_small_frames(video):
    """As many numbers as the codec keeps: the mean of four frames, 4 x 4 pixels of three colours a cell, enlarged."""
    small = [cv2.resize(frame, (WIDTH // 4, HEIGHT // 4), interpolation=cv2.INTER_AREA) for frame in video]
    groups = [small[:1], *(small[start : start + 4] for start in range(1, len(small), 4))]
    decoded = [cv2.resize(np.mean(group, axis=0), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC) for group in groups]
    return np.repeat(np.stack(decoded), [len(group) for group in groups], axis=0).clip(-1, 1)


def measure_colour(clean_u8, noisy_u8) -> dict[str, float]:
    noisy, clean = (
        rgb_video([simplejpeg.encode_jpeg(frame, quality=95) for frame in frames], WIDTH, HEIGHT, "generated")
        for frames in (noisy_u8, clean_u8)
    )
    decoded = through_codec(noisy)
    return {
        "psnr_db": psnr_db(noisy, decoded),
        "psnr_to_clean_db": psnr_db(clean, decoded),
        "input_psnr_to_clean_db": psnr_db(clean, noisy),
        "small_frames_psnr_db": psnr_db(noisy, through_small_frames(noisy)),
    }


def measure_depth(depth_m) -> DepthErrors:
    raw_u16 = np.rint(depth_m / ENCODING.metres_per_unit).clip(1, 65534).astype(np.uint16)
    pngs = [cv2.imencode(".png", frame)[1].tobytes() for frame in raw_u16]
    depth, valid = depth_video(pngs, ENCODING, RANGE, WIDTH, HEIGHT, "generated")
    reference_m, decoded_m = (depth_m_from_latent_video(video, RANGE) for video in (depth, through_codec(depth)))
    return depth_error_by_range(reference_m, decoded_m, valid, DEPTH_EDGES_M)


def measure_speed() -> dict[str, float]:
    """Median frames per second of one core at 320 x 192, of clips of 169 frames."""
    video = np.random.default_rng(0).uniform(-1, 1, (SPEED_FRAMES, HEIGHT, WIDTH, 3)).astype(np.float32)
    grey = np.broadcast_to(video[..., :1], video.shape)
    latents = CODEC.encode(video)
    tasks = {
        "encode_colour": lambda: CODEC.encode(video),
        "encode_depth": lambda: CODEC.encode(grey),
        "decode": lambda: CODEC.decode(latents),
    }
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(ROUNDS):
        for name, task in tasks.items():
            start = time.perf_counter()
            task()
            times[name].append(time.perf_counter() - start)
    return {f"{name}_frames_per_s": SPEED_FRAMES / statistics.median(taken) for name, taken in times.items()}


def main() -> None:
    cv2.setNumThreads(1)
    cases: dict[str, dict[str, list[float]]] = {}
    errors = []
    for (motion, settings), seed in itertools.product(MOTIONS.items(), SEEDS):
        light, depth_m = room_video(seed, FRAMES, **settings)
        errors.append(measure_depth(depth_m))
        for noise in NOISE_LEVELS:
            case = cases.setdefault(f"{motion}, noise of {noise:g} levels", {})
            for key, value in measure_colour(sensor(light, 0), sensor(light, noise)).items():
                case.setdefault(key, []).append(value)
    depth = reduce(DepthErrors.merge, errors)
    speed, setup = measure_speed(), machine("numpy", "numba", "opencv-python-headless")
    record = {
        "machine": setup,
        "seeds": SEEDS,
        "videos": cases,
        "depth": {"edges_m": depth.edges_m, "mean_error_m": depth.mean_error_m, "shares": depth.shares},
        "speed": speed,
    }
    write_results("codec_quality", record, page(cases, depth, speed, setup))


def page(cases, depth: DepthErrors, speed, setup) -> list[str]:
    def decibels(values):
        return f"{statistics.mean(values):.1f} ({min(values):.1f} to {max(values):.1f})"

    video_rows = [
        [name, *(f"{decibels(values)}" if np.isfinite(values).all() else "equal" for values in case.values())]
        for name, case in cases.items()
    ]
    depth_rows = [
        [f"{low:g} to {high:g}", "no pixel" if mean is None else f"{mean:.4f}", f"{100 * share:.1f}"]
        for low, high, mean, share in zip(
            depth.edges_m, depth.edges_m[1:], depth.mean_error_m, depth.shares, strict=False
        )
    ]
    seconds = sum(SPEED_FRAMES / speed[f"encode_{kind}_frames_per_s"] for kind in ("colour", "depth"))
    return [
        "# Quality and speed of the codec `dct`",
        "",
        f"{len(SEEDS)} generated rooms per row, {FRAMES} frames at {WIDTH}x{HEIGHT}, latents through float16; mean "
        "(lowest to highest), dB. As many numbers: the mean of four frames at a quarter of the size, enlarged again.",
        "",
        *table(
            ["video", "PSNR to the input", "PSNR to the video without noise", "the input's own", "as many numbers"],
            video_rows,
        ),
        "",
        "Mean absolute depth error, m, in the rooms above; depth beyond 5 m counts as 5 m.",
        "",
        *table(["true depth, m", "mean error, m", "share of pixels, %"], depth_rows),
        "",
        f"Frames per second of one core: encode colour {speed['encode_colour_frames_per_s']:.0f}, encode depth "
        f"{speed['encode_depth_frames_per_s']:.0f}, decode {speed['decode_frames_per_s']:.0f} (clips of {SPEED_FRAMES} "
        f"frames, so a median episode of InternData-N1 takes {seconds:.2f} s).",
        "",
        machine_line(setup),
    ]


if __name__ == "__main__":
    main()

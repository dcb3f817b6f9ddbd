"""Frames per second up to the codec, against a bare loop that decodes and resizes the same files with OpenCV.

Ours, per frame: digests of both files and the structural checks of `wsm index`; strict decode, area resize and
conversion of colour, decode, nearest resize, log table and validity of depth as in `wsm encode`. Bare: imdecode and
area resize of the same JPEG and the same PNG, nothing checked, nothing kept. Run as `python bench/frames.py`.
"""

import multiprocessing
import statistics
import time

import cv2
import numpy as np
import simplejpeg
from generated_room import HEIGHT, WIDTH, room_video, sensor
from reporting import machine, machine_line, table, write_results

from wsm_data.codecs.clip_video import depth_video, rgb_video
from wsm_data.files.digest import xxh3_128
from wsm_data.readers.images import check_jpeg, check_png16
from wsm_data.schema.depth import DepthEncoding, DepthRange

TARGET_WIDTH, TARGET_HEIGHT = 320, 192
FRAMES = 48
ROUNDS = 9
EPISODES_PER_WORKER_ROUND = 6
ENCODING = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
RANGE = DepthRange()
CASES = {"smooth depth": 0.0, "noisy depth": 0.002}
"""Noise of depth as a share of depth squared (m), as of a stereo camera; rendered depth has none."""


def make_episode(depth_noise: float) -> tuple[list[bytes], list[bytes]]:
    """JPEG and 16-bit PNG files of one generated episode with 4 levels of colour noise."""
    light, depth_m = room_video(seed=3, frames=FRAMES)
    depth_m = depth_m + depth_noise * depth_m**2 * np.random.default_rng(0).normal(size=depth_m.shape)
    raw_u16 = np.clip(np.rint(depth_m / ENCODING.metres_per_unit), 1, 65534).astype(np.uint16)
    jpegs = [simplejpeg.encode_jpeg(frame, quality=95) for frame in sensor(light, 4.0)]
    return jpegs, [cv2.imencode(".png", frame)[1].tobytes() for frame in raw_u16]


def bare_loop(jpegs: list[bytes], pngs: list[bytes]) -> None:
    size = (TARGET_WIDTH, TARGET_HEIGHT)
    for jpeg, png in zip(jpegs, pngs, strict=True):
        cv2.resize(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), size, interpolation=cv2.INTER_AREA)
        cv2.resize(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED), size, interpolation=cv2.INTER_AREA)


def our_path(jpegs: list[bytes], pngs: list[bytes]) -> None:
    for index, (jpeg, png) in enumerate(zip(jpegs, pngs, strict=True)):
        where = f"frame {index}"
        xxh3_128(jpeg), xxh3_128(png)
        check_jpeg(memoryview(jpeg), where), check_png16(memoryview(png), where)
    rgb_video(jpegs, TARGET_WIDTH, TARGET_HEIGHT, "episode")
    depth_video(pngs, ENCODING, RANGE, TARGET_WIDTH, TARGET_HEIGHT, "episode")


def seconds(function, *args) -> float:
    start = time.perf_counter()
    function(*args)
    return time.perf_counter() - start


def compare(episode: tuple[list[bytes], list[bytes]]) -> dict[str, object]:
    """Alternate both loops, the order swapped every round, and take the ratio of each round."""
    our_path(*episode)
    bare_loop(*episode)
    ours, bare = [], []
    for turn in range(ROUNDS):
        for function, times in sorted(
            [(our_path, ours), (bare_loop, bare)], key=lambda c: c[0].__name__, reverse=turn % 2
        ):
            times.append(seconds(function, *episode))
    ratios = sorted(b / o for o, b in zip(ours, bare, strict=True))
    return {
        "ours_frames_per_s": FRAMES / statistics.median(ours),
        "bare_frames_per_s": FRAMES / statistics.median(bare),
        "ratio": statistics.median(ratios),
        "ratio_spread": [ratios[0], ratios[-1]],
    }


def two_process_speed_up(episode: tuple[list[bytes], list[bytes]]) -> dict[str, object]:
    """Wall time of the same episodes in one process and in two, alternating, both pools warm."""
    work = [episode] * EPISODES_PER_WORKER_ROUND
    context = multiprocessing.get_context("spawn")
    with context.Pool(1, cv2.setNumThreads, (1,)) as one, context.Pool(2, cv2.setNumThreads, (1,)) as two:
        pools = {"one": one, "two": two}
        for pool in pools.values():
            pool.starmap(our_path, work, chunksize=1)
        times: dict[str, list[float]] = {"one": [], "two": []}
        for _ in range(ROUNDS):
            for name, pool in pools.items():
                times[name].append(seconds(lambda pool=pool: pool.starmap(our_path, work, chunksize=1)))
    ratios = sorted(a / b for a, b in zip(times["one"], times["two"], strict=True))
    return {"speed_up": statistics.median(ratios), "speed_up_spread": [ratios[0], ratios[-1]]}


def main() -> None:
    cv2.setNumThreads(1)
    episodes = {name: make_episode(noise) for name, noise in CASES.items()}
    results = {name: compare(episode) for name, episode in episodes.items()}
    speed_up = two_process_speed_up(episodes["smooth depth"])
    setup = machine("numpy", "opencv-python-headless", "simplejpeg", "xxhash")
    rows = [
        [
            name,
            f"{np.mean([len(data) for data in episodes[name][0]]) / 1e3:.0f} + "
            f"{np.mean([len(data) for data in episodes[name][1]]) / 1e3:.0f}",
            f"{result['ours_frames_per_s']:.0f}",
            f"{result['bare_frames_per_s']:.0f}",
            f"{result['ratio']:.2f} ({result['ratio_spread'][0]:.2f} to {result['ratio_spread'][1]:.2f})",
        ]
        for name, result in results.items()
    ]
    spread = speed_up["speed_up_spread"]
    lines = [
        "# Frames per second up to the codec",
        "",
        f"{FRAMES} generated frames of {WIDTH}x{HEIGHT} (JPEG quality 95, 16-bit PNG) to "
        f"{TARGET_WIDTH}x{TARGET_HEIGHT}, one process with one thread, "
        f"medians of {ROUNDS} alternating rounds; a frame is a colour and a depth image. "
        "Ours digests, checks, decodes strictly, resizes, normalises and keeps; the bare loop decodes and resizes.",
        "",
        *table(["input", "kB a frame", "ours, frames/s", "bare loop, frames/s", "ratio (spread)"], rows),
        "",
        f"Two processes against one, ours: {speed_up['speed_up']:.2f} x ({spread[0]:.2f} to {spread[1]:.2f}).",
        "",
        machine_line(setup),
    ]
    write_results("frames", {"machine": setup, "cases": results, "two_processes": speed_up}, lines)


if __name__ == "__main__":
    main()

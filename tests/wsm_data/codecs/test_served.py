"""A codec behind a socket gives what it gives without, to the byte, and says what it refuses."""

import socket
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.served import ServedCodec, answer_one
from wsm_data.errors import WsmError


@contextmanager
def served(tmp_path, requests):
    """A codec that answers so many requests."""
    address = str(tmp_path / "socket")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen()
        thread = threading.Thread(target=lambda: [answer_one(listening, DctCodec()) for _ in range(requests)])
        thread.start()
        yield ServedCodec(address)
        thread.join()


def test_latents_and_videos_are_those_of_the_codec_itself(tmp_path, noise_video, smooth_video):
    codec = DctCodec()
    videos = [noise_video, np.broadcast_to(smooth_video[..., :1], smooth_video.shape)]  # depth repeats one channel
    wanted = codec.encode_many(videos)
    with served(tmp_path, 2) as asked:
        latents = asked.encode_many(videos)
        assert [one.tobytes() for one in latents] == [one.tobytes() for one in wanted]
        assert asked.decode(latents[0]).tobytes() == codec.decode(wanted[0]).tobytes()


def test_it_describes_itself_as_the_codec_does(tmp_path):
    with served(tmp_path, 1) as asked:
        assert asked.describe() == DctCodec().describe()


def test_what_the_codec_refuses_is_told_with_its_words(tmp_path, noise_video):
    with served(tmp_path, 1) as asked, pytest.raises(ValueError, match="1 \\+ 4k frames, found 2"):
        asked.encode_many([noise_video[:2]])


def test_a_server_that_is_gone_is_told(tmp_path, noise_video):
    with pytest.raises(WsmError, match="the process that holds the codec ended"):
        ServedCodec(str(tmp_path / "nobody")).encode_many([noise_video])


def test_a_request_that_breaks_off_leaves_the_server_answering(tmp_path):
    with served(tmp_path, 2) as asked:
        with socket.socket(socket.AF_UNIX) as broken:
            broken.connect(asked.address)
        assert asked.describe().name == "dct"

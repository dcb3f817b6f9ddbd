import threading
import time

import pytest

from wsm_data.loaders.timing import Part, Timing


def test_parts_add_up():
    timing = Timing()
    for part, seconds in ((Part.STORE, 1.5), (Part.WAIT, 0.25), (Part.STORE, 0.5)):
        timing.add(part, seconds)
    assert timing.seconds() == dict.fromkeys(Part, 0.0) | {Part.STORE: 2.0, Part.WAIT: 0.25}


def test_what_was_given_out_does_not_change():
    timing = Timing()
    earlier = timing.seconds()
    timing.add(Part.STORE, 1.0)
    assert earlier[Part.STORE] == 0


def test_nothing_is_lost_among_threads():
    timing = Timing()
    threads = [threading.Thread(target=lambda: [timing.add(Part.COLLATE, 1.0) for _ in range(500)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert timing.seconds()[Part.COLLATE] == 2000


def fail_after_a_while(timing: Timing) -> None:
    with timing.measure(Part.CHECKSUM):
        time.sleep(0.01)
        raise ValueError("x")


def test_blocks_are_counted_to_their_parts_also_where_they_fail():
    timing = Timing()
    with timing.measure(Part.STORE):
        time.sleep(0.01)
    with pytest.raises(ValueError, match="x"):
        fail_after_a_while(timing)
    seconds = timing.seconds()
    assert seconds[Part.STORE] >= 0.01
    assert seconds[Part.CHECKSUM] >= 0.01
    assert seconds[Part.TRANSFER] == 0

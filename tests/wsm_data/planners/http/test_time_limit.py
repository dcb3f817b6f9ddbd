"""A limit on the whole of a conversation."""

import socket
import threading

from wsm_data.planners.http.time_limit import TimeLimit


def test_a_peer_that_sends_a_byte_now_and_then_is_cut_off_all_the_same():
    ours, theirs = socket.socketpair()
    stop = threading.Event()

    def drip():
        while not stop.wait(0.02):
            theirs.send(b".")

    dripping = threading.Thread(target=drip)
    dripping.start()
    with ours, theirs:
        with TimeLimit(ours, 0.2, socket.SHUT_RD) as limit:
            received = 0
            while data := ours.recv(1):
                received += len(data)
        stop.set()
        dripping.join()
    assert limit.is_over
    assert received > 1


def test_after_the_block_the_socket_is_left_alone():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        with TimeLimit(ours, 30.0, socket.SHUT_RDWR) as limit:
            theirs.send(b"x")
            assert ours.recv(1) == b"x"
        assert not limit.is_over
        theirs.send(b"y")
        assert ours.recv(1) == b"y"

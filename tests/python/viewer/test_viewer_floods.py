"""Sockets by the hundreds: nobody is locked out, and Ctrl-C ends all of them."""

import os
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

pytest.importorskip("viser", reason="viser is not installed: pip install 'graspforce[viewer]'")

from support.viewer_client import (
    CAMERA,
    PROTOCOL,
    client,
    get,
    nothing_happens,
    raw_client,
    say,
    token_of,
    wait_for,
)
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect as websocket

from graspforce.viewer import guard

EXAMPLES = Path(__file__).parents[3] / "examples"


@contextmanager
def silent(port, count):
    """Open sockets that say nothing, one after the other."""
    opened = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(count)]
    yield opened
    for one in opened:
        one.close()


def processor_seconds(process):
    stat = Path(f"/proc/{process}/stat")
    if not stat.exists():
        return 0.0
    ticks = stat.read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


@pytest.mark.alone
def test_hundreds_of_sockets_are_closed_within_a_second_of_ctrl_c(tmp_path):
    command = [sys.executable, "-m", "graspforce", "view", str(EXAMPLES / "pinched_egg.yaml")]
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    with (
        subprocess.Popen(
            [*command, "--port", "18098"],
            cwd=tmp_path,
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as running,
        ExitStack() as at_the_end,
    ):
        at_the_end.callback(running.kill)
        address, token = re.match(r"http://([^/]+)/\?token=(\S+)", running.stderr.readline()).groups()

        def open_one(_):
            page = f"ws://{address}/?token={token}"
            return websocket(page, subprotocols=[PROTOCOL], max_size=None, compression=None)

        with ThreadPoolExecutor(4) as pool:
            opened = list(pool.map(open_one, range(guard.MAX_CONNECTIONS)))
        at_the_end.enter_context(silent(int(address.rpartition(":")[2]), 512))
        for one in opened:
            at_the_end.callback(one.socket.close)
            say(one, CAMERA)
        opened[0].recv(timeout=10)
        before = processor_seconds(running.pid)
        begin = time.monotonic()
        running.send_signal(signal.SIGINT)
        output, errors = running.communicate(timeout=20)
        took = time.monotonic() - begin
        assert running.returncode == 0
    # Where others use the machine, too, what counts is that nothing is waited for.
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = used.ru_utime + used.ru_stime - children.ru_utime - children.ru_stime - before
    assert took < 1.0 or (took < 5.0 and ended < 0.7), f"{took:.2f} s, of which it computed {ended:.2f} s"
    assert "Traceback" not in output + errors


def frame(opcode, content=b"", *, last=True):
    """Return a frame of the protocol, masked with zeros."""
    return bytes([128 * last + opcode, 128 + len(content)]) + bytes(4) + content


@pytest.mark.parametrize(
    ("begin", "more"),
    [(frame(2, last=False), frame(0, last=False)), (b"", frame(9, bytes(125)))],
    ids=["empty pieces of a message", "pings whose answers are not read"],
)
def test_frames_without_end_end_their_connection(viewer, begin, more):
    with raw_client(viewer) as opened:
        opened.sendall(begin)
        with pytest.raises(OSError, match=r"reset|Broken pipe"):
            opened.sendall(more * (64 << 20 >> len(more).bit_length()))
    nothing_happens(viewer)


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="counts file descriptors")
def test_sockets_beyond_a_limit_are_closed_at_once(viewer, monkeypatch):
    monkeypatch.setattr(guard, "MAX_CONNECTIONS", 5)
    before = len(list(Path("/proc/self/fd").iterdir()))
    kept, refused = [], 0
    for _ in range(20):
        try:
            manager = client(viewer)
            manager.__enter__()
            kept.append(manager)
        except (OSError, EOFError, WebSocketException):
            refused += 1
    assert len(kept) <= 5
    assert refused >= 15
    assert len(list(Path("/proc/self/fd").iterdir())) - before <= 12
    for manager in kept:
        manager.__exit__(None, None, None)
    wait_for(lambda: not viewer._guard._open)
    monkeypatch.undo()
    nothing_happens(viewer)


def test_sockets_without_the_token_lock_nobody_out(viewer):
    with silent(viewer.port, 600):
        begin = time.monotonic()
        nothing_happens(viewer)
        assert get(viewer, f"/?token={token_of(viewer)}").status == 200
        assert time.monotonic() - begin < 5.0
        assert len(viewer._guard._unknown) <= guard.MAX_HANDSHAKES
        # They are not waited for either.
        wait_for(lambda: not viewer._guard._unknown)


def test_requests_that_are_refused_do_not_count_as_connections(viewer):
    for _ in range(20):
        assert get(viewer, "/").status == 403
    wait_for(lambda: not viewer._guard._open and not viewer._guard._unknown)

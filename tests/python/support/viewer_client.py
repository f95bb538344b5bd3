"""A viewer, and raw clients of it that may say anything."""

import http.client
import socket
import time
from contextlib import contextmanager

import msgspec
import numpy as np
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect as websocket

import graspforce as gf
from graspforce.viewer import view
from graspforce.viewer.controls import identifier

PROTOCOL = f"viser-v{viser.__version__}"
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, 0, 1], "fov": 1.0, "near": 0.1,
    "far": 10.0, "image_height": 480, "image_width": 640, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip
UNIT = [1, 0, 0, 0]


@contextmanager
def served():
    """Serve three fingers on a ring and stop afterwards."""
    angles = np.deg2rad([0, 120, 240])
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    grasp = gf.Grasp(0.04 * outward, -outward, friction=0.6, max_normal_force=20.0, length_scale=0.04)
    viewer = view(grasp, wrenches=[[0, 0, -5 - k, 0, 0, 0] for k in range(8)], port=18090)
    yield viewer
    viewer.stop()


def token_of(viewer):
    return viewer.address.partition("?token=")[2]


@contextmanager
def client(viewer, token=None, **headers):
    """Connect a raw client that has sent a camera, as viser's page does; by default it holds the token."""
    token = token_of(viewer) if token is None else token
    cookie = headers.pop("cookie", f"graspforce-{viewer.port}={token}")
    # The client library makes the Host header from the address.
    address = f"ws://{headers.pop('host', f'127.0.0.1:{viewer.port}')}/{headers.pop('query', '')}"
    sent = {"Cookie": cookie} if cookie else {}
    origin = headers.pop("origin", None)
    with websocket(
        address, sock=socket.create_connection(("127.0.0.1", viewer.port)),
        origin=origin, subprotocols=[PROTOCOL],
        additional_headers=sent, max_size=None, compression=None, close_timeout=0.2,
    ) as opened:  # fmt: skip
        say(opened, CAMERA)
        yield opened


@contextmanager
def raw_client(viewer):
    """Connect a socket that has made the handshake and reads nothing more."""
    with socket.create_connection(("127.0.0.1", viewer.port), timeout=10) as opened:
        lines = [
            "GET / HTTP/1.1", f"Host: 127.0.0.1:{viewer.port}", "Upgrade: websocket", "Connection: Upgrade",
            f"Sec-WebSocket-Key: {'A' * 22}==", "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Protocol: {PROTOCOL}",
            f"Cookie: graspforce-{viewer.port}={token_of(viewer)}", "", "",
        ]  # fmt: skip
        opened.sendall("\r\n".join(lines).encode())
        assert b" 101 " in opened.recv(4096)
        yield opened


def say(opened, message):
    opened.send(msgspec.msgpack.encode(message))


def status(viewer, **headers):
    """Status with which a handshake is refused; 101 if it is not."""
    try:
        with client(viewer, **headers):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def get(viewer, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    answer.body = answer.read()
    connection.close()
    return answer


def wait_for(condition, timeout=10.0):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def state_of(viewer):
    """Everything that clients might have changed."""
    shown = viewer._controls
    controls = (shown.friction, shown.limits, shown.row, shown.criterion, shown.playing, shown.dark)
    return (
        [(control.value, control.label, control.disabled) for control in controls],
        [(*handle.position, *handle.wxyz, handle.visible) for handle in viewer._handles],
        viewer.state.grasp.positions.tolist(),
        viewer._controls.message.content,
    )


def nothing_happens(viewer, *forged):
    """Send messages, then a genuine one on the same connection: it is obeyed, the others were not."""
    before = state_of(viewer)
    factor = 1.5 if viewer._controls.friction.value != 1.5 else 1.0
    with client(viewer) as opened:
        for message in forged:
            opened.send(message) if isinstance(message, bytes | str) else say(opened, message)
        say(opened, slide(viewer._controls.friction, factor))
        wait_for(lambda: viewer._controls.friction.value == factor)
        say(opened, slide(viewer._controls.friction, before[0][0][0]))
        wait_for(lambda: viewer._controls.friction.value == before[0][0][0])
    assert state_of(viewer) == before


def slide(control, value, **more):
    return {"type": "GuiUpdateMessage", "uuid": identifier(control), "updates": {"value": value, **more}}


def drag(name, position, wxyz=UNIT, **more):
    return {
        "type": "TransformControlsUpdateMessage", "name": name, "wxyz": wxyz, "position": position,
        "owner": "", **more,
    }  # fmt: skip

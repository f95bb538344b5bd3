"""What an attacker tries against the viewer: another page, another name, a client that lies or floods."""

import dataclasses
import http.client
import math
import resource
import threading
import time

import numpy as np
import pytest

import graspforce as gf

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'graspforce[viewer]'")

import msgspec
from support.viewer_client import (
    CAMERA,
    PROTOCOL,
    client,
    drag,
    get,
    nothing_happens,
    say,
    slide,
    status,
    token_of,
    wait_for,
)
from viser import _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as websocket

from graspforce.viewer import guard, messages, view
from graspforce.viewer.controls import identifier
from graspforce.viewer.ports import free_port


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example", "null", "http://127.0.0.1", "http://127.0.0.1:1", "https://127.0.0.1:{port}",
        "http://localhost:3000", "http://127.0.0.1:{port}.evil.example", "http://127.0.0.1:{port}@evil.example",
        "http://evil.example:{port}", "file://", "",
    ],
)  # fmt: skip
def test_another_page_is_refused_even_with_the_token(viewer, origin):
    origin = origin.format(port=viewer.port)
    assert status(viewer, origin=origin) == 403
    assert get(viewer, f"/?token={token_of(viewer)}", Origin=origin).status == 403


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "[::1]"])
def test_its_own_page_is_answered(viewer, name):
    host = f"{name}:{viewer.port}"
    assert status(viewer, origin=f"http://{host}", host=host) == 101
    assert get(viewer, f"/?token={token_of(viewer)}", Host=host, Origin=f"http://{host}").status == 200


@pytest.mark.parametrize("host", ["attacker.example", "attacker.example:{port}", "127.0.0.1:1", "127.0.0.1"])
def test_a_name_that_was_bound_to_this_machine_is_refused(viewer, host):
    host = host.format(port=viewer.port)
    assert status(viewer, host=host) == 403
    assert status(viewer, host=host, origin=f"http://{host}") == 403
    assert get(viewer, f"/?token={token_of(viewer)}", Host=host).status == 403


@pytest.mark.parametrize("wrong", ["", "x", "{token}x", "{half}", "ż", "%00"])
def test_without_the_token_there_is_neither_page_nor_socket(viewer, wrong):
    token = token_of(viewer)
    wrong = wrong.format(token=token, half=token[:-1])
    assert status(viewer, cookie="") == 403
    assert status(viewer, token=wrong.encode().decode("latin-1")) == 403
    assert status(viewer, cookie="", query=f"?token={wrong.encode('ascii', 'ignore').decode()}") == 403
    for path in ("/", "/index.html", "/assets/", f"/?token={wrong.encode('ascii', 'ignore').decode()}"):
        answer = get(viewer, path)
        assert answer.status == 403
        assert len(answer.body) < 200
        assert token.encode() not in answer.body


def test_the_page_carries_the_token_on_in_a_cookie_that_no_script_and_no_other_site_can_use(viewer):
    answer = get(viewer, f"/?token={token_of(viewer)}")
    assert answer.status == 200
    cookie = answer.getheader("Set-Cookie")
    assert cookie == f"graspforce-{viewer.port}={token_of(viewer)}; HttpOnly; SameSite=Strict; Path=/"
    assert answer.getheader("Referrer-Policy") == "no-referrer"
    assert "frame-ancestors 'none'" in answer.getheader("Content-Security-Policy")
    assert get(viewer, "/", Cookie=cookie.partition(";")[0]).status == 200
    assert status(viewer, cookie="", query=f"?token={token_of(viewer)}") == 101


def test_the_page_is_titled_whatever_the_request_accepts(viewer):
    for accepted in ([], ["gzip, br"], ["gzip", "gzip"]):
        connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=10)
        connection.putrequest("GET", f"/?token={token_of(viewer)}", skip_accept_encoding=True)
        for value in accepted:
            connection.putheader("Accept-Encoding", value)
        connection.endheaders()
        answer = connection.getresponse()
        assert answer.status == 200
        assert b"<title>graspforce</title>" in answer.read()
        connection.close()


def test_tokens_are_random_and_compared_in_constant_time(viewer, monkeypatch):
    tokens = {guard.Guard("127.0.0.1", messages.Filter()).token for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 32
    compared = []
    monkeypatch.setattr(
        guard.hmac, "compare_digest", lambda given, own: compared.append(given) or given == own
    )
    assert status(viewer, token="guess") == 403
    assert compared == [b"guess"]


def test_nobody_can_ask_for_a_public_tunnel(viewer, monkeypatch):
    asked = []
    monkeypatch.setattr(viewer._server, "request_share_url", lambda: asked.append(True))
    monkeypatch.setattr(viser._viser, "ViserTunnel", lambda *arguments: asked.append(arguments))
    nothing_happens(viewer, {"type": "ShareUrlRequest"}, {"type": "ShareUrlDisconnect"})
    assert asked == []
    assert viewer._server._share_tunnel is None


def test_uploads_are_dropped(viewer):
    start = {
        "type": "FileTransferStartUpload", "source_component_uuid": identifier(viewer._controls.friction),
        "transfer_uuid": "u", "filename": "f", "mime_type": "", "part_count": 99, "size_bytes": 1 << 40,
    }  # fmt: skip
    part = {
        "type": "FileTransferPart", "source_component_uuid": None, "transfer_uuid": "u", "part_index": 0,
        "content": bytes(40_000),
    }  # fmt: skip
    nothing_happens(viewer, start, part)
    assert viewer._server.gui._current_file_upload_states == {}


def test_a_message_of_400_mib_ends_its_connection_and_takes_no_memory(viewer):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    piece = bytes(1 << 20)

    def attack():
        with client(viewer) as opened:
            opened.send(piece for _ in range(400))
            for _ in range(100):
                opened.recv(timeout=5)

    with pytest.raises(ConnectionClosed):
        attack()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 40 << 10
    nothing_happens(viewer)


def test_forged_updates_are_ignored(viewer):
    slider, name = viewer._controls.friction, "/contacts/0"
    nothing_happens(
        viewer,
        slide(slider, 1.2, label="pwned"),
        {"type": "GuiUpdateMessage", "uuid": identifier(slider), "updates": {"min": 5.0}},
        {"type": "GuiUpdateMessage", "uuid": identifier(slider), "updates": {"removed": True}},
        {"type": "GuiUpdateMessage", "uuid": identifier(slider), "updates": {}},
        {"type": "GuiUpdateMessage", "uuid": [1, 2], "updates": {"value": 1}},
        {"type": "GuiUpdateMessage", "uuid": "unknown", "updates": {"value": 1}},
        {
            "type": "GuiUpdateMessage",
            "uuid": identifier(viewer._controls.message),
            "updates": {"content": "<script>"},
        },
        *(slide(slider, value) for value in (0.0, -1, 2.1, 1e308, 1 << 60, "1", True, None, [1.0], {})),
        *(slide(viewer._controls.row, value) for value in (-1, 8, 1e9, "x", False)),
        *(slide(viewer._controls.criterion, value) for value in ("", "min", 1, True, ["max"])),
        *(slide(viewer._controls.playing, value) for value in ("yes", 2, 1.0)),
        drag("/object", [1, 1, 1]),
        drag("/contacts/3", [1, 1, 1]),
        drag("/contacts/0/../1", [1, 1, 1]),
        drag(name, [1, 1, 1], owner="0"),
        drag(name, [1, 1]),
        drag(name, [1, 1, "1"]),
        drag(name, [1, 1, 1], wxyz=[0, 0, 0, 0]),
        drag(name, [1, 1, 1], more=1),
        {"type": "SetPositionMessage", "name": name, "position": [9, 9, 9]},
        {"type": "RemoveSceneNodeMessage", "name": name},
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "GuiFormDirtyMessage", "uuid": "x"},
        {"type": "GetRenderResponseMessage", "payload": b""},
        {**CAMERA, "position": [0, 0, math.inf]},
        {**CAMERA, "image_height": -1},
        {"type": "Nothing"},
        {},
        b"",
        b"\xc1",
        b"\x91" * 60_000,
        msgspec.msgpack.encode([CAMERA]),
        "text",
    )


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_reach_neither_contact_nor_slider(viewer, value):
    nothing_happens(
        viewer,
        drag("/contacts/0", [value, 0, 0]),
        drag("/contacts/1", [0, 0, 0], wxyz=[value, 0, 0, 0]),
        slide(viewer._controls.friction, value),
        slide(viewer._controls.limits, value),
        slide(viewer._controls.row, value),
        {**CAMERA, "fov": value},
    )
    assert viewer.state.quality("max").epsilon > 0


def test_a_state_that_refuses_a_change_is_as_before(viewer):
    # What earlier tests moved may not have reached the state yet.
    wait_for(lambda: not viewer._changed.is_set())
    with viewer._turn:
        viewer._apply_changes()
    state = viewer.state
    before = state.grasp.positions.copy(), state.quality("max").epsilon
    for contact, to in ((0, [math.nan] * 3), (0, [1e308] * 3), (3, [0, 0, 0]), (-1, [0, 0, 0]), (0, [0, 0])):
        with pytest.raises(gf.GraspForceError):
            state.move(contact, to)
    for factors in ((math.nan, 1.0), (1.0, math.nan), (-1.0, 1.0), (1.0, math.inf), (math.inf, 1.0)):
        with pytest.raises(gf.GraspForceError):
            state.scale(*factors)
    np.testing.assert_array_equal(state.grasp.positions, before[0])
    assert state.quality("max").epsilon == before[1]


def test_a_drag_of_its_own_page_is_obeyed_and_the_newest_counts(viewer):
    start = viewer.state.grasp.positions[0].tolist()
    with client(viewer, origin=f"http://127.0.0.1:{viewer.port}") as opened:
        say(opened, {"type": "TransformControlsDragStartMessage", "name": "/contacts/0", "owner": ""})
        for k in range(50):
            say(opened, drag("/contacts/0", [start[0], start[1], 1e-4 * k]))
        say(opened, {"type": "TransformControlsDragEndMessage", "name": "/contacts/0", "owner": ""})
        wait_for(lambda: viewer.state.grasp.positions[0, 2] == pytest.approx(49e-4))
        say(opened, drag("/contacts/0", start))
        wait_for(lambda: np.array_equal(viewer.state.grasp.positions[0], start))


def test_a_flood_of_messages_is_read_slowly_and_answered_as_few(viewer, monkeypatch):
    answered = []
    update = viewer.update
    monkeypatch.setattr(viewer, "update", lambda: (time.sleep(0.1), answered.append(1), update()))
    factors = [1.0 + 0.1 * (k % 2) for k in range(601)]
    with client(viewer) as opened, client(viewer) as other:
        begin = time.monotonic()
        for factor in factors:
            say(opened, slide(viewer._controls.limits, factor))
        # Another client is served meanwhile.
        say(other, slide(viewer._controls.criterion, "sum"))
        wait_for(lambda: viewer._controls.criterion.value == "sum", timeout=1.0)
        wait_for(lambda: viewer._controls.limits.value == factors[-1] and not viewer._changed.is_set())
        time.sleep(1.0)
        assert len(answered) < 10 * (time.monotonic() - begin) + 2
        say(other, slide(viewer._controls.criterion, "max"))
        wait_for(lambda: viewer._controls.criterion.value == "max")
    wait_for(lambda: not viewer._changed.is_set())


def test_a_flood_of_asking_for_the_file_makes_it_at_most_once_a_second(viewer, monkeypatch):
    made, sent = [], []
    html = viewer.html
    monkeypatch.setattr(viewer, "html", lambda: made.append(1) or html())
    monkeypatch.setattr(
        viser.ClientHandle, "send_file_download", lambda *arguments, **_: sent.append(arguments)
    )
    begin = time.monotonic()
    with client(viewer) as opened:
        for _ in range(200):
            say(opened, slide(viewer._controls.share, True))
        say(opened, slide(viewer._controls.limits, 1.5))
        wait_for(lambda: viewer._controls.limits.value == 1.5)
        say(opened, slide(viewer._controls.limits, 1.0))
        wait_for(lambda: viewer._controls.limits.value == 1.0 and sent)
    assert len(made) <= time.monotonic() - begin + 1
    nothing_happens(viewer)


def test_the_messages_are_those_of_the_installed_viser():
    for ours in messages.MESSAGES:
        theirs = getattr(_messages, ours.__name__)
        assert [field.name for field in msgspec.structs.fields(ours)] == [
            field.name for field in dataclasses.fields(theirs)
        ]


def test_a_viser_that_cannot_be_guarded_is_not_started(monkeypatch):
    # As if viser called the server by another name than the one that is replaced.
    serve = guard.websockets_server.serve
    monkeypatch.setattr(guard, "websockets_server", type("Elsewhere", (), {"serve": serve}))
    with pytest.raises(gf.GraspForceError, match=f"viser {viser.__version__}.*cannot be guarded"):
        view(gf.Grasp(np.eye(3), -np.eye(3)), port=18095)
    assert free_port("127.0.0.1", 18095) == 18095


def test_a_viewer_that_fails_while_it_starts_leaves_its_port(monkeypatch):
    monkeypatch.setattr(viser.SceneApi, "add_mesh_simple", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        view(gf.Grasp(np.eye(3), -np.eye(3)), port=18098)
    assert free_port("127.0.0.1", 18098) == 18098


@pytest.mark.parametrize("broken", ["html", "update"])
def test_what_goes_wrong_unexpectedly_is_shown_and_the_page_lives_on(viewer, monkeypatch, broken):
    reported = []
    monkeypatch.setattr(threading, "excepthook", reported.append)
    control = viewer._controls.share if broken == "html" else viewer._controls.limits
    with client(viewer) as opened:
        with monkeypatch.context() as failing:
            failing.setattr(viewer, broken, lambda: {}["gone"])
            say(opened, slide(control, True if broken == "html" else 1.2))
            wait_for(lambda: reported)
        assert "KeyError" in viewer._controls.message.content
        assert isinstance(reported[0].exc_value, KeyError)
        say(opened, slide(viewer._controls.limits, 1.5))
        wait_for(lambda: not viewer._controls.message.content)
        say(opened, slide(viewer._controls.limits, 1.0))
        wait_for(lambda: viewer._controls.limits.value == 1.0)
    assert all(thread.is_alive() for thread in viewer._threads)


def test_servers_of_others_are_left_alone():
    assert guard.websockets_server.serve.__module__ == "websockets.asyncio.server"
    other = viser.ViserServer(host="127.0.0.1", port=18096, verbose=False)
    try:
        with websocket(f"ws://127.0.0.1:{other.get_port()}", subprotocols=[PROTOCOL], origin="null"):
            pass
    finally:
        other.stop()


def test_other_machines_are_let_in_only_with_a_warning():
    with pytest.warns(UserWarning, match=r"0\.0\.0\.0, where other machines can reach it"):
        viewer = view(gf.Grasp(np.eye(3), -np.eye(3)), host="0.0.0.0", port=18097)
    try:
        assert viewer.address.startswith("http://127.0.0.1:")
        assert status(viewer) == 101
        assert status(viewer, host=f"attacker.example:{viewer.port}") == 403
        assert status(viewer, cookie="") == 403
    finally:
        viewer.stop()
    assert [guard.is_loopback(host) for host in ("127.0.0.2", "::1", "localhost")] == [True] * 3
    assert [guard.is_loopback(host) for host in ("", "0.0.0.0", "::", "robot.lan")] == [False] * 4

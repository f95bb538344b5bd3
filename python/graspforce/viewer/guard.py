"""The check of each request to the viewer: it must hold the token and come from the viewer's own page.

viser serves its page and its WebSocket to anyone who reaches the port, any page in the browser included. The
guard checks each request before viser sees it. viser has no hook for such a check. It calls the public
function ``websockets.asyncio.server.serve``. `guarded` replaces this function while the server starts, and
only for an address of the type `GuardedHost`.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import io
import ipaddress
import logging
import secrets
import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit, urlunsplit

import websockets.asyncio.server as websockets_server
from websockets.frames import Frame, Opcode

from .share import titled

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from .messages import Filter

MAX_MESSAGE_BYTES = 1 << 16
"""Largest size of one message in bytes. Messages of viser's page have a few hundred."""

MAX_CONNECTIONS = 512
"""Largest number of open sockets whose request held the token."""

MAX_HANDSHAKES = 64
"""Largest number of open sockets whose request was refused, or not read yet. A new one closes the oldest."""

_MESSAGES_PER_SECOND = 250
"""Largest rate for one client. Its page sends up to 20 a second for a drag, and 50 for the camera."""

_HANDSHAKE_SECONDS = 2.0
_CLOSE_SECONDS = 0.2

_HEADERS = {
    # The token is in the address of the page: no other site is told of it, no cache keeps it.
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
}

_LOG = logging.getLogger("graspforce.viewer")
# Failed handshakes are the client's mistake, and their text is the client's: no traceback in the terminal.
_LOG.addHandler(logging.NullHandler())
_STARTING = threading.Lock()


class GuardedHost(str):
    """The address a guarded server listens at; its type tells that server from any other in this process."""

    guard: Guard
    __slots__ = ("guard",)


class Guard:
    """The check before a viewer's server.

    Parameters
    ----------
    host : str
        The address to listen at; requests must name it, or a loopback name.
    messages : Filter
        Which messages of clients are passed on.
    title : str, optional
        Title of the page.
    """

    def __init__(self, host: str, messages: Filter, title: str = "graspforce") -> None:
        self.host = host
        self.title = title
        self.token = secrets.token_urlsafe(24)
        self.messages = messages
        self.applied = False
        self._loop: asyncio.AbstractEventLoop | None = None
        self._open: set[_Connection] = set()
        # A dict keeps the order in which they came.
        self._unknown: dict[_Connection, None] = {}

    def address(self, port: int) -> str:
        """Return the page's address with its token; the loopback one where it listens at all addresses."""
        host = {"": "127.0.0.1", "0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.host, self.host)  # noqa: S104 - not bound
        return urlunsplit(("http", f"{_bracketed(host)}:{port}", "/", f"token={self.token}", ""))

    def options(self, given: dict[str, Any]) -> dict[str, Any]:
        """Change viser's options of ``serve`` into guarded ones."""
        self.applied = True
        self._loop = asyncio.get_running_loop()
        return given | {
            "process_request": partial(self._process_request, given["process_request"]),
            "create_connection": partial(_Connection, self),
            "max_size": MAX_MESSAGE_BYTES,
            "open_timeout": _HANDSHAKE_SECONDS,
            "close_timeout": _CLOSE_SECONDS,
            "logger": _LOG,
        }

    def close(self) -> None:
        """Drop all connections at once. A closing handshake with hundreds of clients takes seconds."""

        def abort() -> None:
            for connection in (*self._open, *self._unknown):
                connection.transport.abort()

        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended already
                self._loop.call_soon_threadsafe(abort)

    def opened(self, connection: _Connection) -> None:
        """Count a socket whose request has not been read, and close the oldest beyond the limit."""
        while len(self._unknown) >= MAX_HANDSHAKES:
            oldest = next(iter(self._unknown))
            del self._unknown[oldest]
            oldest.transport.abort()
        self._unknown[connection] = None

    def closed(self, connection: _Connection) -> None:
        """Forget a socket."""
        self._open.discard(connection)
        self._unknown.pop(connection, None)

    def refusal(self, request: Request, local: tuple[str, int]) -> str | None:
        """Say why a request that arrived at the address `local` is refused; None if it is not."""
        port = local[1]
        names = {"127.0.0.1", "localhost", "::1", self.host, local[0].partition("%")[0]}
        # A name that an attacker's DNS server gives to this machine is none of these.
        hosts = {f"{_bracketed(name)}:{port}".lower() for name in names if name}
        if [host.lower() in hosts for host in request.headers.get_all("Host")] != [True]:
            return "the Host header names another server"
        if any(not _is_origin(origin, hosts) for origin in request.headers.get_all("Origin")):
            return "the request comes from another page"
        if not any(self._is_token(given) for given in _tokens(request, port)):
            return "open the address that was printed when the viewer started: it ends with the token"
        return None

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(errors="surrogateescape"), self.token.encode())

    def _process_request(
        self,
        serve_page: Callable[[ServerConnection, Request], Response | None],
        connection: _Connection,
        request: Request,
    ) -> Response | None:
        reason = self.refusal(request, connection.local_address or ("", 0))
        if reason is not None:
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"graspforce: {reason}\n")
        if len(self._open) >= MAX_CONNECTIONS:
            reason = f"{MAX_CONNECTIONS} connections are open; close other pages of this viewer"
            return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, f"graspforce: {reason}\n")
        if connection in self._unknown:
            del self._unknown[connection]
            self._open.add(connection)
        if request.headers.get_all("Upgrade") == ["websocket"]:
            return None
        # What is compressed has no title to replace.
        if "Accept-Encoding" in request.headers:
            del request.headers["Accept-Encoding"]
        response = serve_page(connection, request)
        if response is None:
            return connection.respond(http.HTTPStatus.BAD_REQUEST, "graspforce: not a request for the page\n")
        if response.headers.get("Content-Type", "").startswith("text/html"):
            response.body = titled(response.body.decode(), self.title).encode()
            del response.headers["Content-Length"]
            response.headers["Content-Length"] = str(len(response.body))
        for name, value in _HEADERS.items():
            response.headers[name] = value
        # The page's WebSocket has neither the query of the page nor headers of its own, but it has cookies.
        cookie = f"{_cookie(connection.local_address[1])}={self.token}; HttpOnly; SameSite=Strict; Path=/"
        response.headers["Set-Cookie"] = cookie
        return response


class _Connection(websockets_server.ServerConnection):
    """A connection that passes on the messages that the guard accepts, at a bounded rate."""

    def __init__(self, guard: Guard, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._guard = guard
        self._free_at = 0.0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._guard.opened(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._guard.closed(self)
        super().connection_lost(exc)

    def process_event(self, event: Any) -> None:
        if isinstance(event, Frame) and self._fills_memory(event):
            self.transport.abort()
        else:
            super().process_event(event)

    def _fills_memory(self, frame: Frame) -> bool:
        # Empty pieces of a message that never ends take memory and no part of its size.
        if frame.opcode is Opcode.CONT:
            return not frame.data
        # Answers to pings wait until the client reads them.
        return frame.opcode is Opcode.PING and self.transport.get_write_buffer_size() > MAX_MESSAGE_BYTES

    async def recv(self, decode: bool | None = None) -> Any:
        while True:
            message = await super().recv(decode)
            # Slower reading fills the client's socket, not this machine's memory.
            now = time.monotonic()
            self._free_at = max(self._free_at, now - 1.0) + 1 / _MESSAGES_PER_SECOND
            if self._free_at > now:
                await asyncio.sleep(self._free_at - now)
            if isinstance(message, bytes) and self._guard.messages.accepts(message):
                return message


@contextlib.contextmanager
def guarded(guard: Guard) -> Iterator[GuardedHost]:
    """Guard the viser server that is started inside this context at the yielded address."""
    host = GuardedHost(guard.host)
    host.guard = guard
    with _STARTING:
        serve = websockets_server.serve

        def guarded_serve(handler: Any, host: Any = None, port: Any = None, **options: Any) -> Any:
            if isinstance(host, GuardedHost):
                options = host.guard.options(options)
            return serve(handler, host, port, **options)

        websockets_server.serve = guarded_serve  # type: ignore[misc, assignment] # put back below
        try:
            # viser prints addresses without the token.
            with contextlib.redirect_stdout(io.StringIO()):
                yield host
        finally:
            websockets_server.serve = serve  # type: ignore[misc]


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach the address."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def exposure(host: str) -> str:
    """Return the warning for an address that other machines can reach."""
    return (
        f"the viewer listens at {host}, where other machines can reach it: anyone on the network can see and "
        "move the grasp, because nothing is encrypted, not even the token"
    )


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _is_origin(origin: str, hosts: set[str]) -> bool:
    scheme, _, host = origin.lower().partition("://")
    return scheme == "http" and host in hosts


def _cookie(port: int) -> str:
    # Cookies are shared by all ports of a host.
    return f"graspforce-{port}"


def _tokens(request: Request, port: int) -> Iterator[str]:
    with contextlib.suppress(ValueError):
        yield from parse_qs(urlsplit(request.path).query).get("token", [])
    for cookies in request.headers.get_all("Cookie"):
        for cookie in cookies.split(";"):
            name, _, value = cookie.strip().partition("=")
            if name == _cookie(port):
                yield value

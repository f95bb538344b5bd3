"""A free port to listen at, or an error that names what is taken."""

from __future__ import annotations

import errno
import os
import socket

from graspforce._internal.checks import whole_number
from graspforce.errors import InvalidInputError

DEFAULT_PORT = 8080

_TRIED = 100
"""Ports that are tried from the default one on."""


def free_port(host: str, port: int | None) -> int:
    """Return a port at which `host` can be listened to: the given one, for 0 any, for None the next free one.

    viser itself tries the next ports, and waits forever where the address is not one of this machine.

    Raises
    ------
    InvalidInputError
        The port is taken or not allowed, or the address is not one of this machine.
    """
    if port is not None:
        return _bound(host, whole_number("port", port, least=0, most=65535))
    for candidate in range(DEFAULT_PORT, DEFAULT_PORT + _TRIED):
        try:
            return _bound(host, candidate)
        except _TakenError:
            continue
    return _bound(host, 0)


class _TakenError(InvalidInputError):
    """Another program listens at the port."""


def _bound(host: str, port: int) -> int:
    try:
        found = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as error:
        raise InvalidInputError(
            f"host: {host!r} is no address: {getattr(error, 'strerror', None) or error}"
        ) from None
    for family, *_, address in found:
        try:
            with socket.create_server((address[0], port, *address[2:]), family=family) as bound:
                port = bound.getsockname()[1]
        except OSError as error:
            raise _refusal(host, port, error) from None
    return port


def _refusal(host: str, port: int, error: OSError) -> InvalidInputError:
    if error.errno == errno.EADDRINUSE:
        return _TakenError(f"port: {port} is taken by another program; choose another one, or 0 for any")
    if error.errno in (errno.EACCES, errno.EPERM):
        return InvalidInputError(f"port: {port} is not allowed to this user; choose one above 1023")
    return InvalidInputError(f"host: cannot listen at {host!r}: {os.strerror(error.errno or 0)}")

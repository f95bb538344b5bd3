"""Runs calls under memory limits, in processes forked from one interpreter in which everything is imported.

Reads lines of JSON: the arguments, the call, and the megabytes to try in turn until one suffices. Answers
with a line each: for every room the exit code and what was printed.
"""

import copy
import json
import os
import re
import resource
import signal
import sys
from pathlib import Path

import numpy as np

import graspforce as gf
from graspforce._core import CandidateSearch, TriangleTree

MIB = 1 << 20
PAIR = [(1, 0), (-1, 0.5)], [(-1, 0), (1, 0)]


def around(contacts):
    """Contacts all over a ball, pressing inwards."""
    outward = np.random.default_rng(0).normal(size=(contacts, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    return outward, -outward


def names():
    """Return what arguments and calls may use."""
    grasp = gf.Grasp(*PAIR)
    return {
        "np": np, "gf": gf, "copy": copy, "TriangleTree": TriangleTree, "CandidateSearch": CandidateSearch,
        "around": around, "grasp": grasp, "distributor": gf.ForceDistributor(grasp),
    }  # fmt: skip


def in_child(work):
    """Fork, let the child write into a pipe, and return its exit code and what it wrote."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        os.dup2(writing, 1)
        os.dup2(writing, 2)
        signal.alarm(60)
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - told to the parent
            os.write(2, f"{type(error).__name__} {error}".encode()[:2000])
            os._exit(1)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        written = pipe.read()
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), written.decode(errors="replace")


def limited(call, known, room):
    """Make the call with so many megabytes beside what the process uses already."""
    # The threads of this process, which take address space too.
    positions, normals = np.array(PAIR, float)
    gf.quality_many(positions[None], normals[None])
    used = int(re.search(r"VmSize:\s*([0-9]+)", Path("/proc/self/status").read_text("ascii"))[1]) * 1024
    resource.setrlimit(resource.RLIMIT_AS, (used + room * MIB,) * 2)
    try:
        eval(call, known)
        told = "answered"
    except MemoryError as error:
        told = f"{type(error).__name__} {error}"
    # The process goes on.
    assert known["grasp"].quality().closure in ("force", "partial", "none")
    os.write(1, told.encode())


def tried(given, call, rooms):
    """Compute the arguments once, then make the call with each room in a process of its own."""
    known = names()
    known["given"] = eval(given, known)
    for room in rooms:
        code, told = in_child(lambda room=room: limited(call, known, room))
        os.write(1, json.dumps([room, code, told]).encode() + b"\n")
        if told == "answered":
            break


def main():
    for line in sys.stdin:
        given, call, rooms = json.loads(line)
        code, told = in_child(lambda given=given, call=call, rooms=rooms: tried(given, call, rooms))
        found = [json.loads(row) for row in told.splitlines()] if code == 0 else [[0, code, told]]
        sys.stdout.write(json.dumps(found) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()

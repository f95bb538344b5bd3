"""The comparison with other software: its verdicts, and that what it wrote belongs together."""

import importlib
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from benches.compare import certificates, page, table
from benches.compare.asking import Answers
from benches.compare.problems import any_grasps, closed_grasps
from benches.compare.timing import Apart, Call, Measured, UnsolvedError, measure

import graspforce as gf

ROOT = Path(__file__).parents[3]


def asked(peer):
    """Ask for the squares of 0 to 199, by this library and by the peer."""
    ours = Call("ours", "graspforce", lambda: lambda x: x * x, 1e-9, reference=True)
    measured = measure([ours, Call("peer", "peer", lambda: peer, 1e-6)], list(range(200)))
    return Answers("squares", measured, measured[0].answers)


def unsolved_above_100(x):
    if x > 100:
        raise UnsolvedError
    return x * x


def test_scipy_agrees_on_every_question():
    command = [sys.executable, "-m", "benches.compare", "--quick", "--peers", "scipy"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("\n| SciPy Qhull |") == 8
    assert done.stdout.count("\n| SciPy linprog (HiGHS) |") == 4
    assert "not run" not in done.stdout


def test_a_peer_that_cannot_be_imported_is_shown_with_the_reason():
    calls = [
        Call("ours", "graspforce", lambda: abs, 1e-9, reference=True),
        Call("absent", "absent", lambda: importlib.import_module("absent"), 1e-9),
    ]
    measured = measure(calls, [1.0, 2.0])
    lines = "\n".join(table.rows(Answers("magnitudes", measured, measured[0].answers)))
    assert "| absent | not run: ModuleNotFoundError: No module named 'absent' |" in lines


def answering():
    return unsolved_above_100


def dying_once(flag):
    def ask(x):
        if x == 150 and not flag.exists():
            flag.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return unsolved_above_100(x)

    return ask


def dying():
    return lambda _: os.kill(os.getpid(), signal.SIGKILL)


def test_a_peer_apart_answers_as_one_in_this_process_and_may_die(tmp_path, monkeypatch):
    monkeypatch.setattr(Apart, "LIVES", 3)
    calls = [Call("here", "peer", answering, 1e-6)]
    makes = (partial(dying_once, tmp_path / "died"), dying)
    calls += [Call("apart", "peer", make, 1e-6, apart=True) for make in makes]
    here, apart, dead = measure(calls, list(range(200)))
    np.testing.assert_array_equal(apart.answers, here.answers)
    assert (apart.unsolved, apart.deaths, len(apart.seconds)) == (99, 1, 199)
    assert all(apart.seconds > 0)
    assert dead.failure == "ChildProcessError: died 3 times, at last with exit code -9"


def test_ratios_are_of_the_problems_that_both_were_asked():
    ours = Call("ours", "graspforce", lambda: abs, 0, reference=True)
    slow = Call("slow", "peer", lambda: abs, 0)
    base = Measured(ours, np.array([1.0, 1.0, 5.0, 5.0, 5.0]), np.arange(5.0))
    few = Measured(slow, np.array([3.0, 3.0]), np.arange(2.0))
    assert table.longer(few, base) == 3
    assert table.longer(base, few) == pytest.approx(1 / 3)
    block = replace(few, call=replace(slow, whole=True), seconds=np.array([4.0]), answers=np.arange(5.0))
    assert table.longer(block, base) == pytest.approx(4 / 5)


def test_the_readme_shows_the_headline_of_the_page():
    pattern = re.compile(re.escape(page.BEGIN) + ".*?" + re.escape(page.END), re.DOTALL)
    blocks = [pattern.findall(path.read_text()) for path in (page.README, page.PAGE)]
    assert [len(found) for found in blocks] == [1, 1]
    assert blocks[0] == blocks[1]
    assert blocks[0][0].count("\n|") > 8


@pytest.mark.parametrize(
    ("peer", "count"), [(lambda x: x * x, 0), (lambda x: x * x * (1 + 1e-5), 199), (unsolved_above_100, 0)]
)
def test_answers_beyond_their_tolerance_disagree_and_unsolved_ones_do_not(peer, count):
    answers = asked(peer)
    assert table.disagreements(answers, answers.measured[1]) == count


def test_a_refuted_answer_does_not_disagree():
    answers = asked(lambda x: x * x + (x == 7))
    assert table.disagreements(answers, answers.measured[1]) == 1
    answers.refuted = lambda number, _answer: number == 7
    assert table.disagreements(answers, answers.measured[1]) == 0
    assert "1 refuted" in "\n".join(table.rows(answers))


def test_a_faster_peer_is_named():
    answers = asked(lambda x: x * x)
    answers.measured[0].seconds *= 1000
    lines = list(table.better(answers))
    assert [("median" in line, "p99" in line) for line in lines] == [(True, False), (False, True)]
    assert float(table.ratio(answers, answers.measured[1])) < 1


def test_a_failing_peer_is_shown_and_the_rest_goes_on():
    def broken(x):
        message = f"no square of {x}"
        raise ArithmeticError(message)

    answers = asked(broken)
    assert "not run: ArithmeticError: no square of 0" in "\n".join(table.rows(answers))
    assert len(answers.measured[0].answers) == 200


def test_closure_is_proven_one_way_only():
    grasps = any_grasps(19, 60, 8)
    closed = [contacts.grasp.is_force_closure for contacts in grasps]
    assert 10 < sum(closed) < 50
    for contacts, said in zip(grasps, closed, strict=True):
        assert certificates.closure_is(contacts, said)
        assert not certificates.closure_is(contacts, not said)


def test_only_other_answers_than_the_least_maximum_are_refuted():
    grasp = closed_grasps(3, 1, 4, 8)[0].grasp
    distributor = gf.ForceDistributor(grasp, "max")
    for external in np.random.default_rng(1).normal(size=(50, 6)):
        least = distributor.solve(external).sigma_max
        refuted = [
            certificates.least_maximum_is_not(distributor, external, least * (1 + change))
            for change in (-1e-6, 0, 1e-6)
        ]
        assert refuted == [True, False, True]

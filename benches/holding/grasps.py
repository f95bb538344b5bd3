"""Grasps of an object by a hand: the planned one, poses near it, and random poses that touch."""

import numpy as np

from graspforce.errors import GraspForceError
from graspforce.hands import plan_hand
from graspforce.hands.candidates import measured
from graspforce.hands.distances import Distances
from graspforce.hands.grasp_problem import PUSHES, GraspProblem
from graspforce.hands.grasped_object import grasped_object
from graspforce.hands.kinematics import HandKinematics, Poses
from graspforce.hands.plan_making import Maker
from graspforce.hands.poses import quaternion_of
from graspforce.hands.search import Search
from graspforce.hands.seeds import palm_seeds
from graspforce.hands.snap import SnapOptions, snap

# Every grasp presses each finger with 2 N where torques allow it, within friction divided by this.
MARGIN, PRELOAD = 1.2, 2.0
NEAR, FAR = 0.05, 0.3  # rad: deviations of perturbed joints and palms
PALM = 0.06  # m per rad of these
TRIED = 24  # poses a time


class GraspMaker:
    """Makes grasps of one object by one hand, and counts the poses that are none."""

    def __init__(self, hand, mesh, seed):
        self.hand, self.mesh = hand, mesh
        problem = GraspProblem.of(
            grasped_object(mesh), friction=0.6, torsion=0.02, criterion="max", external_wrench=None,
            preload=PRELOAD, friction_margin=MARGIN,
        )  # fmt: skip
        self.problem = problem
        self.distances = Distances(HandKinematics(hand, problem.grasped, tuple(range(hand.num_fingers))))
        self.rng = np.random.default_rng(seed)
        self.counts = Search(self.distances, problem, seed, np.inf).counts
        self.maker = Maker(self.distances, problem, PUSHES, 0.01)

    def planned(self):
        """Return the plan of `plan_hand`, or None."""
        try:
            # A search that tries its plans in simulation would leave out those that fail.
            options = {"friction_margin": MARGIN, "preload": PRELOAD, "simulate": False}
            return plan_hand(self.hand, self.mesh, **options).best
        except GraspForceError as error:
            print(f"    no plan: {error}")
            return None

    def near(self, plan, count):
        """Return up to `count` grasps from random moves of a plan."""
        middle = Poses(
            plan.palm[None, :3, 3],
            quaternion_of(plan.palm[:3, :3])[None],
            plan.joints[None, self.hand.driven],
        )
        size = self.distances.kinematics.size
        deviations = np.repeat([PALM, 1.0, 1.0], [3, 3, size - 6])

        def poses():
            step = self.rng.uniform(NEAR, FAR, size=(TRIED, 1)) * self.rng.normal(size=(TRIED, size))
            return middle[[0] * TRIED].moved(step * deviations, self.hand.driven_limits)

        return self._kept(poses, count, posture=0.0)

    def random(self, count):
        """Return up to `count` grasps from random palms, whatever their quality."""
        return self._kept(
            lambda: palm_seeds(self.distances, self.problem, self.rng, 3 * TRIED, TRIED), count, posture=0.02
        )

    def _kept(self, poses, count, posture):
        kept = []
        for _ in range(8):
            found = measured(
                self.distances, self.problem,
                snap(self.distances, poses(), SnapOptions(posture=posture)), None,
            )  # fmt: skip
            for row in self.rng.permutation(np.flatnonzero(found.usable(None))):
                plan = self.maker.plan(found, int(row), self.hand, self.counts)
                kept += [] if plan is None else [plan]
                if len(kept) == count:
                    return kept
        return kept

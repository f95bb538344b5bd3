"""Plan files that name a mesh: contacts anywhere on it, from many starts."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from graspforce._internal.to_dict import ReadOnly
from graspforce.errors import GraspForceError, InvalidFileError, InvalidGraspError, InvalidInputError
from graspforce.planning import Iterate, plan_multistart, refine
from graspforce.planning.contacts_on_mesh import MeshLengths
from graspforce.planning.distinct import default_distance, distinct_plans
from graspforce.planning.problem import deadline_after
from graspforce.surfaces import MeshSurface, contacts_on

from .contacts_on_mesh import load_surface, mesh_path
from .schema import MeshPlanModel

if TYPE_CHECKING:
    from pathlib import Path

    from graspforce.planning import Plan, PlanSet, Refinement
    from graspforce.planning.progress import Report
    from graspforce.typing import Criterion, Stopped

    from .schema import MeshModel
    from .yaml_document import Document

_BRACKET = 1e-4
"""Narrow enough to tell grasps apart while the search runs."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshPlanFile(ReadOnly):
    """A planning problem on a mesh from a file.

    Threads may share it; it can be copied and pickled.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    name : str
        Its title, or the name of the file.
    mesh : pathlib.Path
        File of the mesh.
    mesh_options : dict
        Other fields of the mesh, as for `graspforce.surfaces.MeshSurface`.
    surface : MeshSurface
        Surface of the mesh.
    num_contacts : int
        Number of contacts.
    search : dict
        ``step``, ``tolerance``, ``starts``, ``best``, ``min_distance``, ``seed`` and ``time_limit`` of
        `graspforce.plan_multistart`.
    refined : bool
        Whether the grasps kept are refined by gradients.
    grasp_options : dict
        Other options of the contacts, as for `graspforce.Grasp`.
    """

    path: Path
    name: str
    mesh: Path
    mesh_options: dict[str, Any]
    surface: MeshSurface
    num_contacts: int
    search: dict[str, Any]
    refined: bool
    grasp_options: dict[str, Any]

    @property
    def num_searches(self) -> int:
        """Number of searches and refinements."""
        return int(self.search["starts"] + (self.search["best"] if self.refined else 0))

    def plan(self, criterion: Criterion = "max", *, progress: Report | None = None) -> PlanSet:
        """Search for the best grasps by `graspforce.plan_multistart` and `graspforce.refine`.

        Returns
        -------
        PlanSet
            The best distinct grasps, best first. The last iterate of a refined grasp is its refinement.
            When time is over or Ctrl-C is pressed, the grasp that is being refined keeps what it gained, and
            those after it stay as they were found. A grasp whose refinement fails keeps what it reached, and
            is among the failures.
        """
        began, deadline = time.monotonic(), deadline_after(self.search["time_limit"])
        surface = contacts_on(*[self.surface] * self.num_contacts)
        bounds = np.tile(self.surface.bounds, (self.num_contacts, 1))
        options: dict[str, Any] = {"criterion": criterion, **self.grasp_options}
        steps = self.num_searches
        report: Any = progress and (lambda done, _, epsilon: progress(done, steps, epsilon))
        try:
            found = plan_multistart(
                surface, bounds, rtol=_BRACKET, progress=report or False, **self.search, **options
            )
        except (InvalidInputError, InvalidGraspError) as error:
            raise of_file(self.path, error) from error
        if not self.refined or found.stopped == "interrupted":
            return found
        plans, failures = list(found.plans), dict(found.failures)
        stopped: Stopped = found.stopped
        try:
            for at, plan in enumerate(found.plans):
                left = deadline - time.monotonic()
                if left <= 0:
                    stopped = "time"
                    break
                better: Refinement | None
                try:
                    better = refine(
                        surface, plan.params, bounds, min_distance=self.search["min_distance"],
                        time_limit=left, **options,
                    )  # fmt: skip
                except GraspForceError as error:
                    failures.setdefault(_start_of(plan, found), f"refinement: {error}")
                    better = cast("Refinement | None", error.partial)
                if better is not None:
                    plans[at] = _refined(plan, better)
                    if better.stopped in ("time", "interrupted"):
                        stopped = cast("Stopped", better.stopped)
                        break
                if report is not None:
                    report(self.search["starts"] + at + 1, steps, plans[at].quality.epsilon)
        except KeyboardInterrupt:
            stopped = "interrupted"
        plans.sort(key=lambda plan: plan.quality.rho)
        # Two may have become one.
        same = default_distance(surface(found.starts)[0])
        kept = distinct_plans(plans, len(plans), same, interchangeable=True)
        seconds = time.monotonic() - began
        return replace(found, plans=tuple(kept), failures=failures, stopped=stopped, seconds=seconds)


def mesh_problem(document: Document) -> MeshPlanFile:
    """Check a plan file's document that names a mesh, and read the mesh."""
    model = document.parsed(MeshPlanModel)
    surface = load_surface(document, model.mesh)
    lengths = MeshLengths.of(surface, model.contacts)
    step = model.step or lengths.step
    return MeshPlanFile(
        document.path,
        model.name or document.path.name,
        mesh_path(document, model.mesh),
        _options(model.mesh),
        surface,
        model.contacts,
        {
            "step": step,
            "tolerance": model.tolerance or step / 10,
            "starts": model.starts,
            "best": model.best,
            "min_distance": lengths.min_distance if model.min_distance is None else model.min_distance,
            "seed": model.seed,
            "time_limit": model.time_limit,
        },
        model.refine,
        {
            "friction": model.friction,
            "max_normal_force": model.max_normal_force,
            "edges": model.edges,
            "torsion": model.torsion or None,
            **lengths.grasp_options,
            **({} if model.length_scale is None else {"length_scale": model.length_scale}),
            "friction_margin": model.friction_margin,
            **({} if model.origin is None else {"origin": model.origin}),
        },
    )


def of_file(path: Path, error: InvalidInputError | InvalidGraspError) -> InvalidFileError:
    """Return the error of a search as one of the file that asked for it, with what was found."""
    located = InvalidFileError(path, str(error))
    located.partial = error.partial
    return located


def _start_of(plan: Plan, found: PlanSet) -> int:
    return int(np.flatnonzero((found.starts == plan.history[0].params).all(axis=1))[0])


def _refined(plan: Plan, better: Refinement) -> Plan:
    last = Iterate(better.params, better.quality.rho, plan.history[-1].step)
    history = (*plan.history, last)
    return replace(plan, params=better.params, quality=better.quality, grasp=better.grasp, history=history)


def _options(mesh: MeshModel) -> dict[str, Any]:
    return mesh.model_dump(exclude={"file"}, exclude_defaults=True)

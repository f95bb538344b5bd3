"""``graspforce plan`` on a mesh: the best few grasps of many searches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .output import print_json, print_table, save, save_best, vector
from .progress import progress

if TYPE_CHECKING:
    from pathlib import Path

    from graspforce.files import MeshPlanFile
    from graspforce.planning import PlanSet
    from graspforce.typing import Criterion


def plan_on_mesh(
    file: MeshPlanFile, criterion: Criterion, *, as_json: bool, out: Path | None, plot: Path | None
) -> None:
    """Plan, and print, write and draw the result."""
    with progress("planning", file.num_searches) as done:
        found = file.plan(criterion, progress=lambda count, _, __: done(count))
    if as_json:
        print_json({"file": str(file.path), **found.to_dict()})
    else:
        _print(file, found, criterion)
    best = found.best.grasp
    if out is not None:
        save_best(out, best, name=file.name, mesh=file.mesh, mesh_options=file.mesh_options)
    if plot is not None:
        from graspforce.plotting import quality_figure  # noqa: PLC0415 - matplotlib only where it is asked for

        mesh = (file.surface.vertices, file.surface.faces)
        save(quality_figure(found.best.quality, title=file.name, mesh=mesh), plot)


def _print(file: MeshPlanFile, found: PlanSet, criterion: Criterion) -> None:
    options = file.grasp_options
    origin = vector(options["origin"], options["length_scale"])
    rows = [
        (str(k), f"{q.epsilon:.9g}", f"{q.upper - q.lower:.1e}", q.closure)
        for k, q in enumerate((plan.quality for plan in found.plans), start=0)
    ]
    searched = int(np.isfinite(found.epsilon).sum())
    title = f"{file.name}: {file.num_contacts} contacts, {searched} of {len(found.starts)} searches ended"
    print_table(title, ("grasp", f"epsilon_{criterion} (N)", "proven within (N)", "closure"), rows)
    best = found.best.grasp
    places = [
        (str(i), vector(position), vector(normal))
        for i, (position, normal) in enumerate(zip(best.positions, best.normals, strict=True))
    ]
    print_table("best grasp", ("contact", "position (m)", "normal"), places)
    print(f"length scale {options['length_scale']:.4g} m, torques about {origin} m")
    if found.stopped != "tolerance":
        print(f"stopped by {found.stopped}")

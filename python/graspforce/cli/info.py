"""``graspforce info``."""

from __future__ import annotations

import importlib.metadata
import platform
from typing import Annotated, Literal

import typer
from pydantic import BaseModel

from graspforce.files.schema import GraspModel, MeshPlanModel, PlanModel

from .output import AsJson, print_json, print_table

_PACKAGES = (
    "numpy",
    "scipy",
    "matplotlib",
    "trimesh",
    "manifold3d",
    "viser",
    "mujoco",
    "drake",
    "pin",
    "pyarrow",
    "dask",
)


_MODELS: dict[str, type[BaseModel]] = {"grasp": GraspModel, "plan": PlanModel, "mesh-plan": MeshPlanModel}


def info(
    schema: Annotated[
        Literal["grasp", "plan", "mesh-plan"] | None,
        typer.Option(help="Print the JSON Schema of grasp, plan or mesh-plan files instead."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the versions of graspforce and of the packages it uses, or the schema of its input files.

    Example: `graspforce info --schema grasp > grasp.schema.json`
    """
    if schema is not None:
        print_json(_MODELS[schema].model_json_schema())
        return
    versions = {"graspforce": _version("graspforce"), "python": platform.python_version()}
    versions |= {package: _version(package) for package in _PACKAGES}
    if as_json:
        print_json({"versions": versions, "platform": platform.platform()})
    else:
        rows = ((name, version or "not installed") for name, version in versions.items())
        print_table(platform.platform(), ("package", "version"), rows)


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None

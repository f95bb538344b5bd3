"""Files of grasps, planning problems and wrenches, read without trusting them.

Needs the ``cli`` extra. Only regular files are read, of limited size; YAML and JSON hold plain data,
NumPy files no pickles, and a mesh lies beside the file that names it.
Whatever is wrong is an `graspforce.InvalidFileError` that names file, line and field.
"""

from .grasps import GraspFile, load_grasp
from .mesh_problems import MeshPlanFile
from .meshes import load_mesh
from .problems import PlanFile, load_problem
from .wrenches import WrenchFile, load_wrenches, parse_wrench
from .writing import save_grasp

__all__ = [
    "GraspFile",
    "MeshPlanFile",
    "PlanFile",
    "WrenchFile",
    "load_grasp",
    "load_mesh",
    "load_problem",
    "load_wrenches",
    "parse_wrench",
    "save_grasp",
]

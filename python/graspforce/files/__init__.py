"""Files of grasps, planning problems and wrenches, read without trusting them.

Needs the ``cli`` extra. Only regular files of limited size are read. YAML and JSON hold plain data, NumPy
files hold no pickles, and a mesh lies beside the file that names it. A wrong file raises
`graspforce.InvalidFileError` with file, line and field.

- `grasp_file`, `plan_file`, `mesh_plan_file`, `wrench_file`, `save_grasp`: one kind of file each; `schema`:
  their fields.
- `contacts_on_mesh`: contacts of a file on its mesh, which `graspforce.surfaces` reads.
- `yaml_document`: YAML and JSON with lines; `reasons`: error messages about fields.
"""

from graspforce.surfaces.mesh_file import load_mesh

from .grasp_file import GraspFile, load_grasp
from .mesh_plan_file import MeshPlanFile
from .plan_file import PlanFile, load_problem
from .save_grasp import save_grasp
from .wrench_file import WrenchFile, load_wrenches, parse_wrench

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

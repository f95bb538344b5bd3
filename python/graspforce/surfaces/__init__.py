"""Where contacts can go: planar curves, surfaces in space, meshes, and arrangements of contacts on them.

A curve maps parameters (B,) to points and unit normals (B, 2), a surface (B, 2), a mesh points in space (B,
3). `contacts_on` puts one contact on each of several; `tied` and `mirrored` make contacts depend on each
other. `graspforce.plan` takes any function of this form, not only these surfaces.

- `curves`, `parametric`: curves and surfaces; `finite_differences`: their normals; `contact_layouts`:
  arrangements.
- `mesh_file`, `triangles`, `scene_file`: meshes of files, read within limits.
- `mesh`: `MeshSurface`; `mesh_checks`: its checks; `mesh_parts` and `mesh_union`: its parts and the boundary
  of their union; `mesh_normals`; `mesh_sharpness`: places too sharp for a contact.
"""

from .contact_layouts import Arrangement, contacts_on, mirrored, tied
from .curves import PlanarCurve, ellipse, line
from .mesh import MeshSurface
from .parametric import ParametricSurface, cylinder, ellipsoid, plane

__all__ = [
    "Arrangement",
    "MeshSurface",
    "ParametricSurface",
    "PlanarCurve",
    "contacts_on",
    "cylinder",
    "ellipse",
    "ellipsoid",
    "line",
    "mirrored",
    "plane",
    "tied",
]

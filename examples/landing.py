"""The first lines of the documentation, whose output stands beside them."""

import graspforce as gf

# Three fingers around a cup: metres, newtons, normals into the object.
positions = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0)]
normals = [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0)]
grasp = gf.Grasp(positions, normals, max_normal_force=20, length_scale=0.04)
print(grasp.quality("max"))
print(gf.ForceDistributor(grasp).solve([0, 0, -5, 0, 0, 0]))

"""Plan files that several tests read."""

SURFACES = """
edges: 6
contacts:
  - surface: {kind: plane, start: [0, 0, 0.1], u: [1, 0, 0], v: [0, 1, 0], object_side: against}
    initial: [0, 0.01]
    step: 0.02
    tolerance: [0.01, 0.005]
    bounds: [[-0.05, 0.05], [-0.04, 0.04]]
  - surface: {kind: ellipsoid, semi_x: 0.05, semi_y: 0.05, semi_z: 0.1}
    initial: [0, -1]
    step: [0.5, 0.4]
    tolerance: 0.1
    bounds: [[-3, 3], [-1.5, 0]]
  - surface: {kind: cylinder, radius: 0.05}
    initial: [3, 0]
    step: 0.4
    tolerance: 0.1
    bounds: [[1, 5], [-0.05, 0.05]]
"""

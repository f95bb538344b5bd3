"""A robot on three feet puts down the fourth one in MuJoCo: its force limit is raised at once, or as a ramp.

Usage: python fourth_foot.py

Needs graspforce[mujoco].
"""

import mujoco
import numpy as np

import graspforce as gf

MASS, FOOT_MASS = 12.0, 0.1
GRAVITY = np.array([0, 0, -9.81, 0, 0, 0])
HEIGHT, RADIUS = 0.3, 0.02
FEET = np.array([(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)])
CENTRE = np.array([0.06, 0.04, HEIGHT])  # of mass: between the first three feet
LIMIT = 100.0
LAST = 3  # the foot that comes down
FREQUENCY = 15.0  # rad/s of the closed loop


def model() -> mujoco.MjModel:
    """Return a body on four feet, each moved by three motors; the last foot is 2 cm above the floor."""
    feet, motors = "", ""
    for i, (x, y) in enumerate(FEET):
        joints = "".join(
            f'<joint name="{i}{axis}" type="slide" axis="{direction}" damping="2"/>'
            for axis, direction in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), strict=True)
        )
        z = RADIUS - HEIGHT + (0.02 if i == LAST else 0.0)
        ball = f'<geom name="foot{i}" type="sphere" size="{RADIUS}" mass="{FOOT_MASS}"/>'
        feet += f'<body pos="{x} {y} {z}">{joints}{ball}</body>'
        motors += "".join(f'<motor joint="{i}{axis}"/>' for axis in "xyz")
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="0.0005" cone="elliptic" impratio="100" integrator="implicitfast"/>
      <default><geom solref="0.005 1" friction="0.8"/></default>
      <worldbody>
        <geom name="floor" type="plane" size="2 2 1"/>
        <body name="trunk" pos="0 0 {HEIGHT}">
          <freejoint/>
          <inertial pos="{CENTRE[0]} {CENTRE[1]} 0" mass="{MASS}" diaginertia="0.2 0.4 0.5"/>
          {feet}
        </body>
      </worldbody>
      <actuator>{motors}</actuator>
    </mujoco>""")


def largest_jump(grasp: gf.Grasp, contact: int, step: float) -> float:
    """Return how far the forces of "squares" move when one limit changes by ``step`` (N).

    The bound is on the norm of the change of all forces together. It holds while the
    other contacts stay inside their cones and limits.
    """
    matrix = grasp.grasp_matrix
    internal = np.eye(matrix.shape[1]) - np.linalg.pinv(matrix) @ matrix
    own = slice(3 * contact, 3 * contact + 3)
    smallest = np.linalg.eigvalsh(internal[own, own])[0]
    return step * np.hypot(1, grasp.friction[contact]) / np.sqrt(smallest)


def touch_down(step: float, seconds: float = 1.5) -> float:
    """Raise the limit of the last foot by ``step`` (N) a tick from when it touches the floor.

    Returns the largest change of the forces in a tick (N).
    """
    simulated = model()
    data = mujoco.MjData(simulated)
    mujoco.mj_forward(simulated, data)
    feet = np.column_stack([FEET, np.zeros(4)])
    grasp = gf.Grasp(feet, [(0, 0, 1)] * 4, friction=0.6, max_normal_force=LIMIT, edges=None, origin=CENTRE)
    legs = gf.ForceDistributor(grasp, "squares", limits=True)
    total = MASS + 4 * FOOT_MASS
    inertia = np.array([total, total, total, 0.2, 0.4, 0.5])
    lifted, touching = simulated.geom(f"foot{LAST}").id, False
    limits = np.full(4, LIMIT)
    limits[LAST] = 0.0
    last, jumps = None, []
    for tick in range(round(1000 * seconds)):
        touching = touching or any(lifted in (contact.geom1, contact.geom2) for contact in data.contact)
        if touching:
            limits[LAST] = min(LIMIT, limits[LAST] + step)
        legs.set_limits(limits)
        turned = np.empty(3)
        mujoco.mju_quat2Vel(turned, data.qpos[3:7], 1.0)
        error = np.concatenate([data.qpos[:3] - (0, 0, HEIGHT), turned])
        wanted = -(FREQUENCY**2) * error - 2 * FREQUENCY * data.qvel[:6]
        forces = legs.nearest(inertia * (GRAVITY - wanted)).forces
        motors = -forces @ grasp.frames[0]  # the same frame at every foot
        motors[:, 2] -= FOOT_MASS * GRAVITY[2]
        if not touching:
            # The foot comes down at 4 cm/s from a quarter of a second on.
            down = np.array([0, 0, -0.04 * max(0.0, tick / 1000 - 0.25)])
            own = slice(7 + 3 * LAST, 10 + 3 * LAST)
            motors[LAST] += 1000 * (down - data.qpos[own]) - 20 * data.qvel[6 + 3 * LAST : 9 + 3 * LAST]
        data.ctrl[:] = motors.ravel()
        mujoco.mj_step(simulated, data, 2)
        if touching:
            jumps.append(np.linalg.norm(forces - last))
        last = forces
    return max(jumps)


def main() -> None:
    feet = gf.Grasp(np.column_stack([FEET, np.zeros(4)]), [(0, 0, 1)] * 4, friction=0.6, edges=None)
    print("limit raised by    largest change of the forces in a tick      bound")
    for step in (LIMIT, 2.0, 0.5):
        print(f"{step:5g} N a tick {touch_down(step):40.3f} N {largest_jump(feet, LAST, step):8.3f} N")


if __name__ == "__main__":
    main()

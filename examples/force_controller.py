"""Hold an object by four force-controlled fingers in MuJoCo, with forces chosen in five ways.

Usage: python force_controller.py [--seconds 10] [--plot FILE]

The grasp and the load are those of Fig. 6 in Zheng and Qian (2006). Needs graspforce[mujoco], and matplotlib
for the picture.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

import graspforce as gf
from graspforce.paper import TILE, TILE_WRENCHES
from graspforce.paper.tile import INFERRED_FRICTION, tile_grasp

MASS, INERTIA = 1.0, (0.0134, 0.0134, 0.0267)  # kg, kg m^2
FRICTION = 0.72  # of the simulation; the controller counts on 0.68
FINGERTIP = 0.005  # radius in m
LOST = 0.02  # m

Distribute = Callable[[np.ndarray], np.ndarray]


@dataclass
class Controller:
    """Forces of the fingers that keep an object in its place, at 1 kHz.

    ``distribute`` maps an external wrench (6,) to contact forces (m, 3).
    """

    grasp: gf.Grasp
    distribute: Distribute
    inertia: np.ndarray  # (6,) mass three times, then the moments of inertia
    frequency: float = 30.0  # rad/s of the closed loop, which is critically damped

    def forces(self, pose: np.ndarray, velocity: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Return the contact forces (m, 3) in the contact frames.

        ``pose`` is a position and a quaternion, ``velocity`` that of MuJoCo's free
        joint. ``load`` is the external wrench in world axes, as known or estimated.
        """
        to_object = rotation(pose).T
        turned = np.empty(3)
        mujoco.mju_quat2Vel(turned, pose[3:], 1.0)
        error = np.concatenate([to_object @ pose[:3], turned])
        rate = np.concatenate([to_object @ velocity[:3], velocity[3:]])
        acceleration = -(self.frequency**2) * error - 2 * self.frequency * rate
        load = np.concatenate([to_object @ load[:3], to_object @ load[3:]])
        return self.distribute(load - self.inertia * acceleration)

    def motors(self, pose: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Turn contact forces into those of the motors (3 m,) in world axes."""
        in_object = np.einsum("mk,mkj->mj", forces, self.grasp.frames)
        return (in_object @ rotation(pose).T).ravel()


def rotation(pose: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of a pose: object axes to world axes."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, pose[3:])
    return matrix.reshape(3, 3)


def strategies(grasp: gf.Grasp, loads: np.ndarray) -> dict[str, Distribute]:
    """Return the ways to choose forces, by name."""
    largest, total = (gf.ForceDistributor(grasp, objective) for objective in ("max", "sum"))
    squares = gf.ForceDistributor(grasp, "squares", limits=True)
    # What most controllers do: the least squares of the pseudoinverse and a fixed internal force.
    inverse = np.linalg.pinv(grasp.grasp_matrix)
    squeeze = gf.ForceDistributor(grasp, "squares", min_normal=1.0).solve(np.zeros(6)).forces
    effort = largest.solve_many(loads).sigma_sum.mean()
    needed = (loads @ -inverse.T).reshape(len(loads), -1, 3)[:, :, 0] / grasp.max_normal_force
    share = squeeze[:, 0] / grasp.max_normal_force

    def squeezing(effort: float) -> Distribute:
        constant = (effort - needed.sum(axis=1).mean()) / share.sum() * squeeze
        return lambda load: (-inverse @ load).reshape(-1, 3) + constant

    return {
        "least maximum": lambda load: largest.nearest(load, limits=False).forces,
        "least sum": lambda load: total.nearest(load, limits=False).forces,
        "squares": lambda load: squares.nearest(load).forces,
        "constant squeeze, equal effort": squeezing(effort),
        "constant squeeze, 1.4 x the effort": squeezing(1.4 * effort),
    }


def model(grasp: gf.Grasp) -> mujoco.MjModel:
    """Return the object with a small plate at each contact, and a ball on three motors as each fingertip."""
    plates, fingers, motors = "", "", ""
    for i, (tip, normal, frame) in enumerate(zip(grasp.positions, grasp.normals, grasp.frames, strict=True)):
        axes = text(np.concatenate([frame[1], frame[2]]))
        plates += f'<geom class="plate" pos="{text(tip + 0.005 * normal)}" xyaxes="{axes}"/>'
        joints = "".join(
            f'<joint name="{i}{axis}" type="slide" axis="{direction}" damping="1"/>'
            for axis, direction in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), strict=True)
        )
        ball = f'<geom class="fingertip" size="{FINGERTIP}"/>'
        fingers += f'<body pos="{text(tip - FINGERTIP * normal)}">{joints}{ball}</body>'
        motors += "".join(f'<motor joint="{i}{axis}"/>' for axis in "xyz")
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="0.0005" gravity="0 0 0" cone="elliptic" impratio="100" integrator="implicitfast"/>
      <default>
        <geom solref="0.005 1" friction="{FRICTION}" conaffinity="0" contype="0"/>
        <default class="plate"><geom type="box" size="0.02 0.02 0.005" mass="0" conaffinity="1"/></default>
        <default class="fingertip"><geom type="sphere" mass="0.02" contype="1"/></default>
      </default>
      <worldbody>
        <body name="object">
          <freejoint/>
          <inertial pos="0 0 0" mass="{MASS}" diaginertia="{text(INERTIA)}"/>
          {plates}
        </body>
        {fingers}
      </worldbody>
      <actuator>{motors}</actuator>
    </mujoco>""")


def text(numbers: np.ndarray | tuple[float, ...]) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def simulate(controller: Controller, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (T, 3) of the object and contact forces (T, m, 3) until it is lost, or to the end."""
    simulated = model(controller.grasp)
    data = mujoco.MjData(simulated)
    positions, forces = [], []
    for load in loads:
        pose, velocity = data.qpos[:7].copy(), data.qvel[:6].copy()
        positions.append(pose[:3])
        if np.linalg.norm(pose[:3]) > LOST:
            break
        forces.append(controller.forces(pose, velocity, load))
        data.ctrl[:] = controller.motors(pose, forces[-1])
        data.body("object").xfrc_applied[:] = load
        mujoco.mj_step(simulated, data, 2)
    return np.array(positions), np.array(forces)


def main() -> None:
    """Simulate every strategy, print what it did, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--plot", metavar="FILE", help="draw the object's motion and the shares into FILE")
    options = parser.parse_args()
    grasp = tile_grasp(TILE.published["max"].params, INFERRED_FRICTION, edges=None)
    loads = TILE_WRENCHES[6].at(np.arange(round(1000 * options.seconds)) / 1000)
    runs = {}
    print(f"{'':34} {'error':>9} {'greatest':>9} {'mean':>7} {'change of a force':>18}")
    print(f"{'forces':34} {'(mm)':>9} {'share':>9} {'effort':>7} {'in a tick (N)':>18}")
    for name, distribute in strategies(grasp, loads).items():
        controller = Controller(grasp, distribute, np.array([MASS] * 3 + [*INERTIA]))
        positions, forces = simulate(controller, loads)
        errors = 1e3 * np.linalg.norm(positions, axis=1)
        shares = forces[:, :, 0] / grasp.max_normal_force
        runs[name] = errors, shares.max(axis=1)
        if len(forces) < len(loads):
            print(f"{name:34} {f'lost after {len(forces) / 1000:.2f} s':>19}")
            continue
        # The first tenth of a second is left out: the load comes at once.
        change = np.linalg.norm(np.diff(forces[100:], axis=0), axis=2).max()
        figures = f"{errors.max():9.3f} {shares.max():9.3f} {shares.sum(axis=1).mean():7.3f} {change:18.4f}"
        print(f"{name:34} {figures}")
    if options.plot:
        draw(runs, options.plot)


def draw(runs: dict[str, tuple[np.ndarray, np.ndarray]], path: str) -> None:
    """Draw the errors and the greatest shares over time."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only where it is asked for

    figure = Figure(figsize=(8.4, 5.4), dpi=130, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    colours = ("#1f5f99", "#c8742c", "#3f8f4f", "#c0392b", "#b58ad0")
    for (name, (errors, shares)), colour in zip(runs.items(), colours, strict=True):
        above.semilogy(
            np.arange(len(errors)) / 1000, np.maximum(errors, 1e-5), color=colour, lw=1.3, label=name
        )
        below.plot(np.arange(len(shares)) / 1000, shares, color=colour, lw=1.3)
    below.axhline(1, color="#30343b", lw=1, ls="--")
    above.set_ylabel("error of the position (mm)")
    below.set_ylabel("greatest share of a limit")
    below.set_xlabel("time (s)")
    for axes in (above, below):
        axes.grid(color="#ececec")
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    figure.savefig(path)


if __name__ == "__main__":
    main()

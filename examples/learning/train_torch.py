"""Train the network of train_jax.py in PyTorch: four contacts on an ellipsoid; the loss is minus the quality.

Usage: python train_torch.py [--steps 300]
"""

import argparse
from itertools import pairwise

import torch

import graspforce.torch

GRASP = {"friction": 0.7, "length_scale": 0.05}
SMALLEST, LARGEST = 0.03, 0.06  # semi-axes, m
BATCH = 64
RATE = 3e-3


def contacts(network: torch.nn.Module, axes: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return positions and inward normals (B, 4, 3) on ellipsoids of semi-axes (B, 3)."""
    outward = network((axes - SMALLEST) / (LARGEST - SMALLEST) - 0.5).unflatten(-1, (4, 3))
    outward = torch.nn.functional.normalize(outward, dim=-1)
    return outward * axes[:, None], -outward / axes[:, None]


def train(steps: int, seed: int = 0) -> tuple[torch.nn.Module, list[float]]:
    """Return the network and the mean quality at each step."""
    torch.manual_seed(seed)
    sizes = (3, 64, 64, 12)
    layers = [torch.nn.Linear(n, m) for n, m in pairwise(sizes)]
    network = torch.nn.Sequential(layers[0], torch.nn.Tanh(), layers[1], torch.nn.Tanh(), layers[2])
    for layer in layers:
        torch.nn.init.normal_(layer.weight, std=layer.in_features**-0.5)
        torch.nn.init.normal_(layer.bias, std=0.5)
    adam = torch.optim.Adam(network.parameters(), RATE)
    # The rate falls to zero: the best grasps are at kinks of the quality.
    rates = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
    curve = []
    for _ in range(steps):
        axes = SMALLEST + (LARGEST - SMALLEST) * torch.rand(BATCH, 3)
        loss = -graspforce.torch.quality(*contacts(network, axes), criterion="sum", **GRASP).mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
        rates.step()
        curve.append(-loss.item())
    return network, curve


def main() -> None:
    """Train and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=300)
    steps = parser.parse_args().steps
    _, curve = train(steps)
    for i in range(0, steps, max(1, steps // 5)):
        part = curve[i : i + 10]
        print(f"step {i:4}: mean epsilon {sum(part) / len(part):7.4f} N")


if __name__ == "__main__":
    main()

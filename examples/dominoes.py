"""A row of dominoes: the first is tipped over, and each falls against the next.

In the end all lie still, and what lies still has velocity 0.0. The wave soon runs at one speed, which
depends on their height, thickness and distance, and hardly on the friction."""

import numpy as np

import perp

HALF_THICKNESS, HALF_HEIGHT, SPACING = 0.004, 0.024, 0.02


def row(count):
    world = perp.World(planar=True, friction=0.3, accuracy="accurate")
    world.ground.add_plane((0, 1))
    for k in range(count):
        domino = world.add_body(mass=0.01, position=(k * SPACING, HALF_HEIGHT))
        domino.add_box((HALF_THICKNESS, HALF_HEIGHT))
    first, omega = world.bodies[0], 5.0  # about its lower right edge
    first.angular_velocity = -omega
    first.velocity = (omega * HALF_HEIGHT, omega * HALF_THICKNESS)
    return world


def main():
    count, h = 20, 1e-3
    world = row(count)
    down = np.full(count, np.nan)  # when each has leant over by 15 degrees
    angles = world.orientations

    def watch(world):
        down[np.isnan(down) & (angles < -np.radians(15))] = world.time

    result = world.run(2.0, h, watch)
    print(f"outcome {result.outcome}, {np.isfinite(down).sum()} of {count} fell")
    middle = slice(count // 2, count - 3)
    print(f"the wave runs at {SPACING / np.diff(down)[middle].mean():.2f} m/s")
    print(f"largest velocity at the end: {np.abs(world.velocities).max()}")


if __name__ == "__main__":
    main()

"""Bricks that lean out over the edge of a table as far as they can: the harmonic overhang.

The k-th brick from the top may reach out over the next by 1/(2k) of its length, so that n bricks
reach 1/2 + 1/4 + ... + 1/(2n) beyond the table. With 0.99 of each of these the stack stands for ever,
and every velocity is 0.0; with 1.01 it falls.
"""

import numpy as np

import perp


def overhang(bricks, share, accuracy="standard"):
    """Bricks of 1 x 0.25 m on a table whose edge is at x = 0."""
    world = perp.World(planar=True, friction=0.5, accuracy=accuracy)
    world.ground.add_box((5, 0.5), offset=(-5, -0.5))  # its upper face is at height 0
    edge = share / (2 * bricks)  # of the lowest brick, counted from the table's
    for k in range(bricks, 0, -1):
        brick = world.add_body(mass=1, position=(edge - 0.5, 0.25 * (bricks - k) + 0.125))
        brick.add_box((0.5, 0.125))
        edge += share / (2 * (k - 1)) if k > 1 else 0.0
    return world, edge


def main():
    for bricks in (1, 2, 5, 10, 20):
        for share in (0.99, 1.01):
            world, reach = overhang(bricks, share)
            start = world.positions.copy()
            world.run(2.0, 0.01)
            moved = np.abs(world.positions - start).max()
            speed = np.abs(world.velocities).max()
            print(
                f"{bricks:2} bricks reach {reach:.4f} m, {share} of what they can: "
                + (f"stand, velocity {speed}" if moved == 0.0 else f"fall {moved:.2f} m in 2 s")
            )


if __name__ == "__main__":
    main()

"""A steel ball goes through a stack of boxes at 300 m/s and takes one of them along.

A step of 5 ms is 1.5 m of the ball's way, six boxes wide: it meets the box all the same. Momentum is what
it was, and energy goes down only."""

import numpy as np

import perp


def shoot(speed=300.0, h=5e-3, accuracy="standard"):
    world = perp.World(friction=0.4, accuracy=accuracy)
    world.ground.add_plane((0, 0, 1))
    for k in range(8):
        world.add_body(mass=2.0, position=(0, 0, 0.125 + 0.25 * k)).add_box((0.125, 0.125, 0.125))
    bullet = world.add_body(mass=0.1, position=(-1.0, 0.02, 0.89), velocity=(speed, 0, 0))
    bullet.add_sphere(0.015)
    return world, bullet


def main():
    world, bullet = shoot()
    h = 5e-3
    for step in range(1, 5):
        before, momentum = world.energy().total, world.momentum().linear
        world.step(h)
        gain = world.momentum().linear[0] - momentum[0]
        speeds = " ".join(f"{v:.2f}" for v in world.velocities[:8, 0])
        print(f"step {step}: ball {bullet.velocity[0]:7.2f} m/s, boxes {speeds} m/s")
        print(f"  momentum along x gains {gain:.1e} N s, energy {world.energy().total - before:.1f} J")
    world.run(3.0, h)
    print(f"after 3 s: {np.sum(world.positions[:8, 2] > 0.12)} boxes lie, velocity {np.abs(world.velocities[:8]).max()}")


if __name__ == "__main__":
    main()

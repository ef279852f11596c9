"""A ball goes into a stack of boxes at 300 m/s and takes one of them along.

A step of 5 ms is 1.5 m of the ball's way, six boxes wide: it meets the box all the same, ends the step
touching it, and shares its momentum with it in the next. Then what was above comes down."""

import numpy as np

import perp


def shoot(speed=300.0, accuracy="standard"):
    """Seen from the side: 8 boxes of 0.25 m and 2 kg, a ball of 0.1 kg."""
    world = perp.World(planar=True, friction=0.4, accuracy=accuracy)
    world.ground.add_plane((0, 1))
    for k in range(8):
        world.add_body(mass=2.0, position=(0, 0.125 + 0.25 * k)).add_box((0.125, 0.125))
    ball = world.add_body(mass=0.1, position=(-1.0, 0.89), velocity=(speed, 0))
    ball.add_sphere(0.015)
    return world, ball


def main():
    world, ball = shoot()
    h = 5e-3
    boxes = slice(0, 8)
    for step in range(1, 4):
        energy = world.energy().total
        world.step(h)
        speeds = " ".join(f"{v:.2f}" for v in world.velocities[boxes, 0])
        lost = energy - world.energy().total
        print(f"step {step}: ball {ball.velocity[0]:.2f}, boxes {speeds} m/s, lost {lost:.1f} J")
    world.run(4.0, h)
    x = world.positions[boxes, 0]
    others = np.abs(np.delete(x, 3)).max()
    print(f"after 4 s: the box that was hit lies {x[3]:.1f} m away, the others within {others:.1f} m,")
    print(f"  and the largest velocity of a box is {np.abs(world.velocities[boxes]).max()}")


if __name__ == "__main__":
    main()

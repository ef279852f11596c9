"""A wall of bricks stands, and moves by 0.0; then bricks of its lowest course are taken out.

The bond carries what is above the first gap; as it grows the wall comes down, and lies still in the end."""

import numpy as np

import perp

LENGTH, HEIGHT, COURSES = 0.25, 0.125, 6


def wall(accuracy="exact"):
    """Bricks in a running bond, seen from the front; each second course begins with half a brick."""
    world = perp.World(planar=True, friction=0.6, accuracy=accuracy)
    world.ground.add_plane((0, 1))
    for course in range(COURSES):
        lengths = [LENGTH] * 5 if course % 2 == 0 else [LENGTH / 2, *[LENGTH] * 4, LENGTH / 2]
        x = 0.0
        for length in lengths:
            brick = world.add_body(position=(x + length / 2, HEIGHT * (course + 0.5)))
            brick.add_box((length / 2 - 5e-4, HEIGHT / 2), density=1800 * 0.12)  # kg / m^2
            x += length
    return world


def tell(world, what, heights):
    fallen = sum(h - body.position[1] > HEIGHT / 2 for body, h in heights.items())
    speed = np.abs(world.velocities).max()
    print(f"{what}: {fallen} of {len(heights)} bricks fell, largest velocity {speed}")


def main():
    world = wall()
    heights = {body: body.position[1] for body in world.bodies}
    start = world.positions.copy()
    world.run(1.0, 0.01)
    print(f"stands: moved by {np.abs(world.positions - start).max()}")
    lowest = world.bodies[:5]
    for brick, what in zip(lowest[2::-1], ("one brick out", "two out", "three out")):
        del heights[brick]
        brick.remove()
        world.run(1.5, 0.01)
        tell(world, what, heights)


if __name__ == "__main__":
    main()

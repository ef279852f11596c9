"""A pyramid of boxes at three accuracies: what rests is as still at each; what is hit differs.

    python pyramid.py [--output FOLDER] [--no-picture]

28 boxes of 1 kg stand for a second; then a ball of 20 kg hits them at 30 m/s, and is seen 0.3 s later.
Where they are then depends on every impact on the way, and so on the length of the steps as much as
on the accuracy; the residual tells how well each step obeyed the laws. FOLDER (default build/run)
receives pyramid.png and pyramid.svg (needs Matplotlib).
"""

import argparse

import numpy as np

import perp

ROWS, H = 7, 0.01


def pyramid(accuracy):
    world = perp.World(planar=True, friction=0.5, accuracy=accuracy)
    world.ground.add_plane((0, 1))
    for row in range(ROWS):
        for k in range(ROWS - row):
            box = world.add_body(mass=1, position=(1.05 * (k - (ROWS - row - 1) / 2), 0.5 + row))
            box.add_box((0.5, 0.5))
    return world


def hit(accuracy, seconds=0.3):
    """What moved in a second of rest; poses and the worst residual after the hit."""
    world = pyramid(accuracy)
    start = world.positions.copy()
    world.run(1.0, H)
    moved = np.abs(world.positions - start).max()
    ball = world.add_body(mass=20, position=(-6.0, 2.3), velocity=(30, 0))
    ball.add_sphere(0.5)
    run = world.run(seconds, H)
    return moved, world.positions.copy(), world.orientations.copy(), run.residual


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="build/run", help="folder of the picture")
    parser.add_argument("--no-picture", action="store_true")
    options = parser.parse_args()
    found = {accuracy: hit(accuracy) for accuracy in ("fast", "standard", "exact")}
    for accuracy, (moved, _, _, residual) in found.items():
        print(f"{accuracy:9} at rest moved by {moved}; hit: residual {residual:.1e}")
    if not options.no_picture:
        from pyramid_picture import draw

        for path in draw(options.output, found):
            print(f"wrote {path}")


if __name__ == "__main__":
    main()

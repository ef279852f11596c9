"""A zoo of assemblies that begin at rest, made from a seed, and whether perp leaves at rest what
can rest and lets fall what cannot.

    python tests/zoo/assemblies.py --count 1000 --seed 0 --levels all
    python tests/zoo/assemblies.py --seed 37 --count 1 --kind arch --levels fast     # one again

Scenes are judged by Clarabel (equilibrium.py), not by perp: those that stand have to keep their
first velocity to the last bit in every step, and where they are; those that fall have to move.
Classes are functions in masonry.py and leaning.py; what is random beyond a class is here: headings,
units, ratios of masses, forces that touch bodies, what carries an assembly, planar worlds.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from random import Random
from typing import Callable, Optional

sys.path.insert(0, str(Path(__file__).parent))

import leaning  # noqa: E402
import masonry  # noqa: E402
from masonry import spread  # noqa: E402
from scene import GRAVITY, Scene  # noqa: E402

Generator = Callable[[Random, Optional[int]], Scene]

CLASSES: dict[str, Generator] = {
    "arch": masonry.arch,
    "vault": masonry.vault,
    "lintel": masonry.lintel,
    "wall": masonry.wall,
    "tilted_pile": masonry.tilted_pile,
    "corbel": masonry.corbel,
    "overhang": masonry.overhang,
    "jenga": masonry.jenga,
    "slope": masonry.slope,
    "cards": leaning.cards,
    "ladder": leaning.ladder,
    "planks": leaning.planks,
    "books": leaning.books,
    "wedged": leaning.wedged,
    "flush": leaning.flush,
    "pushed": leaning.pushed,
    "tipping": leaning.tipping,
    "hung": leaning.hung,
    "tent": leaning.tent,
}
KINDS = (*CLASSES, "carried")
LEVELS = ("fast", "standard", "accurate", "exact")


def touch(scene: Scene, random: Random) -> None:
    """Forces on one or a few bodies, from next to nothing to half a weight, mostly sideways."""
    parts = [scene.parts[k] for k in scene.dynamic()]
    touched = random.sample(parts, min(len(parts), random.choice((1, 1, 1, 3))))
    size = spread(random, 1e-7, 0.5)
    for part in touched:
        push, angle = size * part.mass * GRAVITY, random.uniform(0, 2 * math.pi)
        down = random.choice((0.0, 0.0, random.uniform(-1, 1)))
        part.force = (push * math.cos(angle), push * math.sin(angle), push * down)
    scene.notes["touched"] = size


def flatten(scene: Scene) -> None:
    """The picture in x and z as a planar world."""
    scene.planar = True
    for part in scene.parts:
        part.force = (part.force[0], 0.0, part.force[2])


def make(seed: int, kind: Optional[str] = None, size: Optional[int] = None) -> Scene:
    """The scene of a seed. kind: one of KINDS, by default the seed's. size: how many stones,
    courses, levels, bricks, ...: by default random."""
    kind = kind or KINDS[seed % len(KINDS)]
    random = Random(f"{kind} {seed}")
    base = random.choice(list(CLASSES)) if kind == "carried" else kind
    scene = CLASSES[base](random, size)
    scene.kind, scene.seed, scene.size = kind, seed, size
    if kind == "carried":
        scene.notes["what"] = base
    if scene.share is None:
        if random.random() < 0.2:
            orders = random.uniform(0, 4)
            for k in scene.dynamic():
                scene.parts[k].mass *= 10 ** random.uniform(0, orders)
            scene.notes["masses"] = 10**orders
        if random.random() < 0.3:
            touch(scene, random)
    if random.random() < 0.25:
        unit = spread(random, 0.01, 100)
        scene.scaled(unit)
        scene.notes["unit"] = unit
    if scene.picture and random.random() < 0.3:
        flatten(scene)
        scene.notes["planar"] = True
    if kind == "carried":
        speed, angle = spread(random, 1e-3, 3), random.uniform(0, 2 * math.pi)
        up = random.choice((0.0, random.uniform(-1, 1)))
        scene.carried((speed * math.cos(angle), speed * math.sin(angle), speed * up))
        if scene.planar:
            scene.velocity = (scene.velocity[0], 0.0, scene.velocity[2])
    if not scene.planar and random.random() < 0.8:
        scene.turned("z", random.uniform(0, 2 * math.pi))
    return scene


def main() -> int:
    from judge import report

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, help="of scenes")
    parser.add_argument("--seed", type=int, default=0, help="of the first")
    parser.add_argument("--levels", default="all", help="all, or some with commas")
    parser.add_argument("--kind", choices=KINDS, help="of all scenes, by default each in turn")
    parser.add_argument("--size", type=int, help="of all scenes, by default random")
    parser.add_argument("--steps", type=int, default=60, help="of what stands")
    parser.add_argument("--verbose", action="store_true", help="a line for each scene")
    options = parser.parse_args()
    levels = LEVELS if options.levels == "all" else tuple(options.levels.split(","))
    scenes = (make(options.seed + k, options.kind, options.size) for k in range(options.count))
    return report(scenes, levels, options.steps, options.verbose)


if __name__ == "__main__":
    sys.exit(main())

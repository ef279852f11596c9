"""What can rest, rests, and what cannot falls, at every accuracy: a few scenes of each class of the
zoo, verdicts of Clarabel and of closed forms. assemblies.py runs as many as one wants.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import perp
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import assemblies  # noqa: E402
import equilibrium  # noqa: E402
import geometry  # noqa: E402
import judge  # noqa: E402
import masonry  # noqa: E402
from scene import GRAVITY, Scene  # noqa: E402

KNOWN = ("slope", "tipping", "pushed", "ladder", "tent", "overhang")  # those with a closed form
SMALL = {"arch": 15, "vault": 7, "wall": 5, "tilted_pile": 4, "jenga": 6, "cards": 4, "lintel": 8}
with_clarabel = pytest.mark.skipif(equilibrium.clarabel is None, reason="needs Clarabel")


def check(scene: Scene, stands: bool, level: str) -> None:
    wrong = judge.run(scene, stands, level, 30).wrong
    assert not wrong, f"{scene} {'stands' if stands else 'falls'}, {level}: {wrong}"


# --- the judges themselves ----------------------------------------------------------------------


def test_a_seed_gives_the_same_scene() -> None:
    for seed in range(2 * len(assemblies.KINDS)):
        assert assemblies.make(seed) == assemblies.make(seed)


def test_contacts_of_boxes_side_by_side() -> None:
    scene = Scene(0.5)
    scene.add_floor()
    scene.add_box((0, 0, 1), (1, 1, 1), 1)
    scene.add_box((2, 0.5, 1), (1, 1, 1), 1)
    scene.turned("z", 0.3)
    pairs = geometry.touching(scene)
    assert sorted(len(pair[0]) for pair in pairs) == [4, 4, 4] and all(len(p) == 1 for p in pairs)
    side = next(p[0] for p in pairs if p[0][0].a != 0)
    assert all(abs(c.normal[2]) < 1e-15 for c in side)
    assert sorted(round(c.position[2], 12) for c in side) == [0, 0, 2, 2]
    width = max(np.linalg.norm(c.position[:2] - side[0].position[:2]) for c in side)
    assert width == pytest.approx(1.5, abs=1e-12)  # the common part of 2 and 2, shifted by .5


@pytest.mark.parametrize("kind", KNOWN)
@with_clarabel
def test_clarabel_knows_closed_forms(kind: str) -> None:
    """Its margin is a third or so of what the share is off 1, and its tolerance 1e-10: nearer than
    1e-5 to the edge it is not asked."""
    told = 0
    for seed in range(12):
        scene = assemblies.make(seed, kind)
        if abs(scene.share - 1) > 1e-5:
            expected = "stands" if scene.share < 1 else "falls"
            assert equilibrium.decide(scene).word == expected, scene
            told += 1
    assert told > 2


@pytest.mark.parametrize("t_over_R, expected", [(0.110, "stands"), (0.105, "falls")])
@with_clarabel
def test_clarabel_knows_the_thinnest_arch(t_over_R: float, expected: str) -> None:
    """Milankovitch: .1075 for joints towards the centre and any number of them; 101 come near."""
    scene = Scene(0.8, picture=True)
    scene.notes["density"] = 1000.0
    scene.add_floor()
    angles = [math.pi * k / 101 for k in range(102)]
    masonry.ring(scene, 0, 0.1, t_over_R, angles, True)
    assert equilibrium.decide(scene).word == expected


@with_clarabel
def test_clarabel_agrees_with_contacts_of_the_world() -> None:
    """Of bricks, whose faces lie on faces: where the world sees contacts as they are at rest."""
    for seed in range(4):
        scene = assemblies.make(seed, "wall", 4)
        of_the_world = equilibrium.decide_with(scene, equilibrium.from_world(scene, "fast"))
        assert equilibrium.decide(scene).word == of_the_world.word, scene


# --- the world ----------------------------------------------------------------------------------


@pytest.mark.parametrize("level", assemblies.LEVELS)
@pytest.mark.parametrize("kind", KNOWN)
def test_at_the_edge(kind: str, level: str) -> None:
    """From a tenth to 1e-9 before and behind what can be carried."""
    for seed in range(100, 120):
        scene = assemblies.make(seed, kind)
        check(scene, scene.share < 1, level)


@pytest.mark.parametrize("level", assemblies.LEVELS)
def test_what_hardly_falls_falls_slowly(level: str) -> None:
    """Bricks that overhang by a share more than they can: they turn by that share of a fall about
    an edge, and neither rest nor break apart, where rounding names their points anew, too."""
    count = 0
    for seed in range(500, 560):
        scene = assemblies.make(seed, "overhang")
        share = scene.share - 1
        if not 1e-9 < share < 1e-3:
            continue
        world, bodies = scene.build(level, wakeful=True)
        for _ in range(5):
            world.step(0.01)
        speed = np.abs(world.velocities).max()
        # a fall from rest; bricks of a few sizes, that turn about edges at .5 to 1.2 of it
        assert 0 < speed <= 2 * share * GRAVITY * 0.05, scene
        count += 1
    assert count >= 20


@pytest.mark.parametrize("level", assemblies.LEVELS)
@pytest.mark.parametrize("kind", KNOWN)
def test_carried_at_the_edge(kind: str, level: str) -> None:
    """The same on a carrier that moves up, down and sideways."""
    random = Random(7)
    for seed in range(200, 206):
        scene = assemblies.make(seed, kind)
        across = 0.0 if scene.planar else random.uniform(-1, 1)
        scene.carried((random.uniform(-1, 1), across, random.uniform(-1, 1)))
        check(scene, scene.share < 1, level)


def luggage(random: Random) -> Scene:
    """One to three boxes, one on another, on a carrier."""
    scene, top = Scene(random.uniform(0.3, 0.9)), 0.0
    scene.add_floor(slab=True)
    for _ in range(random.randint(1, 3)):
        half = tuple(random.uniform(0.2, 1.0) for _ in range(3))
        place = (random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), top + half[2])
        scene.add_box(place, half, 10 ** random.uniform(1, 3))
        top += 2 * half[2]
    return scene.carried((0, 0, 0))


@pytest.mark.parametrize("level", assemblies.LEVELS)
@with_clarabel
def test_rides_along_when_its_carrier_changes_its_speed(level: str) -> None:
    """By dv in one step: boxes go as far as the carrier does in each step, where they can also stand
    with the forces -m dv / h, so Clarabel."""
    random, asked = Random("rides"), 0
    while asked < 40:
        scene = luggage(random)
        size, angle = random.uniform(0, scene.friction) * GRAVITY, random.uniform(0, 2 * math.pi)
        change = size * judge.STEP * np.array([math.cos(angle), math.sin(angle), 0.0])
        pushed = replace(scene, gravity=tuple(np.array(scene.gravity) - change / judge.STEP))
        if judge.verdict(scene).word != "stands" or judge.verdict(pushed).word != "stands":
            continue
        asked += 1
        world, bodies = scene.build(level)
        for step in range(6):
            velocity = change if step >= 3 else 0 * change
            bodies[0].velocity = velocity
            before = world.positions.copy()
            world.step(judge.STEP)
            off = np.abs(world.positions - before - judge.STEP * velocity)[1:].max()
            # three roundings of places, a few boxes high
            assert off <= 3 * 2.0**-52 * 8, f"step {step}: behind by {off / judge.STEP / size}"


@pytest.mark.parametrize("kind", [kind for kind in assemblies.KINDS if kind not in KNOWN])
@with_clarabel
def test_an_assembly_rests_or_falls(kind: str) -> None:
    for seed in range(300, 304):
        scene = assemblies.make(seed, kind, SMALL.get(kind))
        found = judge.verdict(scene)
        if found.word in ("stands", "falls"):
            for level in assemblies.LEVELS:
                check(scene, found.word == "stands", level)


@pytest.mark.parametrize("kind", ["arch", "cards", "wall", "hung"])
@with_clarabel
def test_parts_smaller_than_the_fall_of_a_step(kind: str) -> None:
    """A millimetre and less, where gravity alone would move them by g h^2 / 2 = .5 mm."""
    for seed in range(400, 404):
        scene = assemblies.make(seed, kind, SMALL.get(kind))
        scene.scaled(0.5e-3 / scene.length())
        found = judge.verdict(scene)
        if found.word in ("stands", "falls"):
            check(scene, found.word == "stands", "fast")


@pytest.mark.parametrize("level", assemblies.LEVELS)
def test_what_hangs_moves_as_its_carrier(level: str) -> None:
    """To the last bit: on strings, on corners and in chains."""
    for seed in (208, 2602, 3438):
        check(assemblies.make(seed, "carried"), stands=True, level=level)


@with_clarabel
def test_a_push_moves_what_hangs_with_a_load() -> None:
    """However small beside the weights that it carries, whose velocities a sweep knows to 1e-2."""
    for seed in (1860, 3171, 3247, 3323):
        scene = assemblies.make(seed, "hung")
        assert judge.verdict(scene).word == "falls"
        check(scene, stands=False, level="fast")


@pytest.mark.parametrize("level", assemblies.LEVELS)
def test_a_tall_house_of_cards(level: str) -> None:
    """Its cards meet corner to corner: known from the first look, so that no sweep says which."""
    for seed in (7002, 7008, 7012, 7013):
        scene = assemblies.make(seed, "cards", 12)
        check(scene, stands=True, level=level)


@pytest.mark.parametrize("level", assemblies.LEVELS)
def test_corners_of_flush_neighbours_do_not_lean(level: str) -> None:
    """A box that is pushed from rest slides under a lintel whose lower side is flush with its top:
    the corners touch, and F - mu m g is what moves it."""
    mass, friction, h, steps = 2.0, 0.8, 0.01, 10
    world = perp.World(accuracy=level, friction=friction)
    world.ground.add_plane((0, 0, 1))
    world.ground.add_box((2, 1, 0.25), offset=(2.5, 0, 1.25))
    box = world.add_body(mass, position=(0, 0, 0.5))
    box.add_box((0.5, 0.5, 0.5))
    push = 1.2 * friction * mass * GRAVITY
    for _ in range(steps):
        box.force = (push, 0, 0)
        world.step(h)
    expected = (push / mass - friction * GRAVITY) * steps * h
    assert box.velocity[0] == pytest.approx(expected, rel=1e-10)  # rounding of sums of weights


@pytest.mark.parametrize("level", assemblies.LEVELS)
@pytest.mark.parametrize("neighbours", [0, 1, 2])
def test_an_edge_among_flush_neighbours(neighbours: int, level: str) -> None:
    """Cubes on ice that touch in an upright edge, pushed together along the diagonal: the edge holds
    them, also where others lie flush in the free corners, which may carry nothing."""
    world = perp.World(accuracy=level)
    world.ground.add_plane((0, 0, 1))
    places = [(0, 0), (1, 1), (1, 0), (0, 1)][: 2 + neighbours]
    cubes = [world.add_body(1.0, position=(x, y, 0.5)) for x, y in places]
    for cube in cubes:
        cube.add_box((0.5, 0.5, 0.5))
    for step in range(3):
        cubes[0].force, cubes[1].force = (2, 2, 0), (-2, -2, 0)
        if step == 0:
            assert world.statics().verdict == "stands"
        world.step(0.01)
    assert np.abs(world.velocities).max() == 0.0

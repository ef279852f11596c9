"""Heavy bodies that bounce fall on stacks of light ones that do not, which touch each other and the
ground but for rounding: nothing goes into anything, by corners and distances of NumPy alone."""

from __future__ import annotations

import numpy as np
import perp
import pytest

LEVELS = ("fast", "standard", "accurate", "exact")
# Of the size: twice what a level lets a motion go deep at most; at `standard` what is shot out sideways goes .0104 deep.
DEEP = {"fast": 0.02, "standard": 0.02, "accurate": 0.01, "exact": 0.01}


def drop(seed: int, level: str, all_bounce: bool = False) -> tuple[perp.World, list[tuple[perp.Body, float, bool]], float]:
    random = np.random.default_rng(seed)
    world = perp.World(planar=True, friction=random.uniform(0, 1), accuracy=level)  # type: ignore[arg-type]
    world.ground.add_plane((0, 1))
    things, height = [], 0.0
    count = int(random.integers(4, 9) if all_bounce else random.integers(2, 5))
    for k in range(count):
        top, radius = k == count - 1, random.uniform(0.1, 0.3)
        height += random.uniform(0.001, 0.1) if top else 10 ** random.uniform(-12, -5)
        body = world.add_body(
            10 ** (random.uniform(1, 3 - all_bounce) if top else random.uniform(-1, 0.5 + all_bounce)),
            position=(random.uniform(-0.02, 0.02), height + radius),
            velocity=(0, -random.uniform(1, 8) if top else 0),
        )
        bounce, is_disc = float(random.choice((0.3, 0.5, 0.8, 1))) * (top or all_bounce), random.random() < 0.5
        if is_disc:
            body.add_sphere(radius, restitution=bounce)
        else:
            body.add_box((radius, radius), restitution=bounce)
        things.append((body, radius, is_disc))
        height += 2 * radius
    return world, things, float(random.choice((1 / 30, 1 / 60, 1 / 120)))


def corners(body: perp.Body, radius: float, is_disc: bool) -> np.ndarray:
    """Of a box; the centre of a disc."""
    c, s = np.cos(body.orientation), np.sin(body.orientation)
    signs = np.zeros((1, 2)) if is_disc else np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    return body.position + radius * signs @ np.array([(c, s), (-s, c)])


def apart(a: np.ndarray, b: np.ndarray, round_by: float) -> float:
    """How far two convex polygons, or points, are apart, less what they are round by: the largest
    distance along normals of sides and lines between corners."""
    ways = [p - q for p in a for q in b]
    for polygon in (a, b):
        sides = np.roll(polygon, -1, axis=0) - polygon
        ways += [np.array((side[1], -side[0])) for side in sides if len(polygon) > 1]
    units = np.array([way / np.linalg.norm(way) for way in ways if np.linalg.norm(way) > 0])
    units = np.concatenate((units, -units))
    return float(((units @ a.T).min(axis=1) - (units @ b.T).max(axis=1)).max()) - round_by


def watch(seed: int, level: str, all_bounce: bool) -> None:
    world, things, h = drop(seed, level, all_bounce)
    for step in range(int(0.3 / h)):
        world.step(h)
        shapes = [corners(*thing) for thing in things]
        for k, (body, radius, is_disc) in enumerate(things):
            low = shapes[k][:, 1].min() - radius * is_disc
            assert low > -DEEP[level] * 2 * radius, (seed, step, k, low)
            for j in range(k):
                round_by = radius * is_disc + things[j][1] * things[j][2]
                gap = apart(shapes[k], shapes[j], round_by)
                assert gap > -DEEP[level] * 2 * min(radius, things[j][1]), (seed, step, j, k, gap)


# Bodies were up to .74 of their size in each other: what an impact threw at a third body, a rounding
# away, went on through the rest of the step, as only contacts with restitution were hit.
@pytest.mark.parametrize("level", LEVELS)
def test_nothing_goes_into_what_it_hits(level: str) -> None:
    for seed in range(40):
        watch(seed, level, False)


# The last impacts of a step gave ten times the energy that there was, where a light body comes back
# fast between heavy ones: to take it back shortened all impulses, and what had met went on.
@pytest.mark.parametrize("level", LEVELS)
def test_nothing_goes_into_what_bounces_among_others(level: str) -> None:
    for seed in range(40):
        watch(seed, level, True)


# Light bodies that are shot out sideways turn against each other by up to radians a step. The pose in which
# they end a step was taken for what they had in common, but they were on their way out again there, and the
# rates of that pose asked for nothing: 33 of 2,500 of these worlds were over .02 deep, these ones .1 to .5.
@pytest.mark.parametrize("seed", (473, 510, 737, 1125, 1593, 1758, 1792, 1890, 2032, 2146, 2276, 2494))
def test_what_is_shot_out_sideways_does_not_turn_into_its_neighbour(seed: int) -> None:
    watch(seed, "fast", False)


# Energy that a step gave was taken back from ways however long these were, and what an impact had moved out of
# another went into it again, .13 and .1 of its size deep.
@pytest.mark.parametrize("seed", (333, 1867))
def test_what_ways_give_back_presses_nothing_into_another(seed: int) -> None:
    watch(seed, "fast", False)


# A pair that had just met was looked at again only if its point changed the motion. At a touching point that the
# motion opens it did not, and a box turned by .65 of a radian into the disc below, .15 of its size deep.
@pytest.mark.parametrize("level", ("accurate", "exact"))
def test_what_has_just_met_is_looked_at_again(level: str) -> None:
    watch(2342, level, False)


# A corner that hops comes back at the time of its parabola, but till then the island went with the velocities of
# the end, as if it fell all the time, unless all else in it was at rest exactly: .011 to .03 deep.
@pytest.mark.parametrize("seed,level", ((584, "exact"), (1055, "fast"), (2396, "accurate"), (2396, "exact")))
def test_what_hops_moves_by_the_mean_of_its_velocities(seed: int, level: str) -> None:
    watch(seed, level, False)


# What is lifted out of one body was pushed into the next but one, and turned by a third of a radian as if its
# corners went straight: .012 to .075 deep.
@pytest.mark.parametrize("seed,level,all_bounce", (
    (101, "accurate", False), (101, "exact", False), (964, "accurate", False), (415, "fast", True),
    (482, "fast", True), (509, "fast", True), (509, "exact", True), (1571, "fast", True), (2077, "fast", True)))
def test_what_is_pushed_out_goes_into_no_other(seed: int, level: str, all_bounce: bool) -> None:
    watch(seed, level, all_bounce)

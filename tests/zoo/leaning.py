"""Generators of what leans, hangs, is pushed or squeezed. See assemblies.py."""

from __future__ import annotations

import math
from random import Random
from typing import Optional

from masonry import near, spread
from scene import GRAVITY, Scene, Shape, about


def cards(random: Random, size: Optional[int]) -> Scene:
    """A house of cards; those that lie on the others are a little shorter, as in bench/world.c."""
    lean = math.radians(random.uniform(8, 25))
    scene = Scene(math.tan(lean) * random.uniform(0.8, 3), picture=True)
    levels = size or random.choice((random.randint(2, 5), random.randint(2, 10)))
    length, thick, depth = 0.9, random.choice((0.01, random.uniform(0.002, 0.03))), 0.3
    width = 2 * (length * math.sin(lean) + thick * math.cos(lean))
    height = length * math.cos(lean) + thick * math.sin(lean)
    density, z = spread(random, 100, 8000), 0.0
    scene.add_floor(random.random() < 0.5)
    for count in range(levels, 0, -1):
        for c in range(2 * count):
            side = 1 if c % 2 else -1
            x = (c // 2 - (count - 1) / 2) * width + side * width / 4
            turn = about("y", -side * lean)
            half = (thick / 2, depth, length / 2)
            scene.add_box((x, 0, z + height / 2), half, density, turn=turn)
        z += height
        for c in range(count - 1):
            x = (c - (count - 2) / 2) * width
            half = (width / 2 - 0.001, depth, thick / 2)
            scene.add_box((x, 0, z + thick / 2), half, density)
        z += thick
    scene.notes.update(levels=levels, lean=lean, friction_over_lean=scene.friction / math.tan(lean))
    return scene


def leaning_box(
    scene: Scene, foot: float, half: tuple[float, float, float], lean: float, density: float
) -> tuple[int, float, float]:
    """A box that leans to the right, its right lower edge on the floor at x = foot. Returns it and
    how far its right upper edge is from there, to the right and up."""
    c, s = math.cos(lean), math.sin(lean)
    x = foot - (half[0] * c - half[2] * s)
    z = half[0] * s + half[2] * c
    body = scene.add_box((x, 0, z), half, density, turn=about("y", lean))
    return body, 2 * half[2] * s, 2 * half[2] * c


def ladder(random: Random, size: Optional[int]) -> Scene:
    """A plank that leans against a wall, at a share of what the friction of its foot can carry."""
    scene = Scene(1.0, picture=True)
    lean, share = math.radians(random.uniform(10, 60)), near(random, 1e-9, 0.1)
    half = (random.uniform(0.01, 0.05), random.uniform(0.1, 0.3), random.uniform(0.4, 1.5))
    body, right, up = leaning_box(scene, 0, half, lean, spread(random, 1, 1e5))
    reach = scene.parts[body].position[0]  # from the foot to below the mass centre
    at_wall = random.choice((0.0, random.uniform(0.05, 0.5)))
    # Moments about the foot, all friction spent at floor and wall: N_wall (up + mu_wall right) is
    # m g times the way to the mass centre, and N_wall = mu m g / (1 + mu mu_wall).
    needed = reach / (up + at_wall * (right - reach))
    friction = needed / share
    # A pair's friction is the geometric mean: the plank has that of the floor.
    scene.friction = friction
    scene.add_floor(random.random() < 0.5)
    face = Shape("box", (0.5, 2, 4), friction=at_wall**2 / friction)
    scene.add("static", (right + 0.5, 0, 4), face)
    scene.share = share
    scene.notes.update(share_less_1=share - 1, lean=lean, friction=friction, wall=at_wall)
    return scene


def tent(random: Random, size: Optional[int]) -> Scene:
    """Two equal boxes or prisms that lean on each other, upper edge on upper edge, at a share of
    what the friction of their feet can carry. Their thrust is level by symmetry: a level normal
    needs no friction between the edges."""
    scene = Scene(1.0, picture=True)
    lean, share = math.radians(random.uniform(10, 40)), near(random, 1e-9, 0.1)
    half = (random.uniform(0.002, 0.05), random.uniform(0.1, 0.3), random.uniform(0.4, 1.5))
    density, prism = spread(random, 1, 1e5), random.random() < 0.4
    if prism:
        back, rise = 2 * half[0] * math.cos(lean), 2 * half[0] * math.sin(lean)
        right, up = 2 * half[2] * math.sin(lean), 2 * half[2] * math.cos(lean)
        outline = [(0, 0), (right, up), (right - back, up + rise), (-back, rise)]
        if random.random() < 0.5:
            del outline[random.choice((2, 3))]
        body = scene.add_prism(outline, 0, half[1], density)
        mirrored = [(2 * right - x, z) for x, z in reversed(outline)]
        scene.add_prism(mirrored, 0, half[1], density)
    else:
        body, right, up = leaning_box(scene, 0, half, lean, density)
        x, y, z = scene.parts[body].position
        scene.add_box((2 * right - x, y, z), half, density, turn=about("y", -lean))
    reach = scene.parts[body].position[0]  # from the foot to below the mass centre
    # Moments about the foot: N_edge up = m g reach, and N_edge = mu m g at most.
    friction = reach / up / share
    # A pair's friction is the geometric mean.
    scene.friction = friction * spread(random, 1e-3, 1)
    floor = Shape("box", (8, 8, 0.5), friction=friction**2 / scene.friction)
    scene.add("static", (right, 0, -0.5), floor)
    scene.share = share
    scene.notes.update(share_less_1=share - 1, lean=lean, friction=friction, edges=scene.friction)
    scene.notes.update(prism=prism)
    return scene


def planks(random: Random, size: Optional[int]) -> Scene:
    """Planks that lean, one behind the other or each for itself, against a wall or a heavy box."""
    lean = math.radians(random.uniform(10, 45))
    scene = Scene(random.uniform(0.2, 1.0), picture=True)
    count, density = size or random.randint(1, 5), spread(random, 100, 8000)
    half = (random.uniform(0.01, 0.05), 0.3, random.uniform(0.4, 1.2))
    scene.add_floor(random.random() < 0.5)
    c, s = math.cos(lean), math.sin(lean)
    foot = 0.0
    for k in range(count):
        _, right, up = leaning_box(scene, foot, half, lean, density)
        if k == 0:
            high, wide = up * random.uniform(0.55, 0.9), random.uniform(0.1, 0.5)
            if random.random() < 0.5:
                scene.add("static", (right + 0.5, 0, up), Shape("box", (0.5, 2, up)))
            else:
                edge = high * s / c  # of the box, on the plank's face
                box = (edge + wide, 0, high / 2), (wide, 0.4, high / 2)
                scene.add_box(*box, density * spread(random, 0.1, 10))
        foot -= 2 * half[0] / c
    scene.notes.update(planks=count, lean=lean)
    return scene


def books(random: Random, size: Optional[int]) -> Scene:
    """Books of any size in a row on a shelf, all leaning alike on a wall or on a book upright."""
    scene = Scene(random.uniform(0.1, 0.8), picture=True)
    count, lean = size or random.randint(2, 12), math.radians(random.uniform(2, 30))
    density, c = spread(random, 100, 8000), math.cos(lean)
    scene.add_floor(True)
    foot, tallest = 0.0, 0.0
    for k in range(count):
        half = (random.uniform(0.01, 0.03), random.uniform(0.05, 0.09), random.uniform(0.08, 0.15))
        if k == 0:
            half = (half[0], half[1], 0.15)
            _, tallest, high = leaning_box(scene, foot, half, lean, density)
        else:
            leaning_box(scene, foot, half, lean, density)
        foot -= 2 * half[0] / c
    if random.random() < 0.5:
        scene.add("static", (tallest + 0.5, 0, 0.5), Shape("box", (0.5, 1, 0.5)))
    else:
        wide = random.uniform(0.02, 0.1)
        scene.add_box((tallest + wide, 0, 0.2), (wide, 0.1, 0.2), density * spread(random, 0.3, 5))
    scene.notes.update(books=count, lean=lean)
    return scene


def wedged(random: Random, size: Optional[int]) -> Scene:
    """A wedge in a groove, or between walls that lean over it, where friction alone can hold it;
    boxes may stand on it."""
    scene = Scene(random.uniform(0.1, 1.0), picture=True)
    limit = math.atan(scene.friction)
    if random.random() < 0.5:
        scene.friction = random.uniform(0.1, 0.5)
        left = right = -math.atan(scene.friction) * near(random, 1e-3, 0.3)
    else:
        left, right = (
            random.choice((random.uniform(-1.3, 1.3) * limit, random.uniform(0, 0.6), 0.0))
            for _ in range(2)
        )
    left, right = max(min(left, 0.7), -0.6), max(min(right, 0.7), -0.6)
    height, width, depth = random.uniform(0.3, 0.8), random.uniform(0.7, 1.5), 0.4
    a, b = (-width / 2, 0.0), (width / 2, 0.0)
    d, e = height * math.tan(left), height * math.tan(right)
    low_left, low_right = (a[0] + d / 2, 0.0), (b[0] - e / 2, 0.0)
    top_left, top_right = (a[0] - d / 2, height), (b[0] + e / 2, height)
    density = spread(random, 100, 8000)
    scene.add_prism([low_left, low_right, top_right, top_left], 0, depth, density)
    scene.add_prism([(-3, 0), low_left, top_left, (-3, height)], 0, depth, 1, "static")
    scene.add_prism([low_right, (3, 0), (3, height), top_right], 0, depth, 1, "static")
    z = height
    for k in range(random.randint(0, size or 3)):
        high = random.uniform(0.05, 0.2)
        scene.add_box((0, 0, z + high), (width / 8, 0.2, high), density * spread(random, 0.1, 10))
        z += 2 * high
    scene.notes.update(left=left, right=right, friction=scene.friction)
    return scene


def flush(random: Random, size: Optional[int]) -> Scene:
    """Boxes side by side on a floor, without friction between them: contacts that carry nothing
    unless something pushes. The floor may have friction."""
    across, along = random.randint(1, 4), size or random.randint(2, 5)
    scene = Scene(0.0)
    scene.add_floor(random.random() < 0.5)
    half, density = [random.uniform(0.2, 0.5) for _ in range(3)], spread(random, 100, 8000)
    for i in range(along):
        for j in range(across):
            centre = ((2 * i - along + 1) * half[0], (2 * j - across + 1) * half[1], half[2])
            scene.add_box(centre, half, density)
    if random.random() < 0.3:  # one on top of them all
        top = (along * half[0], across * half[1], half[2])
        scene.add_box((0, 0, 3 * half[2]), top, density)
    scene.notes.update(across=across, along=along)
    return scene


def pushed(random: Random, size: Optional[int]) -> Scene:
    """One flat box, pushed at its mass centre with a share of its friction in any direction."""
    scene = Scene(spread(random, 0.05, 1.0))
    share, angle = near(random, 1e-9, 0.1), random.uniform(0, 2 * math.pi)
    half = (random.uniform(0.3, 1), random.uniform(0.3, 1), random.uniform(0.02, 0.1))
    scene.add_floor(random.random() < 0.5)
    body = scene.add_box((0, 0, half[2]), half, spread(random, 1, 1e5))
    push = share * scene.friction * scene.parts[body].mass * GRAVITY
    scene.parts[body].force = (push * math.cos(angle), push * math.sin(angle), 0)
    scene.share = share
    scene.notes.update(share_less_1=share - 1, angle=angle, friction=scene.friction)
    return scene


def tipping(random: Random, size: Optional[int]) -> Scene:
    """One high box, pushed at its mass centre along its edges with a share of what tips it."""
    half = (random.uniform(0.1, 0.3), random.uniform(0.1, 0.3), random.uniform(0.3, 1))
    tips = half[0] / half[2]
    scene = Scene(tips * random.uniform(1.3, 4), picture=True)
    share = near(random, 1e-9, 0.1)
    scene.add_floor(random.random() < 0.5)
    body = scene.add_box((0, 0, half[2]), half, spread(random, 1, 1e5))
    scene.parts[body].force = (share * tips * scene.parts[body].mass * GRAVITY, 0, 0)
    scene.share = share
    scene.notes.update(share_less_1=share - 1, friction_over_tipping=scene.friction / tips)
    return scene


# --- hung by joints -----------------------------------------------------------------------------


def hung(random: Random, size: Optional[int]) -> Scene:
    """Boxes on a plate that joints hold: a bracket, a hinged shelf with a prop, strings at its
    corners, or hinges at them all; or a chain that hangs straight."""
    way = random.choice(("bracket", "shelf", "strings", "corners", "chain"))
    scene = Scene(random.uniform(0.2, 0.9))
    scene.notes["way"] = way
    density, high = spread(random, 100, 8000), 2.0
    above = 3 * high + 0.4 * (size or 0)  # of all boxes
    ceiling = scene.add("static", (0, 0, above), Shape("box", (5, 5, 0.5)))
    if way == "chain":
        return hang_chain(scene, random, size or random.randint(1, 6), ceiling, density)
    half = (random.uniform(0.5, 1.0), random.uniform(0.3, 0.6), 0.05)
    plate = scene.add_box((0, 0, high - half[2]), half, density)
    ends = [(i * half[0] * 0.9, j * half[1] * 0.9, high) for i in (-1, 1) for j in (-1, 1)]
    if way == "bracket":
        scene.add_joint("fixed", ceiling, plate, (-half[0], 0, high))
    elif way == "shelf":
        scene.picture = True
        scene.add_joint("revolute", ceiling, plate, (-half[0], 0, high - half[2]))
        prop = (half[0] * random.uniform(0, 1), 0, high - 2 * half[2] - 0.2)
        scene.add("static", prop, Shape("box", (0.05, 0.5, 0.2)))
    elif way == "strings":
        for x, y, z in ends:
            scene.add_joint("distance", ceiling, plate, (x, y, z + 1), (x, y, z))
    else:
        for end in ends[: random.choice((3, 4))]:
            scene.add_joint("ball", ceiling, plate, end)
    z = high
    for k in range(size or random.randint(0, 4)):
        box = [half[0] * 0.6, half[1] * 0.6, random.uniform(0.05, 0.2)]
        aside = random.choice((0.0, random.uniform(-0.5, 0.5) * half[0]))
        scene.add_box((aside, 0, z + box[2]), box, density * spread(random, 0.1, 10))
        z += 2 * box[2]
    scene.notes.update(boxes=len(scene.parts) - 2)
    return scene


def hang_chain(
    scene: Scene, random: Random, links: int, ceiling: int, density: float
) -> Scene:
    """Links one below the other, hinged in line with their mass centres."""
    above, z = ceiling, 5.0
    for _ in range(links):
        half = [random.uniform(0.05, 0.2) for _ in range(3)]
        link = scene.add_box((0, 0, z - half[2]), half, density * spread(random, 0.01, 100))
        scene.add_joint(random.choice(("ball", "fixed")), above, link, (0, 0, z))
        above, z = link, z - 2 * half[2]
    scene.notes.update(links=links)
    return scene

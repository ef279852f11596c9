"""Generators of what is laid of stones, bricks and boxes. See assemblies.py."""

from __future__ import annotations

import math
from random import Random
from typing import Optional

from scene import Scene, Shape, about


def spread(random: Random, low: float, high: float) -> float:
    """Evenly over the orders of magnitude."""
    return math.exp(random.uniform(math.log(low), math.log(high)))


def near(random: Random, least: float, most: float) -> float:
    """1 less or more a share between least and most."""
    return 1 + random.choice((-1, 1)) * spread(random, least, most)


def pieces(random: Random, length: float, least: float, most: float) -> list[float]:
    """Lengths between least and about most that add up to `length`."""
    found = []
    while length > most + least:
        found.append(random.uniform(least, most))
        length -= found[-1]
    return [*found, length]


# --- arches ------------------------------------------------------------------------------------


def ring(
    scene: Scene, y: float, depth: float, thickness: float, angles: list[float], turned: bool
) -> None:
    """Stones between radii 1 -+ thickness / 2 and between angles, from right to left."""
    inner, outer = 1 - thickness / 2, 1 + thickness / 2
    for low, high in zip(angles, angles[1:]):
        corners = [(inner, high), (inner, low), (outer, low), (outer, high)]
        outline = [(r * math.cos(a), r * math.sin(a)) for r, a in corners]
        lean = math.pi / 2 - (low + high) / 2 if turned else 0.0
        scene.add_prism(outline, y, depth, scene.notes["density"], lean=lean)


def thinnest(half: float) -> float:
    """About the least thickness that stands, of the radius: .1075 for a semicircle (Milankovitch
    1907, joints towards the centre), less for flatter ones."""
    return 0.1075 * min(half / 1.5708, 1) ** 4


def add_abutments(scene: Scene, low: float, high: float, thickness: float, depth: float) -> None:
    """Static stones below the springings of an arch."""
    inner, outer = 1 - 0.7 * thickness, 1 + 0.7 * thickness
    for first, last in ((low - 0.3, low), (high, high + 0.3)):
        corners = [(inner, last), (inner, first), (outer, first), (outer, last)]
        outline = [(r * math.cos(a), r * math.sin(a)) for r, a in corners]
        scene.add_prism(outline, 0, depth, 1, "static")


def arch(random: Random, size: Optional[int]) -> Scene:
    """A semicircle of wedges around its limit t/R = .1075, or a flatter one, on fixed abutments."""
    scene = Scene(random.choice((0.7, 0.7, random.uniform(0.25, 1.0))), picture=True)
    count = size or random.choice((random.randint(5, 25), random.randint(5, 101)))
    half = random.choice((math.pi / 2, math.pi / 2, random.uniform(0.6, 1.5)))
    thickness = thinnest(half) * random.choice((near(random, 1e-3, 0.3), random.uniform(0.8, 3)))
    depth = random.uniform(0.05, 0.5)
    low, high = math.pi / 2 - half, math.pi / 2 + half
    scene.notes.update(stones=count, t_over_R=thickness, half_angle=half)
    scene.notes["density"] = spread(random, 100, 8000)
    if half > 1.55:
        scene.add_floor(random.random() < 0.5)
    else:
        add_abutments(scene, low, high, thickness, depth)
    angles = [low + 2 * half * k / count for k in range(count + 1)]
    if random.random() < 0.3:  # stones of unequal size
        step = 2 * half / count
        angles[1:-1] = [a + random.uniform(-0.3, 0.3) * step for a in angles[1:-1]]
    ring(scene, 0, depth, thickness, angles, random.random() < 0.5)
    return scene


def vault(random: Random, size: Optional[int]) -> Scene:
    """A barrel: rings of wedges side by side, the joints of every second one shifted."""
    scene = Scene(random.uniform(0.3, 0.9))
    rings, count = random.randint(2, 4), size or random.randint(5, 17)
    half = random.choice((math.pi / 2, random.uniform(0.8, 1.4)))
    thickness = thinnest(half) * random.choice((random.uniform(0.6, 1.2), random.uniform(1, 3)))
    depth, density = random.uniform(0.05, 0.3), spread(random, 100, 8000)
    low, high = math.pi / 2 - half, math.pi / 2 + half
    scene.notes.update(stones=count, rings=rings, t_over_R=thickness, half_angle=half)
    scene.notes["density"] = density
    if half > 1.55:
        scene.add_floor(random.random() < 0.5)
    else:
        add_abutments(scene, low, high, thickness, 2 * rings * depth)
    step = 2 * half / count
    for k in range(rings):
        inside = [low + step * (j + (0.5 if k % 2 else 0)) for j in range(count)]
        angles = [*inside, high] if k % 2 == 0 else [low, *inside, high]
        ring(scene, (2 * k - rings + 1) * depth, depth, thickness, angles, random.random() < 0.5)
    return scene


def lintel(random: Random, size: Optional[int]) -> Scene:
    """A flat arch: wedges in a row between abutments, the joints leaning by any angles: also the
    wrong way, held by nothing but friction."""
    scene = Scene(random.uniform(0.2, 1.0), picture=True)
    count = size or random.randint(1, 15)
    height, depth = random.uniform(0.3, 1.5), random.uniform(0.1, 0.5)
    wrong = random.random() < 0.3
    most = random.uniform(0.5, 1.5) * math.atan(scene.friction) if wrong else 0.35
    widths = [random.uniform(0.3, 1.0) for _ in range(count)]
    reach = sum(widths) / 2
    edges = [sum(widths[:k]) - reach for k in range(count + 1)]
    leans = [x / reach * most * random.uniform(0.8, 1.2) for x in edges]
    if wrong:
        leans = [random.uniform(-most, most) for _ in edges]
    leans = [min(max(lean, -0.14 / height), 0.14 / height) for lean in leans]
    below = [(x, 0.0) for x in edges]
    above = [(x + height * math.tan(lean), height) for x, lean in zip(edges, leans)]
    density = spread(random, 100, 8000)
    scene.notes.update(stones=count, height=height, wrong=wrong)
    for k in range(count):
        outline = [below[k], below[k + 1], above[k + 1], above[k]]
        scene.add_prism(outline, 0, depth, density)
    left, right = -reach - 1, reach + 1
    scene.add_prism([(left, 0), below[0], above[0], (left, height)], 0, depth, 1, "static")
    scene.add_prism([below[-1], (right, 0), (right, height), above[-1]], 0, depth, 1, "static")
    return scene


# --- walls, towers ------------------------------------------------------------------------------


def wall(random: Random, size: Optional[int]) -> Scene:
    """Dry stone: courses of flush boxes with joints at random; some lean, some have a hole."""
    scene = Scene(random.uniform(0.2, 0.9), picture=True)
    courses, length = size or random.randint(2, 9), random.uniform(2, 8)
    depth, density = random.uniform(0.1, 0.5), spread(random, 100, 8000)
    hole = random.random() < 0.4
    lean = random.choice((0.0, 0.0, random.uniform(0, 0.4)))
    scene.add_floor(random.random() < 0.5)
    z = 0.0
    for course in range(courses):
        height, x = random.uniform(0.15, 0.5), -length / 2
        for piece in pieces(random, length, 0.3, 1.2):
            middle = x + piece / 2
            left_out = hole and 0 < course < courses - 1 and random.random() < 0.15
            if not left_out:
                half = (piece / 2, depth, height / 2)
                scene.add_box((middle, 0, z + height / 2), half, density)
            x += piece
        z += height
    scene.notes.update(courses=courses, length=length, hole=hole, lean=lean)
    return scene.turned("y", lean, gravity=False) if lean else scene


def tilted_pile(random: Random, size: Optional[int]) -> Scene:
    """Stacks and pyramids of boxes on a tilted plane."""
    scene = Scene(random.uniform(0.2, 0.9), picture=True)
    rows, tilt = size or random.randint(1, 6), math.atan(scene.friction)
    tilt *= random.choice((near(random, 1e-4, 0.3), random.uniform(0.1, 1.1)))
    edge, density = random.uniform(0.2, 0.6), spread(random, 100, 8000)
    depth, height = random.uniform(0.3, 0.6), edge * random.uniform(0.3, 1)
    apart = random.choice((0.0, 0.02))
    scene.add_floor(random.random() < 0.5)
    for row in range(rows):
        for k in range(rows - row):
            x = (2 * edge + apart) * (k - (rows - row - 1) / 2)
            half = (edge, depth, height)
            scene.add_box((x, 0, (2 * row + 1) * height), half, density)
    scene.notes.update(rows=rows, tilt=tilt, share_of_friction=math.tan(tilt) / scene.friction)
    return scene.turned("y", tilt, gravity=False)


def corbel(random: Random, size: Optional[int]) -> Scene:
    """Bricks on bricks, each pushed out by chance, some with a counterweight; most would fall."""
    scene = Scene(random.uniform(0.3, 0.8), picture=True)
    count, density = size or random.randint(2, 14), spread(random, 100, 8000)
    scene.add_floor(random.random() < 0.5)
    x = z = 0.0
    bias = random.uniform(0, 0.4)
    for k in range(count):
        height, half = random.uniform(0.05, 0.2), random.uniform(0.3, 0.6)
        scene.add_box((x, 0, z + height), (half, 0.2, height), density)
        z += 2 * height
        x += random.uniform(-0.25, 0.25) + bias * 0.5 * random.random()
    scene.notes.update(bricks=count, bias=bias)
    return scene


def overhang(random: Random, size: Optional[int]) -> Scene:
    """The harmonic overhang over a table's edge, by a share of what it can reach."""
    scene = Scene(random.uniform(0.1, 0.9), picture=True)
    count, share = size or random.randint(1, 20), near(random, 1e-9, 0.1)
    half, height = random.uniform(0.3, 0.6), random.uniform(0.02, 0.2)
    scene.add("static", (-5, 0, -0.5), Shape("box", (5, 2, 0.5)))
    edge, density = 0.0, spread(random, 100, 8000)
    for k in range(count, 0, -1):
        edge += share * half / k
        z = (2 * (count - k) + 1) * height
        scene.add_box((edge - half, 0, z), (half, 0.2, height), density)
    scene.share = share
    scene.notes.update(bricks=count, share_less_1=share - 1)
    return scene


def jenga(random: Random, size: Optional[int]) -> Scene:
    """A tower of three blocks a level, crosswise, some taken out."""
    scene = Scene(random.uniform(0.2, 0.8))
    levels, taken = size or random.randint(2, 14), random.uniform(0, 0.55)
    gap = random.choice((0.0, 0.002))
    thick, high, density = 0.5, random.uniform(0.15, 0.3), spread(random, 100, 8000)
    scene.add_floor(random.random() < 0.5)
    for level in range(levels):
        left = [k for k in (-1, 0, 1) if random.random() > taken or level == levels - 1]
        for k in left or [random.choice((-1, 0, 1))]:
            across, along = (thick / 2, 1.5 * thick)[:: 1 if level % 2 else -1], k * (thick + gap)
            centre = (along, 0.0) if level % 2 else (0.0, along)
            scene.add_box((*centre, (2 * level + 1) * high), (*across, high), density)
    scene.notes.update(levels=levels, taken=taken, gap=gap)
    return scene


def slope(random: Random, size: Optional[int]) -> Scene:
    """One box on a tilted plane, at a share of its friction, too flat to tip."""
    scene = Scene(spread(random, 0.05, 1.0), picture=True)
    share = near(random, 1e-9, 0.1)
    half = (random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.05, 0.15))
    scene.add_floor(random.random() < 0.5)
    heading = about("z", random.choice((0.0, random.uniform(0, 6.3))))
    if heading[3]:
        scene.picture = False
    scene.add_box((0, 0, half[2]), half, spread(random, 1, 1e5), turn=heading)
    scene.share = share
    scene.notes.update(share_less_1=share - 1)
    return scene.turned("y", math.atan(share * scene.friction), gravity=False)

"""The smallest script: an LCP with two variables, and a box that slides and stops dead."""

import perp

r = perp.lcp([[2, 1], [1, 2]], [-1, 1])
print(f"{r.outcome}: z = {r.z}, w = {r.w}")

world = perp.World()
world.ground.add_plane((0, 0, 1), 0, friction=0.5)
box = world.add_body(mass=1, position=(0, 0, 0.5), velocity=(3, 0, 0))
box.add_box((0.5, 0.5, 0.5), friction=0.5)
world.run(1.0, 0.001)
print(f"position {box.position}, velocity {box.velocity}")

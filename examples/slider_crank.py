"""A crank that a motor turns pushes a piston to and fro, against dry friction in its bore.

The piston is where r cos(a) + sqrt(l^2 - r^2 sin(a)^2) puts it, a the crank's angle. Then the motor gets
too weak: friction stops it all, at velocity 0.0, and holds the motor's torque over the lever of the crank."""

import math

import numpy as np

import perp

R, L = 0.2, 0.5  # crank and rod
SPEED, TORQUE = 5.0, 40.0
FRICTION = 30.0  # of the piston, N


def build():
    """In the plane, without gravity: crank, rod and piston in line to begin with."""
    world = perp.World(gravity=(0, 0), planar=True)
    crank = world.add_body(mass=1.0, inertia=R * R / 12, position=(R / 2, 0))
    rod = world.add_body(mass=0.5, inertia=0.5 * L * L / 12, position=(R + L / 2, 0))
    piston = world.add_body(mass=2.0, inertia=1.0, position=(R + L, 0))
    axle = world.add_joint("revolute", world.ground, crank, anchor=(0, 0))
    world.add_joint("revolute", crank, rod, anchor=(R, 0))
    world.add_joint("revolute", rod, piston, anchor=(R + L, 0))
    bore = world.add_joint("prismatic", world.ground, piston, axis=(1, 0), friction=FRICTION)
    return world, axle, bore


def place(angle):
    return R * math.cos(angle) + math.sqrt(L * L - (R * math.sin(angle)) ** 2) - (R + L)


def main():
    world, axle, bore = build()
    axle.motor = SPEED, TORQUE
    h, off = 2e-3, 0.0
    for _ in range(2000):
        world.step(h)
        off = max(off, abs(bore.position - place(axle.position)))
    print(f"{axle.position / (2 * math.pi):.2f} turns, at {axle.speed:.6f} rad/s")
    print(f"piston off its place by {off:.10f} m at most")
    axle.motor = SPEED, 2.0
    world.run(3.0, h)
    speeds = np.abs(world.velocities[:3]).max()
    print(f"with 2 Nm it stands at {axle.position % math.pi:.3f} rad, largest velocity {speeds}")
    angle, eps = axle.position, 1e-6
    lever = abs(place(angle + eps) - place(angle - eps)) / (2 * eps)
    held = abs(bore.reaction.friction) / h
    print(f"friction holds {held:.3f} N: 2 Nm over {lever:.4f} m is {2 / lever:.3f}")


if __name__ == "__main__":
    main()

"""What a second thread gives perp.mujoco.rollout, beside what it gives work that shares nothing.

    bench/run build mujoco_threads       needs mujoco and gymnasium

sha256: eight sums of 30 MB; rollout: 16 runs of gymnasium's humanoid, 400 steps each. Both are made
by one thread and by two, 20 times in turns. wall: time of one over time of two; processor: what two
take of it, over what one takes; waits: how often a thread of two gave its processor away, waiting.
Numbers are medians. What else runs on the machine takes from 'wall', of both lines alike.
"""

import hashlib
import os
import resource
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import mujoco
import numpy as np

import perp.mujoco

BYTES = bytes(30_000_000)


def sums(threads):
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(hashlib.sha256, [BYTES] * 8))


def rollouts():
    folder = os.path.join(os.path.dirname(gymnasium.__file__), "envs", "mujoco", "assets")
    model = mujoco.MjModel.from_xml_path(os.path.join(folder, "humanoid.xml"))
    spec, data = mujoco.mjtState.mjSTATE_FULLPHYSICS, mujoco.MjData(model)
    state = np.zeros(mujoco.mj_stateSize(model, spec))
    mujoco.mj_getState(model, data, state, spec)
    controls = np.random.default_rng(0).uniform(-1.0, 1.0, (16, 400, model.nu))
    return lambda threads: perp.mujoco.rollout(model, state, controls, threads=threads)


def measure(work, threads):
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    work(threads)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, spent, after.ru_nvcsw - before.ru_nvcsw


def main():
    doc = __doc__.split("\n    bench/run")
    lines = [doc[0], "", __doc__[__doc__.index("sha256") :].strip(), ""]
    lines += [os.environ.get("MACHINE", ""), f"mujoco {mujoco.__version__}", ""]
    lines.append(f"{'work':8} {'wall':>6} {'processor':>10} {'waits':>6}")
    works = {"sha256": sums, "rollout": rollouts()}
    found = {name: [] for name in works}
    for _ in range(20):
        for name, work in works.items():
            found[name].append([measure(work, threads) for threads in (1, 2)])
    for name, times in found.items():
        one, two = np.array(times).transpose(1, 2, 0)
        wall, spent = np.median(one[0] / two[0]), np.median(two[1] / one[1])
        lines.append(f"{name:8} {wall:6.2f} {spent:10.3f} {np.median(two[2]):6.0f}")
        print(lines[-1], file=sys.stderr, flush=True)
    if len(sys.argv) == 2:
        with open(os.path.join(sys.argv[1], "mujoco_threads.txt"), "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

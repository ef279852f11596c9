"""Steps a second of gymnasium's environments: as they are, and wrapped by perp.mujoco.wrap.

    bench/run build gymnasium_steps   needs mujoco and gymnasium

Each environment is made twice, one of them wrapped, and both are given the same random actions, new
ones each step, 20 at a time in turns; what has fallen begins anew. frames: MuJoCo's steps in one of
the environment's. Numbers are steps a second of the thread's processor, from the mean of 600 steps
and from their median; share: perp's over MuJoCo's.
"""

import os
import sys
import time

import gymnasium
import mujoco
import numpy as np

import perp.mujoco

NAMES = (
    "Ant-v5", "Humanoid-v5", "HumanoidStandup-v5", "Hopper-v5", "Walker2d-v5", "HalfCheetah-v5",
    "Pusher-v5", "Reacher-v5", "Swimmer-v5", "InvertedDoublePendulum-v5",
)  # fmt: skip


def measure(name):
    """Frames of a step, and both times of each step in seconds."""
    plain = gymnasium.make(name)
    both = plain, perp.mujoco.wrap(gymnasium.make(name), rigid=True)
    times, space = ([], []), plain.action_space
    rng = np.random.default_rng(0)
    for env in both:
        env.reset(seed=0)
    for block in range(30):
        actions = rng.uniform(space.low, space.high, (20, *space.shape))
        for env, taken in zip(both, times):
            for action in actions:
                began = time.thread_time_ns()
                _, _, terminated, truncated, _ = env.step(action)
                taken.append((time.thread_time_ns() - began) * 1e-9)
                if terminated or truncated:
                    env.reset(seed=block)
    return plain.unwrapped.frame_skip, np.array(times)


def main():
    head = f"{'':26} {'':6} {'mean':>8} {'':8} {'':6} {'median':>8}\n{'environment':26} frames"
    head += f" {'MuJoCo':>8} {'perp':>8} {'share':>6}" * 2
    lines = [__doc__.split("\n")[0], "", __doc__[__doc__.index("Each") :].strip(), ""]
    lines += [os.environ.get("MACHINE", "")]
    lines += [f"mujoco {mujoco.__version__}, gymnasium {gymnasium.__version__}", "", head]
    for name in NAMES:
        frames, times = measure(name)
        line = f"{name:26} {frames:6d}"
        for theirs, ours in (1.0 / times.mean(axis=1), 1.0 / np.median(times, axis=1)):
            line += f" {theirs:8.0f} {ours:8.0f} {ours / theirs:6.2f}"
        lines.append(line)
        print(line, file=sys.stderr, flush=True)
    if len(sys.argv) == 2:
        with open(os.path.join(sys.argv[1], "gymnasium_steps.txt"), "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

"""What the scripts of this folder share: the command line, and the look of their pictures."""

import argparse
import os
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

G = 9.81


def run(name, text, report, draw, panels, size):
    """Prints what report() has to say, and has draw(axes, what it returned) draw it."""
    parser = argparse.ArgumentParser(description=" ".join(text.split("\n\n")[0].split()))
    parser.add_argument("--output", default=".", help=f"folder for {name}.png and .svg")
    parser.add_argument("--no-picture", action="store_true")
    arguments = parser.parse_args()
    data = report()
    if arguments.no_picture:
        return
    from pictures import paint

    for path in paint(arguments.output, name, lambda axes: draw(axes, data), panels, size, dpi=100):
        print("wrote", path)


def bisect(is_above, low, high, steps=50):
    """The number between low and high at which is_above turns true."""
    for _ in range(steps):
        middle = (low + high) / 2
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return (low + high) / 2


def at(times, t, x):
    """The columns of x, known at the times t, at others: steps of a chosen length end anywhere."""
    import numpy as np

    return np.column_stack([np.interp(times, t, column) for column in x.T])

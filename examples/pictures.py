"""What the pictures of this folder share: their look, and the numbers that they draw.

A picture NAME.png has NAME.json beside it, which says what is drawn: limits, points, words. The
picture carries the hash of that file, so that it is seen to be of these numbers; the tests draw it
anew and compare (tests/docs/drawn.py). `make pictures` renews those of docs/.
"""

import hashlib
import json
import math
import os

import numpy as np

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.colors import LinearSegmentedColormap  # noqa: E402

INK, QUIET, GROUND = "#22303c", "#8795a1", "#dfe5ea"
BLUE, RED, SAND = "#1f6f9f", "#c8452f", "#f3e6cf"
CHAOS = "chaos"  # the gid of a panel in which rounding decides where things are
TIME = LinearSegmentedColormap.from_list("time", ["#bcd8e8", "#1f6f9f", "#12283a"])

STYLE = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.titlesize": 11.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 24,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "svg.hashsalt": "perp",
}


def subtitle(axes, text):
    axes.annotate(
        text, (0, 1), (0, 9), "axes fraction", textcoords="offset points", color=QUIET, fontsize=9.5
    )


def capsule(axes, x, y, angle, **style):
    """The outline of a rod of 0.5 m between the centres of its caps, which have radius 0.05 m."""
    around = np.linspace(-math.pi / 2, math.pi / 2, 24)
    cap = np.column_stack([0.25 + 0.05 * np.cos(around), 0.05 * np.sin(around)])
    shape = np.vstack([cap, -cap])
    c, s = math.cos(angle), math.sin(angle)
    turned = shape @ np.array([[c, s], [-s, c]])
    axes.fill(turned[:, 0] + x, turned[:, 1] + y, **style)


def paint(folder, name, draw, panels, size, dpi=110, **grid):
    """Has draw(axes) fill as many panels; writes NAME.png, .svg and .json, returns their paths."""
    os.makedirs(folder, exist_ok=True)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            1, panels, figsize=size, layout="constrained", squeeze=False, **grid
        )
        figure.get_layout_engine().set(w_pad=0.15, h_pad=0.12, wspace=0.04)
        draw(axes[0])
        figure.canvas.draw()
        text = drawn(figure)
        paths = [os.path.join(folder, f"{name}.{kind}") for kind in ("png", "svg", "json")]
        digest = hashlib.sha256(text.encode()).hexdigest()
        figure.savefig(paths[0], dpi=dpi, metadata={"Drawn": digest})
        figure.savefig(paths[1], metadata={"Date": None})
        with open(paths[2], "w", encoding="utf-8") as file:
            file.write(text)
        plt.close(figure)
    return paths


def drawn(figure):
    """What a figure shows, as JSON: a line for each curve, area, image and word."""
    lines = []
    for axes in figure.findobj(matplotlib.axes.Axes):
        lines.append({
            "panel": axes.get_title("left") or axes.get_title(),
            "x": [axes.get_xscale(), *numbers(axes.get_xlim()), axes.get_xlabel()],
            "y": [axes.get_yscale(), *numbers(axes.get_ylim()), axes.get_ylabel()],
        })
        if axes.get_gid() == CHAOS:
            lines[-1]["chaos"] = True
        lines += [curve("line", line.get_label(), *line.get_data()) for line in axes.lines]
        to_data = axes.transData.inverted()
        for patch in axes.patches:
            path = patch.get_path().transformed(patch.get_transform() + to_data)
            lines.append(curve("area", "", *path.vertices.T))
        for collection in axes.collections:
            if collection.get_array() is not None:
                lines.append({"image": image(collection.get_array())})
            else:
                for path in collection.get_paths():
                    lines.append(curve("area", "", *path.vertices.T))
        lines += [{"image": image(picture.get_array())} for picture in axes.images]
        lines += [
            {"words": text.get_text(), "at": numbers(text.get_position())} for text in axes.texts
        ]
    return "[\n" + ",\n".join(json.dumps(line, ensure_ascii=False) for line in lines) + "\n]\n"


def numbers(values):
    """Five digits are more than a picture shows; None where nothing is drawn."""
    return [float(f"{x:.5g}") if math.isfinite(x) else None for x in np.ravel(values).tolist()]


def curve(kind, label, x, y, most=40):
    """As many of the points at most, evenly chosen, the ends among them."""
    x, y = (np.ma.filled(np.ma.asarray(part, float), np.nan) for part in (x, y))
    chosen = np.unique(np.linspace(0, len(x) - 1, min(len(x), most)).round().astype(int))
    label = "" if label.startswith("_") else label
    return {kind: label, "x": numbers(x[chosen]), "y": numbers(y[chosen])}


def image(array, most=12):
    """As many of its rows and columns at most."""
    array = np.ma.filled(np.ma.asarray(array, float), np.nan)
    for axis in range(min(array.ndim, 2)):
        count = array.shape[axis]
        array = array.take(np.linspace(0, count - 1, min(count, most)).round().astype(int), axis)
    return numbers(array)

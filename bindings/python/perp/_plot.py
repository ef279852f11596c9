"""Pictures of results, by matplotlib, which is imported when one is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

_COLOURS = {"stick": "tab:green", "slip": "tab:red", "separate": "tab:gray"}


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("plots need matplotlib: pip install 'perp[plot]'") from None
    return pyplot


def panels(pictures: list[Any], axes: Any = None) -> Any:
    """Draws pictures, (function, arguments) each, side by side; returns the figure."""
    if axes is None:
        size = (4.8 * len(pictures), 3.6)
        _, table = _pyplot().subplots(
            1, len(pictures), figsize=size, squeeze=False, layout="constrained"
        )
        axes = table[0]
    axes = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(axes) != len(pictures):
        raise ValueError(f"axes has {len(axes)} entries for {len(pictures)} pictures")
    for axis, (draw, arguments) in zip(axes, pictures):
        draw(axis, *arguments)
    return axes[0].figure


def residuals(axis: Any, history: Any) -> None:
    """The residual at each call of the monitor, method by method."""
    values = np.array([entry.residual for entry in history], dtype=float)
    values[~(values > 0)] = np.nan  # no logarithm
    methods = np.array([entry.method for entry in history])
    for method in dict.fromkeys(methods.tolist()):
        axis.semilogy(np.where(methods == method, values, np.nan), ".-", label=method)
    axis.set(xlabel="call of the monitor", ylabel="residual")
    if len(history):
        axis.legend()


def complements(axis: Any, z: Any, w: Any) -> None:
    """z and w, an index each."""
    index = np.arange(len(z))
    axis.plot(index, z, "o", fillstyle="none", label="z")
    axis.plot(index, w, "x", label="w")
    axis.axhline(0, color="black", linewidth=0.5)
    axis.set(xlabel="index")
    axis.legend()


def impulses(axis: Any, normal: Any, modes: Any) -> None:
    """The normal impulse of each contact, coloured by its mode."""
    axis.bar(np.arange(len(normal)), normal, color=[_COLOURS[mode] for mode in modes])
    axis.set(xlabel="contact", ylabel="normal impulse")


def cones(axis: Any, normal: Any, friction: Any, bound: Any, modes: Any) -> None:
    """Friction beside its bound, mu times the normal impulse: what slips lies on the line."""
    top = max(float(bound.max(initial=0.0)), float(friction.max(initial=0.0)))
    axis.plot([0, top or 1.0], [0, top or 1.0], color="black", linewidth=0.8, label="cone")
    for mode, colour in _COLOURS.items():
        chosen = modes == mode
        if chosen.any():
            axis.plot(bound[chosen], friction[chosen], "o", color=colour, label=mode)
    axis.set(xlabel="mu times normal impulse", ylabel="friction impulse")
    axis.legend()


def courses(axis: Any, t: Any, values: Any, name: str) -> None:
    """Columns over time."""
    for column, course in enumerate(np.asarray(values).T):
        axis.plot(t, course, label=f"{name}[{column}]")
    axis.set(xlabel="t", ylabel=name)
    if 0 < np.shape(values)[1] <= 8:
        axis.legend()

"""The words that arguments and results may have, for type checkers and completion."""

from __future__ import annotations

from typing import Literal

LcpMethod = Literal["auto", "lemke", "pgs", "fischer", "active_set"]
NcpMethod = Literal["auto", "fischer", "josephy"]
ContactMethod = Literal["auto", "sweep", "newton", "lemke", "admm", "proximal"]
PivotRule = Literal["harris", "lexicographic"]
Sweep = Literal["forward", "symmetric"]
AccelerationMethod = Literal["none", "conjugate_gradient"]
Accuracy = Literal["fast", "standard", "accurate", "exact"]
Scheme = Literal["frozen", "implicit", "theta"]
Selection = Literal["any", "nearest", "freest"]
ImpactLaw = Literal["moreau", "newton", "poisson", "stronge"]
BodyKind = Literal["dynamic", "static", "kinematic"]
JointKind = Literal[
    "ball",
    "revolute",
    "prismatic",
    "fixed",
    "screw",
    "cylindrical",
    "planar",
    "distance",
]
StaticsObjective = Literal["least", "interior"]
StaticsVerdict = Literal["stands", "falls", "indeterminate"]
Outcome = Literal[
    "solved",
    "rounding_limit",
    "ray",
    "iteration_limit",
    "time_limit",
    "stalled",
    "singular",
    "stopped",
    "evaluation_failed",
]

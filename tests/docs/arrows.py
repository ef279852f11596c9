"""The map of CONTRIBUTING.md, held against the includes: which layer may know which.

A layer's file includes headers of its own layer, and interfaces of those that its arrow leads to. The
files of layers do not lead back to themselves by way of another layer. The mechanism is a library of
its own: of libperp's it includes no interface but the public one, and what the Makefile's COMMON gives it.
"""

import os
import re

from pages import ROOT

# The interfaces of a layer; all headers of the first three are for everybody above.
SHARED = ("base", "linalg", "patterns", "step")
INTERFACES = {
    "lcp/lcp.h",
    "lcp/fischer/newton.h",  # ncp's Newton is lcp's
    "contact/contact.h",
    "contact/coloured/coloured.h",  # sweeps over a whole step of a world
    "contact/statics/statics.h",  # what of a world can rest
}


def below():
    """Each layer of the map with those that its arrow leads to."""
    with open(os.path.join(ROOT, "CONTRIBUTING.md"), encoding="utf-8") as page:
        chain = re.search(r"Arrows point one way: ([^.]*)\.", page.read()).group(1)
    floors = [[name.strip() for name in floor.split(",")] for floor in chain.split("->")]
    under = {}
    for level, floor in enumerate(floors):
        for place, layer in enumerate(floor):
            lower = [name for names in floors[level + 1 :] for name in names]
            under[layer] = set(floor[place + 1 :] + lower) if level else set(lower)
    return under


def check():
    """(file, header, what is wrong or None) for each include of another layer."""
    under = below()
    found = []
    for folder, _, names in os.walk(os.path.join(ROOT, "src")):
        for name in sorted(names):
            if not name.endswith((".c", ".h")):
                continue
            path = os.path.relpath(os.path.join(folder, name), ROOT)
            layer = path.split(os.sep)[1]
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                headers = re.findall(r'^#include "([^"]+)"', file.read(), re.M)
            for header in headers:
                other = header.split("/")[0]
                if other == layer:
                    continue
                wrong = None
                if layer == "mechanism" and other not in SHARED:
                    wrong = f"includes {header}, which is inside of the other library"
                elif other not in under[layer]:
                    wrong = f"includes {header}, which is not below it"
                elif other not in SHARED and header not in INTERFACES:
                    wrong = f"includes {header}, which is private to {other}"
                found.append((path, header, wrong))
    return found

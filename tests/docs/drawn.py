"""Pictures show what their scripts draw today.

A picture has its numbers beside it (NAME.json, or NAME.txt for a table of bench/results) and
carries the hash of that file. What is drawn today may differ from the committed numbers by what an
eye does not see: half a hundredth of a panel's width or height. In a panel of chaos the rounding of
a processor decides on the places, so that there only the kinds and the number of things compare.
"""

import hashlib
import json
import math
import os
import struct

from pages import ROOT, files

UNSEEN = 0.005


def words_of_png(path):
    """The texts that a PNG file carries."""
    with open(path, "rb") as file:
        data = file.read()
    place, found = 8, {}
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        if kind == b"tEXt":
            key, _, value = data[place + 8 : place + 8 + length].partition(b"\0")
            found[key.decode()] = value.decode()
        place += 12 + length
    return found


def pictures():
    return [path for path in files() if path.endswith(".png")]


def numbers_of(picture):
    """The file with what a picture shows."""
    name = picture[: -len(".png")]
    return next((name + end for end in (".json", ".txt") if name + end in files()), None)


def hashes():
    """(picture, what is checked, what is wrong or None)."""
    for picture in pictures():
        numbers = numbers_of(picture)
        wrong = "has no numbers beside it"
        if numbers:
            with open(os.path.join(ROOT, numbers), "rb") as file:
                digest = hashlib.sha256(file.read()).hexdigest()
            drawn = words_of_png(os.path.join(ROOT, picture)).get("Drawn")
            wrong = None if drawn == digest else f"is not of {numbers}"
        yield picture, "is of its numbers", wrong


def place(x, axis):
    """Where a number is on an axis (scale, from, to, label): 0 at its begin, 1 at its end."""
    scale, begin, end = axis[:3]
    if x is None:
        return None
    if scale == "log":
        if x <= 0:
            return None
        x, begin, end = math.log(x), math.log(begin), math.log(end)
    return min(max((x - begin) / (end - begin), -1), 2)  # what is out of sight is all the same


def differ(mine, theirs, axis):
    a, b = ([place(x, axis) for x in values] for values in (mine, theirs))
    return len(a) != len(b) or any(
        (p is None) != (q is None) or (p is not None and abs(p - q) > UNSEEN) for p, q in zip(a, b)
    )


def difference(old, new):
    """What two lists of drawn things differ in, or None."""
    if len(old) != len(new):
        return f"{len(new)} things are drawn instead of {len(old)}"
    x = y = None
    chaos = False
    for was, now in zip(old, new):
        if "panel" in was:
            x, y = was["x"], was["y"]
            chaos = now.get("chaos", False)
            same = was["panel"] == now.get("panel") and all(
                was[a][0] == now[a][0] and was[a][3] == now[a][3]
                and not differ(was[a][1:3], now[a][1:3], was[a]) for a in "xy"
            )
        elif chaos:
            same = was.keys() == now.keys()
        elif "image" in was:
            scale = max((abs(x) for x in was["image"] if x), default=1)
            same = not differ(was["image"], now.get("image", []), ("linear", 0, scale))
        elif "words" in was:
            same = was["words"] == now.get("words")
        else:
            kind = next(iter(was))
            same = was[kind] == now.get(kind)
            same = same and not differ(was["x"], now["x"], x) and not differ(was["y"], now["y"], y)
        if not same:
            return f"{short(was)} is now {short(now)}"
    return None


def short(thing):
    text = json.dumps(thing, ensure_ascii=False)
    return text if len(text) < 300 else text[:297] + "..."


def today(folder):
    """(picture, what is checked, what is wrong or None) for those drawn into a folder."""
    for picture in pictures():
        numbers = numbers_of(picture)
        if not numbers or not numbers.endswith(".json"):
            continue
        new = os.path.join(folder, os.path.basename(numbers))
        if not os.path.exists(new):
            yield picture, "is drawn by an example", "was not drawn"
            continue
        with open(os.path.join(ROOT, numbers)) as old, open(new) as now:
            wrong = difference(json.load(old), json.load(now))
        yield picture, "shows what is drawn today", wrong and f"(make pictures): {wrong}"

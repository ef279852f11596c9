"""Checks that the pages say what is so, and that the pictures show it.

    python tests/docs/check.py          what can be seen in the files
    python tests/docs/check.py FOLDER   what the examples have printed there, and drawn in FOLDER/run

See names.py, quotes.py, drawn.py and arrows.py. The last line is 'N passed, N failed'.
"""

import os
import sys

import arrows
import drawn
import names
import quotes


def main():
    if sys.argv[1:]:
        folder = sys.argv[1]
        found = [*quotes.check(folder), *drawn.today(os.path.join(folder, "run"))]
        least = 1
    else:
        found = [*names.check(), *quotes.check(), *drawn.hashes(), *arrows.check()]
        least = 2000  # the pages name that much: a check that finds less has gone blind
    failures = [(page, what, wrong) for page, what, wrong in found if wrong]
    if len(found) < least:
        failures.append(("the checks", f"found {len(found)} names", f"not {least}"))
    for page, what, wrong in failures:
        print(f"FAILED {page}: {what} {wrong}")
    print(f"{len(found) - len(failures)} passed, {len(failures)} failed")
    return len(failures) > 0


if __name__ == "__main__":
    sys.exit(main())

"""Checks that what the pages name is there: links, files as `folder/file`, tests as `file:test`."""

import os
import re
import subprocess
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
TOP = "src|include|tests|examples|docs|bench|bindings|scripts|perp"
NAMED = re.compile(rf"`((?:{TOP})/[\w./*-]*\w\*?/?)(?::(\w+))?`")
LINK = re.compile(r"\]\(([^)#\s]+)")


def pages():
    listed = subprocess.run(
        ["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True
    ).stdout.split()
    folders = ("", "docs", "examples", "bindings/python", "bench/results")
    found = listed or [  # of an archive without its history
        os.path.join(folder, name)
        for folder in folders
        if os.path.isdir(os.path.join(ROOT, folder))
        for name in os.listdir(os.path.join(ROOT, folder))
        if name.endswith(".md")
    ]
    return sorted(p for p in found if "third_party" not in p)


def missing_name(path, test):
    """What is wrong with `path:test`, or None; perp/x.h is a public header."""
    if "*" in path:
        return None
    place = os.path.join(ROOT, "include" if path.startswith("perp/") else "", path)
    if not os.path.exists(place):  # a program has the name of its source
        return None if os.path.exists(place + ".c") else "does not exist"
    if test:
        with open(place) as file:
            if not re.search(rf"\b{test}\b", file.read()):
                return f"has no {test}"
    return None


def problems(page):
    """(what was looked for, what is wrong or None) of one page."""
    with open(os.path.join(ROOT, page)) as file:
        text = file.read()
    for path, test in NAMED.findall(text):
        yield path + (":" + test if test else ""), missing_name(path, test)
    for link in LINK.findall(re.sub(r"```.*?```", "", text, flags=re.S)):
        if "://" not in link and not link.startswith("mailto:"):
            place = os.path.join(ROOT, os.path.dirname(page), link)
            yield link, None if os.path.exists(place) else "does not exist"


def main():
    passed = failed = 0
    for page in pages():
        for what, wrong in problems(page):
            passed, failed = (passed, failed + 1) if wrong else (passed + 1, failed)
            if wrong:
                print(f"FAILED {page}: {what} {wrong}")
    if passed < 100:
        failed += 1
        print(f"FAILED only {passed} names were found: the pages name more")
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())

"""What the checks of this folder read: the repository's files, its pages, the words of its code."""

import functools
import os
import re
import subprocess

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
DATA = (".png", ".mtx", ".h5", ".hdf5", ".xml", "tests/fuzz/corpus/", "third_party/")


@functools.lru_cache(None)
def files():
    """Every file of the repository; of an archive without its history all but what is built."""
    run = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if run.returncode == 0:
        return [path for path in run.stdout.split("\n") if os.path.isfile(os.path.join(ROOT, path))]
    found = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in ("build", "__pycache__", ".git")]
        found += [os.path.relpath(os.path.join(folder, name), ROOT) for name in names]
    return sorted(found)


@functools.lru_cache(None)
def read(path):
    with open(os.path.join(ROOT, path), errors="replace") as file:
        return file.read()


def texts():
    """The files that people write."""
    return [path for path in files() if not any(part in path for part in DATA)]


def pages():
    return [path for path in texts() if path.endswith(".md")]


def headers():
    return [path for path in texts() if path.startswith("include/")]


def exists(path):
    """Whether a file or a folder of the repository has this name; `*` stands for anything."""
    path = os.path.normpath(path)
    if "*" in path:
        pattern = re.compile(re.escape(path).replace(r"\*", "[^/]*") + "$")
        return any(map(pattern.match, files()))
    return path in files() or any(name.startswith(path + "/") for name in files())


def without_comments(path):
    text = read(path)
    return re.sub(r"/\*.*?\*/", "", text, flags=re.S) if path.endswith((".c", ".h")) else text


@functools.lru_cache(None)
def words(inner=False):
    """Every word of what a user meets, or, with `inner`, of all code: a page that names another
    means something that is no more."""
    found = set()
    for path in texts():
        if path.endswith((".md", ".txt")) or (path.startswith(("src/", "tests/")) and not inner):
            continue
        found.update(re.findall(r"\w+", without_comments(path)))
        found.update(re.findall(r"\w+", path))
    return found

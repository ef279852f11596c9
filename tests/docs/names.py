"""Whatever a page names is there: files, tests, headings, functions, constants, targets, options.

Each check yields (what was named, what is wrong with it or None).
"""

import ast
import functools
import os
import re

from pages import exists, files, headers, pages, read, texts, without_comments, words

TOP = r"(?:src|include|tests|examples|docs|bench|bindings|scripts|\.ci|perp)"
PATH = re.compile(rf"(?<![\w/.=-])({TOP}/[\w./*-]*[\w*]/?)(?::(\w+))?(?!\.\.\.|\w|<)")
FILE = re.compile(r"(?<![\w/.*<-])([\w-]+\.(?:md|c|h|py|sh|txt|png|mtx|map|toml))\b(?!\()")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```.*?^```", re.S | re.M)
SPAN = re.compile(r"`([^`\n]+)`")
BLOCK = re.compile(r"^    \S.*$", re.M)

# Pages that speak of the inside, too.
INNER = ("CONTRIBUTING.md", "docs/abi.md", "docs/architecture.md", "docs/ncp.md", "docs/theory.md")
# What pages call any function, and C99's own.
ANY = {"perp_x", "perp__x", "fma"}


def paths(page):
    for path, test in PATH.findall(read(page)):
        name, folder = path, os.path.dirname(page)
        if path.startswith("perp/"):  # a header, or the binding's package
            name = "include/" + path if path.endswith((".h", "*")) else "bindings/python/" + path
        forms = [name, name + ".c", name + ".py", os.path.join(folder, path)]
        found = next((form for form in forms if exists(form)), None)
        wrong = None if found else "does not exist"
        if found and test and not re.search(rf"\b{test}\b", read(found)):
            wrong = f"has no {test}"
        yield path + (":" + test if test else ""), wrong


@functools.lru_cache(None)
def basenames():
    return {os.path.basename(path) for path in files()}


def single_files(page):
    for name in FILE.findall(read(page)):
        yield name, None if name in basenames() else "is the name of no file"


def anchors(page):
    """What a link can point at behind `#`, as the forges write it."""
    titles = re.findall(r"^#+ (.*)$", FENCE.sub("", read(page)), re.M)
    plain = (re.sub(r"[^\w\- ]", "", re.sub(r"\[(.*?)\]\(.*?\)", r"\1", t)) for t in titles)
    return {title.lower().replace(" ", "-") for title in plain}


def links(page):
    for link in LINK.findall(FENCE.sub("", read(page))):
        path, _, anchor = link.partition("#")
        if "://" in link or link.startswith("mailto:"):
            continue
        target = os.path.join(os.path.dirname(page), path) if path else page
        wrong = None if exists(target) else "does not exist"
        if not wrong and anchor and anchor not in anchors(os.path.normpath(target)):
            wrong = "has no such heading"
        yield link, wrong


@functools.lru_cache(None)
def interface():
    """The words of the headers, comments aside, and those of the build and the binding."""
    places = ("Makefile", ".ci/run", "scripts/", "bindings/python/", "tests/fuzz/fuzz.h")
    built = [path for path in files() if path.startswith(places)]
    code = "".join(map(without_comments, headers())) + "".join(map(read, built))
    return set(re.findall(r"\w+", code))


def interface_names(page):
    """perp_..., PERP_...; one that ends with _ or goes on with * or ... stands for all like it."""
    for name, more in re.findall(r"\b((?:perp|PERP)_\w+)(?!\.\d)(\*|\.\.\.)?", read(page)):
        if name in ANY or name in ("perp__", "PERP__"):
            known = True
        elif name.startswith(("perp__", "PERP__")):
            known = name in words(True)
        elif more or name.endswith("_"):
            known = any(word.startswith(name) for word in interface())
        else:
            known = name in interface()
        yield name, None if known else "is not in the headers"


@functools.lru_cache(None)
def package():
    """What `import perp` gives, by its source."""
    tree = ast.parse(read("bindings/python/perp/__init__.py"))
    names = {alias.asname or alias.name for node in ast.walk(tree)
             if isinstance(node, (ast.Import, ast.ImportFrom)) for alias in node.names}
    modules = {os.path.basename(path)[:-3] for path in files() if "python/perp/" in path}
    return names | modules | {"version"}


def python_names(page):
    for name, rest in re.findall(r"(?<![\w/.-])perp\.(\w+)((?:\.\w+)*)", read(page)):
        known = name in package() or f"perp.{name}" in basenames() | {"perp.pc"}
        known = known and all(part in words() for part in rest.split(".") if part)
        yield f"perp.{name}{rest}", None if known else "is not in the package"


@functools.lru_cache(None)
def targets():
    lines = re.findall(r"^([\w -]+):(?!=)", read("Makefile"), re.M)
    return {name for line in lines for name in line.split()}


def code_spans(page):
    """Words in code letters, and lines of shell that stand alone."""
    text = read(page)
    for fence in FENCE.findall(text):
        yield from fence.split("\n")[1:-1] if fence.startswith(("```sh", "```\n")) else ()
    yield from SPAN.findall(FENCE.sub("", text))
    yield from (line.strip() for line in BLOCK.findall(FENCE.sub("", text)))


def commands(page):
    """make's targets and variables, and the options of scripts."""
    for span in code_spans(page):
        for name in re.findall(r"\b([A-Z][A-Z_]+)=", span):
            yield f"{name}=", None if name in words(page in INNER) else "is read nowhere"
        span = span.split("#")[0].split("  ")[0]
        for arguments in re.findall(r"^(?:\w+=\S+ )*make\b((?: [\w=',./-]+)*)", span):
            for word in arguments.split():
                if re.fullmatch(r"[a-z][\w-]*", word) and "=" not in word:
                    yield f"make {word}", None if word in targets() else "is no target"
        for option in re.findall(r"(?<![\w-])--([a-z][\w-]*)", span):
            known = any(f"--{option}" in read(path) for path in texts() if path not in pages())
            yield f"--{option}", None if known else "is an option of nothing"


def is_word(part, known):
    """A word of the code, the begin of one, or the end of a constant."""
    if part in known or part in ANY:
        return True
    if part.isupper():
        return any(word.endswith("_" + part) for word in interface())
    return part[-1] == "_" and any(word.lower().startswith(part.lower()) for word in known)


def code_words(page):
    """A single name in code letters, perhaps with a value, is a word of the code."""
    known = words(page in INNER)
    for span in SPAN.findall(FENCE.sub("", read(page))):
        match = re.fullmatch(r"([A-Za-z_][\w.]*?)(?:\(\))?(?: ?= ?([\w.]+))?", span)
        if not match:
            continue
        parts = [part for text in match.groups() if text for part in text.split(".")]
        for part in parts:
            if len(part) > 1 and re.match(r"[A-Za-z_]", part):
                yield span, None if is_word(part, known) else f"{part} is no word of the code"


def documents(path):
    """In the sources too: a document that is named is there."""
    for name in re.findall(r"[\w./-]*\w\.md\b", read(path)):
        yield name, None if os.path.basename(name) in basenames() else "is the name of no file"
    for name in re.findall(r"(?:\.\.|/work)/shared\b[\w/.]*|\bDESIGN\b", read(path)):
        if not path.startswith("tests/docs/"):
            yield name, "is not in the repository"


def check():
    """(page, what it names, what is wrong or None) of all of them."""
    of_pages = (paths, single_files, links, interface_names, python_names, commands, code_words)
    of_history = (links, commands)  # it names what was
    for page in pages():
        for look in of_history if page == "CHANGELOG.md" else of_pages:
            yield from ((page, *found) for found in look(page))
    for header in headers():
        for look in (paths, single_files, interface_names):
            yield from ((header, *found) for found in look(header))
    for path in texts():
        yield from ((path, *found) for found in documents(path))

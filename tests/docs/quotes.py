"""Tables and paragraphs that a page quotes from measured results, or from what an example prints.

A comment before one says where its numbers are from:

    <!-- lines of bench/results/x.txt -->      the numbers of a cell stand together in one line
    <!-- numbers of examples/x.py -->          each number stands somewhere

A page rounds: 6.7e-7 is 6.69e-07. What an example prints is known where the examples are run.
"""

import os
import re

from pages import exists, pages, read

MARK = re.compile(r"<!-- (lines|numbers) of (\S+) -->\n+(.*?)(?:\n\n|\Z)", re.S)
NUMBER = re.compile(r"(?<![\w.^])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w^])")


def unit(number):
    """What one is worth in the last digit that is written."""
    digits, _, power = number.lower().partition("e")
    return 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))


def stands(number, line):
    """Whether a line has a number that rounds to this one."""
    near = 0.501 * unit(number)
    return any(abs(float(number) - float(other)) <= near for other in NUMBER.findall(line))


def cells(text):
    """The parts of a table's rows, without its head, or the whole paragraph."""
    if not text.startswith("|"):
        return [text]
    return [cell for row in text.split("\n")[2:] for cell in row.strip("|").split("|")]


def wrong_cell(kind, cell, lines):
    numbers = NUMBER.findall(re.sub(r"`[^`]*`", "", cell))
    if kind == "lines":
        together = any(all(stands(n, line) for n in numbers) for line in lines)
        return None if together else f"has no line with {', '.join(numbers)}"
    lost = [n for n in numbers if not any(stands(n, line) for line in lines)]
    return f"has no {', '.join(lost)}" if lost else None


def check(printed=None):
    """(page, what it quotes, what is wrong or None); printed: the folder with what examples say."""
    for page in pages():
        for kind, source, text in MARK.findall(read(page)):
            if not exists(source):
                yield page, source, "does not exist"
                continue
            if source.endswith(".py") != (printed is not None):
                continue
            output = os.path.join(printed, os.path.basename(source)[:-3]) if printed else None
            if output:
                with open(output) as file:
                    lines = file.read().split("\n")
            else:
                lines = read(source).split("\n")
            for cell in cells(text):
                wrong = wrong_cell(kind, cell, lines)
                yield page, f"{cell.strip()} of {source}", wrong

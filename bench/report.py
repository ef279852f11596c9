"""What the benchmarks in Python write: a table with its machine on top, a picture of that table."""

from __future__ import annotations

import hashlib
import os
import textwrap
from pathlib import Path
from typing import Any

import perp


def heading(about: str, file: Any) -> None:
    """The program's own words, but for its command line and what it writes; then the machine."""
    first, _, rest = about.split("\n\n")
    rest = " ".join(rest.split()).split(". ", 1)[1]
    print(first, textwrap.fill(rest, 100), sep="\n\n", end="\n\n", file=file)
    print(os.environ.get("MACHINE", "machine:  unknown"), file=file)
    print(f"\nperp {perp.version_text()}", file=file)


def save(figure: Any, table: Path) -> None:
    """The picture beside its table, with the table's hash: tests see that they belong together."""
    digest = hashlib.sha256(table.read_bytes()).hexdigest()
    figure.savefig(table.with_suffix(".png"), dpi=110, metadata={"Drawn": digest})

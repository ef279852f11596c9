"""Lets the tests run from a checkout: the package beside this folder, the library in build/."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
BUILT = ROOT / "build" / "lib" / "libperp.so"

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
if "PERP_LIBRARY" not in os.environ and BUILT.exists():
    os.environ["PERP_LIBRARY"] = str(BUILT)
# for the programs that tests start
os.environ["PYTHONPATH"] = os.pathsep.join(sys.path)

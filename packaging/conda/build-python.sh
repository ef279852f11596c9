#!/bin/bash
# The package alone: the library is that of libperp.
set -eu
PERP_USE_SYSTEM_LIBRARY=1 "$PYTHON" -m pip install --no-deps --no-build-isolation ./bindings/python

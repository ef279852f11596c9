#!/bin/bash
# conda build runs this with its compilers in CC and its flags in CFLAGS and LDFLAGS.
set -eu
make -j"${CPU_COUNT:-1}" library
make install PREFIX="$PREFIX"

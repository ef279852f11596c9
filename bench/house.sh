#!/bin/sh
# What the same work costs with two builds of the library: runs bench/house.c with each in turn and
# prints the medians and their ratio.
#
#   bench/house.sh BEFORE AFTER [RUNS]     folders with both libraries; default: 7 runs
#
# BEFORE is the library of an older commit whose interface is the same. Build first: make benches.
set -eu

root=$(cd "$(dirname "$0")/.." && pwd)
before=$1 after=$2 runs=${3-7}
program=${BUILD-$root/build}/bench/house
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

for run in $(seq "$runs"); do
    for side in before after; do
        eval "folder=\$$side"
        LD_LIBRARY_PATH=$folder "$program" | sed "s/^/$side  /" >>"$work/rows"
    done
done
awk '
    function middle(key,    n, i, j, x, list) {
        n = split(times[key], list, " ")
        for (i = 2; i <= n; i++)
            for (j = i; j > 1 && list[j - 1] + 0 > list[j] + 0; j--) {
                x = list[j]; list[j] = list[j - 1]; list[j - 1] = x
            }
        return n % 2 ? list[(n + 1) / 2] : (list[n / 2] + list[n / 2 + 1]) / 2
    }
    {
        row = $0
        sub(/^[a-z]+ +/, "", row)
        row = substr(row, 1, 40)
        if (!(row in seen)) { seen[row] = 1; order[++rows] = row }
        times[$1 row] = times[$1 row] " " $(NF - 1)
        good[$1 row] = $NF
    }
    END {
        printf "%-40s %12s %9s %12s %9s %6s\n", "", "before us", "good", "after us", "good", "ratio"
        for (k = 1; k <= rows; k++) {
            row = order[k]; b = middle("before" row); a = middle("after" row)
            printf "%-40s %12.1f %9s %12.1f %9s %6.3f\n", row, b, good["before" row], a,
                good["after" row], a / b
            split(row, word, " "); logs[word[1]] += log(a / b); numbers[word[1]]++
            if (numbers[word[1]] == 1) names[++benches] = word[1]
        }
        print ""
        for (k = 1; k <= benches; k++)
            printf "%-40s %58.3f\n", names[k] ", geometric mean", exp(logs[names[k]] / numbers[names[k]])
    }' "$work/rows"

#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/coverage.sh DIR: after tests that were built with --coverage into DIR have run, prints
# the share of lines and branches of envmap.h that any of them took, and the lines that none did.
cd "$(dirname "$0")/.." || exit 1
for data in "$1"/tests/*.gcda; do
    gcov -b -c -t "$data" 2>/dev/null
done | awk '
    / 0:Source:/ { mine = /:envmap\.h$/ }
    !mine { next }
    /^(branch|call)/ {
        if (/^branch/) {
            key = line "." n++
            branches[key] = 1
            if ($4 + 0 > 0) taken[key] = 1
        }
        next
    }
    match($0, /^ *[0-9#=-]+\*?: *[0-9]+:/) {
        split($0, part, ":")
        count = part[1]; line = part[2] + 0; n = 0
        gsub(/[ *]/, "", count)
        if (count == "-") next
        text[line] = substr($0, RSTART + RLENGTH)
        lines[line] = 1
        if (count + 0 > 0) hit[line] = 1
        if (line > last) last = line
    }
    END {
        for (i = 1; i <= last; ++i)
            if (i in lines) {
                ++all
                if (i in hit) ++some
                else print "  not run: envmap.h:" i ":" text[i]
            }
        for (key in branches) { ++ways; if (key in taken) ++gone }
        if (!all) { print "no coverage data here"; exit 1 }
        printf "envmap.h: %.2f %% of %d lines, %.1f %% of %d branches\n", 100 * some / all, all,
            100 * gone / ways, ways
        exit 100 * some / all < 98
    }'

#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/mutate.sh DIR COUNT SEED [ROOM]
# Puts one small fault into the bodies of envmap.h (a sign, a constant doubled, < for <=, one more or
# less, a term dropped, a condition turned), runs the tests of the room that it fell into, and does so
# COUNT times. A fault that no test notices survives, and is listed. Faults that do not compile do
# not count. The whole of 200 takes about two hours of one processor, most of it compiling.
cd "$(dirname "$0")/.." || exit 1
dir=$1 count=$2 seed=${3:-1} room=${4:-}
mkdir -p "$dir/src" || exit 1
cc=${CC:-cc}
killed=0 survived=0 n=0

# Tests of a room, the quickest first; a room's faults are looked for there and in `search`.
tests_of() {
    case $1 in
    base) echo "base maps compare" ;;
    resample) echo "maps stability_maps search" ;;
    reference) echo "search filters" ;;
    rings | transform) echo "harmonics prepared sh" ;;
    scene | fast) echo "prepared search scenes fast" ;;
    filters) echo "prepared search filters" ;;
    directions | maps | mips) echo "$1 stability_maps search" ;;
    pfm | compare | materials) echo "$1" ;;
    *) echo "$1 search" ;;
    esac
}

# Every place that can be changed: line, room, text before, text after; one is drawn for each number.
faults() {
    awk -v count="$count" -v seed="$seed" -v want="$room" '
    function add(at, length_, by) {
        ++all
        place[all] = NR "\t" room "\t" substr($0, 1, at - 1) "\034" substr($0, at, length_) "\034" by \
            "\034" substr($0, at + length_)
    }
    function each(pattern, by,    rest, start) {
        rest = $0; start = 0
        while (match(rest, pattern)) {
            add(start + RSTART, RLENGTH, by == "2x" ? "2 * " substr(rest, RSTART, RLENGTH) : by)
            start += RSTART + RLENGTH - 1
            rest = substr(rest, RSTART + RLENGTH)
        }
    }
    /^\/\* -+ >>/ { room = $0; sub(/.*>>/, "", room); sub(/[^a-z].*/, "", room) }
    /you can stop reading here/ { bodies = 1 }
    !bodies || /^ *(\/\*|\*|#|[A-Z]\. )|^   [A-Z]|^ +[a-z].*\*\/$|\\$|static const/ { next }
    want != "" && room != want { next }
    !/[;{]/ { next }
    {
        each(" \\+ ", " - "); each(" - ", " + "); each(" \\* ", " / "); each(" < ", " <= ")
        each(" <= ", " < "); each(" > ", " >= "); each(" >= ", " > "); each(" && ", " || ")
        each(" \\|\\| ", " && "); each("[0-9]*\\.[0-9]+", "2x"); each("[0-9]e-[0-9]+", "2x")
        each(" \\+ 1", ""); each(" - 1", ""); each(" == ", " != ")
    }
    END {
        srand(seed)
        for (i = 0; i < count && all; ++i) print place[1 + int(all * rand())]
    }' envmap.h
}

try() { # LINE ROOM: 0 where a test notices, 1 where none does, 2 where it does not compile
    $cc -std=c99 -O1 -w -I"$dir/src" -I. -Itests -c tests/oracle.c -o "$dir/oracle.o" 2>/dev/null || return 2
    for t in $(tests_of "$2"); do
        [ -e "tests/test_$t.c" ] || continue
        shared="-DTEST_SHARED $dir/oracle.o"
        ! grep -q 'define ENVMAP_IMPLEMENTATION' "tests/test_$t.c" || shared=
        $cc -std=c99 -O1 -w -I"$dir/src" -I. -Itests $shared "tests/test_$t.c" -o "$dir/test" -lm \
            -lpthread 2>/dev/null || return 2
        (ulimit -v 4000000; TEST_QUICK=1 timeout 300 "$dir/test") >"$dir/log" 2>&1 || return 0
    done
    return 1
}

faults >"$dir/faults"
tab=$(printf '\t')
while IFS="$tab" read -r line room text; do
    n=$((n + 1))
    printf '%s\n' "$text" | tr '\034' '\n' >"$dir/parts"
    awk -v line="$line" -v parts="$dir/parts" 'NR == line {
            for (i = 0; (getline part < parts) > 0; ++i) if (i != 1) $0 = i ? $0 part : part
        } { print }' envmap.h >"$dir/src/envmap.h"
    try "$line" "$room" </dev/null
    case $? in
    0) killed=$((killed + 1)) what=killed ;;
    1) survived=$((survived + 1)) what=SURVIVED ;;
    *) what='does not compile' ;;
    esac
    echo "$n $what: $room $line:$(sed -n "${line}p" "$dir/src/envmap.h")"
done <"$dir/faults"
echo "$survived of $((killed + survived)) faults survived"

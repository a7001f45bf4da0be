#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/mutate.sh DIR COUNT SEED [ROOM]
# Puts one small fault into the bodies of envmap.h (a sign, a constant doubled, < for <=, one more or
# less, a term dropped, a condition turned), runs the tests of the room that it fell into, and does so
# COUNT times. A fault that no test notices survives, and is listed. Faults that do not compile do
# not count, nor do comments. A fault that no test notices runs once more under the address sanitizer,
# as make sanitize would. The bodies are compiled once a fault, as the tests' shared object; only
# tests of private functions are compiled again, with what they use. CC, CFLAGS (-O1), LIMIT (processor
# seconds a test may take, 120).
cd "$(dirname "$0")/.." || exit 1
dir=$1 count=$2 seed=${3:-1} room=${4:-}
mkdir -p "$dir/src" || exit 1
cc="${CC:-cc} -std=c99 ${CFLAGS:--O1} -w" limit=${LIMIT:-120}
killed=0 survived=0 n=0 kind= plain=$cc sanitized="$cc -fsanitize=address,bounds"
echo 'int main(void) { return 0; }' >"$dir/probe.c"
$sanitized "$dir/probe.c" -o "$dir/probe" 2>/dev/null || sanitized=

# Tests of a room, the quickest first; a room's faults are looked for there and in `search`.
tests_of() {
    case $1 in
    base) echo "base compare maps" ;;
    resample) echo "maps stability_maps search" ;;
    reference) echo "search filters" ;;
    rings | transform) echo "harmonics prepared sh" ;;
    windows | kernels | near) echo "near search" ;;
    lights | scene | fast) echo "prepared search scenes fast" ;;
    filters) echo "prepared search filters" ;;
    directions) echo "directions harmonics stability_maps maps" ;;
    harmonics) echo "sh harmonics prepared" ;;
    maps | mips) echo "$1 stability_maps search" ;;
    pfm | compare | materials | lobes) echo "$1" ;;
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
        rest = code; start = 0
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
        code = $0
        sub(/\/\*.*/, "", code)
        each(" \\+ ", " - "); each(" - ", " + "); each(" \\* ", " / "); each(" < ", " <= ")
        each(" <= ", " < "); each(" > ", " >= "); each(" >= ", " > "); each(" && ", " || ")
        each(" \\|\\| ", " && "); each("[0-9]*\\.[0-9]+", "2x"); each("[0-9]e-[0-9]+", "2x")
        each(" \\+ 1", ""); each(" - 1", ""); each(" == ", " != ")
    }
    END {
        srand(seed)
        for (i = 0; i < count && all; ++i) { # none twice
            at = 1 + int(all * rand())
            print place[at]
            place[at] = place[all--]
        }
    }' envmap.h
}

# The test's object, made when it is first asked for; none where the test has bodies of its own.
ready() { # TEST
    [ -e "$dir/$1$kind.o" ] || $cc -I. -Itests -DTEST_SHARED -c "tests/test_$1.c" -o "$dir/$1$kind.o"
}

build() { # TEST: $dir/test, with the fault in it
    if grep -q 'define ENVMAP_IMPLEMENTATION$' "tests/test_$1.c"; then
        $cc -I"$dir/src" -I. -Itests -DTEST_SHARED "tests/test_$1.c" "$dir/oracle.o" -o "$dir/test" \
            -lm -lpthread
    else
        ready "$1" && $cc "$dir/$1$kind.o" "$dir/oracle.o" -o "$dir/test" -lm -lpthread
    fi
}

run() { # seconds of its processor, so that a busy machine changes nothing
    ([ -n "$kind" ] || ulimit -v 4000000; ulimit -t "$limit"; TEST_QUICK=1 TEST_FIRST=1 "$dir/test") >"$dir/log" 2>&1
}

fails() { # TEST: 0 where it fails with $dir/src/envmap.h, 2 where that does not compile
    build "$1" 2>/dev/null || return 2
    ! run
}

# A test that fails without a fault, or takes too long, tells nothing: it is left out, and named.
sound() { # TEST
    if [ ! -e "$dir/$1.sound" ]; then
        cp envmap.h "$dir/src/envmap.h"
        $cc -I"$dir/src" -I. -Itests -c tests/oracle.c -o "$dir/oracle.o"
        fails "$1"
        echo $? >"$dir/$1.sound"
        [ "$(cat "$dir/$1.sound")" = 1 ] || echo "test_$1 passed by: it fails without a fault"
    fi
    [ "$(cat "$dir/$1.sound")" = 1 ]
}

# Every test of the rooms in question, once without a fault.
check_tests() {
    for r in $(cut -f2 "$dir/faults" | sort -u); do
        for t in $(tests_of "$r"); do [ ! -e "tests/test_$t.c" ] || sound "$t"; done
    done
}

noticed() { # ROOM: 0 where a test notices, 1 where none does, 2 where none could: it does not compile
    status=2
    $cc -I"$dir/src" -I. -Itests -c tests/oracle.c -o "$dir/oracle.o" 2>/dev/null || return 2
    for t in $(tests_of "$1"); do
        [ "$(cat "$dir/$t.sound" 2>/dev/null)" = 1 ] || continue
        fails "$t"
        case $? in 0) return 0 ;; 2) return 2 ;; esac
        status=1
    done
    return $status
}

try() { # ROOM: as noticed; what survives is tried under the sanitizer
    kind= cc=$plain
    noticed "$1"
    status=$?
    [ $status = 1 ] && [ -n "$sanitized" ] || return $status
    kind=-sanitized cc=$sanitized
    noticed "$1"
}

rm -f "$dir"/*.o "$dir"/*.sound
faults >"$dir/faults"
check_tests
tab=$(printf '\t')
while IFS="$tab" read -r line room text; do
    n=$((n + 1))
    printf '%s\n' "$text" | tr '\034' '\n' >"$dir/parts"
    awk -v line="$line" -v parts="$dir/parts" 'NR == line {
            for (i = 0; (getline part < parts) > 0; ++i) if (i != 1) $0 = i ? $0 part : part
        } { print }' envmap.h >"$dir/src/envmap.h"
    try "$room" </dev/null
    case $? in
    0) killed=$((killed + 1)) what=killed ;;
    1) survived=$((survived + 1)) what=SURVIVED ;;
    *) what='does not compile, or has no test' ;;
    esac
    echo "$n $what: $room $line:$(sed -n "${line}p" "$dir/src/envmap.h")"
done <"$dir/faults"
echo "$survived of $((killed + survived)) faults survived"

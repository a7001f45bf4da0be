#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/mutate.sh DIR COUNT SEED [ROOM | FAULT]
# Puts one small fault into the bodies of envmap.h (a sign, a constant doubled, < for <=, one more or
# less, a term dropped, a condition turned), runs the tests of the room that it fell into, and does so
# COUNT times. A fault that no test notices survives, and is listed. Faults that do not compile do
# not count, nor do comments.
# A fault's number is made of its text and of SEED, so it stays when other lines change; the COUNT
# lowest are tried. DIR/SEED.log has a line for each that was tried; faults that it names are passed
# over, so a run that was stopped goes on. (Delete lines there to try these again.) ROOM is a regular
# expression. With a FAULT's number this one is tried, and what its test prints is shown.
# What survives runs once more, each test for 20 seconds, under the address sanitizer, as make
# sanitize would; SANITIZED= leaves that out. The bodies are compiled once a fault, as the tests'
# shared object; only tests of private functions are compiled again. A test that takes three times as
# long as without a fault has noticed it. CC, CFLAGS (-O1), SKIP (tests that are not asked: near and
# fast take a minute each time that they notice nothing).
cd "$(dirname "$0")/.." || exit 1
dir=$1 count=$2 seed=${3:-1} room=${4:-.*} fault=
case $room in [0-9]*) fault=$room room='.*' ;; esac
mkdir -p "$dir/src" || exit 1
plain="${CC:-cc} -std=c99 ${CFLAGS:--O1} -w" sanitized=${SANITIZED-yes} log=$dir/$seed.log
tab=$(printf '\t')
echo 'int main(void) { return 0; }' >"$dir/probe.c"
[ -z "$sanitized" ] || sanitized="$plain -fsanitize=address,bounds -fno-sanitize-recover=all"
$sanitized "$dir/probe.c" -o "$dir/probe" 2>/dev/null || sanitized=

# Tests of a room: the quickest first, those that are compiled again behind them.
tests_of() {
    case $1 in
    base) echo "base compare search maps" ;;
    directions) echo "directions stability_maps search harmonics maps" ;;
    maps) echo "stability_maps search maps" ;;
    resample) echo "stability_maps search maps" ;;
    pfm) echo "pfm" ;;
    mips) echo "mips search stability_maps" ;;
    lobes) echo "lobes calls search materials filters" ;;
    rings | transform | harmonics) echo "search prepared harmonics sh fast" ;;
    lights | scene | fast) echo "search prepared calls scenes fast" ;;
    reference) echo "search filters" ;;
    hierarchical) echo "search hierarchical" ;;
    windows | kernels | knots | near) echo "search calls prepared near" ;;
    filters) echo "search calls prepared filters" ;;
    plan) echo "plan search materials" ;;
    *) echo "$1 search" ;;
    esac
}

# Every place that can be changed: number, line, room, text before, text after.
faults() {
    awk -v seed="$seed" -v want="^($room)\$" '
    BEGIN { for (i = 1; i < 256; ++i) ordinal[sprintf("%c", i)] = i }
    function hash(text,    h, i) {
        h = seed
        for (i = 1; i <= length(text) + 3; ++i)
            h = (h * 16807 + 7919 * ordinal[substr(text, i, 1)] + 1) % 2147483647
        return h
    }
    function add(at, length_, by,    text) {
        text = room "\t" substr($0, 1, at - 1) "\034" substr($0, at, length_) "\034" by \
            "\034" substr($0, at + length_)
        printf "%d\t%d\t%s\n", hash(text), NR, text
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
    comment { comment = !/\*\//; next }
    {
        code = $0
        gsub(/\/\*.*\*\//, "", code)
        comment = sub(/\/\*.*/, "", code)
    }
    !bodies || room !~ want || code ~ /^ *#|\\$|static const/ || code !~ /[;{]/ { next }
    {
        each(" \\+ ", " - "); each(" - ", " + "); each(" \\* ", " / "); each(" < ", " <= ")
        each(" <= ", " < "); each(" > ", " >= "); each(" >= ", " > "); each(" && ", " || ")
        each(" \\|\\| ", " && "); each("[0-9]*\\.[0-9]+", "2x"); each("[0-9]e-[0-9]+", "2x")
        each(" \\+ 1", ""); each(" - 1", ""); each(" == ", " != ")
    }' envmap.h | sort -n -u -k1,1 | if [ -n "$fault" ]; then grep "^$fault$tab"
    else head -n "$count"; fi
}

# What the fault-free test depends on, as a number: what was made for it once serves again.
key() { # TEST
    { echo "$cc"; cat envmap.h tests/*.h tests/fuzz_calls.c "tests/test_$1.c"; } | cksum |
        cut -d ' ' -f 1
}

run() { # SECONDS of its processor, so that a busy machine changes nothing
    (
        ulimit -t "$1"
        [ $kind = sanitized ] || ulimit -v 4000000
        case $t in search | fast) export TEST_QUICK=1 ;; esac # half a minute, whole
        TEST_FIRST=1 exec "$dir/test"
    ) >"$dir/out" 2>&1
    status=$?
    [ $kind = sanitized ] && [ $status -gt 128 ] && return 0 # its seconds were over
    return $status
}

# A test that fails without a fault tells nothing: it is left out, and named. $of_test: what its
# files are called; $seconds: three times what it took, and three.
sound() { # TEST
    of_test=$dir/$1-$kind-$(key "$1")
    if [ ! -e "$of_test" ]; then
        rm -f "$dir/$1-$kind"-*
        $cc -I. -Itests "tests/test_$1.c" -o "$dir/test" -lm -lpthread || return 1
        start=$(date +%s)
        run "$most" && echo $((3 * ($(date +%s) - start) + 3)) >"$of_test" || : >"$of_test"
        [ -s "$of_test" ] || echo "test_$1 passed by: it fails without a fault"
    fi
    [ -s "$of_test" ] && seconds=$(cat "$of_test")
}

build() { # TEST: $dir/test, with the fault in it
    if grep -q 'define ENVMAP_IMPLEMENTATION$' "tests/test_$1.c"; then
        $cc -I"$dir/src" -I. -Itests -DTEST_SHARED "tests/test_$1.c" "$dir/oracle.o" -o "$dir/test" \
            -lm -lpthread
    else
        [ -e "$of_test.o" ] || $cc -I. -Itests -DTEST_SHARED -c "tests/test_$1.c" -o "$of_test.o"
        $cc "$of_test.o" "$dir/oracle.o" -o "$dir/test" -lm -lpthread
    fi
}

noticed() { # ROOM: 0 where a test notices, 1 where none does, 2 where none could: it does not compile
    $cc -I"$dir/src" -I. -Itests -c tests/oracle.c -o "$dir/oracle.o" 2>/dev/null || return 2
    for t in $(tests_of "$1"); do
        case " $SKIP " in *" $t "*) continue ;; esac
        sound "$t" || continue
        build "$t" 2>/dev/null || return 2
        run $((seconds < most ? seconds : most)) || return 0
    done
    return 1
}

try() { # ROOM: as noticed
    for kind in plain sanitized; do
        cc=$plain most=300
        [ $kind != sanitized ] || cc=$sanitized most=20
        [ -n "$cc" ] || continue
        noticed "$1"
        found=$?
        [ $found = 1 ] || return $found
    done
    return 1
}

[ -z "$fault" ] || log=$dir/again.log
[ -z "$fault" ] || rm -f "$log"
touch "$log"
faults >"$dir/faults"
while IFS="$tab" read -r number line of text; do
    ! grep -q "^$number " "$log" || continue
    printf '%s\n' "$text" | tr '\034' '\n' >"$dir/parts"
    awk -v line="$line" -v parts="$dir/parts" 'NR == line {
            for (i = 0; (getline part < parts) > 0; ++i) if (i != 1) $0 = i ? $0 part : part
        } { print }' envmap.h >"$dir/src/envmap.h"
    try "$of" </dev/null
    case $? in
    0) what="killed by $t: $(sed -n 's/^  FAIL //p' "$dir/out" | head -n 1)" ;;
    1) what=SURVIVED ;;
    *) what='does not compile' ;;
    esac
    echo "$number $of $line:$(sed -n "${line}p" "$dir/src/envmap.h") -- $what" | tee -a "$log"
    [ -z "$fault" ] || cat "$dir/out"
done <"$dir/faults"
cut -f 1 "$dir/faults" | sed 's/^/^/;s/$/ /' | grep -f - "$log" >"$dir/tried"
echo "$(grep -c ' -- SURVIVED' "$dir/tried") of $(grep -c ' -- [kS]' "$dir/tried") faults survived"

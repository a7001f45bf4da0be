#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/mutate.sh DIR COUNT SEED [ROOM | FAULT]
# Draws COUNT small faults in the functions of envmap.h (a sign, a constant doubled, < for <=, one more
# or less, a term dropped, a condition turned), and asks the tests of the room that each fell into. A
# fault that no test notices survives, and is listed. Faults that do not compile do not count, nor are
# there any in comments; `a < b ? a : b` gets no `<=`, which is the same number.
# A fault's number is made of its text and of SEED, so it stays when other lines change; the COUNT
# lowest are tried. DIR/SEED.log has a line for each that was tried; faults that it names are passed
# over, so a run that was stopped goes on. (Delete lines there to try these again.) ROOM is a regular
# expression. With a FAULT's number this one is tried, and what its test prints is shown.
# (Lines of faults that survived a form of the tests are in DIR/SEED.log.FORM.)
# All faults are compiled at once: a function that has some is there once more for each, and
# ENVMAP_FAULT=number, in the environment, says which is called. A fault first meets the quick forms
# of its tests, what survives their whole forms, and what survives these the quick ones under the
# address sanitizer; KINDS ("quick whole sanitized") picks of these. A test that takes three times as
# long as without a fault has noticed it. CC (with GNU C), CFLAGS (-O2), JOBS, SKIP (tests not to ask).
# The last line counts. A survivor whose number is in docs/security.md is argued there.
cd "$(dirname "$0")/.." || exit 1
dir=$1 count=$2 seed=${3:-1} room=${4:-.*} fault=
case $room in [0-9]*) fault=$room room='.*' ;; esac
mkdir -p "$dir/src" || exit 1
plain="${CC:-cc} -std=gnu99 ${CFLAGS:--O2} -w" log=$dir/$seed.log kinds=${KINDS:-quick whole sanitized}
tab=$(printf '\t')
echo 'int main(void) { return 0; }' >"$dir/probe.c"
sanitized="$plain -O1 -fsanitize=address,bounds -fno-sanitize-recover=all"
$sanitized "$dir/probe.c" -o "$dir/probe" 2>/dev/null || sanitized=

# Tests of a room, the quickest first.
tests_of() {
    case $1 in
    base) echo "base compare search maps" ;;
    directions | maps | resample | mips) echo "directions stability_maps search mips calls maps harmonics" ;;
    pfm) echo "pfm" ;;
    lobes) echo "lobes calls search materials plan filters" ;;
    rings | transform | harmonics) echo "search prepared harmonics sh calls plan fast" ;;
    lights | scene | fast | sharp) echo "search prepared calls plan memory scenes fast" ;;
    source | reference) echo "search stability_maps filters" ;;
    hierarchical) echo "search hierarchical" ;;
    banks) echo "banks search" ;;
    windows | kernels | knots | near) echo "search calls prepared memory near" ;;
    filters) echo "search calls prepared plan memory filters" ;;
    plan) echo "plan search materials" ;;
    *) echo "$1 search calls" ;;
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
    # Whether < or > at this place is that of a < b ? a : b, or of a < b ? b : a, or a > b ? a - b : 0:
    # a one word, or all since `= `.
    function tie(at,    a, b, rest, i) {
        rest = substr(code, at + 1); sub(/^[<>=]+ /, "", rest)
        b = rest; sub(/ .*/, "", b)
        rest = substr(rest, length(b) + 1)
        for (i = 0; i < 2; ++i) {
            a = substr(code, 1, at - 1); sub(i ? ".*= " : ".*[ (,!]", "", a)
            if (index(rest, " ? " a " : " b) == 1 || index(rest, " ? " b " : " a) == 1 ||
                index(rest, " ? " a " - " b " : 0") == 1) return 1
        }
        return 0
    }
    function each(pattern, by,    rest, start) {
        rest = code; start = 0
        while (match(rest, pattern)) {
            if (pattern !~ /[<>]/ || !tie(start + RSTART))
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
    /^[A-Za-z].*\(/ && !/\\$/ && !/;$/ { inside = 1 }
    !bodies || !inside || room !~ want || code ~ /^ *#|\\$|static const/ || code !~ /[;{]/ { next }
    {
        each(" \\+ ", " - "); each(" - ", " + "); each(" \\* ", " / "); each(" < ", " <= ")
        each(" <= ", " < "); each(" > ", " >= "); each(" >= ", " > "); each(" && ", " || ")
        each(" \\|\\| ", " && "); each("[0-9]*\\.[0-9]+", "2x"); each("[0-9]e-[0-9]+", "2x")
        each(" \\+ 1", ""); each(" - 1", ""); each(" == ", " != ")
    }
    /^}/ || /^[A-Za-z].*}$/ { inside = 0 }' envmap.h | sort -n -u -k1,1 |
        if [ -n "$fault" ]; then grep "^$fault$tab"; else head -n "$count"; fi
}

# envmap.h with all faults of a list: $dir/src/envmap.h, and $dir/lines, the lines of each fault's copy.
with_faults() { # FAULTS
    awk -F "$tab" -v map="$dir/lines" '
    function out(text) { print text; ++lines }
    function copy(as, at, text,    i) { # the function, called `as`, with line `at` changed
        out("#define " name " " as)
        for (i = 1; i <= n; ++i) out(i == at ? text : body[i])
        out("#undef " name)
    }
    function flush(    i, k, from, choice, signature, arguments, a, parts) {
        if (!n) return
        if (!found) { for (i = 1; i <= n; ++i) out(body[i]); n = 0; return }
        copy(name "__0", 0, "")
        choice = name "__0"
        for (k = 1; k <= found; ++k) {
            from = lines + 1
            copy(name "__" of[k], at[k], changed[k])
            print of[k], from, lines >map
            choice = "envmap_fault == " of[k] " ? " name "__" of[k] " : " choice
        }
        if (body[1] ~ /^ENVMAPI_BODY/) { # others link it: a function that calls the one
            signature = ""
            for (i = 1; i <= n; ++i) {
                signature = signature body[i] " "
                if (body[i] ~ /{/) break
            }
            sub(/{.*/, "", signature)
            arguments = signature
            sub(/^[^(]*\(/, "", arguments); sub(/\) *$/, "", arguments)
            i = split(arguments, parts, ","); arguments = ""
            for (k = 1; k <= i; ++k) {
                a = parts[k]; gsub(/\[[^]]*\]/, "", a); sub(/ *$/, "", a); sub(/.*[ *]/, "", a)
                if (a != "void") arguments = arguments (k > 1 ? ", " : "") a
            }
            out(signature "{ return (" choice ")(" arguments "); }")
        } else out("#define " name " (" choice ")")
        n = 0
    }
    FNR == NR { number[$2] = number[$2] " " $1; split($4, part, "\034")
        text[$1] = part[1] part[3] part[4]; next }
    /you can stop reading here/ { bodies = 1 }
    bodies && !n && /^[A-Za-z].*\(/ && !/\\$/ && !/;$/ && !/^ENVMAPI_LANE/ {
        name = $0; sub(/\(.*/, "", name); sub(/.*[ *]/, "", name); found = 0; inside = 1
        if (!begun++) out("extern int envmap_fault;")
    }
    inside {
        body[++n] = $0
        k = split(number[FNR], list, " ")
        for (i = 1; i <= k; ++i) { of[++found] = list[i]; at[found] = n; changed[found] = text[list[i]] }
        if (/^}/ || (n == 1 && /}$/)) { flush(); inside = 0 }
        next
    }
    { out($0) }' "$1" envmap.h >"$dir/src/envmap.h"
}

# Leaves those out of the list that do not compile, until the rest does.
compile() {
    cp "$dir/faults" "$dir/fit"
    : >"$dir/unfit"
    while with_faults "$dir/fit"; ! $plain -fmax-errors=0 -fsyntax-only -I"$dir/src" -I. -Itests \
        tests/oracle.c 2>"$dir/errors"; do
        grep -E '^[^ ]*src/envmap.h:[0-9]+:.* error:' "$dir/errors" | cut -d : -f 2 | sort -un |
            awk 'FNR == NR { from[$1] = $2; to[$1] = $3; next }
                { for (f in from) if ($1 >= from[f] && $1 <= to[f]) print f }' "$dir/lines" - |
            sort -u >"$dir/these"
        [ -s "$dir/these" ] || { cat "$dir/errors" && exit 1; }
        cat "$dir/these" >>"$dir/unfit"
        awk 'FNR == NR { bad[$1] = 1; next } !($1 in bad)' "$dir/these" "$dir/fit" >"$dir/fit2"
        mv "$dir/fit2" "$dir/fit"
    done
}

# The program of a test: $dir/KIND-TEST, built when it is first asked for.
build() { # TEST
    [ -e "$dir/$kind-$1" ] && return
    [ -e "$dir/$kind.o" ] || {
        { cat tests/oracle.c && echo '#include <stdlib.h>
            int envmap_fault;
            __attribute__((constructor)) static void fault_of_the_environment(void) {
                envmap_fault = getenv("ENVMAP_FAULT") ? atoi(getenv("ENVMAP_FAULT")) : 0;
            }'; } >"$dir/bodies.c"
        $cc -I"$dir/src" -I. -Itests -c "$dir/bodies.c" -o "$dir/$kind.o" || exit 1
    }
    $cc -I"$dir/src" -I. -Itests -DTEST_SHARED "tests/test_$1.c" "$dir/$kind.o" -o "$dir/$kind-$1" \
        -lm -lpthread || exit 1
}

run() { # SECONDS of its processor, so that a busy machine changes nothing; FAULT
    (
        ulimit -t "$1"
        [ $kind = sanitized ] || ulimit -v 4000000
        [ $kind = whole ] || export TEST_QUICK=1
        ENVMAP_FAULT=$2 TEST_FIRST=1 exec "$dir/$kind-$t"
    ) >"$dir/out-$me" 2>&1
}

# $dir/KIND-TEST.s: three times the seconds that the test takes without a fault, and three. A test that
# fails without one tells nothing: it is named, and has none. Nor have quick forms of eight seconds
# and more: the whole ones come anyway.
sound() { # TEST
    t=$1 me=$kind-$1 most=8
    [ $kind != whole ] || most=600
    (run $most 0 && times) | tail -n 1 | tr ms '  ' |
        awk 'NF { printf "%d\n", 3 * (60 * ($1 + $3) + $2 + $4) + 3 }' >"$dir/$me.part"
    [ -s "$dir/$me.part" ] || ! grep -q FAIL "$dir/out-$me" ||
        echo "test_$t passed by: it fails without a fault"
    mv "$dir/$me.part" "$dir/$me.s"
}

try() { # ME, and on stdin faults: each that a test notices goes to the log, others to $dir/SEED.KIND
    me=$1
    while IFS="$tab" read -r number line of text; do
        what="$number $of $line:$(printf %s "$text" | tr '\034' '@') --"
        for t in $(tests_of "$of"); do
            case " $SKIP " in *" $t "*) continue ;; esac
            [ -s "$dir/$kind-$t.s" ] && [ -x "$dir/$kind-$t" ] || continue
            run "$(cat "$dir/$kind-$t.s")" "$number" </dev/null && continue
            by=$(sed -n 's/^  FAIL //p' "$dir/out-$me" | head -n 1)
            printf '%s\n' "$what killed by $t: ${by:-its end, or its time}" | tee -a "$log"
            [ -z "$fault" ] || cat "$dir/out-$me"
            continue 2
        done
        printf '%s\n' "$what SURVIVED" >>"$log.$kind"
    done
}

# All faults that nothing noticed yet meet their tests in one form, JOBS at once.
phase() { # KIND
    kind=$1 cc=$plain k=0
    [ $kind != sanitized ] || cc=$sanitized
    [ -n "$cc" ] || return 0
    last=$kind
    touch "$log.$kind"
    cat "$log" "$log.$kind" | cut -d ' ' -f 1 | awk -F "$tab" '!second { done[$1] = 1; next }
        !($1 in done)' - second=1 "$dir/fit" >"$dir/left"
    for t in $(cut -f 3 "$dir/left" | sort -u | while read -r of; do tests_of "$of"; done |
        tr ' ' '\n' | sort -u); do
        case " $SKIP " in *" $t "*) continue ;; esac
        [ $kind != whole ] || [ ! -e "$dir/quick-$t" ] || ln -f "$dir/quick-$t" "$dir/whole-$t"
        build "$t"
        [ ! -e "$dir/$kind-$t.s" ] || continue
        sound "$t" &
        k=$((k + 1))
        [ $((k % jobs)) != 0 ] || wait
    done
    wait
    k=0
    while [ $k -lt "$jobs" ]; do
        awk -v jobs="$jobs" -v k=$k 'NR % jobs == k' "$dir/left" >"$dir/left-$k"
        try $k <"$dir/left-$k" &
        k=$((k + 1))
    done
    wait
}

[ -z "$fault" ] || log=$dir/again.log
[ -z "$fault" ] || rm -f "$log"*
touch "$log"
faults >"$dir/faults"
key=$({ cat "$dir/faults" envmap.h tests/*.[ch] "$0" && echo "$plain"; } | cksum)
[ "$key" = "$(cat "$dir/key" 2>/dev/null)" ] || rm -f "$dir"/quick* "$dir"/whole* "$dir"/sanitized*
echo "$key" >"$dir/key"
compile
jobs=${JOBS:-2}
for kind in $kinds; do phase $kind; done
awk '!second { done[$1] = 1; next } !($1 in done)' "$log" second=1 "$log.$last" >"$dir/survived"
tee -a "$log" <"$dir/survived"
cut -f 1 "$dir/fit" | sed 's/^/^/;s/$/ /' | grep -f - "$log" >"$dir/tried"
all=$(wc -l <"$dir/tried")
grep -e '-- SURVIVED$' "$dir/tried" >"$dir/survived"
argued=0
while read -r number rest; do
    if grep -qE "(^|[^0-9])$number([^0-9]|\$)" docs/security.md; then argued=$((argued + 1))
    else echo "not argued: $number $rest"; fi
done <"$dir/survived"
left=$(wc -l <"$dir/survived")
echo "envmap.h $(cksum <envmap.h | cut -d ' ' -f 1), seed $seed: $(wc -l <"$dir/unfit") of" \
    "$(wc -l <"$dir/faults") faults do not compile; of $all tried $((all - left)) were noticed, $left" \
    "survived, $argued of these argued in docs/security.md"

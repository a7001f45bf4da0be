#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/analyze.sh DIR: clang-tidy, cppcheck and scan-build on envmap.h; what they say is a
# failure. Checks that are off say why; gcc's -fanalyzer takes minutes and is not among them: it
# suspects the answers of a BRDF in envmapi_brdf_cosine alone, which are set before the call.
cd "$(dirname "$0")/.." || exit 1
dir=$1 passed=0 failed=0
mkdir -p "$dir" || exit 1
echo '#define ENVMAP_IMPLEMENTATION
#include "envmap.h"' >"$dir/body.c"

says_nothing() { # NAME LOG PATTERN
    if grep -E "$3" "$2" | sort -u | head -n 20 | grep .; then
        failed=$((failed + 1))
        echo "  FAIL $1"
    else
        passed=$((passed + 1))
        echo "  ok   $1"
    fi
}

# Off:
#  easily-swappable-parameters   u, v and x, y are what formulas have
#  implicit-widening, misplaced-widening-cast   products of sizes that envmap_create bounds by 16384
#  integer-division              texel counts are halved as integers
#  macro-parentheses             macros whose arguments are types
#  suspicious-memory-comparison, exp42, flp37   an envmap has no padding; the same bits are meant
#  err33                         closing a file that was only read
#  flp30                         loops over angles by a step or by doubling
#  int-to-ptr                    takes const away from lanes that are only read
off='-bugprone-easily-swappable-parameters,-bugprone-implicit-widening-of-multiplication-result'
off="$off,-bugprone-misplaced-widening-cast,-bugprone-integer-division,-bugprone-macro-parentheses"
off="$off,-bugprone-suspicious-memory-comparison,-cert-exp42-c,-cert-flp37-c,-cert-err33-c"
off="$off,-cert-flp30-c,-performance-no-int-to-ptr"
if command -v clang-tidy >/dev/null; then
    clang-tidy "--checks=-*,bugprone-*,cert-*,performance-*,$off" '--header-filter=envmap\.h' \
        "$dir/body.c" -- -std=c99 -I. >"$dir/tidy.log" 2>&1
    says_nothing "clang-tidy: bugprone, cert, performance" "$dir/tidy.log" '(warning|error):'
else
    echo "clang-tidy passed by (Debian: clang-tidy)"
fi

# Off:
#  uninitvar            arrays that a call fills, unless it fails and they are not read
#  objectIndex          lanes are read one by one
#  invalidPointerCast   one block of memory holds arrays of several types, each used as its own
if command -v cppcheck >/dev/null; then
    cppcheck -q --std=c99 --enable=warning,portability,performance -I. --suppress=uninitvar \
        --suppress=objectIndex --suppress=invalidPointerCast --suppress=missingInclude \
        '--template={file}:{line}: {id}: {message}' "$dir/body.c" >"$dir/cppcheck.log" 2>&1
    says_nothing "cppcheck: warning, portability, performance" "$dir/cppcheck.log" '^envmap.h:[0-9]+: [a-zA-Z]+: '
else
    echo "cppcheck passed by (Debian: cppcheck)"
fi

if command -v scan-build >/dev/null; then
    scan-build -o "$dir/scan" clang -std=c99 -I. -c "$dir/body.c" -o "$dir/body.o" >"$dir/scan.log" 2>&1
    says_nothing "scan-build" "$dir/scan.log" 'warning:|error:'
else
    echo "scan-build passed by (Debian: clang-tools)"
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

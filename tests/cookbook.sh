#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/cookbook.sh CC ENVMAP [DIR], from the top of the project
# Runs the recipes of docs/cookbook.md as they stand there: each one's command, then its program,
# which has at most 20 lines and ends with 0. Then examples/cached_memory.c, whose later calls must
# not ask the system for memory.
cc=$1 here=$PWD dir=${3:-build/cookbook}
quick='-O0 -DENVMAP_STATIC' # compiles what a recipe calls, no more
case $2 in /*) tool=$2 ;; *) tool=$here/$2 ;; esac
rm -rf "$dir" && mkdir -p "$dir" && cd "$dir" || exit 1
awk '/^## /      { n++ }
     /^```$/     { out = "" }
     out != ""   { print > out }
     /^```sh$/   { out = n ".sh" }
     /^```c$/    { out = n ".c" }' "$here/docs/cookbook.md"

recipe() { # NUMBER
    [ "$(wc -l <"$1.c")" -le 20 ] || { echo "more than 20 lines"; return 1; }
    (envmap() { "$tool" "$@"; } && set -e && . "./$1.sh") || return 1
    "$cc" -std=c99 $quick -Wall -Wextra -Werror -I"$here" "$1.c" -o "$1.out" -lm && "./$1.out"
}

cached_memory() {
    "$cc" -std=c99 $quick -Wall -Wextra -Werror -I"$here" "$here/examples/cached_memory.c" -o cached.out \
        -lm && ./cached.out >cached.txt || return 1
    cat cached.txt
    grep -q '^call 1 asked for memory [1-9]' cached.txt &&
        [ "$(grep -c '^call [23] asked for memory 0 times$' cached.txt)" = 2 ]
}

passed=0 failed=0
test_that() { # NAME COMMAND ...
    name=$1 && shift
    if "$@" >log 2>&1; then
        passed=$((passed + 1)) && echo "  ok   $name"
    else
        failed=$((failed + 1)) && echo "  FAIL $name" && sed 's/^/       /' log
    fi
}
for n in 1 2 3 4 5 6 7 8; do test_that "recipe $n" recipe $n; done
test_that "a filter called again asks for no memory" cached_memory
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

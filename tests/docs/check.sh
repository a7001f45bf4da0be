#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/docs/check.sh DIR NAME ...
# Runs `make NAME DOCS=DIR/docs` on a copy of docs/, and fails where the pages then say something
# else than at the start (DIR/was); docs/ itself may be edited meanwhile.
# Numbers may differ by 15 % (other compilers, other processors), and errors below 1e-5 and points
# of charts by a little; columns of times are not looked at. Pictures may differ by 1/200 of their
# bytes.
dir=$1
shift
here=$(dirname "$0")
passed=0 failed=0

same() { # FILE: as it was, and in the copy
    case $1 in
    *.png)
        a=$(wc -c <"$dir/was/$1") b=$(wc -c <"$dir/docs/$1")
        [ $((200 * (a > b ? a - b : b - a))) -le "$a" ] || echo "$1: another picture" ;;
    *) awk -v name="$1" -f "$here/same.awk" "$dir/was/$1" "$dir/docs/$1" ;;
    esac
}

for name; do
    begun=$(date +%s)
    rm -rf "$dir/docs" "$dir/was" && mkdir -p "$dir" && cp -R docs "$dir/was" &&
        cp -R "$dir/was" "$dir/docs" || exit 1
    if ! make --no-print-directory "$name" DOCS="$dir/docs" >"$dir/log" 2>&1; then
        cat "$dir/log"
        echo "  FAIL $name"
        failed=$((failed + 1))
        continue
    fi
    (cd "$dir/docs" && find . -type f | sed 's|^\./||' | sort) >"$dir/files"
    while read -r file; do
        if [ ! -e "$dir/was/$file" ]; then
            echo "$file: not in docs/"
        elif ! cmp -s "$dir/was/$file" "$dir/docs/$file"; then
            same "$file"
        fi
    done <"$dir/files" >"$dir/differences" 2>&1
    if [ -s "$dir/differences" ]; then
        sed 's/^/    /' "$dir/differences"
        echo "  FAIL $name: make $name, and look at what changed"
        failed=$((failed + 1))
    else
        echo "  ok   $name ($(($(date +%s) - begun)) s)"
        passed=$((passed + 1))
    fi
done
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

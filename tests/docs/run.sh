#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/docs/run.sh [DIR]
# Holds the pages to what they say, from the top of the project: links lead somewhere, code names
# exist, and two pages are followed word by word in a copy of the project (DIR/project).
# In such a page
#   ```sh      is run, with -e; a name in the fence (```c first.c) saves the block in that file
#   ```text    holds lines that the sh block before it must have printed
dir=${1:-build/docs-test}
here=$PWD
mkdir -p "$dir" || exit 1
dir=$(cd "$dir" && pwd)
passed=0 failed=0

ok() { # NAME COMMAND ...: a test that passes when the command succeeds
    name=$1
    shift
    if "$@" >"$dir/log" 2>&1; then
        passed=$((passed + 1))
        echo "  ok   $name"
    else
        failed=$((failed + 1))
        echo "  FAIL $name"
        tail -n 20 "$dir/log" | sed 's/^/       /'
    fi
}

pages="README.md $(ls docs/*.md)"

# Text outside fences, so that code is not taken for links.
prose() { awk '/^```/ { inside = !inside; next } !inside' "$1"; }

# GitHub's anchors of a page: lower case, no punctuation, spaces are hyphens.
anchors() {
    prose "$1" | sed -n 's/^##* *//p' | tr 'A-Z' 'a-z' | sed -E 's/[^a-z0-9_ -]//g; s/ /-/g'
}

links_lead_somewhere() {
    bad=0
    for page in $pages; do
        for link in $(prose "$page" | grep -oE '\]\([^) ]+\)' | sed 's/^](//; s/)$//' | sort -u); do
            case $link in http*) continue ;; esac
            file=${link%%#*} anchor=
            [ "$file" = "$link" ] || anchor=${link#*#}
            [ -n "$file" ] && file=$(dirname "$page")/$file || file=$page
            if [ ! -e "$file" ]; then
                bad=1
                echo "$page: no $link"
            elif [ -n "$anchor" ] && ! anchors "$file" | grep -qx "$anchor"; then
                bad=1
                echo "$page: no heading for $link"
            fi
        done
    done
    return $bad
}

every_page_is_on_the_map() {
    bad=0
    for page in docs/*.md; do
        page=$(basename "$page")
        [ "$page" = README.md ] || grep -qF "($page" docs/README.md || { bad=1; echo "$page"; }
    done
    return $bad
}

# What stands between backquotes and looks like a name of ours (three underscores or more, or
# envmap_) must be a word of the sources. A name that ends in * stands for those that begin so.
code_names_exist() {
    cat envmap.h Makefile tests/*.[ch] tests/*/* examples/*.c examples/*/* .ci/run |
        grep -aoE '[A-Za-z_][A-Za-z0-9_]*' | sort -u >"$dir/words"
    for page in $pages; do
        prose "$page" | grep -oE '`[A-Za-z0-9]+(_[A-Za-z0-9]+)+(\(\))?`' | tr -d '`()' |
            grep -E '^envmap_|_.*_.*_' | sort -u >"$dir/named"
        comm -23 "$dir/named" "$dir/words" | sed "s|^|$page: no |"
    done >"$dir/unknown"
    cat "$dir/unknown"
    [ ! -s "$dir/unknown" ]
}

# Tests that pages name run: each function of three words or more that stands after RUN(.
tests_of_papers_run() {
    grep -ohE '(RUN|ok)[( ][a-z0-9_]+' tests/*.c tests/*/* | sed -E 's/.*[( ]//' |
        sort -u >"$dir/tests"
    prose docs/papers.md | awk -F'|' '/^\|/ && NF > 4 { print $5 }' |
        grep -oE '`[a-z0-9]+(_[a-z0-9]+){2,}`' | tr -d '`' | grep -v '^envmap_' |
        sort -u >"$dir/named"
    [ -s "$dir/named" ] && comm -23 "$dir/named" "$dir/tests" >"$dir/unknown"
    sed 's/^/no test /' "$dir/unknown"
    [ ! -s "$dir/unknown" ]
}

# From an equation's or figure's number to what does it and to what holds it: every row of the page
# has a code name or a link that exists (see above), and a test or a target of the Makefile.
papers_lead_to_code_and_tests() {
    sed -nE 's/^([a-z0-9-]+):.*/\1/p; s/^\.PHONY: (.*)/\1/p' Makefile | tr ' ' '\n' >"$dir/targets"
    ls examples/measure/*.c | sed 's|.*/||; s|\.c$||' >>"$dir/targets"
    prose docs/papers.md | grep -oE '`make [a-z0-9-]+' | sed 's/.* //' | sort -u |
        grep -vxFf "$dir/targets" | sed 's/^/no target /' >"$dir/unknown"
    prose docs/papers.md | awk -F'|' '
        !/^\|/ || /^\|[ -]*-/ || NF < 7 { next }
        $5 ~ /test or target/ { next }
        $4 !~ /`[^`]+`|\]\(/ { print "no code for:" $2 }
        $5 !~ /`[^`]+`/ { print "no test for:" $2 }' >>"$dir/unknown"
    cat "$dir/unknown"
    [ ! -s "$dir/unknown" ]
}

split() { # PAGE: its blocks as NNN.sh, NNN.text and NNN.file (whose first line is the name)
    awk -v dir="$dir/walk" '
        /^```/ && out { close(out); out = ""; next }
        /^```(sh|text)$/ {
            out = sprintf("%s/%03d.%s", dir, ++n, substr($0, 4))
            printf "" >out
            next
        }
        /^```[a-z]+ [^ ]+$/ { out = sprintf("%s/%03d.file", dir, ++n); print $2 >out; next }
        /^```/ { out = "/dev/null"; next }
        out { print >out }' "$1"
}

follow() { # PAGE: does what it says, in the copy of the project
    rm -rf "$dir/walk" && mkdir -p "$dir/walk" && split "$here/$1" || return 1
    cd "$dir/project" || return 1
    for block in "$dir"/walk/*; do
        case $block in
        *.sh)
            cat "$block"
            sh -e "$block" >"$dir/printed" 2>&1 </dev/null || { cat "$dir/printed"; return 1; } ;;
        *.text)
            while read -r line; do
                sed -E 's/^[ \t]+//' "$dir/printed" | grep -qxF -- "$line" && continue
                echo "not printed: $line"
                cat "$dir/printed"
                return 1
            done <"$block" ;;
        *.file) sed 1d "$block" >"$(head -n 1 "$block")" ;;
        esac
    done
}
walk() { (follow "$1"); }

rm -rf "$dir/project" && mkdir -p "$dir/project" || exit 1
cp -R envmap.h Makefile README.md LICENSE docs examples tests "$dir/project" || exit 1

ok links_lead_somewhere links_lead_somewhere
ok every_page_is_on_the_map every_page_is_on_the_map
ok code_names_exist code_names_exist
ok tests_of_papers_run tests_of_papers_run
ok papers_lead_to_code_and_tests papers_lead_to_code_and_tests
ok getting_started_does_what_it_says walk docs/getting-started.md
ok contributing_does_what_it_says walk docs/contributing.md
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

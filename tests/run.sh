#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/run.sh [-s] [-j N] [-l DIR] COMMAND ...
# Runs every COMMAND (a line of shell), shows what it prints, and ends with one line
# "N passed, N failed": the sum of the lines of that form which the commands end with. A command
# that prints none counts once, by its exit status; with -s (test programs) it counts as a failure,
# because it must have crashed. What passed by is named before the last line. Exits with 1 when anything failed.
#   -j N    N commands at once (the output of each comes whole, when it ends, with its seconds);
#           1 shows it as it comes
#   -l DIR  keep the logs in DIR
summary_needed=0 jobs=1 logs=
while getopts sj:l: option; do
    case $option in
    s) summary_needed=1 ;;
    j) jobs=$OPTARG ;;
    l) logs=$OPTARG ;;
    *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
[ -n "$logs" ] || { logs=$(mktemp -d) && trap 'rm -rf "$logs"' EXIT; }
mkdir -p "$logs" || exit 2
rm -f "$logs"/[0-9]*.log
passed=0 failed=0

# Only the last line of all may read "N passed, N failed".
label() { sed -E "s|^([0-9]+ passed, [0-9]+ failed)\$|$1: \1|"; }

# count NUMBER NAME: adds what command NUMBER reported
count() {
    status=$(cat "$logs/$1.status" 2>/dev/null || echo 1)
    line=$(grep -aE '^[0-9]+ passed, [0-9]+ failed$' "$logs/$1.log" | tail -n 1)
    p=0 f=0
    if [ -n "$line" ]; then
        p=${line%% *}
        f=${line#*, } f=${f%% *}
    elif [ "$status" -eq 0 ] && [ $summary_needed -eq 0 ]; then
        p=1
    fi
    if [ "$p$f" = 00 ] || { [ "$status" -ne 0 ] && [ "$f" -eq 0 ]; }; then
        f=$((f + 1))
        if [ "$status" -gt 128 ]; then
            echo "  FAIL $2: ended by signal $((status - 128))"
        else
            [ -n "$line" ] && why="although its tests passed" || why="and no count of its tests"
            [ $summary_needed -eq 1 ] || [ -n "$line" ] || why=
            echo "  FAIL $2: exit status $status $why"
        fi
    fi
    passed=$((passed + p)) failed=$((failed + f))
}

finish() { # NUMBER: shows the output of a command that has ended
    eval "name=\$name_$1 start=\$start_$1"
    ended=$((ended + 1))
    echo "== $name ($ended of $total, $(($(date +%s) - start)) s)"
    label "$name" <"$logs/$1.log"
    count "$1" "$name"
}

running= total=$# ended=0
wait_below() { # N: until fewer than N commands run
    while :; do
        left= n=0
        for k in $running; do
            eval "pid=\$pid_$k"
            if [ -e "$logs/$k.status" ] || ! kill -0 "$pid" 2>/dev/null; then
                finish "$k"
            else
                left="$left $k" n=$((n + 1))
            fi
        done
        running=$left
        [ $n -ge "$1" ] || return 0
        sleep 0.2
    done
}

i=0
for command; do
    i=$((i + 1))
    name=$(echo "$command" | sed -E 's|^.*/(test_[a-z0-9_]+)$|\1|')
    rm -f "$logs/$i.log" "$logs/$i.status" "$logs/$i.part"
    if [ "$jobs" -le 1 ]; then
        echo "== $name"
        { sh -c "$command" 2>&1; echo $? >"$logs/$i.status"; } | tee "$logs/$i.log" | label "$name"
        count $i "$name"
    else
        {
            sh -c "$command"
            echo $? >"$logs/$i.part" && mv "$logs/$i.part" "$logs/$i.status"
        } >"$logs/$i.log" 2>&1 &
        eval "pid_$i=$! name_$i=\$name start_$i=$(date +%s)"
        running="$running $i"
        wait_below "$jobs"
    fi
done
wait_below 1

# What passed by, for want of a package, once more: nothing is left out in silence.
grep -ahE '[^ ] passed by[: (]' "$logs"/[0-9]*.log | sed 's/^ *//' | sort -u >"$logs/by"
[ ! -s "$logs/by" ] || { echo "not run here: $(($(wc -l <"$logs/by")))" && sed 's/^/  /' "$logs/by"; }
echo "$passed passed, $failed failed"
[ $failed -eq 0 ] && [ $passed -gt 0 ]

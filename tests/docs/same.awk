# SPDX-License-Identifier: MIT
# usage: awk -v name=FILE -f same.awk OLD NEW
# Says where two versions of a page or chart differ by more than check.sh allows.
function number(text) { gsub(/ /, "", text); return text + 0 }
# One step of the last place of a number such as 0.02.
function step(text) { return match(text, /\.[0-9]+$/) ? 10 ^ (1 - RLENGTH) : 0 }
function close_to(old, new,    a, b, d, m) {
    a = number(old)
    b = number(new)
    d = a > b ? a - b : b - a
    m = a * a > b * b ? a : b
    if (m < 0) m = -m
    return d <= 0.15 * m || d <= 1.01 * step(old) || m < 1e-5 || (chart && d <= 3)
}
# Words and numbers in turn; a number may have spaces between thousands.
function alike(old, new,    a, b) {
    while (match(old, pattern)) {
        a = substr(old, RSTART, RLENGTH)
        if (!match(new, pattern)) return 0
        b = substr(new, RSTART, RLENGTH)
        match(old, pattern)
        before = substr(old, 1, RSTART - 1)
        old = substr(old, RSTART + RLENGTH)
        match(new, pattern)
        if (before != substr(new, 1, RSTART - 1)) return 0
        new = substr(new, RSTART + RLENGTH)
        if (!close_to(a, b)) return 0
    }
    return old == new
}
function timed(text) {
    return text ~ /(^|[^a-z])(ms|us|copies|copy|seconds?|speed-up)([^a-z]|$)/ ||
           text ~ /[Mm]illiseconds|took|gcc|clang|pow in both|brute force|hierarchical/
}
function row_alike(old, new,    a, b, n, i) {
    n = split(old, a, "|")
    if (split(new, b, "|") != n) return 0
    for (i = 1; i <= n; ++i) {
        if (timed(heads[i])) continue
        gsub(/\*\*[^*]*\*\*/, "", a[i]) # bold numbers are times
        gsub(/\*\*[^*]*\*\*/, "", b[i])
        if (!alike(a[i], b[i])) return 0
    }
    return 1
}
BEGIN {
    pattern = "[0-9]+( [0-9][0-9][0-9])*(\\.[0-9]+)?(e[-+]?[0-9]+)?"
    chart = name ~ /\.svg$/
}
FNR == NR { lines[FNR] = $0; count = FNR; next }
{
    old = lines[FNR]
    table = old ~ /^\|/
    if (table && !inside) {
        split(old, heads, "|")
        skip = said ~ /^Milli/
    }
    if (!table && old != "") said = old
    inside = table
    if (old == $0 || (table && skip) || (!table && !chart && timed(old))) next
    if (!(table ? row_alike(old, $0) : alike(old, $0)))
        printf "%s:%d\n  - %s\n  + %s\n", name, FNR, substr(old, 1, 200), substr($0, 1, 200)
}
END { if (FNR != count) printf "%s: %d lines instead of %d\n", name, FNR, count }

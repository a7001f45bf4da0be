#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: build.sh OUT.html: the page of examples/web as one file. WORK=DIR keeps what is between.
# Passes by, naming the packages, where clang cannot make WebAssembly.
here=$(dirname "$0") out=$1 work=${WORK:-$(dirname "$1")/web}
mkdir -p "$work" || exit 1
wasm() { # NAME FLAG ...: 64 KB of stack come first, so that an overflow traps
    name=$1 && shift
    clang --target=wasm32-wasi -mexec-model=reactor -std=c99 -DNDEBUG "$@" -I"$here/../.." \
        -Wl,--stack-first -Wl,-z,stack-size=65536 -Wl,-s "$here/web.c" -o "$work/$name"
}
echo '#include <stdlib.h>
int main(void) { return 0; }' >"$work/probe.c"
if ! clang --target=wasm32-wasi -mexec-model=reactor "$work/probe.c" -o "$work/probe.wasm" \
        2>/dev/null; then
    packages="clang lld wasi-libc libclang-rt-14-dev-wasm32"
    echo "web passed by: no WebAssembly here (Debian: $packages)"
    exit 0
fi
wasm simd.wasm -O2 -fno-unroll-loops -mllvm -inline-threshold=150 -msimd128 && wasm scalar.wasm -Oz -DENVMAP_NO_SIMD || exit 1
for name in simd scalar; do
    gzip -9nc "$work/$name.wasm" | base64 | tr -d '\n' >"$work/$name.wasm.txt" || exit 1
done
# A mark @name@ stands for a file, of this folder or of what was built.
awk -v here="$here" -v work="$work" '
    match($0, /@[a-z]+\.(css|js|wasm)@/) {
        name = substr($0, RSTART + 1, RLENGTH - 2)
        file = name ~ /wasm$/ ? work "/" name ".txt" : here "/" name
        printf "%s", substr($0, 1, RSTART - 1)
        while ((status = (getline line <file)) > 0) print line
        if (status < 0) exit 1
        print substr($0, RSTART + RLENGTH)
        next
    }
    { print }' "$here/page.html" >"$work/page.html" && mv "$work/page.html" "$out" && ls -l "$out" |
    awk '{ printf "%s: %d KB, one file, opens from disk\n", $NF, $5 / 1000 }'

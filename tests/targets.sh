#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/targets.sh [-o docs/targets.md] [TARGET ...]
# Runs the tests, in their quick form, as other compilers, flags and machines see them, and prints a
# table of it. A target whose packages are not here passes by and names them. LONG=1 runs the tests
# that take minutes under an emulator, too.
cd "$(dirname "$0")/.." && root=$PWD || exit 1
table=
[ "${1:-}" = -o ] && table=$2 && shift 2
wanted=" $* "
mkdir -p "${BUILD:-build}/targets" && build=$(cd "${BUILD:-build}/targets" && pwd) || exit 1
body= names= passed=0 failed=0
strict='-Wall -Wextra -Wpedantic -Wshadow -Wundef -Werror'
few='base compare directions pfm lobes prepared'
more="$few search harmonics mips stability_maps materials hierarchical sh calls threads"
[ -z "${LONG:-}" ] || few="$more" more="$more filters fast near plan scenes"
echo 'int main(void) { return 0; }' >"$build/probe.c"

target() { # NAME TESTS PACKAGES CC CFLAGS RUN [LIBS] [STRICT]
    names="$names $1"
    [ "$wanted" = '  ' ] || case $wanted in *" $1 "*) ;; *) return ;; esac
    dir=$build/$1 start=$(date +%s)
    libs=${7:--lm -lpthread} flags=${8:-$strict}
    mkdir -p "$dir"
    $4 $5 "$build/probe.c" -o "$dir/probe" >/dev/null 2>&1 && $6 "$dir/probe" >/dev/null 2>&1 || {
        echo "target $1 passed by (Debian: $3)"
        return
    }
    tests=
    for t in $2; do
        [ ! -e "tests/test_$t.c" ] || tests="$tests $dir/tests/test_$t"
    done
    TEST_QUICK=1 make --no-print-directory test BUILD="$dir" COMPILE= TESTS="$tests" CC="$4" \
        CFLAGS="$5" BODYFLAGS="$body" STRICT="$flags" LIBS="$libs" RUN="$6" JOBS="${JOBS:-2}" >"$dir/log" 2>&1
    line=$(grep -aE '^[0-9]+ passed, [0-9]+ failed$' "$dir/log" | tail -n 1)
    [ -n "$line" ] || line='0 passed, 1 failed'
    passed=$((passed + ${line%% *}))
    n=${line#*, } failed=$((failed + ${n%% *}))
    [ "${n%% *}" = 0 ] || grep -aE '^ *FAIL|error:|tests/.*: ' "$dir/log" | head -n 20
    echo "target $1: $line, $(($(date +%s) - start)) s"
    version=$($4 --version 2>/dev/null | head -n 1) || version=
    [ -n "$version" ] || version=$($4 -v 2>&1 | head -n 1)
    echo "| $1 | $version | \`$5 $body\` | $6 | $line |" >"$dir/row"
}

qemu() { target "$1" "$few" "gcc-$1-linux-gnu qemu-user" "$1-linux-gnu-gcc" '-O2 -static' "qemu-$1"; }

for cc in gcc-11 gcc-12 gcc-14 clang-13 clang-14 clang-16 clang-19 clang-22; do
    target $cc "$more" $cc $cc -O2 ''
done
# tcc takes no NAN in a constant initializer.
target tcc "$(echo "$few" | sed 's/ prepared//')" tcc tcc '' '' '-lm -lpthread' ' '
# The bodies alone: a test compiled so could not tell what is not finite, and linking so makes small
# numbers zero. For the same reason not those tests that have bodies of their own.
open="base compare directions pfm mips search stability_maps materials hierarchical calls"
body=-Ofast
target gcc-Ofast "$open" gcc gcc -O2 ''
body='-O3 -ffast-math' # clang divides by multiplying, so a cube's edges are not exactly at 0 and 1
target clang-ffast-math "$(echo "$open" | sed 's/ directions//')" clang clang -O2 ''
body=
target chars-and-enums "$more" gcc gcc '-O2 -funsigned-char -fshort-enums' ''
target no-simd "$more" gcc gcc '-O2 -DENVMAP_NO_SIMD' ''
target m32-sse2 "$more" 'libc6-dev-i386 lib32gcc-12-dev' gcc '-O2 -m32 -msse2 -mfpmath=sse' ''
target m32-x87 "$more" 'libc6-dev-i386 lib32gcc-12-dev' gcc '-O2 -m32' ''
qemu aarch64
qemu riscv64
qemu s390x # big-endian
wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
WINEPREFIX=${WINEPREFIX:-$build/wine} WINEDEBUG=-all
export WINEPREFIX WINEDEBUG
# gcc adds .exe to a name and wine does not; Windows ends lines with CR LF.
printf '%s\n' "'$wine' \"\$1.exe\" >\"\$1.out\"" 'status=$?' "tr -d '\\r' <\"\$1.out\"" 'exit $status' \
    >"$build/wine.sh"
target mingw64 "$more" 'gcc-mingw-w64-x86-64 wine64' x86_64-w64-mingw32-gcc '-O2 -static' "sh $build/wine.sh"
# The tool, too: what it bakes there is what it bakes here, byte for byte.
windows_tool() {
    names="$names mingw64-tool"
    [ "$wanted" = '  ' ] || case $wanted in *' mingw64-tool '*) ;; *) return ;; esac
    dir=$build/mingw64-tool cc=x86_64-w64-mingw32-gcc
    rm -rf "$dir" && mkdir -p "$dir"
    $cc "$build/probe.c" -o "$dir/probe.exe" 2>/dev/null && "$wine" "$dir/probe.exe" 2>/dev/null || {
        echo 'target mingw64-tool passed by (Debian: gcc-mingw-w64-x86-64 wine64)'
        return
    }
    line='0 passed, 1 failed'
    make -s --no-print-directory "${BUILD:-build}/envmap" && here=$(cd "${BUILD:-build}" && pwd)/envmap &&
        $cc -std=c99 -O2 -static $strict -I. examples/tool/envmap.c -o "$dir/envmap.exe" -lm -lpthread &&
        cd "$dir" && "$here" generate sun sky.hdr --size 32 &&
        "$here" bake sky.hdr here --size 16 >/dev/null &&
        "$wine" envmap.exe bake sky.hdr 'out\there' --size 16 >/dev/null &&
        "$wine" envmap.exe bake sky.hdr out/there --size 16 >/dev/null && # over what exists
        cmp here/specular.ktx2 out/there/specular.ktx2 && cmp here/preview.png out/there/preview.png &&
        cmp here/split-sum.ktx2 out/there/split-sum.ktx2 &&
        cmp here/irradiance.ktx2 out/there/irradiance.ktx2 && [ -s out/there/manifest.json ] &&
        "$wine" envmap.exe info - <sky.hdr | grep -q 'Radiance RGBE, 64 x 32' && line='1 passed, 0 failed'
    cd "$root" || exit 1
    n=${line#*, } passed=$((passed + ${line%% *})) failed=$((failed + ${n%% *}))
    echo "target mingw64-tool: $line"
    echo "| the tool, mingw64 | $($cc --version | head -n 1) | \`-O2 -static\` | wine64 | $line |" >"$dir/row"
}
windows_tool
# The stack comes first in memory, so that one that is too small traps and overwrites nothing. Node 20
# may crash at the end of a program unless it has one thread.
target wasm32 "$more" 'clang wasi-libc libclang-rt-14-dev-wasm32 lld nodejs' clang \
    '-O2 --target=wasm32-wasi -D_WASI_EMULATED_PROCESS_CLOCKS' \
    'node --no-warnings --single-threaded tests/compile/wasi.js' \
    '-lm -lwasi-emulated-process-clocks -Wl,-z,stack-size=1048576,--stack-first'

# Of every target that has been run here, now or before.
if [ -n "$table" ]; then
    {
        echo '# Targets'
        echo
        echo 'The tests, in their quick form, as other compilers, flags and machines see them. `make'
        echo 'targets` runs them and writes this table; a target whose packages are missing passes by.'
        echo 'Emulated machines run the tests that take seconds; `make targets LONG=1` runs more. For'
        echo '`-Ofast` and `-ffast-math` the bodies of the header are compiled so, and the tests are not:'
        echo 'they could not tell what is not a number. clang then divides by multiplying with the'
        echo "reciprocal, so coordinates on a cube's edges may miss 0 and 1 by a rounding."
        echo 'The tool is built for Windows, too, and what it bakes there compared byte for byte.'
        echo
        echo '| target | compiler | flags | run by | tests |'
        echo '|---|---|---|---|---|'
        for name in $names; do
            [ ! -e "$build/$name/row" ] || cat "$build/$name/row"
        done | sed "s|sh $build/wine.sh|wine64|" | sed 's|/usr/lib/wine/||; s/ *`/`/2; s/|  *|/| |/g'
    } >"$table"
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/compile/run.sh CC [DIR] [strict]
# What a compiler says about the header, one test per way to use it. DIR holds what is built, in
# the project's folder. With `strict`: every standard, extern and static, tests and examples too.
cc=${1:-cc} dir=${2:-build/compile} more=${3:-}
cd "$(dirname "$0")/../.." || exit 1
here=$PWD
mkdir -p "$dir" || exit 1
passed=0 failed=0
warn="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wundef -Wcast-qual \
-Wdouble-promotion -Werror"
c="$cc $warn -x c -I$here"
cpp="$cc $warn -x c++ -I$here"

ok() { # NAME COMMAND ...: a test that passes when the command succeeds
    name=$1
    shift
    if "$@" >"$dir/log" 2>&1; then
        passed=$((passed + 1))
        echo "  ok   $name"
    else
        failed=$((failed + 1))
        echo "  FAIL $name"
        echo "       $*"
        head -n 20 "$dir/log" | sed 's/^/       /'
    fi
}

# ---------------------------------------------------------------------------------- the sources --
echo '#include "envmap.h"
int envmap_test_alone(void); int envmap_test_alone(void) { return (int)sizeof(envmap); }' >"$dir/alone.c"
echo '#define ENVMAP_IMPLEMENTATION
#include "envmap.h"' >"$dir/body.c"
echo '#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
int main(void) { return envmap_faces(ENVMAP_CUBE) - 6; }' >"$dir/static.c"
echo '#include "envmap.h"
#include "envmap.h"
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "envmap.h"
int main(void) { return envmap_faces(ENVMAP_CUBE) - 6; }' >"$dir/twice.c"
echo '#include "envmap.h"
int other(void);
int main(void) { return envmap_faces(ENVMAP_CUBE) - 6 + other(); }' >"$dir/main.c"
echo '#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
int other(void); int other(void) { return envmap_faces(ENVMAP_PARABOLOID) - 2; }' >"$dir/other.c"
echo '#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
int other(void); int other(void) { return envmap_faces(ENVMAP_PARABOLOID) - 2; }' >"$dir/static_other.c"
echo '#include <stddef.h>
void *grab(void *context, size_t bytes); void release(void *context, void *pointer);
#define ENVMAP_MALLOC(context, bytes) grab(context, bytes)
#define ENVMAP_FREE(context, pointer) release(context, pointer)
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"' >"$dir/memory.c"
echo '#define ENVMAP_NO_STDIO
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"' >"$dir/no_stdio.c"
# The quick start is the indented block of the header's first comment, as it stands.
sed -n '/QUICK START/,/THE IDEA/p' envmap.h | sed -n 's/^       //p' | grep . >"$dir/quick.c"
sed 's/{0}/{}/g' "$dir/quick.c" >"$dir/quick_cpp.c"
# A lat-long of 4 x 2 ones: rows of little-endian 1.0f, samples 1.
ones='\000\000\200\077\000\000\200\077\000\000\200\077'
printf "PF\n4 2\n-1.0\n$ones$ones$ones$ones$ones$ones$ones$ones" >"$dir/sky.pfm"

# ------------------------------------------------------------------------------------- the tests --
cxx=1
echo 'int main() { return 0; }' >"$dir/probe.c"
$cpp "$dir/probe.c" -o "$dir/probe" >/dev/null 2>&1 || {
    cxx=0
    echo "  C++ tests passed by: $cc has no C++ (Debian: g++, or clang with libstdc++-12-dev)"
}

standards="c:c99 c:c11"
[ $cxx = 0 ] || standards="$standards c++:c++11 c++:c++20"
if [ "$more" = strict ]; then
    standards="c:c99 c:c11 c:c17"
    [ $cxx = 0 ] || standards="$standards c++:c++11 c++:c++14 c++:c++17 c++:c++20"
fi
for pair in $standards; do
    compile="$cc $warn -x ${pair%%:*} -std=${pair#*:} -I$here -c"
    # What only the optimiser sees it sees in any standard: the oldest of C will do, and with
    # `strict` that of C++ too.
    case $more${pair#*:} in c99 | strictc99 | strictc++11) ;; *) compile="$compile -fsyntax-only" ;; esac
    ok "the header alone is ${pair#*:}" $compile "$dir/alone.c" -o "$dir/alone.o"
    # Without PIC, so that constant tables of addresses lie in .rodata: see symbols below.
    ok "the implementation is ${pair#*:}" $compile -O2 -fno-pic "$dir/body.c" -o "$dir/body-${pair#*:}.o"
    ok "the static implementation is ${pair#*:}" $compile -O2 "$dir/static.c" -o "$dir/static.o"
    [ "$more" = strict ] || continue
    ok "the implementation at -O0 is ${pair#*:}" $compile -O0 "$dir/body.c" -o "$dir/body.o"
    ok "without stdio it is ${pair#*:}" $compile -O2 "$dir/no_stdio.c" -o "$dir/no_stdio.o"
    ok "with its own memory it is ${pair#*:}" $compile -O2 "$dir/memory.c" -o "$dir/memory.o"
done
if [ "$more" = strict ]; then
    for file in tests/*.c tests/*/*.c; do
        [ -e "$file" ] || continue
        ok "$file is C99" $c -std=c99 -O2 -Itests -fsyntax-only "$file"
    done
    gl=1
    echo '#include <EGL/egl.h>
#include <GL/glcorearb.h>' >"$dir/probe.c"
    $c -std=c99 -c "$dir/probe.c" -o "$dir/probe.o" >/dev/null 2>&1 || {
        gl=0
        echo "  OpenGL examples passed by: no EGL headers here (Debian: libegl-dev libgl-dev)"
    }
    for file in examples/*.c examples/*/*.c; do
        [ -e "$file" ] || continue
        case $gl$file in 0examples/gl/*) continue ;; esac
        ok "$file is C99" $c -std=c99 -O2 -fsyntax-only "$file"
    done
    echo "$passed passed, $failed failed"
    [ $failed -eq 0 ]
    exit
fi

ok "asserts off it is clean" $c -std=c99 -DNDEBUG -c "$dir/body.c" -o "$dir/ndebug.o"

links() { "$@" -lm && "$dir/a.out"; }
c99="$c -std=c99"
# Names that programs and their systems define, as numbers and with arguments: code that used one
# would not compile. The bodies are held against the first only where it is no letter of the papers.
names='near far min max small IN OUT ERROR interface PI EPS'
letters='A B C D E F G H I J K L M N O P Q R S T U V W X Y Z'
hostile() { # HOW NAMES FILE
    flags=
    for word in $2; do flags="$flags -D$word$1=)"; done
    $c99 $flags -fsyntax-only "$3"
}
ok "macros of any name before the declarations break nothing" hostile '' "$names $letters" "$dir/alone.c"
ok "macros with arguments, X(a, b), break no body" hostile '(a,b)' "$letters" "$dir/body.c"
ok "macros $names break no body" hostile '' "$names" "$dir/body.c"
windows=x86_64-w64-mingw32-gcc
if command -v $windows >/dev/null; then
    { echo '#include <windows.h>' && cat "$dir/body.c"; } >"$dir/windows.c"
    ok "windows.h before it breaks nothing" $windows $warn -std=c99 -I"$here" -fsyntax-only "$dir/windows.c"
else
    echo "  windows.h passed by: no $windows here (Debian: gcc-mingw-w64-x86-64)"
fi
ok "-O3 -ffast-math refuses what is not finite" links $c99 -O3 -ffast-math \
    tests/compile/fast_math.c -o "$dir/a.out"
# Static, at -O1, which leaves out at once what is not called; -O0 of gcc compiles it.
ok "static it links and runs" links $c99 -O1 "$dir/static.c" -o "$dir/a.out"
ok "included twice it links and runs" links $c99 "$dir/twice.c" -o "$dir/a.out"
shared() {
    $c99 -c "$dir/other.c" -o "$dir/other.o" && $c99 -c "$dir/main.c" -o "$dir/main.o" &&
        $cc "$dir/main.o" "$dir/other.o" -o "$dir/a.out" -lm && "$dir/a.out"
}
ok "two objects share one implementation" shared
ok "two objects with static copies link" links $c99 -O1 "$dir/static.c" "$dir/static_other.c" -o "$dir/a.out"
if [ $cxx = 1 ]; then
    c11="$cpp -std=c++11"
    ok "two C++ objects share one implementation" links $c11 "$dir/main.c" "$dir/other.c" -o "$dir/a.out"
    ok "two C++ objects with static copies link" links $c11 -O1 "$dir/static.c" "$dir/static_other.c" -o "$dir/a.out"
    # the call, `other`, is extern "C" in one of them only, so it has to be asked for by its C name
    sed 's/^int other(void);/extern "C" &/' "$dir/main.c" >"$dir/main_cpp.c"
    mixed() {
        $c11 -c "$dir/main_cpp.c" -o "$dir/main.o" &&
            $cc "$dir/main.o" "$dir/other.o" -o "$dir/a.out" -lm && "$dir/a.out"
    }
    ok "a C++ program uses an implementation in C" mixed
fi

# Symbols: nm of binutils comes with every gcc and clang of Debian. What is referred to it is without
# optimisation, too.
symbols=$dir/body-c99.o
$c99 -c "$dir/no_stdio.c" -o "$dir/no_stdio.o" 2>/dev/null
$c99 -c "$dir/memory.c" -o "$dir/memory.o" 2>/dev/null
none() { # PATTERN OBJECT: no symbol whose line in nm's list matches
    nm "$2" >"$dir/nm" && ! grep -E "$1" "$dir/nm"
}
exported() { nm -g --defined-only "$1" | awk '$3 !~ /^envmap_/ { print; bad = 1 } { n++ } END { exit bad || !n }'; }
ok "every exported symbol starts with envmap_" exported "$symbols"
ok "there is no variable that can be written" none ' [bBdDcC] ' "$symbols"
stdio='fopen|fdopen|freopen|fclose|fread|fwrite|fseek|ftell|fflush|fgetc|getc|fgets|fputc|fputs|putc'
stdio="$stdio|putchar|puts|[a-z_]*printf[a-z_]*|[a-z_]*scanf|perror|stdin|stdout|stderr|remove|rename|tmpfile"
ok "ENVMAP_NO_STDIO refers to nothing of stdio" none " U ($stdio)[0-9]*(@.*)?\$" "$dir/no_stdio.o"
ok "nothing ends the program or prints" none ' U (abort|exit|_exit|__assert_fail|v?printf|puts|putchar|perror|stdout|stderr)(@.*)?$' "$dir/ndebug.o"
ok "no number is read by the locale" none ' U [a-z_]*(strto[a-z]+|ato[a-z]+|scanf|setlocale)' "$symbols"
ok "own memory replaces malloc and free" none ' U (malloc|calloc|realloc|free)(@.*)?$' "$dir/memory.o"
asks() { nm "$dir/memory.o" | grep -q ' U grab' && nm "$dir/memory.o" | grep -q ' U release'; }
ok "own memory is asked for" asks

# The banner's "envmap.h 0.1" and ENVMAP_VERSION.
version() {
    banner=$(sed -nE 's/^ +envmap\.h ([0-9]+)\.([0-9]+)(\.([0-9]+))? - .*/\1 \2 0\4/p' envmap.h)
    set -- $banner
    grep "^#define ENVMAP_VERSION $(($1 * 10000 + $2 * 100 + $3)) " envmap.h
}
ok "the version is that of the banner" version

# The quick start.
lines() { n=$(wc -l <"$dir/quick.c") && echo "$n lines" && [ "$n" -ge 5 ] && [ "$n" -le 15 ]; }
ok "the quick start has at most 15 lines" lines
# As it stands it is compiled, and run where it finds no sky; with a result of 4 texels instead of
# 128, which takes no time, it is run to its end.
sed 's/128/4/g' "$dir/quick.c" >"$dir/small.c"
mkdir -p "$dir/nowhere"
quick() { "$@" -lm && (cd "$dir/nowhere" && ! ../quick); }
small() { "$@" -lm && (cd "$dir" && ./small); }
ok "the quick start compiles in C99, and misses its sky" quick $c99 "$dir/quick.c" -o "$dir/quick"
ok "with a sky it runs to its end" small $c99 "$dir/small.c" -o "$dir/small"
[ $cxx = 0 ] || ok "the quick start compiles in C++11" quick $cpp -std=c++11 "$dir/quick_cpp.c" -o "$dir/quick"

echo "$passed passed, $failed failed"
[ $failed -eq 0 ]

#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/compile/size.sh CC DIR [DOCUMENT]
# Bytes of code and constants that a program carries of the header, by what it uses: whole programs,
# linked with --gc-sections, less one that does nothing. Written between the marks of DOCUMENT.
cc=${1:-cc} dir=${2:-build/size} document=$3
here=$PWD
mkdir -p "$dir" || exit 1
command -v size >/dev/null || {
    echo "size passed by: no size here (Debian: binutils)"
    exit 0
}
flags="-std=c99 -Os -ffunction-sections -fdata-sections -I$here"

text() { # FILE.c ...: bytes of the program, code and constants
    $cc $flags "$@" -Wl,--gc-sections -o "$dir/program" -lm && size "$dir/program" | awk 'NR == 2 { print $1 }'
}

# The parts. Each is a whole main; what is read at run time keeps the compiler from knowing.
write() { # NAME STATEMENTS
    printf '#include "envmap.h"\nstatic envmap a, b; static float f[3]; static double s[75];\n%s%s' \
        'static envmap_lobe lobe; static envmap_filter_desc desc; static envmap_plan needs;' \
        '
static envmap_brdf brdf; static envmap_frame frame; static envmap_fit fit;
static float matrix[48], packed[28]; static envmap_difference difference;
' >"$dir/$1.c"
    printf 'int main(int n, char **v) {\n    (void)v; (void)s; (void)lobe; (void)desc; (void)needs; (void)brdf; (void)frame;\n    (void)fit; (void)matrix; (void)packed; (void)difference; (void)a; (void)b; (void)f;\n    f[0] = (float)n;\n    %s\n    return (int)f[1];\n}\n' "$2" >>"$dir/$1.c"
}
load='if (envmap_pfm_load(&a, v[1], ENVMAP_LATLONG)) return 1; envmap_lookup(f, &a, f, f[0]);'
make='if (envmap_create(&b, ENVMAP_CUBE, n, 1, 1)) return 1; lobe = envmap_lobe_phong(f[0]);'
write nothing ''
write lookup "$load"
write mips "$load envmap_mips_build(&a);"
write resample "$load $make envmap_resample(&b, &a, NULL); envmap_pfm_save(&b, v[1], 0);"
write filter "$load $make f[1] = (float)envmap_filter(&b, &a, &lobe, &desc);"
write reference "$load $make desc.method = ENVMAP_METHOD_REFERENCE; f[1] = (float)envmap_filter(&b, &a, &lobe, &desc);"
write sh "$load lobe = envmap_lobe_diffuse(); envmap_sh_project(s, 3, &a, 0, 0, 0); envmap_sh_convolve(s, s, 3, &lobe, 0); envmap_sh_pack(matrix, packed, s); f[1] = packed[n];"
write plan "$load $make envmap_filter(&b, &a, &lobe, &desc); envmap_filter_plan(&needs, &b, &a, &lobe, &desc); f[1] = (float)needs.size;"
write radiance "$load envmap_radiance(f, &a, &brdf, &frame, 1, &desc.work);"
write fit "$load envmap_fit_brdf(&fit, &brdf, 0); envmap_fit_lookup(f, &fit, &a, f, f);"
write ggx "envmap_ggx_split_sum(s, s + 1, f[0], f[0]); f[1] = (float)s[0];"
write compare "$load $make envmap_compare(&difference, &a, &b, 0); f[1] = (float)difference.rms;"
printf '#define ENVMAP_IMPLEMENTATION\n#include "envmap.h"\n' >"$dir/body.c"

both() { # NAME: "static object", in bytes above a program that does nothing
    own=$(text -DENVMAP_STATIC -DENVMAP_IMPLEMENTATION "$dir/$1.c") || exit 1
    apart=$(text "$dir/$1.c" "$dir/body.o") || exit 1
    echo "$((own - $(cat "$dir/nothing"))) $((apart - $(cat "$dir/nothing")))"
}
text -DENVMAP_STATIC -DENVMAP_IMPLEMENTATION "$dir/nothing.c" >"$dir/nothing" || exit 1
$cc $flags -c "$dir/body.c" -o "$dir/body.o" || exit 1

{
    echo "| a program that | ENVMAP_STATIC | its own object |"
    echo "|---|--:|--:|"
    while IFS=: read -r name what; do
        set -- $(both "$name")
        [ $# = 2 ] || exit 1
        echo "| $what | $1 | $2 |"
    done <<END
nothing:includes the header, and calls nothing
lookup:loads a PFM and looks up
mips:... and builds mips
resample:... resamples and saves
compare:... and compares
sh:... and lights with nine harmonics
filter:... and filters, any method
reference:... and filters, REFERENCE alone
plan:... and plans
radiance:... and sums eq. 1
fit:... and fits a BRDF
ggx:has GGX's split sum alone
END
    echo "| all of it, not linked | | $(size "$dir/body.o" | awk 'NR == 2 { print $1 }') |"
} >"$dir/table.md" || exit 1
cat "$dir/table.md"
[ -n "$document" ] || exit 0
{
    sed '/^<!-- make size/q' "$document"
    cat "$dir/table.md"
    sed -n '/^<!-- make size/,$p' "$document" | sed -n '/^<!-- end -->/,$p'
} >"$dir/document.md" && cp "$dir/document.md" "$document"

#!/bin/sh
# SPDX-License-Identifier: MIT
# usage: tests/limits.sh ENVMAP DIR EDGE [FACES]: the tool on a lat-long map of 2 EDGE x EDGE texels and on a
# cube of faces of FACES, or EDGE / 4, from file to file: a row of a table for each command, with the
# seconds of all processors and the peak of memory. EDGE = 8192 takes 2 GB in DIR and 4 GB of memory;
# with FACES = 8192 it takes 7 GB and 12 GB.
tool=$1 dir=$2 edge=$3
mkdir -p "$dir" || exit 1
measure=$(command -v time) && [ -x "$measure" ] || measure=/usr/bin/time
[ -x "$measure" ] || { echo "limits passed by: no time here (Debian: time)"; exit 0; }

faces=${4:-$((edge / 4))}
echo "| lat-long $((2 * edge)) × $edge, faces of $faces | processor, s | peak, MiB |"
echo "|---|---|---|"
row() { # NAME COMMAND ...
    name=$1 && shift
    "$measure" -f '%U %S %M' -o "$dir/time" "$@" >"$dir/log" 2>&1 ||
        { cat "$dir/log" && echo "| $name | failed | |" && exit 1; }
    tail -n 1 "$dir/time" | awk -v name="$name" '{ printf "| %s | %.0f | %.0f |\n", name, $1 + $2, $3 / 1024 }'
}
# A studio of 256 rows, again and again: its texels are what counts, not where they are.
"$tool" generate studio "$dir/tile.pfm" --size 256 --to latlong && tail -n +4 "$dir/tile.pfm" >"$dir/tile"
{ printf 'PF\n%d %d\n-1\n' $((2 * edge)) "$edge"
  i=0
  while [ $i -lt $((edge * edge / 65536)) ]; do cat "$dir/tile" && i=$((i + 1)); done; } >"$dir/sky.pfm"
row "load it, filter with Phong 100 to faces of 256" "$tool" filter "$dir/sky.pfm" "$dir/gloss.pfm" \
    --lobe phong --exponent 100 --to cube --size 256
row "load it, bake" "$tool" bake "$dir/sky.pfm" "$dir/baked"
row "load it, convert it to the cube, save" "$tool" convert "$dir/sky.pfm" "$dir/cube.pfm" --to cube \
    --size "$faces"
row "load the cube, filter with Phong 100 to faces of 256" "$tool" filter "$dir/cube.pfm" \
    "$dir/gloss.pfm" --lobe phong --exponent 100 --to cube --size 256
rm -rf "$dir/tile" "$dir/tile.pfm" "$dir/sky.pfm" "$dir/cube.pfm" "$dir/gloss.pfm" "$dir/baked"

/* SPDX-License-Identifier: MIT
   What turning a map into another one takes and loses: the table of docs/parameterizations.md.

   What you will see: for each pair of maps the time in copies of both, and how much light a lit
   texel alone and the whole of a map lose, at the worst of what is tried. `conversions DOCS` also
   puts the table into DOCS/parameterizations.md.

   Time is CPU time, one thread, the best of three. */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "measure.h"

typedef struct pair {
    int from, size, to, edge;
} pair;

static const char *const name[] = {"cube",     "paraboloid",  "sphere map",
                                   "lat-long", "angular map", "octahedral"};
static measure_document document;

static double energy(const envmap *map) {
    double sum = 0;
    for (int face = 0; face < envmap_faces(map->mapping); ++face)
        for (int y = 0; y < map->size; ++y)
            for (int x = 0; x < measure_width(map, 0); ++x)
                sum += envmap_solid_angle(map, 0, face, x, y) *
                       (double)envmap_texel(map, 0, 0, face, x, y)[0];
    return sum;
}

static double larger(double a, double b) { return a > b ? a : b; }

/* Light lost or won, over the light there is. */
static double lost(envmap *to, const envmap *from) {
    measure_must(envmap_resample(to, from, NULL), "resample");
    return fabs(energy(to) / energy(from) - 1);
}

static void row(FILE *out, pair p) {
    envmap from = measure_map(p.from, p.size, 1, 1), to = measure_map(p.to, p.edge, 1, 1);
    double best = 1e30, alone = 0, whole, copy = measure_copy(&from, &to, 1, measure_seconds);
    size_t floats = measure_bytes(&from, 1) / sizeof(float);
    unsigned state = 1;
    for (int i = 0; i < 24; ++i) { /* texels along a diagonal of a face */
        int at = (int)((i + 0.5) / 24 * p.size), x = at * measure_width(&from, 0) / p.size;
        if (!(envmap_solid_angle(&from, 0, 0, x, at) > 0)) continue;
        measure_flat(&from, 0);
        envmap_texel(&from, 0, 0, 0, x, at)[0] = 1;
        alone = larger(alone, lost(&to, &from));
    }
    for (size_t i = 0; i < floats; ++i) {
        state = state * 1664525u + 1013904223u;
        from.texels[i] = (float)(state >> 8) / 16777216.0f;
    }
    whole = lost(&to, &from);
    for (int i = 0; i < 3; ++i) {
        double start = measure_seconds();
        measure_must(envmap_resample(&to, &from, NULL), "resample");
        start = measure_seconds() - start;
        best = start < best ? start : best;
    }
    fprintf(out, "| %s %d → %s %d | %.1f | %.0f | %.2g %% | %.1g |\n", name[p.from], p.size,
            name[p.to], p.edge, 1e3 * best, best / copy, 100 * alone, whole);
    envmap_free(&from), envmap_free(&to);
}

int main(int argc, char **argv) {
    static const pair pairs[] = {
        {3, 1024, 0, 512}, {3, 256, 0, 256}, {3, 512, 0, 128}, {0, 256, 3, 256}, {0, 512, 3, 256},
        {4, 512, 0, 128},  {2, 512, 0, 128}, {1, 256, 0, 128}, {0, 256, 2, 256}, {0, 256, 4, 256},
        {3, 256, 4, 256},  {5, 512, 0, 128}, {0, 256, 5, 512}, {3, 512, 5, 512}, {0, 256, 0, 128}};
    FILE *out = measure_begin(&document, "conversions");
    fprintf(out, "| conversion | ms | copies | a texel alone loses, at most | a whole map, of 1 |\n"
                 "|---|---|---|---|---|\n");
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; ++i) row(out, pairs[i]);
    measure_end(&document, out, 1);
    if (argc > 1) {
        char path[4096];
        snprintf(path, sizeof path, "%s/parameterizations.md", argv[1]);
        measure_write(&document, path, "make conversions");
    }
    measure_document_free(&document);
    return 0;
}

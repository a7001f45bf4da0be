/* compiled.c - what a compiler and its flags make of the same filters: the table of docs/filters.md.

   What you will see: for each compiler and set of flags that work here, the milliseconds of a few
   filters of a cube 256 x 256, and how many times those of the fastest. `compiled DOCS` also puts
   the table into DOCS/filters.md. It builds itself again for each row, so run it where envmap.h is.

   Time is CPU time, one thread, the best of five.

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/picture.h"
#include "../tool/scenes.h"

#define LOBES 6
#define EDGE  256

static const char *const titles[LOBES] = {"Phong 10",   "Phong 100", "Phong 500",
                                          "Phong 5000", "Phong 1e6", "GGX .001"};

static envmap_lobe lobe_of(int i) {
    static const float exponents[LOBES - 1] = {10, 100, 500, 5000, 1e6f};
    return i < LOBES - 1 ? envmap_lobe_phong(exponents[i]) : envmap_lobe_ggx(0.001f);
}

/* Milliseconds of each lobe, as this program was compiled. */
static void times_of(double ms[LOBES]) {
    envmap src = measure_map(ENVMAP_CUBE, EDGE, 1, 1), dst = measure_map(ENVMAP_CUBE, EDGE, 1, 1);
    scene_fill(&src, SCENE_SUN);
    for (int i = 0; i < LOBES; ++i) {
        envmap_lobe lobe = lobe_of(i);
        ms[i] = 1e30;
        for (int run = 0; run < 5; ++run) {
            double start = measure_seconds();
            measure_must(envmap_filter(&dst, &src, &lobe, NULL), titles[i]);
            start = 1e3 * (measure_seconds() - start);
            ms[i] = start < ms[i] ? start : ms[i];
        }
    }
    envmap_free(&src), envmap_free(&dst);
}

/* The same of this program, compiled again; 0 where that does not work here. */
static int times_with(double ms[LOBES], const char *flags, const char *program) {
    char line[4096];
    snprintf(line, sizeof line,
             "%s -std=c99 -w -I. examples/measure/compiled.c -o '%s-row' -lm 2>/dev/null && "
             "'%s-row' row",
             flags, program, program);
    FILE *out = popen(line, "r");
    int count = 0;
    if (!out) return 0;
    while (count < LOBES && fscanf(out, "%lf", ms + count) == 1) ++count;
    return pclose(out) == 0 && count == LOBES;
}

int main(int argc, char **argv) {
    static const char *const flags[] = {
        "gcc -O3 -march=native", "gcc -O3 -mavx2 -mfma",  "gcc -O3", "gcc -O2 -march=native",
        "gcc -O2 -mavx2 -mfma",  "gcc -O2",               "gcc -O2 -DENVMAP_NO_SIMD",
        "clang -O3 -march=native", "clang -O2 -mavx2 -mfma", "clang -O2"};
    double ms[COUNT(flags)][LOBES], least[LOBES];
    int works[COUNT(flags)];
    measure_document document;
    if (argc == 2 && !strcmp(argv[1], "row")) {
        times_of(ms[0]);
        for (int i = 0; i < LOBES; ++i) printf("%.3f\n", ms[0][i]);
        return 0;
    }
    memset(&document, 0, sizeof document);
    for (int i = 0; i < LOBES; ++i) least[i] = 1e30;
    for (int f = 0; f < COUNT(flags); ++f) {
        fprintf(stderr, "\r%-40s", flags[f]);
        works[f] = times_with(ms[f], flags[f], argv[0]);
        for (int i = 0; i < LOBES && works[f]; ++i)
            if (ms[f][i] < least[i]) least[i] = ms[f][i];
    }
    fprintf(stderr, "\r%40s\r", "");
    FILE *out = measure_begin(&document, "compiled");
    fprintf(out, "Milliseconds, cube %d² to cube %d² beside a sun, and times the least of a column.\n\n|",
            EDGE, EDGE);
    for (int i = 0; i < LOBES; ++i) fprintf(out, " | %s", titles[i]);
    fprintf(out, " |\n|---|--:|--:|--:|--:|--:|--:|\n");
    for (int f = 0; f < COUNT(flags); ++f) {
        if (!works[f]) continue;
        fprintf(out, "| `%s`", flags[f]);
        for (int i = 0; i < LOBES; ++i)
            fprintf(out, " | %.1f (%.1f)", ms[f][i], ms[f][i] / least[i]);
        fprintf(out, " |\n");
    }
    measure_end(&document, out, 1);
    if (argc > 1) {
        char path[4096];
        snprintf(path, sizeof path, "%s/filters.md", argv[1]);
        measure_write(&document, path, "make compiled");
    }
    measure_document_free(&document);
    return 0;
}

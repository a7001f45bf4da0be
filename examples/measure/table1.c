/* SPDX-License-Identifier: MIT
   Table 1 of Kautz, Vazquez, Heidrich and Seidel 2000 measured again: a parabolic map of 128 x 256
   texels filtered into one of the same size, hierarchically (threshold 0.001) and by brute force,
   the plain loop over the whole square with pow.

   What you will see: the table, after some minutes; `table1 DOCS` also writes it to the end of
   DOCS/filters.md.
       cc -O3 -march=native -I. examples/measure/table1.c -o table1 -lm */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "table1.h"

static const char *const scene_name[2] = {"mild", "sun"};
static measure_document document;

static envmap create(void) { return measure_map(ENVMAP_PARABOLOID, TABLE1_SIZE, 1, 1); }

static envmap scene(int sun) {
    envmap map = create();
    table1_scene(&map, sun);
    return map;
}

static double brute(envmap *dst, const envmap *src, double n) {
    double seconds = table1_brute(dst, src, n, 1, measure_now);
    if (!(seconds > 0)) measure_must(ENVMAP_ERROR_MEMORY, "brute force");
    return seconds;
}

typedef struct counter {
    double n, calls;
} counter;

static double counted(double x, double p, void *user) {
    counter *c = (counter *)user;
    (void)p;
    c->calls += 1;
    return x > 0 ? pow(x, c->n) : 0;
}

static double hierarchical(envmap *dst, const envmap *src, envmap_lobe lobe, int runs) {
    envmap_filter_desc desc = {0};
    desc.method = ENVMAP_METHOD_HIERARCHICAL;
    double best = 1e9;
    for (int run = 0; run < runs; ++run) {
        double start = measure_now();
        measure_must(envmap_filter(dst, src, &lobe, &desc), "hierarchical");
        double seconds = measure_now() - start;
        if (seconds < best) best = seconds;
    }
    return best;
}

static void line(FILE *out, const envmap scenes[2], int i) {
    envmap truth[2] = {create(), create()}, dst = create();
    counter c = {table1_exponents[i], 0};
    double plain = brute(&truth[0], &scenes[0], table1_exponents[i]);
    double again = brute(&truth[1], &scenes[1], table1_exponents[i]);
    if (again < plain) plain = again;
    double with_pow = hierarchical(&dst, &scenes[0], envmap_lobe_function(counted, &c), 1);
    double fewer = (double)TABLE1_TEXELS * TABLE1_TEXELS / c.calls;
    for (int s = 0; s < 2; ++s) {
        envmap_difference d;
        double seconds =
            hierarchical(&dst, &scenes[s], envmap_lobe_phong((float)table1_exponents[i]), 5);
        measure_must(envmap_compare(&d, &dst, &truth[s], 0), "compare");
        fprintf(out, "| %d | %s | %.1f | **%.1f** | %.1f | %.1f | %.2f s | %.3f s |",
                table1_exponents[i], scene_name[s], table1_published[i], plain / seconds,
                plain / with_pow, fewer, plain, seconds);
        fprintf(out, " %.2e | %.2e | %+.1e |\n", d.rms, d.worst, d.bias);
    }
    envmap_free(&truth[0]);
    envmap_free(&truth[1]);
    envmap_free(&dst);
}

int main(int argc, char **argv) {
    envmap scenes[2] = {scene(0), scene(1)};
    char path[4096];
    FILE *out = measure_begin(&document, "table");
    fprintf(out,
            "Parabolic map 128 x 256, threshold 0.001, one thread, errors against brute force. "
            "`pow in both`: the\nsame function given as a callback, which has no support to skip; "
            "`evaluations`: how many times fewer\nlobe values that takes.\n\n");
    fprintf(out, "| N | scene | published | speed-up | pow in both | evaluations | brute force | "
                 "hierarchical | rms | worst | bias |\n|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:"
                 "|\n");
    for (int i = 0; i < 5; ++i) {
        fprintf(stderr, "table1: N = %d\n", table1_exponents[i]);
        line(out, scenes, i);
    }
    measure_end(&document, out, 1);
    snprintf(path, sizeof path, "%s/filters.md", argc > 1 ? argv[1] : "");
    if (argc > 1) measure_write(&document, path, "make table1");
    measure_document_free(&document);
    envmap_free(&scenes[0]);
    envmap_free(&scenes[1]);
    return 0;
}

/* SPDX-License-Identifier: MIT
   `envmap bake` of a 2048 x 1024 .hdr to a chain of 512² and 8 levels, irradiance, table and
   preview, beside 1024-sample importance sampling of the same chain alone, on one thread each.

   What you will see: processor time and memory of both and their ratio, after a minute; `baking
   ENVMAP DOCS` also writes them to DOCS/bake.md. The tool is started as a person starts it.
   Sampling is examples/methods/importance_sampling.h, each sample on the level that fits it.
       cc -O3 -march=native -I. examples/measure/baking.c -o baking -lm
       baking build/envmap */
#define _DEFAULT_SOURCE /* wait4 */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"
#include "../tool/scenes.h"
#include "../methods/importance_sampling.h"
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

enum { SIZE = 512, LEVELS = 8, SAMPLES = 1024 };

typedef struct spent {
    double seconds, megabytes; /* of the processor; resident at most */
} spent;

/* Runs a program in a folder, quietly, and waits for it. */
static spent run(const char *folder, char *const *argv) {
    struct rusage usage;
    spent s;
    int status;
    pid_t child = fork();
    if (child == 0) {
        if (chdir(folder) || !freopen("/dev/null", "w", stdout)) _exit(126);
        execv(argv[0], argv);
        _exit(127);
    }
    if (child < 0 || wait4(child, &status, 0, &usage) != child || status)
        measure_must(ENVMAP_ERROR_FILE, argv[0]);
    s.seconds = (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    s.megabytes = (double)usage.ru_maxrss / 1024;
    return s;
}

/* The best of three bakes of sky.pfm, as sky.hdr. */
static spent bake(const char *tool, const char *folder) {
    char program[4096];
    char *convert[] = {program, "convert", "sky.pfm", "sky.hdr", NULL};
    char *command[] = {program, "bake", "sky.hdr", "out", "--size", "512", "--levels", "8",
                       "--threads", "1", NULL};
    spent best = {1e9, 0};
    if (!realpath(tool, program)) measure_must(ENVMAP_ERROR_FILE, tool);
    run(folder, convert);
    for (int k = 0; k < 3; ++k) {
        spent s = run(folder, command);
        best.seconds = fmin(best.seconds, s.seconds);
        best.megabytes = fmax(best.megabytes, s.megabytes);
    }
    return best;
}

/* Levels 1 to 7 by samples of a source that has its levels; the mirror is for free. */
static double sample(const envmap *sky) {
    envmap src = measure_map(ENVMAP_CUBE, SIZE, 1, 1);
    method_desc desc = {0};
    measure_must(envmap_resample(&src, sky, NULL), "source");
    desc.samples = SAMPLES;
    double begun = measure_seconds();
    for (int l = 1; l < LEVELS; ++l) {
        double r = envmap_level_roughness(l, LEVELS, 0);
        envmap_lobe lobe = envmap_lobe_ggx((float)(r * r));
        envmap dst = measure_map(ENVMAP_CUBE, SIZE >> l, 1, 1);
        measure_must(method_importance_sampling(&dst, &src, &lobe, &desc), "sampling");
        envmap_free(&dst);
    }
    envmap_free(&src);
    return measure_seconds() - begun;
}

static void remove_folder(const char *folder) {
    char *argv[] = {"/bin/rm", "-rf", (char *)(size_t)folder, NULL};
    run("/", argv);
}

int main(int argc, char **argv) {
    static measure_document document;
    char folder[] = "/tmp/envmap-baking-XXXXXX", path[4096];
    envmap sky = measure_map(ENVMAP_LATLONG, 1024, 1, 1);
    if (argc < 2 || !mkdtemp(folder)) return 1;
    scene_fill(&sky, SCENE_SUN);
    snprintf(path, sizeof path, "%s/sky.pfm", folder);
    measure_must(envmap_pfm_save(&sky, path, 0), path);
    spent ours = bake(argv[1], folder);
    double sampled = sample(&sky);
    FILE *out = measure_begin(&document, "table");
    fprintf(out,
            "One thread, %s; 2048 x 1024 `.hdr`, cube of 512² and 8 levels. Time is the "
            "processor's.\n\n| what | s | MB |\n|---|--:|--:|\n"
            "| `envmap bake`: reading, chain, irradiance, table, files, preview | %.2f | %.0f |\n"
            "| 1024 samples a texel, each on the level that fits it: the chain alone | %.1f | |\n\n"
            "`bake` is %.0f times quicker.\n",
            MEASURE_COMPILER, ours.seconds, ours.megabytes, sampled, sampled / ours.seconds);
    measure_end(&document, out, 1);
    if (argc > 2) {
        snprintf(path, sizeof path, "%s/bake.md", argv[2]);
        measure_write(&document, path, "make baking");
    }
    measure_document_free(&document);
    envmap_free(&sky);
    remove_folder(folder);
    return ours.seconds > 2 || ours.megabytes > 300 || sampled < 20 * ours.seconds;
}

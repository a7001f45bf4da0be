/* SPDX-License-Identifier: MIT
   How long the tool takes to read, with the memory that it uses itself. */
#ifndef _DEFAULT_SOURCE
#define _DEFAULT_SOURCE
#endif
#include "examples/tool/memory.h"
#define ENVMAP_STATIC /* compiles what is called, no more */
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "examples/tool/read.h"
#include "examples/tool/layouts.h"
#include "test.h"
#include <time.h>

enum { W = 4096, H = 2048, RUN_LENGTH = 16 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* A .hdr whose samples come in runs of 16, about what photographs have in the mean. */
static unsigned char *large_radiance(size_t *bytes) {
    const char *head = "#?RADIANCE\n\n-Y 2048 +X 4096\n";
    unsigned char *file = (unsigned char *)malloc(64 + (size_t)H * (4 + 4 * 2 * W / RUN_LENGTH));
    unsigned long long seed = 1;
    if (!file) exit(1);
    size_t n = strlen(head);
    memcpy(file, head, n);
    for (int y = 0; y < H; ++y) {
        file[n++] = 2, file[n++] = 2, file[n++] = W >> 8, file[n++] = W & 255;
        for (int i = 0; i < 4 * W / RUN_LENGTH; ++i) {
            file[n++] = 128 + RUN_LENGTH;
            file[n++] = (unsigned char)(128 + 16 * test_random(&seed));
        }
    }
    *bytes = n;
    return file;
}

static void a_large_radiance_picture_reads_in_four_copies(void) {
    size_t bytes, floats = (size_t)3 * W * H;
    unsigned char *data = large_radiance(&bytes);
    float *from = (float *)malloc(floats * 4), *to = (float *)malloc(floats * 4);
    FILE *file = tmpfile();
    double copy = 1e9, read = 1e9;
    if (!from || !to || !file || fwrite(data, 1, bytes, file) != bytes) exit(1);
    memset(from, 1, floats * 4), memset(to, 1, floats * 4);
    for (int k = 0; k < 9; ++k) {
        image in;
        envmap map = {0};
        double t = now(), fetched;
        rewind(file);
        CHECK(fread(data, 1, bytes, file) == bytes);
        fetched = now() - t;
        memcpy(to, from, floats * 4);
        copy = fmin(copy, now() - t);
        t = now();
        CHECK(image_read(&in, data, bytes) && layout_map(&map, &in, -1, HORIZON_NONE));
        read = fmin(read, fetched + now() - t);
        envmap_free(&map);
    }
    CHECK(to[floats - 1] > 0);
    free(data), free(from), free(to), fclose(file);
    printf("    bytes and a copy of floats %.1f ms, reading %.1f ms\n", 1e3 * copy, 1e3 * read);
    FIGURE("4096 x 2048 .hdr: time over that of its bytes and a copy of its floats", read / copy,
           getenv("TEST_QUICK") ? 1000 : test_whole() ? 4 : 8);
}

int main(void) {
    RUN(a_large_radiance_picture_reads_in_four_copies);
    return test_summary();
}

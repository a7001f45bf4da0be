/* SPDX-License-Identifier: MIT
   What the tool reads: Radiance pictures that this test writes itself in every form, odd PFMs, what
   OpenImageIO makes of both, layouts, orientation; and the built tool's manners. */
#ifndef _XOPEN_SOURCE
#define _XOPEN_SOURCE 700
#endif
#include "oracle.h"
#include "examples/tool/read.h"
#include "examples/tool/layouts.h"
#include "examples/tool/orientation.h"
#include <fcntl.h>
#include <sys/resource.h>
#include <stdint.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* -------------------------------------------------------------------- files in the making ---- */

typedef struct {
    unsigned char *data;
    size_t bytes, room;
} blob;

static void put(blob *b, const void *data, size_t bytes) {
    if (b->bytes + bytes > b->room) {
        b->room = 2 * (b->bytes + bytes);
        b->data = (unsigned char *)realloc(b->data, b->room);
        if (!b->data) exit(1);
    }
    memcpy(b->data + b->bytes, data, bytes);
    b->bytes += bytes;
}

static void put_text(blob *b, const char *text) { put(b, text, strlen(text)); }

/* Reads from a block of exactly that size, so that one byte too many is seen by ASan. */
static int read_exactly(image *out, const unsigned char *data, size_t bytes) {
    unsigned char *copy = (unsigned char *)malloc(bytes + !bytes);
    if (!copy) exit(1);
    memcpy(copy, data, bytes);
    int ok = image_read(out, copy, bytes);
    free(copy);
    return ok;
}

static int read_text(image *out, const char *text) {
    return read_exactly(out, (const unsigned char *)text, strlen(text));
}

/* RGBE pixels that repeat now and then, so that run lengths have something to do. */
static void draw_rgbe(unsigned char *rgbe, int count, unsigned long long seed) {
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < 4; ++c) {
            double fresh = c < 3 ? 128 + 127 * test_random(&seed) : 120 + 20 * test_random(&seed);
            rgbe[4 * i + c] = i && test_random(&seed) < 0.7 ? rgbe[4 * i + c - 4]
                                                            : (unsigned char)fresh;
        }
}

/* A line with new run lengths: runs of three and more, else literals. */
static void put_new_line(blob *b, const unsigned char *rgbe, int n) {
    unsigned char head[4] = {2, 2, (unsigned char)(n >> 8), (unsigned char)n};
    put(b, head, 4);
    for (int c = 0; c < 4; ++c)
        for (int i = 0, run; i < n; i += run) {
            unsigned char code[129];
            for (run = 1; i + run < n && run < 127 && rgbe[4 * (i + run) + c] == rgbe[4 * i + c];)
                ++run;
            code[0] = (unsigned char)(128 + run), code[1] = rgbe[4 * i + c];
            if (run > 2) {
                put(b, code, 2);
                continue;
            }
            for (run = 0; i + run < n && run < 128; ++run) {
                const unsigned char *p = rgbe + 4 * (i + run) + c;
                if (i + run + 2 < n && p[0] == p[4] && p[0] == p[8]) break;
                code[1 + run] = *p;
            }
            code[0] = (unsigned char)run;
            put(b, code, (size_t)run + 1);
        }
}

/* A line with old run lengths: counts of more than 255 take several pixels. */
static void put_old_line(blob *b, const unsigned char *rgbe, int n) {
    for (int i = 0, run; i < n; i += run) {
        put(b, rgbe + 4 * i, 4);
        for (run = 1; i + run < n && !memcmp(rgbe + 4 * i, rgbe + 4 * (i + run), 4);) ++run;
        for (int left = run - 1; left > 0; left >>= 8) {
            unsigned char repeat[4] = {1, 1, 1, (unsigned char)left};
            put(b, repeat, 4);
        }
    }
}

enum { FLAT, OLD, NEW };

static blob radiance(const char *head, const unsigned char *rgbe, int lines, int n, int form) {
    blob b = {NULL, 0, 0};
    put_text(&b, head);
    for (int y = 0; y < lines; ++y, rgbe += 4 * n)
        if (form == FLAT) put(&b, rgbe, 4 * (size_t)n);
        else if (form == OLD) put_old_line(&b, rgbe, n);
        else put_new_line(&b, rgbe, n);
    return b;
}

/* Every sample is its mantissa times 2^(e - 136). */
static int is_rgbe(const float *rgb, const unsigned char *rgbe) {
    for (int c = 0; c < 3; ++c)
        if ((double)rgb[c] < ldexp(rgbe[c], rgbe[3] - 136) * (rgbe[3] > 0) ||
            (double)rgb[c] > ldexp(rgbe[c], rgbe[3] - 136) * (rgbe[3] > 0))
            return 0;
    return 1;
}

/* -------------------------------------------------------------------------------- Radiance ---- */

static void a_radiance_sample_is_its_mantissa_times_a_power_of_two(void) {
    static unsigned char rgbe[4 * 65536];
    for (int i = 0; i < 65536; ++i) {
        rgbe[4 * i] = (unsigned char)i, rgbe[4 * i + 1] = (unsigned char)(255 - i);
        rgbe[4 * i + 2] = 77, rgbe[4 * i + 3] = (unsigned char)(i >> 8);
    }
    blob b = radiance("#?RADIANCE\n\n-Y 65536 +X 1\n", rgbe, 65536, 1, FLAT);
    image in;
    CHECK(read_exactly(&in, b.data, b.bytes) && in.width == 1 && in.height == 65536);
    int wrong = 0;
    for (int i = 0; i < 65536 && in.rgb; ++i) wrong += !is_rgbe(in.rgb + 3 * i, rgbe + 4 * i);
    CHECK(wrong == 0);
    image_free(&in);
    free(b.data);
}

static void new_old_and_no_run_lengths_give_the_same_pixels(void) {
    static const int widths[] = {1, 7, 8, 9, 127, 128, 129, 300, 1023, 32767, 32768};
    for (size_t k = 0; k < sizeof widths / sizeof *widths; ++k)
        for (int form = FLAT; form <= NEW; ++form) {
            int n = widths[k];
            char head[99];
            unsigned char *rgbe = (unsigned char *)malloc(12 * (size_t)n);
            if (!rgbe) exit(1);
            if (form == NEW && (n < 8 || n > 32767)) {
                free(rgbe);
                continue;
            }
            draw_rgbe(rgbe, 3 * n, (unsigned long long)n);
            if (form == OLD) memset(rgbe, 130, 4 * (size_t)n); /* a run over the whole line */
            sprintf(head, "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X %d\n", n);
            blob b = radiance(head, rgbe, 3, n, form);
            image in;
            CHECK(read_exactly(&in, b.data, b.bytes) && in.width == n && in.height == 3);
            int wrong = 0;
            for (int i = 0; i < 3 * n && in.rgb; ++i)
                wrong += !is_rgbe(in.rgb + 3 * i, rgbe + 4 * i);
            CHECK(wrong == 0);
            image_free(&in);
            free(b.data), free(rgbe);
        }
    CHECK(oracle_live == 0);
}

/* -Y: from the top down; +X: from left to right; the axis named first is that of the lines. */
static void pixels_may_come_in_any_of_eight_orders(void) {
    enum { W = 5, H = 3 };
    unsigned char rgbe[4 * W * H];
    for (int k = 0; k < 8; ++k) {
        int by_rows = k & 1, up = k >> 1 & 1, left = k >> 2 & 1;
        char head[99], y[16], x[16];
        for (int i = 0; i < W * H; ++i) {
            int line = i / (by_rows ? W : H), at = i % (by_rows ? W : H);
            int row = by_rows ? line : at, column = by_rows ? at : line;
            unsigned char p[4] = {(unsigned char)(left ? W - 1 - column : column),
                                  (unsigned char)(up ? H - 1 - row : row), 9, 136};
            memcpy(rgbe + 4 * i, p, 4);
        }
        sprintf(y, "%cY %d", up ? '+' : '-', H), sprintf(x, "%cX %d", left ? '-' : '+', W);
        sprintf(head, "#?RADIANCE\n\n%s %s\n", by_rows ? y : x, by_rows ? x : y);
        blob b = radiance(head, rgbe, by_rows ? H : W, by_rows ? W : H, FLAT);
        image in;
        CHECK(read_exactly(&in, b.data, b.bytes) && in.width == W && in.height == H);
        for (int i = 0; i < W * H && in.rgb; ++i) {
            CHECK_CLOSE(in.rgb[3 * i], i % W, 0);
            CHECK_CLOSE(in.rgb[3 * i + 1], i / W, 0);
        }
        image_free(&in);
        free(b.data);
    }
}

static const unsigned char two_pixels[8] = {128, 64, 32, 137, 255, 1, 2, 130};

static image read_head(const char *lines) {
    char head[400];
    image in;
    sprintf(head, "#?RADIANCE\n%s\n-Y 1 +X 2\n", lines);
    blob b = radiance(head, two_pixels, 1, 2, FLAT);
    if (read_exactly(&in, b.data, b.bytes) != !*in.error) CHECK(0);
    free(b.data);
    return in;
}

static void exposure_lines_accumulate_and_divide(void) {
    static const struct {
        const char *lines;
        double r, g, b;
    } table[] = {{"EXPOSURE=2\n", 2, 2, 2},
                 {"EXPOSURE=2\nEXPOSURE=4\n", 8, 8, 8},
                 {"EXPOSURE =  2 \n  EXPOSURE\t=\t.5e1\n", 10, 10, 10},
                 {"EXPOSURE=2\r\nCOLORCORR= 1 2 4\r\n", 2, 4, 8},
                 {"SOFTWARE=EXPOSURE=3\n# EXPOSURE=3\nEXPOSURES=3\n", 1, 1, 1},
                 {" FORMAT = 32-bit_rle_rgbe\nGAMMA=1\nVIEW= -vtv -vp 0 0 0\n", 1, 1, 1}};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        image in = read_head(table[k].lines);
        if (!CHECK(in.rgb != NULL)) continue;
        CHECK_CLOSE(in.rgb[0], 256 / table[k].r, 1e-5);
        CHECK_CLOSE(in.rgb[1], 128 / table[k].g, 1e-5);
        CHECK_CLOSE(in.rgb[2], 64 / table[k].b, 1e-5);
        image_free(&in);
    }
}

static void radiance_headers_that_make_no_sense_are_refused_in_words(void) {
    static const char *const table[][2] = {{"FORMAT=32-bit_rle_xyze\n", "XYZ"},
                                           {"FORMAT=8-bit\n", "unknown FORMAT"},
                                           {"EXPOSURE=0\n", "EXPOSURE"},
                                           {"EXPOSURE=-1\n", "EXPOSURE"},
                                           {"EXPOSURE=nan\n", "EXPOSURE"},
                                           {"EXPOSURE=inf\n", "EXPOSURE"},
                                           {"EXPOSURE=\n", "EXPOSURE"},
                                           {"COLORCORR=1 2\n", "COLORCORR"}};
    static const char *const sizes[] = {"",           "-Y 1",         "-Y 1 +X",
                                        "-Y 1 +Y 2",  "Y 1 X 2",      "-Y -1 +X 2",
                                        "-Y 0 +X 2",  "-Y 1 +X 2 3",  "-Z 1 +X 2",
                                        "-Y 1 +X 2a", "-Y 9999999999999999999 +X 1"};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        image in = read_head(table[k][0]);
        CHECK(!in.rgb && strstr(in.error, table[k][1]));
    }
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; ++k) {
        char text[200];
        image in;
        sprintf(text, "#?RADIANCE\n\n%s\n12345678", sizes[k]);
        CHECK(!read_text(&in, text) && !in.rgb && strstr(in.error, "size"));
    }
}

static void every_truncated_prefix_of_a_picture_is_refused(void) {
    unsigned char rgbe[4 * 3 * 20];
    draw_rgbe(rgbe, 60, 5);
    memset(rgbe + 80, 140, 80); /* a line that is one run */
    for (int form = FLAT; form <= NEW; ++form) {
        blob b = radiance("#?RADIANCE\nEXPOSURE=1\n\n-Y 3 +X 20\n", rgbe, 3, 20, form);
        image in;
        for (size_t n = 0; n < b.bytes; ++n)
            CHECK(!read_exactly(&in, b.data, n) && !in.rgb && *in.error);
        CHECK(read_exactly(&in, b.data, b.bytes));
        image_free(&in);
        free(b.data);
    }
    CHECK(oracle_live == 0);
}

static void damaged_lines_are_refused(void) {
    static const struct {
        const char *bytes;
        size_t count;
    } table[] = {{"\2\2\0\x8\x89\1\x88\1\x88\1\x88\1", 12}, /* a run past the end of the line */
                 {"\2\2\0\x8\0\0\0\0\0\0\0\0", 12},         /* a literal of nothing */
                 {"\2\2\0\x7\x87\1\x87\1\x87\1\x87\1", 12}, /* another length */
                 {"\1\1\1\x8\x88\x88\x88\x88", 8},          /* a repeat of nothing */
                 {"\x88\x88\x88\x88\1\1\1\x8", 8},          /* one repeat too many */
                 {"\x88\x88\x88\x88\1\1\1\0\1\1\1\0\1\1\1\0\1\1\1\1", 20}};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        blob b = radiance("#?RADIANCE\n\n-Y 1 +X 8\n", NULL, 0, 0, FLAT);
        image in;
        put(&b, table[k].bytes, table[k].count);
        CHECK(!read_exactly(&in, b.data, b.bytes) && !in.rgb && strstr(in.error, "damaged"));
        free(b.data);
    }
}

static void absurd_sizes_are_refused_before_any_allocation(void) {
    static const char *const files[] = {
        "#?RADIANCE\n\n-Y 1000000 +X 1000000\n12345678", "#?RADIANCE\n\n-Y 100 +X 1000000\n1234",
        "#?RADIANCE\n\n+X 1000000 -Y 1000000\n12345678", "PF\n999999999 999999999\n-1\n12345678",
        "PF4\n40000 40000\n-1\n12345678", "Pf\n999999999 9\n-1\n1"};
    for (size_t k = 0; k < sizeof files / sizeof *files; ++k) {
        image in;
        oracle_largest = 0;
        CHECK(!read_text(&in, files[k]) && !in.rgb && *in.error);
        CHECK(oracle_largest < 65536);
    }
}

static void without_memory_nothing_leaks(void) {
    unsigned char rgbe[4 * 60];
    draw_rgbe(rgbe, 60, 5);
    blob b = radiance("#?RADIANCE\n\n-Y 3 +X 20\n", rgbe, 3, 20, NEW);
    for (int n = 0, done = 0; n < 20 && !done; ++n) {
        image in;
        envmap map = {0};
        oracle_calls = 0, oracle_fail_at = n;
        done = read_exactly(&in, b.data, b.bytes) &&
               layout_map(&map, &in, ENVMAP_LATLONG, HORIZON_MEAN);
        oracle_fail_at = -1;
        CHECK(done || (in.no_room && *in.error && !map.texels));
        CHECK(!done || n > 3);
        image_free(&in);
        envmap_free(&map);
        CHECK(oracle_live == 0);
    }
    free(b.data);
}

/* ------------------------------------------------------------------------------------- PFM ---- */

static void put_floats(blob *b, const float *values, int count) {
    for (int i = 0; i < count; ++i) {
        uint32_t bits;
        unsigned char bytes[4];
        memcpy(&bits, values + i, 4);
        for (int k = 0; k < 4; ++k) bytes[k] = (unsigned char)(bits >> 8 * k);
        put(b, bytes, 4);
    }
}

/* A picture of 2 x 2 pixels whose samples are 1, 2, 3, ... in the file's order. */
static blob small_pfm(const char *head, int channels) {
    blob b = {NULL, 0, 0};
    put_text(&b, head);
    for (int i = 0; i < 4 * channels; ++i) {
        float value = (float)(1 + i);
        put_floats(&b, &value, 1);
    }
    return b;
}

/* Where the file's pixel k has gone, and all of its truncated prefixes are refused. */
static void check_pfm(const char *head, int channels, int top_down, const char *remark) {
    blob b = small_pfm(head, channels);
    image in;
    for (size_t n = 0; n < b.bytes; ++n)
        if (read_exactly(&in, b.data, n)) {
            printf("    %zu of %zu bytes were enough\n", n, b.bytes);
            CHECK(0);
            image_free(&in);
        }
    if (!CHECK(read_exactly(&in, b.data, b.bytes))) printf("    %s: %s\n", head, in.error);
    for (int k = 0; k < 4 && in.rgb; ++k)
        for (int c = 0; c < 3; ++c) {
            int row = top_down ? k / 2 : 1 - k / 2;
            CHECK_CLOSE(in.rgb[3 * (2 * row + k % 2) + c],
                        1 + channels * k + (channels > 1 ? c : 0), 0);
        }
    CHECK(remark ? strstr(in.remarks, remark) != NULL : !*in.remarks);
    image_free(&in);
    free(b.data);
}

static void pfm_headers_are_read_as_programs_write_them(void) {
    check_pfm("PF\n2 2\n-1\n", 3, 0, NULL);
    check_pfm("Pf 2 2 -1\n", 1, 0, NULL);
    check_pfm("PF4\n2 2\n-1.0\n", 4, 0, "alpha");
    check_pfm("PF\n2\n2\n-1.0\n", 3, 1, "Photoshop");
    check_pfm("PF4\n2\n2\n-1.0\n", 4, 1, "alpha");
    check_pfm("PF\r2 2\r-1.0\r", 3, 0, NULL);
    check_pfm("PF\r\n2 2\r\n-1.0\r\n", 3, 0, NULL);
    check_pfm("PF 2 2 -1.0\r\n", 3, 0, NULL);
    check_pfm("PF\n2 2\n-1.0 ", 3, 0, NULL);
}

/* These are told by the size of the file alone, so a prefix may be taken for a shorter header. */
static void blanks_and_comments_may_follow_the_scale(void) {
    static const char *const heads[] = {"PF\n2 2\n-1.0 \n", "PF\n2 2\n-1.0\t \n",
                                        "PF\n2 2\n-1.0 # made by hand\n",
                                        "PF\n2 2\n-1.0\n# made by hand\n# twice\n",
                                        "PF # a\n# b\n2 2\n-1.0 \r\n"};
    for (size_t k = 0; k < sizeof heads / sizeof *heads; ++k) {
        blob b = small_pfm(heads[k], 3);
        image in;
        CHECK(read_exactly(&in, b.data, b.bytes));
        if (in.rgb) CHECK_CLOSE(in.rgb[6], 1, 0);
        image_free(&in);
        put_text(&b, "\n"); /* at the end of the file: no harm */
        CHECK(read_exactly(&in, b.data, b.bytes));
        image_free(&in);
        put_text(&b, "more");
        CHECK(!read_exactly(&in, b.data, b.bytes) && strstr(in.error, "after its last"));
        free(b.data);
    }
}

/* 0x0A is a line feed, and the lowest byte of some floats. */
static void a_first_sample_that_begins_like_a_line_end_stays_a_sample(void) {
    static const char *const heads[] = {"PF\r2 1\r-1.0\r", "PF\r\n2 1\r\n-1.0\r\n",
                                        "PF\n2 1\n-1.0\n"};
    for (size_t k = 0; k < 3; ++k) {
        uint32_t bits = 0x3F80000A;
        float samples[6] = {0, 1, 2, 3, 4, 5};
        blob b = {NULL, 0, 0};
        image in;
        memcpy(samples, &bits, 4);
        put_text(&b, heads[k]), put_floats(&b, samples, 6);
        CHECK(read_exactly(&in, b.data, b.bytes) && !memcmp(in.rgb, samples, sizeof samples));
        image_free(&in);
        free(b.data);
    }
}

static void what_the_header_reads_the_tool_reads_as_the_same_bits(void) {
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        envmap map = {0}, back = {0};
        image in;
        size_t bytes = 0;
        CHECK(envmap_create(&map, m, 6, 1, 1) == ENVMAP_OK);
        oracle_noise(&map, 3);
        CHECK(envmap_pfm_write(NULL, 0, &bytes, &map, 0) == ENVMAP_OK);
        unsigned char *file = (unsigned char *)malloc(bytes);
        CHECK(file && envmap_pfm_write(file, bytes, NULL, &map, 0) == ENVMAP_OK);
        CHECK(read_exactly(&in, file, bytes) && layout_map(&back, &in, m, HORIZON_NONE));
        CHECK(back.mapping == m && back.size == 6 && back.slices == 1 && back.levels == 1);
        CHECK(back.texels && !memcmp(back.texels, map.texels,
                                     oracle_floats(m, 6, 1, 0) * sizeof(float)));
        envmap_free(&map), envmap_free(&back);
        free(file);
    }
    CHECK(oracle_live == 0);
}

/* --------------------------------------------------------------------------------- layouts ---- */

/* A picture whose pixels hold their own column and row. */
static image numbered(int width, int height) {
    image p;
    memset(&p, 0, sizeof p);
    p.width = width, p.height = height;
    if (!image_create(&p)) exit(1);
    for (int i = 0; i < width * height; ++i) {
        p.rgb[3 * i] = (float)(i % width), p.rgb[3 * i + 1] = (float)(i / width);
        p.rgb[3 * i + 2] = 1;
    }
    return p;
}

/* Neighbours in a cross are neighbours on the sphere, over the edges of its faces too, and +Z is in
   the middle, +X to its right, +Y above. */
static void check_cross(int columns, int rows) {
    enum { N = 8 };
    float where[4 * N][4 * N][3];
    int width = columns * N, height = rows * N, used = 0, torn = 0, pairs = 0;
    image in = numbered(width, height);
    envmap map = {0};
    memset(where, 0, sizeof where);
    CHECK(layout_map(&map, &in, -1, HORIZON_NONE) && map.mapping == ENVMAP_CUBE && map.size == N);
    for (int i = 0; i < 6 * N * N && map.texels; ++i) {
        int x = (int)map.texels[3 * i], y = (int)map.texels[3 * i + 1];
        envmap_direction(where[y][x], ENVMAP_CUBE, i / (N * N), ((float)(i % N) + 0.5f) / N,
                         ((float)(i / N % N) + 0.5f) / N);
        ++used;
    }
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = 0; k < 2; ++k) {
                if (y + k == height || x + !k == width) continue;
                const float *a = where[y][x], *b = where[y + k][x + !k];
                if (fabsf(a[0]) + fabsf(a[1]) + fabsf(a[2]) < 0.5f ||
                    fabsf(b[0]) + fabsf(b[1]) + fabsf(b[2]) < 0.5f)
                    continue;
                ++pairs;
                torn += oracle_angle_f(a, b) > 2.3 / N;
            }
    CHECK(used == 6 * N * N && torn == 0 && pairs == 2 * 6 * N * (N - 1) + 5 * N);
    CHECK(where[N + N / 2][N + N / 2][2] > 0.9f && where[N / 2][N + N / 2][1] > 0.9f);
    CHECK(where[N + N / 2][2 * N + N / 2][0] > 0.9f);
    envmap_free(&map);
}

static void crosses_are_cubes_unfolded(void) {
    check_cross(3, 4);
    check_cross(4, 3);
}

static void strips_hold_faces_in_order_both_ways(void) {
    static const struct {
        int mapping, width, height, columns;
    } table[] = {{-1, 6, 36, 1},  {-1, 36, 6, 6}, {ENVMAP_CUBE, 6, 72, 1},
                 {-1, 6, 12, 1}, {ENVMAP_PARABOLOID, 12, 6, 2}};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        image in = numbered(table[k].width, table[k].height);
        envmap map = {0};
        CHECK(layout_map(&map, &in, table[k].mapping, HORIZON_NONE) && map.size == 6);
        int faces = envmap_faces(map.mapping);
        for (int i = 0; i < 36 * faces * map.slices && map.texels; ++i) {
            int face = i / 36, x = i % 6, y = i / 6 % 6;
            if (table[k].columns > 1) x += 6 * face;
            else y += 6 * face;
            CHECK_CLOSE(map.texels[3 * i], x, 0);
            CHECK_CLOSE(map.texels[3 * i + 1], y, 0);
        }
        CHECK(map.slices == (table[k].height == 72 ? 2 : 1));
        envmap_free(&map), image_free(&in);
    }
    CHECK(oracle_live == 0);
}

static void lat_longs_of_other_shapes_are_stretched_and_it_is_said(void) {
    static const int shapes[][3] = {{1917, 938, -1}, {100, 50, -1}, {300, 100, ENVMAP_LATLONG},
                                    {64, 64, ENVMAP_LATLONG}, {7, 100, ENVMAP_LATLONG}};
    for (size_t k = 0; k < sizeof shapes / sizeof *shapes; ++k) {
        int w = shapes[k][0], h = shapes[k][1], exact = w == 2 * h;
        image in = numbered(w, h);
        envmap map = {0};
        CHECK(layout_map(&map, &in, shapes[k][2], HORIZON_NONE) && map.mapping == ENVMAP_LATLONG);
        CHECK(2 * map.size >= w && map.size >= h);
        CHECK(exact ? !*in.remarks : strstr(in.remarks, "stretched") != NULL);
        double sum[3] = {0, 0, 0};
        int texels = 2 * map.size * map.size;
        for (int i = 0; i < 3 * texels && map.texels; ++i) sum[i % 3] += (double)map.texels[i];
        CHECK_CLOSE(sum[0] / texels, (w - 1) / 2.0, 1e-3 * w); /* means stay, along both axes */
        CHECK_CLOSE(sum[1] / texels, (h - 1) / 2.0, 1e-3 * h);
        CHECK_CLOSE(sum[2] / texels, 1, 1e-6);
        if (map.texels) CHECK(map.texels[3 * texels - 3] > map.texels[3 * texels - 6 * map.size]);
        envmap_free(&map);
    }
}

static void a_sky_that_ends_at_the_horizon_gets_a_ground(void) {
    for (int horizon = HORIZON_BLACK; horizon <= HORIZON_MEAN; ++horizon) {
        image in = numbered(32, 8);
        envmap map = {0};
        CHECK(layout_map(&map, &in, -1, horizon) && map.mapping == ENVMAP_LATLONG);
        CHECK(map.size == 16);
        if (!map.texels) continue;
        CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 5, 7)[0], 5, 0);
        CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 5, 8)[0], horizon == HORIZON_MEAN ? 15.5 : 0, 1e-5);
        CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 5, 15)[1], horizon == HORIZON_MEAN ? 7 : 0, 1e-5);
        envmap_free(&map);
    }
    image in = numbered(32, 8);
    envmap map = {0};
    CHECK(!layout_map(&map, &in, ENVMAP_CUBE, HORIZON_MEAN) && !map.texels && in.rgb);
    image_free(&in);
}

static void shapes_that_fit_nothing_say_what_would(void) {
    static const struct {
        int width, height, mapping;
        const char *says;
    } table[] = {{64, 64, -1, "--mapping sphere|angular"}, {640, 480, ENVMAP_SPHERE, "1:1"},
                 {500, 300, -1, "--mapping latlong"},      {400, 100, -1, "--horizon"},
                 {8, 24, -1, "3 squares"},                 {100, 50, ENVMAP_CUBE, "3:4"},
                 {7, 13, ENVMAP_PARABOLOID, "1:2"}};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        image in = numbered(table[k].width, table[k].height);
        envmap map = {0};
        char found[40];
        sprintf(found, "%d x %d", table[k].width, table[k].height);
        CHECK(!layout_map(&map, &in, table[k].mapping, HORIZON_NONE) && !map.texels);
        CHECK(strstr(in.error, found) && strstr(in.error, table[k].says));
        image_free(&in);
    }
    image in = numbered(1, 4096 * 6 + 6); /* more slices than maps have */
    envmap map = {0};
    CHECK(!layout_map(&map, &in, ENVMAP_CUBE, HORIZON_NONE) && in.no_room && !map.texels);
    image_free(&in);
    CHECK(oracle_live == 0);
}

/* ----------------------------------------------------------------------------- orientation ---- */

static void turn(envmap *map, int convention, double yaw, double pitch, double roll) {
    double m[9], angles[3];
    angles[0] = yaw, angles[1] = pitch, angles[2] = roll;
    orientation_matrix(m, convention, angles);
    CHECK(orientation_turn_map(map, m) == ENVMAP_OK);
}

static envmap noise_map(int mapping, int size) {
    envmap map = {0};
    if (envmap_create(&map, mapping, size, 1, 1)) exit(1);
    oracle_noise(&map, 11);
    return map;
}

static void a_turn_by_180_degrees_shifts_a_lat_long_by_half(void) {
    static const int sizes[] = {1, 7, 64, 1024};
    for (int k = 0; k < 4; ++k) {
        int n = sizes[k], wrong = 0;
        envmap map = noise_map(ENVMAP_LATLONG, n), before = noise_map(ENVMAP_LATLONG, n);
        turn(&map, 1, 0, 0, 0); /* OpenEXR's */
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < 2 * n; ++x)
                wrong += memcmp(envmap_texel(&map, 0, 0, 0, x, y),
                                envmap_texel(&before, 0, 0, 0, (x + n) % (2 * n), y), 12) != 0;
        CHECK(wrong == 0);
        envmap_free(&map), envmap_free(&before);
    }
}

static void right_angles_keep_a_cubes_numbers(void) {
    envmap map = noise_map(ENVMAP_CUBE, 33), before = noise_map(ENVMAP_CUBE, 33);
    size_t bytes = oracle_floats(ENVMAP_CUBE, 33, 1, 0) * sizeof(float);
    turn(&map, 0, 90, 0, 0), turn(&map, 0, 0, 90, 0), turn(&map, 0, 0, 0, 90);
    CHECK(memcmp(map.texels, before.texels, bytes));
    turn(&map, 0, 0, 0, -90), turn(&map, 0, 0, -90, 0), turn(&map, 0, -90, 0, 0);
    CHECK(!memcmp(map.texels, before.texels, bytes));
    turn(&map, 3, 0, 0, 0); /* a mirror */
    CHECK(memcmp(map.texels, before.texels, bytes));
    turn(&map, 3, 0, 0, 0);
    CHECK(!memcmp(map.texels, before.texels, bytes));
    envmap_free(&map), envmap_free(&before);
}

static void angles_and_conventions_bring_directions_where_docs_say(void) {
    static const struct {
        int convention;
        double angles[3];
        int from, to; /* axes: 1 x, 2 y, 3 z, negative: the other way */
    } table[] = {{0, {90, 0, 0}, -3, -1}, {0, {90, 0, 0}, 1, -3},  {0, {0, 90, 0}, -3, 2},
                 {0, {0, 0, 90}, 1, 2},   {0, {90, 90, 0}, -3, 2}, {1, {0, 0, 0}, -3, 3},
                 {1, {0, 0, 0}, -1, 1},   {2, {0, 0, 0}, -3, 1},   {2, {0, 0, 0}, 1, 3},
                 {3, {0, 0, 0}, 3, -3},   {3, {0, 0, 0}, 1, 1},    {3, {0, 0, 0}, 2, 2}};
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        envmap map = {0};
        float dir[3] = {0, 0, 0}, rgb[3];
        if (envmap_create(&map, ENVMAP_CUBE, 3, 1, 1)) exit(1);
        int from = table[k].from, to = table[k].to;
        envmap_texel(&map, 0, 0, 2 * (abs(from) - 1) + (from < 0), 1, 1)[0] = 5;
        turn(&map, table[k].convention, table[k].angles[0], table[k].angles[1],
             table[k].angles[2]);
        dir[abs(to) - 1] = to < 0 ? -1 : 1;
        envmap_lookup(rgb, &map, dir, 0);
        CHECK_CLOSE(rgb[0], 5, 1e-6);
        envmap_free(&map);
    }
}

/* Lookups keep smooth light to the square of a texel. */
static void any_angle_turns_what_is_seen(void) {
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        envmap map = {0};
        unsigned long long seed = 2;
        double worst = 0, matrix[9], angles[3] = {30, -50, 110};
        if (envmap_create(&map, m, 64, 1, 1)) exit(1);
        oracle_fill(&map, 0, oracle_smooth);
        orientation_matrix(matrix, 0, angles);
        CHECK(orientation_turn_map(&map, matrix) == ENVMAP_OK);
        for (int k = 0; k < 500; ++k) {
            double d[3], e[3] = {0, 0, 0};
            float to[3], rgb[3];
            oracle_random_direction(d, &seed);
            for (int i = 0; i < 9; ++i) e[i / 3] += matrix[i] * d[i % 3];
            if (d[2] < -0.9 || d[2] > 0.9 || e[2] < -0.9 || e[2] > 0.9) continue; /* rims */
            for (int i = 0; i < 3; ++i) to[i] = (float)e[i];
            envmap_lookup(rgb, &map, to, 0);
            for (int c = 0; c < 3; ++c)
                worst = fmax(worst, fabs((double)rgb[c] - oracle_smooth(d, c)));
        }
        FIGURE(oracle_name[m], worst, 0.05);
        envmap_free(&map);
    }
    CHECK(oracle_live == 0);
}

/* ------------------------------------------------------------------------------- the tool ---- */

static char folder[2048]; /* of this program; the tool is one above */
static char said[8192];   /* what the tool printed, standard output first */

static const char *file_at(const char *name) {
    static char paths[4][4096];
    static int next;
    next = (next + 1) % 4;
    snprintf(paths[next], sizeof paths[next], "%s/tool-read-%s", folder, name);
    return paths[next];
}

static size_t read_back(const char *path, char *out, size_t room) {
    FILE *file = fopen(path, "rb");
    size_t n = file ? fread(out, 1, room - 1, file) : 0;
    if (file) fclose(file);
    out[n] = 0;
    return n;
}

static void redirect(int number, const char *path, int flags) {
    int file = path ? open(path, flags, 0666) : -1;
    close(number);
    if (path && (file < 0 || dup2(file, number) != number)) _exit(99);
}

/* Runs a program with arguments up to NULL; in: standard input's file, or NULL for none; out:
   standard output's, NULL: closed. Returns its exit status, 127 where there is no such program. */
static int start(const char *program, const char *const *arguments, const char *in,
                 const char *out) {
    char *argv[24];
    int status = 0, k = 0;
    fflush(stdout);
    argv[k++] = strdup(program);
    for (; *arguments; ++arguments) argv[k++] = strdup(*arguments);
    argv[k] = NULL;
    pid_t child = fork();
    if (child == 0) {
        redirect(0, in ? in : "/dev/null", O_RDONLY);
        redirect(2, file_at("err"), O_WRONLY | O_CREAT | O_TRUNC);
        redirect(1, out, O_WRONLY | O_CREAT | O_TRUNC);
        execvp(program, argv);
        _exit(127);
    }
    while (k > 0) free(argv[--k]);
    if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
    return WEXITSTATUS(status);
}

/* Runs the tool with words of a line; `said` is what it printed. */
static int tool_from(const char *in, const char *out, const char *line) {
    char words[2048], path[4096];
    const char *arguments[20];
    int count = 0;
    snprintf(words, sizeof words, "%s", line);
    for (char *word = strtok(words, " "); word && count < 19; word = strtok(NULL, " "))
        arguments[count++] = strchr("@", *word) ? strdup(file_at(word + 1)) : strdup(word);
    arguments[count] = NULL;
    snprintf(path, sizeof path, "%s/../envmap", folder);
    int status = start(path, arguments, in, out);
    while (count > 0) free((void *)(uintptr_t)arguments[--count]);
    size_t n = out && !strncmp(out, folder, strlen(folder)) ? read_back(out, said, sizeof said) : 0;
    read_back(file_at("err"), said + n, sizeof said - n);
    return status;
}

static int tool(const char *line) { return tool_from(NULL, file_at("out"), line); }

static int check_tool(const char *line, int status, const char *says) {
    int got = tool(line), ok = CHECK(got == status) & CHECK(!says || strstr(said, says));
    if (!ok) printf("    envmap %s: status %d: %s\n", line, got, said);
    return ok;
}

static void write_file(const char *name, const void *data, size_t bytes) {
    FILE *file = fopen(file_at(name), "wb");
    if (!file || fwrite(data, 1, bytes, file) != bytes || fclose(file)) exit(1);
}

static void write_blob(const char *name, blob b) {
    write_file(name, b.data, b.bytes);
    free(b.data);
}

/* A lat-long of ones with a few bad samples. */
static void write_bad(const char *name, float bad) {
    blob b = {NULL, 0, 0};
    float values[3 * 8 * 4];
    for (int i = 0; i < 96; ++i) values[i] = 1 + (float)(i % 5);
    values[10] = bad, values[40] = bad;
    put_text(&b, "PF\n8 4\n-1.0\n"), put_floats(&b, values, 96);
    write_blob(name, b);
}

static void the_tool_reads_every_format_and_standard_input(void) {
    unsigned char rgbe[4 * 16 * 8];
    draw_rgbe(rgbe, 128, 4);
    write_blob("a.HDR", radiance("#?RADIANCE\n\n-Y 8 +X 16\n", rgbe, 8, 16, NEW));
    check_tool("info @a.HDR", 0, "Radiance RGBE, 16 x 8");
    check_tool("convert @a.HDR @a.pfm", 0, NULL);
    check_tool("compare @a.HDR @a.pfm", 0, "rms    0 ");
    CHECK(tool_from(file_at("a.HDR"), file_at("out"), "info -") == 0 && strstr(said, "16 x 8"));
    check_tool("info -- @a.HDR", 0, "latlong");
    check_tool("plan @a.HDR --lobe phong --size=4", 0, "size");
}

static void six_files_are_a_cube(void) {
    static const char *const names[] = {"six-posx.pfm", "six-negx.pfm", "six-posy.pfm",
                                        "six-negy.pfm", "six-posz.pfm", "six-negz.pfm"};
    for (int k = 0; k < 6; ++k) {
        blob b = {NULL, 0, 0};
        float values[12];
        for (int i = 0; i < 12; ++i) values[i] = (float)(k + 1);
        put_text(&b, "PF\n2 2\n-1.0\n"), put_floats(&b, values, 12);
        write_blob(names[k], b);
    }
    envmap map = {0};
    check_tool("convert @six-%.pfm @six.pfm", 0, NULL);
    CHECK(envmap_pfm_load(&map, file_at("six.pfm"), ENVMAP_CUBE) == ENVMAP_OK);
    for (int k = 0; k < 6 && map.texels; ++k)
        CHECK_CLOSE(envmap_texel(&map, 0, 0, k, 1, 1)[0], k + 1, 0);
    envmap_free(&map);
    remove(file_at("six-negy.pfm"));
    check_tool("info @six-%.pfm", 2, "six-negy.pfm: does not exist");
    check_tool("info @none-%.pfm", 2, "six files");
}

/* Six files, and the containers that hold them all, as a name's ending and a % ask. */
static void files_are_written_by_their_ending(void) {
    static const char *const magic[] = {"PF", "\x89PNG", "#?RADIANCE", "\253KTX 20", "\253KTX 11",
                                        "DDS "};
    static const char *const ends[] = {"pfm", "PNG", "hdr", "ktx2", "KTX", "dds"};
    char line[256], head[16];
    for (int k = 0; k < 6; ++k) {
        snprintf(line, sizeof line, "generate labels @kind.%s --to cube --size 8", ends[k]);
        check_tool(line, 0, NULL);
        snprintf(line, sizeof line, "kind.%s", ends[k]);
        CHECK(read_back(file_at(line), head, sizeof head) == 15);
        CHECK(!strncmp(head, magic[k], strlen(magic[k])));
    }
    check_tool("convert @kind.pfm @faces-%.pfm", 0, NULL);
    check_tool("compare @faces-%.pfm @kind.pfm", 0, "rms    0 ");
    check_tool("mips @kind.pfm @levels.ktx2 --format rgb9e5", 0, NULL);
    CHECK(read_back(file_at("levels.ktx2"), head, sizeof head) == 15 && head[12] == 123);
    write_bad("bad.pfm", 1e6f);
    check_tool("convert @bad.pfm @half.dds", 0, "2 numbers are too large for RGBA16F");
    check_tool("convert @kind.pfm @faces-%.dds", 1, "all six faces");
    check_tool("convert @bad.pfm @faces-%.pfm", 1, "--to cube");
    check_tool("convert @kind.pfm @out.pfm --format rgb9e5", 1, "nothing here");
    check_tool("mips @kind.pfm @out- --format rgb9e5", 1, "nothing here");
    check_tool("convert @kind.pfm @out.hdr --exposure 1", 1, "nothing here");
    check_tool("convert @kind.pfm @out.dds --to paraboloid --size 8", 1, "one picture");
    check_tool("convert @kind.pfm @out.jpg", 1, "end it in");
}

/* Every file of an octahedral map can have a border; what has none is told so. */
static void octahedral_maps_get_a_border_where_asked(void) {
    static const char *const commands[] = {"generate labels @b.pfm", "convert @kind.pfm @b.pfm",
                                           "filter @kind.pfm @b.pfm --lobe phong"};
    char line[256];
    check_tool("generate labels @kind.pfm --to cube --size 8", 0, NULL);
    for (int k = 0; k < 3; ++k) {
        envmap map = {0};
        snprintf(line, sizeof line, "%s --to octahedral --size 12 --border 2", commands[k]);
        check_tool(line, 0, NULL);
        CHECK(!envmap_pfm_load(&map, file_at("b.pfm"), ENVMAP_OCTAHEDRAL) && map.size == 16);
        for (int i = 0; i < 12 && map.texels; ++i) /* the first row inside, turned, and outside */
            CHECK(!memcmp(envmap_texel(&map, 0, 0, 0, 2 + i, 2),
                          envmap_texel(&map, 0, 0, 0, 13 - i, 1), 12));
        envmap_free(&map);
    }
    check_tool("mips @kind.pfm @border- --to octahedral --size 8 --border 2", 0, "border-1.pfm");
    CHECK(!strstr(said, "border-2.pfm"));
    check_tool("convert @kind.pfm @b.pfm --border 2", 1, "--to octahedral");
    check_tool("convert @kind.pfm @b.pfm --to octahedral --size 4 --border 5", 3, "wider than");
    check_tool("convert @kind.pfm @b.pfm --to octahedral --size 16384 --border 1", 3, "smaller");
}

/* A link to a device is written through and stays; a name that cannot be written leaves nothing. */
static void links_to_devices_stay_and_failures_leave_nothing(void) {
    static const char *const commands[] = {"convert @sky.pfm @link.%s --to cube --size 64",
                                           "filter @sky.pfm @link.%s --lobe phong --size 64",
                                           "generate sun @link.%s --size 64"};
    struct stat about;
    char line[256];
    write_bad("sky.pfm", 2);
    for (int k = 0; k < 9 && access("/dev/full", W_OK) == 0; ++k) {
        const char *end = k % 3 == 0 ? "pfm" : k % 3 == 1 ? "png" : "hdr";
        snprintf(line, sizeof line, "link.%s", end);
        remove(file_at(line));
        CHECK(symlink("/dev/full", file_at(line)) == 0);
        snprintf(line, sizeof line, commands[k / 3], end);
        check_tool(line, 2, "no space left");
        snprintf(line, sizeof line, "link.%s", end);
        CHECK(lstat(file_at(line), &about) == 0 && S_ISLNK(about.st_mode));
        remove(file_at(line));
    }
    snprintf(line, sizeof line, "%s", file_at("level-0.pfm"));
    CHECK(symlink("/dev/full", line) == 0);
    check_tool("mips @sky.pfm @level- --to cube --size 64", 2, "no space left");
    CHECK(lstat(line, &about) == 0 && S_ISLNK(about.st_mode));
    remove(line);
}

/* The corners of each face, which no letter reaches, have the colour of its axis. */
static void the_labelled_sky_has_a_colour_for_each_axis(void) {
    static const int brightest[6] = {0, 1, 1, 0, 2, 0};
    envmap map = {0};
    check_tool("generate labels @labels.pfm --to cube --size 32", 0, NULL);
    CHECK(envmap_pfm_load(&map, file_at("labels.pfm"), ENVMAP_CUBE) == ENVMAP_OK);
    for (int face = 0; face < 6 && map.texels; ++face) {
        const float *texel = envmap_texel(&map, 0, 0, face, 4, 4);
        for (int c = 0; c < 3; ++c) CHECK(texel[c] <= texel[brightest[face]] && texel[c] > 0);
    }
    envmap_free(&map);
}

static void bad_samples_are_cleaned_by_all_commands_and_it_is_said(void) {
    static const char *const commands[] = {
        "convert @bad.pfm @out.pfm", "mips @bad.pfm @out-", "plan @bad.pfm --lobe phong",
        "filter @bad.pfm @out.pfm --lobe phong --size 4", "sh @bad.pfm",
        "compare @bad.pfm @bad.pfm"};
    static const char *const says[] = {"2 NaN and 0 negative", "0 NaN and 2 negative",
                                       "2 infinite ones 5"};
    for (int kind = 0; kind < 3; ++kind) {
        write_bad("bad.pfm", kind == 0 ? NAN : kind == 1 ? -3 : INFINITY);
        for (size_t k = 0; k < sizeof commands / sizeof *commands; ++k)
            check_tool(commands[k], 0, says[kind]);
        check_tool("info @bad.pfm", 0, kind == 0 ? "2 NaN, 0 infinite" : "0 NaN");
    }
    write_bad("bad.pfm", 1000);
    check_tool("convert @bad.pfm @out.pfm --limit 10", 0, "2 samples above 10");
    CHECK(strstr(said, "% of the energy"));
    check_tool("info @out.pfm", 0, "max");
}

static void info_remarks_on_what_programs_do_to_files(void) {
    blob b = small_pfm("PF\n2 1\n-2.5\n", 3);
    b.bytes -= 24; /* two pixels, not four */
    write_blob("scale.pfm", b);
    check_tool("info @scale.pfm", 0, "its scale is -2.5");
    write_bad("one.pfm", 0);
    blob one = {NULL, 0, 0};
    float values[6] = {0, 1, 0.5f, 0.25f, 0, 0};
    put_text(&one, "PF\n2 1\n1\n");
    put_floats(&one, values, 6);
    for (int i = 0; i < 6; ++i) { /* big-endian */
        unsigned char *p = one.data + one.bytes - 24 + 4 * i, q[4] = {p[3], p[2], p[1], p[0]};
        memcpy(p, q, 4);
    }
    write_blob("one.pfm", one);
    check_tool("info @one.pfm", 0, "exactly 1");
}

static void wrong_use_is_said_in_words(void) {
    write_bad("sky.pfm", 2);
    check_tool("-h", 0, "usage");
    check_tool("--help", 0, "usage");
    check_tool("filter -h", 0, "--exponent");
    check_tool("--version", 0, "envmap ");
    check_tool("info @sky.pfm --size=4", 1, "no such option");
    check_tool("convert @sky.pfm @out.pfm --size=4 --to=cube", 0, NULL);
    check_tool("convert @sky.pfm @out.pfm --size", 1, "needs a value");
    check_tool("convert @sky.pfm @out.pfm --flip=1", 1, "takes no value");
    check_tool("convert @sky.pfm @OUT.PFM", 0, NULL);
    check_tool("convert @sky.pfm @OUT.PNG", 0, NULL);
    check_tool("convert @sky.pfm @out.pfm -x", 1, "no such option");
    check_tool("convert -- @sky.pfm @out.pfm --size", 1, "one argument too many");
    check_tool("convert @sky.pfm @out.pfm --rotate 1,2", 1, "angle");
    check_tool("convert @sky.pfm @out.pfm --rotate 90x", 1, "angle");
    check_tool("convert @sky.pfm @out.pfm --rotate nan", 1, "angle");
    check_tool("convert @sky.pfm @out.pfm --rotate 1,2,99999", 1, "angle");
    check_tool("convert @sky.pfm @out.pfm --size 0", 3, "from 1 to 16384");
    check_tool("convert @sky.pfm @out.pfm --size 4.5", 1, "whole number");
    check_tool("convert @sky.pfm @out.pfm --limit inf", 1, "is not a number");
    check_tool("bake @sky.pfm @out --lobe banks", 1, "phong or charlie");
    check_tool("info", 1, "too few arguments");
    check_tool("nothing", 1, "no such command");
    check_tool("convert @sky.pfm @out.pfm --rotate=90,0,-1e1", 0, NULL);
    check_tool("convert @sky.pfm @out.pfm --from-convention nobody", 1, "openexr");
    check_tool("filter @sky.pfm @out.pfm --lobe phong --alpha 0.5", 1, "--lobe ggx");
    check_tool("filter @sky.pfm @out.pfm --exponent 50", 1, "--lobe phong");
    check_tool("filter @sky.pfm @out.pfm --lobe phong --scale 2", 1, "--raw");
    check_tool("filter @sky.pfm @out.pfm --lobe phong --threshold 1", 1, "hierarchical");
    check_tool("filter @sky.pfm @out.pfm --lobe banks --to latlong --size 4", 1, "one slice");
}

/* Files may grow to 4096 bytes only; the message is one of its own, and no temporary is left. */
static void a_file_that_may_not_grow_leaves_nothing(void) {
    struct rlimit before, small;
    char line[4200];
    write_bad("sky.pfm", 2);
    snprintf(line, sizeof line, "%s/full", folder);
    mkdir(line, 0777);
    getrlimit(RLIMIT_FSIZE, &before);
    small = before, small.rlim_cur = 4096;
    setrlimit(RLIMIT_FSIZE, &small);
    snprintf(line, sizeof line, "convert @sky.pfm %s/full/a.pfm --to cube --size 64", folder);
    int status = tool(line);
    setrlimit(RLIMIT_FSIZE, &before);
    CHECK(status == 2 && strstr(said, "too large"));
    snprintf(line, sizeof line, "%s/full", folder);
    CHECK(rmdir(line) == 0); /* it is empty */
}

static void what_the_system_refuses_is_said_in_words(void) {
    char line[4200];
    write_bad("sky.pfm", 2);
    check_tool("info @missing.pfm", 2, "does not exist");
    snprintf(line, sizeof line, "info %s", folder);
    check_tool(line, 2, "is a folder");
    check_tool("info @sky.pfm/inside", 2, "a part of the path is a file");
    check_tool("convert @sky.pfm @nowhere/out.pfm", 2, "its folder does not exist");
    check_tool("bake @sky.pfm /dev/null/out --size 4", 2, "a part of the path is a file");
    check_tool("convert @sky.pfm @huge.pfm --size 16384 --to cube", 3, "a smaller --size");
    if (geteuid()) { /* root may read all */
        CHECK(chmod(file_at("sky.pfm"), 0) == 0);
        check_tool("info @sky.pfm", 2, "permission");
        CHECK(chmod(file_at("sky.pfm"), 0666) == 0);
    }
    write_file("text.pfm", "PFM?", 4);
    check_tool("info @text.pfm", 2, "width");
    write_file("empty.hdr", "", 0);
    check_tool("info @empty.hdr", 2, "is empty");
    write_file("image.hdr", "\x89PNG\r\n", 6);
    check_tool("info @image.hdr", 2, "is a PNG");
    for (int k = 0; k < 5; ++k) {
        static const char *const prints[] = {"info --help", "info @sky.pfm", "sh @sky.pfm",
                                             "compare @sky.pfm @sky.pfm", "mips @sky.pfm @out-"};
        CHECK(tool_from(NULL, NULL, prints[k]) == 2 && strstr(said, "is closed"));
        if (access("/dev/full", W_OK) == 0)
            CHECK(tool_from(NULL, "/dev/full", prints[k]) == 2 && strstr(said, "no space"));
    }
}

/* ---------------------------------------------------------------------- readers not ours ---- */

#ifdef TOOL_EXR
/* What oiiotool makes of a picture: floats or halves, in lines or tiles. */
static int oiiotool(const char *from, const char *to, const char *kind, int tiled) {
    const char *tiles[] = {from, "-d", kind, "--tile", "64", "64", "-o", to, NULL};
    const char *lines[] = {from, "-d", kind, "--scanline", "-o", to, NULL};
    return start("oiiotool", tiled ? tiles : lines, NULL, file_at("out"));
}

static image read_file(const char *path) {
    image in;
    blob b = {NULL, 0, 0};
    unsigned char part[65536];
    size_t n;
    FILE *file = fopen(path, "rb");
    while (file && (n = fread(part, 1, sizeof part, file)) > 0) put(&b, part, n);
    if (file) fclose(file);
    if (!image_read(&in, b.data, b.bytes)) printf("    %s %s\n", path, in.error);
    free(b.data);
    return in;
}

/* Our reading of a .hdr is OpenImageIO's, bit for bit, by way of .exr in floats; in halves too, as
   far as they reach, for 8 bits fit in their mantissa. */
static void compare_with_oiiotool(const char *path) {
    char hdr[4096];
    snprintf(hdr, sizeof hdr, "%s", path);
    image a = read_file(hdr);
    CHECK(a.rgb != NULL);
    for (int k = 0; k < 3 && a.rgb; ++k) {
        char copy[4096];
        double worst = 0;
        snprintf(copy, sizeof copy, "%s", file_at("copy.exr"));
        CHECK(oiiotool(hdr, copy, k == 2 ? "half" : "float", k == 1) == 0);
        image b = read_file(copy);
        if (!CHECK(b.rgb && b.width == a.width && b.height == a.height)) continue;
        for (size_t i = 0; i < image_floats(&a) && k == 2; ++i)
            if (a.rgb[i] > 6.2e-5f && a.rgb[i] < 65504) /* what a half can be, but denormals */
                worst = fmax(worst, fabs((double)b.rgb[i] / (double)a.rgb[i] - 1));
        CHECK_CLOSE(worst, 0, 0);
        CHECK(k == 2 || !memcmp(a.rgb, b.rgb, image_floats(&a) * sizeof(float)));
        image_free(&b);
    }
    image_free(&a);
}

static void radiance_pictures_are_read_as_openimageio_reads_them(void) {
    unsigned char *rgbe = (unsigned char *)malloc(4 * 256 * 128);
    if (!rgbe) exit(1);
    draw_rgbe(rgbe, 256 * 128, 9);
    for (int form = FLAT; form <= NEW; form += 2) { /* it does not know old run lengths */
        write_blob("hdr.hdr", radiance("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 128 +X 256\n",
                                       rgbe, 128, 256, form));
        compare_with_oiiotool(file_at("hdr.hdr"));
    }
    free(rgbe);
}

static char **your_maps; /* .hdr files that the test was started with */

static void your_maps_are_read_as_openimageio_reads_them(void) {
    for (char **map = your_maps; *map; ++map) compare_with_oiiotool(*map);
}

static void every_truncated_prefix_of_an_exr_is_refused(void) {
    write_bad("sky.pfm", 2);
    const char *make[] = {file_at("sky.pfm"), "-d", "half", "-o", file_at("small.exr"), NULL};
    CHECK(start("oiiotool", make, NULL, file_at("out")) == 0);
    char *data = (char *)malloc(100000);
    size_t bytes = data ? read_back(file_at("small.exr"), data, 100000) : 0, taken = 0;
    for (size_t n = 0; n < bytes; ++n) {
        image in;
        taken += (size_t)read_exactly(&in, (unsigned char *)data, n);
        CHECK(in.rgb || *in.error);
        image_free(&in);
    }
    CHECK(bytes > 100 && taken == 0);
    free(data);
}

/* Channels A, G and Y: only Y is read. */
static void grey_is_read_beside_channels_that_are_not_wanted(void) {
    write_bad("sky.pfm", 2);
    const char *make[] = {file_at("sky.pfm"), "--ch", "A=R,G=B,Y=G", "-d", "half", "-o",
                          file_at("grey.exr"), NULL};
    CHECK(start("oiiotool", make, NULL, file_at("out")) == 0);
    char path[4096];
    snprintf(path, sizeof path, "%s", file_at("grey.exr"));
    image grey = read_file(path);
    CHECK(grey.rgb != NULL);
    for (size_t i = 0; grey.rgb && i < image_floats(&grey); i += 3)
        CHECK(grey.rgb[i] >= 0 && !memcmp(grey.rgb + i, grey.rgb + i + 1, sizeof(float)));
    image_free(&grey);
}

#else
static void without_the_library_an_exr_names_the_package(void) {
    image in;
    CHECK(!read_text(&in, "\x76\x2F\x31\x01....") && strstr(in.error, "libopenexr-dev"));
}
#endif

int main(int argc, char **argv) {
    const char *slash = strrchr(argv[0], '/');
    (void)argc; /* without OpenEXR */
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - argv[0]) : 1,
             slash ? argv[0] : ".");
    RUN(a_radiance_sample_is_its_mantissa_times_a_power_of_two);
    RUN(new_old_and_no_run_lengths_give_the_same_pixels);
    RUN(pixels_may_come_in_any_of_eight_orders);
    RUN(exposure_lines_accumulate_and_divide);
    RUN(radiance_headers_that_make_no_sense_are_refused_in_words);
    RUN(every_truncated_prefix_of_a_picture_is_refused);
    RUN(damaged_lines_are_refused);
    RUN(absurd_sizes_are_refused_before_any_allocation);
    RUN(without_memory_nothing_leaks);
    RUN(pfm_headers_are_read_as_programs_write_them);
    RUN(blanks_and_comments_may_follow_the_scale);
    RUN(a_first_sample_that_begins_like_a_line_end_stays_a_sample);
    RUN(what_the_header_reads_the_tool_reads_as_the_same_bits);
    RUN(crosses_are_cubes_unfolded);
    RUN(strips_hold_faces_in_order_both_ways);
    RUN(lat_longs_of_other_shapes_are_stretched_and_it_is_said);
    RUN(a_sky_that_ends_at_the_horizon_gets_a_ground);
    RUN(shapes_that_fit_nothing_say_what_would);
    RUN(a_turn_by_180_degrees_shifts_a_lat_long_by_half);
    RUN(right_angles_keep_a_cubes_numbers);
    RUN(angles_and_conventions_bring_directions_where_docs_say);
    RUN(any_angle_turns_what_is_seen);
    RUN(the_tool_reads_every_format_and_standard_input);
    RUN(six_files_are_a_cube);
    RUN(files_are_written_by_their_ending);
    RUN(octahedral_maps_get_a_border_where_asked);
    RUN(links_to_devices_stay_and_failures_leave_nothing);
    RUN(the_labelled_sky_has_a_colour_for_each_axis);
    RUN(bad_samples_are_cleaned_by_all_commands_and_it_is_said);
    RUN(info_remarks_on_what_programs_do_to_files);
    RUN(wrong_use_is_said_in_words);
    RUN(a_file_that_may_not_grow_leaves_nothing);
    RUN(what_the_system_refuses_is_said_in_words);
#ifndef TOOL_EXR
    RUN(without_the_library_an_exr_names_the_package);
    printf("  .exr passed by: no OpenEXR library here (Debian: libopenexr-dev)\n");
#else
    const char *nothing[] = {"--help", NULL};
    if (start("oiiotool", nothing, NULL, file_at("out")) == 0) {
        RUN(radiance_pictures_are_read_as_openimageio_reads_them);
        RUN(every_truncated_prefix_of_an_exr_is_refused);
        RUN(grey_is_read_beside_channels_that_are_not_wanted);
        your_maps = argv + 1;
        if (argc > 1) RUN(your_maps_are_read_as_openimageio_reads_them);
    } else printf("  OpenImageIO passed by: no oiiotool here (Debian: openimageio-tools)\n");
#endif
    return test_summary();
}

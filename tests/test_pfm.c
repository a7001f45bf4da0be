/* SPDX-License-Identifier: MIT
   pfm: files that this test writes byte by byte itself, whole, cut off, hostile, foreign-endian;
   and what the library writes, read back. */
#ifndef _XOPEN_SOURCE
#define _XOPEN_SOURCE 600 /* symlink, setrlimit */
#endif
#include "oracle.h"
#include <limits.h>
#include <locale.h>
#if !defined(_WIN32) && !defined(__wasm__) /* what only POSIX can do to a file */
#define TEST_POSIX
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

static const int mappings[] = {ENVMAP_CUBE,    ENVMAP_PARABOLOID, ENVMAP_SPHERE,
                               ENVMAP_LATLONG, ENVMAP_ANGULAR,    ENVMAP_OCTAHEDRAL};

/* A block of exactly `bytes`, so that one byte too many read is seen by ASan and valgrind. */
typedef struct {
    unsigned char *data;
    size_t bytes;
} blob;

static blob new_blob(const char *header, size_t samples_bytes) {
    blob b = {NULL, strlen(header) + samples_bytes};
    b.data = (unsigned char *)malloc(b.bytes ? b.bytes : 1);
    if (!b.data) exit(1);
    memset(b.data, 0, b.bytes ? b.bytes : 1);
    memcpy(b.data, header, strlen(header));
    return b;
}

static void put_float(unsigned char *at, float value, int big) {
    unsigned u;
    memcpy(&u, &value, 4);
    for (int i = 0; i < 4; ++i) at[big ? 3 - i : i] = (unsigned char)(u >> (8 * i));
}

/* The picture's sample (row from the top, column, channel), all different and exact in float. */
static float sample(int row, int column, int channel) {
    return (float)(1 + column + 100 * row) + 0.25f * (float)channel;
}

/* A file: rows bottom to top, each sample by its place. */
static blob picture(const char *header, int w, int h, int channels, int big) {
    blob b = new_blob(header, (size_t)w * (size_t)h * (size_t)channels * 4);
    unsigned char *at = b.data + strlen(header);
    for (int row = h - 1; row >= 0; --row)
        for (int column = 0; column < w; ++column)
            for (int c = 0; c < channels; ++c, at += 4) put_float(at, sample(row, column, c), big);
    return b;
}

static envmap_result read_blob(envmap *map, const blob *b, int mapping) {
    return envmap_pfm_read(map, b->data, b->bytes, mapping);
}

/* Reads a header in front of a 4 x 2 picture; the result, and that nothing changed on failure. */
static envmap_result try_header(const char *header, const char *what) {
    envmap map = {0}, before;
    map.size = 77;
    memcpy(&before, &map, sizeof map);
    blob b = picture(header, 4, 2, 3, 0);
    envmap_result r = read_blob(&map, &b, ENVMAP_LATLONG);
    if (r) {
        CHECK(!memcmp(&before, &map, sizeof map));
    } else {
        int ok = map.size == 2 && map.levels == 1 && map.slices == 1 && map.texels &&
                 fabsf(map.texels[0]) > 0;
        if (!ok) printf("    strange map from %s\n", what);
        CHECK(ok);
        envmap_free(&map);
    }
    free(b.data);
    CHECK(oracle_live == 0);
    return r;
}

static void check_header(const char *header, envmap_result expected) {
    envmap_result r = try_header(header, header);
    if (r != expected) {
        char shown[200];
        size_t n = 0;
        for (const char *c = header; *c && n < sizeof shown - 6; ++c)
            n += (size_t)sprintf(shown + n, *c < 32 ? "\\%o" : "%c", *c);
        printf("    header \"%s\": %s\n", shown, envmap_result_text((envmap_result)r));
    }
    CHECK(r == expected);
}

/* ------------------------------------------------------------------------------ what is read -- */

static void samples_land_where_the_picture_has_them(void) {
    static const char *const header[2][2] = {{"PF\n4 2\n-1.0\n", "PF\n4 2\n1.0\n"},
                                             {"Pf\n4 2\n-1.0\n", "Pf\n4 2\n1.0\n"}};
    for (int grey = 0; grey < 2; ++grey)
        for (int big = 0; big < 2; ++big) {
            envmap map = {0};
            blob b = picture(header[grey][big], 4, 2, grey ? 1 : 3, big);
            CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_OK);
            CHECK(map.mapping == ENVMAP_LATLONG && map.size == 2 && map.slices == 1);
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 4; ++x)
                    for (int c = 0; c < 3; ++c)
                        CHECK(envmap_texel(&map, 0, 0, 0, x, y)[c] == sample(y, x, grey ? 0 : c));
            envmap_free(&map);
            free(b.data);
        }
}

/* Two slices of a cube of 3: a strip of 12 faces, +X of the first slice at the top. */
static void strips_hold_faces_in_order_and_slices_outermost(void) {
    static const int faces[MAPPINGS] = {6, 2, 1, 0, 1, 1};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int slices = 1; slices <= 3 && faces[m]; ++slices) {
            char header[40];
            int h = 3 * faces[m] * slices;
            sprintf(header, "PF\n3 %d\n-1\n", h);
            blob b = picture(header, 3, h, 3, 0);
            envmap map = {0};
            int here;
            map.memory = &here;
            CHECK(read_blob(&map, &b, mappings[m]) == ENVMAP_OK);
            CHECK(map.size == 3 && map.slices == slices && map.levels == 1 && map.mapping == m);
            CHECK(map.p0 == -1 && map.p1 == 1 && map.memory == &here);
            for (int s = 0; s < slices && map.texels; ++s)
                for (int f = 0; f < faces[m]; ++f)
                    for (int y = 0; y < 3; ++y)
                        for (int x = 0; x < 3; ++x)
                            for (int c = 0; c < 3; ++c)
                                CHECK(envmap_texel(&map, 0, s, f, x, y)[c] ==
                                      sample((s * faces[m] + f) * 3 + y, x, c));
            envmap_free(&map);
            free(b.data);
        }
    CHECK(oracle_live == 0 && oracle_wrong_context == 0);
}

static void samples_are_multiplied_by_the_magnitude_of_the_scale(void) {
    static const struct {
        const char *text;
        double scale;
    } table[] = {{"-1", 1},        {"1", 1},         {"+1", 1},       {"-2.5", 2.5},
                 {"0.5", 0.5},     {".5", 0.5},      {"-.25", 0.25},  {"3.", 3},
                 {"-1.000000", 1}, {"1e2", 100},     {"-1E+2", 100},  {"2.5e-3", 2.5e-3},
                 {"-0001.50", 1.5}, {"12345678901234567890", 12345678901234567890.0},
                 {"0.00000000000000000001", 1e-20},  {"1000000000000000000000e-21", 1},
                 {"-0.000000000000000000000000000001e30", 1}};
    for (size_t i = 0; i < sizeof table / sizeof *table; ++i) {
        char header[80];
        envmap map = {0};
        sprintf(header, "PF\n4 2\n%s\n", table[i].text);
        blob b = picture(header, 4, 2, 3, table[i].text[0] != '-');
        if (read_blob(&map, &b, ENVMAP_LATLONG)) printf("    scale %s refused\n", table[i].text);
        CHECK(map.texels != NULL);
        for (int k = 0; k < 24 && map.texels; ++k) {
            double expected = table[i].scale * (double)sample(k / 12, k / 3 % 4, k % 3);
            CHECK_CLOSE(map.texels[k], expected, 2e-7 * expected);
        }
        envmap_free(&map);
        free(b.data);
    }
}

static void headers_may_use_any_white_space_and_comments(void) {
    static const char *const good[] = {
        "PF\n4 2\n-1.0\n",
        "PF\r\n4 2\r\n-1.0\r\n",
        "PF 4 2 -1.0\n",
        "PF\n4\n2\n-1.0\n",
        "PF\t4\t2\t-1.0\t",
        "PF \n  4    2  \n\n\n-1.0\n",
        "PF\n\n4\v2\f-1.0 ",
        "PF\n# made by a tool\n4 2\n-1.0\n",
        "PF\n#\n#two\n4 2\n# three 3 3\n-1.0\n",
        "PF\n4 2 # width and height\n-1.0\n",
        "PF # comment\r\n4 2\r\n# another\r\n-1.0\r\n",
        "PF\n4 # width\n2 # height\n-1.0\n",
        "PF\n004 02\n-1.0\n"};
    for (size_t i = 0; i < sizeof good / sizeof *good; ++i) check_header(good[i], ENVMAP_OK);
}

/* One white space (or CR LF) ends the header. What follows are samples, also when they look like
   white space, digits or a comment. */
static void samples_that_look_like_text_stay_samples(void) {
    static const char *const header[] = {"PF\n2 1\n-1.0\n", "PF 2 1 -1.0 ", "PF\r\n2 1\r\n-1.0\r\n"};
    static const unsigned char looks[] = {' ', '\n', '\t', '0', '9', '#', '.', 'e', '\v'};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < sizeof looks; ++k) {
            envmap map = {0};
            blob b = new_blob(header[i], 24);
            memset(b.data + strlen(header[i]), looks[k], 24);
            CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_OK);
            if (map.texels) CHECK(!memcmp(map.texels, b.data + strlen(header[i]), 24));
            envmap_free(&map);
            free(b.data);
        }
}

/* NaN, infinities, -0 and denormals come through with all their bits: filters judge, not files. */
/* 0x0A is a line feed: part of a line end, unless lines end in carriage returns alone. */
static void a_first_sample_that_begins_with_a_line_feed_is_kept(void) {
    static const char *const headers[] = {"PF\r2 1\r-1\r", "PF\r\n2 1\r\n-1\r\n", "PF 2 1 -1\r\n"};
    for (int k = 0; k < 3; ++k) {
        blob b = picture(headers[k], 2, 1, 3, 0);
        envmap map = {0};
        b.data[strlen(headers[k])] = 0x0A;
        CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_OK);
        for (int c = 0; map.texels && c < 3; ++c) {
            unsigned char bytes[4];
            put_float(bytes, map.texels[c], 0);
            CHECK(memcmp(bytes, b.data + strlen(headers[k]) + 4 * c, 4) == 0);
        }
        envmap_free(&map);
        b.bytes--;
        CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_ERROR_TRUNCATED);
        free(b.data);
    }
}

static void any_float_is_kept_bit_by_bit(void) {
    static const unsigned bits[6] = {0x7fc00001u, 0x7f800000u, 0xff800000u,
                                     0x80000000u, 0x00000001u, 0xc2280000u};
    envmap map = {0};
    unsigned char out[64];
    size_t bytes = 0;
    blob b = new_blob("PF\n2 1\n-1\n", 24);
    for (int i = 0; i < 24; ++i)
        b.data[10 + i] = (unsigned char)(bits[i / 4] >> (8 * (i % 4)));
    CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_OK);
    if (map.texels) CHECK(!memcmp(map.texels, bits, 24));
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &map, 0) == ENVMAP_OK);
    CHECK(bytes > 24 && bytes <= sizeof out && !memcmp(out + bytes - 24, b.data + 10, 24));
    envmap_free(&map);
    free(b.data);
}

/* ------------------------------------------------------------------------- what is refused -- */

static void every_truncated_prefix_is_refused(void) {
    static const char *const header[] = {"PF\n4 2\n-1.0\n", "Pf\n4 2\n1.0\n",
                                         "PF\r\n# c\r\n4 2\r\n-1.0\r\n"};
    for (size_t i = 0; i < 3; ++i)
        for (int m = 0; m < MAPPINGS; ++m) {
            int channels = header[i][1] == 'F' ? 3 : 1, w = 4, h = 2;
            char own[60];
            strcpy(own, header[i]);
            if (m != ENVMAP_LATLONG) { /* one face, or a strip of them, of 1 x 1 */
                char *at = strstr(own, "4 2");
                w = 1, h = envmap_faces(m);
                at[0] = '1', at[2] = (char)('0' + h);
            }
            blob b = picture(own, w, h, channels, 0);
            for (size_t n = 0; n <= b.bytes; ++n) {
                envmap map = {0}, before;
                map.levels = 42;
                memcpy(&before, &map, sizeof map);
                unsigned char *cut = (unsigned char *)malloc(n ? n : 1);
                memcpy(cut, b.data, n);
                envmap_result r = envmap_pfm_read(&map, cut, n, mappings[m]);
                if (n == b.bytes) {
                    CHECK(r == ENVMAP_OK);
                } else if (n >= strlen(own)) {
                    CHECK(r == ENVMAP_ERROR_TRUNCATED);
                } else {
                    CHECK(r == ENVMAP_ERROR_TRUNCATED || r == ENVMAP_ERROR_FORMAT);
                }
                if (r)
                    CHECK(!memcmp(&before, &map, sizeof map));
                else
                    envmap_free(&map);
                CHECK(oracle_live == 0);
                free(cut);
            }
            free(b.data);
        }
}

static void data_after_the_last_sample_are_refused(void) {
    for (size_t extra = 1; extra < 40; extra += 3) {
        envmap map = {0};
        blob b = new_blob("PF\n4 2\n-1\n", 96 + extra);
        CHECK(read_blob(&map, &b, ENVMAP_LATLONG) == ENVMAP_ERROR_TRAILING);
        CHECK(map.texels == NULL && oracle_live == 0);
        free(b.data);
    }
}

static void hostile_headers_are_refused(void) {
    static const char *const bad[] = {
        "", "P", "P6\n4 2\n255\n", "PG\n4 2\n-1\n", "pf\n4 2\n-1\n", "PF4 2\n-1\n", "PFF\n4 2\n-1\n",
        "PF\n4 2\n", "PF\n4\n", "PF\n-4 2\n-1\n", "PF\n4 -2\n-1\n", "PF\n-4 -2\n-1\n",
        "PF\n4.0 2\n-1\n", "PF\n4e0 2\n-1\n", "PF\n0x4 2\n-1\n", "PF\n4,2\n-1\n", "PF\nx 2\n-1\n",
        "PF\n4 2\n0\n", "PF\n4 2\n-0\n", "PF\n4 2\n0.0\n", "PF\n4 2\n0e5\n", "PF\n4 2\n-0.0e-9\n",
        "PF\n4 2\nnan\n", "PF\n4 2\nNaN\n", "PF\n4 2\n-nan\n", "PF\n4 2\ninf\n", "PF\n4 2\n-inf\n",
        "PF\n4 2\nInfinity\n", "PF\n4 2\n1e999\n", "PF\n4 2\n-1e999\n", "PF\n4 2\n1e-999\n",
        "PF\n4 2\n1e99999999999999999999\n", "PF\n4 2\n1e-99999999999999999999\n",
        "PF\n4 2\n-\n", "PF\n4 2\n+\n", "PF\n4 2\n.\n", "PF\n4 2\n-.\n", "PF\n4 2\ne5\n",
        "PF\n4 2\n1e\n", "PF\n4 2\n1e+\n", "PF\n4 2\n1,5\n", "PF\n4 2\n0x1p3\n", "PF\n4 2\n1.5.5\n",
        "PF\n4 2\n--1\n", "PF\n4 2\n1f\n", "PF\n4 2\nabc\n"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) check_header(bad[i], ENVMAP_ERROR_FORMAT);
    check_header("PF\n0 0\n-1\n", try_header("PF\n0 0\n-1\n", "0 0"));
    CHECK(try_header("PF\n0 0\n-1\n", "0 0") != ENVMAP_OK);
    CHECK(try_header("PF\n4 0\n-1\n", "4 0") != ENVMAP_OK);
    CHECK(try_header("PF\n0 2\n-1\n", "0 2") != ENVMAP_OK);
}

/* Sizes that no memory holds, or that wrap around when multiplied: refused, and nothing larger
   than the file itself was ever asked for. */
static void absurd_sizes_are_refused_before_any_allocation(void) {
    static const char *const bad[] = {
        "PF\n32768 16384\n-1\n", "PF\n65536 32768\n-1\n", "PF\n2147483646 1073741823\n-1\n",
        "PF\n4294967296 2147483648\n-1\n", "PF\n4294967300 4294967298\n-1\n",
        "PF\n8589934592 4294967296\n-1\n", "PF\n18446744073709551620 2\n-1\n",
        "PF\n18446744073709551616 9223372036854775808\n-1\n",
        "PF\n99999999999999999999999999999999 99999999999999999999999999999999\n-1\n",
        "PF\n2000 1000\n-1\n", "PF\n4 99999999999\n-1\n"};
    oracle_calls = 0, oracle_largest = 0;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        envmap_result r = try_header(bad[i], bad[i]);
        CHECK(r == ENVMAP_ERROR_LIMIT || r == ENVMAP_ERROR_FORMAT || r == ENVMAP_ERROR_SHAPE ||
              r == ENVMAP_ERROR_TRUNCATED);
    }
    /* strips: 6 w slices and 2 w slices that overflow an int; slices beyond 4096 */
    static const char *const strip[] = {"PF\n1 24582\n-1\n", "PF\n357913942 2147483652\n-1\n",
                                        "PF\n1 2147483646\n-1\n", "PF\n16384 98304\n-1\n"};
    for (size_t i = 0; i < 4; ++i)
        for (int m = 0; m < MAPPINGS; ++m) {
            envmap map = {0};
            blob b = new_blob(strip[i], 72);
            CHECK(read_blob(&map, &b, mappings[m]) != ENVMAP_OK);
            CHECK(map.texels == NULL);
            free(b.data);
        }
    CHECK(oracle_largest < 100000);
    CHECK(oracle_live == 0);
}

/* One texel more is beyond it; what is not has no samples here. */
static void the_largest_edge_is_16384(void) {
    static const char largest[] = "PF\n16384 16384\n-1\n", more[] = "PF\n16385 16385\n-1\n";
    envmap map = {0};
    CHECK(envmap_pfm_read(&map, largest, sizeof largest - 1, ENVMAP_SPHERE) == ENVMAP_ERROR_TRUNCATED);
    CHECK(envmap_pfm_read(&map, more, sizeof more - 1, ENVMAP_SPHERE) == ENVMAP_ERROR_LIMIT);
}

static void shapes_must_fit_the_mapping(void) {
    static const struct {
        int mapping, w, h, slices; /* 0: refused */
    } table[] = {
        {ENVMAP_CUBE, 2, 12, 1},      {ENVMAP_CUBE, 2, 24, 2},      {ENVMAP_CUBE, 2, 10, 0},
        {ENVMAP_CUBE, 2, 2, 0},       {ENVMAP_CUBE, 12, 2, 0},      {ENVMAP_CUBE, 8, 6, 0},
        {ENVMAP_CUBE, 2, 18, 0},      {ENVMAP_PARABOLOID, 3, 6, 1}, {ENVMAP_PARABOLOID, 3, 12, 2},
        {ENVMAP_PARABOLOID, 3, 9, 0}, {ENVMAP_PARABOLOID, 6, 3, 0}, {ENVMAP_SPHERE, 3, 3, 1},
        {ENVMAP_SPHERE, 3, 9, 3},     {ENVMAP_SPHERE, 3, 4, 0},     {ENVMAP_SPHERE, 4, 3, 0},
        {ENVMAP_LATLONG, 6, 3, 1},    {ENVMAP_LATLONG, 6, 6, 0},    {ENVMAP_LATLONG, 3, 6, 0},
        {ENVMAP_LATLONG, 5, 2, 0},    {ENVMAP_LATLONG, 9, 3, 0},    {ENVMAP_LATLONG, 5, 3, 0},
        {ENVMAP_LATLONG, 1, 1, 0},    {ENVMAP_ANGULAR, 5, 5, 1},    {ENVMAP_ANGULAR, 5, 10, 2},
        {ENVMAP_ANGULAR, 5, 7, 0},    {ENVMAP_OCTAHEDRAL, 4, 4, 1}, {ENVMAP_OCTAHEDRAL, 3, 6, 2},
        {ENVMAP_OCTAHEDRAL, 8, 4, 0}};
    for (size_t i = 0; i < sizeof table / sizeof *table; ++i) {
        char header[40];
        envmap map = {0};
        sprintf(header, "PF\n%d %d\n-1\n", table[i].w, table[i].h);
        blob b = picture(header, table[i].w, table[i].h, 3, 0);
        envmap_result r = read_blob(&map, &b, table[i].mapping);
        CHECK(r == (table[i].slices ? ENVMAP_OK : ENVMAP_ERROR_SHAPE));
        CHECK(map.slices == table[i].slices);
        envmap_free(&map);
        free(b.data);
    }
}

static void bad_arguments_are_refused(void) {
    envmap map = {0}, none = {0};
    unsigned char out[200];
    size_t bytes = 7;
    blob b = picture("PF\n4 2\n-1\n", 4, 2, 3, 0);
    CHECK(envmap_pfm_read(NULL, b.data, b.bytes, ENVMAP_LATLONG) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_read(&map, NULL, b.bytes, ENVMAP_LATLONG) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_read(&map, b.data, b.bytes, ENVMAP_MAPPING_COUNT) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_load(NULL, "x", ENVMAP_CUBE) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_load(&map, NULL, ENVMAP_CUBE) == ENVMAP_ERROR_ARGUMENT);
    CHECK(map.texels == NULL);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &none, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_save(&none, "build/never.pfm", 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_create(&map, ENVMAP_CUBE, 4, 3, 1) == ENVMAP_OK);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &map, 3) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &map, -1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_pfm_save(&map, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&map);
    CHECK(envmap_create(&map, ENVMAP_LATLONG, 2, 1, 2) == ENVMAP_OK);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &map, 0) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&map);
    free(b.data);
}

static void without_memory_nothing_leaks_and_the_map_stays(void) {
    blob b = picture("PF\n4 2\n-1\n", 4, 2, 3, 0);
    for (int n = 0; n < 20; ++n) {
        envmap map = {0}, before;
        map.levels = 42;
        memcpy(&before, &map, sizeof map);
        oracle_calls = 0, oracle_fail_at = n;
        envmap_result r = read_blob(&map, &b, ENVMAP_LATLONG);
        oracle_fail_at = -1;
        if (r == ENVMAP_OK) {
            CHECK(n > 0);
            envmap_free(&map);
            CHECK(oracle_live == 0);
            break;
        }
        CHECK(r == ENVMAP_ERROR_MEMORY && n < 19);
        CHECK(!memcmp(&before, &map, sizeof map));
        CHECK(oracle_live == 0);
    }
    free(b.data);
}

/* ------------------------------------------------------------------------------ and written -- */

static void pfm_round_trips(void) {
    static const int sizes[] = {1, 2, 3, 5, 16};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 5; ++i)
            for (int slices = 1; slices <= (m == ENVMAP_LATLONG ? 1 : 3); ++slices) {
                int size = sizes[i], levels = envmap_levels(size);
                envmap map = {0};
                CHECK(envmap_create(&map, mappings[m], size, levels, slices) == ENVMAP_OK);
                oracle_noise(&map, 3);
                for (int l = 0; l < levels; ++l) {
                    size_t need = 0, bytes = 0, floats = oracle_floats(m, size, slices, l);
                    envmap back = {0};
                    CHECK(envmap_pfm_write(NULL, 0, &need, &map, l) == ENVMAP_OK);
                    CHECK(need > floats * 4 && need < floats * 4 + 64);
                    unsigned char *file = (unsigned char *)malloc(need);
                    CHECK(envmap_pfm_write(file, need, &bytes, &map, l) == ENVMAP_OK);
                    CHECK(bytes == need);
                    CHECK(envmap_pfm_read(&back, file, bytes, mappings[m]) == ENVMAP_OK);
                    CHECK(back.size == oracle_edge(size, l) && back.slices == slices);
                    if (back.texels)
                        CHECK(!memcmp(back.texels, envmap_texel(&map, l, 0, 0, 0, 0), floats * 4));
                    envmap_free(&back);
                    free(file);
                }
                envmap_free(&map);
            }
    CHECK(oracle_live == 0);
}

/* The bytes themselves, written out: PF, width height, -1, little-endian, last row first. */
static void a_written_file_is_little_endian_and_bottom_to_top(void) {
    envmap map = {0};
    unsigned char out[200];
    size_t bytes = 0;
    int w = 0, h = 0, header = 0;
    double scale = 0;
    CHECK(envmap_create(&map, ENVMAP_LATLONG, 2, 1, 1) == ENVMAP_OK);
    for (int k = 0; k < 24; ++k) map.texels[k] = sample(k / 12, k / 3 % 4, k % 3);
    CHECK(envmap_pfm_write(out, sizeof out, &bytes, &map, 0) == ENVMAP_OK);
    header = (int)bytes - 96;
    CHECK(header > 6 && !memcmp(out, "PF\n", 3) && out[header - 1] == '\n');
    char text[64] = {0};
    memcpy(text, out, (size_t)header);
    CHECK(sscanf(text, "PF %d %d %lf", &w, &h, &scale) == 3);
    CHECK(w == 4 && h == 2 && scale == -1);
    blob b = picture("", 4, 2, 3, 0);
    CHECK(!memcmp(out + header, b.data, 96));
    free(b.data);
    envmap_free(&map);
}

static void too_little_room_writes_nothing(void) {
    envmap map = {0};
    size_t need = 0;
    CHECK(envmap_create(&map, ENVMAP_PARABOLOID, 2, 2, 1) == ENVMAP_OK);
    CHECK(envmap_pfm_write(NULL, 0, &need, &map, 0) == ENVMAP_OK);
    for (size_t room = 0; room < need; ++room) {
        size_t bytes = 0;
        int touched = 0;
        unsigned char *file = (unsigned char *)malloc(need);
        memset(file, 0x5A, need);
        CHECK(envmap_pfm_write(file, room, &bytes, &map, 0) == ENVMAP_ERROR_LIMIT);
        CHECK(bytes == need);
        for (size_t i = 0; i < need; ++i) touched += file[i] != 0x5A;
        CHECK(touched == 0);
        free(file);
    }
    envmap_free(&map);
}

/* ----------------------------------------------------------------------------------- paths -- */

static char own_path[600]; /* beside the program */

static int exists(const char *path) {
    FILE *file = fopen(path, "rb");
    if (file) fclose(file);
    return file != NULL;
}

static void write_file(const char *path, const void *data, size_t bytes) {
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    if (!file) return;
    if (bytes) CHECK(fwrite(data, 1, bytes, file) == bytes);
    fclose(file);
}

static void files_are_what_memory_is(void) {
    envmap map = {0}, back = {0};
    CHECK(envmap_create(&map, ENVMAP_CUBE, 32, 6, 2) == ENVMAP_OK);
    oracle_noise(&map, 4);
    for (int l = 0; l < 6; ++l) {
        size_t need = 0, got;
        int context;
        CHECK(envmap_pfm_save(&map, own_path, l) == ENVMAP_OK);
        CHECK(envmap_pfm_write(NULL, 0, &need, &map, l) == ENVMAP_OK);
        unsigned char *memory = (unsigned char *)malloc(need), *disk = (unsigned char *)malloc(need + 9);
        CHECK(envmap_pfm_write(memory, need, &need, &map, l) == ENVMAP_OK);
        FILE *file = fopen(own_path, "rb");
        got = file ? fread(disk, 1, need + 9, file) : 0;
        if (file) fclose(file);
        CHECK(got == need && !memcmp(memory, disk, need));
        back.memory = &context;
        CHECK(envmap_pfm_load(&back, own_path, ENVMAP_CUBE) == ENVMAP_OK);
        CHECK(back.size == 32 >> l && back.slices == 2);
        if (back.texels)
            CHECK(!memcmp(back.texels, envmap_texel(&map, l, 0, 0, 0, 0),
                          oracle_floats(ENVMAP_CUBE, 32, 2, l) * 4));
        envmap_free(&back);
        free(memory), free(disk);
    }
    envmap_free(&map);
    remove(own_path);
    CHECK(oracle_live == 0 && oracle_wrong_context == 0);
}

/* Whatever memory says of bytes, a path says of a file that holds them. */
static void bad_files_are_refused_as_in_memory(void) {
    blob b = picture("PF\n4 2\n-1.0\n", 4, 2, 3, 0), more = new_blob("PF\n4 2\n-1.0\n", 97);
    for (size_t n = 0; n <= b.bytes; ++n) {
        envmap disk = {0}, memory = {0};
        write_file(own_path, b.data, n);
        envmap_result r = envmap_pfm_load(&disk, own_path, ENVMAP_LATLONG);
        CHECK(r == envmap_pfm_read(&memory, b.data, n, ENVMAP_LATLONG));
        CHECK((r == ENVMAP_OK) == (n == b.bytes) && (disk.texels != NULL) == (n == b.bytes));
        envmap_free(&disk), envmap_free(&memory);
    }
    envmap map = {0};
    write_file(own_path, more.data, more.bytes);
    CHECK(envmap_pfm_load(&map, own_path, ENVMAP_LATLONG) == ENVMAP_ERROR_TRAILING);
    CHECK(envmap_pfm_load(&map, own_path, ENVMAP_CUBE) == ENVMAP_ERROR_SHAPE);
    static const char huge[] = "PF\n32768 16384\n-1\n";
    write_file(own_path, huge, sizeof huge - 1);
    oracle_largest = 0;
    CHECK(envmap_pfm_load(&map, own_path, ENVMAP_LATLONG) != ENVMAP_OK);
    CHECK(oracle_largest < 10000000);
    CHECK(map.texels == NULL && oracle_live == 0);
    remove(own_path);
    free(b.data), free(more.data);
}

static void paths_that_cannot_be_opened_are_file_errors(void) {
    envmap map = {0}, small = {0};
    CHECK(envmap_create(&small, ENVMAP_SPHERE, 2, 1, 1) == ENVMAP_OK);
    CHECK(envmap_pfm_load(&map, "no/such/file.pfm", ENVMAP_CUBE) == ENVMAP_ERROR_FILE);
    CHECK(envmap_pfm_load(&map, "", ENVMAP_CUBE) == ENVMAP_ERROR_FILE);
    CHECK(envmap_pfm_load(&map, ".", ENVMAP_CUBE) == ENVMAP_ERROR_FILE); /* a directory */
    CHECK(envmap_pfm_save(&small, "no/such/file.pfm", 0) == ENVMAP_ERROR_FILE);
    CHECK(envmap_pfm_save(&small, "", 0) == ENVMAP_ERROR_FILE);
    if (exists("/dev/zero")) /* endless, and no picture */
        CHECK(envmap_pfm_load(&map, "/dev/zero", ENVMAP_CUBE) != ENVMAP_OK);
    if (exists("/dev/null")) CHECK(envmap_pfm_load(&map, "/dev/null", ENVMAP_CUBE) != ENVMAP_OK);
    CHECK(map.texels == NULL);
    envmap_free(&small);
    CHECK(oracle_live == 0);
}

#ifdef TEST_POSIX
/* It stays, though `remove` would take an empty one away. */
static void a_directory_is_not_written_over(void) {
    envmap small = {0};
    struct stat is;
    CHECK(envmap_create(&small, ENVMAP_SPHERE, 2, 1, 1) == ENVMAP_OK);
    remove(own_path);
    CHECK(mkdir(own_path, 0777) == 0);
    CHECK(envmap_pfm_save(&small, own_path, 0) == ENVMAP_ERROR_FILE);
    CHECK(stat(own_path, &is) == 0 && S_ISDIR(is.st_mode));
    remove(own_path);
    envmap_free(&small);
}

/* A full disk. /dev/full is met through a link, so that removing what could not be written whole
   cannot take the device away from whoever runs this as root. */
static void a_full_disk_is_a_file_error(void) {
    envmap small = {0}, large = {0};
    if (!exists("/dev/full")) {
        printf("    no /dev/full here\n");
        CHECK(1);
        return;
    }
    CHECK(envmap_create(&small, ENVMAP_SPHERE, 2, 1, 1) == ENVMAP_OK);
    CHECK(envmap_create(&large, ENVMAP_SPHERE, 256, 1, 1) == ENVMAP_OK);
    remove(own_path);
    for (int i = 0; i < 2; ++i) {
        CHECK(symlink("/dev/full", own_path) == 0);
        CHECK(envmap_pfm_save(i ? &large : &small, own_path, 0) == ENVMAP_ERROR_FILE);
        CHECK(exists("/dev/full"));
        remove(own_path);
    }
    envmap_free(&small), envmap_free(&large);
}

/* Nor can a pipe be read: it has no length. */
static void a_pipe_is_a_file_error(void) {
    envmap map = {0};
    remove(own_path);
    int made = mkfifo(own_path, 0666) == 0;
    int other_end = made ? open(own_path, O_RDWR) : -1; /* or to open it would wait for a writer */
    CHECK(!made || envmap_pfm_load(&map, own_path, ENVMAP_CUBE) == ENVMAP_ERROR_FILE);
    CHECK(map.texels == NULL && oracle_live == 0);
    if (made) close(other_end), remove(own_path);
}

/* The system stops a file at 4096 bytes: what is there of it must go. */
static void a_file_that_is_not_whole_is_removed(void) {
    envmap large = {0};
    struct rlimit old, less;
    CHECK(envmap_create(&large, ENVMAP_SPHERE, 64, 1, 1) == ENVMAP_OK);
    remove(own_path);
    CHECK(getrlimit(RLIMIT_FSIZE, &old) == 0);
    signal(SIGXFSZ, SIG_IGN);
    less = old, less.rlim_cur = 4096;
    fflush(stdout);
    CHECK(setrlimit(RLIMIT_FSIZE, &less) == 0);
    envmap_result r = envmap_pfm_save(&large, own_path, 0);
    setrlimit(RLIMIT_FSIZE, &old);
    signal(SIGXFSZ, SIG_DFL);
    CHECK(r == ENVMAP_ERROR_FILE);
    CHECK(!exists(own_path));
    remove(own_path);
    envmap_free(&large);
}

#endif

static void without_memory_files_leak_nothing(void) {
    blob b = picture("PF\n4 2\n-1.0\n", 4, 2, 3, 0);
    write_file(own_path, b.data, b.bytes);
    int n = 0;
    for (; n < 20; ++n) {
        envmap map = {0};
        oracle_calls = 0, oracle_fail_at = n;
        envmap_result r = envmap_pfm_load(&map, own_path, ENVMAP_LATLONG);
        oracle_fail_at = -1;
        if (r == ENVMAP_OK) {
            envmap_free(&map);
            break;
        }
        CHECK(r == ENVMAP_ERROR_MEMORY);
        CHECK(map.texels == NULL && oracle_live == 0);
    }
    CHECK(n > 0 && n < 20);
    envmap map = {0};
    CHECK(envmap_pfm_load(&map, own_path, ENVMAP_LATLONG) == ENVMAP_OK);
    remove(own_path);
    for (n = 0; n < 20; ++n) {
        oracle_calls = 0, oracle_fail_at = n;
        envmap_result r = envmap_pfm_save(&map, own_path, 0);
        oracle_fail_at = -1;
        if (r == ENVMAP_OK) break;
        CHECK(r == ENVMAP_ERROR_MEMORY && !exists(own_path));
    }
    CHECK(n < 20 && exists(own_path));
    remove(own_path);
    envmap_free(&map);
    CHECK(oracle_live == 0);
    free(b.data);
}

/* Where a comma is the decimal point, a file still has its dot. */
static void the_locale_changes_nothing(void) {
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8"};
    const char *got = NULL;
    for (size_t i = 0; i < 4 && !got; ++i) got = setlocale(LC_ALL, names[i]);
    if (!got) printf("    no locale with a decimal comma here; tested in \"C\" only\n");
    check_header("PF\n4 2\n-1.5\n", ENVMAP_OK);
    check_header("PF\n4 2\n-1,5\n", ENVMAP_ERROR_FORMAT);
    samples_are_multiplied_by_the_magnitude_of_the_scale();
    a_written_file_is_little_endian_and_bottom_to_top();
    setlocale(LC_ALL, "C");
}

int main(int argc, char **argv) {
    snprintf(own_path, sizeof own_path, "%s.tmp.pfm", argc > 0 ? argv[0] : "test_pfm");
    RUN(samples_land_where_the_picture_has_them);
    RUN(strips_hold_faces_in_order_and_slices_outermost);
    RUN(samples_are_multiplied_by_the_magnitude_of_the_scale);
    RUN(headers_may_use_any_white_space_and_comments);
    RUN(samples_that_look_like_text_stay_samples);
    RUN(a_first_sample_that_begins_with_a_line_feed_is_kept);
    RUN(any_float_is_kept_bit_by_bit);
    RUN(every_truncated_prefix_is_refused);
    RUN(data_after_the_last_sample_are_refused);
    RUN(hostile_headers_are_refused);
    RUN(absurd_sizes_are_refused_before_any_allocation);
    RUN(the_largest_edge_is_16384);
    RUN(shapes_must_fit_the_mapping);
    RUN(bad_arguments_are_refused);
    RUN(without_memory_nothing_leaks_and_the_map_stays);
    RUN(pfm_round_trips);
    RUN(a_written_file_is_little_endian_and_bottom_to_top);
    RUN(too_little_room_writes_nothing);
    RUN(files_are_what_memory_is);
    RUN(bad_files_are_refused_as_in_memory);
    RUN(paths_that_cannot_be_opened_are_file_errors);
#ifdef TEST_POSIX
    RUN(a_directory_is_not_written_over);
    RUN(a_full_disk_is_a_file_error);
    RUN(a_pipe_is_a_file_error);
    RUN(a_file_that_is_not_whole_is_removed);
#endif
    RUN(without_memory_files_leak_nothing);
    RUN(the_locale_changes_nothing);
    return test_summary();
}

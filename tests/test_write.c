/* SPDX-License-Identifier: MIT
   The files that examples/tool/write_*.h write, read by readers of this test's own, from the
   published pages of the formats alone: KTX 2 and 1, DDS, Radiance, and the numbers in them. Where
   node and npm's ktx-parse or OpenImageIO's oiiotool are here, they read them too. */
#define _XOPEN_SOURCE 700
#include "oracle.h"
#include <signal.h>
#include <sys/resource.h>
#include <dirent.h>
#include <math.h>
#include "examples/tool/picture.h"
#include "examples/tool/write_file.h"
#include "examples/tool/write_texels.h"
#include "examples/tool/write_ktx.h"
#include "examples/tool/write_dds.h"
#include "examples/tool/write_hdr.h"
#include "examples/tool/write_pfm.h"
#include "examples/tool/write_png.h"
#include "examples/tool/border.h"
#include "textures.h"

static char folder[] = "/tmp/envmap-write-XXXXXX";
static char path[512];

static const char *in_folder(const char *name) {
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int files_in_folder(void) {
    DIR *directory = opendir(folder);
    int count = 0;
    while (directory && readdir(directory)) count++;
    if (directory) closedir(directory);
    return count - 2; /* . and .. */
}

static void empty_folder(void) {
    DIR *directory = opendir(folder);
    struct dirent *entry;
    while (directory && (entry = readdir(directory))) unlink(in_folder(entry->d_name));
    if (directory) closedir(directory);
}

/* --------------------------------------------------------------------------------- numbers -- */

static float of_bits(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void every_half_is_written_as_itself(void) {
    long saturated = 0;
    for (unsigned half = 0; half < 0x10000; ++half)
        if ((half & 0x7C00) != 0x7C00 && half != 0x8000)
            CHECK(texel_half((float)texture_half_value(half), &saturated) == half);
    CHECK(saturated == 0);
}

/* Among the two halves around a float the nearer one, and of two as near the even one. */
static void halves_round_to_the_nearest_and_to_even(void) {
    long saturated = 0;
    for (unsigned half = 0; half < 0x7BFF; ++half) {
        double a = texture_half_value(half), b = texture_half_value(half + 1), middle = (a + b) / 2;
        CHECK(texel_half((float)middle, &saturated) == half + (half & 1));
        CHECK(texel_half(nextafterf((float)middle, 0), &saturated) == half);
        CHECK(texel_half(nextafterf((float)middle, 1e9f), &saturated) == half + 1);
    }
    CHECK(saturated == 0);
}

static void what_is_too_large_is_saturated_and_counted(void) {
    long saturated = 0;
    CHECK(texel_half(65519.99f, &saturated) == 0x7BFF && saturated == 0); /* rounds to 65504 */
    CHECK(texel_half(65520, &saturated) == 0x7BFF && saturated == 1);
    CHECK(texel_half(of_bits(0x7F800000), &saturated) == 0x7BFF && saturated == 2);
    CHECK(texel_half(of_bits(0xFF800000), &saturated) == 0xFBFF && saturated == 3);
    CHECK(texel_half(of_bits(0x7FC00000), &saturated) == 0 && saturated == 4);
    CHECK(texel_float(of_bits(0x7F800000), &saturated) == 0x7F7FFFFF && saturated == 5);
    float bright[3] = {1e6f, -1, 1};
    double rgb[3];
    texture_b10g11r11_value(rgb, texel_b10g11r11(bright, &saturated));
    CHECK(saturated == 7 && rgb[0] == 65024 && rgb[1] == 0 && rgb[2] == 1);
    texture_rgb9e5_value(rgb, texel_rgb9e5(bright, &saturated));
    CHECK(saturated == 9 && rgb[0] == 65408 && rgb[1] == 0);
}

/* The bounds are half a unit of the last place: of 6 and 5 bits, and of 9 bits of the largest. */
static void packed_formats_keep_their_bits(void) {
    unsigned long long seed = 7;
    long saturated = 0;
    for (int i = 0; i < 200000; ++i) {
        float rgb[3];
        double back[3], most = 0;
        for (int c = 0; c < 3; ++c) {
            rgb[c] = (float)exp2(24 * test_random(&seed) - 9);
            most = fmax(most, (double)rgb[c]);
        }
        texture_b10g11r11_value(back, texel_b10g11r11(rgb, &saturated));
        for (int c = 0; c < 3; ++c)
            CHECK_CLOSE(back[c] / (double)rgb[c], 1, c < 2 ? 1.0 / 128 : 1.0 / 64);
        texture_rgb9e5_value(back, texel_rgb9e5(rgb, &saturated));
        for (int c = 0; c < 3; ++c) CHECK_CLOSE(back[c], (double)rgb[c], most / 511);
    }
    CHECK(saturated == 0);
}

/* ------------------------------------------------------------------------------ containers -- */

/* A cube of levels whose texels are all different, with dark and bright ones. */
static envmap a_map(int mapping, int size, int levels) {
    envmap map = {0};
    unsigned long long seed = 1;
    CHECK(!envmap_create(&map, mapping, size, levels, 1));
    size_t floats = 0;
    for (int l = 0; l < levels; ++l) {
        int edge = size >> l > 1 ? size >> l : 1;
        floats += 3 * (size_t)envmap_faces(mapping) * (size_t)edge *
                  (size_t)(mapping == ENVMAP_LATLONG ? 2 * edge : edge);
    }
    for (size_t i = 0; i < floats; ++i) map.texels[i] = (float)exp2(20 * test_random(&seed) - 8);
    return map;
}

/* Every texel of the file is where the page of the format says, with the value of the map. */
static double worst_of(const envmap *map, const texture_file *file) {
    double worst = 0;
    CHECK(file->good && file->levels == map->levels && file->faces == envmap_faces(map->mapping));
    for (int l = 0; l < map->levels && file->good; ++l)
        for (int f = 0; f < file->faces; ++f)
            for (int y = 0; y < texture_file_height(file, l); ++y)
                for (int x = 0; x < texture_file_width(file, l); ++x) {
                    const float *t = envmap_texel(map, l, 0, f, x, y);
                    double rgb[3], most = fmax((double)t[0], fmax((double)t[1], (double)t[2]));
                    CHECK(texture_file_texel(rgb, file, l, f, x, y));
                    for (int c = 0; c < 3; ++c)
                        worst = fmax(worst, fabs(rgb[c] - (double)t[c]) / most);
                }
    return worst;
}

typedef int writer(texture *t, const char *to);

static void check_container(writer *write, texture_file (*read)(const char *), const char *name) {
    static const double bound[] = {1.0 / 2048, 0, 1.0 / 511, 1.0 / 64};
    static const int shapes[][3] = {{ENVMAP_CUBE, 16, 5},
                                    {ENVMAP_CUBE, 7, 3},
                                    {ENVMAP_CUBE, 1, 1},
                                    {ENVMAP_LATLONG, 12, 2},
                                    {ENVMAP_ANGULAR, 5, 1}};
    for (int format = 0; format < 4; ++format)
        for (int s = 0; s < 5; ++s) {
            envmap map = a_map(shapes[s][0], shapes[s][1], shapes[s][2]);
            texture t = {0};
            t.map = &map, t.format = format;
            t.notes = "sky\0blue", t.notes_size = 9;
            CHECK(write(&t, in_folder(name)) == 0);
            CHECK(t.saturated == 0);
            texture_file file = read(path);
            CHECK(file.format == format);
            double worst = worst_of(&map, &file);
            if (!s) {
                char what[96];
                snprintf(what, sizeof what, "%s %s: worst error of a channel", name,
                         texel_format_name[format]);
                FIGURE(what, worst, bound[format]);
            } else CHECK_CLOSE(worst, 0, bound[format]);
            texture_file_free(&file);
            envmap_free(&map);
        }
}

static void ktx2_files_hold_the_map(void) { check_container(write_ktx2, texture_ktx2, "a.ktx2"); }
static void ktx1_files_hold_the_map(void) { check_container(write_ktx1, texture_ktx1, "a.ktx"); }
static void dds_files_hold_the_map(void) { check_container(write_dds, texture_dds, "a.dds"); }

static void paraboloids_and_slices_are_refused(void) {
    envmap map = a_map(ENVMAP_PARABOLOID, 4, 1), slices = {0};
    texture t = {0};
    CHECK(!envmap_create(&slices, ENVMAP_CUBE, 4, 1, 2));
    empty_folder();
    for (int k = 0; k < 2; ++k) {
        t.map = k ? &slices : &map;
        CHECK(write_ktx2(&t, in_folder("p")) == EINVAL && write_ktx1(&t, path) == EINVAL);
        CHECK(write_dds(&t, path) == EINVAL);
    }
    CHECK(files_in_folder() == 0);
    envmap_free(&map), envmap_free(&slices);
}

/* What a sampler that knows of no folds and clamps sees at (u,v) of a file's level. */
static void bilinear(double rgb[3], const texture_file *file, int level, double u, double v) {
    int w = texture_file_width(file, level), h = texture_file_height(file, level);
    double x = u * w - 0.5, y = v * h - 0.5, a = x - floor(x), b = y - floor(y);
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int k = 0; k < 4; ++k) {
        int i = (int)floor(x) + (k & 1), j = (int)floor(y) + (k >> 1);
        double texel[3] = {0, 0, 0}, part = ((k & 1) ? a : 1 - a) * (k > 1 ? b : 1 - b);
        i = i < 0 ? 0 : i < w ? i : w - 1, j = j < 0 ? 0 : j < h ? j : h - 1;
        CHECK(texture_file_texel(texel, file, level, 0, i, j));
        for (int c = 0; c < 3; ++c) rgb[c] += part * texel[c];
    }
}

/* The worst difference of a level with its border from envmap_lookup, relative to the brightest;
   every second place is within a texel of an edge, and some are corners. */
static double worst_of_border(const envmap *map, const texture_file *file, int border, int level) {
    unsigned long long seed = 5;
    double most = 0, worst = 0, edge = 1.0 / (map->size >> level);
    double b = border / (double)(map->size + 2 * border);
    for (int i = 0; i < 4000; ++i) {
        double at[2] = {test_random(&seed), test_random(&seed)}, rgb[3];
        float d[3], want[3], u, v;
        int face;
        if (i % 2) at[i / 2 % 2] = i / 4 % 2 ? 1 - edge * at[i / 2 % 2] : edge * at[i / 2 % 2];
        if (i < 16) at[0] = i & 1, at[1] = i >> 1 & 1;
        envmap_direction(d, ENVMAP_OCTAHEDRAL, 0, (float)at[0], (float)at[1]);
        envmap_lookup(want, map, d, (float)level);
        envmap_coordinates(&face, &u, &v, ENVMAP_OCTAHEDRAL, d);
        bilinear(rgb, file, level, b + (1 - 2 * b) * (double)u, b + (1 - 2 * b) * (double)v);
        for (int c = 0; c < 3; ++c) {
            most = fmax(most, (double)want[c]);
            worst = fmax(worst, fabs(rgb[c] - (double)want[c]));
        }
    }
    return worst / most;
}

static void with_a_border_a_plain_sampler_sees_no_edge(void) {
    static const int shapes[][3] = {{16, 4, 3}, {7, 1, 1}, {12, 12, 3}, {1, 1, 1}};
    for (int s = 0; s < 4; ++s) {
        int size = shapes[s][0], border = shapes[s][1];
        envmap map = a_map(ENVMAP_OCTAHEDRAL, size, envmap_levels(size)), wide = {0};
        CHECK(!border_map(&wide, &map, border));
        CHECK(wide.size == size + 2 * border && wide.levels == shapes[s][2]);
        texture t = {0};
        t.map = &wide, t.format = TEXEL_RGBA32F;
        CHECK(write_ktx2(&t, in_folder("border.ktx2")) == 0);
        texture_file file = texture_ktx2(path);
        CHECK(file.good);
        for (int l = 0; l < wide.levels; ++l)
            FIGURE("octahedral with border: a bilinear sample, of the brightest",
                   worst_of_border(&map, &file, border, l), 1e-6);
        texture_file_free(&file);
        envmap_free(&wide), envmap_free(&map);
    }
    envmap cube = a_map(ENVMAP_CUBE, 4, 1), out = {0};
    CHECK(border_map(&out, &cube, 1) == ENVMAP_ERROR_ARGUMENT && !out.texels);
    envmap_free(&cube);
}

/* Half a unit of 8 bits of the brightest channel. */
static void radiance_files_hold_the_map(void) {
    static const int shapes[][2] = {{ENVMAP_LATLONG, 64},
                                    {ENVMAP_CUBE, 16},
                                    {ENVMAP_CUBE, 7},
                                    {ENVMAP_LATLONG, 4},
                                    {ENVMAP_ANGULAR, 200}};
    for (int s = 0; s < 5; ++s) {
        envmap map = a_map(shapes[s][0], shapes[s][1], 1);
        for (int i = 0; i < 3 * 40 && shapes[s][1] > 9; ++i) map.texels[i] = 0.25f; /* a run */
        texture t = {0};
        t.map = &map;
        CHECK(write_hdr(&t, 0, in_folder("a.hdr")) == 0);
        CHECK(t.saturated == 0);
        texture_file file = texture_hdr(path);
        CHECK(file.good);
        double worst = 0;
        for (int y = 0; y < file.height && file.good; ++y)
            for (int x = 0; x < file.width; ++x) {
                const float *m = map.texels + 3 * (y * file.width + x);
                double rgb[3], most = fmax((double)m[0], fmax((double)m[1], (double)m[2]));
                CHECK(texture_file_texel(rgb, &file, 0, 0, x, y));
                for (int c = 0; c < 3; ++c) worst = fmax(worst, fabs(rgb[c] - (double)m[c]) / most);
            }
        CHECK(file.width * file.height * 3 ==
              map.size * map.size * 3 * envmap_faces(map.mapping) * (s % 3 == 0 ? 2 : 1));
        FIGURE("radiance: worst error of a channel, of the brightest", worst, 1.0 / 255);
        texture_file_free(&file);
        envmap_free(&map);
    }
}

/* A picture that was read from RGBE goes back as the same bytes. */
static void radiance_pixels_come_back_as_they_were(void) {
    unsigned long long seed = 3;
    long saturated = 0;
    for (int i = 0; i < 100000; ++i) {
        unsigned char in[4], out[4];
        float rgb[3];
        int most = 0;
        for (int c = 0; c < 3; ++c)
            in[c] = (unsigned char)(256 * test_random(&seed)), most = in[c] > most ? in[c] : most;
        if (most < 128) in[i % 3] = 200;
        in[3] = (unsigned char)(20 + 210 * test_random(&seed));
        for (int c = 0; c < 3; ++c) rgb[c] = (float)ldexp(in[c], in[3] - 136);
        hdr_pixel(out, rgb, &saturated);
        CHECK(!memcmp(in, out, 4));
    }
    float dark[3] = {0, 0, 0}, bad[3] = {-1, of_bits(0x7FC00000), of_bits(0x7F800000)};
    unsigned char out[4];
    hdr_pixel(out, dark, &saturated);
    CHECK(!out[0] && !out[3] && saturated == 0);
    hdr_pixel(out, bad, &saturated);
    CHECK(out[0] == 0 && out[1] == 0 && out[2] == 255 && out[3] == 255 && saturated == 3);
}

static void six_faces_and_pfm_are_what_the_map_holds(void) {
    envmap map = a_map(ENVMAP_CUBE, 9, 1), face = {0}, back = {0};
    for (int f = 0; f < 6; ++f) {
        CHECK(!texture_face(&face, &map, f));
        CHECK(write_pfm(&face, 0, in_folder("face.pfm")) == 0);
        CHECK(!envmap_pfm_load(&back, path, ENVMAP_ANGULAR));
        CHECK(!memcmp(back.texels, envmap_texel(&map, 0, 0, f, 0, 0), 9 * 9 * 3 * sizeof(float)));
        envmap_free(&face), envmap_free(&back);
    }
    envmap_free(&map);
}

/* ----------------------------------------------------------------------------------- files -- */

/* Files may grow to 4096 bytes only: what a full disk does, without one. */
static void a_full_disk_leaves_nothing(void) {
    struct rlimit before, small;
    envmap map = a_map(ENVMAP_CUBE, 32, 6);
    texture t = {0};
    picture p;
    int status[5];
    t.map = &map;
    CHECK(picture_create(&p, 200, 200));
    for (int i = 0; i < 200 * 200 * 3; ++i) p.rgb[i] = (unsigned char)(i % 251 * (i % 241) >> 3);
    empty_folder();
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before);
    small = before, small.rlim_cur = 4096;
    setrlimit(RLIMIT_FSIZE, &small);
    status[0] = write_ktx2(&t, in_folder("full.ktx2"));
    status[1] = write_ktx1(&t, in_folder("full.ktx"));
    status[2] = write_dds(&t, in_folder("full.dds"));
    status[3] = write_pfm(&map, 0, in_folder("full.pfm"));
    status[4] = write_png(&p, in_folder("full.png"));
    setrlimit(RLIMIT_FSIZE, &before);
    for (int k = 0; k < 5; ++k) CHECK(status[k] == EFBIG);
    CHECK(files_in_folder() == 0);
    picture_free(&p);
    envmap_free(&map);
}

static void what_was_there_stays_until_the_new_file_is_whole(void) {
    write_file w;
    char text[8] = {0};
    empty_folder();
    FILE *old = fopen(in_folder("kept"), "w");
    fputs("old", old), fclose(old);
    CHECK(write_open(&w, path));
    write_text(&w, "new");
    w.error = EIO; /* as if the disk had failed */
    CHECK(write_close(&w) == EIO);
    old = fopen(path, "r");
    CHECK(old && fgets(text, sizeof text, old) && !strcmp(text, "old"));
    fclose(old);
    CHECK(write_open(&w, path));
    write_text(&w, "new");
    CHECK(write_close(&w) == 0);
    old = fopen(path, "r");
    CHECK(old && fgets(text, sizeof text, old) && !strcmp(text, "new"));
    fclose(old);
    CHECK(files_in_folder() == 1);
}

static void links_and_devices_are_not_removed(void) {
    struct stat about;
    write_file w;
    char link[512];
    empty_folder();
    snprintf(link, sizeof link, "%s", in_folder("link"));
    CHECK(!symlink("/dev/full", link));
    CHECK(write_open(&w, link));
    for (int i = 0; i < 100000; ++i) write_little(&w, 0, 8);
    CHECK(write_close(&w) == ENOSPC);
    CHECK(!lstat(link, &about) && S_ISLNK(about.st_mode));
    CHECK(!stat("/dev/full", &about) && S_ISCHR(about.st_mode));
    unlink(link);
    FILE *target = fopen(in_folder("target"), "w");
    fclose(target);
    CHECK(!symlink("target", link)); /* a link stays a link, its file is replaced */
    CHECK(write_open(&w, link));
    write_text(&w, "through");
    CHECK(write_close(&w) == 0);
    CHECK(!lstat(link, &about) && S_ISLNK(about.st_mode));
    CHECK(!stat(in_folder("target"), &about) && about.st_size == 7);
    CHECK(files_in_folder() == 2);
}

/* Through a link, so that a fault cannot take the device away from whoever runs this as root. */
static void a_picture_on_a_full_device_removes_no_link(void) {
    struct stat about;
    char link[512];
    picture p;
    empty_folder();
    CHECK(picture_create(&p, 300, 300));
    for (int i = 0; i < 300 * 300 * 3; ++i) p.rgb[i] = (unsigned char)(i % 251 * (i % 241) >> 3);
    snprintf(link, sizeof link, "%s", in_folder("link.png"));
    CHECK(!symlink("/dev/full", link));
    CHECK(!picture_save(&p, link) && write_png(&p, link) == ENOSPC);
    CHECK(!lstat(link, &about) && S_ISLNK(about.st_mode));
    CHECK(!stat("/dev/full", &about) && S_ISCHR(about.st_mode));
    CHECK(!picture_save(&p, in_folder("none/at.png")) && picture_save(&p, in_folder("a.png")));
    CHECK(files_in_folder() == 2);
    picture_free(&p);
}

static void a_folder_that_is_not_there_is_an_error_in_words(void) {
    envmap map = a_map(ENVMAP_CUBE, 2, 1);
    texture t = {0};
    t.map = &map;
    CHECK(write_ktx2(&t, "/nowhere/at/all.ktx2") == ENOENT);
    CHECK(write_hdr(&t, 0, "/nowhere/at/all.hdr") == ENOENT);
    envmap_free(&map);
}

/* -------------------------------------------------------------------------- other readers -- */

static int runs(const char *command) { return system(command) == 0; }

/* ktx-parse reads every format as we meant it: its numbers of the header, and its levels' bytes. */
static void ktx_parse_reads_them(void) {
    char command[1024];
    envmap map = a_map(ENVMAP_CUBE, 16, 5);
    texture t = {0};
    t.map = &map;
    CHECK(1);
    snprintf(command, sizeof command, "node tests/read_ktx2.mjs >/dev/null 2>&1");
    if (!runs(command)) {
        printf(
            "    ktx-parse passed by: it or node is not here (npm install --prefix build/npm "
            "ktx-parse@2.0.0)\n");
        envmap_free(&map);
        return;
    }
    for (t.format = 0; t.format < 4; ++t.format) {
        CHECK(write_ktx2(&t, in_folder("parse.ktx2")) == 0);
        snprintf(command, sizeof command, "node tests/read_ktx2.mjs %s %s 16 5 6", path,
                 texel_format_name[t.format]);
        CHECK(runs(command));
    }
    envmap_free(&map);
}

/* oiiotool brings our .hdr into floats and back into .hdr: the same RGBE. And it reads our PNG. */
static void oiiotool_reads_them(void) {
    char command[4096], hdr[512], tif[512];
    envmap map = a_map(ENVMAP_LATLONG, 32, 1);
    texture t = {0};
    picture p;
    t.map = &map;
    CHECK(1);
    if (!runs("oiiotool --version >/dev/null 2>&1")) {
        printf("    passed by: oiiotool is not here (Debian: openimageio-tools)\n");
        envmap_free(&map);
        return;
    }
    snprintf(hdr, sizeof hdr, "%s", in_folder("a.hdr"));
    CHECK(write_hdr(&t, 0, hdr) == 0);
    snprintf(tif, sizeof tif, "%s", in_folder("a.tif"));
    snprintf(command, sizeof command,
             "oiiotool %s -d float -o %s >/dev/null && oiiotool %s -o %s/b.hdr", hdr, tif, tif,
             folder);
    CHECK(runs(command));
    texture_file ours = texture_hdr(hdr), theirs = texture_hdr(in_folder("b.hdr"));
    CHECK(ours.good && theirs.good && ours.size == theirs.size &&
          !memcmp(ours.data, theirs.data, ours.size));
    texture_file_free(&ours), texture_file_free(&theirs);
    CHECK(picture_create(&p, 33, 21));
    for (int i = 0; i < 33 * 21 * 3; ++i) p.rgb[i] = (unsigned char)(i * 7);
    CHECK(write_png(&p, in_folder("a.png")) == 0);
    snprintf(command, sizeof command,
             "oiiotool --info -v %s | grep -q '33 x   21, 3 channel, uint8'", path);
    CHECK(runs(command));
    picture_free(&p);
    envmap_free(&map);
}

int main(void) {
    if (!mkdtemp(folder)) return 1;
    RUN(every_half_is_written_as_itself);
    RUN(halves_round_to_the_nearest_and_to_even);
    RUN(what_is_too_large_is_saturated_and_counted);
    RUN(packed_formats_keep_their_bits);
    RUN(ktx2_files_hold_the_map);
    RUN(ktx1_files_hold_the_map);
    RUN(dds_files_hold_the_map);
    RUN(paraboloids_and_slices_are_refused);
    RUN(with_a_border_a_plain_sampler_sees_no_edge);
    RUN(radiance_files_hold_the_map);
    RUN(radiance_pixels_come_back_as_they_were);
    RUN(six_faces_and_pfm_are_what_the_map_holds);
    RUN(a_full_disk_leaves_nothing);
    RUN(what_was_there_stays_until_the_new_file_is_whole);
    RUN(links_and_devices_are_not_removed);
    RUN(a_picture_on_a_full_device_removes_no_link);
    RUN(a_folder_that_is_not_there_is_an_error_in_words);
    RUN(ktx_parse_reads_them);
    RUN(oiiotool_reads_them);
    empty_folder();
    rmdir(folder);
    return test_summary();
}

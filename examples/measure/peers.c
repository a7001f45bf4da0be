/* SPDX-License-Identifier: MIT
   A GGX chain as most engines bake it, beside this library's: one loop of 1024 samples a texel, on
   the source itself or on a level that fits the sample's share of the sphere. And the tools that
   it is pointed at, each beside this library with that tool's lobes:
       CMGEN=path        Filament's cmgen          CMFT=path    cmft
       IBLSAMPLER=path   Khronos' glTF-IBL-Sampler THREE=path   npm's folder of three.js

   What you will see: time and error of each on two scenes, after some minutes; `peers DOCS` also
   writes the tables to DOCS/peers.md. Errors are against the exact sum of the same lobe over all
   texels. Source and results pass as files of floats; glTF-IBL-Sampler reads Radiance pictures.
   Run it from the top of the project: three.js runs in a browser, by tests/three/pmrem.py.
       cc -O3 -march=native -I. examples/measure/peers.c -o peers -lm -lpthread */
#define _POSIX_C_SOURCE 200809L
#define _DEFAULT_SOURCE /* realpath, for write_file.h */
#include "measure.h"
#include "../tool/scenes.h"
#include "../tool/threads.h"
#include "../tool/write_file.h"
#include "../tool/write_texels.h"
#include "../tool/write_dds.h"
#include "../tool/write_hdr.h"
#include <sys/times.h>

enum { SIZE = 128, LEVELS = 6, SAMPLES = 1024 };
enum { OURS, FILTERED, PLAIN, WAYS };
static const char *const names[WAYS] = {"`envmap_filter_chain`, tolerance 1e-3",
                                        "1024 samples, each on the level that fits it",
                                        "1024 samples of the source itself"};

static double roughness(int level) { return envmap_level_roughness(level, LEVELS, 0); }

/* Van der Corput's second coordinate of Hammersley's points. */
static double radical(unsigned i) {
    double sum = 0, part = 0.5;
    for (; i; i >>= 1, part /= 2) sum += part * (double)(i & 1);
    return sum;
}

/* Sample i about n: its direction and n.l; returns the level whose texels are as large as the
   sample's share of the sphere. h is drawn from D(h) (n.h); with n = v the density of l is D/4. */
static double sample(float l[3], double *nl, int i, double alpha, double omega, const double n[3],
                     const double t[3], const double b[3]) {
    double u = (i + 0.5) / SAMPLES, phi = 2 * MEASURE_PI * radical((unsigned)i), aa = alpha * alpha;
    double c = sqrt((1 - u) / (1 + (aa - 1) * u)), s = sqrt(1 - c * c), q = (aa - 1) * c * c + 1;
    double density = aa / (MEASURE_PI * q * q) / 4;
    *nl = 2 * c * c - 1;
    for (int k = 0; k < 3; ++k) {
        double h = s * cos(phi) * t[k] + s * sin(phi) * b[k] + c * n[k];
        l[k] = (float)(2 * c * h - n[k]);
    }
    return 0.5 * log2(fmax(1 / (SAMPLES * density * omega), 1));
}

static void sampled_texel(float rgb[3], const envmap *src, const double n[3], double alpha,
                          int filtered) {
    double t[3] = {0, 0, 0}, b[3], sum[3] = {0, 0, 0}, weight = 0;
    double omega = 4 * MEASURE_PI / (6.0 * SIZE * SIZE);
    t[fabs(n[1]) < 0.9] = 1;
    double along = measure_dot(t, n);
    for (int k = 0; k < 3; ++k) t[k] -= along * n[k];
    measure_unit(t, t);
    for (int k = 0; k < 3; ++k)
        b[k] = n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3];
    for (int i = 0; i < SAMPLES; ++i) {
        float l[3], L[3];
        double nl, level = sample(l, &nl, i, alpha, omega, n, t, b);
        if (nl <= 0) continue;
        envmap_lookup(L, src, l, filtered ? (float)level : 0);
        for (int k = 0; k < 3; ++k) sum[k] += nl * (double)L[k];
        weight += nl;
    }
    for (int k = 0; k < 3; ++k) rgb[k] = (float)(sum[k] / weight);
}

static void sampled_chain(envmap *dst, envmap *src, int filtered) {
    if (filtered) measure_must(envmap_mips_build(src), "levels");
    measure_must(envmap_resample(dst, src, NULL), "mirror");
    for (int level = 1; level < LEVELS; ++level) {
        double r = roughness(level);
        for (int i = 0; i < 6 * (SIZE >> level) * (SIZE >> level); ++i) {
            int edge = SIZE >> level, face = i / (edge * edge), y = i / edge % edge, x = i % edge;
            double n[3];
            measure_direction(n, dst, level, face, x, y);
            sampled_texel(envmap_texel(dst, level, 0, face, x, y), src, n, r * r, filtered);
        }
    }
}

/* -------------------------------------------------------------------------------- others' tools */

static void must_run(const char *command) {
    int status = system(command);
    if (!status) return;
    fprintf(stderr, "%s\nended with %d\n", command, status);
    exit(2);
}

/* Seconds of all processes that have ended, theirs and their threads'. */
static double seconds_of_others(void) {
    struct tms t;
    times(&t);
    return (double)(t.tms_cutime + t.tms_cstime) / (double)sysconf(_SC_CLK_TCK);
}

static float big_endian(const unsigned char *b) {
    uint32_t bits = (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | b[3];
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The last `bytes` of a file: texels stand at the end of PSD and DDS. */
static unsigned char *tail_of(const char *path, size_t bytes) {
    FILE *file = fopen(path, "rb");
    unsigned char *data = (unsigned char *)malloc(bytes);
    if (!file || !data || fseek(file, -(long)bytes, SEEK_END) ||
        fread(data, 1, bytes, file) != bytes)
        measure_must(ENVMAP_ERROR_FILE, path);
    fclose(file);
    return data;
}

static void write_big(FILE *file, uint32_t value, int bytes) {
    while (bytes-- > 0) fputc((int)(value >> 8 * bytes & 255), file);
}

/* Level 0 as a lying cross in a Photoshop file of 32-bit floats, channel after channel. */
static void write_psd_cross(const envmap *map, const char *path) {
    static const int column[6] = {2, 0, 1, 1, 1, 3}, row[6] = {1, 1, 0, 2, 1, 1};
    int n = map->size;
    size_t plane = (size_t)(4 * n) * (size_t)(3 * n);
    float *cross = (float *)calloc(3 * plane, sizeof *cross);
    FILE *file = fopen(path, "wb");
    if (!file || !cross) measure_must(ENVMAP_ERROR_FILE, path);
    for (int i = 0; i < 6 * n * n; ++i) {
        int face = i / (n * n), y = i / n % n, x = i % n;
        size_t at = (size_t)(row[face] * n + y) * (size_t)(4 * n) + (size_t)(column[face] * n + x);
        for (size_t c = 0; c < 3; ++c)
            cross[c * plane + at] = envmap_texel(map, 0, 0, face, x, y)[c];
    }
    fputs("8BPS", file), write_big(file, 1, 2), write_big(file, 0, 6), write_big(file, 3, 2);
    write_big(file, (uint32_t)(3 * n), 4), write_big(file, (uint32_t)(4 * n), 4);
    write_big(file, 32, 2), write_big(file, 3, 2); /* bits, RGB */
    write_big(file, 0, 4), write_big(file, 0, 4), write_big(file, 0, 4), write_big(file, 0, 2);
    for (size_t i = 0; i < 3 * plane; ++i) {
        uint32_t bits;
        memcpy(&bits, cross + i, sizeof bits);
        write_big(file, bits, 4);
    }
    fclose(file), free(cross);
}

static void read_psd_face(envmap *dst, int level, int face, const char *path) {
    size_t plane = (size_t)(dst->size >> level) * (size_t)(dst->size >> level);
    unsigned char *data = tail_of(path, 12 * plane);
    float *out = envmap_texel(dst, level, 0, face, 0, 0);
    for (size_t i = 0; i < 3 * plane; ++i)
        out[i % plane * 3 + i / plane] = big_endian(data + 4 * i);
    free(data);
}

/* Filament maps level l of n to the roughness 1 - sqrt(1 - l/(n-1)); its lobe is GGX, n = v = r. */
static envmap_lobe cmgen_lobe(int level) {
    double r = 1 - sqrt(1 - level / (LEVELS - 1.0));
    return envmap_lobe_ggx((float)(r * r));
}

static double cmgen_chain(envmap *dst, const envmap *src, const char *tool, const char *folder) {
    static const char *const face_name[6] = {"px", "nx", "py", "ny", "pz", "nz"};
    char text[8192];
    snprintf(text, sizeof text, "%s/sky.psd", folder);
    write_psd_cross(src, text);
    snprintf(text, sizeof text,
             "'%s' -q -f psd -c 32 --no-mirror -s %d --ibl-min-lod-size=%d --ibl-ld='%s/out' "
             "'%s/sky.psd' >/dev/null",
             tool, SIZE, SIZE >> (LEVELS - 1), folder, folder);
    must_run(text);
    for (int i = 0; i < 6 * LEVELS; ++i) {
        snprintf(text, sizeof text, "%s/out/sky/m%d_%s.psd", folder, i / 6, face_name[i % 6]);
        read_psd_face(dst, i / 6, i % 6, text);
    }
    return 0;
}

/* cmft maps level l of n to the exponent 2^(scale (1 - l/(n-1)) + bias), here 10 and 1. */
static envmap_lobe cmft_lobe(int level) {
    if (level == 0) return envmap_lobe_mirror();
    return envmap_lobe_phong((float)pow(2, 10 * (1 - level / (LEVELS - 1.0)) + 1));
}

static double cmft_chain(envmap *dst, const envmap *src, const char *tool, const char *folder) {
    envmap level0 = measure_map(ENVMAP_CUBE, SIZE, 1, 1);
    texture t = {0};
    char text[8192];
    memcpy(level0.texels, src->texels, measure_bytes(src, 1));
    t.map = &level0, t.format = TEXEL_RGBA32F;
    snprintf(text, sizeof text, "%s/sky.dds", folder);
    if (write_dds(&t, text)) measure_must(ENVMAP_ERROR_FILE, text);
    envmap_free(&level0);
    snprintf(text, sizeof text,
             "'%s' --input '%s/sky.dds' --filter radiance --srcFaceSize 0 --dstFaceSize %d "
             "--excludeBase true --mipCount %d --glossScale 10 --glossBias 1 --lightingModel phong "
             "--edgeFixup none --numCpuProcessingThreads 1 --useOpenCL false --outputNum 1 "
             "--output0 '%s/out' --output0params dds,rgba32f,cubemap --silent >/dev/null",
             tool, folder, SIZE, LEVELS, folder);
    must_run(text);
    size_t texels = measure_bytes(dst, LEVELS) / (3 * sizeof(float));
    snprintf(text, sizeof text, "%s/out.dds", folder);
    unsigned char *data = tail_of(text, 16 * texels), *at = data;
    for (int i = 0; i < 6 * LEVELS; ++i) {
        int face = i / LEVELS, level = i % LEVELS, edge = SIZE >> level;
        for (int k = 0; k < edge * edge; ++k, at += 16)
            memcpy(envmap_texel(dst, level, 0, face, k % edge, k / edge), at, 3 * sizeof(float));
    }
    free(data);
    return 0;
}

static envmap_lobe engine_lobe(int level) {
    return envmap_lobe_ggx((float)(roughness(level) * roughness(level)));
}

/* The panorama's middle column looks along +x there, along -z here: a quarter of the columns. */
static void write_turned(const envmap *src, const char *path) {
    envmap turned = measure_map(ENVMAP_LATLONG, src->size, 1, 1);
    texture t = {0};
    int width = 2 * src->size;
    for (int y = 0; y < src->size; ++y)
        for (int x = 0; x < width; ++x)
            memcpy(envmap_texel(&turned, 0, 0, 0, x, y),
                   envmap_texel(src, 0, 0, 0, (x + width / 4) % width, y), 3 * sizeof(float));
    t.map = &turned;
    if (write_hdr(&t, 0, path)) measure_must(ENVMAP_ERROR_FILE, path);
    envmap_free(&turned);
}

/* KTX2 has the smallest level first, each with its six faces: RGBA floats up to the file's end. */
static double sampler_chain(envmap *dst, const envmap *src, const char *tool, const char *folder) {
    char text[8192];
    snprintf(text, sizeof text, "%s/sky.hdr", folder);
    write_turned(src, text);
    snprintf(text, sizeof text,
             "cd '%s' && '%s' -inputPath sky.hdr -outCubeMap out.ktx2 -outLUT lut.png "
             "-cubeMapResolution %d -mipLevelCount %d -targetFormat R32G32B32A32_SFLOAT >/dev/null",
             folder, tool, SIZE, LEVELS);
    must_run(text);
    snprintf(text, sizeof text, "%s/out.ktx2", folder);
    unsigned char *data = tail_of(text, measure_bytes(dst, LEVELS) / 3 * 4), *at = data;
    for (int level = LEVELS - 1; level >= 0; --level) {
        int edge = SIZE >> level;
        for (int k = 0; k < 6 * edge * edge; ++k, at += 16)
            memcpy(envmap_texel(dst, level, 0, 0, 0, 0) + 3 * k, at, 3 * sizeof(float));
    }
    free(data);
    return 0;
}

/* The browser filters twice; the second time counts, and is measured there. */
static double three_chain(envmap *dst, const envmap *src, const char *tool, const char *folder) {
    char text[8192];
    double seconds = 0;
    size_t bytes = measure_bytes(dst, LEVELS);
    snprintf(text, sizeof text, "%s/sky.f32", folder);
    FILE *file = fopen(text, "wb");
    if (!file || fwrite(src->texels, measure_bytes(src, 1), 1, file) != 1 || fclose(file))
        measure_must(ENVMAP_ERROR_FILE, text);
    snprintf(text, sizeof text, "python3 tests/three/pmrem.py '%s' '%s' >'%s/seconds'", tool,
             folder, folder);
    must_run(text);
    snprintf(text, sizeof text, "%s/seconds", folder);
    file = fopen(text, "r");
    if (!file || fscanf(file, "%lf", &seconds) != 1) measure_must(ENVMAP_ERROR_FILE, text);
    fclose(file);
    snprintf(text, sizeof text, "%s/out.f32", folder);
    unsigned char *data = tail_of(text, bytes);
    memcpy(dst->texels, data, bytes);
    free(data);
    return seconds;
}

/* ----------------------------------------------------------------------------------- measuring */

/* Rows that share source and lobes of their levels, and so the exact sum. */
typedef struct family {
    const char *mark, *tool; /* tool: the variable that says where it is, or NULL */
    envmap_lobe (*lobe)(int level);
    /* Returns the seconds of the filter, or 0: then all that the processes took counts. */
    double (*chain)(envmap *dst, const envmap *src, const char *tool, const char *folder);
    const char *name, *levels;
    int edge, panorama; /* faces of the result; 1: the source is a lat-long map */
    float scale;        /* of the source: halves end at 65504, below the sun */
    int first;          /* the finest level that is compared: exact sums of large ones take long */
} family;

static const family families[] = {
    {"table", NULL, engine_lobe, NULL, NULL, "GGX, roughness 0.2, 0.4, 0.6, 0.8, 1", SIZE, 0, 1, 1},
    {"cmgen", "CMGEN", cmgen_lobe, cmgen_chain, "cmgen, 1024 samples and more on lower levels",
     "GGX, roughness 0.106, 0.225, 0.368, 0.553, 1", SIZE, 0, 1, 1},
    {"cmft", "CMFT", cmft_lobe, cmft_chain, "cmft, every texel within the lobe's reach",
     "Phong, exponent 512, 128, 32, 8, 2", SIZE, 0, 1, 1},
    {"iblsampler", "IBLSAMPLER", engine_lobe, sampler_chain, "glTF-IBL-Sampler, 1024 samples",
     "GGX, roughness 0.2, 0.4, 0.6, 0.8, 1", SIZE, 1, 1, 1},
    {"three", "THREE", cmgen_lobe, three_chain, "three.js, 256 samples or a source of 6 x 16²",
     "GGX, roughness 0.225, 0.368, 0.553, 1", 256, 0, 0.25f, 2},
};

/* Levels before `first` are mirrors. */
static void chain_of(envmap *dst, const envmap *src, const family *f, int first,
                     const envmap_filter_desc *desc) {
    envmap_lobe lobes[LEVELS];
    for (int l = 0; l < LEVELS; ++l) lobes[l] = l < first ? envmap_lobe_mirror() : f->lobe(l);
    measure_must(envmap_filter_chain(dst, src, lobes, LEVELS, desc), "chain");
}

static double theirs(envmap *dst, const envmap *src, const family *f) {
    char folder[] = "/tmp/peers-XXXXXX", text[64];
    double begun = seconds_of_others(), seconds;
    if (!mkdtemp(folder)) measure_must(ENVMAP_ERROR_FILE, folder);
    seconds = f->chain(dst, src, getenv(f->tool), folder);
    if (seconds <= 0) seconds = seconds_of_others() - begun;
    snprintf(text, sizeof text, "rm -r '%s'", folder);
    must_run(text);
    return seconds;
}

/* One way on one scene: seconds, and the errors of the levels after the mirror. */
static void measure_way(FILE *out, const char *scene, envmap *src, const envmap *truth,
                        const family *f, int way) {
    envmap dst = measure_map(ENVMAP_CUBE, f->edge, LEVELS, 1);
    envmap_filter_desc desc = {0};
    double begun = measure_seconds(), seconds = 0, worst = 0;
    if (way == OURS) chain_of(&dst, src, f, 0, &desc);
    else if (f->chain) seconds = theirs(&dst, src, f);
    else sampled_chain(&dst, src, way == FILTERED);
    if (!f->chain || way == OURS) seconds = measure_seconds() - begun;
    const char *name = way && f->chain ? f->name : names[way];
    fprintf(out, "| %s | %s | %.0f |", scene, name, 1e3 * seconds);
    for (int level = f->first; level < LEVELS; ++level) {
        envmap_difference d;
        measure_must(envmap_compare(&d, &dst, truth, level), "compare");
        fprintf(out, level > f->first ? ", %.2g" : " %.2g", d.rms);
        worst = fmax(worst, d.worst);
    }
    fprintf(out, " | %.2g |\n", worst);
    envmap_free(&dst);
}

/* The scene as the family reads it. What Radiance pictures hold has 8 bits a channel and one
   exponent; so has the panorama here, for all. */
static void source_of(envmap *src, const family *f, int scene) {
    envmap wide = measure_map(ENVMAP_LATLONG, 2 * f->edge, 1, 1);
    unsigned char rgbe[4];
    long saturated = 0;
    scene_fill(&wide, scene);
    for (int i = 0; i < 6 * wide.size * wide.size; ++i) wide.texels[i] *= f->scale;
    if (!f->panorama) {
        *src = measure_map(ENVMAP_CUBE, f->edge, envmap_levels(f->edge), 1);
        measure_must(envmap_resample(src, &wide, NULL), "source");
        envmap_free(&wide);
        return;
    }
    for (int i = 0; i < 2 * wide.size * wide.size; ++i) {
        float *rgb = wide.texels + 3 * i;
        hdr_pixel(rgbe, rgb, &saturated);
        for (int c = 0; c < 3; ++c) rgb[c] = ldexpf(rgbe[c], rgbe[3] - 136);
    }
    *src = wide;
}

static void measure_family(FILE *out, const family *f, envmap_filter_desc *exact) {
    static const int scenes[2] = {SCENE_STUDIO, SCENE_SUN};
    char cpu[64];
    measure_processor(cpu, sizeof cpu);
    fprintf(out,
            "Time of the processor, %s, %s; source %d x %d², result 6 x %d² ... "
            "%d².\nLevels %d ... 5: %s.\n\n"
            "| scene | way | ms | rms of levels %d ... 5 | worst texel of all |\n"
            "|---|---|--:|---|--:|\n",
            cpu, MEASURE_COMPILER, f->panorama ? 2 : 6, f->panorama ? 2 * f->edge : f->edge,
            f->edge, f->edge >> (LEVELS - 1), f->first, f->levels, f->first);
    for (int s = 0; s < 2; ++s) {
        envmap src, truth = measure_map(ENVMAP_CUBE, f->edge, LEVELS, 1);
        source_of(&src, f, scenes[s]);
        chain_of(&truth, &src, f, f->first, exact);
        for (int way = 0; way < (f->chain ? 2 : WAYS); ++way)
            measure_way(out, scene_name[scenes[s]], &src, &truth, f, way);
        envmap_free(&src), envmap_free(&truth);
    }
}

int main(int argc, char **argv) {
    static measure_document document;
    static threads_pool threads;
    envmap_filter_desc exact = {0};
    threads_begin(&threads, threads_here());
    exact.method = ENVMAP_METHOD_REFERENCE;
    exact.work.executor.run = threads_run, exact.work.executor.user = &threads;
    for (int i = 0; i < COUNT(families); ++i) {
        const family *f = &families[i];
        const char *path = f->tool ? getenv(f->tool) : "here";
        if (!path || !*path) {
            printf("%s passed by: %s=path says where it is\n", f->mark, f->tool);
            continue;
        }
        FILE *out = measure_begin(&document, f->mark);
        measure_family(out, f, &exact);
        measure_end(&document, out, 1);
    }
    if (argc > 1) {
        char path[4096];
        snprintf(path, sizeof path, "%s/peers.md", argv[1]);
        measure_write(&document, path, "make peers");
    }
    measure_document_free(&document);
    threads_end(&threads);
    return 0;
}

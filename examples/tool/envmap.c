/* envmap.c - the command-line tool: looks at, converts, filters and compares float environment
   maps.

   What you will see: `envmap demo DIR` writes three environments, the maps filtered from them, and
   contact-sheet.png to look at; `envmap --help` lists the other commands. Build with
       cc -O3 -std=c99 -I. examples/tool/envmap.c -o envmap -lm -lpthread
   Exit status: 0 done, 1 wrong use, 2 a file or its format, 3 a value out of range or a filter that
   was refused.

   >>errors     what was wrong, where, what to do
   >>options    one table: parsing, ranges and help come from it
   >>progress   a bar, or a few lines where nobody watches
   >>files      maps from and to PFM and PNG
   >>commands   info convert mips plan filter sh compare generate demo docs
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "brdfs.h"
#include "picture.h"
#include "scenes.h"
#include "shader.h"
#include "gallery.h"
#include "threads.h"

/* ---------------------------------------------------------------------------------- >>errors -- */

enum { DONE = 0, USAGE_ERROR = 1, FILE_ERROR = 2, RANGE_ERROR = 3 };

static const char *command_name = "envmap"; /* for messages */

/* Prints "envmap filter: where: what" and what to do about it; returns the exit status. */
static int fail(int status, const char *where, const char *what, const char *remedy) {
    fprintf(stderr, "envmap %s: %s: %s\n", command_name, where, what);
    if (remedy) fprintf(stderr, "  %s\n", remedy);
    return status;
}

static int status_of(envmap_result result) {
    switch (result) {
    case ENVMAP_OK: return DONE;
    case ENVMAP_ERROR_FILE:
    case ENVMAP_ERROR_FORMAT:
    case ENVMAP_ERROR_SHAPE:
    case ENVMAP_ERROR_TRUNCATED:
    case ENVMAP_ERROR_TRAILING: return FILE_ERROR;
    default: return RANGE_ERROR;
    }
}

static const char *remedy_for(envmap_result result) {
    switch (result) {
    case ENVMAP_ERROR_FILE: return "see that the path exists and may be read or written";
    case ENVMAP_ERROR_FORMAT:
        return "only float PFM files are read: 'PF' or 'Pf', size, scale, data";
    case ENVMAP_ERROR_SHAPE:
        return "name its parameterization: "
               "--mapping cube|paraboloid|sphere|latlong|angular|octahedral";
    case ENVMAP_ERROR_TRUNCATED:
    case ENVMAP_ERROR_TRAILING: return "the file seems damaged; export or copy it again";
    case ENVMAP_ERROR_RADIANCE: return "`envmap info` counts NaN, infinite and negative samples";
    case ENVMAP_ERROR_LOBE: return "`envmap filter --help` lists the ranges of lobe parameters";
    case ENVMAP_ERROR_METHOD: return "--method reference filters with every lobe";
    case ENVMAP_ERROR_MEMORY:
    case ENVMAP_ERROR_LIMIT: return "ask for a smaller --size or fewer --slices";
    default: return NULL;
    }
}

/* 0 for OK; else says what happened at `where`. */
static int check(envmap_result result, const char *where) {
    if (!result) return DONE;
    return fail(status_of(result), where, envmap_result_text(result), remedy_for(result));
}

/* --------------------------------------------------------------------------------- >>options -- */

typedef struct options {
    const char *files[2];
    int file_count;
    int mapping, to, size, slices, lobe, method, threads; /* mapping, to, size: -1 if not given */
    double exponent, sharpness, alpha, s, scale, tolerance, threshold, exposure;
    int raw, glsl, window, progress, help;
} options;

static const options defaults = {{NULL, NULL}, 0,   -1, -1, -1, 1, 0, 0, 0, 100, 100,
                                 0.25,         0.9, 1,  0,  0,  0, 0, 0, 0, 0,   0};

static const char *const mapping_words[] = {"cube",    "paraboloid", "sphere", "latlong",
                                            "angular", "octahedral", NULL};
static const char *const lobe_words[] = {"mirror", "diffuse", "phong", "gaussian",
                                         "ggx",    "banks",   NULL};
static const char *const method_words[] = {"auto", "reference", "hierarchical",
                                           "fast", "harmonics", NULL};
enum { LOBE_MIRROR, LOBE_DIFFUSE, LOBE_PHONG, LOBE_GAUSSIAN, LOBE_GGX, LOBE_BANKS };

typedef enum option_kind { FLAG, INTEGER, NUMBER, WORD } option_kind;
typedef struct option_spec {
    const char *name;
    option_kind kind;
    size_t offset;            /* of an int, or of a double for NUMBER, in struct options */
    double low, high;         /* allowed range, both included */
    const char *const *words; /* for WORD */
    const char *help;
} option_spec;

#define AT(field) offsetof(options, field)
static const option_spec option_table[] = {
    {"--mapping", WORD, AT(mapping), 0, 0, mapping_words,
     "parameterization of the input (default: by its shape)"},
    {"--from", WORD, AT(mapping), 0, 0, mapping_words, "the same"},
    {"--to", WORD, AT(to), 0, 0, mapping_words, "parameterization of the output"},
    {"--size", INTEGER, AT(size), 1, 16384, NULL, "face edge in texels (lat-long: its height)"},
    {"--slices", INTEGER, AT(slices), 1, 4096, NULL,
     "slices of the third dimension (default 1; banks 16)"},
    {"--lobe", WORD, AT(lobe), 0, 0, lobe_words, "which lobe (default mirror)"},
    {"--exponent", NUMBER, AT(exponent), 0, 1e9, NULL, "N of phong (default 100)"},
    {"--sharpness", NUMBER, AT(sharpness), 0, 1e9, NULL, "lambda of gaussian (default 100)"},
    {"--alpha", NUMBER, AT(alpha), 1e-4, 1, NULL, "alpha of ggx, roughness squared (default 0.25)"},
    {"--s", NUMBER, AT(s), 0, 0.99999, NULL, "s of banks (default 0.9)"},
    {"--raw", FLAG, AT(raw), 0, 0, NULL, "the papers' sums instead of normalised ones"},
    {"--scale", NUMBER, AT(scale), 0, 1e9, NULL, "k_s or k_d with --raw (default 1)"},
    {"--method", WORD, AT(method), 0, 0, method_words, "how (default auto)"},
    {"--tolerance", NUMBER, AT(tolerance), 0, 1, NULL,
     "relative rms error allowed (default 0: 1e-3)"},
    {"--threshold", NUMBER, AT(threshold), -1, 1, NULL, "of method hierarchical (default 0: 1e-3)"},
    {"--glsl", FLAG, AT(glsl), 0, 0, NULL, "print GLSL that evaluates them"},
    {"--window", FLAG, AT(window), 0, 0, NULL, "window them, if need be, against negative light"},
    {"--threads", INTEGER, AT(threads), 1, THREADS_MOST, NULL, "default: one per processor"},
    {"--exposure", NUMBER, AT(exposure), -40, 40, NULL,
     "of a PNG, in stops above the automatic one"},
    {"--progress", FLAG, AT(progress), 0, 0, NULL,
     "a progress bar also where stderr is no terminal"},
    {"--help", FLAG, AT(help), 0, 0, NULL, "this text"}};
enum { OPTION_COUNT = sizeof option_table / sizeof option_table[0] };

typedef struct command {
    const char *name, *files; /* files: names of the operands */
    int file_count;
    const char *takes; /* names of its options, each followed by a blank; --help is always one */
    const char *what, *example;
    int (*run)(const options *o);
} command;

/* Strict: the whole argument is one finite number, without blanks before it. */
static int parse_number(double *value, const char *text) {
    char *end;
    if (!*text || isspace((unsigned char)*text)) return 0;
    *value = strtod(text, &end);
    return !*end && isfinite(*value);
}

static int parse_word(int *index, const char *const *words, const char *text) {
    for (*index = 0; words[*index]; ++*index)
        if (!strcmp(words[*index], text)) return 1;
    return 0;
}

static void list_words(char *out, size_t room, const char *const *words) {
    size_t used = 0;
    *out = 0;
    for (; *words && used < room; words++)
        used += (size_t)snprintf(out + used, room - used, "%s%s", used ? "|" : "", *words);
}

static int store_number(options *o, const option_spec *option, const char *text) {
    char *field = (char *)o + option->offset, remedy[96];
    double value;
    int whole;
    snprintf(remedy, sizeof remedy, "%s takes %s from %g to %g", option->name,
             option->kind == INTEGER ? "a whole number" : "a number", option->low, option->high);
    if (!parse_number(&value, text)) return fail(USAGE_ERROR, text, "is not a number", remedy);
    if (option->kind == INTEGER && value != floor(value))
        return fail(USAGE_ERROR, text, "is not a whole number", remedy);
    if (value < option->low || value > option->high)
        return fail(RANGE_ERROR, text, "is out of range", remedy);
    whole = option->kind == INTEGER ? (int)value : 0;
    if (option->kind == INTEGER) memcpy(field, &whole, sizeof whole);
    else memcpy(field, &value, sizeof value);
    return DONE;
}

static int store_option(options *o, const option_spec *option, const char *text) {
    char remedy[96];
    int index;
    if (option->kind == INTEGER || option->kind == NUMBER) return store_number(o, option, text);
    if (!parse_word(&index, option->words, text)) {
        list_words(remedy, sizeof remedy, option->words);
        return fail(USAGE_ERROR, text, "is not one of", remedy);
    }
    memcpy((char *)o + option->offset, &index, sizeof index);
    return DONE;
}

static int command_takes(const command *c, const option_spec *option) {
    char name[32];
    snprintf(name, sizeof name, "%s ", option->name);
    return !strcmp(option->name, "--help") || strstr(c->takes, name) != NULL;
}

static const option_spec *find_option(const command *c, const char *name) {
    int k;
    for (k = 0; k < OPTION_COUNT; k++)
        if (!strcmp(option_table[k].name, name) && command_takes(c, &option_table[k]))
            return &option_table[k];
    return NULL;
}

/* One argument, or an option with its value; *i moves past what was taken. */
static int parse_argument(options *o, const command *c, char **arguments, int *i) {
    const char *text = arguments[(*i)++];
    const option_spec *option;
    int on = 1;
    if (text[0] != '-' || text[1] != '-') {
        if (o->file_count == c->file_count)
            return fail(USAGE_ERROR, text, "is one argument too many", NULL);
        o->files[o->file_count++] = text;
        return DONE;
    }
    option = find_option(c, text);
    if (!option) return fail(USAGE_ERROR, text, "no such option", "add --help for a list");
    if (option->kind == FLAG) {
        memcpy((char *)o + option->offset, &on, sizeof on);
        return DONE;
    }
    if (!arguments[*i]) return fail(USAGE_ERROR, text, "needs a value", "add --help for a list");
    return store_option(o, option, arguments[(*i)++]);
}

static void print_help(const command *c) {
    char words[96];
    int k;
    printf("usage: envmap %s %s [options]\n\n%s\n\n", c->name, c->files, c->what);
    for (k = 0; k < OPTION_COUNT; k++) {
        const option_spec *option = &option_table[k];
        if (!command_takes(c, option)) continue;
        *words = 0;
        if (option->words) list_words(words, sizeof words, option->words);
        printf("  %-12s %s%s%s\n", option->name, option->help, *words ? ": " : "", words);
    }
    printf("\nexample: %s\n", c->example);
}

/* -------------------------------------------------------------------------------- >>progress -- */

typedef struct meter {
    double start, shown; /* seconds */
    int bar, drawn, quarter;
} meter;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static meter meter_start(const options *o) {
    meter m = {0, 0, 0, 0, 0};
    m.start = seconds();
    m.bar = o->progress || isatty(STDERR_FILENO);
    return m;
}

static void meter_bar(meter *m, double fraction, double elapsed) {
    char bar[41];
    int k;
    for (k = 0; k < 40; k++) bar[k] = (double)k < 40 * fraction ? '#' : '.';
    bar[40] = 0;
    fprintf(stderr, "\r[%s] %3.0f %%, %.0f s left ", bar, 100 * fraction,
            elapsed * (1 - fraction) / fmax(fraction, 1e-3));
    m->drawn = 1;
}

/* envmap_progress.report: nothing in the first second, then a bar, or a line per quarter. */
static int meter_report(void *user, float fraction) {
    meter *m = (meter *)user;
    double now = seconds(), elapsed = now - m->start;
    int quarter = (int)(4 * fraction);
    if (elapsed < 1 || fraction <= 0) return 0;
    if (m->bar && now - m->shown > 0.1) {
        meter_bar(m, (double)fraction, elapsed);
        m->shown = now;
    }
    if (!m->bar && quarter > m->quarter)
        fprintf(stderr, "envmap %s: %d %% after %.0f s\n", command_name, 25 * quarter, elapsed);
    if (quarter > m->quarter) m->quarter = quarter;
    return 0;
}

static void meter_stop(const meter *m) {
    if (m->drawn) fprintf(stderr, "\r%70s\r", "");
}

/* The filter's description from the options; `threads` must outlive it. */
static envmap_filter_desc describe(const options *o, int *threads, meter *m) {
    envmap_filter_desc desc = {0};
    *threads = o->threads ? o->threads : threads_here();
    desc.method = o->method;
    desc.tolerance = (float)o->tolerance;
    desc.threshold = (float)o->threshold;
    desc.work.executor.user = threads;
    desc.work.executor.run = threads_run;
    desc.work.progress.user = m;
    desc.work.progress.report = meter_report;
    return desc;
}

/* ----------------------------------------------------------------------------------- >>files -- */

static const envmap no_map = {NULL, NULL, 0, 0, 0, 0, 0, 0};

static int map_width(const envmap *map) {
    return map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size;
}

/* Reads a PFM. Without --mapping its shape tells: 2:1 lat-long, 1:6 cube, 1:2 paraboloids; a square
   could be three things, and a taller strip has slices of who knows what. */
static int load(envmap *map, const char *path, int mapping) {
    static const int guesses[] = {ENVMAP_LATLONG, ENVMAP_CUBE, ENVMAP_PARABOLOID};
    envmap_result result = ENVMAP_ERROR_SHAPE;
    int k;
    *map = no_map;
    if (mapping >= 0) return check(envmap_pfm_load(map, path, mapping), path);
    for (k = 0; k < 3 && result == ENVMAP_ERROR_SHAPE; k++) {
        result = envmap_pfm_load(map, path, guesses[k]);
        if (!result && map->slices > 1) envmap_free(map), result = ENVMAP_ERROR_SHAPE;
    }
    return check(result, path);
}

static int ends_with(const char *text, const char *end) {
    size_t a = strlen(text), b = strlen(end);
    return a >= b && !strcmp(text + a - b, end);
}

/* Refuses a file name before any work is done for it. */
static int check_output(const char *path) {
    if (ends_with(path, ".pfm") || ends_with(path, ".png")) return DONE;
    return fail(USAGE_ERROR, path, "is no name to write to", "end it in .pfm or .png");
}

static unsigned texel_colour(const float texel[3], float exposure) {
    float light[3];
    int c;
    for (c = 0; c < 3; c++) light[c] = picture_curve(exposure * texel[c]);
    return picture_colour(light);
}

/* A pixel per texel, faces below each other as in a PFM. */
static int save_png(const envmap *map, const char *path, double stops) {
    float exposure = picture_exposure(map) * exp2f((float)stops);
    int width = map_width(map), x, y, saved;
    int height = map->size * envmap_faces(map->mapping) * map->slices;
    picture p;
    if (!picture_create(&p, width, height)) return check(ENVMAP_ERROR_MEMORY, path);
    for (y = 0; y < height; y++)
        for (x = 0; x < width; x++) {
            const float *texel = map->texels + 3 * ((size_t)y * (size_t)width + (size_t)x);
            picture_blend(&p, x, y, texel_colour(texel, exposure), 1);
        }
    saved = picture_save(&p, path);
    picture_free(&p);
    return check(saved ? ENVMAP_OK : ENVMAP_ERROR_FILE, path);
}

static int save(const envmap *map, const char *path, double stops) {
    if (ends_with(path, ".png")) return save_png(map, path, stops);
    return check(envmap_pfm_save(map, path, 0), path);
}

/* Creates a folder and those above it; one that exists is fine. */
static int make_folder(const char *path) {
    char part[4096];
    size_t i, length = strlen(path);
    struct stat about;
    if (length >= sizeof part) return fail(FILE_ERROR, path, "the path is too long", NULL);
    for (i = 0; i <= length; i++) {
        part[i] = path[i];
        if (i == 0 || (path[i] && path[i] != '/')) continue;
        part[i] = 0;
        if (mkdir(part, 0777) && errno != EEXIST)
            return fail(FILE_ERROR, part, strerror(errno), "name a folder that can be created");
        part[i] = path[i];
    }
    if (stat(path, &about) || !S_ISDIR(about.st_mode))
        return fail(FILE_ERROR, path, "is not a folder", "name a folder that can be created");
    return DONE;
}

/* -------------------------------------------------------------------------------- >>commands -- */

typedef struct statistics {
    double least, most, mean, share; /* luminance; share: energy of the brightest 0.1 % */
    long nans, infinities, negatives;
} statistics;

typedef struct lit_texel {
    double luminance, omega;
} lit_texel;

static int brighter_first(const void *a, const void *b) {
    double x = ((const lit_texel *)a)->luminance, y = ((const lit_texel *)b)->luminance;
    return x < y ? 1 : x > y ? -1 : 0;
}

/* Rec. 709 luminance, counting what no filter should meet; those samples count as 0. */
static double luminance(const float texel[3], statistics *s) {
    static const double weight[3] = {0.2126, 0.7152, 0.0722};
    double sum = 0;
    int c;
    for (c = 0; c < 3; c++) {
        if (isnan(texel[c])) s->nans++;
        else if (isinf(texel[c])) s->infinities++;
        else sum += weight[c] * (double)texel[c];
        if (texel[c] < 0) s->negatives++;
    }
    return sum;
}

/* The energy of the brightest texels that together fill 0.1 % of the sphere, over all energy. */
static double bright_share(lit_texel *texels, size_t count, double energy) {
    double room = 0.001 * 4 * 3.14159265358979, sum = 0;
    size_t i;
    qsort(texels, count, sizeof *texels, brighter_first);
    for (i = 0; i < count && room > 0; i++) {
        sum += texels[i].luminance * fmin(texels[i].omega, room);
        room -= texels[i].omega;
    }
    return energy > 0 ? sum / energy : 0;
}

/* Over the first slice; texels outside a rim do not count. 0 when out of memory. */
static int measure(statistics *s, const envmap *map) {
    int faces = envmap_faces(map->mapping), width = map_width(map), face, x, y;
    size_t room = (size_t)faces * (size_t)width * (size_t)map->size, count = 0;
    lit_texel *texels = (lit_texel *)malloc(room * sizeof *texels);
    double energy = 0;
    memset(s, 0, sizeof *s);
    s->least = HUGE_VAL;
    for (face = 0; face < faces && texels; face++)
        for (y = 0; y < map->size; y++)
            for (x = 0; x < width; x++) {
                double omega = envmap_solid_angle(map, 0, face, x, y);
                double value = luminance(envmap_texel(map, 0, 0, face, x, y), s);
                if (omega <= 0) continue;
                s->least = fmin(s->least, value), s->most = fmax(s->most, value);
                energy += value * omega;
                texels[count].luminance = value, texels[count++].omega = omega;
            }
    s->mean = energy / (4 * 3.14159265358979);
    if (texels) s->share = bright_share(texels, count, energy);
    free(texels);
    return texels != NULL;
}

static int run_info(const options *o) {
    envmap map;
    statistics s;
    int status = load(&map, o->files[0], o->mapping);
    if (status) return status;
    if (!measure(&s, &map)) return check(ENVMAP_ERROR_MEMORY, o->files[0]);
    printf("%s\n", o->files[0]);
    printf("  shape       %s%s, %d x %d texels, faces %d, slices %d\n", mapping_words[map.mapping],
           o->mapping < 0 ? " (by its proportions)" : "", map_width(&map), map.size,
           envmap_faces(map.mapping), map.slices);
    printf("  luminance   min %.4g, mean %.4g, max %.4g\n", s.least, s.mean, s.most);
    printf("  max/mean    %.4g\n", s.mean > 0 ? s.most / s.mean : 0);
    printf("  brightest   0.1 %% of the sphere holds %.2g %% of the energy\n", 100 * s.share);
    printf("  samples     %ld NaN, %ld infinite, %ld negative\n", s.nans, s.infinities,
           s.negatives);
    envmap_free(&map);
    return DONE;
}

/* An edge that keeps about the source's resolution at the equator, where --size is not given. */
static int natural_size(const envmap *source, int to) {
    double around = source->mapping == ENVMAP_LATLONG ? 2.0 * source->size
                    : source->mapping == ENVMAP_CUBE  ? 4.0 * source->size
                                                      : 2.0 * source->size;
    if (to == source->mapping) return source->size;
    return (int)fmax(1, to == ENVMAP_CUBE ? around / 4 : around / 2);
}

/* dst = an empty map as --to and --size say, else like the source. */
static int create_output(envmap *dst, const envmap *src, const options *o, int levels, int slices) {
    int to = o->to >= 0 ? o->to : src->mapping;
    int size = o->size > 0 ? o->size : natural_size(src, to);
    *dst = no_map;
    return check(envmap_create(dst, to, size, levels ? levels : envmap_levels(size), slices),
                 "output");
}

/* in as the level 0 of out, with progress. */
static int resample(envmap *out, const envmap *in, const options *o) {
    int threads;
    meter m = meter_start(o);
    envmap_filter_desc desc = describe(o, &threads, &m);
    envmap_result result = envmap_resample(out, in, &desc.work);
    meter_stop(&m);
    return check(result, o->files[0]);
}

static int run_convert(const options *o) {
    envmap in, out = no_map;
    int status = check_output(o->files[1]);
    if (!status) status = load(&in, o->files[0], o->mapping);
    if (status) return status;
    status = create_output(&out, &in, o, 1, in.slices);
    if (!status) status = resample(&out, &in, o);
    if (!status) status = save(&out, o->files[1], o->exposure);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

static int save_levels(const envmap *map, const char *prefix) {
    char path[4096];
    int level, status = DONE;
    for (level = 0; level < map->levels && !status; level++) {
        snprintf(path, sizeof path, "%s%d.pfm", prefix, level);
        status = check(envmap_pfm_save(map, path, level), path);
        if (!status) printf("%s\n", path);
    }
    return status;
}

static int run_mips(const options *o) {
    envmap in, out = no_map;
    int status = load(&in, o->files[0], o->mapping);
    if (status) return status;
    status = create_output(&out, &in, o, 0, in.slices);
    if (!status) status = resample(&out, &in, o);
    if (!status) status = check(envmap_mips_build(&out), o->files[0]);
    if (!status) status = save_levels(&out, o->files[1]);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

static envmap_lobe chosen_lobe(const options *o) {
    envmap_lobe lobe = envmap_lobe_mirror();
    switch (o->lobe) {
    case LOBE_DIFFUSE: lobe = envmap_lobe_diffuse(); break;
    case LOBE_PHONG: lobe = envmap_lobe_phong((float)o->exponent); break;
    case LOBE_GAUSSIAN: lobe = envmap_lobe_gaussian((float)o->sharpness); break;
    case LOBE_GGX: lobe = envmap_lobe_ggx((float)o->alpha); break;
    case LOBE_BANKS: lobe = envmap_lobe_banks((float)o->s); break;
    default: break;
    }
    lobe.raw = o->raw;
    lobe.scale = (float)o->scale;
    return lobe;
}

/* What the output needs to be, and the options with the defaults that follow: a cube of the edge
   that loses nothing, or as fine as the source where that is less. */
static int plan_for(envmap_plan *needs, options *asked, const envmap *in, const options *o) {
    envmap shape = no_map;
    envmap_lobe lobe = chosen_lobe(o);
    envmap_filter_desc desc;
    int threads, status;
    *asked = *o;
    if (asked->to < 0) asked->to = ENVMAP_CUBE;
    if (asked->slices == defaults.slices && o->lobe == LOBE_BANKS) asked->slices = 16;
    if (asked->slices == 1 && in->slices > 1) asked->slices = in->slices;
    desc = describe(o, &threads, NULL);
    desc.work.progress.report = NULL;
    shape.mapping = asked->to, shape.levels = 1, shape.slices = asked->slices;
    shape.size = o->size > 0 ? o->size : natural_size(in, asked->to);
    status = check(envmap_filter_plan(needs, &shape, in, &lobe, &desc), lobe_words[o->lobe]);
    if (status || o->size > 0) return status;
    asked->size = needs->size < shape.size ? needs->size : shape.size;
    shape.size = asked->size; /* what that costs, and loses */
    return check(envmap_filter_plan(needs, &shape, in, &lobe, &desc), lobe_words[o->lobe]);
}

static const char *lobe_text(char text[64], const options *o) {
    static const char *const names[] = {NULL, NULL, "N", "lambda", "alpha", "s"};
    double value = o->lobe == LOBE_PHONG      ? o->exponent
                   : o->lobe == LOBE_GAUSSIAN ? o->sharpness
                   : o->lobe == LOBE_GGX      ? o->alpha
                                              : o->s;
    if (names[o->lobe])
        snprintf(text, 64, "%s, %s = %g", lobe_words[o->lobe], names[o->lobe], value);
    else snprintf(text, 64, "%s", lobe_words[o->lobe]);
    return text;
}

static void print_scene(const envmap_plan *n, double tolerance) {
    printf("  scene     filtered, it departs from its mean by %.2g of that (rms): %s contrast\n",
           n->contrast,
           n->contrast < 0.5 ? "low"
           : n->contrast < 2 ? "middling"
                             : "high");
    printf("  bands     %d: harmonics beyond hold less than %.2g of the rms\n", n->bands,
           tolerance);
    if (n->nine <= fmax(tolerance, 0.01))
        printf("            nine numbers do it: error %.1g %% (`envmap sh` prints them)\n",
               100 * n->nine);
    else printf("            nine numbers do not do: error %.2g %%\n", 100 * n->nine);
}

static void print_size(const envmap_plan *n, const options *asked, const options *o,
                       const envmap *in, double tolerance) {
    int natural = natural_size(in, asked->to);
    if (n->method != ENVMAP_METHOD_FAST && n->size >= natural) {
        printf("  size      %d, as fine as the source: the lobe is about as thin as its texels,\n"
               "            or they are few\n",
               natural);
        return;
    }
    printf(
        "  size      %d: the smallest edge of a%s %s that loses less than %.2g between its texels,\n"
        "            looked up bilinearly",
        n->size, strchr("ao", *mapping_words[asked->to]) ? "n" : "", mapping_words[asked->to],
        tolerance);
    if (o->size > 0) printf("; that of %d loses %.2g\n", o->size, n->lookup);
    else if (n->size > natural)
        printf("; %d, as fine as the source, loses %.2g\n", natural, n->lookup);
    else printf("; that of the source would be %d\n", natural);
    if (o->lobe == LOBE_BANKS || asked->slices > 1)
        printf("  slices    %d: the fewest that lose less between two of them; here %d\n",
               n->slices, asked->slices);
}

static void print_method(const envmap_plan *n) {
    static const char *const why[] = {
        "", "there are so few texels, or so sharp a lobe, that the definition is the way", "",
        "through harmonics: the lobe leaves few bands"};
    printf("  method    %s: %s\n", method_words[n->method], why[n->method]);
    if (n->lights)
        printf("            and %d texels that outshine the others are summed one by one\n",
               n->lights);
    printf("  error     %.1g expected, relative rms\n", n->error);
}

/* Seconds that a method takes here on one thread, into a map of that edge; a negative number where
   it cannot. */
static double filter_seconds(const envmap *in, const options *asked, int method, int size) {
    envmap out = no_map;
    envmap_lobe lobe = chosen_lobe(asked);
    envmap_filter_desc desc = {0};
    double t = -1;
    desc.method = method, desc.tolerance = (float)asked->tolerance;
    if (!envmap_create(&out, asked->to, size, 1, asked->slices)) {
        t = seconds();
        t = envmap_filter(&out, in, &lobe, &desc) ? -1 : seconds() - t;
    }
    envmap_free(&out);
    return t;
}

/* It is tried: the reference on a few texels only, for its time goes with their number. */
static void print_time(const envmap_plan *n, const envmap *in, const options *asked) {
    int few = asked->size < 4 ? asked->size : 4;
    double part = (double)few / asked->size;
    double own, reference = filter_seconds(in, asked, ENVMAP_METHOD_REFERENCE, few) / part / part;
    own = n->method == ENVMAP_METHOD_FAST
              ? filter_seconds(in, asked, ENVMAP_METHOD_FAST, asked->size)
              : reference;
    if (own < 0 || reference < 0) return;
    printf("  time      about %.2g %s here on one thread\n", own < 1 ? 1e3 * own : own,
           own < 1 ? "ms" : "s");
    if (n->method == ENVMAP_METHOD_FAST)
        printf("            the reference would take %.0f times as long\n", reference / own);
}

/* How many lobes a fit of GGX's f_r (n.l) takes, for views up to 75 degrees from the normal. */
static int print_fit(const options *o) {
    brdf_values values = {{1, 1, 1}, 0, 0, 0, 0, 0};
    envmap_brdf brdf = {brdf_ggx, NULL};
    static const char *const words[3] = {"one does", "two do", "three do"};
    double error[3], best;
    int lobes, k, status = DONE;
    values.alpha = o->alpha, brdf.user = &values;
    for (lobes = 1; lobes <= 3 && !status; lobes++) {
        envmap_fit fit = {0};
        fit.lobes = lobes, fit.slices = 4;
        status = check(envmap_fit_brdf(&fit, &brdf, NULL), "fit");
        error[lobes - 1] = 0;
        for (k = 1; k < fit.slices && !status; k++) error[lobes - 1] += (double)fit.error[k] / 3;
        envmap_fit_free(&fit);
    }
    if (status) return status;
    best = 1.1 * fmin(error[0], fmin(error[1], error[2]));
    printf("  fit       the whole f_r (n.l) as a sum of lobes: one is off by %.2g (rms, seen from\n"
           "            up to 68 degrees), two by %.2g, three by %.2g: %s\n",
           error[0], error[1], error[2], words[error[0] > best ? error[1] > best ? 2 : 1 : 0]);
    return DONE;
}

static int run_plan(const options *o) {
    envmap in;
    envmap_plan needs;
    options asked;
    char text[64];
    double tolerance = o->tolerance > 0 ? fmin(fmax(o->tolerance, 1e-7), 0.1) : 1e-3;
    int status = load(&in, o->files[0], o->mapping);
    if (status) return status;
    status = plan_for(&needs, &asked, &in, o);
    if (!status) {
        printf("%s, %s %d x %d, through %s, to a relative error of %g\n", o->files[0],
               mapping_words[in.mapping], map_width(&in), in.size, lobe_text(text, o), tolerance);
        if (!needs.method)
            printf("  size      %d: as fine as the source; a mirror is resampled, not filtered\n",
                   needs.size);
        else {
            print_scene(&needs, tolerance);
            print_size(&needs, &asked, o, &in, tolerance);
            print_method(&needs);
            print_time(&needs, &in, &asked);
            if (o->lobe == LOBE_GGX) status = print_fit(o);
        }
    }
    envmap_free(&in);
    return status;
}

/* The output of a filter, filled: with a cube no larger than need be where nothing else is asked
   for. */
static int filter_into(envmap *out, const envmap *in, const options *o) {
    options asked;
    envmap_lobe lobe = chosen_lobe(o);
    envmap_plan needs;
    envmap_filter_desc desc;
    envmap_result result;
    meter m = meter_start(o);
    int threads, status = DONE;
    asked = *o;
    if (o->size < 0) status = plan_for(&needs, &asked, in, o);
    if (asked.to < 0) asked.to = ENVMAP_CUBE;
    if (asked.slices == defaults.slices && o->lobe == LOBE_BANKS) asked.slices = 16;
    if (!status) status = create_output(out, in, &asked, 1, asked.slices);
    if (status) return status;
    desc = describe(o, &threads, &m);
    result = envmap_filter(out, in, &lobe, &desc);
    meter_stop(&m);
    return check(result, lobe_words[o->lobe]);
}

static int run_filter(const options *o) {
    envmap in, out = no_map;
    int status = check_output(o->files[1]);
    if (!status) status = load(&in, o->files[0], o->mapping);
    if (status) return status;
    status = filter_into(&out, &in, o);
    if (!status) status = save(&out, o->files[1], o->exposure);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

/* Nine coefficients, convolved, as GLSL: envmap_sh_pack's layout. */
static void print_glsl(const char *path, const float packed[28]) {
    char text[SHADER_ROOM];
    shader_diffuse(text, packed);
    printf("// of %s\n%s", path, text);
}

static void print_coefficients(const double sh[27]) {
    int k;
    printf("  l  m %14s %14s %14s   radiance\n", "R", "G", "B");
    for (k = 0; k < 9; k++) {
        int l = k > 3 ? 2 : k > 0;
        printf("  %d %2d %14.7g %14.7g %14.7g\n", l, k - l * (l + 1), sh[3 * k], sh[3 * k + 1],
               sh[3 * k + 2]);
    }
}

static int run_sh(const options *o) {
    envmap in;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    double sh[27], windowed[27], moved = 0;
    float packed[28];
    int status = load(&in, o->files[0], o->mapping);
    if (status) return status;
    status = check(envmap_sh_project(sh, 3, &in, 0, 0, NULL), o->files[0]);
    envmap_free(&in);
    if (!status)
        status = check(envmap_sh_window(windowed, &moved, sh, 3, &diffuse, 0), o->files[0]);
    if (status) return status;
    if (moved > 0)
        printf("// %s: nine coefficients of its irradiance go below zero somewhere; %s\n",
               o->files[0], o->window ? "windowed" : "--window would prevent it");
    if (moved > 0) printf("// at %.2g relative rms\n", moved);
    if (o->window) memcpy(sh, windowed, sizeof sh);
    if (!o->glsl) {
        print_coefficients(sh);
        return DONE;
    }
    status = check(envmap_sh_convolve(sh, sh, 3, &diffuse, 0), o->files[0]);
    if (!status) status = check(envmap_sh_pack(NULL, packed, sh), o->files[0]);
    if (!status) print_glsl(o->files[0], packed);
    return status;
}

static void print_difference(const envmap_difference *d, const envmap *map) {
    float dir[3];
    envmap_direction(dir, map->mapping, d->face, ((float)d->x + 0.5f) / (float)map_width(map),
                     ((float)d->y + 0.5f) / (float)map->size);
    printf("rms    %.6g (relative to the second map)\n", d->rms);
    printf("bias   %+.6g\n", d->bias);
    printf("worst  %.6g at slice %d, face %d, x %d, y %d: direction %.4f %.4f %.4f\n", d->worst,
           d->slice, d->face, d->x, d->y, (double)dir[0], (double)dir[1], (double)dir[2]);
}

static int run_compare(const options *o) {
    envmap a, b = no_map;
    envmap_difference difference;
    int status = load(&a, o->files[0], o->mapping);
    if (status) return status;
    status = load(&b, o->files[1], o->mapping);
    if (!status && (a.mapping != b.mapping || a.size != b.size || a.slices != b.slices))
        status = fail(RANGE_ERROR, o->files[1], "has another size or parameterization",
                      "bring both to one with `envmap convert --to --size`");
    if (!status) status = check(envmap_compare(&difference, &a, &b, 0), o->files[0]);
    if (!status) print_difference(&difference, &a);
    envmap_free(&a);
    envmap_free(&b);
    return status;
}

static int run_generate(const options *o) {
    envmap map = no_map;
    int scene, status = check_output(o->files[1]);
    int to = o->to >= 0 ? o->to : ENVMAP_LATLONG;
    for (scene = 0; scene < SCENE_COUNT; scene++)
        if (!strcmp(scene_name[scene], o->files[0])) break;
    if (scene == SCENE_COUNT)
        return fail(USAGE_ERROR, o->files[0], "is no scene", "overcast, studio or sun");
    if (status) return status;
    status = check(envmap_create(&map, to, o->size > 0 ? o->size : 256, 1, 1), "output");
    if (status) return status;
    scene_fill(&map, scene);
    status = save(&map, o->files[1], o->exposure);
    envmap_free(&map);
    return status;
}

/* demo and docs: a folder of pictures, with progress over all of them. */
static int run_gallery(const options *o, envmap_result (*paint)(gallery *)) {
    gallery g = {0};
    envmap_result result;
    meter m = meter_start(o);
    int threads, status = make_folder(o->files[0]);
    if (status) return status;
    g.folder = o->files[0];
    g.desc = describe(o, &threads, &m);
    result = paint(&g);
    meter_stop(&m);
    return check(result, g.path);
}

static int run_demo(const options *o) {
    double start = seconds();
    int status = run_gallery(o, gallery_demo), scene, k;
    if (status) return status;
    for (scene = 0; scene < SCENE_COUNT; scene++) {
        printf("%s/%s-environment.pfm\n ", o->files[0], scene_name[scene]);
        for (k = 0; k < GALLERY_LOOKS; k++) printf(" %s", gallery_looks[k].file);
        printf("\n");
    }
    printf("%d maps and a picture of them in %.0f s. Look at\n%s/contact-sheet.png\n",
           SCENE_COUNT * (GALLERY_LOOKS + 1), seconds() - start, o->files[0]);
    return DONE;
}

static int run_docs(const options *o) {
    int status = run_gallery(o, gallery_docs);
    if (!status)
        printf("%s/glossinesses.png\n%s/parameterizations.png\n", o->files[0], o->files[0]);
    return status;
}

/* ------------------------------------------------------------------------------------ >>main -- */

static const command commands[] = {
    {"info", "FILE.pfm", 1, "--mapping ", "Prints shape, radiance, contrast and damage of a map.",
     "envmap info sky.pfm", run_info},
    {"convert", "IN.pfm OUT.pfm|png", 2, "--mapping --from --to --size --exposure ",
     "Brings a map into another parameterization or size, or into a picture.",
     "envmap convert sky.pfm sky-cube.pfm --to cube --size 128", run_convert},
    {"mips", "IN.pfm OUT_PREFIX", 2, "--mapping --from --to --size ",
     "Writes every mip level, weighted by solid angle, to OUT_PREFIX0.pfm, OUT_PREFIX1.pfm ...",
     "envmap mips sky.pfm sky-level- --to cube --size 128", run_mips},
    {"plan", "IN.pfm", 1,
     "--mapping --from --to --size --slices --lobe --exponent --sharpness --alpha --s --tolerance ",
     "Says how much of everything a map, a lobe and a tolerance need, why, and what it will cost.",
     "envmap plan sky.pfm --lobe phong --exponent 100 --tolerance 1e-3", run_plan},
    {"filter", "IN.pfm OUT.pfm|png", 2,
     "--mapping --from --to --size --slices --lobe --exponent --sharpness --alpha --s --raw "
     "--scale "
     "--method --tolerance --threshold --threads --exposure --progress ",
     "Filters a map with a lobe into a cube as small as `plan` says, or what --to and --size say.",
     "envmap filter sky.pfm gloss.pfm --lobe phong --exponent 50 --to cube --size 32", run_filter},
    {"sh", "IN.pfm", 1, "--mapping --glsl --window ",
     "Prints nine spherical harmonic coefficients, or GLSL that lights with them.",
     "envmap sh sky.pfm --glsl", run_sh},
    {"compare", "A.pfm B.pfm", 2, "--mapping ", "Prints how far A is from B, the truth.",
     "envmap compare fast.pfm exact.pfm --mapping cube", run_compare},
    {"generate", "overcast|studio|sun OUT.pfm|png", 2, "--to --size --exposure ",
     "Makes one of three environments (default: lat-long, 512 x 256).",
     "envmap generate sun sun.pfm --to latlong --size 256", run_generate},
    {"demo", "DIR", 1, "--threads --progress ",
     "Makes three environments, filters each eight ways, and draws contact-sheet.png.",
     "envmap demo build/demo", run_demo},
    {"docs", "DIR", 1, "--threads --progress ", "Draws the pictures of the README and of docs/.",
     "envmap docs docs/images", run_docs}};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

static void print_commands(FILE *to) {
    int k;
    fprintf(to, "usage: envmap COMMAND ...    filters environment maps, exactly\n\n");
    for (k = 0; k < COMMAND_COUNT; k++)
        fprintf(to, "  %-9s %-32s %s\n", commands[k].name, commands[k].files, commands[k].what);
    fprintf(to, "\n  COMMAND --help lists its options.\n"
                "example: envmap filter sky.pfm gloss.pfm --lobe phong --exponent 50\n"
                "status:  0 done, 1 wrong use, 2 file or format, 3 out of range or refused\n");
}

static int run_command(const command *c, char **arguments) {
    options o = defaults;
    int i = 0, status = DONE;
    command_name = c->name;
    while (arguments[i] && !status) status = parse_argument(&o, c, arguments, &i);
    if (status) return status;
    if (o.help) {
        print_help(c);
        return DONE;
    }
    if (o.file_count < c->file_count)
        return fail(USAGE_ERROR, c->files, "too few arguments", c->example);
    return c->run(&o);
}

int main(int argc, char **argv) {
    int k;
    if (argc < 2) {
        print_commands(stderr);
        return USAGE_ERROR;
    }
    for (k = 0; k < COMMAND_COUNT; k++)
        if (!strcmp(argv[1], commands[k].name)) return run_command(&commands[k], argv + 2);
    if (!strcmp(argv[1], "--help")) {
        print_commands(stdout);
        return DONE;
    }
    command_name = argv[1];
    return fail(USAGE_ERROR, "no such command", argv[1], "envmap --help lists them");
}

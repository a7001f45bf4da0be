/* options.h - the tool's options: one table, from which parsing, ranges and help come. Include
   after messages.h, layouts.h, orientation.h and threads.h.

   SPDX-License-Identifier: MIT */

#ifndef OPTIONS_H
#define OPTIONS_H

#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct options {
    const char *files[2];
    int file_count;
    int mapping, to, size, slices, lobe, method, threads; /* mapping, to, size: -1 if not given */
    double exponent, sharpness, alpha, s, scale, tolerance, threshold, exposure;
    int raw, glsl, window, progress, help;
    int format;                    /* texel_format of what is written */
    int border;                    /* texels around an octahedral map that is written */
    int flip, horizon, convention; /* of what is read; horizon: -1 if not given */
    double limit, rotate[3];
    int engine, levels, sun, sheen, verify; /* of bake; levels: 0 if not given */
    double bend;                            /* -1 if not given */
    unsigned long long given;               /* a bit for each option of the table */
} options;

static const options defaults = {.mapping = -1,
                                 .to = -1,
                                 .size = -1,
                                 .slices = 1,
                                 .exponent = 100,
                                 .sharpness = 100,
                                 .alpha = 0.25,
                                 .s = 0.9,
                                 .scale = 1,
                                 .horizon = -1,
                                 .bend = -1};

static const char *const lobe_words[] = {"mirror", "diffuse", "phong", "gaussian",
                                         "ggx",    "banks",   "charlie", NULL};
static const char *const method_words[] = {"auto", "reference", "hierarchical",
                                           "fast", "harmonics", NULL};
enum { LOBE_MIRROR, LOBE_DIFFUSE, LOBE_PHONG, LOBE_GAUSSIAN, LOBE_GGX, LOBE_BANKS, LOBE_CHARLIE };

/* In the order of texel_format. */
static const char *const format_words[] = {"rgba16f", "rgba32f", "rgb9e5", "b10g11r11", NULL};

static const char *const horizon_words[] = {"black", "mean", NULL};

typedef enum option_kind { FLAG, INTEGER, NUMBER, WORD, ANGLES } option_kind;
typedef struct option_spec {
    const char *name;
    option_kind kind;
    size_t offset;            /* of an int (NUMBER, ANGLES: double) in struct options */
    double low, high;         /* allowed range, both included */
    const char *const *words; /* for WORD */
    const char *help;
} option_spec;

#define AT(field) offsetof(options, field)
static const option_spec option_table[] = {
    {"--mapping", WORD, AT(mapping), 0, 0, mapping_words,
     "parameterization of the input (default: by its shape)"},
    {"--from", WORD, AT(mapping), 0, 0, mapping_words, "the same"},
    {"--flip", FLAG, AT(flip), 0, 0, NULL, "turn the input's rows upside down"},
    {"--horizon", WORD, AT(horizon), 0, 0, horizon_words,
     "the input is the upper half of a lat-long; below is"},
    {"--from-convention", WORD, AT(convention), 0, 0, orientation_words,
     "whose axes the input has (default envmap)"},
    {"--rotate", ANGLES, AT(rotate), -36000, 36000, NULL,
     "YAW[,PITCH,ROLL]: turn the input about +y, +x, +z, in degrees"},
    {"--limit", NUMBER, AT(limit), 0, 3e38, NULL,
     "the most radiance to let pass (default 0: all that is finite)"},
    {"--to", WORD, AT(to), 0, 0, mapping_words, "parameterization of the output"},
    {"--size", INTEGER, AT(size), 1, 16384, NULL, "face edge in texels (lat-long: its height)"},
    {"--border", INTEGER, AT(border), 1, 8192, NULL,
     "so many texels around the map, with --to octahedral, for bilinear samplers"},
    {"--slices", INTEGER, AT(slices), 1, 4096, NULL,
     "slices of the third dimension (default 1; banks 16)"},
    {"--lobe", WORD, AT(lobe), 0, 0, lobe_words, "which lobe (default mirror; of a chain ggx)"},
    {"--exponent", NUMBER, AT(exponent), 0, 1e9, NULL, "N of phong (default 100)"},
    {"--sharpness", NUMBER, AT(sharpness), 0, 1e9, NULL, "lambda of gaussian (default 100)"},
    {"--alpha", NUMBER, AT(alpha), 1e-4, 1, NULL, "alpha of ggx and charlie, roughness squared (default 0.25)"},
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
    {"--format", WORD, AT(format), 0, 0, format_words,
     "of the texels of .ktx2, .ktx and .dds (default rgba16f)"},
    {"--for", WORD, AT(engine), 0, 0, bake_words, "the engine (default opengl)"},
    {"--levels", INTEGER, AT(levels), 1, 16, NULL, "of the chain (default: down to an edge of 4)"},
    {"--bend", NUMBER, AT(bend), 0, 1, NULL,
     "level = (levels - 1) r (1 + bend - bend r) (default: the engine's)"},
    {"--sun", FLAG, AT(sun), 0, 0, NULL, "take the brightest compact lights out of the maps"},
    {"--sheen", FLAG, AT(sheen), 0, 0, NULL, "put sheen (charlie) into the table's third channel"},
    {"--verify", INTEGER, AT(verify), 0, 10000, NULL,
     "measure so many texels of every level against plain sums (default 0)"},
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
static inline int parse_number(double *value, const char *text) {
    char *end;
    if (!*text || isspace((unsigned char)*text)) return 0;
    *value = strtod(text, &end);
    return !*end && isfinite(*value);
}

static inline int parse_word(int *index, const char *const *words, const char *text) {
    for (*index = 0; words[*index]; ++*index)
        if (!strcmp(words[*index], text)) return 1;
    return 0;
}

static inline void list_words(char *out, size_t room, const char *const *words) {
    size_t used = 0;
    *out = 0;
    for (; *words && used < room; words++)
        used += (size_t)snprintf(out + used, room - used, "%s%s", used ? "|" : "", *words);
}

static inline int store_number(options *o, const option_spec *option, const char *text) {
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

/* One number, or three with commas between. */
static inline int store_angles(options *o, const option_spec *option, const char *text) {
    double angles[3] = {0, 0, 0};
    char *end = NULL;
    int k, good = 1;
    for (k = 0; k < 3; k++, text = end + 1) {
        angles[k] = strtod(text, &end);
        good = good && end != text && angles[k] >= option->low && angles[k] <= option->high;
        if (!good || *end != ',') break;
    }
    if (!good || *end || k == 1)
        return fail(USAGE_ERROR, option->name, "takes an angle, or three with commas between",
                    "YAW or YAW,PITCH,ROLL, in degrees");
    memcpy((char *)o + option->offset, angles, sizeof angles);
    return DONE;
}

static inline int store_option(options *o, const option_spec *option, const char *text) {
    char remedy[96];
    int index;
    if (option->kind == ANGLES) return store_angles(o, option, text);
    if (option->kind == INTEGER || option->kind == NUMBER) return store_number(o, option, text);
    if (!parse_word(&index, option->words, text)) {
        list_words(remedy, sizeof remedy, option->words);
        return fail(USAGE_ERROR, text, "is not one of", remedy);
    }
    memcpy((char *)o + option->offset, &index, sizeof index);
    return DONE;
}

static inline int command_takes(const command *c, const option_spec *option) {
    char name[32];
    snprintf(name, sizeof name, "%s ", option->name);
    return !strcmp(option->name, "--help") || strstr(c->takes, name) != NULL;
}

/* The option that `text` names up to its end or to '='. */
static inline const option_spec *find_option(const command *c, const char *text) {
    size_t length = strcspn(text, "=");
    int k;
    if (!strcmp(text, "-h")) text = "--help", length = 6;
    for (k = 0; k < OPTION_COUNT; k++)
        if (!strncmp(option_table[k].name, text, length) && !option_table[k].name[length] &&
            command_takes(c, &option_table[k]))
            return &option_table[k];
    return NULL;
}

static inline int is_given(const options *o, const char *name) {
    int k = 0;
    while (k < OPTION_COUNT && strcmp(option_table[k].name, name)) k++;
    return (int)(o->given >> k & 1);
}

static inline int parse_operand(options *o, const command *c, const char *text) {
    if (o->file_count == c->file_count)
        return fail(USAGE_ERROR, text, "is one argument too many", NULL);
    o->files[o->file_count++] = text;
    return DONE;
}

/* An option, with its value behind '=' or as the next argument; *i moves past what was taken. */
static inline int parse_option(options *o, const command *c, char **arguments, int *i) {
    const char *text = arguments[(*i)++], *value = strchr(text, '=');
    const option_spec *option = find_option(c, text);
    int on = 1;
    if (!option) return fail(USAGE_ERROR, text, "no such option", "add --help for a list");
    o->given |= 1ull << (option - option_table);
    if (option->kind == FLAG) {
        if (value) return fail(USAGE_ERROR, text, "takes no value", "add --help for a list");
        memcpy((char *)o + option->offset, &on, sizeof on);
        return DONE;
    }
    if (!value && !arguments[*i])
        return fail(USAGE_ERROR, text, "needs a value", "add --help for a list");
    return store_option(o, option, value ? value + 1 : arguments[(*i)++]);
}

/* What belongs to one lobe, method or mapping would do nothing with another: it is refused. */
static inline int check_unused(const options *o) {
    static const struct {
        const char *option, *use;
    } uses[] = {{"--exponent", "--lobe phong"}, {"--sharpness", "--lobe gaussian"},
                {"--alpha", "--lobe ggx or charlie"},      {"--s", "--lobe banks"},
                {"--scale", "--raw"},           {"--threshold", "--method hierarchical"},
                {"--border", "--to octahedral"}};
    int used[7], u;
    used[0] = o->lobe == LOBE_PHONG, used[1] = o->lobe == LOBE_GAUSSIAN;
    used[2] = o->lobe == LOBE_GGX || o->lobe == LOBE_CHARLIE, used[3] = o->lobe == LOBE_BANKS;
    used[4] = o->raw, used[5] = o->method == ENVMAP_METHOD_HIERARCHICAL;
    used[6] = o->to == ENVMAP_OCTAHEDRAL;
    for (u = 0; u < 7; u++)
        if (!used[u] && is_given(o, uses[u].option)) {
            char remedy[64];
            snprintf(remedy, sizeof remedy, "it goes with %s", uses[u].use);
            return fail(USAGE_ERROR, uses[u].option, "would do nothing here", remedy);
        }
    return DONE;
}

/* All of a command's arguments; after "--" there are no options. "-" is a file. */
static inline int parse_arguments(options *o, const command *c, char **arguments) {
    int i = 0, status = DONE, only_files = 0;
    while (arguments[i] && !status && !o->help) {
        const char *text = arguments[i];
        if (only_files || text[0] != '-' || !text[1]) {
            status = parse_operand(o, c, text);
            i++;
        } else if (!strcmp(text, "--")) {
            only_files = 1, i++;
        } else status = parse_option(o, c, arguments, &i);
    }
    if (status || o->help) return status;
    if (o->file_count < c->file_count)
        return fail(USAGE_ERROR, c->files, "too few arguments", c->example);
    if (o->border && o->size + 2 * o->border > 16384) /* said before a minute's work */
        return fail(RANGE_ERROR, "--border", "makes the map wider than 16384", "a smaller --size");
    return check_unused(o);
}

static inline void print_help(const command *c) {
    char words[96];
    int k;
    printf("usage: envmap %s %s [options]\n\n%s\n\n", c->name, c->files, c->what);
    for (k = 0; k < OPTION_COUNT; k++) {
        const option_spec *option = &option_table[k];
        if (!command_takes(c, option)) continue;
        *words = 0;
        if (option->words) list_words(words, sizeof words, option->words);
        printf("  %-18s %s%s%s\n", option->name, option->help, *words ? ": " : "", words);
    }
    printf("\nexample: %s\n", c->example);
}

#endif /* OPTIONS_H */

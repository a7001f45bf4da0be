/* architecture.c - the rooms of envmap.h and a texel's way through them: the tables and the two
   drawings of docs/architecture.md.

   What you will see: `architecture` prints the tables; `architecture DOCS` also writes them between
   the marks in DOCS/architecture.md, and DOCS/charts/architecture-rooms.svg and -texel.svg. Start it
   where envmap.h is.
       cc -O3 -march=native -std=c99 -I. examples/measure/architecture.c -o architecture -lm -lpthread

   What is said of rooms is read from envmap.h as a text: marks, lines, functions, who names whose
   functions, public calls, tests. A room that is not described below, or that calls one further
   down, ends the program. Sizes along the way are those of a filter that runs: its desc's memory
   tells the blocks that it asks for, its executor the rows of nodes.

   >>rooms     what each takes and gives
   >>header    envmap.h, read as a text
   >>sizes     of one filter, step by step
   >>tables    Markdown
   >>drawings  SVG
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/scenes.h"
#include "svg.h"

/* ----------------------------------------------------------------------------------- >>rooms -- */

enum { NUMBERS, MAPS, HARMONICS, METHODS, CALLS, BESIDE, GROUPS };

static const struct {
    const char *name, *colour;
} groups[GROUPS] = {{"numbers and directions", "#777777"}, {"maps and files", "#3b6ea8"},
                    {"lobes and harmonics", "#c4732b"},    {"methods", "#b03a48"},
                    {"calls that filter", "#4d8f4d"},      {"surfaces and errors", "#7a5aa6"}};

/* The rooms in the header's order; which of them are there, the header tells. */
static const struct described {
    const char *name;
    int group;
    const char *takes, *gives;
} described[] = {
    {"base", NUMBERS, "tasks, blocks of memory, banded systems",
     "results, lanes of floats, solved systems"},
    {"directions", NUMBERS, "mapping, face, (u, v)", "a direction; and back"},
    {"maps", MAPS, "a map and a texel or a direction",
     "memory, solid angle, radiance; a clean map"},
    {"resample", MAPS, "a map", "the same radiance in another mapping or size"},
    {"pfm", MAPS, "bytes of a PFM file", "a map; and back"},
    {"mips", MAPS, "level 0", "all levels; lookups over a footprint"},
    {"lobes", HARMONICS, "a lobe, an angle, p", "k, integral, width, support, kinks, λ_l"},
    {"splines", HARMONICS, "places between samples", "weights of six samples; what grids lose"},
    {"rings", HARMONICS, "values at points anywhere on the sphere", "a_lm; and back"},
    {"lights", HARMONICS, "lights, a lobe, axes", "what they send along eight axes at a time"},
    {"transform", HARMONICS, "texels of a slice",
     "nodes of a coarser grid, by `rings` a_lm; and back"},
    {"harmonics", HARMONICS, "a map, coefficients",
     "coefficients: filtered, turned, windowed, packed"},
    {"source", METHODS, "a slice; light from anywhere",
     "texels that count, points of light, in tiles"},
    {"axis", METHODS, "a source, a lobe, an axis", "sums over texels and tents; points"},
    {"circles", METHODS, "the same", "sums over circles of bilinear radiance"},
    {"reference", METHODS, "a slice, a lobe", "a slice of the result, by the definition's sum"},
    {"hierarchical", METHODS, "a slice, a lobe, a threshold", "the same sum over nodes of a tree"},
    {"windows", METHODS, "an axis, a radius, a face", "a rectangle of (u, v), nodes over it"},
    {"kernels", METHODS, "a sharp lobe, axes side by side", "what each texel in sight counts"},
    {"knots", METHODS, "a tile of axes", "K of a few axes, and of those between"},
    {"near", METHODS, "a slice, a sharp lobe, a tolerance",
     "that sum over the texels within reach"},
    {"cells", METHODS, "a cell, a thin ring", "what it counts of the corners"},
    {"banks", METHODS, "a slice, a thin ring", "that sum, tile by tile of the source"},
    {"scene", METHODS, "a slice", "its contrast at every scale, its lights"},
    {"fast", METHODS, "a slice, its scene, lobes, a tolerance",
     "how many bands, how fine a grid; then the results"},
    {"sharp", METHODS, "lobes, bands, a spectrum", "results, by bands, points, near sums or rings"},
    {"filters", CALLS, "maps, lobes, a desc", "checked arguments, the method, the results"},
    {"plan", CALLS, "the same, without a result", "the bands, size and slices that will do"},
    {"materials", BESIDE, "a BRDF, a surface", "lobes, factors and taps for lookups; eq. 1"},
    {"compare", BESIDE, "a map and the truth", "rms, bias, worst texel"}};

enum { ROOMS = 32, FUNCTIONS = 2000 };

typedef struct room {
    const struct described *is;
    int declared, body, functions; /* lines, lines, number */
    const char *from, *to;         /* its bodies, in the text */
    int calls[ROOMS];              /* how often it names a function of another room */
    char public_calls[2000], tests[400];
} room;

static room rooms[ROOMS];
static int room_count;

/* ---------------------------------------------------------------------------------- >>header -- */

typedef struct function {
    const char *name;
    size_t length;
    int room;
} function;

static function functions[FUNCTIONS];
static int function_count, header_lines;
static char *header, *code; /* code: the header with its comments blank */

static void stop(const char *what, const char *name) {
    fprintf(stderr, "architecture: %s%s\n", what, name);
    exit(2);
}

static int is_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static size_t word_length(const char *at) {
    size_t n = 0;
    while (is_word(at[n])) ++n;
    return n;
}

static const char *next_line(const char *at) {
    const char *end = strchr(at, '\n');
    return end ? end + 1 : at + strlen(at);
}

static int starts(const char *at, const char *with) { return !strncmp(at, with, strlen(with)); }

static void blank_comments(char *at) {
    char *end;
    while ((at = strstr(at, "/*")) != NULL && (end = strstr(at, "*/")) != NULL)
        for (end += 2; at < end; ++at)
            if (*at != '\n') *at = ' ';
}

/* The name of the room whose mark this line is, or NULL. */
static const char *mark_of(const char *line) {
    const char *found = starts(line, "/* ---") ? strstr(line, ">>") : NULL;
    return found && found < next_line(line) ? found + 2 : NULL;
}

/* The room of that name, which its bodies' mark begins. */
static int room_of(const char *name, int bodies) {
    size_t length = word_length(name);
    for (int i = 0; i < room_count; ++i)
        if (!strncmp(rooms[i].is->name, name, length) && !rooms[i].is->name[length]) return i;
    for (int i = 0; i < COUNT(described) && bodies && room_count < ROOMS; ++i) {
        if (strncmp(described[i].name, name, length) || described[i].name[length]) continue;
        rooms[room_count].is = described + i;
        return room_count++;
    }
    if (bodies) stop("describe this room in `described`: ", name);
    return -1;
}

/* Bodies first: they have all rooms, and in order. */
static void find_rooms(int bodies) {
    int at = -1, below = 0;
    for (const char *line = header; *line; line = next_line(line)) {
        const char *name = mark_of(line);
        below |= starts(line, "/* =====");
        if (starts(line, "#endif /* ENVMAP_H") || starts(line, "#endif /* ENVMAP_IMPL")) at = -1;
        if (name && below == bodies) {
            at = room_of(name, bodies);
            if (bodies) rooms[at].from = line;
        }
        if (at < 0 || below != bodies) continue;
        if (bodies) ++rooms[at].body, rooms[at].to = next_line(line);
        else ++rooms[at].declared;
    }
}

/* Notes the function that a line of code at the margin defines, if it does. */
static void find_function(const char *line, int at) {
    const char *end = next_line(line);
    if (!is_word(*line)) return;
    for (const char *open = line; (open = strchr(open, '(')) != NULL && open < end; ++open) {
        const char *name = open;
        while (name > line && is_word(name[-1])) --name;
        if (!starts(name, "envmap")) continue;
        if (function_count == FUNCTIONS) stop("too many functions", "");
        functions[function_count++] = (function){name, (size_t)(open - name), at};
        ++rooms[at].functions;
        return;
    }
}

static const function *function_of(const char *name, size_t length) {
    for (int i = 0; i < function_count; ++i)
        if (functions[i].length == length && !strncmp(functions[i].name, name, length))
            return functions + i;
    return NULL;
}

/* A body calls only what stands above it. */
static void count_calls(int at) {
    const char *end = code + (rooms[at].to - header);
    for (const char *word = code + (rooms[at].from - header); word < end;) {
        size_t length = word_length(word);
        const function *f = starts(word, "envmap") ? function_of(word, length) : NULL;
        if (f && f->room > at) stop("calls what stands below it: ", rooms[at].is->name);
        if (f && f->room != at) ++rooms[at].calls[f->room];
        word += length ? length : 1;
    }
}

static void add_test(room *r, const char *path, size_t length) {
    char whole[100], *name = whole + 6; /* behind tests/ */
    FILE *file;
    snprintf(whole, sizeof whole, "%.*s", (int)length, path);
    file = fopen(whole, "r");
    if (!file) fprintf(stderr, "architecture: >>%s names %s\n", r->is->name, whole);
    if (!file) return;
    fclose(file);
    whole[length - 2] = 0;
    if (strstr(r->tests, name)) return;
    if (*r->tests) strcat(r->tests, ", ");
    strcat(r->tests, name);
}

/* The test programs that a room's comments name. */
static void find_tests(room *r) {
    const char *at = r->from;
    while ((at = strstr(at, "tests/")) != NULL && at < r->to) {
        size_t length = 6 + word_length(at + 6);
        if (starts(at + length, ".c") && strlen(r->tests) < sizeof r->tests - 100)
            add_test(r, at, length + 2);
        at += length;
    }
    if (!*r->tests) stop("no test is named in >>", r->is->name);
}

/* Without their prefix. */
static void find_public(room *r, int at) {
    for (const function *f = functions; f < functions + function_count; ++f) {
        size_t used = strlen(r->public_calls);
        if (f->room != at || !starts(f->name, "envmap_")) continue;
        snprintf(r->public_calls + used, sizeof r->public_calls - used, "%s`%.*s`",
                 used ? ", " : "", (int)f->length - 7, f->name + 7);
    }
}

static void read_header(const char *path) {
    header = measure_read(path), code = measure_read(path);
    blank_comments(code);
    for (const char *line = header; *line; line = next_line(line)) ++header_lines;
    find_rooms(1);
    find_rooms(0);
    for (int i = 0; i < room_count; ++i) {
        const char *end = code + (rooms[i].to - header);
        for (const char *line = code + (rooms[i].from - header); line < end; line = next_line(line))
            find_function(line, i);
    }
    for (int i = 0; i < room_count; ++i) {
        count_calls(i);
        find_public(rooms + i, i);
        find_tests(rooms + i);
    }
}

/* ----------------------------------------------------------------------------------- >>sizes --
   What a filter asks of ENVMAP_MALLOC and of its executor says how fine its grids are. */

#define EDGE 256
enum { NOTES = 512 };
static size_t blocks[NOTES];
static int block_count, rounds[NOTES], round_count;

static void note_block(size_t bytes) {
    if (block_count < NOTES) blocks[block_count++] = bytes;
}

static void note_round(void *user, envmap_task *task, void *context, int count) {
    (void)user;
    if (round_count < NOTES) rounds[round_count++] = count;
    for (int i = 0; i < count; ++i) task(context, i);
}

typedef struct sizes {
    int exponent, bands, nodes, rings; /* nodes: along the edge of a face's grid */
    size_t most, file;                 /* bytes: at once beside the maps; of the source's file */
} sizes;

/* Blocks are longer than what is in them, so that it can be aligned. */
static int has_block(size_t bytes) {
    for (int i = 0; i < block_count; ++i)
        if (blocks[i] == bytes + 128) return 1;
    return 0;
}

static int has_round(int count) {
    for (int i = 0; i < round_count; ++i)
        if (rounds[i] == count) return 1;
    return 0;
}

/* Bytes of the block that has all about rings: 2M points of M + 6 rings, 4 floats each; the nodes'
   places, 8 bytes; their 4 floats or, where these lie later, 4 complex doubles for every l and
   m >= 0; tables; and what 12 tasks need. */
static size_t rings_bytes(size_t M, size_t L, size_t nodes) {
    size_t n = 2 * M, H = M / 2, a = 4 * L * (L + 1);
    size_t own = (n + 6) * 2 * (M + 6) + nodes + (a > 2 * nodes ? a : 2 * nodes);
    size_t tables = 4 * n + 2 * L + 14 * H + 24, tasks = 12 * (36 * M + 256);
    return 8 * ((own + 7) / 8 * 8 + tables + tasks + (n + 1) / 2);
}

/* There are L < M - 1 bands, and a task for every row of a face's nodes. */
static void sizes_find(sizes *s) {
    for (size_t n = 4; n <= EDGE && !s->nodes; ++n)
        for (size_t M = 8; M <= 512 && !s->nodes && has_round((int)n); M += 4)
            for (size_t L = 4; L < M - 1 && !s->nodes; ++L)
                if (has_block(rings_bytes(M, L, 6 * n * n)))
                    s->nodes = (int)n, s->rings = (int)M, s->bands = (int)L;
    if (!s->nodes) stop("FAST's blocks are not those that sizes_find knows", "");
}

static sizes sizes_of(const envmap *src, int exponent) {
    sizes s = {exponent, 0, 0, 0, 0, 0};
    measure_meter meter = {0, 0, note_block};
    envmap_lobe lobe = envmap_lobe_phong((float)exponent);
    envmap dst = measure_map(ENVMAP_CUBE, EDGE, 1, 1);
    envmap_filter_desc desc = {0};
    desc.work.memory = &meter, desc.work.executor.run = note_round;
    block_count = round_count = 0;
    measure_must(envmap_filter(&dst, src, &lobe, &desc), "a filter");
    sizes_find(&s);
    s.most = meter.most;
    measure_must(envmap_pfm_write(NULL, 0, &s.file, src, 0), "the size of a file");
    envmap_free(&dst);
    return s;
}

/* "1 179 648" into one of a few buffers that take turns. */
static const char *number(size_t n) {
    static char buffers[8][32];
    static int turn;
    char digits[24], *out = buffers[turn++ % 8], *to = out;
    int count = snprintf(digits, sizeof digits, "%zu", n);
    for (int i = 0; i < count; ++i) {
        if (i && (count - i) % 3 == 0) *to++ = ' ';
        *to++ = digits[i];
    }
    *to = 0;
    return out;
}

/* ---------------------------------------------------------------------------------- >>tables -- */

static measure_document document;

static void table_of_rooms(void) {
    FILE *out = measure_begin(&document, "rooms");
    int last = 0;
    for (int i = 0; i < room_count; ++i)
        if (rooms[i].body > rooms[last].body) last = i;
    fprintf(out,
            "The header has %s lines and %d functions in %d rooms; the longest room is `%s` with "
            "%d\nlines of bodies.\n\n"
            "| room | takes | gives | calls, without `envmap_` | tests |\n|---|---|---|---|---|\n",
            number((size_t)header_lines), function_count, room_count, rooms[last].is->name,
            rooms[last].body);
    for (int i = 0; i < room_count; ++i)
        fprintf(out, "| %s | %s | %s | %s | %s |\n", rooms[i].is->name, rooms[i].is->takes,
                rooms[i].is->gives, rooms[i].public_calls, rooms[i].tests);
    measure_end(&document, out, 1);
}

static void table_of_sizes(const sizes *s, int count) {
    FILE *out = measure_begin(&document, "sizes");
    fprintf(out, "| Phong N | bands L | nodes of a face | rings × points | numbers at nodes "
                 "| at points | in a_lm | temporary memory |\n"
                 "|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (; count-- > 0; ++s) {
        size_t n = (size_t)s->nodes, m = (size_t)s->rings, bands = (size_t)s->bands;
        fprintf(out, "| %d | %d | %d × %d | %d × %d | %s | %s | %s | %.1f MB |\n", s->exponent,
                s->bands, s->nodes, s->nodes, s->rings, 2 * s->rings, number(24 * n * n),
                number(8 * m * m), number(4 * bands * bands), 1e-6 * (double)s->most);
    }
    measure_end(&document, out, 1);
}

/* -------------------------------------------------------------------------------- >>drawings -- */

static void draw_line(FILE *f, double x0, double y0, double x1, double y1, const char *colour,
                      double width) {
    fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\" stroke-width=\"%g\"/>\n", x0, y0, x1,
            y1, colour, width);
}

/* A line whose end is an arrow; along x or along y. */
static void draw_arrow(FILE *f, double x0, double y0, double x1, double y1, const char *colour) {
    double length = hypot(x1 - x0, y1 - y0), dx = (x1 - x0) / length, dy = (y1 - y0) / length;
    double x = x1 - 8 * dx, y = y1 - 8 * dy;
    draw_line(f, x0, y0, x, y, colour, 1.5);
    fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\" fill=\"%s\"/>\n", x1, y1, x - 4.5 * dy,
            y - 4.5 * dx, x + 4.5 * dy, y + 4.5 * dx, colour);
}

static void draw_dot(FILE *f, double x, double y, double radius, const char *colour) {
    fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"%s\"/>\n", x, y, radius, colour);
}

/* Places of the drawing of rooms. */
enum { TOP = 84, PITCH = 29, NAME = 24, BAR = 118, WIDEST = 190, WIRE = 392, STEP = 28 };

static double row_y(int i) { return TOP + PITCH * (i + 0.5); }
static double wire_x(int i) { return WIRE + STEP * i; }

static void draw_bar(FILE *f, const room *r, double y, double scale) {
    const char *colour = groups[r->is->group].colour;
    double body = scale * r->body, declared = scale * r->declared;
    svg_text(f, NAME, y + 4.5, 13, "start", "#111", "%s", r->is->name);
    svg_bar(f, BAR, y - 9, body, 18, colour);
    fprintf(f, "<g opacity=\"0.45\">");
    svg_bar(f, BAR + body, y - 9, declared, 18, colour);
    fprintf(f, "</g>\n");
    svg_text(f, BAR + body + declared + 6, y + 4, 11, "start", "#444", "%d", r->body + r->declared);
}

/* The wire of room i: from the last room that calls it up to its own row. */
static void draw_wire(FILE *f, int i) {
    int last = i;
    const char *colour = groups[rooms[i].is->group].colour;
    for (int k = i; k < room_count; ++k)
        if (rooms[k].calls[i]) last = k;
    if (last > i) draw_arrow(f, wire_x(i), row_y(last), wire_x(i), row_y(i) + 2, colour);
    for (int k = i; k <= last; ++k)
        if (rooms[k].calls[i])
            draw_dot(f, wire_x(i), row_y(k), fmin(2 + 1.2 * sqrt(rooms[k].calls[i]), 10), colour);
    svg_text(f, wire_x(i) + 9, row_y(i) + 4.5, 13, "start", colour, "%s", rooms[i].is->name);
}

static void draw_rooms(const char *folder) {
    int most = 1, height = TOP + PITCH * room_count + 76;
    double below = TOP + PITCH * room_count + 24;
    FILE *f = svg_open(folder, "architecture-rooms.svg", WIRE + STEP * room_count + 90, height,
                       "The rooms of envmap.h in the file's order, and who calls whom");
    for (int i = 0; i < room_count; ++i)
        if (rooms[i].body + rooms[i].declared > most) most = rooms[i].body + rooms[i].declared;
    svg_text(f, BAR, TOP - 12, 11, "start", "#444", "lines of bodies, paler: of declarations");
    svg_text(f, WIRE - 10, TOP - 30, 11, "start", "#444",
             "A dot: the room on the left calls the one at the head of the arrow; larger: in more "
             "places.");
    for (int i = 0; i < room_count; ++i) {
        draw_line(f, WIRE - 10, row_y(i), wire_x(i) + 2, row_y(i), "#ddd", 1);
        draw_bar(f, rooms + i, row_y(i), WIDEST / (double)most);
    }
    for (int i = 0; i < room_count; ++i) draw_wire(f, i);
    for (int g = 0; g < GROUPS; ++g) {
        double x = NAME + 250 * (g % 3), y = below + 24 * (g / 3);
        svg_bar(f, x, y, 13, 13, groups[g].colour);
        svg_text(f, x + 20, y + 11, 13, "start", "#111", "%s", groups[g].name);
    }
    svg_close(f);
}

/* Places of the drawing of the way: two columns of boxes, what decides between them. */
enum { BOX = 290, TALL = 58, GAP = 102, LEFT = 24, MIDDLE = 357, RIGHT = 690, FIRST = 64 };

static double box_y(int row) { return FIRST + GAP * row; }

/* A box with two lines, and a bar below them as long as there are numbers in it; 0: none. */
static void draw_box(FILE *f, double x, double y, double width, int group, const char *head,
                     const char *body, size_t numbers) {
    double part = (double)numbers / (6.0 * EDGE * EDGE * 3);
    fprintf(f,
            "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%d\" rx=\"4\" fill=\"none\" "
            "stroke=\"%s\" stroke-width=\"1.5\"/>\n",
            x, y, width, TALL, groups[group].colour);
    svg_text(f, x + 10, y + 20, 13, "start", "#111", "%s", head);
    svg_text(f, x + 10, y + 38, 11, "start", "#444", "%s", body);
    if (numbers) svg_bar(f, x + 10, y + 46, (width - 20) * part, 5, groups[group].colour);
}

/* An arrow from one row to the next, down or up, and what happens there: text, room. */
static void draw_step(FILE *f, double x, int row, int up, const char *what, const char *where) {
    double from = box_y(row) + TALL, to = box_y(row + 1);
    if (up) draw_arrow(f, x + 20, to, x + 20, from, "#666");
    else draw_arrow(f, x + 20, from, x + 20, to, "#666");
    svg_text(f, x + 34, from + 18, 11, "start", "#111", "%s", what);
    svg_text(f, x + 34, from + 33, 11, "start", "#666", "%s", where);
}

static void draw_column(FILE *f, double x, const sizes *s, int up) {
    static const char *const heads[2][5] = {
        {"a PFM file", "a map", "nodes of a coarser grid", "points on rings", "rings by order m"},
        {"a pixel", "a map", "nodes of a coarser grid", "points on rings", "rings by order m"}};
    static const char *const what[2][5] = {
        {"bytes to floats; rows come bottom first", "times solid angle; adjoint of the spline",
         "adjoint of the rings' spline", "FFT along every ring", "Legendre: sum over the rings"},
        {"look up: 4 texels, 8 between levels", "the spline at every texel",
         "the rings' spline; RGB over solid angle", "inverse FFT along every ring",
         "Legendre: sum over l"}};
    static const char *const where[2][5] = {
        {"pfm: envmap_pfm_load", "transform", "rings", "rings", "rings"},
        {"maps: envmap_lookup, or the card", "transform", "rings", "rings", "rings"}};
    size_t n = (size_t)s->nodes, m = (size_t)s->rings;
    size_t numbers[5] = {(size_t)6 * EDGE * EDGE * 3, (size_t)6 * EDGE * EDGE * 3, 24 * n * n,
                         8 * m * m, 8 * m * (size_t)s->bands};
    char body[5][100];
    if (up) numbers[0] = 0;
    snprintf(body[0], sizeof body[0],
             up ? "one direction, one radiance" : "six faces, one above the other: %.1f MB",
             1e-6 * (double)s->file);
    snprintf(body[1], sizeof body[1], "6 × %d² texels × RGB: %s numbers", EDGE, number(numbers[1]));
    snprintf(body[2], sizeof body[2], "6 × %d² × (RGB, solid angle): %s", s->nodes,
             number(numbers[2]));
    snprintf(body[3], sizeof body[3], "%d rings × %d points × 4: %s", s->rings, 2 * s->rings,
             number(numbers[3]));
    snprintf(body[4], sizeof body[4], "%d rings × %d orders × 4, complex: %s", s->rings, s->bands,
             number(numbers[4]));
    for (int row = 0; row < 5; ++row) {
        draw_box(f, x, box_y(row), BOX, row < 2 ? MAPS : HARMONICS, heads[up][row], body[row],
                 numbers[row]);
        draw_step(f, x, row, up, what[up][row], where[up][row]);
    }
}

/* What a look at the scene decides, and what goes round the waves. */
static void draw_middle(FILE *f, const sizes *s) {
    double x = MIDDLE + 20, wide = BOX - 40, y = box_y(1) + TALL / 2;
    char text[100];
    draw_box(f, x, box_y(1), wide, METHODS, "what is in the scene",
             "blocks of texels: contrast, darkness, lights", 0);
    draw_box(f, x, box_y(2), wide, METHODS, "how fine the grids have to be",
             "asked of lobe, scene and tolerance", 0);
    draw_arrow(f, LEFT + BOX, y, x, y, "#666");
    draw_arrow(f, x + wide, y, RIGHT, y, "#666");
    draw_arrow(f, x + 20, box_y(1) + TALL, x + 20, box_y(2), "#666");
    draw_arrow(f, x, y + GAP, LEFT + BOX, y + GAP, "#666");
    draw_arrow(f, x + wide, y + GAP, RIGHT, y + GAP, "#666");
    svg_text(f, x + wide, box_y(1) - 23, 11, "end", "#111", "lights, if the lobe has a kink:");
    svg_text(f, x + wide, box_y(1) - 8, 11, "end", "#666", "summed texel by texel, transform");
    svg_text(f, x + 34, box_y(1) + TALL + 18, 11, "start", "#111", "one look at all texels");
    svg_text(f, x + 34, box_y(1) + TALL + 33, 11, "start", "#666", "scene");
    svg_text(f, x + 34, box_y(2) + TALL + 18, 11, "start", "#111",
             "%d bands, faces of %d² nodes, %d rings", s->bands, s->nodes, s->rings);
    svg_text(f, x + 34, box_y(2) + TALL + 33, 11, "start", "#666", "fast");
    snprintf(text, sizeof text, "%d² coefficients × 4: %s numbers", s->bands,
             number(4 * (size_t)s->bands * (size_t)s->bands));
    draw_box(f, LEFT, box_y(5), BOX, HARMONICS, "a_lm", text,
             4 * (size_t)s->bands * (size_t)s->bands);
    draw_box(f, RIGHT, box_y(5), BOX, HARMONICS, "λ_l a_lm", text,
             4 * (size_t)s->bands * (size_t)s->bands);
    draw_arrow(f, LEFT + BOX, box_y(5) + TALL / 2, RIGHT, box_y(5) + TALL / 2, "#666");
    svg_text(f, MIDDLE + BOX / 2, box_y(5) + 18, 13, "middle", "#111", "times λ_l");
    svg_text(f, MIDDLE + BOX / 2, box_y(5) + 48, 11, "middle", "#666", "fast; lobes: λ_l");
}

static void draw_way(const char *folder, const sizes *s) {
    char title[200];
    snprintf(title, sizeof title,
             "A texel's way: fill ∘ λ ∘ project, a cube of %d² through Phong N = %d", EDGE,
             s->exponent);
    FILE *f = svg_open(folder, "architecture-texel.svg", RIGHT + BOX + LEFT,
                       (int)box_y(5) + TALL + 44, title);
    draw_column(f, LEFT, s, 0);
    draw_column(f, RIGHT, s, 1);
    draw_middle(f, s);
    svg_text(f, LEFT, box_y(5) + TALL + 26, 11, "start", "#444",
             "left, down: project; right, up: fill. Bars: how many numbers there are. Beside the "
             "arrows: what happens, and the room where it does.");
    svg_close(f);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    static const int exponents[] = {10, 100, 500};
    sizes s[COUNT(exponents)];
    envmap sky = measure_map(ENVMAP_CUBE, EDGE, 1, 1);
    read_header("envmap.h");
    scene_fill(&sky, SCENE_SUN);
    for (int i = 0; i < COUNT(exponents); ++i) s[i] = sizes_of(&sky, exponents[i]);
    table_of_rooms();
    table_of_sizes(s, COUNT(exponents));
    if (argc > 1) {
        char path[5000];
        draw_rooms(argv[1]);
        draw_way(argv[1], s + 1);
        snprintf(path, sizeof path, "%s/architecture.md", argv[1]);
        measure_write(&document, path, "make architecture");
    }
    envmap_free(&sky);
    free(header), free(code);
    measure_document_free(&document);
    return 0;
}

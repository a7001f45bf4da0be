/* envmap.c - the command-line tool: looks at, converts, filters and compares float environment
   maps.

   What you will see: `envmap demo DIR` writes three environments, the maps filtered from them, and
   contact-sheet.png to look at; `envmap --help` lists the other commands. Build with
       cc -O3 -std=c99 -I. examples/tool/envmap.c -o envmap -lm -lpthread
   Exit status: 0 done, 1 wrong use, 2 a file or its format, 3 a value out of range or a filter that
   was refused.

   messages.h   what was wrong, where, what to do
   options.h    one table: parsing, ranges and help come from it
   progress.h   a bar, or a few lines where nobody watches
   load.h       from a file to a map
   save.h       from a map to a file
   look.h       commands info, compare
   convert.h    commands convert, mips, generate
   filter.h     commands plan, filter, sh
   >>gallery    commands demo, docs
   >>main

   SPDX-License-Identifier: MIT */

#define _XOPEN_SOURCE 700
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <stdio.h>
#include <string.h>

#include "brdfs.h"
#include "picture.h"
#include "scenes.h"
#include "shader.h"
#include "gallery.h"
#include "threads.h"

#include "messages.h"
#include "options.h"
#include "progress.h"
#include "load.h"
#include "save.h"
#include "look.h"
#include "convert.h"
#include "filter.h"

/* --------------------------------------------------------------------------------- >>gallery -- */

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

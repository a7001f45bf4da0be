/* envmap.c - the command-line tool: looks at, converts, filters and compares float environment
   maps.

   What you will see: `envmap demo DIR` writes three environments, the maps filtered from them, and
   contact-sheet.png to look at; `envmap --help` lists the other commands. Build with
       cc -O3 -std=c99 -I. examples/tool/envmap.c -o envmap -lm -lpthread
   Exit status: 0 done, 1 wrong use, 2 a file or its format, 3 a value out of range or a filter that
   was refused.

   system.h     what it wants of POSIX, for Windows
   memory.h     large pages for large maps
   messages.h   what was wrong, where, what to do
   options.h    one table: parsing, ranges and help come from it
   progress.h   a bar, or a few lines where nobody watches
   read.h       from a file's bytes to floats: read_hdr.h, read_pfm.h, read_exr.h
   layouts.h    which map a picture is
   orientation.h  which way it looks
   load.h       all of these: from a file to a map
   save.h       from a map to a file; border.h: with a border that folds as the sphere does
   look.h       commands info, compare
   convert.h    commands convert, mips, generate
   filter.h     commands plan, filter, sh
   bake*.h      command bake, and write_*.h, the files that it writes
   >>gallery    commands demo, docs
   >>main

   SPDX-License-Identifier: MIT */

#define _DEFAULT_SOURCE /* madvise, for memory.h */
#define _XOPEN_SOURCE   700
#define _FILE_OFFSET_BITS 64 /* files beyond 2 GiB */
#include "system.h"
#include "memory.h"
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "brdfs.h"
#include "picture.h"
#include "write_file.h"
#include "write_pfm.h"
#include "write_png.h"
#include "scenes.h"
#include "shader.h"
#include "sheen.h"
#include "gallery.h"
#include "labels.h"
#include "threads.h"

#include "write_texels.h"
#include "write_ktx.h"
#include "write_dds.h"
#include "write_hdr.h"
#include "bake_presets.h"
#include "border.h"

#include "read.h"
#include "layouts.h"
#include "orientation.h"
#include "messages.h"
#include "options.h"
#include "progress.h"
#include "load.h"
#include "save.h"
#include "look.h"
#include "convert.h"
#include "filter.h"
#include "bake.h"

/* --------------------------------------------------------------------------------- >>gallery -- */

/* demo and docs: a folder of pictures, with progress over all of them. */
static int run_gallery(const options *o, envmap_result (*paint)(gallery *)) {
    gallery g = {0};
    envmap_result result;
    meter m = meter_start(o);
    int status = make_folder(o->files[0]);
    if (status) return status;
    g.folder = o->files[0];
    g.desc = describe(o, &m);
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
    {"bake", "IN|FOLDER DIR", 2,
     LOAD_OPTIONS "--for --size --levels --bend --lobe --sun --sheen --tolerance --verify --threads "
                  "--exposure --progress ",
     "Writes what an engine loads: filtered cubes, irradiance, table, preview, manifest.",
     "envmap bake sky.hdr out/ --for filament --sun", run_bake},
    {"info", "FILE", 1, LOAD_OPTIONS, "Prints shape, radiance, contrast and damage of a map.",
     "envmap info sky.hdr", run_info},
    {"convert", "IN OUT", 2, LOAD_OPTIONS "--to --size --border --format --exposure ",
     "Brings a map into another parameterization, size or kind of file.",
     "envmap convert sky.hdr sky-cube.pfm --to cube --size 128", run_convert},
    {"mips", "IN PREFIX|OUT.ktx2", 2, LOAD_OPTIONS "--to --size --border --format ",
     "Writes every mip level, weighted by solid angle: PREFIX0.pfm ..., or a ktx2, ktx or dds.",
     "envmap mips sky.hdr sky-level- --to cube --size 128", run_mips},
    {"plan", "IN", 1,
     LOAD_OPTIONS "--to --size --slices --lobe --exponent --sharpness --alpha --s --tolerance ",
     "Says how much of everything a map, a lobe and a tolerance need, why, and what it will cost.",
     "envmap plan sky.hdr --lobe phong --exponent 100 --tolerance 1e-3", run_plan},
    {"filter", "IN OUT", 2,
     LOAD_OPTIONS "--to --size --border --slices --lobe --exponent --sharpness --alpha --s "
                  "--raw --scale "
                  "--method --tolerance --threshold --threads --format --exposure --progress ",
     "Filters a map with a lobe into a cube as small as `plan` says, or what --to and --size say.",
     "envmap filter sky.hdr gloss.pfm --lobe phong --exponent 50 --to cube --size 32", run_filter},
    {"sh", "IN", 1, LOAD_OPTIONS "--glsl --window ",
     "Prints nine spherical harmonic coefficients, or GLSL that lights with them.",
     "envmap sh sky.hdr --glsl", run_sh},
    {"compare", "A B", 2, LOAD_OPTIONS, "Prints how far A is from B, the truth.",
     "envmap compare fast.pfm exact.pfm --mapping cube", run_compare},
    {"generate", "SCENE OUT", 2, "--to --size --border --format --exposure ",
     "Makes an environment, overcast, studio or sun, or a sky with labels on its axes: labels.",
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
        fprintf(to, "  %-9s %-19s %s\n", commands[k].name, commands[k].files, commands[k].what);
    fputs("\n  COMMAND --help lists its options.\n"
          "files:   Radiance (.hdr, .pic), PFM and OpenEXR; \"-\" reads standard input, and % in\n"
          "         a name stands for px nx py ny pz nz, so that six files are one cube. Shapes:\n"
          "         lat-long, strips and crosses of a cube; squares need --mapping.\n"
          "         Written by a name's ending: " SAVE_NAMES "; six files with %.\n"
          "example: envmap filter sky.hdr gloss.pfm --lobe phong --exponent 50\n"
          "status:  0 done, 1 wrong use, 2 file or format, 3 out of range or refused\n",
          to);
}

static int run_command(const command *c, char **arguments) {
    options o = defaults;
    int status;
    command_name = c->name;
    status = parse_arguments(&o, c, arguments);
    if (status) return status;
    if (!o.help) return c->run(&o);
    print_help(c);
    return DONE;
}

static int run(char **arguments) {
    const char *name = arguments[0];
    int k;
    if (!name) {
        print_commands(stderr);
        return USAGE_ERROR;
    }
    for (k = 0; k < COMMAND_COUNT; k++)
        if (!strcmp(name, commands[k].name)) return run_command(&commands[k], arguments + 1);
    if (!strcmp(name, "--help") || !strcmp(name, "-h") || !strcmp(name, "help")) {
        print_commands(stdout);
        return DONE;
    }
    if (!strcmp(name, "--version")) {
        printf("envmap %d.%d.%d\n", ENVMAP_VERSION / 10000, ENVMAP_VERSION / 100 % 100,
               ENVMAP_VERSION % 100);
        return DONE;
    }
    command_name = name;
    return fail(USAGE_ERROR, "no such command", name, "envmap --help lists them");
}

int main(int argc, char **argv) {
    int status;
    system_start();
    status = run(argv + (argc > 0));
    if (workers.threads) threads_end(&workers);
    if ((fflush(stdout) || ferror(stdout)) && status == DONE)
        status = fail(FILE_ERROR, "standard output", why_not(errno), NULL);
    return status;
}

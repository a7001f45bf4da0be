/* bake_manifest.h - manifest.json: what was written, in which convention, how exactly. Include
   after bake_job.h.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_MANIFEST_H
#define BAKE_MANIFEST_H

#include <stdarg.h>

/* Text as JSON's, with its quotes. */
static inline void manifest_text(FILE *to, const char *text) {
    putc('"', to);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\') putc('\\', to);
        if ((unsigned char)*text < 32) fprintf(to, "\\u%04x", (unsigned)(unsigned char)*text);
        else putc(*text, to);
    }
    putc('"', to);
}

static inline void manifest_pair(FILE *to, const char *name, const char *value, const char *end) {
    fprintf(to, "\"%s\": ", name);
    manifest_text(to, value);
    fputs(end, to);
}

/* count numbers, in groups of three where there are more. */
static inline void manifest_numbers(FILE *to, const double *values, int count) {
    int k;
    fputs(count > 3 ? "[[" : "[", to);
    for (k = 0; k < count; k++)
        fprintf(to, "%s%.9g", k == 0 ? "" : k % 3 ? ", " : "], [", values[k]);
    fputs(count > 3 ? "]]" : "]", to);
}

static inline void manifest_files(FILE *to, const bake_job *j) {
    int k;
    fputs("  \"files\": [\n", to);
    for (k = 0; k < j->file_count; k++) {
        const bake_file *f = &j->files[k];
        fprintf(to, "    {\"name\": \"%s\", ", f->name);
        manifest_pair(to, "holds", f->what, ", ");
        fprintf(to,
                "\"container\": \"%s\", \"format\": \"%s\", \"edge\": %d, \"levels\": %d, "
                "\"faces\": %d,\n     \"numbers_saturated\": %ld, \"rms_lost_by_format\": %.3g, "
                "\"energy_lost\": %.3g},\n",
                f->container, f->format, f->size, f->levels, f->faces, f->saturated, f->error,
                f->lost);
    }
    fputs("    {\"name\": \"preview.png\", \"holds\": \"balls lit by what was read back from the "
          "files\"}],\n",
          to);
}

static inline void manifest_level(FILE *to, const bake_job *j, int l) {
    const bake_level *level = &j->levels[l];
    fprintf(to,
            "    {\"level\": %d, \"edge\": %d, \"roughness\": %.6g, \"alpha\": %.6g, "
            "\"rms_lost_by_format\": %.3g, \"measured_rms\": ",
            l, j->size >> l > 1 ? j->size >> l : 1, level->roughness, level->alpha, level->stored);
    if (level->measured < 0) fputs("null, \"measured_worst\": null}", to);
    else fprintf(to, "%.3g, \"measured_worst\": %.3g}", level->measured, level->worst);
    fputs(l + 1 < j->level_count ? ",\n" : "],\n", to);
}

static inline void manifest_specular(FILE *to, const bake_job *j) {
    double bend = j->o->bend >= 0 ? j->o->bend : j->preset->bend;
    int l;
    fputs("  \"specular\": {\n    ", to);
    manifest_pair(to, "lobe", lobe_words[j->lobe], ",\n    ");
    if (j->preset->scale > 0 && j->o->bend < 0)
        fprintf(to, "\"level\": \"%g log2(edge roughness^2)\",\n", j->preset->scale);
    else
        fprintf(to,
                "\"level\": \"(levels - 1) roughness (1 + %g - %g roughness)\", \"bend\": %g,\n",
                bend, bend, bend);
    fputs("    \"holds\": \"the mean radiance under the lobe, n = v = r, alpha = roughness^2; a "
          "constant environment stays itself\",\n",
          to);
    fprintf(to, "    \"tolerance\": %g, \"texels_measured\": %d,\n",
            j->o->tolerance > 0 ? j->o->tolerance : 1e-3, j->o->verify);
    fputs(j->o->verify
              ? "    \"measured\": \"the file's texels against sums over every texel of the "
                "source, in double; null: the lobe is thinner than two texels, where the definition is "
                "another\"},\n"
              : "    \"measured\": \"not measured: --verify 200 holds 200 texels of each level "
                "against sums over every texel of the source\"},\n",
          to);
    fputs("  \"levels\": [\n", to);
    for (l = 0; l < j->level_count; l++) manifest_level(to, j, l);
}

static inline void manifest_diffuse(FILE *to, const bake_job *j) {
    fputs(
        "  \"harmonics\": {\n"
        "    \"basis\": \"real, orthonormal, no Condon-Shortley phase, of the engine's x, y, z: 1; "
        "y, z, x; xy, yz, 3zz-1, xz, xx-yy\",\n"
        "    \"radiance\": ",
        to);
    manifest_numbers(to, j->sh, 27);
    fputs(",\n    \"irradiance_over_pi\": ", to);
    manifest_numbers(to, j->diffuse, 27);
    fprintf(to, ",\n    \"rms_that_windowing_would_move\": %.3g,\n", j->ringing);
    fputs(
        "    \"zh3\": {\"holds\": \"the first four of radiance, and for l = 2 one number a channel "
        "times sqrt(4 pi / 5) Y_2m(axis)\", \"axis\": ",
        to);
    manifest_numbers(to, j->axis, 3);
    fputs(", \"zonal\": ", to);
    manifest_numbers(to, j->zonal, 3);
    fputs("}},\n", to);
}

static inline void manifest_lights(FILE *to, const bake_job *j) {
    int k, c;
    fputs("  \"lights\": [", to);
    for (k = 0; k < j->light_count; k++) {
        const bake_light *l = &j->lights[k];
        double engine[3], colour[3], most = 0;
        bake_to_engine(engine, j->preset, l->direction);
        for (c = 0; c < 3; c++) most = fmax(most, l->irradiance[c]);
        for (c = 0; c < 3; c++) colour[c] = most > 0 ? l->irradiance[c] / most : 0;
        fprintf(to, "%s\n    {\"direction_towards\": ", k ? "," : "");
        manifest_numbers(to, engine, 3);
        fputs(", \"irradiance\": ", to);
        manifest_numbers(to, l->irradiance, 3);
        fputs(", \"colour\": ", to);
        manifest_numbers(to, colour, 3);
        fprintf(to, ", \"diameter_degrees\": %.4g, \"share_of_energy\": %.4g}", l->diameter,
                l->share);
    }
    fputs("],\n", to);
}

static inline void manifest_head(FILE *to, const bake_job *j) {
    fputs("{\n  ", to);
    manifest_pair(to, "made_by", "envmap bake", ",\n  ");
    manifest_pair(to, "source", j->input, ",\n  ");
    fprintf(to, "\"source_mapping\": \"%s\", \"source_edge\": %d,\n  ",
            mapping_words[j->source_mapping], j->source_size);
    manifest_pair(to, "for", j->preset->name, ",\n  ");
    manifest_pair(to, "engine", j->preset->remark, ",\n");
    fputs("  \"conventions\": {\n    ", to);
    manifest_pair(to, "space", j->preset->space, ",\n    ");
    fprintf(to, "\"our_x_y_z_as_engine_axes\": [%d, %d, %d],\n    ", j->preset->axes[0],
            j->preset->axes[1], j->preset->axes[2]);
    manifest_pair(to, "cube",
                  "faces +X -X +Y -Y +Z -Z, row 0 is t = 0, as OpenGL, Vulkan and "
                  "Direct3D look cubes up",
                  ",\n    ");
    manifest_pair(to, "units",
                  "linear radiance as in the source; diffuse light is irradiance / pi: "
                  "times the albedo it is what a surface sends out",
                  ",\n    ");
    manifest_pair(to, "primaries", "those of the source, taken for BT.709", ",\n    ");
    manifest_pair(to, "split_sum",
                  "colour = (f0 R + G) specular; lost between facets, times diffuse "
                  "light: F E (1 - S) / (1 - F (1 - S)), S = R + G, E = f0 R + G, "
                  "F = f0 + (1 - f0) / 21",
                  j->o->sheen ? ",\n    " : "},\n");
    if (j->o->sheen)
        manifest_pair(to, "sheen",
                      "B is what Charlie (Estevez and Kulla), with Neubelt and Pettineo's "
                      "visibility, reflects of a white environment: sheen colour B times a chain "
                      "of lobe charlie; what lies below gets 1 - B times the largest channel",
                      "},\n");
}

/* 0, or an exit status. Written last: a folder that has it has everything. */
static inline int bake_manifest(bake_job *j) {
    write_file w;
    int error;
    if (write_open(&w, bake_path(j, "manifest.json"))) {
        manifest_head(w.file, j);
        manifest_files(w.file, j);
        if (j->preset->container != BAKE_NONE) manifest_specular(w.file, j);
        manifest_diffuse(w.file, j);
        manifest_lights(w.file, j);
        fprintf(w.file,
                "  \"energy\": {\"limit\": %.9g, \"numbers_limited\": %d, "
                "\"share_that_the_limit_took\": %.4g},\n",
                j->o->limit, j->cleaned.limited, j->cleaned.energy);
        fprintf(w.file,
                "  \"seconds\": {\"reading\": %.3f, \"lights\": %.3f, \"specular\": %.3f, "
                "\"diffuse\": %.3f, \"writing\": %.3f, \"measuring\": %.3f, \"threads\": %d}\n}\n",
                j->seconds[0], j->seconds[1], j->seconds[2], j->seconds[3], j->seconds[4],
                j->seconds[5], workers.threads);
    }
    error = write_close(&w);
    return error ? bake_wrong_file(j, error) : DONE;
}

#endif /* BAKE_MANIFEST_H */

/* filter.h - the commands that have to do with a lobe: plan, filter, sh. Include after convert.h.

   SPDX-License-Identifier: MIT */

#ifndef FILTER_H
#define FILTER_H

#include <math.h>

/* *alpha is what some lobes borrow, so it must outlive the lobe. */
static inline envmap_lobe chosen_lobe(double *alpha, const options *o) {
    envmap_lobe lobe = envmap_lobe_mirror();
    *alpha = o->alpha;
    switch (o->lobe) {
    case LOBE_DIFFUSE: lobe = envmap_lobe_diffuse(); break;
    case LOBE_PHONG: lobe = envmap_lobe_phong((float)o->exponent); break;
    case LOBE_GAUSSIAN: lobe = envmap_lobe_gaussian((float)o->sharpness); break;
    case LOBE_GGX: lobe = envmap_lobe_ggx((float)o->alpha); break;
    case LOBE_BANKS: lobe = envmap_lobe_banks((float)o->s); break;
    case LOBE_CHARLIE: lobe = sheen_lobe(alpha); break;
    default: break;
    }
    lobe.raw = o->raw;
    lobe.scale = (float)o->scale;
    return lobe;
}

/* What the output needs to be, and the options with the defaults that follow: a cube of the edge
   that loses nothing, or as fine as the source where that is less. */
static inline int plan_for(envmap_plan *needs, options *asked, const envmap *in, const options *o) {
    envmap shape = no_map;
    double alpha;
    envmap_lobe lobe = chosen_lobe(&alpha, o);
    envmap_filter_desc desc;
    int status;
    *asked = *o;
    if (asked->to < 0) asked->to = ENVMAP_CUBE;
    if (asked->slices == defaults.slices && o->lobe == LOBE_BANKS) asked->slices = 16;
    if (asked->slices == 1 && in->slices > 1) asked->slices = in->slices;
    desc = describe(o, NULL);
    desc.work.progress.report = NULL;
    shape.mapping = asked->to, shape.levels = 1, shape.slices = asked->slices;
    shape.size = o->size > 0 ? o->size : natural_size(in, asked->to);
    status = check(envmap_filter_plan(needs, &shape, in, &lobe, &desc), lobe_words[o->lobe]);
    if (status || o->size > 0) return status;
    asked->size = needs->size < shape.size ? needs->size : shape.size;
    shape.size = asked->size; /* what that costs, and loses */
    return check(envmap_filter_plan(needs, &shape, in, &lobe, &desc), lobe_words[o->lobe]);
}

static inline const char *lobe_text(char text[64], const options *o) {
    static const char *const names[] = {NULL, NULL, "N", "lambda", "alpha", "s", "alpha"};
    double value = o->lobe == LOBE_PHONG      ? o->exponent
                   : o->lobe == LOBE_GAUSSIAN ? o->sharpness
                   : o->lobe == LOBE_BANKS    ? o->s
                                              : o->alpha;
    if (names[o->lobe])
        snprintf(text, 64, "%s, %s = %g", lobe_words[o->lobe], names[o->lobe], value);
    else snprintf(text, 64, "%s", lobe_words[o->lobe]);
    return text;
}

static inline void print_scene(const envmap_plan *n, double tolerance) {
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

static inline void print_size(const envmap_plan *n, const options *asked, const options *o,
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

static inline void print_method(const envmap_plan *n) {
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
static inline double filter_seconds(const envmap *in, const options *asked, int method, int size) {
    envmap out = no_map;
    double alpha;
    envmap_lobe lobe = chosen_lobe(&alpha, asked);
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
static inline void print_time(const envmap_plan *n, const envmap *in, const options *asked) {
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
static inline int print_fit(const options *o) {
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

static inline int run_plan(const options *o) {
    envmap in;
    envmap_plan needs;
    options asked;
    char text[64];
    double tolerance = o->tolerance > 0 ? fmin(fmax(o->tolerance, 1e-7), 0.1) : 1e-3;
    int status = load(&in, o->files[0], o);
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
static inline int filter_into(envmap *out, const envmap *in, const options *o) {
    options asked;
    double alpha;
    envmap_lobe lobe = chosen_lobe(&alpha, o);
    envmap_plan needs;
    envmap_filter_desc desc;
    envmap_result result;
    meter m = meter_start(o);
    int status = DONE;
    asked = *o;
    if (o->size < 0) status = plan_for(&needs, &asked, in, o);
    if (asked.to < 0) asked.to = ENVMAP_CUBE;
    if (asked.slices == defaults.slices && o->lobe == LOBE_BANKS) asked.slices = 16;
    if (!status && asked.to == ENVMAP_LATLONG && asked.slices > 1)
        status = fail(USAGE_ERROR, "--to latlong", "a file of a lat-long holds one slice",
                      "--to cube holds several");
    if (!status) status = create_output(out, in, &asked, 1, asked.slices);
    if (status) return status;
    desc = describe(o, &m);
    result = envmap_filter(out, in, &lobe, &desc);
    meter_stop(&m);
    return check(result, lobe_words[o->lobe]);
}

static inline int run_filter(const options *o) {
    envmap in, out = no_map;
    int status = check_output(o);
    if (!status) status = load(&in, o->files[0], o);
    if (status) return status;
    status = filter_into(&out, &in, o);
    if (!status) status = add_border(&out, o);
    if (!status) status = save(&out, o->files[1], o);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

/* Nine coefficients, convolved, as GLSL: envmap_sh_pack's layout. */
static inline void print_glsl(const char *path, const float packed[28]) {
    char text[SHADER_ROOM];
    shader_diffuse(text, packed);
    printf("// of %s\n%s", path, text);
}

static inline void print_coefficients(const double sh[27]) {
    int k;
    printf("  l  m %14s %14s %14s   radiance\n", "R", "G", "B");
    for (k = 0; k < 9; k++) {
        int l = k > 3 ? 2 : k > 0;
        printf("  %d %2d %14.7g %14.7g %14.7g\n", l, k - l * (l + 1), sh[3 * k], sh[3 * k + 1],
               sh[3 * k + 2]);
    }
}

static inline int run_sh(const options *o) {
    envmap in;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    double sh[27], windowed[27], moved = 0;
    float packed[28];
    int status = load(&in, o->files[0], o);
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

#endif /* FILTER_H */

/* SPDX-License-Identifier: MIT
   The search (search.c) with fixed seeds, on maps small enough for seconds: a test passes when no
   promise of its works breaks. Times are not judged here. */
#include "search_run.h"

static search state;

/* Draws `count` works, and makes each one of a check, with maps of few texels. */
static void draw(int check, int count, unsigned long long seed) {
    int findings = state.findings;
    judge_budget = 0.03;
    count = test_many(count);
    for (int n = 0; n < count; ++n) {
        work w = search_draw(seed, n);
        w.check = check, w.method = ENVMAP_METHOD_AUTO;
        w.src_size = w.src_size > 48 ? 24 + w.src_size % 40 : w.src_size;
        int dear = w.tolerance < 1e-5 || (w.lobe >= LOBE_CONE && w.a < 0.05);
        w.dst_size = 1 + w.dst_size % (dear ? 3 : 8); /* texels of a sharp lobe cost 40 ms each */
        if (w.dst_slices > 3) w.src_slices = w.src_slices > 1 ? 3 : 1, w.dst_slices = 3;
        verdict v = check_work(&w);
        v.over[PROMISE_COST] = v.over[PROMISE_CLIFF] = -1;
        search_add(&state, &w, &v, 0);
    }
    CHECK(state.works > 0 && state.findings == findings);
}

static void random_filters_keep_their_tolerance(void) { draw(CHECK_FILTER, 50, 1); }
static void random_chains_keep_their_tolerance(void) { draw(CHECK_CHAIN, 10, 2); }
static void random_prepared_sources_keep_their_tolerance(void) { draw(CHECK_PREPARED, 15, 3); }
static void random_constants_stay_themselves(void) { draw(CHECK_FURNACE, 20, 4); }
static void random_orders_of_tasks_give_the_same_bits(void) { draw(CHECK_EXECUTORS, 15, 5); }
static void random_failures_leave_everything_as_it_was(void) { draw(CHECK_FAILURES, 30, 6); }
static void random_plans_are_in_range(void) { draw(CHECK_PLAN, 20, 7); }
static void random_lobes_are_their_formulas(void) { draw(CHECK_LOBES, 40, 8); }
static void random_harmonics_are_their_sums(void) { draw(CHECK_HARMONICS, 40, 9); }
static void random_windows_end_all_ringing(void) { draw(CHECK_WINDOW, 40, 10); }
static void random_maps_are_resampled_to_means(void) { draw(CHECK_RESAMPLE, 40, 11); }
static void random_levels_are_means_of_those_above(void) { draw(CHECK_MIPS, 40, 12); }
static void random_lookups_are_bilinear_everywhere(void) { draw(CHECK_LOOKUPS, 40, 13); }

/* What a search prints can be given to it again. */
static void a_work_reads_back_as_it_was_printed(void) {
    for (int n = 0; n < 200; ++n) {
        char text[512], again[512];
        work w = search_draw(14, n), back;
        work_print(text, sizeof text, &w);
        CHECK(work_read(&back, text));
        work_print(again, sizeof again, &back);
        CHECK(!strcmp(text, again));
    }
}

/* The oracle and the library's reference are two programs of one definition: they agree to 1e-6 as
   long as texels count at their centres; the bilinear radiance of thinner lobes is an integral that
   both do by quadrature, the reference to some percent in the worst scenes, and worse for axes that
   look exactly at the point where all of a rim's texels meet. */
static void the_oracle_is_the_reference(void) {
    double wide = 0, thin = 0;
    for (int n = 0; n < test_many(40); ++n) {
        work w = search_draw(15, n);
        w.check = CHECK_FILTER, w.method = ENVMAP_METHOD_REFERENCE, w.tolerance = 1e-2;
        w.src_size = 3 + w.src_size % 20, w.dst_size = 1 + w.dst_size % 3;
        w.src_slices = 1, w.dst_slices = 1 + w.dst_slices % 2;
        if (w.lobe == LOBE_SLIDE) w.dst_size = w.dst_slices = 1; /* 200 ms each where it is sharp */
        if (w.scene == SCENE_TEXEL || w.scene == SCENE_SUN || w.scene == SCENE_CHECKER)
            w.scene = SCENE_NOISE;
        verdict v = check_work(&w);
        double off = v.value[PROMISE_RMS] * w.tolerance;
        if (work_texels(&w) >= 2) wide = fmax(wide, off);
        else thin = fmax(thin, off);
    }
    FIGURE("lobes of two texels and more, rms", wide, 1e-6);
    FIGURE("thinner ones", thin, 1e-3);
}

/* Its two sums of the bilinear radiance, by rings about an axis and by rings about a disc's centre,
   agree, for an axis that looks at the rim too. */
static void the_oracles_rings_and_discs_agree(void) {
    static const char *const sources[3] = {"paraboloid:9", "sphere:12", "angular:15"};
    static const char *const lobes[3] = {"phong:400:0", "banks:0.99:0", "ggx:0.02:0"};
    double of_k = 0, of_light = 0;
    for (int i = 0; i < 27; ++i) {
        char text[300];
        work w;
        bench b;
        snprintf(text, sizeof text,
                 "check=filter method=auto src=%s:1 dst=cube:3:1 lobe=%s raw=0:1 tolerance=0.001 "
                 "scene=noise:0.3:0.3 times=1 seed=3",
                 sources[i % 3], lobes[i / 3 % 3]);
        CHECK(work_read(&w, text) && bench_create(&b, &w));
        oracle_filter f = judge_filter(&b, 0, 1);
        double rings[4] = {0, 0, 0, 0}, discs[4] = {0, 0, 0, 0}, a[3] = {0, 0, i / 9 % 2 ? 1 : -1};
        double reach = f.from > 0 ? f.to : fmin(fmax(12 * f.extent, 8 * f.sigma), f.to);
        if (i / 9 == 2) oracle_axis_of(a, ENVMAP_CUBE, 3, b.dst_texels + 5 * (i / 9) + 1);
        f.fine = 4;
        oracle_polar(rings, &f, a, reach), oracle_discs(discs, &f, a, reach);
        of_k = fmax(of_k, fabs(rings[3] / discs[3] - 1));
        of_light = fmax(of_light, fabs(rings[0] / discs[0] - 1));
        bench_free(&b);
    }
    FIGURE("k, relative", of_k, 1e-6);
    FIGURE("light, relative", of_light, 2e-5);
}

/* Works that broke a promise, or showed the oracle to be wrong, one of each kind. */
static void works_that_broke_hold(void) {
    static const char *const works[][2] = {
        {"cube:16:1 dst=cube:2:3 lobe=banks:0.99:0 raw=0:1 tolerance=1e-5", "texel:0.3:0.3"},
        {"cube:24:3 dst=cube:3:3 lobe=banks:0.988:0 raw=0:1 tolerance=1e-4",
         "noise:0.4:0"}, /* every slice has its own light */
        {"cube:32:1 dst=latlong:126:1 lobe=phong:12:0 raw=0:1 tolerance=2.3e-6",
         "texel:0.49:0.154632669"}, /* bands of floats, beside a lamp */
        {"paraboloid:11:1 dst=cube:6:1 lobe=ring:1:4.4 raw=0:1 tolerance=3e-3",
         "texel:0.25:0.5"}, /* it is all beyond the definition's reach, which points have not */
        {"octahedral:24:1 dst=cube:2:2 lobe=banks:0.98:0 raw=0:1 tolerance=1e-5", "lamps:0.4:0"},
        {"sphere:20:1 dst=cube:1:1 lobe=phong:90:0 raw=0:1 tolerance=1e-5", "texel:0.02:0.5"},
        {"cube:16:1 dst=latlong:3:1 lobe=slide:0.13:0.4 raw=0:1 tolerance=1e-5", "half:0.6:0"},
        {"octahedral:16:1 dst=cube:1:1 lobe=two:0.14:0.8 raw=0:1 tolerance=1e-5", "texel:0.4:0.8"},
        {"paraboloid:11:1 dst=cube:6:2 lobe=banks:0.978106141:0 raw=0:1 tolerance=2e-4",
         "sun:0.981366244:0.760661091"},
        {"latlong:1:1 dst=angular:9:1 lobe=gaussian:2e5:0 raw=0:1 tolerance=.03", "checker:.03:0"},
        {"paraboloid:11:1 dst=cube:3:2 lobe=banks:0.978106141:0 raw=0:1 tolerance=1.5e-6",
         "sun:0.981366244:0.760661091"},
        {"cube:2:1 dst=angular:30:1 lobe=banks:0.96843344:0 raw=0:1 tolerance=5e-6",
         "texel:0.49:0.25"},
        {"sphere:4:1 dst=angular:5:1 lobe=phong:2.4:0 raw=0:1 tolerance=6e-6", "texel:0.89:0.42"},
        {"sphere:20:1 dst=cube:4:1 lobe=phong:300:0 raw=0:1 tolerance=1.5e-6", "sun:0.98:0.76"},
        {"paraboloid:11:1 dst=cube:4:1 lobe=phong:300:0 raw=0:1 tolerance=1.5e-6", "sun:0.98:0.76"},
        {"paraboloid:64:1 dst=cube:6:1 lobe=ggx:0.0086:0 raw=0:1 tolerance=1.1e-5",
         "sun:0.86:0.63"},
        {"latlong:64:1 dst=cube:5:1 lobe=cone:0.051:0 raw=0:1 tolerance=1e-6", "lamps:0.83:0.44"},
        {"latlong:80:1 dst=cube:3:1 lobe=cone:0.0830696523:0 raw=0:1 tolerance=1e-4",
         "texel:0.457941309:0"},
        {"angular:101:1 dst=angular:8:1 lobe=gaussian:48000:0 raw=0:1 tolerance=.017",
         "lamps:.7:0"},
        {"angular:68:1 dst=octahedral:9:1 lobe=ggx:0.0384:0 raw=0:1 tolerance=.001",
         "checker:.7:.3"},
        {"sphere:64:1 dst=sphere:4:1 lobe=table:0.0366620868:25 raw=0:1 tolerance=.001",
         "half:.5:0"},
        {"octahedral:95:1 dst=sphere:5:1 lobe=power:12.9:0 raw=0:1 tolerance=.001", "sun:.8:.3"},
        {"sphere:2:1 dst=cube:4:1 lobe=phong:50:0 raw=0:1 tolerance=1e-3", "texel:0.52:0.999999"},
        {"sphere:30:1 dst=cube:3:1 lobe=phong:54.6:0 raw=0:1 tolerance=1.1e-6",
         "lamps:0.516955288:0.999999"},
        {"cube:64:1 dst=cube:30:1 lobe=banks:0.99:0 raw=0:1 tolerance=3e-5", "constant:0.2:0"},
        {"octahedral:68:1 dst=paraboloid:6:1 lobe=cone:0.0613602251:0 raw=1:2.36 tolerance=1e-6",
         "colours:0.884963805:0.999999"},
        {"cube:34:1 dst=angular:5:1 lobe=cone:0.0727:0 raw=0:1 tolerance=8.7e-5",
         "lamps:0.579380556:0.999999"},
        {"paraboloid:6:1 dst=cube:3:1 lobe=phong:4.13537169:0 raw=1:3.54 tolerance=6e-6",
         "sun:0.165193177:0"},
        {"sphere:16:1 dst=paraboloid:3:1 lobe=cone:0.192073166:0 raw=0:1 tolerance=1.26e-5",
         "lamps:0.644452387:0.288706575"},
        {"paraboloid:8:1 dst=cube:1:1 lobe=ggx:0.0129005723:0 raw=0:1 tolerance=0.0219463",
         "texel:0.0508344271:0.895431301"},
        {"angular:84:1 dst=octahedral:4:1 lobe=ggx:0.012541174:0 raw=0:1 tolerance=1e-3",
         "checker:0.502387079:0.695044267"},
        {"angular:128:1 dst=sphere:4:1 lobe=two:0.0500000007:0.07 raw=1:1 tolerance=2e-05",
         "constant:0.23:0.62"}, /* a tip at an axis, on which a texel's centre lies */
        {"latlong:17:1 dst=octahedral:4:1 lobe=banks:0.980747223:0 raw=0:1 tolerance=0.00026256",
         "texel:0.210044662:0"}, /* rings touch the pole, beside which the light is */
        {"paraboloid:20:1 dst=latlong:12:1 lobe=ring:0.19334662:0.750169062 raw=0:1 "
         "tolerance=0.000132594",
         "texel:0.975975607:0.150255181"}, /* beyond the rim, where only a blend shows it */
        {"octahedral:22:1 dst=paraboloid:4:1 lobe=ring:0.4:3 raw=0:1 tolerance=1e-6",
         "texel:0.5:0.5"}, /* its width ends at the antipode: there the oracle was wrong */
        {"angular:9:3 dst=angular:2:3 lobe=banks:0.976459801:0 raw=0:1 tolerance=1.02876e-06",
         "lamps:0.761105576:0.886183232"}, /* rings beside the point where a rim's texels meet */
        {"sphere:9:1 dst=cube:3:2 lobe=banks:0.97:0 raw=0:1 tolerance=1e-06", "texel:0.3:0.1"},
        {"cube:3:1 dst=paraboloid:16:1 lobe=banks:0.88526684:0 raw=1:0.565039814 "
         "tolerance=2.21419e-06",
         "texel:0.460414119:0"},
        {"sphere:64:1 dst=octahedral:13:1 lobe=ggx:0.000624458306:0 raw=1:1.0402292 "
         "tolerance=0.000304016",
         "decades:0.575795735:0.499298301"}, /* a ring's nodes beside -z are of length 1 */
        {"octahedral:8:1 dst=sphere:12:1 lobe=cone:0.227254197:0 raw=0:1 tolerance=3e-4",
         "checker:0.32:0.46"},
        {"angular:63:1 dst=angular:8:1 lobe=ggx:0.000558850414:0 raw=1:4.13451624 tolerance=3.7e-5",
         "checker:0.833008444:0.491988308"}, /* u and v are nearly one line beside a rim */
        {"sphere:50:1 dst=cube:4:1 lobe=ggx:0.00056:0 raw=1:1 tolerance=1e-5", "noise:0.8:0.5"},
        {"octahedral:40:1 dst=latlong:3:1 lobe=ggx:0.01:0 raw=1:1 tolerance=2e-5",
         "noise:0.8:0.5"}, /* axes on the fold */
        {"paraboloid:9:1 dst=cube:3:2 lobe=banks:0.95:0 raw=0:1 tolerance=1e-3", "texel:0.05:0.1"},
        {"paraboloid:9:1 dst=cube:3:2 lobe=banks:0.95:0 raw=0:1 tolerance=2e-5",
         "texel:0.05:0.1"}, /* rings in the paraboloids' blend */
        {"paraboloid:5:1 dst=latlong:1:1 lobe=hat:0.0693762824:0.170244212 raw=1:0.142414078 "
         "tolerance=4.25127e-05",
         "lamps:0.971183395:0"}, /* rings are not exact enough where paraboloids blend */
        {"sphere:56:1 dst=octahedral:12:1 lobe=phong:1000:0 raw=0:1 tolerance=1e-3",
         "texel:0.553382763:0"}, /* beside a rim */
        {"sphere:56:1 dst=octahedral:5:1 lobe=phong:1000:0 raw=0:1 tolerance=2e-5",
         "texel:0.553382763:0"}, /* rings about the axis lose 7 % of a dark texel */
        {"sphere:56:1 dst=octahedral:5:1 lobe=cone:.1:0 raw=0:1 tolerance=2e-5",
         "texel:0.553382763:0"},
        {"angular:60:1 dst=octahedral:8:1 lobe=phong:1000:0 raw=0:1 tolerance=1e-5",
         "texel:0.15:0.15"},
        {"sphere:2:1 dst=octahedral:6:1 lobe=phong:0.05:0 raw=0:1 tolerance=1e-6",
         "half:0.3:0.2"}, /* x^N has a root where it ends */
        {"angular:40:1 dst=latlong:5:1 lobe=ggx:0.05:0 raw=0:1 tolerance=1e-3",
         "texel:0.553382763:0"},
        {"sphere:56:1 dst=octahedral:8:1 lobe=power:20:0 raw=0:1 tolerance=1e-3",
         "texel:0.553382763:0"}, /* rings through the point where a rim's texels meet */
        {"sphere:104:1 dst=cube:17:1 lobe=ggx:0.0644071177:0 raw=0:1 tolerance=1.14494e-05",
         "half:0.963281819:0.124846249"}, /* points have tents where the definition has none */
        {"octahedral:64:1 dst=cube:6:1 lobe=ggx:0.0805:0 raw=0:1 tolerance=1e-4", "texel:0.55:0.3"},
        {"sphere:64:1 dst=cube:6:1 lobe=ggx:0.0909:0 raw=0:1 tolerance=1e-4",
         "texel:0.55:0.3"}, /* and a tail of GGX has centres where it has tents */
        {"latlong:92:1 dst=paraboloid:11:1 lobe=banks:0.996292055:0 raw=0:1 tolerance=1.02283e-06",
         "colours:0.631192672:0.999999"}, /* two places for a tent across a ring's edge */
        {"paraboloid:87:1 dst=cube:15:1 lobe=ring:0.05:0.06 raw=0:1 tolerance=1e-3",
         "texel:0.71:0.47"},
        {"cube:64:1 dst=cube:2:1 lobe=two:0.034:0.3 raw=0:1 tolerance=1e-3",
         "texel:0.73:0.999999"}, /* functions whose last flank was left to harmonics */
        {"cube:65:1 dst=latlong:5:1 lobe=two:0.0340863913:0.321477612 raw=0:1 tolerance=1e-3",
         "texel:0.725868572:0.999999"},
        {"paraboloid:47:1 dst=paraboloid:8:1 lobe=gaussian:700:0 raw=0:1 tolerance=2e-6",
         "texel:0.0025:0.55"}, /* windows in the paraboloids' blend */
        {"octahedral:7:1 dst=cube:1:1 lobe=slide:1:0.2 raw=0:1 tolerance=5e-6",
         "texel:0.66:0.55"}, /* tents across folds */
        {"octahedral:99:1 dst=cube:3:1 lobe=ring:0.07:0.532486443 raw=0:1 tolerance=1e-5",
         "lamps:0.27:0.999999"},
        {"cube:1:1 dst=sphere:4:1 lobe=phong:0.0184572637:0 raw=0:1 tolerance=2.5e-6",
         "sun:0.5:0.5"},
        {"latlong:2:1 dst=cube:2:1 lobe=phong:0.3:0 raw=0:1 tolerance=1e-5", "sun:0.5:0.5"},
        {"octahedral:2:1 dst=cube:2:1 lobe=phong:0.2:0 raw=0:1 tolerance=1e-5",
         "sun:0.5:0.5"}, /* jumps and roots at the horizon, where bilinear radiance is integrated */
        {"cube:73:1 dst=cube:1:1 lobe=phong:0.2:0 raw=0:1 tolerance=1e-3",
         "decades:0.75:0.999999"}, /* a row of texels on the horizon, where k jumps */
        {"cube:120:1 dst=cube:9:1 lobe=ring:0.0342:0.0735 raw=0:1 tolerance=1e-3",
         "decades:0.45:0.999999"}, /* a tip at the axis, beside next to nothing but dark */
        {"cube:73:1 dst=latlong:17:1 lobe=ring:0.220708728:0.849142588 raw=0:1 tolerance=9.4e-4",
         "lamps:0.826387743:0.750396734"}, /* 24 bands did not show how slowly a tip's end */
        {"octahedral:20:1 dst=paraboloid:3:1 lobe=cone:0.206:0 raw=0:1 tolerance=1.45e-6",
         "half:0.6:0"}, /* rings touch lines close to an axis on an octahedral fold */
        {"cube:40:1 dst=cube:6:1 lobe=ggx:0.0526:0 raw=0:1 tolerance=1e-4", "texel:0.44:0.43"},
        {"latlong:40:1 dst=cube:5:1 lobe=ggx:0.0912:0 raw=0:1 tolerance=1e-4",
         "texel:0.44:0.43"}, /* tents that ended at one angle, where a tail had centres before */
        {"sphere:84:1 dst=cube:15:1 lobe=ggx:0.0845873579:0 raw=0:1 tolerance=3e-5",
         "texel:0.446:0.796"}, /* a tail over its own sum, which is not its integral */
        {"cube:40:1 dst=cube:6:1 lobe=slide:0.055:0 raw=0:1 tolerance=1e-4",
         "texel:0.44:0.43"}, /* bells whose tents must not fade before they have ended */
        {"paraboloid:1:1 dst=paraboloid:2:1 lobe=phong:0.147704884:0 raw=0:1 tolerance=3.5555e-06",
         "half:0.947290214:0.286497331"}, /* x^0.15 at the horizon */
        {"cube:1:1 dst=angular:4:1 lobe=phong:0.224028885:0 raw=0:1 tolerance=3.51068e-06",
         "half:0.624502328:0.256877401"},
        {"cube:1:1 dst=paraboloid:5:1 lobe=ggx:0.9:0 raw=0:1 tolerance=1e-06",
         "texel:0.64:0.72"}, /* a kink where the lobe ends, across patches */
        {"cube:5:1 dst=paraboloid:6:1 lobe=cone:0.3:0 raw=0:1 tolerance=1e-05",
         "texel:0.64:0.72"}, /* steps of rings, where a cube's u and v bend most */
        {"cube:8:1 dst=paraboloid:6:1 lobe=power:15:0 raw=0:1 tolerance=1e-05",
         "texel:0.64:0.72"}, /* rings through the centre of the lit texel */
        {"paraboloid:28:1 dst=octahedral:3:4 lobe=banks:0.9987:0 raw=0:1 tolerance=1e-3",
         "texel:0.43:0.87"}, /* seen only at the end of a blend, which rings cut too coarsely */
        {"paraboloid:3:1 dst=cube:4:1 lobe=hat:0.03:0.18 raw=0:1 tolerance=1e-3",
         "half:0.53:0.53"}, /* lookups that count negatively had no blend */
        {"latlong:2:1 dst=octahedral:5:1 lobe=diffuse:1:0 raw=0:1 tolerance=1.2e-6",
         "sun:0.39:0.86"}, /* rings about a pole lie on its rows, which the oracle did not know */
        {"cube:8:1 dst=angular:54:1 lobe=cone:0.205032036:0 raw=0:1 tolerance=3.38e-6",
         "lamps:0.222827313:0.999999"}, /* rings that dip into the next cell between two steps */
        {"octahedral:11:1 dst=cube:5:1 lobe=phong:2.3:0 raw=0:1 tolerance=1e-3",
         "texel:0.77:0"}, /* a coarse texel across the horizon, of which a tent is all */
        {"cube:3:1 dst=cube:3:1 lobe=banks:0.93:0 raw=0:1 tolerance=1e-5",
         "texel:0.4:0.6"}, /* circles through points where lines cross a face's side */
        {"octahedral:5:1 dst=cube:3:1 lobe=cone:0.4:0 raw=0:1 tolerance=1e-5", "texel:0.4:0.6"},
        {"latlong:9:1 dst=cube:3:1 lobe=banks:0.96:0 raw=0:1 tolerance=1e-5", "texel:0.4:0.99"},
        {"paraboloid:1:1 dst=cube:3:1 lobe=hat:0.03:0.08 raw=0:1 tolerance=1e-5", "half:0.4:0.9"},
        {"paraboloid:7:1 dst=cube:3:1 lobe=banks:0.9:0 raw=0:1 tolerance=1e-5", "texel:0.4:0.4"},
        {"octahedral:4:1 dst=sphere:5:1 lobe=ggx:0.765:0 raw=1:0.92 tolerance=0.0269",
         "smooth:0.3:0.57"}, /* a block of all texels has no contrast */
        {"latlong:1:1 dst=cube:3:1 lobe=power:2.5:0 raw=0:1 tolerance=1e-3", "noise:0.03:0.85"},
        {"sphere:5:1 dst=cube:4:1 lobe=phong:0:0 raw=0:1 tolerance=1e-3",
         "noise:0.33:0.78"}, /* two places of a tent across a jump */
        {"sphere:95:1 dst=cube:4:1 lobe=gaussian:230:0 raw=0:1 tolerance=1e-3",
         "texel:0.79:0.87"}, /* two places of a long texel's tent */
        {"sphere:2:1 dst=latlong:22:1 lobe=banks:0.992090166:0 raw=0:1 tolerance=1e-3",
         "lamps:0.83:0.33"}, /* thousands of tiles of cells, one of them off by 186 tolerances */
        {"octahedral:1:1 dst=cube:3:2 lobe=banks:0.9963:0 raw=0:1 tolerance=1e-3",
         "constant:0.76:0.07"},
        {"octahedral:2:1 dst=octahedral:5:1 lobe=gaussian:19225.8:0 raw=0:1 tolerance=1.75e-6",
         "texel:0.7:0.47"}, /* long pieces of few nodes each */
        {"octahedral:13:1 dst=cube:2:1 lobe=ggx:0.15:0 raw=0:1 tolerance=1e-6",
         "lamps:0.14:0.69"}, /* the horizon of a GGX, which dark axes see */
        {"paraboloid:21:1 dst=sphere:5:1 lobe=ggx:0.0028:0 raw=0:1 tolerance=5e-6",
         "sun:0.71:0.47"}, /* circles far from the axis through points where lines cross */
        {"angular:8:1 dst=octahedral:4:1 lobe=ggx:0.000157:0 raw=0:1 tolerance=2e-5",
         "lamps:0.61:0.79"}, /* sixty circles a panel */
        {"angular:3:1 dst=cube:3:1 lobe=diffuse:1:0 raw=0:1 tolerance=1e-3",
         "lamps:0.5:0.5"}, /* the rim cuts all texels but the middle's */
        {"cube:3:1 dst=cube:1:1 lobe=diffuse:1:0 raw=0:1 tolerance=1e-3",
         "texel:0.77:0.37"}, /* along its row lies the horizon of four axes */
        {"cube:1:1 dst=paraboloid:11:1 lobe=phong:8e4:0 raw=1:1 tolerance=3.56e-6",
         "constant:0.54:0.12"}, /* axes beside the middle of a cube's edge */
        {"sphere:67:1 dst=octahedral:34:1 lobe=gaussian:250.424:0 raw=0:1 tolerance=1.54e-6",
         "sun:0.0121535493:0.456403833"}, /* texels longer than the lobe, crossed by many lines */
        {"sphere:76:1 dst=sphere:4:1 lobe=ggx:0.09:0 raw=0:1 tolerance=0.02",
         "colours:0.96:0"}, /* tents at a rim */
        {"octahedral:66:1 dst=cube:2:1 lobe=cone:0.3:0 raw=0:1 tolerance=1e-3",
         "checker:0.2:0"}, /* a lattice of its own */
        {"octahedral:2:1 dst=cube:5:3 lobe=banks:0.996868372:0 raw=0:1 tolerance=2.1e-5",
         "constant:0.01:0.98"}, /* a ring thinner than texels */
        {"paraboloid:11:1 dst=sphere:1:2 lobe=banks:0.961574972:0 raw=0:1 tolerance=1.21756e-06",
         "sun:0.738302512:0.204946401"}, /* a ring about a face's middle */
        {"paraboloid:44:1 dst=cube:20:1 lobe=ggx:0.0569:0 raw=0:1 tolerance=1e-4",
         "sun:0:0.44"}, /* a light where paraboloids blend */
        {"sphere:68:1 dst=cube:47:1 lobe=hat:0.183357209:0.17 raw=0:1 tolerance=1e-3",
         "colours:0.54566639:0.494166688"}, /* negative parts between a sphere map's last texels */
        {"sphere:60:1 dst=cube:47:1 lobe=hat:0.14:0.17 raw=0:1 tolerance=1e-3",
         "colours:0.54566639:0.494166688"}, /* the same by points */
        {"octahedral:64:1 dst=octahedral:13:1 lobe=ggx:0.03118:0 raw=0:1 tolerance=1.05e-4",
         "texel:0.4:0.5"}, /* nodes far from an axis */
        {"octahedral:34:1 dst=cube:16:1 lobe=ggx:0.09:0 raw=0:1 tolerance=1e-4",
         "lamps:0.3:0.7"}, /* centres beyond tents */
        {"cube:64:1 dst=cube:1:1 lobe=ggx:0.0101:0 raw=1:4 tolerance=1.2e-6",
         "constant:0.5:0.5"}}; /* whose midpoints show */
    for (size_t i = 0; i < sizeof works / sizeof *works; ++i) {
        verdict v = check_line("filter", works[i][0], works[i][1], 3);
        CHECK(!broken(&v, PROMISE_RMS) && !broken(&v, PROMISE_WORST) && v.over[PROMISE_RMS] >= 0);
    }
}

/* Grids of a cube's face of few nodes, of whose splines single texels lose more. */
static void a_series_of_a_lit_texel_keeps_its_tolerance(void) {
    static const char *const works[][2] = {
        {"cube:64:1 dst=cube:22:1 lobe=phong:20:0 raw=0:1 tolerance=0.009", "texel:0.1:0.015"},
        {"cube:60:1 dst=octahedral:39:1 lobe=phong:20:0 raw=0:1 tolerance=5.17e-4",
         "texel:0.939:0.374"}};
    for (int i = 0; i < 2; ++i) {
        verdict v = check_line("harmonics", works[i][0], works[i][1], i ? 58460 : 10286);
        CHECK(v.over[PROMISE_PROJECT] >= 0 && !broken(&v, PROMISE_PROJECT));
        CHECK(!broken(&v, PROMISE_EVALUATE));
    }
}

/* The oracle's own solid angles fill the sphere, for every mapping, odd and tiny edges too. */
static void the_oracles_solid_angles_sum_to_4_pi(void) {
    static const int sizes[] = {1, 2, 3, 7, 16, 33};
    for (int mapping = 0; mapping < MAPPINGS; ++mapping)
        for (int i = 0; i < 6; ++i) {
            oracle_texel *texels = oracle_texels(mapping, sizes[i]);
            double sum = 0;
            for (size_t t = 0; t < oracle_count(mapping, sizes[i]); ++t) sum += texels[t].w;
            CHECK_CLOSE(sum, 4 * PI, 1e-8);
            free(texels);
        }
}

static void nothing_leaks(void) { CHECK(oracle_live == 0 && oracle_wrong_context == 0); }

int main(void) {
    RUN(a_work_reads_back_as_it_was_printed);
    RUN(the_oracle_is_the_reference);
    RUN(the_oracles_rings_and_discs_agree);
    RUN(works_that_broke_hold);
    RUN(a_series_of_a_lit_texel_keeps_its_tolerance);
    RUN(the_oracles_solid_angles_sum_to_4_pi);
    RUN(random_filters_keep_their_tolerance);
    RUN(random_chains_keep_their_tolerance);
    RUN(random_prepared_sources_keep_their_tolerance);
    RUN(random_constants_stay_themselves);
    RUN(random_orders_of_tasks_give_the_same_bits);
    RUN(random_failures_leave_everything_as_it_was);
    RUN(random_plans_are_in_range);
    RUN(random_lobes_are_their_formulas);
    RUN(random_harmonics_are_their_sums);
    RUN(random_windows_end_all_ringing);
    RUN(random_maps_are_resampled_to_means);
    RUN(random_levels_are_means_of_those_above);
    RUN(random_lookups_are_bilinear_everywhere);
    RUN(nothing_leaks);
    search_report(&state);
    return test_summary();
}

/* SPDX-License-Identifier: MIT
   Threads: every call that takes an executor gives the bits of its serial run on threads, backwards,
   shuffled, nested, and while other threads make the same call with the same source; and of what
   takes long, most is tasks. `make tsan` runs this under the thread sanitizer. */
#define _POSIX_C_SOURCE 200809L
#include "helpers.h"
#include "../examples/tool/threads.h"

/* ----------------------------------------------------------------------------------- calls ---- */

enum { ROOM = 62000 }; /* floats, for the result of any call */

typedef struct source {
    envmap map, cube;
    envmap_prepared prepared;
    envmap_lobe lobe;
    double sh[3 * 64];
} source;

typedef envmap_result call(float *out, const source *s, const envmap_work *work);

static envmap result_map(float *out, int mapping, int size, int slices) {
    envmap map;
    memset(&map, 0, sizeof map);
    map.texels = out, map.mapping = mapping, map.size = size, map.levels = 1, map.slices = slices;
    return map;
}

static envmap_result filtered(float *out, const source *s, const envmap_work *work, int method,
                              envmap_lobe lobe, const envmap_prepared *prepared) {
    envmap dst = result_map(out, ENVMAP_CUBE, 12, 1);
    envmap_filter_desc desc = desc_of(method, 1e-3);
    desc.work = *work, desc.prepared = prepared;
    return envmap_filter(&dst, &s->map, &lobe, &desc);
}

static envmap_result reference(float *out, const source *s, const envmap_work *work) {
    return filtered(out, s, work, ENVMAP_METHOD_REFERENCE, s->lobe, NULL);
}

static envmap_result hierarchical(float *out, const source *s, const envmap_work *work) {
    return filtered(out, s, work, ENVMAP_METHOD_HIERARCHICAL, s->lobe, NULL);
}

static envmap_result fast(float *out, const source *s, const envmap_work *work) {
    return filtered(out, s, work, ENVMAP_METHOD_FAST, s->lobe, NULL);
}

static envmap_result sharp(float *out, const source *s, const envmap_work *work) {
    return filtered(out, s, work, ENVMAP_METHOD_FAST, envmap_lobe_phong(20000), NULL);
}

static envmap_result rings(float *out, const source *s, const envmap_work *work) {
    envmap dst = result_map(out, ENVMAP_CUBE, 8, 12);
    envmap_lobe lobe = envmap_lobe_banks(0.8f);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_FAST, 1e-3);
    envmap_plan made = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    desc.work = *work;
    envmap_result r = envmap_filter(&dst, &s->map, &lobe, &desc);
    if (!r) r = envmap_filter_plan(&made, &dst, &s->map, &lobe, &desc);
    out[ROOM - 1] = (float)made.slices;
    return r;
}

static envmap_result prepared(float *out, const source *s, const envmap_work *work) {
    return filtered(out, s, work, ENVMAP_METHOD_FAST, s->lobe, &s->prepared);
}

static envmap_result chain(float *out, const source *s, const envmap_work *work) {
    envmap_lobe lobes[3] = {envmap_lobe_mirror(), envmap_lobe_ggx(0.1f), envmap_lobe_diffuse()};
    envmap dst = result_map(out, ENVMAP_LATLONG, 16, 2);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 1e-3);
    dst.levels = 3;
    desc.work = *work;
    return envmap_filter_chain(&dst, &s->map, lobes, 3, &desc);
}

static envmap_result prepare(float *out, const source *s, const envmap_work *work) {
    envmap_prepared made = {NULL, NULL};
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_FAST, 1e-3);
    desc.work = *work;
    envmap_result r = envmap_prepare(&made, &s->map, &s->lobe, 1, &desc);
    if (!r) r = filtered(out, s, work, ENVMAP_METHOD_FAST, s->lobe, &made);
    envmap_prepared_free(&made);
    return r;
}

static envmap_result plan(float *out, const source *s, const envmap_work *work) {
    envmap dst = result_map(NULL, ENVMAP_CUBE, 12, 1);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 1e-3);
    envmap_plan made;
    memset(&made, 0, sizeof made);
    desc.work = *work;
    envmap_result r = envmap_filter_plan(&made, &dst, &s->map, &s->lobe, &desc);
    memcpy(out, &made, sizeof made);
    return r;
}

static envmap_result resample(float *out, const source *s, const envmap_work *work) {
    envmap dst = result_map(out, ENVMAP_ANGULAR, 20, 1);
    return envmap_resample(&dst, &s->cube, work);
}

static envmap_result mips(float *out, const source *s, const envmap_work *work) {
    envmap map = result_map(out, ENVMAP_ANGULAR, 128, 1);
    map.levels = 2;
    (void)s;
    for (int i = 0; i < 3 * 128 * 128; ++i) out[i] = (float)(i % 11);
    return envmap_mips_work(&map, work);
}

static envmap_result project(float *out, const source *s, const envmap_work *work) {
    double sh[3 * 64];
    envmap_result r = envmap_sh_project(sh, 8, &s->map, 0, 0, work);
    memcpy(out, sh, sizeof sh);
    if (!r) r = envmap_sh_project(sh, 8, &s->map, 0, 1e-3, work);
    memcpy(out + 2 * 3 * 64, sh, sizeof sh);
    return r;
}

static envmap_result fill_map(float *out, const source *s, const envmap_work *work) {
    envmap exact = result_map(out, ENVMAP_SPHERE, 16, 1);
    envmap near_enough = result_map(out + 3 * 256, ENVMAP_SPHERE, 16, 1);
    envmap_result r = envmap_sh_fill(&exact, 0, 0, s->sh, 8, 0, work);
    return r ? r : envmap_sh_fill(&near_enough, 0, 0, s->sh, 8, 1e-3, work);
}

static void glossy(double f[3], const double v[3], const double l[3], void *user) {
    (void)user;
    f[0] = f[1] = f[2] = 0.1 + pow(fmax(0, v[2] * l[2] - v[0] * l[0] - v[1] * l[1]), 9);
}

static envmap_result radiance(float *out, const source *s, const envmap_work *work) {
    envmap_brdf brdf = {glossy, NULL};
    envmap_frame frames[40];
    for (int i = 0; i < 40; ++i) {
        envmap_frame f = {{0, 0, 1}, {1, 0, 0}, {0.02f * (float)i, 0.1f, 1}};
        frames[i] = f;
    }
    return envmap_radiance(out, &s->map, &brdf, frames, 40, work);
}

static envmap_result fit(float *out, const source *s, const envmap_work *work) {
    envmap_brdf brdf = {glossy, NULL};
    envmap_fit made;
    memset(&made, 0, sizeof made);
    made.lobes = 1, made.slices = 3;
    (void)s;
    envmap_result r = envmap_fit_brdf(&made, &brdf, work);
    if (!r) memcpy(out, made.table, 64 * sizeof(float));
    envmap_fit_free(&made);
    return r;
}

static envmap_result ggx_table(float *out, const source *s, const envmap_work *work) {
    (void)s;
    return envmap_ggx_table(out, 12, work);
}

static const struct {
    const char *name;
    call *run;
} calls[] = {{"reference", reference},
             {"hierarchical", hierarchical},
             {"fast", fast},
             {"sharp", sharp},
             {"rings", rings},
             {"prepared", prepared},
             {"chain", chain},
             {"prepare", prepare},
             {"plan", plan},
             {"resample", resample},
             {"mips", mips},
             {"project", project},
             {"fill", fill_map},
             {"radiance", radiance},
             {"fit", fit},
             {"ggx_table", ggx_table}};
enum { CALLS = sizeof calls / sizeof *calls };

static source scene;
static float expected[CALLS][ROOM];

static int same_as_serial(int c, const envmap_work *work) {
    float *out = (float *)calloc(ROOM, sizeof *out);
    int ok =
        out && !calls[c].run(out, &scene, work) && !memcmp(out, expected[c], sizeof expected[c]);
    free(out);
    if (!ok) printf("    %s\n", calls[c].name);
    return ok;
}

/* ------------------------------------------------------------------------------- executors ---- */

static void run_backwards(void *user, envmap_task *task, void *context, int count) {
    (void)user;
    for (int i = count - 1; i >= 0; --i) task(context, i);
}

static void run_shuffled(void *user, envmap_task *task, void *context, int count) {
    int *order = (int *)malloc((size_t)count * sizeof(int));
    unsigned long long *state = (unsigned long long *)user;
    for (int i = 0; i < count; ++i) order[i] = i;
    for (int i = count - 1; i > 0; --i) {
        int j = (int)(test_random(state) * (i + 1)), k = order[i];
        order[i] = order[j], order[j] = k;
    }
    for (int i = 0; i < count; ++i) task(context, order[i]);
    free(order);
}

typedef struct workers {
    envmap_task *task;
    void *context;
    int first, step, count;
} workers;

static void *worker(void *user) {
    const workers *w = (const workers *)user;
    for (int i = w->first; i < w->count; i += w->step) w->task(w->context, i);
    return NULL;
}

static void run_threads(void *user, envmap_task *task, void *context, int count) {
    pthread_t threads[4];
    workers w[4];
    (void)user;
    for (int k = 0; k < 4; ++k) {
        workers one = {task, context, k, 4, count};
        w[k] = one;
        if (pthread_create(threads + k, NULL, worker, w + k)) exit(1);
    }
    for (int k = 0; k < 4; ++k) pthread_join(threads[k], NULL);
}

/* A task that hands its work to other threads and waits, as pools with nested jobs do. */
typedef struct nest {
    envmap_task *task;
    void *context;
    int count;
} nest;

static void half_of(void *user, int half) {
    const nest *n = (const nest *)user;
    for (int i = half; i < n->count; i += 2) n->task(n->context, i);
}

static void run_nested(void *user, envmap_task *task, void *context, int count) {
    nest n = {task, context, count};
    run_threads(user, half_of, &n, 2);
}

static void check_calls(void (*run)(void *, envmap_task *, void *, int)) {
    unsigned long long state = 5;
    envmap_work work;
    memset(&work, 0, sizeof work);
    work.executor.user = &state, work.executor.run = run;
    for (int c = 0; c < CALLS; ++c) CHECK(same_as_serial(c, &work));
}

/* ----------------------------------------------------------------------------------- tests ---- */

static void every_call_does_its_work_serially(void) {
    envmap_work none;
    memset(&none, 0, sizeof none);
    for (int c = 0; c < CALLS; ++c) {
        size_t set = 0;
        CHECK(calls[c].run(expected[c], &scene, &none) == ENVMAP_OK);
        for (int i = 0; i < ROOM; ++i) set += expected[c][i] > 0 || expected[c][i] < 0;
        CHECK(set > 3);
    }
}

static void backwards_it_is_the_same(void) { check_calls(run_backwards); }

static void shuffled_it_is_the_same(void) { check_calls(run_shuffled); }

static void on_threads_it_is_the_same(void) { check_calls(run_threads); }

static void nested_it_is_the_same(void) { check_calls(run_nested); }

/* examples/tool/threads.h; runs inside its tasks, too. */
typedef struct inner {
    threads_pool *pool;
    int ran[8][8];
} inner;

static void inner_task(void *user, int i) { ++((int *)user)[i]; }

static void outer_task(void *user, int i) {
    inner *n = (inner *)user;
    threads_run(n->pool, inner_task, n->ran[i], 8);
}

static void on_a_pool_it_is_the_same(void) {
    static const int counts[] = {1, 2, 5};
    for (int k = 0; k < 3; ++k) {
        threads_pool pool;
        inner n;
        envmap_work work;
        memset(&work, 0, sizeof work), memset(&n, 0, sizeof n);
        threads_begin(&pool, counts[k]);
        CHECK(pool.threads == counts[k]);
        work.executor.user = n.pool = &pool, work.executor.run = threads_run;
        for (int c = 0; c < CALLS; ++c) CHECK(same_as_serial(c, &work));
        threads_run(&pool, outer_task, &n, 8);
        for (int i = 0; i < 64; ++i) CHECK(n.ran[i / 8][i % 8] == 1);
        threads_end(&pool);
    }
}

static threads_pool shared;

static void *call_all(void *user) {
    int *wrong = (int *)user;
    envmap_work work;
    memset(&work, 0, sizeof work);
    if (*wrong) work.executor.user = &shared, work.executor.run = threads_run;
    *wrong = 0;
    for (int c = 0; c < CALLS; ++c) *wrong += !same_as_serial(c, &work);
    return NULL;
}

/* Three threads, two of them with the same pool, and one source. */
static void callers_on_several_threads_do_not_meet(void) {
    pthread_t threads[3];
    int wrong[3] = {0, 1, 1};
    threads_begin(&shared, 3);
    for (int k = 0; k < 3; ++k) CHECK(!pthread_create(threads + k, NULL, call_all, wrong + k));
    for (int k = 0; k < 3; ++k) CHECK(!pthread_join(threads[k], NULL) && wrong[k] == 0);
    threads_end(&shared);
}

/* ----------------------------------------------------------------------------------- shares ---- */

/* Tasks are done one after the other; four workers would have taken as long as the one to whom most
   fell, if each takes the next task when it is free. */
typedef struct shares {
    double tasks, workers, clock,
        clocks; /* seconds; clock: a look at the clock; clocks: all looks */
} shares;

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void run_shared(void *user, envmap_task *task, void *context, int count) {
    shares *s = (shares *)user;
    double load[4] = {0, 0, 0, 0}, most = 0, start = seconds();
    for (int i = 0; i < count; ++i) {
        int least = 0;
        for (int k = 1; k < 4; ++k)
            if (load[k] < load[least]) least = k;
        task(context, i);
        double now = seconds();
        load[least] += now - start - s->clock;
        start = now;
    }
    for (int k = 0; k < 4; ++k) s->tasks += load[k], most = fmax(most, load[k]);
    s->workers += most, s->clocks += (count + 1) * s->clock;
}

static envmap_result large(const source *s, const envmap_work *work, envmap_lobe lobe, int slices) {
    envmap dst = black(ENVMAP_CUBE, slices > 1 ? 48 : 192, 1, slices);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 1e-3);
    desc.work = *work;
    envmap_result r = envmap_filter(&dst, &s->cube, &lobe, &desc);
    envmap_free(&dst);
    return r;
}

static envmap_result of_bands(float *out, const source *s, const envmap_work *work) {
    return (void)out, large(s, work, envmap_lobe_phong(2000), 1);
}

static envmap_result sharper(float *out, const source *s, const envmap_work *work) {
    return (void)out, large(s, work, envmap_lobe_phong(1e5f), 1);
}

static envmap_result with_a_tail(float *out, const source *s, const envmap_work *work) {
    return (void)out, large(s, work, envmap_lobe_ggx(0.01f), 1);
}

static envmap_result of_slices(float *out, const source *s, const envmap_work *work) {
    return (void)out, large(s, work, envmap_lobe_banks(0.95f), 24);
}

static envmap_result of_levels(float *out, const source *s, const envmap_work *work) {
    envmap dst = black(ENVMAP_CUBE, 192, 6, 1);
    envmap_lobe lobes[6];
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 1e-3);
    for (int i = 0; i < 6; ++i) lobes[i] = envmap_lobe_ggx(0.04f * (float)(i * i));
    (void)out, desc.work = *work;
    envmap_result r = envmap_filter_chain(&dst, &s->cube, lobes, 6, &desc);
    envmap_free(&dst);
    return r;
}

static envmap_result plan_of_bands(float *out, const source *s, const envmap_work *work) {
    envmap dst = result_map(NULL, ENVMAP_CUBE, 192, 1);
    envmap_lobe lobe = envmap_lobe_phong(3000);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 1e-3);
    envmap_plan made;
    (void)out, desc.work = *work;
    return envmap_filter_plan(&made, &dst, &s->cube, &lobe, &desc);
}

static envmap_result coefficients(float *out, const source *s, const envmap_work *work) {
    static double sh[3 * 16 * 16];
    return (void)out, envmap_sh_project(sh, 16, &s->cube, 0, 0, work);
}

/* The part of its time that a call takes on four workers, at the best of five. */
static double part_of_time(call *run) {
    static float out[ROOM];
    double best = 1, clock = seconds();
    for (int i = 0; i < 1000; ++i) (void)seconds();
    clock = (seconds() - clock) / 1001;
    for (int i = 0; i < 5; ++i) {
        shares s = {0, 0, clock, 0};
        envmap_work work;
        memset(&work, 0, sizeof work);
        work.executor.user = &s, work.executor.run = run_shared;
        double start = seconds();
        CHECK(run(out, &scene, &work) == ENVMAP_OK);
        double all = seconds() - start - s.clocks;
        best = fmin(best, (all - s.tasks + s.workers) / all);
    }
    return best;
}

/* A quarter would be all of it. Each bound is about a fifth above what is measured. */
static void four_workers_take_little_more_than_a_quarter_of_the_time(void) {
    static const struct {
        const char *name;
        call *run;
        double bound;
    } longer[] = {{"Phong 2000", of_bands, 0.4},
                  {"Phong 1e5", sharper, 0.58},
                  {"GGX 0.01", with_a_tail, 0.5},
                  {"Banks 0.95, 24 slices", of_slices, 0.44},
                  {"a GGX chain", of_levels, 0.5},
                  {"a plan", plan_of_bands, 0.45},
                  {"16 bands, every texel", coefficients, 0.35},
                  {"the definition", reference, 0.35},
                  {"hierarchical", hierarchical, 0.55},
                  {"40 views", radiance, 0.5},
                  {"a fit", fit, 0.5},
                  {"a table", ggx_table, 0.35}};
    int quick = test_many(50) < 50; /* what sanitizers add is not shared, nor do emulators tell */
    struct timespec tick = {1, 0};
    clock_getres(CLOCK_THREAD_CPUTIME_ID, &tick);
    int tells =
        !quick && tick.tv_sec == 0 && tick.tv_nsec <= 1000; /* longer ticks do not, either */
    envmap small = scene.cube;
    scene.cube = noise(ENVMAP_CUBE, 192, 9);
    for (size_t i = 0; i < (quick ? 1 : sizeof longer / sizeof *longer); ++i)
        FIGURE(longer[i].name, part_of_time(longer[i].run), tells ? longer[i].bound : 1);
    envmap_free(&scene.cube);
    scene.cube = small;
}

/* Many tasks do little that one would not: Phong 2000 took 1.2 times as long when each of them
   looked at all points. */
static void tasks_one_after_the_other_take_little_longer_than_none(void) {
    static float out[ROOM];
    double best[2] = {1e30, 1e30};
    int quick = test_many(50) < 50; /* as above */
    envmap small = scene.cube;
    scene.cube = noise(ENVMAP_CUBE, 192, 9);
    for (int i = 0; i < (quick ? 2 : 16); ++i) {
        envmap_work work;
        memset(&work, 0, sizeof work);
        if (i % 2) work.executor.run = run_backwards;
        double start = seconds();
        CHECK(of_bands(out, &scene, &work) == ENVMAP_OK);
        best[i % 2] = fmin(best[i % 2], seconds() - start);
    }
    FIGURE("Phong 2000 in tasks, over one", best[1] / best[0], quick ? 100 : 1.15);
    envmap_free(&scene.cube);
    scene.cube = small;
}

int main(void) {
    int live = oracle_live;
    scene.map = smooth(ENVMAP_LATLONG, 32), scene.cube = noise(ENVMAP_CUBE, 24, 3);
    scene.map.texels[777] = 300;
    scene.lobe = envmap_lobe_phong(60);
    if (envmap_prepare(&scene.prepared, &scene.map, &scene.lobe, 1, NULL)) return 1;
    if (envmap_sh_project(scene.sh, 8, &scene.map, 0, 0, NULL)) return 1;
    RUN(every_call_does_its_work_serially);
    RUN(backwards_it_is_the_same);
    RUN(shuffled_it_is_the_same);
    RUN(on_threads_it_is_the_same);
    RUN(nested_it_is_the_same);
    RUN(on_a_pool_it_is_the_same);
    RUN(callers_on_several_threads_do_not_meet);
    RUN(four_workers_take_little_more_than_a_quarter_of_the_time);
    RUN(tasks_one_after_the_other_take_little_longer_than_none);
    envmap_prepared_free(&scene.prepared);
    envmap_free(&scene.map), envmap_free(&scene.cube);
    return test_summary() || oracle_live != live;
}

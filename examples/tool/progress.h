/* progress.h - a bar while the tool works, or a few lines where nobody watches. Include after
   options.h.

   SPDX-License-Identifier: MIT */

#ifndef PROGRESS_H
#define PROGRESS_H

#include <stdio.h>
#include <time.h>
#include <unistd.h>

typedef struct meter {
    double start, shown; /* seconds */
    int bar, drawn, quarter, warned;
} meter;

static inline double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline meter meter_start(const options *o) {
    meter m = {0, 0, 0, 0, 0, 0};
    m.start = seconds();
    m.bar = o->progress || isatty(STDERR_FILENO);
    return m;
}

static inline void meter_bar(meter *m, double fraction, double elapsed) {
    char bar[41];
    int k;
    for (k = 0; k < 40; k++) bar[k] = (double)k < 40 * fraction ? '#' : '.';
    bar[40] = 0;
    fprintf(stderr, "\r[%s] %3.0f %%, %.0f s left ", bar, 100 * fraction,
            elapsed * (1 - fraction) / fmax(fraction, 1e-3));
    m->drawn = 1;
}

/* envmap_progress.report: nothing in the first second; then what will take more than ten says so,
   and there is a bar, or a line per quarter. */
static inline int meter_report(void *user, float fraction) {
    meter *m = (meter *)user;
    double now = seconds(), elapsed = now - m->start;
    int quarter = (int)(4 * fraction);
    if (elapsed < 1 || fraction <= 0) return 0;
    if (!m->warned && elapsed / (double)fraction > 10)
        fprintf(stderr, "envmap %s: this will take about %.0f s\n", command_name,
                elapsed / (double)fraction);
    m->warned = 1;
    if (m->bar && now - m->shown > 0.1) {
        meter_bar(m, (double)fraction, elapsed);
        m->shown = now;
    }
    if (!m->bar && quarter > m->quarter)
        fprintf(stderr, "envmap %s: %d %% after %.0f s\n", command_name, 25 * quarter, elapsed);
    if (quarter > m->quarter) m->quarter = quarter;
    return 0;
}

static inline void meter_stop(const meter *m) {
    if (m->drawn) fprintf(stderr, "\r%70s\r", "");
}

/* The threads of all calls; they end with the program. */
static threads_pool workers;

/* The filter's description from the options. */
static inline envmap_filter_desc describe(const options *o, meter *m) {
    envmap_filter_desc desc = {0};
    if (!workers.threads) threads_begin(&workers, o->threads ? o->threads : threads_here());
    desc.method = o->method;
    desc.tolerance = (float)o->tolerance;
    desc.threshold = (float)o->threshold;
    desc.work.executor.user = &workers;
    desc.work.executor.run = threads_run;
    desc.work.progress.user = m;
    desc.work.progress.report = meter_report;
    return desc;
}

#endif /* PROGRESS_H */

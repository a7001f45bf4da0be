/* SPDX-License-Identifier: MIT
   Random works against sums of their own, for as long as you like: `make search`.
       search SECONDS SEED     draws works for that long; ends with 1 where a promise breaks;
                               a third number: seconds for making a finding smaller
       search "WORK"           checks one work again: a line as a finding is printed
   search_oracle.h has the definitions, search_works.h what is drawn, search_promises.h and
   search_others.h what is promised, search_slow.h what it may take. */
#include "search_run.h"

/* One work, each promise with its value; 1 where one is broken. */
static int run_work(const char *line) {
    work w;
    int bad = 0;
    if (!work_read(&w, line)) {
        printf("cannot read this work: %s\n", line);
        return 2;
    }
    verdict v = check_work(&w);
    for (int i = 0; i < PROMISE_COUNT; ++i) {
        if (v.over[i] < 0) continue;
        printf("  %-8s %12.4g, %10.4g of its bound: %s\n", broken(&v, i) ? "BROKEN" : "holds",
               v.value[i], v.over[i], promise_text[i]);
        bad |= broken(&v, i);
    }
    return bad;
}

int main(int argc, char **argv) {
    static search s;
    double seconds = argc > 1 ? atof(argv[1]) : 60, start = cpu_seconds();
    unsigned long long seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    double shrink = argc > 3 ? atof(argv[3]) : 10;
    (void)check_line; /* the tests' */
    if (argc > 1 && strchr(argv[1], '=')) return run_work(argv[1]);
    printf("search: %.0f seconds of CPU time, seed %llu\n", seconds, seed);
    for (int n = 0; cpu_seconds() - start < seconds; ++n) {
        work w = search_draw(seed, n);
        double before = cpu_seconds();
        verdict v = check_work(&w);
        search_add(&s, &w, &v, shrink);
        if (getenv("SEARCH_SLOW") && cpu_seconds() - before > 3) {
            char text[512];
            work_print(text, sizeof text, &w);
            printf("    %.1f s: %s\n", cpu_seconds() - before, text);
        }
    }
    search_report(&s);
    return s.findings > 0;
}

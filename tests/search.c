/* SPDX-License-Identifier: MIT
   Random works against sums of their own, for as long as you like: `make search`.
       search SECONDS SEED        draws works, and ends with 1 where a promise is broken anew
       search WORK                runs one work, a line as a finding is printed */
#include "search_promises.h"

int main(int argc, char **argv) {
    double seconds = argc > 1 ? atof(argv[1]) : 60, start = cpu_seconds();
    unsigned long long seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    work w;
    if (argc == 2 && strchr(argv[1], '=')) {
        if (!work_read(&w, argv[1])) return 2;
        verdict v = check_work(&w);
        for (int i = 0; i < PROMISE_COUNT; ++i)
            if (v.over[i] >= 0) printf("  %-12.4g %s\n", v.over[i], promise_text[i]);
        return 0;
    }
    int n = 0;
    for (; cpu_seconds() - start < seconds; ++n) {
        work_draw(&w, seed * 1000003 + (unsigned long long)n);
        w.check = 0;
        double t0 = cpu_seconds(); if (getenv("V")) { char q[512]; work_print(q, 512, &w); fprintf(stderr, "%s\n", q); }
        verdict v = check_work(&w);
        double t = cpu_seconds() - t0;
        char text[512];
        work_print(text, sizeof text, &w);
        int bad = 0;
        for (int i = 0; i < PROMISE_COUNT; ++i) bad |= broken(&v, i);
        if (bad || t > 3) printf("%.2f s %s\n", t, text);
        for (int i = 0; i < PROMISE_COUNT; ++i)
            if (broken(&v, i)) printf("      %-12.4g %s\n", v.over[i], promise_text[i]);
        fflush(stdout);
    }
    printf("%d works\n", n);
    return 0;
}

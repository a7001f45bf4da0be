/* SPDX-License-Identifier: MIT
   Calls with hostile arguments, callbacks, memory and executors, drawn at random: the rules of
   fuzz_calls.c, where every compiler and every machine can hold them. A broken rule ends the
   program. CALLS=n draws more. */
#include "fuzz_calls.c"

static void random_calls_end_well_and_leave_no_trace(void) {
    unsigned long long state = 20261127;
    uint8_t bytes[256];
    int count = getenv("CALLS") ? atoi(getenv("CALLS")) : (getenv("TEST_QUICK") ? 100 : 400);
    for (int n = 0; n < count; ++n) {
        for (int i = 0; i < 256; ++i) bytes[i] = (uint8_t)(256 * test_random(&state));
        LLVMFuzzerTestOneInput(bytes, sizeof bytes);
    }
    for (int r = 0; r < ENVMAP_RESULT_COUNT; ++r)
        if (fuzz_results[r]) printf("    %7d %s\n", fuzz_results[r], envmap_result_text(r));
    CHECK(fuzz_results[ENVMAP_OK] > count / 4 && fuzz_results[ENVMAP_ERROR_RADIANCE] > 0);
}

int main(void) {
    RUN(random_calls_end_well_and_leave_no_trace);
    return test_summary();
}

/* SPDX-License-Identifier: MIT
   base: results and their texts, what a zeroed struct means. */
#include "oracle.h"
#include <limits.h>

static void ok_is_zero(void) {
    CHECK(ENVMAP_OK == 0);
    CHECK(ENVMAP_RESULT_COUNT == 13);
    CHECK(!strcmp(envmap_result_text(ENVMAP_OK), "ok"));
}

static void every_result_has_its_own_text(void) {
    for (int i = 0; i < ENVMAP_RESULT_COUNT; ++i) {
        const char *text = envmap_result_text((envmap_result)i);
        CHECK(text != NULL);
        if (!text) continue;
        size_t n = strlen(text);
        CHECK(n > 1 && text[n - 1] != '.' && text[n - 1] != '\n');
        for (int j = 0; j < i; ++j) CHECK(strcmp(text, envmap_result_text((envmap_result)j)) != 0);
    }
}

static void unknown_results_have_a_text_too(void) {
    static const int numbers[] = {-1, ENVMAP_RESULT_COUNT, 1000, INT_MAX, INT_MIN};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; ++i) {
        const char *text = envmap_result_text(numbers[i]);
        CHECK(text != NULL && *text);
        if (text) CHECK(strcmp(text, envmap_result_text(ENVMAP_OK)) != 0);
    }
}

/* {0} must mean the defaults, also in C++: no struct starts with an enum. */
static void zeroed_structs_are_defaults(void) {
    envmap map = {0};
    envmap_filter_desc desc = {0};
    envmap_executor executor = {0};
    envmap_progress progress = {0};
    CHECK(map.texels == NULL && map.memory == NULL);
    CHECK(desc.method == ENVMAP_METHOD_AUTO);
    CHECK(ENVMAP_CUBE == 0 && ENVMAP_LOBE_MIRROR == 0);
    CHECK(executor.run == NULL && progress.report == NULL);
    envmap_free(&map);
    envmap_free(NULL);
    CHECK(map.texels == NULL);
}

int main(void) {
    RUN(ok_is_zero);
    RUN(every_result_has_its_own_text);
    RUN(unknown_results_have_a_text_too);
    RUN(zeroed_structs_are_defaults);
    return test_summary();
}

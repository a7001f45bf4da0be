/* SPDX-License-Identifier: MIT
   What `make fuzz` runs on the tool's command line: any words, split at line ends, for every
   command. They are refused in words, or every option is within the range that its help names. No
   command is run. */
#define ENVMAP_IMPLEMENTATION
#define main tool_main
#include "examples/tool/envmap.c"
#undef main
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);

static void check_option(const options *o, const option_spec *option) {
    const char *field = (const char *)o + option->offset;
    const int is_int = option->kind != NUMBER && option->kind != ANGLES;
    double value[3] = {0, 0, 0};
    int whole, k, count = 0;
    if (is_int) memcpy(&whole, field, sizeof whole), value[0] = whole;
    else memcpy(value, field, option->kind == ANGLES ? sizeof value : sizeof *value);
    while (option->words && option->words[count]) count++;
    if (option->kind == FLAG && whole != 1) abort();
    if (option->kind == WORD && (whole < 0 || whole >= count)) abort();
    for (k = 0; k < 3 && option->kind != FLAG && option->kind != WORD; k++)
        if (!(value[k] >= option->low && value[k] <= option->high) && (k == 0 || value[k] != 0))
            abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes) {
    char text[512], *words[64];
    int count = 0, k, c;
    size_t i;
    if (!bytes || bytes >= sizeof text) return 0;
    memcpy(text, data, bytes), text[bytes] = 0;
    for (i = 0, words[count++] = text; i < bytes && count < 63; i++)
        if (text[i] == '\n') text[i] = 0, words[count++] = text + i + 1;
    words[count] = NULL;
    for (c = 0; c < COMMAND_COUNT; c++) {
        options o = defaults;
        if (parse_arguments(&o, &commands[c], words) || o.help) continue;
        if (o.file_count != commands[c].file_count) abort();
        for (k = 0; k < OPTION_COUNT; k++)
            if (is_given(&o, option_table[k].name)) check_option(&o, &option_table[k]);
        if (o.file_count == 2 && !check_output(&o) && save_kind(o.files[1]) == SAVE_KINDS) abort();
    }
    return 0;
}

/* SPDX-License-Identifier: MIT
   What the fuzzers of readers share. libFuzzer takes ten times as long to draw an input as a reader
   takes to refuse it, so each input is read 16 times: as it is, and with bytes changed or its end
   cut off, as a hash of it says. */
#ifndef FUZZ_VARIANTS_H
#define FUZZ_VARIANTS_H

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FUZZ_VARIANTS = 16 };

static uint32_t fuzz_draw(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* Mostly what headers are made of, and mostly within the first 32 bytes. */
static void fuzz_change(uint8_t *data, size_t bytes, uint32_t *state) {
    static const char words[] = "0123456789-+.eE \n\r#PFfXY=?/\xff";
    size_t most = bytes > 32 && fuzz_draw(state) % 4 ? 32 : bytes, at = fuzz_draw(state) % most;
    uint32_t word = fuzz_draw(state) % sizeof words, any = fuzz_draw(state);
    data[at] = any % 4 ? (uint8_t)words[word] : (uint8_t)(any >> 2);
}

/* Each variant has a block of its own size, so that the address sanitizer sees its end. */
static void fuzz_variants(void (*read)(const uint8_t *, size_t), const uint8_t *data,
                          size_t bytes) {
    uint32_t state = 1;
    read(data, bytes);
    for (size_t i = 0; i < bytes; ++i) state = (state ^ data[i]) * 16777619u;
    for (int v = 1; v < FUZZ_VARIANTS && bytes > 0; ++v) {
        size_t n = v % 4 ? bytes : 1 + fuzz_draw(&state) % bytes;
        uint8_t *copy = (uint8_t *)malloc(n);
        if (!copy) abort();
        memcpy(copy, data, n);
        for (int i = 0; i < v % 4; ++i) fuzz_change(copy, n, &state);
        read(copy, n);
        free(copy);
    }
}

#endif

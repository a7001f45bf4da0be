/* write_numbers.h - what writers make of write_bytes, which a file (write_file.h) or memory
   (../web/memory_file.h) has before it includes this.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_NUMBERS_H
#define WRITE_NUMBERS_H

static inline void write_text(write_file *w, const char *text) {
    write_bytes(w, text, strlen(text));
}

/* The lowest `bytes` bytes of a number, the lowest first. */
static inline void write_little(write_file *w, unsigned long long value, int bytes) {
    unsigned char data[8];
    int k;
    for (k = 0; k < bytes; k++) data[k] = (unsigned char)(value >> 8 * k & 255);
    write_bytes(w, data, (size_t)bytes);
}

static inline void write_zeros(write_file *w, size_t count) {
    while (count--) write_little(w, 0, 1);
}

#endif /* WRITE_NUMBERS_H */

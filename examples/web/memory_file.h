/* memory_file.h - what the tool's writers call (write_file.h), with memory instead of a file: the
   page offers it as a download. Include before a writer; web_print stands for printf.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_FILE_H
#define WRITE_FILE_H

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct write_file {
    int error; /* an errno, 0 for none */
} write_file;

static struct memory_file {
    unsigned char *data;
    size_t size, room;
} memory_file; /* the last one written */

static inline int write_open(write_file *w, const char *path) {
    (void)path;
    w->error = 0, memory_file.size = 0;
    return 1;
}

static inline void write_bytes(write_file *w, const void *data, size_t size) {
    size_t room = memory_file.room ? memory_file.room : 4096;
    while (room < memory_file.size + size) room *= 2;
    if (room > memory_file.room) {
        unsigned char *grown = (unsigned char *)realloc(memory_file.data, room);
        if (!grown) w->error = ENOMEM;
        else memory_file.data = grown, memory_file.room = room;
    }
    if (w->error) return;
    memcpy(memory_file.data + memory_file.size, data, size);
    memory_file.size += size;
}

#include "../tool/write_numbers.h"

static inline int write_close(write_file *w) { return w->error; }

#endif /* WRITE_FILE_H */

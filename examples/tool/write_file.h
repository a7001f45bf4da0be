/* write_file.h - a file that is there whole or not at all: written under a temporary name in the
   same folder, and renamed when every byte is on it.

   What exists and is no plain file (a device, a pipe) is written to, never renamed over and never
   removed; a link stays, and what it points to is replaced. Include after envmap.h. Test:
   tests/test_write.c.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_FILE_H
#define WRITE_FILE_H

#include "system.h"

#include <string.h>

#define WRITE_PATH 4096

typedef struct write_file {
    FILE *file;
    int error; /* the first errno, 0 for none */
    char path[WRITE_PATH];
    char temporary[WRITE_PATH + 8]; /* empty: the file is written in place */
} write_file;

/* What a path means: the file behind its links where there is one. */
static inline int write_resolve(write_file *w, const char *path) {
    char *real = realpath(path, NULL);
    const char *name = real ? real : path;
    if (strlen(name) >= WRITE_PATH) w->error = ENAMETOOLONG;
    else memcpy(w->path, name, strlen(name) + 1);
    free(real);
    return !w->error;
}

/* Opens a new file beside the path, with the permissions that a new file has. */
static inline void write_temporary(write_file *w) {
    mode_t mask = (mode_t)umask(0);
    int descriptor;
    umask(mask);
    snprintf(w->temporary, sizeof w->temporary, "%s.XXXXXX", w->path);
    descriptor = mkstemp(w->temporary);
    if (descriptor < 0 || fchmod(descriptor, 0666 & ~mask)) w->error = errno;
    if (descriptor >= 0) w->file = fdopen(descriptor, "wb");
    if (descriptor >= 0 && !w->file) close(descriptor);
    if (descriptor < 0) *w->temporary = 0;
}

/* 1, or 0 with w->error set; write_close is called in either case. */
static inline int write_open(write_file *w, const char *path) {
    struct stat about;
    memset(w, 0, sizeof *w);
    if (!write_resolve(w, path)) return 0;
    if (stat(w->path, &about) || S_ISREG(about.st_mode)) write_temporary(w);
    else w->file = fopen(w->path, "wb");
    if (!w->file && !w->error) w->error = errno ? errno : EIO;
    return !w->error;
}

static inline void write_bytes(write_file *w, const void *data, size_t size) {
    if (w->error || !size) return;
    errno = 0;
    if (fwrite(data, 1, size, w->file) != size) w->error = errno ? errno : EIO;
}

#include "write_numbers.h"

/* 0, or the errno of what failed first; then nothing is left, and what was there before is. */
static inline int write_close(write_file *w) {
    if (w->file && ferror(w->file) && !w->error) w->error = EIO; /* of what others wrote there */
    if (w->file && fclose(w->file) && !w->error) w->error = errno;
    w->file = NULL;
    if (*w->temporary && !w->error && system_rename(w->temporary, w->path)) w->error = errno;
    if (*w->temporary && w->error) remove(w->temporary);
    *w->temporary = 0;
    return w->error;
}

/* What a writer returned as a result of envmap.h, with the reason left in errno. */
static inline envmap_result write_result(int error) {
    errno = error;
    return !error ? ENVMAP_OK : error == ENOMEM ? ENVMAP_ERROR_MEMORY : ENVMAP_ERROR_FILE;
}

#endif /* WRITE_FILE_H */

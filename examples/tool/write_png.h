/* write_png.h - a picture as PNG, whole or not at all. Include after write_file.h and picture.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_PNG_H
#define WRITE_PNG_H

/* 0, or an errno. */
static inline int write_png(const picture *p, const char *path) {
    write_file w;
    errno = 0;
    if (write_open(&w, path) && !picture_write(p, w.file)) w.error = errno ? errno : ENOMEM;
    return write_close(&w);
}

#endif /* WRITE_PNG_H */

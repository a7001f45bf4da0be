/* write_pfm.h - a level of a map as float PFM, as envmap_pfm_save writes it, but whole or not at
   all. Include after write_file.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_PFM_H
#define WRITE_PFM_H

/* 0, or an errno. */
static inline int write_pfm(const envmap *map, int level, const char *path) {
    write_file w;
    size_t bytes = 0;
    void *data;
    if (envmap_pfm_write(NULL, 0, &bytes, map, level) == ENVMAP_ERROR_ARGUMENT) return EINVAL;
    data = malloc(bytes);
    if (!data) return ENOMEM;
    envmap_pfm_write(data, bytes, &bytes, map, level);
    if (write_open(&w, path)) write_bytes(&w, data, bytes);
    free(data);
    return write_close(&w);
}

#endif /* WRITE_PFM_H */

/* read.h - bytes of a picture's file to floats, whichever format they are. Include after envmap.h.

   SPDX-License-Identifier: MIT */

#ifndef READ_H
#define READ_H

#include "image.h"
#include "read_exr.h"
#include "read_hdr.h"
#include "read_pfm.h"

static inline int read_begins(const unsigned char *data, size_t bytes, const char *with) {
    size_t length = strlen(with);
    return bytes >= length && !memcmp(data, with, length);
}

/* Formats that people try, which hold 8 bits a channel, or which are for engines to read. */
static inline int read_refuse(image *out, const unsigned char *data, size_t bytes) {
    static const char *const others[][2] = {
        {"\x89PNG", "a PNG"},   {"\xFF\xD8\xFF", "a JPEG"}, {"DDS ", "a DDS"}, {"\xABKTX", "a KTX"},
        {"II*", "a TIFF"},      {"MM", "a TIFF"},           {"GIF8", "a GIF"}, {"RIFF", "a WebP"},
        {"P6", "an 8-bit PPM"}, {"P5", "an 8-bit PGM"},     {"BM", "a BMP"},   {"P7", "a PAM"}};
    size_t k;
    if (!bytes) return image_fail(out, "is empty");
    for (k = 0; k < sizeof others / sizeof *others; k++)
        if (read_begins(data, bytes, others[k][0]))
            return image_fail(out, "is %s, which is not read", others[k][1]);
    return image_fail(out, "is neither a Radiance picture, nor a float PFM, nor OpenEXR");
}

/* The format is told by the first bytes, whatever the name's ending says. On failure *out holds an
   error and no pixels; what it held is overwritten without freeing. */
static inline int image_read(image *out, const unsigned char *data, size_t bytes) {
    int (*reader)(image *, const unsigned char *, size_t) = read_refuse;
    memset(out, 0, sizeof *out);
    out->scale = 1;
    if (read_begins(data, bytes, "#?")) reader = hdr_read;
    else if (read_begins(data, bytes, "PF") || read_begins(data, bytes, "Pf")) reader = pfm_read;
    else if (read_begins(data, bytes, "\x76\x2F\x31\x01")) reader = exr_read;
    if (reader(out, data, bytes)) return 1;
    image_free(out);
    return 0;
}

#endif /* READ_H */

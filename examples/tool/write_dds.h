/* write_dds.h - Direct3D textures: DDS with the DX10 header; cubes and pictures, with levels.

   Source: Microsoft, "Programming Guide for DDS", DDS_HEADER, DDS_HEADER_DXT10. Test:
   tests/test_write.c. Include after write_texels.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_DDS_H
#define WRITE_DDS_H

static inline void dds_header(write_file *w, const texture *t) {
    static const unsigned dxgi[] = {10, 2, 67, 26};
    unsigned cube = texture_faces(t) == 6, levels = (unsigned)t->map->levels;
    unsigned pitch = (unsigned)texture_width(t, 0) * (unsigned)texel_bytes[t->format];
    write_text(w, "DDS ");
    write_little(w, 124, 4);
    write_little(w, 0x1 | 0x2 | 0x4 | 0x8 | 0x1000 | 0x20000, 4); /* what of the header counts */
    write_little(w, (unsigned)texture_edge(t, 0), 4);
    write_little(w, (unsigned)texture_width(t, 0), 4);
    write_little(w, pitch, 4);
    write_little(w, 0, 4); /* no depth */
    write_little(w, levels, 4);
    write_zeros(w, 44);
    write_little(w, 32, 4), write_little(w, 0x4, 4), write_text(w, "DX10");
    write_zeros(w, 20);
    write_little(w, 0x1000u | (levels > 1 || cube ? 0x8u : 0) | (levels > 1 ? 0x400000u : 0), 4);
    write_little(w, cube ? 0xFE00 : 0, 4); /* a cube, all six faces of it */
    write_zeros(w, 12);
    write_little(w, dxgi[t->format], 4);
    write_little(w, 3, 4); /* a 2D texture */
    write_little(w, cube ? 0x4 : 0, 4);
    write_little(w, 1, 4); /* one cube, or one picture */
    write_little(w, 0, 4); /* alpha unknown */
}

/* 0, or an errno. Face by face, each with all its levels. */
static inline int write_dds(texture *t, const char *path) {
    write_file w;
    int level, face;
    if (!texture_is_writable(t)) return EINVAL;
    t->saturated = 0;
    write_open(&w, path);
    dds_header(&w, t);
    for (face = 0; face < texture_faces(t); face++)
        for (level = 0; level < t->map->levels; level++) texture_write_face(&w, t, level, face);
    return write_close(&w);
}

#endif /* WRITE_DDS_H */

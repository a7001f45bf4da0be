/* gl_file.h - textures of a KTX 1, KTX 2 or DDS file as the graphics card takes them: a cube or a
   picture, with its levels, RGBA16F, RGBA32F, RGB9E5 or B10G11R11. No texel is touched on the way.

       gl_file f;
       const char *why = gl_file_open(&f, "specular.ktx2");    NULL: it was read
       GLuint cube = gl_file_upload(&f);
       gl_file_free(&f);

   Sources: KTX File Format Specification 1.1 and 2.0.4; Microsoft, "Programming Guide for DDS",
   DDS_HEADER_DXT10. Files of the other byte order, compressed ones and arrays are refused.
   Include after gl.h. What you will see: `viewer out/specular.ktx2`.  Tests: files_* in test_gl.c.

   SPDX-License-Identifier: MIT */

#ifndef GL_FILE_H
#define GL_FILE_H

enum { GL_FILE_LEVELS = 15, GL_FILE_EDGE = 16384 };

typedef struct gl_file {
    unsigned char *data;
    size_t size;
    int width, height, levels, faces, format;
    size_t at[GL_FILE_LEVELS][6]; /* where each face of each level begins */
} gl_file;

typedef struct gl_file_texel {
    GLenum internal, layout, type;
    unsigned bytes, vulkan, dxgi; /* of a texel; the format's numbers in KTX 2 and DDS */
} gl_file_texel;

static const gl_file_texel gl_file_texels[] = {
    {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT, 8, 97, 10},
    {GL_RGBA32F, GL_RGBA, GL_FLOAT, 16, 109, 2},
    {GL_RGB9_E5, GL_RGB, GL_UNSIGNED_INT_5_9_9_9_REV, 4, 123, 67},
    {GL_R11F_G11F_B10F, GL_RGB, GL_UNSIGNED_INT_10F_11F_11F_REV, 4, 122, 26}};
enum { GL_FILE_TEXELS = sizeof gl_file_texels / sizeof gl_file_texels[0] };

/* A number of up to 8 bytes, the lowest first; 0 beyond the end. */
static inline unsigned long long gl_file_number(const gl_file *f, size_t at, int bytes) {
    unsigned long long value = 0;
    if (at > f->size || f->size - at < (size_t)bytes) return 0;
    while (bytes--) value = value << 8 | f->data[at + (size_t)bytes];
    return value;
}

static inline int gl_file_side(int side, int level) {
    return side >> level > 1 ? side >> level : 1;
}

/* Bytes of one face of a level. */
static inline size_t gl_file_bytes(const gl_file *f, int level) {
    return (size_t)gl_file_side(f->width, level) * (size_t)gl_file_side(f->height, level) *
           gl_file_texels[f->format].bytes;
}

/* Width, height, faces and levels are 4 bytes each. NULL, or what is wrong with them. */
static inline const char *gl_file_shape(gl_file *f, size_t width, size_t height,
                                        unsigned long long faces, size_t levels) {
    unsigned long long w = gl_file_number(f, width, 4), h = gl_file_number(f, height, 4);
    unsigned long long l = gl_file_number(f, levels, 4);
    if (f->format == GL_FILE_TEXELS)
        return "its texels are not RGBA16F, RGBA32F, RGB9E5 or B10G11R11";
    if (w < 1 || h < 1 || w > GL_FILE_EDGE || h > GL_FILE_EDGE) return "its size is out of range";
    if (!(faces == 1 || (faces == 6 && w == h))) return "it is neither a cube nor a picture";
    f->width = (int)w, f->height = (int)h, f->faces = (int)faces;
    if (l > (unsigned)envmap_levels(w > h ? f->width : f->height)) return "it has too many levels";
    f->levels = l ? (int)l : 1; /* 0: the others are to be made of it */
    return NULL;
}

/* Returns where the face ends, or 0 where the file does not have it. */
static inline size_t gl_file_place(gl_file *f, int level, int face, unsigned long long at) {
    size_t bytes = gl_file_bytes(f, level);
    if (!at || at > f->size || bytes > f->size - at) return 0;
    f->at[level][face] = (size_t)at;
    return (size_t)at + bytes;
}

/* Pairs of keys and values, then level by level: the bytes of a face (of all for a picture, which
   has one), the faces. */
static inline const char *gl_file_ktx1(gl_file *f) {
    const char *wrong;
    size_t at = 64 + (size_t)gl_file_number(f, 60, 4);
    int level, face;
    if (gl_file_number(f, 12, 4) != 0x04030201) return "its bytes are in the other order";
    for (f->format = 0; f->format < GL_FILE_TEXELS; f->format++)
        if (gl_file_number(f, 28, 4) == gl_file_texels[f->format].internal &&
            gl_file_number(f, 16, 4) == gl_file_texels[f->format].type)
            break;
    if (gl_file_number(f, 44, 8)) return "it has depth or layers";
    wrong = gl_file_shape(f, 36, 40, gl_file_number(f, 52, 4), 56);
    for (level = 0; level < f->levels && !wrong; level++) {
        if (gl_file_number(f, at, 4) != gl_file_bytes(f, level)) return "a level has not its size";
        for (at += 4, face = 0; face < f->faces && at; face++)
            at = gl_file_place(f, level, face, at);
        if (!at) return "it ends too early";
    }
    return wrong;
}

/* From byte 80 on 24 bytes a level: where it is, its bytes, its bytes again. */
static inline const char *gl_file_ktx2(gl_file *f) {
    const char *wrong;
    int level, face;
    for (f->format = 0; f->format < GL_FILE_TEXELS; f->format++)
        if (gl_file_number(f, 12, 4) == gl_file_texels[f->format].vulkan) break;
    if (gl_file_number(f, 28, 8)) return "it has depth or layers";
    if (gl_file_number(f, 44, 4)) return "it is compressed";
    wrong = gl_file_shape(f, 20, 24, gl_file_number(f, 36, 4), 40);
    for (level = 0; level < f->levels && !wrong; level++) {
        size_t row = 80 + 24 * (size_t)level, at = (size_t)gl_file_number(f, row, 8);
        if (gl_file_number(f, row + 8, 8) != gl_file_bytes(f, level) * (size_t)f->faces)
            return "a level has not its size";
        for (face = 0; face < f->faces && at; face++) at = gl_file_place(f, level, face, at);
        if (!at) return "it ends too early";
    }
    return wrong;
}

/* 128 bytes, 20 more of the DX10 header, face by face with all its levels. */
static inline const char *gl_file_dds(gl_file *f) {
    const char *wrong;
    size_t at = 148;
    int level, face;
    if (gl_file_number(f, 84, 4) != 0x30315844) return "it has no DX10 header";
    for (f->format = 0; f->format < GL_FILE_TEXELS; f->format++)
        if (gl_file_number(f, 128, 4) == gl_file_texels[f->format].dxgi) break;
    if (gl_file_number(f, 132, 4) != 3 || gl_file_number(f, 140, 4) != 1)
        return "it has depth or layers";
    wrong = gl_file_shape(f, 16, 12, gl_file_number(f, 136, 4) & 4 ? 6 : 1, 28);
    for (face = 0; face < f->faces && !wrong; face++)
        for (level = 0; level < f->levels; level++) {
            at = gl_file_place(f, level, face, at);
            if (!at) return "it ends too early";
        }
    return wrong;
}

/* Of what is in data[size], which f keeps. */
static inline const char *gl_file_parse(gl_file *f) {
    static const char ktx[] = "\253KTX ";
    if (f->size >= 128 && !memcmp(f->data, "DDS ", 4)) return gl_file_dds(f);
    if (f->size < 64 || memcmp(f->data, ktx, 5) || memcmp(f->data + 7, "\273\r\n\032\n", 5))
        return "it is neither KTX nor DDS";
    return f->data[5] == '1' ? gl_file_ktx1(f) : gl_file_ktx2(f);
}

static inline void gl_file_free(gl_file *f) {
    free(f->data);
    memset(f, 0, sizeof *f);
}

/* NULL, or in words why the file cannot be taken; nothing is to be freed then. */
static inline const char *gl_file_open(gl_file *f, const char *path) {
    FILE *file = fopen(path, "rb");
    const char *wrong = "it cannot be read";
    long size = file && !fseek(file, 0, SEEK_END) ? ftell(file) : -1;
    memset(f, 0, sizeof *f);
    if (size > 0) f->data = (unsigned char *)malloc((size_t)size);
    if (f->data && !fseek(file, 0, SEEK_SET)) f->size = fread(f->data, 1, (size_t)size, file);
    if (f->data && f->size == (size_t)size) wrong = gl_file_parse(f);
    if (file) fclose(file);
    if (wrong) gl_file_free(f);
    return wrong;
}

static inline GLenum gl_file_target(const gl_file *f, int face) {
    return f->faces == 6 ? GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)face : GL_TEXTURE_2D;
}

/* A cube or a 2D texture, in the file's own format. */
static inline GLuint gl_file_upload(const gl_file *f) {
    const gl_file_texel *t = &gl_file_texels[f->format];
    GLuint texture = gl_texture(f->faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D, f->levels);
    int level, face;
    for (level = 0; level < f->levels; level++)
        for (face = 0; face < f->faces; face++)
            gl.TexImage2D(gl_file_target(f, face), level, (GLint)t->internal,
                          gl_file_side(f->width, level), gl_file_side(f->height, level), 0,
                          t->layout, t->type, f->data + f->at[level][face]);
    return texture;
}

/* The uploaded texture back as a map: a cube; a lat-long of a picture twice as wide as high; a
   square picture becomes an angular map. */
static inline envmap_result gl_file_map(envmap *out, const gl_file *f, GLuint texture) {
    int square = f->width == f->height, most = envmap_levels(f->height), level, face;
    int mapping = f->faces == 6 ? ENVMAP_CUBE : square ? ENVMAP_ANGULAR : ENVMAP_LATLONG;
    envmap_result result = ENVMAP_ERROR_SHAPE;
    gl.BindTexture(f->faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D, texture);
    if (square || f->width == 2 * f->height)
        result = envmap_create(out, mapping, f->height, f->levels < most ? f->levels : most, 1);
    for (level = 0; !result && level < out->levels; level++)
        for (face = 0; face < f->faces; face++)
            gl.GetTexImage(gl_file_target(f, face), level, GL_RGB, GL_FLOAT,
                           envmap_texel(out, level, 0, face, 0, 0));
    return result;
}

#endif /* GL_FILE_H */

/* SPDX-License-Identifier: MIT

   envmap.h 0.1 - turns an environment map into the prefiltered maps that light a scene.

   QUICK START. In one C or C++ file define ENVMAP_IMPLEMENTATION before the include; this is a
   whole program (gcc program.c -lm):

       #define ENVMAP_IMPLEMENTATION
       #include "envmap.h"
       int main(void) {
           envmap sky = {0}, gloss = {0};                              // C++: {}
           if (envmap_pfm_load(&sky, "sky.pfm", ENVMAP_LATLONG)) return 1;
           if (envmap_create(&gloss, ENVMAP_CUBE, 128, 1, 1)) return 1; // 128x128, 1 level, 1 slice
           envmap_lobe phong = envmap_lobe_phong(100.0f);
           if (envmap_filter(&gloss, &sky, &phong, NULL)) return 1;     // NULL: defaults
           float r[3] = {0, 0, 1}, rgb[3];
           envmap_lookup(rgb, &gloss, r, 0.0f);                         // direction, mip level
           envmap_free(&sky); envmap_free(&gloss);
       }

   THE IDEA. A prefiltered map stores, for an axis a, L(a) = integral of k(a.l; p) L_in(l) dl: one
   lobe k that depends only on the angle to the axis, and at most one more parameter p that picks
   a slice. So there is one map type, one lobe type and one filter call:

       map                  axis a    slice p    k(x), x = a.l
       mirror               r_v       -          delta
       diffuse   [Miller84] n         -          k_d max(x,0)
       Phong     [HS99]     r_v       -          k_s max(x,0)^N
       Gaussian             r_v       -          exp(lambda (x - 1))
       GGX, n = v = r       r_v       -          D(sqrt((1+x)/2)) max(x,0)
       Banks     [Banks94]  t         c = v.t    max(0, sqrt(1-x^2) sqrt(1-c^2) - x c - s) / (1-s)^2
       any       [KM00]     any       any        a callback or a table

   CONVENTIONS
     Space       right-handed, +y up. Directions need no unit length.
     Texels      linear radiance, 3 floats (RGB). u runs with the column in memory, v with the row,
                 both in [0,1]; texel (x,y) has its centre at ((x+1/2)/width, (y+1/2)/height).
     Cube        OpenGL: faces +X -X +Y -Y +Z -Z, row 0 is t = 0.
     Others      row 0 is the +y side. For the disc mappings X = 2u-1, Y = 1-2v:
       PARABOLOID  front (X,Y) = (d_x,d_y)/(1+d_z), back (d_x,d_y)/(1-d_z); faces front, back.
       SPHERE      OpenGL's: (X,Y) = (n_x,n_y), n = (d+z)/|d+z|; centre +z, the rim is -z.
       LATLONG     u = 1/2 + atan2(d_x,-d_z)/2pi, v = acos(d_y)/pi; centre -z.
       ANGULAR     Debevec's: (X,Y) = (d_x,d_y) acos(-d_z)/(pi sqrt(d_x^2+d_y^2)); centre -z,
                   the rim is +z.
       OCTAHEDRAL  p = d/(|d_x|+|d_y|+|d_z|); (X,Y) = (p_x,p_z), below the horizon (p_y < 0) turned
                   out: ((1-|p_z|) sign p_x, (1-|p_x|) sign p_z). Centre +y, all corners -y. Here
                   Y = 2v-1: row 0 is -z. The horizon is |X|+|Y| = 1. Beyond an edge lies the same
                   edge, turned about its middle; beyond a corner, the opposite corner.
     Mirrored    Seen from inside, the six cube faces, the front paraboloid, the sphere map and the
                 octahedral map are MIRRORED pictures; lat-long, angular map and back paraboloid are
                 not. This is what OpenGL and the papers define, not a fault of the file.
     Rims        A texel cut by a disc's rim counts with the solid angle of its part inside, at that
                 part's centroid; a texel outside counts 0. Paraboloid texels outside the circle
                 hold the extended domain [-1,1]^2 (the other hemisphere, seen from this face);
                 sphere and angular maps clamp to the rim.
     Size        the face edge in texels; a lat-long map is 2*size x size. Level l has edge
                 max(1, size >> l). Memory order: level, slice, face, row, column, channel.
     Slices      slice k of n holds p at its centre: p = p0 + (p1-p0)(k+1/2)/n. Banks: p = c = v.t,
                 from -1 to 1. A lobe without p fills every slice alike.
     Normalised  A result is divided by sum k w over the same texels, so a constant environment
                 stays itself; Banks by its integral at c = 0, one constant for all slices. lobe.raw
                 asks for the papers' sums instead.

   WHAT IT DOES NOT DO. No image formats but PFM, no threads of its own (bring an executor), no
   global state, no output to stdio, no abort on bad input.

   CONFIGURATION (define before the include that has ENVMAP_IMPLEMENTATION)
     ENVMAP_IMPLEMENTATION   emit the bodies; in exactly one file unless ENVMAP_STATIC
     ENVMAP_STATIC           everything static to this file (define it before every include)
     ENVMAP_NO_STDIO         leave out what needs <stdio.h>: envmap_pfm_load, envmap_pfm_save
     ENVMAP_MALLOC(ctx, n)   memory; ctx is the map's or the desc's `memory` (default malloc(n))
     ENVMAP_FREE(ctx, ptr)   (default free(ptr)); define both or neither. Both are called on the
                             thread that called, never by tasks of an executor (make tsan)
     ENVMAP_NO_SIMD          plain loops where GCC and Clang would get vector types
   The bodies have the papers' letters for names: what says `#define N 8` goes behind them. Macros
   that take arguments, windows.h, and before the declarations any macro, do no harm.

   CONTENTS: the same names in the same order in the declarations, the bodies, tests/ and docs/;
   rings to transform, and source to sharp, declare nothing.
     >>base          results, executor, progress
     >>directions    direction <-> (face, u, v), matrices
     >>maps          create, texel, solid angle, lookups, cleaning
     >>resample      a map in another parameterization and size
     >>pfm           read and write float pictures
     >>mips          levels weighted by solid angle; level of a footprint, and probes along it
     >>lobes         mirror, diffuse, Phong, Gaussian, GGX, Banks, callback, table
     >>splines       quintic B-splines, and what grids lose
     >>rings         points anywhere on the sphere <-> spherical harmonics
     >>lights        texels that are summed by themselves, for every axis
     >>transform     texels <-> spherical harmonics, the only way there is
     >>harmonics     project, fill, convolve, rotate, window coefficients
     >>source        a slice's texels, or points that stand for them, in tiles
     >>axis          what one axis sums of texels and tents; points of bilinear radiance
     >>circles       what it sums of bilinear radiance, by circles about a face's middle
     >>reference     the definition: every texel
     >>hierarchical  [KVHS00]: lobe and environment as mip-maps
     >>windows       what of a face an axis sees
     >>kernels       sharp lobes: what each texel in sight of an axis counts, K
     >>knots         K of a few axes, and of those between
     >>near          the sum over these
     >>cells         thin rings and bilinear radiance: what a ring counts of a cell's corners
     >>banks         thin rings, tile by tile of the source
     >>scene         contrast and lights of a source
     >>fast          bands and grids for a lobe, a scene and a tolerance
     >>sharp         which way a lobe goes: bands, near sums, rings, points
     >>filters       the filter call, chains, prepared sources
     >>plan          what a scene needs: size, bands, slices
     >>materials     eq. 1, Fresnel, BRDFs as lobes, GGX as engines use it, fans
     >>compare       error norms
   References are listed by their keys at the end, then the changes, then the licence. */

#ifndef ENVMAP_H
#define ENVMAP_H

#include <stddef.h>

#define ENVMAP_VERSION 100 /* 10000 major + 100 minor + patch */

#ifdef ENVMAP_STATIC
#define ENVMAP_API static inline
#elif defined(__cplusplus)
#define ENVMAP_API extern "C"
#else
#define ENVMAP_API extern
#endif

/* ------------------------------------------------------------------------------------ >>base -- */

/* Every call that can fail returns one of these and leaves its outputs as they were. Calls keep no
   state, so threads may share whatever none of them writes. */
#define ENVMAP_RESULTS(X)                                                                          \
    X(ENVMAP_OK, "ok")                                                                             \
    X(ENVMAP_ERROR_ARGUMENT, "an argument is NULL, out of range, or both input and output")        \
    X(ENVMAP_ERROR_MEMORY, "out of memory")                                                        \
    X(ENVMAP_ERROR_LIMIT, "the map would be larger than the library's limits")                     \
    X(ENVMAP_ERROR_FILE, "the file cannot be opened, read or written")                             \
    X(ENVMAP_ERROR_FORMAT, "not a PFM picture: the header is malformed")                           \
    X(ENVMAP_ERROR_SHAPE, "width and height do not fit the parameterization")                      \
    X(ENVMAP_ERROR_TRUNCATED, "the PFM picture ends before its last sample")                       \
    X(ENVMAP_ERROR_TRAILING, "there is data after the PFM picture's last sample")                  \
    X(ENVMAP_ERROR_RADIANCE, "the map holds NaN, infinite or (for this method) negative radiance") \
    X(ENVMAP_ERROR_LOBE, "the lobe's parameter is out of range, or its integral is not positive")  \
    X(ENVMAP_ERROR_METHOD, "this method cannot do that")                                           \
    X(ENVMAP_CANCELLED, "cancelled by the progress callback")

#define ENVMAPI_RESULT_ENUM(name, text) name,
typedef enum envmap_result {
    ENVMAP_RESULTS(ENVMAPI_RESULT_ENUM) ENVMAP_RESULT_COUNT,
    ENVMAPI_RESULT_IS_INT = -1 /* signed, so that passing it as an int warns nobody */
} envmap_result;

/* A sentence without a full stop, never NULL.  Test: every_result_has_its_own_text. */
ENVMAP_API const char *envmap_result_text(int result);

/* Runs task(context, i) for i = 0 .. count-1, in any order, on any threads, and returns when all
   are done. Tasks are cut by the data alone, so results are the same bits for every executor. Calls
   try it first, and refuse one that leaves out tasks of these (ARGUMENT); what it leaves out later
   the calling thread runs.
   Test: results_are_the_same_bits_for_any_executor; with pthreads: examples/tool/threads.h. */
typedef void envmap_task(void *context, int i);
typedef struct envmap_executor {
    void *user;
    void (*run)(void *user, envmap_task *task, void *context, int count);
} envmap_executor;

/* Called on the calling thread between rounds of tasks, fraction in [0,1]; return 0 to go on,
   anything else to cancel (CANCELLED). */
typedef struct envmap_progress {
    void *user;
    int (*report)(void *user, float fraction);
} envmap_progress;

/* How a long call works. NULL or all zero: serial, silent, the default heap. Neither a call nor a
   task on an executor's thread takes more than 16 KB of stack in optimised code, beside that of the
   caller's functions.  Test: tests/test_stack.c. */
typedef struct envmap_work {
    envmap_executor executor; /* run NULL: serial                                                 */
    envmap_progress progress; /* report NULL: none                                                */
    void *memory;             /* context for ENVMAP_MALLOC and ENVMAP_FREE of temporary memory    */
} envmap_work;

/* ------------------------------------------------------------------------------ >>directions -- */

typedef enum envmap_mapping {
    ENVMAP_CUBE,       /* 6 faces, density max/min 3 sqrt 3                                       */
    ENVMAP_PARABOLOID, /* 2 faces, 4                                                              */
    ENVMAP_SPHERE,     /* 1 face, constant solid angle, singular at -z                            */
    ENVMAP_LATLONG,    /* 1 face, twice as wide as high, unbounded at the poles                   */
    ENVMAP_ANGULAR,    /* 1 face, unbounded at the rim (+z)                                       */
    ENVMAP_OCTAHEDRAL, /* 1 face, 3 sqrt 3, folded at the horizon and where x or z is 0           */
    ENVMAP_MAPPING_COUNT,
    ENVMAPI_MAPPING_IS_INT = -1
} envmap_mapping;

/* Faces of a mapping: 6, 2, 1, 1, 1, 1; 0 for anything else. */
ENVMAP_API int envmap_faces(int mapping);

/* dir = the unit direction at (u,v) of a face. Beyond [0,1] paraboloids, cube faces and lat-long go
   on, sphere and angular maps clamp to the rim, octahedral maps turn about the edge's middle. Bad
   face or mapping, non-finite u, v: +z.
   Source: CONVENTIONS; [HS98], [Debevec98].  Test: directions_round_trip. */
ENVMAP_API void envmap_direction(float dir[3], int mapping, int face, float u, float v);

/* The inverse: the face that dir belongs to, on an edge the lower one, and (u,v) on it, in [0,1].
   dir is of any length; zero or non-finite counts as +z. At the sphere map's -z and the angular
   map's +z, where every rim point is right, (1, 1/2); at the octahedral map's -y a corner; at the
   lat-long poles u = 1/2. As u, v are floats, the round trip errs by up to 4e-4 rad at 1e-3 from
   the sphere map's -z. */
ENVMAP_API void envmap_coordinates(int *face, float *u, float *v, int mapping, const float dir[3]);

/* The texture matrix of a paraboloid map: takes an eye-space reflection vector (r,1), as
   GL_REFLECTION_MAP generates it, to texture coordinates (s,t,r,q); s/q = u, t/q = v.
     matrix = (scale and bias to [0,1]) P S (M_l)^-1
   matrix     out, column-major
   modelview  column-major: the space of the map -> eye space; only its linear part M_l counts, a
              rotation times a uniform scale (the scale is divided out)
   face       0 front, 1 back. A point is on the face where u, v lie inside the unit disc.
   Errors: ARGUMENT (NULL, face, singular or non-finite M_l).
   Source: [HS98] eqs. 6-9, [HS99]; S = -I, d = (0,0,-1) in front, (0,0,1) at the back and then
   diag(-1,-1,1,1): the printed S computes d - r where eq. 8 needs d + r.
   Test: the_texture_matrix_agrees_with_the_mapping. */
ENVMAP_API envmap_result envmap_paraboloid_matrix(float matrix[16], const float modelview[16],
                                                  int face);

/* ------------------------------------------------------------------------------------ >>maps -- */

typedef struct envmap {
    float *texels; /* level, slice, face, row, column, channel; owned                             */
    void *memory;  /* context for ENVMAP_MALLOC and ENVMAP_FREE; set it before create or load     */
    int mapping;   /* envmap_mapping                                                              */
    int size;      /* face edge in texels at level 0                                              */
    int levels;    /* 1 .. envmap_levels(size)                                                    */
    int slices;    /* 1 ..                                                                        */
    float p0, p1;  /* range of the slices' parameter: -1, 1 until a filter writes its lobe's      */
} envmap;

/* From edge `size` down to edge 1: floor(log2 size) + 1; 0 for size < 1. */
ENVMAP_API int envmap_levels(int size);

/* A black map. Overwrites *map without freeing; keeps map->memory, so zero-initialise it.
   size    1 .. 16384      levels  1 .. envmap_levels(size)      slices  1 .. 4096
   Errors: ARGUMENT, LIMIT (beyond these, or more than 8 GiB), MEMORY. */
ENVMAP_API envmap_result envmap_create(envmap *map, int mapping, int size, int levels, int slices);

/* Frees the texels and zeroes all but map->memory. NULL and twice are fine. */
ENVMAP_API void envmap_free(envmap *map);

/* Texel (x,y): 3 floats, then its row's rest; NULL when out of range.
   Test: texels_are_where_the_memory_order_says. */
ENVMAP_API float *envmap_texel(const envmap *map, int level, int slice, int face, int x, int y);

/* Solid angle of a texel, sr, of its part inside a disc's rim: in closed form, or line quadrature
   (1e-13). 0 when out of range.  Test: solid_angles_sum_to_4_pi. */
ENVMAP_API double envmap_solid_angle(const envmap *map, int level, int face, int x, int y);

/* rgb = radiance in direction dir, trilinear: bilinear in two levels, linear between.
   level  clamped to 0 .. levels-1; NaN counts as 0
   p      linear between slice centres, clamped at the ends; envmap_lookup reads slice 0
   Continuous over every cube edge and corner, over the paraboloids' rim (the faces blend in its
   last half texel), over lat-long's seam and its poles (where the row's mean is the pole), over an
   octahedral map's edges. At a texel's centre it gives the texel (at rims: to second order). Bad
   maps give black.
   Test: lookups_are_continuous_across_seams. */
ENVMAP_API void envmap_lookup(float rgb[3], const envmap *map, const float dir[3], float level);
ENVMAP_API void envmap_lookup_slice(float rgb[3], const envmap *map, const float dir[3], float p,
                                    float level);

/* What a cleaning found, in numbers (three a texel), and took. */
typedef struct envmap_cleaned {
    int nan, infinite, negative, limited;
    double energy;   /* that the limit took, over that of all finite and positive radiance        */
    double replaced; /* share of the sphere whose texels held NaN, Inf or negative numbers        */
} envmap_cleaned;

/* Level 0 as filters want it, in place: NaN and negative numbers become 0, and Inf and what exceeds
   the limit become the limit.
   limit    > 0; 0: none, and Inf becomes the largest finite number that there is
   cleaned  out, or NULL
   Errors: ARGUMENT.  O(texels), allocates nothing.  Test: cleaning_* . */
ENVMAP_API envmap_result envmap_clean(envmap *map, float limit, envmap_cleaned *cleaned);

/* -------------------------------------------------------------------------------- >>resample -- */

/* dst level 0 = src level 0 in dst's parameterization and size, slice by slice (src may have one
   slice for all):
     L_j = sum_i A_ij L_i / sum_i A_ij      A_ij: the solid angle that texels i and j have in common
   so a constant stays, and so does a texel's energy: within 1 % where dst is as coarse as src or
   coarser, mostly 0.1 % (slivers that a rim cuts: 5 %), and the whole map's within 1e-4 (a sphere
   map's: 5e-4), but where most of it is a few texels'.
   Where dst has a quarter more texels than src, L_j is the mean of bilinear src at points of texel
   j, which keeps the whole map's energy, not that of single texels. Same mapping and size: the same
   texels.
   work    NULL: serial, silent. The executor runs 8 rows a task; from a disc or an octahedral
           map, where dst is no finer, two tasks at a time
   Errors: ARGUMENT, RADIANCE (NaN, Inf), MEMORY, CANCELLED.  O(texels of src and dst), memory 8
   bytes a row and 24 KB; from discs and octahedral maps to others 64 bytes a texel of dst or of a
   cube twice as fine as src; with progress or several slices, a copy of the result too.
   Source: [Jones99].  Test: resampling_* . */
ENVMAP_API envmap_result envmap_resample(envmap *dst, const envmap *src, const envmap_work *work);

/* ------------------------------------------------------------------------------------- >>pfm -- */

/* Reads a float PFM: PF (RGB) or Pf (grey, copied to RGB), either byte order, rows bottom to top,
   samples times |scale|. One level; a vertical strip of faces in their order, slices outermost:
     cube  w x 6w*slices     paraboloid  w x 2w*slices     lat-long  2h x h (one slice)
     sphere, angular, octahedral  w x w*slices
   Radiance is kept as it is, NaN and negative numbers too (filters refuse them).
   Overwrites *map without freeing, keeps map->memory.  No stdio, no locale.
   Errors: ARGUMENT, FORMAT (also scale 0, NaN, Inf), SHAPE, LIMIT, TRUNCATED, TRAILING, MEMORY.
   Test: pfm_round_trips, every_truncated_prefix_is_refused. */
ENVMAP_API envmap_result envmap_pfm_read(envmap *map, const void *data, size_t bytes, int mapping);

/* Writes one level as little-endian PF, scale -1, the same shapes. *bytes is the size of the file
   in any case but ARGUMENT; data NULL only asks for it. capacity is the room at data, bytes.
   Errors: ARGUMENT (bad map or level, lat-long with slices), LIMIT (too little room). */
ENVMAP_API envmap_result envmap_pfm_write(void *data, size_t capacity, size_t *bytes,
                                          const envmap *map, int level);

#ifndef ENVMAP_NO_STDIO
/* The same from and to a path, with as much memory as the file has bytes; FILE, MEMORY too. A file
   that could not be written whole is removed. On Windows the path is in the program's code page,
   which is UTF-8 where its manifest says so. */
ENVMAP_API envmap_result envmap_pfm_load(envmap *map, const char *path, int mapping);
ENVMAP_API envmap_result envmap_pfm_save(const envmap *map, const char *path, int level);
#endif

/* ------------------------------------------------------------------------------------ >>mips -- */

/* Fills levels 1 .. levels-1: each texel the mean of the finer level's, weighted by the solid angle
   of the overlap (odd sizes too), so every level carries the energy of level 0. A face of edge 1 is
   the mean of the whole sphere. NaN and Inf reach the texels that they are part of, no others.
   work    its executor runs the rows of a level as tasks; no progress is told
   Errors: ARGUMENT.  O(texels), allocates nothing.  Source [KVHS00] 5.1 with weights added.
   Test: mip_levels_carry_the_same_energy (<= 1e-6; an unweighted box drifts by percents). */
ENVMAP_API envmap_result envmap_mips_build(envmap *map); /* work NULL */
ENVMAP_API envmap_result envmap_mips_work(envmap *map, const envmap_work *work);

/* The level whose texels match a footprint at dir: log2 of its longer side in texels of level 0,
   clamped to [0, levels-1]. Its sides dx, dy: derivatives of the direction along two screen axes.
   Bad maps or numbers give 0.
   Source [Williams83], [HS99].  Test: a_footprint_of_two_texels_is_level_one. */
ENVMAP_API float envmap_footprint_level(const envmap *map, const float dir[3], const float dx[3],
                                        const float dy[3]);

/* rgb = radiance over a footprint by footprint assembly: n trilinear probes along the longer axis
   of the ellipse that the sides span, each the level of its own part of the footprint:
     rgb = 1/n sum over i of map(dir + major ((i+1/2)/n - 1/2)),   n = ceil(longer / shorter axis)
   in texels of level 0. A level alone makes the footprint a square of its longer side.
   probes  the most to take, 1 .. 256 (clamped); 1: one lookup at envmap_footprint_level
   Slice 0; bad maps give black, bad numbers level 0.  O(n) lookups.  Source [SKS96].
   Test: assembled_footprints_*. */
ENVMAP_API void envmap_lookup_footprint(float rgb[3], const envmap *map, const float dir[3],
                                        const float dx[3], const float dy[3], int probes);

/* ----------------------------------------------------------------------------------- >>lobes -- */

typedef enum envmap_lobe_kind {
    ENVMAP_LOBE_MIRROR,
    ENVMAP_LOBE_PHONG, /* diffuse is N = 1                                                        */
    ENVMAP_LOBE_GAUSSIAN,
    ENVMAP_LOBE_GGX,
    ENVMAP_LOBE_BANKS,
    ENVMAP_LOBE_FUNCTION,
    ENVMAP_LOBE_TABLE,
    ENVMAP_LOBE_KIND_COUNT
} envmap_lobe_kind;

/* k(x; p). Cosines x = cos theta in [-1,1] are where k is evaluated; angles theta in rad, 0 at the
   axis and pi behind it, are places on a lobe (sigma, support, kinks, a table's samples).
   A function must be finite and deterministic, and thread-safe if the executor is parallel. */
typedef double envmap_lobe_function_type(double x, double p, void *user);

typedef struct envmap_lobe {
    int kind;        /* envmap_lobe_kind                                                          */
    int raw;         /* 0: normalised; 1: the papers' sums, with k_s (or k_d) = scale             */
    float parameter; /* N, lambda, alpha or s                                                     */
    float scale;     /* k_s or k_d, used when raw; the constructors write 1                       */
    float p0, p1;    /* range of p over a map's slices; equal: the lobe has no p                  */
    envmap_lobe_function_type *function; /* FUNCTION                                              */
    void *user;
    const float *table; /* TABLE: [table_slices][table_size], k at theta = pi i/(size-1)          */
    int table_size, table_slices;
    const float *kinks; /* FUNCTION: theta in (0,pi) of its kinks, for every p; or NULL           */
    int kink_count;     /* the first 64 count                                                     */
} envmap_lobe;

/* Constructors. The calls that take a lobe check it (LOBE), and borrow function, table and kinks
   until they return.
   mirror    delta: filtering with it is envmap_resample
   diffuse   max(x,0)
   phong     max(x,0)^N,         exponent N in [0, 1e9]; N = 0 is the open hemisphere. Up to 1e-12
                                 x counts as 0, as cosines of texels on the horizon are rounded
   gaussian  exp(lambda (x-1)),  sharpness lambda in [0, 1e9]
   ggx       D(sqrt((1+x)/2)) max(x,0), D(c) = alpha^2 / (pi ((alpha^2-1) c^2 + 1)^2), alpha =
             roughness^2 in [0, 1]; 0 is the mirror, (0, 1e-4) counts as 1e-4  [WMLT07] eq. 33
   banks     max(0, sqrt(1-x^2) sqrt(1-c^2) - x c - s) / (1-s)^2, s in [0, 0.99999], c = p
             in [-1,1]  [Banks94], [KVHS00] section 4
   function  any k; set p0 != p1 for slices, kinks where it has any
   table     Catmull-Rom along theta over `size` >= 4 samples from 0 to pi; `slices` rows at slice
             centres of p, linear between; at most 2^28 numbers                        [KM00] */
ENVMAP_API envmap_lobe envmap_lobe_mirror(void);
ENVMAP_API envmap_lobe envmap_lobe_diffuse(void);
ENVMAP_API envmap_lobe envmap_lobe_phong(float exponent);
ENVMAP_API envmap_lobe envmap_lobe_gaussian(float sharpness);
ENVMAP_API envmap_lobe envmap_lobe_ggx(float alpha);
ENVMAP_API envmap_lobe envmap_lobe_banks(float s);
ENVMAP_API envmap_lobe envmap_lobe_function(envmap_lobe_function_type *function, void *user);
ENVMAP_API envmap_lobe envmap_lobe_table(const float *values, int size, int slices, float p0,
                                         float p1);

/* What every method asks a lobe, for each p. Bad lobes (and the mirror, which has no k): 0.
   value      scale * k(x; p)
   integral   2 pi integral of scale * k over [-1,1], sr: closed form where there is one
   sigma      half the width of the angles around the peak of |k| where |k| exceeds e^(-1/2) of it;
              they go on beyond the axis, and beyond what is opposite to it
   support    angles [from, to] outside which k = 0, or below 1e-12 of its peak
   Thread-safe.  Test: lobes_know_*. */
ENVMAP_API double envmap_lobe_value(const envmap_lobe *lobe, double x, double p);
ENVMAP_API double envmap_lobe_integral(const envmap_lobe *lobe, double p);
ENVMAP_API double envmap_lobe_sigma(const envmap_lobe *lobe, double p);
ENVMAP_API void envmap_lobe_support(double *from, double *to, const envmap_lobe *lobe, double p);

/* lambda[l] = 2 pi integral of k P_l / norm, l = 0 .. bands-1, bands 1 .. 4096: the filter maps
   Y_lm to lambda_l Y_lm (Funk-Hecke). norm is the filter's: the lobe's integral, Banks' at c = 0, 1
   raw. Phong and Gaussian by recursion, others by quadrature, O(bands^2). Stable to all bands.
   Errors: ARGUMENT, LOBE.  Test: zonal_coefficients_*. */
ENVMAP_API envmap_result envmap_lobe_zonal(double *lambda, int bands, const envmap_lobe *lobe,
                                           double p);

/* ------------------------------------------------------------------------------- >>harmonics -- */

/* Real spherical harmonics, orthonormal, without the Condon-Shortley phase, polar axis z (up is y):
     Y_lm(d) = N_l|m| P_l|m|(z) * (m > 0: sqrt2 cos m phi, m = 0: 1, m < 0: sqrt2 sin |m| phi)
     Y_00 = 1/sqrt(4 pi),  (Y_1-1, Y_10, Y_11) = sqrt(3/4pi) (y, z, x),  phi = atan2(y, x)
   Coefficients `sh` are doubles [bands * bands][3]: RGB of a_lm = integral of L Y_lm at l(l+1)+m,
   bands 1 .. 256, 0 <= l < bands. A direction may have any length; zero or non-finite counts as +z.
   Unless a call says otherwise it allocates nothing, and refuses coefficients that are not finite,
   or 1e100 and more, with RADIANCE.
   Source [RH01], [Sloan08].  Tests: tests/test_sh.c; docs/harmonics.md has the tables. */

/* basis[l(l+1)+m] = Y_lm(dir), stable to all bands. A light of flux e from dir adds e Y_lm(dir) to
   sh.  Errors: ARGUMENT.  Test: the_basis_is_orthonormal. */
ENVMAP_API envmap_result envmap_sh_basis(double *basis, int bands, const double dir[3]);

/* sh = sum over texels L w Y_lm(texel's centre), level 0 of one slice.
   tolerance  0: every texel, in double. Otherwise a_lm may be off by tolerance * sqrt(2l+1) * a_00
              (a_00 of |L|; sqrt(2l+1) a_00 is the most that a_lm can be). Below 1e-6, and where
              floats overflow or vanish, it is every texel again
   Errors: ARGUMENT, RADIANCE (NaN, Inf), MEMORY, CANCELLED.
   With a tolerance O(texels + bands^3) and the memory of the map and 1000 bands^2 bytes, as FAST;
   without O(texels bands^2) and that of 16 sets of coefficients, for 3 bands also of 144 rows of
   the map.  Test: a_harmonic_projects_onto_itself, points_keep_the_tolerance. */
ENVMAP_API envmap_result envmap_sh_project(double *sh, int bands, const envmap *map, int slice,
                                           double tolerance, const envmap_work *work);

/* rgb = sum a_lm Y_lm(dir).  Errors: ARGUMENT, RADIANCE.  O(bands^2). */
ENVMAP_API envmap_result envmap_sh_evaluate(double rgb[3], const double *sh, int bands,
                                            const double dir[3]);

/* The same at every texel's centre of one level and slice, also those outside a rim; what rings
   below zero is written as it is.
   tolerance  0, and below 3e-6: every coefficient, in double; also for numbers near the ends of
              floats. Otherwise the relative rms error
   Errors: ARGUMENT, RADIANCE (also what could exceed a float), MEMORY, CANCELLED.  Time and memory
   as envmap_sh_project's; without a tolerance the level's.
   Test: filling_evaluates_at_every_texel, filling_keeps_the_tolerance. */
ENVMAP_API envmap_result envmap_sh_fill(envmap *map, int level, int slice, const double *sh,
                                        int bands, double tolerance, const envmap_work *work);

/* out = lambda_l a_lm: the filter with this lobe (envmap_lobe_zonal). The diffuse lobe gives
   irradiance / pi; with raw = 1, irradiance. out may be sh.
   Errors: ARGUMENT, LOBE, RADIANCE.  Test: convolving_is_filtering. */
ENVMAP_API envmap_result envmap_sh_convolve(double *out, const double *sh, int bands,
                                            const envmap_lobe *lobe, double p);

/* The environment turned: out(R d) = sh(d). out is not sh.
   rotation  R, row-major [3][3], orthogonal to 1e-4; a mirror image (det -1) is fine
   Errors: ARGUMENT, RADIANCE.  Exact quadrature at bands x 2 bands Gauss nodes: O(bands^4).
   Test: rotations_compose, rotations_keep_the_energy_of_each_band. */
ENVMAP_API envmap_result envmap_sh_rotate(double *out, const double *sh, int bands,
                                          const double rotation[9]);

/* Against ringing: out = a_lm exp(-mu l), Poisson's kernel, with the least mu >= 0 (to 0.1 %) for
   which the result filtered with the lobe is nowhere negative. mu = 0, the same bits, where nothing
   is. The mean stays; one mu for all channels, so colours do not drift.
   out    may be sh; still to be convolved        lobe   NULL: sh itself must not be negative
   moved  relative rms of what changed in the filtered result, 0 .. 1; may be NULL
   Errors: ARGUMENT, LOBE, RADIANCE (a channel's mean is not positive and the channel not black).
   O(bands^4).  Source: [Sloan08], "Windowing"; his window moves three times as much irradiance.
   Test: a_suns_ringing_is_windowed_away, windowed_scenes_are_nowhere_below_zero. */
ENVMAP_API envmap_result envmap_sh_window(double *out, double *moved, const double *sh, int bands,
                                          const envmap_lobe *lobe, double p);

/* The number of bands L (1 .. 4096; 0 for bad arguments, or without 32 KB of memory, context NULL)
   beyond which the scene, filtered with the lobe, has no more than `tolerance` of its rms:
   sum_(l>=L) lambda_l^2 |a_l|^2 <= tolerance^2 * sum of all; 4096 also when more would be needed.
   sh, bands  the scene as far as it is known; from there on it is taken as flat as a light, each
              coefficient as large as those of the last band. NULL, 0: one light, the lobe alone.
   Test: bands_needed_are_enough. */
ENVMAP_API int envmap_sh_bands(const envmap_lobe *lobe, double p, const double *sh, int bands,
                               double tolerance);

/* Nine coefficients, convolved, for shaders (later bands do not count).
   matrix   [3][16], one symmetric 4x4 M a channel: (n,1)^T M (n,1) = sum a_lm Y_lm(n), |n| = 1
            [RH01] eqs. 11, 12
   packed   [7][4]: for GLSL's vec4 sh[7],
            vec4 b = n.xyzz * n.yzzx;
            rgb = vec3(dot(sh[0], vec4(n, 1)), dot(sh[1], vec4(n, 1)), dot(sh[2], vec4(n, 1)))
                + vec3(dot(sh[3], b), dot(sh[4], b), dot(sh[5], b))
                + sh[6].rgb * (n.x * n.x - n.y * n.y);   sh[6].a is 0
   Either may be NULL.  Errors: ARGUMENT, RADIANCE (also what exceeds a float).
   Test: matrix_and_packing_are_the_nine_coefficients. */
ENVMAP_API envmap_result envmap_sh_pack(float matrix[48], float packed[28], const double *sh);

/* --------------------------------------------------------------------------------- >>filters -- */

typedef enum envmap_method {
    ENVMAP_METHOD_AUTO,         /* the cheapest that keeps the tolerance                          */
    ENVMAP_METHOD_REFERENCE,    /* every texel, in double: the definition                         */
    ENVMAP_METHOD_HIERARCHICAL, /* [KVHS00] 5.1: lobe and environment as mip-maps                 */
    ENVMAP_METHOD_FAST,         /* through harmonics; sums of few texels where they cannot        */
    ENVMAP_METHOD_HARMONICS,    /* through harmonics; METHOD where they cannot                    */
    ENVMAP_METHOD_COUNT
} envmap_method;

/* A source that many calls, and threads, share. */
typedef struct envmap_prepared {
    void *state;
    void *memory; /* context for ENVMAP_MALLOC and ENVMAP_FREE; set it before envmap_prepare      */
} envmap_prepared;

typedef struct envmap_filter_desc {
    int method;      /* envmap_method; 0: AUTO                                                    */
    float tolerance; /* desired rms error, relative to the rms of the filtered scene over the whole
                        sphere (dst's few texels may miss its light), 1e-7 .. 0.1; 0: 1e-3        */
    float threshold; /* HIERARCHICAL: max |k_child - k_parent|, k with peak 1; 0: 0.001,
                        negative: open everything                                                 */
    envmap_work work;
    const envmap_prepared *prepared; /* NULL, or the source's: see envmap_prepare                 */
} envmap_filter_desc;

/* dst level 0, every slice: L(a) = sum k(a.l; p) L_in(l) w(l) / norm over src's level-0 texels l,
   for the axis a of every texel of dst, those outside a rim too. Any parameterizations and sizes.
   As a lobe gets thinner than two texels of src, each texel spreads into a tent (bilinear radiance
   at the end), so the result is continuous in N, and N -> infinity is the bilinear mirror.
   Also writes dst->p0, p1. desc NULL: AUTO, that is FAST, or the reference where texels are few
   and the lobe is wider than they, or GGX, or src has a rim.
   Errors: ARGUMENT (bad map or desc, dst is src), LOBE, RADIANCE (NaN, Inf; negative for all but
   the reference), METHOD, MEMORY, CANCELLED.
   REFERENCE: O(texels of src * texels and slices of dst). Tiles of texels where k is below 1e-12 of
   its peak are passed over.
   FAST: O(texels of src + texels of dst + L^3), L the bands that lobe, scene and tolerance need.
   A source whose texels are all alike is its result, where lobes are divided by their sums, and if
   it is black (AUTO, FAST, HARMONICS).
   Lobes thinner than two texels of src, or of more than 768 bands: O(texels of dst * texels that
   the lobe reaches). Slow: lobes thinner than two texels that have edges, are rings, or reach far
   (Banks, functions, x^N with N < 2), on all maps below a tolerance of 1e-4, on discs and
   octahedral maps always. There the reference's weights serve 2 to 48 axes at a time, if src's
   texels times that number are at most 960000, else one. At 1e-3 an axis may take 500 ns times 1000
   + twice the texels of src, a quarter of it for Phong, Gaussian and GGX, and below
   sqrt(1e-3 / tolerance) as much.
   It keeps the tolerance in rms, and 20 tolerances in each texel, of its radiance or of 1e-3 of the
   filtered scene's mean, which is more, beside what floats lose: 1e-6 of that mean and 1.2e-7 of
   the brightest texel. Lobes with a kink (diffuse, Banks, GGX of large alpha) keep it in rms; in a
   black scene with a lamp their darkest texels may be off by more than 20 tolerances. Where a row
   of texels lies exactly along an axis' horizon, the sum over centres has texel^2 / 12 of a kink's
   slope too much or too little, and half the row of a jump (x^N, N < 0.2), which FAST has right.
   A texel that is wholly beyond a disc's rim counts in lookups beside it: a scene that has no other
   light is promised nothing.
   Memory beside dst, where src has S bytes and dst D: REFERENCE 4 S + D, HIERARCHICAL 8 S + D;
   FAST S + D + 100 L^2 + 2 MB, 200 L^2 at 1e-5, L up to 1.5 envmap_sh_bands; for lobes thinner than
   two texels 9 (S + D) + 2 MB, mostly half, and 3 MB for each of 16 tasks where there is an
   executor. Points that stand for texels of few, of sphere and angular maps under GGX, and for
   functions, take 52 bytes each, and are at most 4 million; functions with negative parts take
   another 4 S of a sphere map. Texels that lobes of one to two texels spread keep their places
   (16, or 4, of 24 bytes), if these are at most 960000.  Test: tests/test_memory.c.
   Source [KVHS00] 4, 5.1.  Test: tests/test_filters.c, test_hierarchical.c; time: search_slow.h. */
ENVMAP_API envmap_result envmap_filter(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                       const envmap_filter_desc *desc);

/* The same into level i with lobes[i], i < count, count in 1 .. dst->levels; all levels or none. */
ENVMAP_API envmap_result envmap_filter_chain(envmap *dst, const envmap *src,
                                             const envmap_lobe *lobes, int count,
                                             const envmap_filter_desc *desc);

/* What FAST learns of a source, once for many calls: calls with desc.prepared and the same src, not
   changed or freed meanwhile, take it from there where their lobes need no more bands and no finer
   tolerance than these lobes; others do their own work.
   prepared  its memory context set, or zero; overwritten without freeing
   lobes     1 .. 32: those that will be asked for, or the sharpest of them
   desc      tolerance, executor
   Errors: ARGUMENT (also a source of several slices), LOBE, RADIANCE, MEMORY.  Memory as FAST's.
   Test: a_prepared_source_gives_the_same_map. */
ENVMAP_API envmap_result envmap_prepare(envmap_prepared *prepared, const envmap *src,
                                        const envmap_lobe *lobes, int count,
                                        const envmap_filter_desc *desc);

/* NULL and twice are fine. */
ENVMAP_API void envmap_prepared_free(envmap_prepared *prepared);

/* ------------------------------------------------------------------------------------ >>plan -- */

/* What a scene needs: expected values, from its own harmonics. */
typedef struct envmap_plan {
    int method;      /* what AUTO takes; AUTO for the mirror                                      */
    int size;        /* smallest edge, 1 .. 16384, of dst's mapping that loses no more than the
                        tolerance when looked up bilinearly; for what is sharper than the source,
                        the edge whose texels are as small as src's                               */
    int bands;       /* fewest bands that lose no more than the tolerance, 1 .. 768               */
    int slices;      /* fewest slices that do, looked up linearly between; 1 for lobes without p  */
    int lights;      /* texels that FAST sums one by one                                          */
    double contrast; /* rms of the result about its mean, over its mean                           */
    double nine;     /* relative rms of what three bands, nine coefficients, lose                 */
    double lookup;   /* relative rms of what bilinear lookups between texels of dst's size lose   */
    double error;    /* relative rms of what `method` loses                                       */
} envmap_plan;

/* What envmap_filter(dst, src, lobe, desc) is expected to lose, and the smallest dst that would do.
   With P_l the power of the filtered scene in band l (of level 0 of slice 0):
     bands   sum_(l >= bands) P_l <= tolerance^2 sum P_l
     size    sum P_l e(l h)^2 <= tolerance^2 sum P_l, in the mean over the map, h the spacing of its
             texels; e(w) -> 0.089 w^2 is the rms of what linear interpolation in u and v loses of
             a wave of w radians a texel; and what a cube's edges lose. Where one light rules the
             tolerance is made smaller, for it may be where texels are largest
     slices  sum_l |a_l|^2 (lambda_l(p) - between two slices)^2, in the mean over p, the same
   dst     mapping, size, levels, slices; no texel of it is read: texels may be NULL
   desc    tolerance, work, prepared
   Errors: those of envmap_filter.  Cost: half the filter's, 0.95 at most; memory as FAST's.
   Source: docs/plan.md.  Test: tests/test_plan.c. */
ENVMAP_API envmap_result envmap_filter_plan(envmap_plan *plan, const envmap *dst, const envmap *src,
                                            const envmap_lobe *lobe,
                                            const envmap_filter_desc *desc);

/* The fewest slices (1 .. 4096) of a map for which the lobe, interpolated between the centres of
   slices, is off by no more than `tolerance` of its rms over all x and p: what a single light can
   show; smooth scenes need fewer. 1 for a lobe without p, 0 for bad ones, 4096 also when more
   would be needed.  Test: slices_needed_are_enough. */
ENVMAP_API int envmap_lobe_slices(const envmap_lobe *lobe, double tolerance);

/* ------------------------------------------------------------------------------- >>materials -- */

/* A reflection model f_r(v, l), 1/sr per channel, in the surface's own frame: x = t, y = n x t,
   z = n; v towards the viewer, l towards the light, unit, both with z > 0. Must be finite, >= 0
   and deterministic, and thread-safe if the executor is parallel.
   What a model does not keep it simply does not use; one that has no n.l in it divides by l[2]. */
typedef void envmap_brdf_function(double f[3], const double v[3], const double l[3], void *user);
typedef struct envmap_brdf {
    envmap_brdf_function *function;
    void *user;
} envmap_brdf;

/* Where and from where a surface is seen; of any length. Of t the part along n is taken out; where
   nothing remains (zero, parallel) any tangent will do, as isotropic models do not ask. */
typedef struct envmap_frame {
    float n[3], t[3], v[3];
} envmap_frame;

/* rgb[i] = sum over texels with n.l > 0 of f_r(v, l) (n.l) L w: outgoing radiance, no filter, no
   approximation but the texel: the truth that every prefiltered map is held against.
   rgb     out [count][3]; black where n.v <= 0: the surface is seen from behind
   map     any parameterization; level 0, slice 0
   frames  [count]
   Models narrower than two texels of map see single texels: resample it to a finer map first.
   Errors: ARGUMENT (also n or v zero, numbers not finite), RADIANCE (NaN, Inf), LOBE (f_r negative
   or not finite), MEMORY, CANCELLED.  O(texels * count), in double; 40 bytes a texel.
   Source [KVHS00] eq. 1.  Test: eq_1_* . */
ENVMAP_API envmap_result envmap_radiance(float *rgb, const envmap *map, const envmap_brdf *brdf,
                                         const envmap_frame *frames, int count,
                                         const envmap_work *work);

/* The part of unpolarised light that a smooth surface reflects, in [0,1].
   cosine  n.v or h.v, clamped to [0,1]
   n, k    index of refraction (inside over outside, > 0) and absorption (>= 0; 0: dielectric).
           n < 1 past the critical angle, sin > n, is total reflection: 1. n = 1, k = 0: 0.
   f0      reflection at normal incidence, ((n-1)^2 + k^2) / ((n+1)^2 + k^2)
   Numbers out of range give 0.  Exact; the other is f0 + (1 - f0)(1 - cosine)^5 [Schlick94], the
   worse the larger k (docs/materials.md).  Test: fresnel_*. */
ENVMAP_API double envmap_fresnel(double cosine, double n, double k);
ENVMAP_API double envmap_fresnel_schlick(double cosine, double f0);

/* A BRDF as one to three lobes, so that maps can be prefiltered for it:
     L = sum over i of factor_i(n.v) map_i(axis_i; n.v),   map_i filtered with envmap_fit_lobe(i)
   axis_i lies in the plane of n and v, turned from n by m_i(n.v) times the angle to v, away from v:
   m = 1 is r_v, 0 n, -1 v; between and beyond: the off-specular peak. */
typedef struct envmap_fit {
    int lobes;     /* 1: glossy, starts at m = 1; 2: and diffuse, m = 0; 3: and retro, m = -1     */
    int slices;    /* 1 .. 256 values of n.v, at (k + 1/2)/slices                                 */
    int size;      /* 16 .. 65536 angles of a lobe: pi/(size-1) should be a third of its sigma    */
    int flat;      /* 1: one row for all slices, the 2D form; 0: the 3D form                      */
    float *table;  /* [lobes][flat ? 1 : slices][size], each row's integral is 1                  */
    float *axis;   /* [lobes][slices]: m                                                          */
    float *factor; /* [lobes][slices][3]: what the lobe reflects of a constant environment        */
    float *error;  /* [slices]: rms over all l of the fit less f_r (n.l), over that of f_r (n.l)  */
    void *memory;  /* context for ENVMAP_MALLOC and ENVMAP_FREE                                   */
} envmap_fit;

/* Fills in the last five of fit; the user sets lobes, slices, size, flat (0: 1, 16, 257, 3D) and
   memory. Frees nothing.
   Each lobe is the mean of f_r (n.l), less the other lobes, around its axis, and not negative: the
   best there is for that axis, which is the one that takes most. Factors by least squares, per
   channel, are scaled so that a constant environment is reflected as f_r (n.l) reflects it.
   Of anisotropic models the one with t in the plane of n and v is seen. Towards grazing views
   f_r (n.l) ends at the horizon and a lobe does not: see fit.error.
   Errors: ARGUMENT, LOBE (f_r negative, not finite, or black), MEMORY, CANCELLED.
   About 6e4 evaluations of f_r a slice for one lobe, 5e5 for three; flat, too, it keeps the memory
   of a row a slice.  Source [KM00]; the sum of lobes and the axis are ours.  Test: fits_*. */
ENVMAP_API envmap_result envmap_fit_brdf(envmap_fit *fit, const envmap_brdf *brdf,
                                         const envmap_work *work);
ENVMAP_API void envmap_fit_free(envmap_fit *fit);

/* Lobe i of a fit, a TABLE with p = n.v over [0,1]; borrows fit->table. Its map needs
   envmap_lobe_slices slices. Bad fits: a lobe that calls refuse. */
ENVMAP_API envmap_lobe envmap_fit_lobe(const envmap_fit *fit, int i);

/* rgb = the sum above; maps [fit->lobes]. Black where n.v <= 0, or for bad fits. */
ENVMAP_API void envmap_fit_lookup(float rgb[3], const envmap_fit *fit, const envmap *maps,
                                  const float n[3], const float v[3]);

/* The integral of f_r (n.l) over l for GGX with height-correlated Smith shadowing and Schlick's
   Fresnel term, as   f0 scale + bias   [Karis13].
     multiple  what bounces between facets more than once, to be multiplied with the diffuse map:
               F E (1 - Ess) / (1 - F (1 - Ess)), E = f0 scale + bias, Ess = scale + bias,
               F = f0 + (1 - f0)/21; f0 = 1 gives 1 - Ess: nothing is lost      [FdezAguera19]
   cosine  n.v in [0,1]; alpha in [1e-4, 1]: outside clamped; NaN: 0
   Error at most 3e-5, and 1e-5 where cosine > 0.1. About 5 us.  Source: [Heitz14].  Test: ggx_*. */
ENVMAP_API void envmap_ggx_split_sum(double *scale, double *bias, double cosine, double alpha);
ENVMAP_API double envmap_ggx_multiple(double f0, double scale, double bias);

/* values[y][x] = (scale, bias), [size][size][2], at texel centres: n.v = (x + 1/2)/size, roughness
   = (y + 1/2)/size, alpha = roughness^2.  size 1 .. 1024.  The executor runs rows.
   Errors: ARGUMENT, MEMORY (as much again), CANCELLED. */
ENVMAP_API envmap_result envmap_ggx_table(float *values, int size, const envmap_work *work);

/* level = (levels - 1) r (1 + bend - bend r) and its inverse: where in a chain a roughness lies.
   bend in [0,1]: 0 linear, 0.7 Unity's, 1 Filament's r (2 - r). Clamped; NaN gives 0.
   Level l of a GGX chain is then envmap_lobe_ggx(roughness^2). */
ENVMAP_API double envmap_roughness_level(double roughness, int levels, double bend);
ENVMAP_API double envmap_level_roughness(double level, int levels, double bend);

/* An elongated highlight from a round map: taps along a tangent whose weights widen the map's lobe
   from `across` to `along`, 1 for a tap in the middle.
     offset_i = h (i - (count-1)/2), weights Gaussian of variance s^2 = along^2 - across^2, sum 1
   offsets  out, rad; weights out; at most `room` are written; either may be NULL
   along, across  sigma of the highlight, and of the map's lobe, rad; along <= 1.5, across > 0
   tolerance  of the ripple between taps, relative to the highlight: 2 exp(-2 (pi u / h)^2),
              u = s across / along; and of the tails cut off; 1e-6 .. 0.5
   Returns count, 0 for bad numbers.  Test: a_fan_of_round_lobes_is_elliptical. */
ENVMAP_API int envmap_fan(float *offsets, float *weights, int room, double along, double across,
                          double tolerance);

/* rgb = sum of weight_i map(l_i), l_i the reflection of v at n turned by offset_i/2 towards t: the
   arc that the glint of a brushed surface draws, t across the strokes. With n = v = r_v the l_i
   lie on the great circle through r_v: a lobe of constant shape, a la Phong.
   Slice 0, level 0. t as in envmap_frame. Bad numbers or maps give black. */
ENVMAP_API void envmap_lookup_fan(float rgb[3], const envmap *map, const float n[3],
                                  const float t[3], const float v[3], const float *offsets,
                                  const float *weights, int count);

/* --------------------------------------------------------------------------------- >>compare -- */

typedef struct envmap_difference {
    int slice, face, x, y; /* where the worst texel is                                            */
    double worst; /* max over texels of max_c |a_c - b_c| / max(max_c b_c, 1e-3 mean b)           */
    double rms;   /* sqrt(sum w |a-b|^2 / sum w |b|^2), all channels and slices                   */
    double bias;  /* sum w (a-b) / sum w b                                                        */
} envmap_difference;

/* How far level `level` of a is from b, the truth; texels outside a rim (w = 0) do not count.
   Black b: 0 where a is black too, else infinity.  Allocates nothing.  Test: differences_*.
   Errors: ARGUMENT (maps of different mapping, edge or slices), RADIANCE (NaN, Inf). */
ENVMAP_API envmap_result envmap_compare(envmap_difference *difference, const envmap *a,
                                        const envmap *b, int level);

#endif /* ENVMAP_H */

/* =========================== you can stop reading here: the bodies =========================== */

#ifdef ENVMAP_IMPLEMENTATION
#ifndef ENVMAP_IMPLEMENTATION_ONCE
#define ENVMAP_IMPLEMENTATION_ONCE

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#ifndef ENVMAP_NO_STDIO
#include <stdio.h>
#endif
#ifndef ENVMAP_MALLOC
#include <stdlib.h>
#define ENVMAP_MALLOC(context, bytes) ((void)(context), malloc(bytes))
#define ENVMAP_FREE(context, pointer) ((void)(context), free(pointer))
#endif

#ifdef ENVMAP_STATIC
#define ENVMAPI_BODY static inline
#elif !defined(ENVMAPI_BODY) /* tests give one, to compile private functions alone */
#define ENVMAPI_BODY
#endif

/* ------------------------------------------------------------------------------------ >>base --
   Numbers, 3-vectors in double, tasks. Bits, not comparisons, decide what is finite, so that
   -ffast-math changes nothing.  Tests: tests/test_base.c. */

#define ENVMAPI_PI    3.14159265358979323846
#define ENVMAPI_FLOAT 3.4028234663852886e38 /* the largest */

ENVMAPI_BODY const char *envmap_result_text(int result) {
#define ENVMAPI_RESULT_TEXT(name, text) text,
    static const char *const texts[] = {ENVMAP_RESULTS(ENVMAPI_RESULT_TEXT)};
    return (unsigned)result < ENVMAP_RESULT_COUNT ? texts[(unsigned)result] : "unknown result";
}

/* Volatile: clang 19 folds the test away under -ffast-math, where no number may be infinite. */
static int envmapi_finite(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    volatile uint64_t exponent = bits >> 52 & 0x7FF;
    return exponent != 0x7FF;
}

static double envmapi_clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

/* Sums may exceed what a float holds; NaN stays to tell of a lobe that failed. */
static float envmapi_to_float(double value) {
    double most = ENVMAPI_FLOAT;
    return (float)(value > most ? most : value < -most ? -most : value);
}

static double envmapi_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The angle between unit vectors, exact also where acos is not. */
static double envmapi_angle(const double a[3], const double b[3]) {
    double minus[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    double plus[3] = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    return 2 * atan2(sqrt(envmapi_dot(minus, minus)), sqrt(envmapi_dot(plus, plus)));
}

/* +z for what is zero or not finite. */
static void envmapi_unit(double out[3], const double in[3]) {
    double scale = fmax(fabs(in[0]), fmax(fabs(in[1]), fabs(in[2])));
    double v[3] = {in[0] / scale, in[1] / scale, in[2] / scale}, length = sqrt(envmapi_dot(v, v));
    int usable = envmapi_finite(length) && envmapi_finite(scale) && scale > 0;
    for (int i = 0; i < 3; ++i) out[i] = usable ? v[i] / length : i == 2;
}
static void envmapi_unit_float(double out[3], const float in[3]) {
    double wide[3] = {(double)in[0], (double)in[1], (double)in[2]};
    envmapi_unit(out, wide);
}

/* The least n in 1 .. limit for which holds(user, n), found by doubling and halving; limit where
   none does. */
static int envmapi_least(int limit, int (*holds)(void *user, int n), void *user) {
    int low = 0, high = 1; /* does not hold; holds */
    while (high < limit && !holds(user, high))
        low = high, high = high < limit / 2 ? 2 * high : limit;
    while (high - low > 1) {
        int n = low + (high - low) / 2;
        if (holds(user, n)) high = n;
        else low = n;
    }
    return high;
}

/* 8-point Gauss-Legendre on [-1,1]: exact for degree 15. Nodes and weights are for +-x. */
static const double envmapi_gauss_x[4] = {0.1834346424956498, 0.5255324099163290,
                                          0.7966664774136267, 0.9602898564975362};
static const double envmapi_gauss_w[4] = {0.3626837833783620, 0.3137066458778873,
                                          0.2223810344533745, 0.1012285362903763};

/* Node i = 0 .. 7 of the rule on [from, to]; returns its weight. */
static double envmapi_gauss(double *node, int i, double from, double to) {
    double half = (to - from) / 2, x = envmapi_gauss_x[i >> 1];
    *node = (from + to) / 2 + (i & 1 ? half : -half) * x;
    return half * envmapi_gauss_w[i >> 1];
}

/* ---- how the work is done: executor, progress, memory */

static envmap_result envmapi_tell(const envmap_progress *progress, double fraction) {
    if (!progress->report) return ENVMAP_OK;
    return progress->report(progress->user, (float)fraction) ? ENVMAP_CANCELLED : ENVMAP_OK;
}

#define ENVMAPI_BATCH 768 /* tasks at most: a byte of stack each */
typedef struct envmapi_batch {
    envmap_task *task;
    void *context;
    int first;
    unsigned char ran[ENVMAPI_BATCH];
} envmapi_batch;

static void envmapi_batch_task(void *context, int i) {
    envmapi_batch *batch = (envmapi_batch *)context;
    if (batch->task) batch->task(batch->context, batch->first + i);
    batch->ran[i] = 1;
}

/* n tasks from `first` on; returns how many the executor left out: these run here. */
static int envmapi_run_batch(const envmap_work *work, envmap_task *task, void *context, int first,
                             int n) {
    envmapi_batch batch = {task, context, first, {0}};
    int left = 0;
    if (work->executor.run) work->executor.run(work->executor.user, envmapi_batch_task, &batch, n);
    for (int i = 0; i < n; ++i)
        if (!batch.ran[i]) envmapi_batch_task(&batch, i), ++left;
    return left;
}

/* All tasks; with a progress callback in 64 rounds or more, told between them on this thread. */
static envmap_result envmapi_run(const envmap_work *work, envmap_task *task, void *context,
                                 int count) {
    int rounds = work->progress.report ? 64 : 1, step = (count + rounds - 1) / rounds;
    if (step > ENVMAPI_BATCH) step = ENVMAPI_BATCH;
    for (int first = 0; first < count; first += step) {
        if (envmapi_tell(&work->progress, (double)first / count)) return ENVMAP_CANCELLED;
        envmapi_run_batch(work, task, context, first, count - first < step ? count - first : step);
    }
    return ENVMAP_OK;
}

/* The same without a word to the progress callback. */
static void envmapi_run_all(const envmap_work *work, envmap_task *task, void *context, int count) {
    envmap_work silent = *work;
    silent.progress.report = NULL;
    envmapi_run(&silent, task, context, count);
}

/* Tasks share nothing and each result is summed in the same order however many there are, so one
   will do where there is one thread. */
#define ENVMAPI_TASKS 16
static int envmapi_tasks(const envmap_work *work) { return work->executor.run ? ENVMAPI_TASKS : 1; }

/* A part of the caller's progress, for one of several runs. */
typedef struct envmapi_part {
    const envmap_progress *whole;
    float from, length;
} envmapi_part;

static int envmapi_report_part(void *user, float fraction) {
    const envmapi_part *part = (const envmapi_part *)user;
    return part->whole->report(part->whole->user, part->from + part->length * fraction);
}

/* The work whose progress runs from done/total to (done + count)/total of the caller's. */
static envmap_work envmapi_work_part(envmapi_part *part, const envmap_work *work, int done,
                                     int count, int total) {
    envmap_work out = *work;
    part->whole = &work->progress;
    part->from = (float)done / (float)total, part->length = (float)count / (float)total;
    out.progress.user = part;
    if (work->progress.report) out.progress.report = envmapi_report_part;
    return out;
}

/* The caller's work, or the default; 0 where its executor does not run what it is given. */
static int envmapi_work_of(envmap_work *out, const envmap_work *work) {
    memset(out, 0, sizeof *out);
    if (work) *out = *work;
    return !out->executor.run || !envmapi_run_batch(out, NULL, NULL, 0, ENVMAPI_TASKS);
}

/* Memory of one call: blocks that go together. */
typedef struct envmapi_pool {
    void *memory, *blocks[64];
    int count;
} envmapi_pool;

/* At a multiple of 64 bytes, and 64 more than asked for may be read. */
static void *envmapi_pool_get(envmapi_pool *pool, size_t count, size_t size) {
    if (pool->count >= 64 || count > SIZE_MAX / 2 / size) return NULL;
    char *block = (char *)ENVMAP_MALLOC(pool->memory, count * size + 128);
    if (!block) return NULL;
    pool->blocks[pool->count++] = block;
    return block + (64 - (uintptr_t)block % 64);
}

static void envmapi_pool_free(envmapi_pool *pool, int keep) {
    while (pool->count > keep) ENVMAP_FREE(pool->memory, pool->blocks[--pool->count]);
}

/* ---- lanes: 4, 8 or 16 numbers in as many registers as they take, in memory or in a variable
   (_at: those in memory). What carries the work. Where C99 evaluates floats as doubles (x87,
   s390x), a float does not multiply a vector of floats: plain loops there. */

#ifdef __GNUC__
#define ENVMAPI_ALIAS __attribute__((may_alias))
#else
#define ENVMAPI_ALIAS
#endif
#if defined(__GNUC__) && __GNUC__ >= 8 && !defined(__clang__)
#define ENVMAPI_UNROLL _Pragma("GCC unroll 8") /* else sums leave their registers at -O2 */
#else
#define ENVMAPI_UNROLL
#endif
#if defined(__GNUC__) && !defined(ENVMAP_NO_SIMD) && __FLT_EVAL_METHOD__ == 0
#define ENVMAPI_PREFETCH(p) __builtin_prefetch(p)
#define ENVMAPI_INLINE      static inline __attribute__((always_inline))
#ifdef __AVX512F__
#define ENVMAPI_REGISTER 64 /* bytes */
#elif defined(__AVX__)
#define ENVMAPI_REGISTER 32
#else
#define ENVMAPI_REGISTER 16
#endif
#define ENVMAPI_PART(type, scalar, n)                                                              \
    typedef scalar type                                                                            \
        __attribute__((vector_size(n * sizeof(scalar) < ENVMAPI_REGISTER ? n * sizeof(scalar)      \
                                                                         : ENVMAPI_REGISTER),      \
                       aligned(sizeof(scalar)), may_alias))
#else
#define ENVMAPI_PREFETCH(p)           (void)0
#define ENVMAPI_INLINE                static inline
#define ENVMAPI_REGISTER              64
#define ENVMAPI_PART(type, scalar, n) typedef scalar type
#endif

#define ENVMAPI_LANE_TYPE(type, scalar, n)                                                         \
    ENVMAPI_PART(type##_part, scalar, n);                                                          \
    typedef struct type {                                                                          \
        type##_part v[n * sizeof(scalar) / sizeof(type##_part)];                                   \
    } ENVMAPI_ALIAS type
#define ENVMAPI_EACH(y) ENVMAPI_UNROLL for (size_t i = 0; i < sizeof(y)->v / sizeof *(y)->v; ++i)
#define ENVMAPI_WIDE    ((int)(ENVMAPI_REGISTER > 32 ? ENVMAPI_REGISTER / sizeof(float) : 8))

ENVMAPI_LANE_TYPE(envmapi_bits, uint32_t, ENVMAPI_WIDE);

/* _add: y += a x. _mad: y += x z. _at: lanes in memory. _solve: (1, 26, 66, 26, 1)/120 c = f in
   place, see envmapi_spline_factor: n items `step` numbers apart, each of 1 .. 4 groups of lanes
   `apart` numbers apart, which hide each other's latency; their factors are `each` rows apart. */
#define ENVMAPI_LANES(type, scalar, lanes)                                                         \
    ENVMAPI_LANE_TYPE(type, scalar, lanes);                                                        \
    ENVMAPI_INLINE void type##_add(type *y, scalar a, const type *x) {                             \
        ENVMAPI_EACH(y) y->v[i] += a * x->v[i];                                                    \
    }                                                                                              \
    ENVMAPI_INLINE void type##_mad(type *y, const type *x, const type *z) {                        \
        ENVMAPI_EACH(y) y->v[i] += x->v[i] * z->v[i];                                              \
    }                                                                                              \
    ENVMAPI_INLINE type *type##_at(const scalar *x) { return (type *)(uintptr_t)x; }               \
    ENVMAPI_INLINE void type##_solve(scalar *f, int n, size_t step, int groups, size_t apart,      \
                                     double(*factors)[3], int each) {                              \
        type one[4], two[4];                                                                       \
        memset(one, 0, sizeof one), memset(two, 0, sizeof two);                                    \
        for (int i = 0; i < n; ++i)                                                                \
            for (int g = 0; g < groups; ++g) {                                                     \
                type *now = type##_at(f + (size_t)i * step + (size_t)g * apart);                   \
                type##_add(now, (scalar)-factors[i + g * each][1], one + g);                       \
                type##_add(now, (scalar)-factors[i + g * each][2], two + g);                       \
                two[g] = one[g], one[g] = *now;                                                    \
            }                                                                                      \
        memset(one, 0, sizeof one), memset(two, 0, sizeof two);                                    \
        for (int i = n - 1; i >= 0; --i)                                                           \
            for (int g = 0; g < groups; ++g) {                                                     \
                type *now = type##_at(f + (size_t)i * step + (size_t)g * apart), done;             \
                memset(&done, 0, sizeof done);                                                     \
                type##_add(&done, (scalar)(120 * factors[i + g * each][0]), now);                  \
                type##_add(&done, (scalar)-factors[i + 1 + g * each][1], one + g);                 \
                type##_add(&done, (scalar)-factors[i + 2 + g * each][2], two + g);                 \
                two[g] = one[g], one[g] = *now = done;                                             \
            }                                                                                      \
    }

ENVMAPI_LANES(envmapi_float4, float, 4)
ENVMAPI_LANES(envmapi_float16, float, 16)
ENVMAPI_LANES(envmapi_double4, double, 4)
ENVMAPI_LANES(envmapi_double8, double, 8)
ENVMAPI_LANES(envmapi_wide, float, ENVMAPI_WIDE) /* a register, or two of 16 bytes */

/* ------------------------------------------------------------------------------ >>directions --
   In: a mapping, a face and (u,v). Out: the direction there; and back. Every room below asks these,
   in double. Cube faces are OpenGL's table of (s_c, t_c, m_a), read as vectors S, T and M:
     cube      d ~ M + (2u-1) S + (2v-1) T
     lat-long  phi = 2 pi (u - 1/2), theta = pi v
     discs     (X,Y) = r d_xy / sin(angle), where the angle to the map's centre gives r:
               paraboloid tan(angle/2)     sphere map sin(angle/2)     angular map angle/pi
     octahedral  the octahedron |x|+|y|+|z| = 1 seen from +y, its lower faces turned out
   (u,v) -> d    envmapi_ray, any length; envmapi_direction, unit length
   d -> (u,v)    envmapi_face, then envmapi_project
   d omega/du dv envmapi_density
   Source: CONVENTIONS; [HS98] eqs. 6-9 for the paraboloids and their matrix; [Debevec98].
   Tests: tests/test_directions.c; directions_round_trip holds that both ways are inverse,
   seams_are_the_same_direction_from_both_sides that faces meet. */

static void envmapi_cross(double out[3], const double a[3], const double b[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Unit vectors t and b = n x t across the unit vector n. t is what the hint has across n; without a
   hint (NULL, zero), or with one along n, any. */
static void envmapi_tangents(double t[3], double b[3], const double n[3], const float *hint) {
    double side[3] = {0, 0, 0}, d[3];
    side[fabs(n[0]) < 0.6 ? 0 : 1] = 1;
    if (hint) envmapi_unit_float(d, hint);
    envmapi_cross(b, n, hint ? d : side);
    if (envmapi_dot(b, b) < 2e-12) envmapi_cross(b, n, side);
    envmapi_unit(b, b);
    envmapi_cross(t, b, n);
}

ENVMAPI_BODY int envmap_faces(int mapping) {
    static const int faces[ENVMAP_MAPPING_COUNT] = {6, 2, 1, 1, 1, 1};
    return mapping >= 0 && mapping < ENVMAP_MAPPING_COUNT ? faces[mapping] : 0;
}

static int envmapi_is_disc(int mapping) {
    return mapping == ENVMAP_PARABOLOID || mapping == ENVMAP_SPHERE || mapping == ENVMAP_ANGULAR;
}

static const double envmapi_cube[6][3][3] = {
    /*     S            T            M     */
    {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},  /* +X */
    {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}},  /* -X */
    {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},    /* +Y */
    {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},  /* -Y */
    {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},   /* +Z */
    {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, /* -Z */
};

/* d_xy = ratio (X,Y); beyond the rim the sphere and angular maps clamp. */
static void envmapi_disc_direction(double d[3], int mapping, int face, double X, double Y) {
    double rr = X * X + Y * Y, ratio;
    if (mapping == ENVMAP_PARABOLOID) {
        ratio = 2 / (1 + rr);
        d[2] = (face == 0 ? 1 - rr : rr - 1) / (1 + rr);
    } else {
        double r = sqrt(rr);
        if (r > 1) X /= r, Y /= r, r = 1;
        if (mapping == ENVMAP_SPHERE) ratio = 2 * sqrt(1 - r * r), d[2] = 1 - 2 * r * r;
        else { /* both, so that a compiler makes one call */
            double sine = sin(ENVMAPI_PI * r), cosine = cos(ENVMAPI_PI * r);
            ratio = r > 0 ? sine / r : ENVMAPI_PI, d[2] = -cosine;
        }
    }
    d[0] = ratio * X, d[1] = ratio * Y;
}

/* A point of the octahedron. (1, 0) and (0, 1) are middles of edges. */
static void envmapi_octa_ray(double d[3], double X, double Y) {
    X -= 4 * floor(X / 4 + 0.5), Y -= 4 * floor(Y / 4 + 0.5);
    if (fabs(X) > 1) X = copysign(2, X) - X, Y = -Y;
    if (fabs(Y) > 1) Y = copysign(2, Y) - Y, X = -X;
    d[0] = X, d[1] = 1 - fabs(X) - fabs(Y), d[2] = Y;
    if (d[1] < 0) d[0] = copysign(1 - fabs(Y), X), d[2] = copysign(1 - fabs(X), Y);
}

static void envmapi_ray(double d[3], int mapping, int face, double u, double v) {
    if (mapping == ENVMAP_CUBE) {
        const double(*axes)[3] = envmapi_cube[face];
        for (int i = 0; i < 3; ++i)
            d[i] = axes[2][i] + (2 * u - 1) * axes[0][i] + (2 * v - 1) * axes[1][i];
    } else if (mapping == ENVMAP_LATLONG) {
        double phi = 2 * ENVMAPI_PI * (u - 0.5), theta = ENVMAPI_PI * v;
        d[0] = sin(theta) * sin(phi), d[1] = cos(theta), d[2] = -sin(theta) * cos(phi);
    } else if (mapping == ENVMAP_OCTAHEDRAL) {
        envmapi_octa_ray(d, 2 * u - 1, 2 * v - 1);
    } else {
        envmapi_disc_direction(d, mapping, face, 2 * u - 1, 1 - 2 * v);
    }
}

static void envmapi_direction(double d[3], int mapping, int face, double u, double v) {
    envmapi_ray(d, mapping, face, u, v);
    if (mapping == ENVMAP_CUBE || mapping == ENVMAP_OCTAHEDRAL) { /* others have unit length */
        double length = sqrt(envmapi_dot(d, d));
        for (int i = 0; i < 3; ++i) d[i] /= length;
    }
}

static int envmapi_face(int mapping, const double d[3]) {
    if (mapping == ENVMAP_PARABOLOID) return d[2] < 0;
    if (mapping != ENVMAP_CUBE) return 0;
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]);
    int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    return 2 * axis + (d[axis] < 0);
}

/* (X,Y) = ratio d_xy. */
static void envmapi_disc_project(double uv[2], int mapping, int face, const double d[3]) {
    double z = face == 1 ? -d[2] : d[2], rho = sqrt(d[0] * d[0] + d[1] * d[1]);
    if (!(rho > 0)) { /* a centre; or a whole rim, of which (1,0) is as good as any point */
        int rim = mapping == ENVMAP_SPHERE ? z < 0 : mapping == ENVMAP_ANGULAR && z > 0;
        uv[0] = rim ? 1 : 0.5, uv[1] = 0.5;
        return;
    }
    double plus = z < 0 ? rho * rho / (1 - z) : 1 + z; /* 1 + z without cancellation */
    double ratio = mapping == ENVMAP_PARABOLOID ? 1 / plus
                   : mapping == ENVMAP_SPHERE   ? 1 / sqrt(2 * plus)
                                                : atan2(rho, -z) / (ENVMAPI_PI * rho);
    uv[0] = 0.5 + 0.5 * d[0] * ratio, uv[1] = 0.5 - 0.5 * d[1] * ratio;
}

/* (u,v) of a unit direction on a given face, also beyond the face's edge (for the cube up to
   nearly a right angle from its centre). */
static void envmapi_project(double uv[2], int mapping, int face, const double d[3]) {
    if (mapping == ENVMAP_CUBE) {
        const double(*axes)[3] = envmapi_cube[face];
        double z = envmapi_dot(d, axes[2]);
        if (z < 1e-3) z = 1e-3;
        for (int i = 0; i < 2; ++i) uv[i] = 0.5 + 0.5 * envmapi_dot(d, axes[i]) / z;
    } else if (mapping == ENVMAP_LATLONG) {
        double rho = sqrt(d[0] * d[0] + d[2] * d[2]);
        uv[0] = rho > 0 ? 0.5 + atan2(d[0], -d[2]) / (2 * ENVMAPI_PI) : 0.5;
        uv[1] = atan2(rho, d[1]) / ENVMAPI_PI;
    } else if (mapping == ENVMAP_OCTAHEDRAL) {
        double all = fabs(d[0]) + fabs(d[1]) + fabs(d[2]), x = d[0] / all, z = d[2] / all;
        uv[0] = 0.5 + 0.5 * (d[1] < 0 ? copysign(1 - fabs(z), x) : x);
        uv[1] = 0.5 + 0.5 * (d[1] < 0 ? copysign(1 - fabs(x), z) : z);
    } else {
        envmapi_disc_project(uv, mapping, face, d);
    }
}

/* Of (u,v) on an octahedral map and its images over the edges and corners, that which is nearest to
   `from`. */
static void envmapi_octa_image(double uv[2], const double from[2]) {
    double u = uv[0], v = uv[1];
    for (int i = 0; i < 8; ++i) {
        double a = i & 4 ? u + 2 * (i & 1) - 1 : (i & 2 ? 1 : 2 * (i & 1)) - u;
        double b = i & 4 ? v + (i & 2) - 1 : (i & 2 ? 2 * (i & 1) : 1) - v;
        if (hypot(a - from[0], b - from[1]) < hypot(uv[0] - from[0], uv[1] - from[1]))
            uv[0] = a, uv[1] = b;
    }
}

/* 0 outside the angular map's rim, where there is nothing. */
static double envmapi_density(int mapping, double u, double v) {
    double X = 2 * u - 1, Y = 2 * v - 1, rr = X * X + Y * Y;
    if (mapping == ENVMAP_CUBE) return 4 / ((1 + rr) * sqrt(1 + rr));
    if (mapping == ENVMAP_LATLONG) return 2 * ENVMAPI_PI * ENVMAPI_PI * sin(ENVMAPI_PI * v);
    if (mapping == ENVMAP_PARABOLOID) return 16 / ((1 + rr) * (1 + rr));
    if (mapping == ENVMAP_SPHERE) return 16;
    if (mapping == ENVMAP_OCTAHEDRAL) {
        double y = 1 - fabs(X) - fabs(Y), x = fabs(X) + fmin(y, 0), z = fabs(Y) + fmin(y, 0);
        double pp = x * x + y * y + z * z;
        return 4 / (pp * sqrt(pp));
    }
    double r = sqrt(rr), density = r > 1e-9 ? sin(ENVMAPI_PI * r) / r : ENVMAPI_PI;
    return r < 1 ? 4 * ENVMAPI_PI * density : 0;
}

ENVMAPI_BODY void envmap_direction(float dir[3], int mapping, int face, float u, float v) {
    double d[3] = {0, 0, 1};
    if (!dir) return;
    if (face >= 0 && face < envmap_faces(mapping) && envmapi_finite((double)u) &&
        envmapi_finite((double)v))
        envmapi_direction(d, mapping, face, (double)u, (double)v);
    for (int i = 0; i < 3; ++i) dir[i] = (float)d[i];
}

ENVMAPI_BODY void envmap_coordinates(int *face, float *u, float *v, int mapping,
                                     const float dir[3]) {
    double d[3] = {0, 0, 1}, uv[2] = {0.5, 0.5};
    int at = 0;
    if (dir) envmapi_unit_float(d, dir);
    if (envmap_faces(mapping)) {
        at = envmapi_face(mapping, d);
        envmapi_project(uv, mapping, at, d);
    }
    if (face) *face = at;
    if (u) *u = (float)envmapi_clamp(uv[0], 0, 1);
    if (v) *v = (float)envmapi_clamp(uv[1], 0, 1);
}

/* inverse = (M / cbrt|det M|)^-1, whose rows are cross products of M's columns; 0 when M is
   singular. M is the linear part of a column-major 4x4 matrix. */
static int envmapi_inverse_rotation(double inverse[3][3], const float modelview[16]) {
    double m[3][3], largest = 0;
    for (int i = 0; i < 9; ++i) {
        m[i / 3][i % 3] = (double)modelview[i / 3 * 4 + i % 3];
        largest = fmax(largest, fabs(m[i / 3][i % 3]));
    }
    for (int r = 0; r < 3; ++r) envmapi_cross(inverse[r], m[(r + 1) % 3], m[(r + 2) % 3]);
    double det = envmapi_dot(m[0], inverse[0]);
    if (!envmapi_finite(det) || !(fabs(det) > 1e-6 * largest * largest * largest)) return 0;
    for (int i = 0; i < 9; ++i) inverse[i / 3][i % 3] *= cbrt(fabs(det)) / det;
    return 1;
}

/* S (M_l)^-1 and, as a fourth column, d give (X,Y,z), the back's (X,Y) turned by diag(-1,-1,1,1);
   then P copies z into q, and u = (q + X)/2q, v = (q - Y)/2q. */
ENVMAPI_BODY envmap_result envmap_paraboloid_matrix(float matrix[16], const float modelview[16],
                                                    int face) {
    double inverse[3][3], side = face == 0 ? -1 : 1;
    if (!matrix || !modelview || face < 0 || face > 1) return ENVMAP_ERROR_ARGUMENT;
    if (!envmapi_inverse_rotation(inverse, modelview)) return ENVMAP_ERROR_ARGUMENT;
    for (int c = 0; c < 4; ++c) {
        double X = c < 3 ? side * inverse[0][c] : 0, Y = c < 3 ? side * inverse[1][c] : 0;
        double z = c < 3 ? -inverse[2][c] : side;
        matrix[4 * c + 0] = (float)((z + X) / 2);
        matrix[4 * c + 1] = (float)((z - Y) / 2);
        matrix[4 * c + 2] = matrix[4 * c + 3] = (float)z;
    }
    return ENVMAP_OK;
}

/* ------------------------------------------------------------------------------------ >>maps --
   In: a map, and a texel, a cell of a face or a direction. Out: memory (envmapi_image), solid angle
   (envmapi_cell) or radiance, texels times weights.
   Solid angle w of the cell [u0,u1] x [v0,v1] of a face, x = 2u-1, y = 1-2v:
     cube      A(x1,y1) - A(x0,y1) - A(x1,y0) + A(x0,y0), A = atan(xy / sqrt(x^2 + y^2 + 1))
     lat-long  dphi (cos theta0 - cos theta1)
     discs     2 pi r^2 g(r^2) being the solid angle of the disc of radius r, Green's theorem says
               w = contour integral of g (x dy - y dx), side by side by _disc_side. Beyond the rim
               there is nothing, so r^2 g stays g(1): a point counts as the rim's next to it.
               g: sphere map 2, paraboloid 2/(1+r^2), angular map (1 - cos pi r)/r^2
     octahedral  folds cut the cell into polygons on the octahedron's faces, these into triangles:
                 tan(w/2) = |abc| / (|a||b||c| + a.b |c| + b.c |a| + c.a |b|)
   Radiance: _add_trilinear has two slices times two levels, each _add_lookup one face or near the
   paraboloids' rim both, each _add_bilinear 2 x 2 texels, each _add_tap one, maybe a neighbour's.
   Turns and mirrors that take texels to texels are for >>resample and >>near, spans for >>mips,
   nests (envmapi_task_nest) for both.
   Tests: tests/test_maps.c; solid_angles_are_the_integral_over_the_texel,
   lookups_are_of_second_order, lookups_are_continuous_across_seams. */

#define ENVMAPI_SIZE_LIMIT  16384
#define ENVMAPI_SLICE_LIMIT 4096
#define ENVMAPI_BYTE_LIMIT  ((uint64_t)1 << 33)

static int envmapi_edge(int size, int level) {
    int edge = size >> level;
    return edge > 1 ? edge : 1;
}

static int envmapi_width(int mapping, int edge) {
    return mapping == ENVMAP_LATLONG ? 2 * edge : edge;
}

/* Texels of one face of edge `edge`. */
static size_t envmapi_area(int mapping, int edge) {
    return (size_t)envmapi_width(mapping, edge) * (size_t)edge;
}

ENVMAPI_BODY int envmap_levels(int size) {
    int levels = 0;
    for (; size > 0; size >>= 1) ++levels;
    return levels;
}

static int envmapi_valid(const envmap *map) {
    return map && map->texels && envmap_faces(map->mapping) && map->size >= 1 &&
           map->size <= ENVMAPI_SIZE_LIMIT && map->levels >= 1 &&
           map->levels <= envmap_levels(map->size) && map->slices >= 1 &&
           map->slices <= ENVMAPI_SLICE_LIMIT;
}

/* dst and src are two valid maps that share no texels, and slices fit. */
static int envmapi_pair_ok(const envmap *dst, const envmap *src) {
    return envmapi_valid(dst) && envmapi_valid(src) && dst != src && dst->texels != src->texels &&
           (src->slices == 1 || src->slices == dst->slices);
}

/* Floats of one slice of a level. */
static size_t envmapi_slice_floats(const envmap *map, int level) {
    return 3 * (size_t)envmap_faces(map->mapping) *
           envmapi_area(map->mapping, envmapi_edge(map->size, level));
}

/* First texel of a face's image. */
static float *envmapi_image(const envmap *map, int level, int slice, int face) {
    size_t area = envmapi_area(map->mapping, envmapi_edge(map->size, level)), before = 0;
    for (int l = 0; l < level; ++l) before += (size_t)map->slices * envmapi_slice_floats(map, l);
    return map->texels + before + (size_t)slice * envmapi_slice_floats(map, level) +
           3 * (size_t)face * area;
}

/* No NaN, no Inf, and no negative number unless they are allowed. */
static int envmapi_floats_ok(const float *floats, size_t count, int negative_too) {
    int bad = 0;
    for (size_t i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, floats + i, sizeof bits);
        bad |= (bits & 0x7F800000u) == 0x7F800000u || (!negative_too && bits > 0x80000000u);
    }
    return !bad;
}

/* e of the largest |number| = f 2^e, f in [1/2, 1); 0 where all are 0. */
static int envmapi_exponent(const float *floats, size_t count) {
    int exponent;
    double most = 0;
    for (size_t i = 0; i < count; ++i) most = fmax(most, fabs((double)floats[i]));
    frexp(most, &exponent);
    return exponent;
}

/* out = in 2^exponent, or the largest float; NaN stays. */
static void envmapi_floats_scale(float *out, const float *in, size_t count, int exponent) {
    for (size_t i = 0; i < count; ++i) out[i] = envmapi_to_float(ldexp((double)in[i], exponent));
}

static int envmapi_radiance_ok(const envmap *map, int negative_too) {
    return envmapi_floats_ok(map->texels, (size_t)map->slices * envmapi_slice_floats(map, 0),
                             negative_too);
}

/* Checks of numbers, or copies of them; a megabyte and more as tasks. */
typedef struct envmapi_scan {
    float *out; /* NULL: envmapi_floats_ok */
    const float *in;
    size_t count;
    int tasks, negative_too, bad[ENVMAPI_TASKS];
} envmapi_scan;

static void envmapi_task_scan(void *context, int task) {
    envmapi_scan *s = (envmapi_scan *)context;
    size_t each = s->count / (size_t)s->tasks, from = (size_t)task * each;
    if (task == s->tasks - 1) each = s->count - from;
    if (s->out) memcpy(s->out + from, s->in + from, each * sizeof(float));
    else s->bad[task] = !envmapi_floats_ok(s->in + from, each, s->negative_too);
}

static int envmapi_scan_run(float *out, const float *in, size_t count, int negative_too,
                            const envmap_work *work) {
    envmapi_scan s = {out, in, count, count >> 18 ? ENVMAPI_TASKS : 1, negative_too, {0}};
    int bad = 0;
    if (s.tasks > 1) envmapi_run_all(work, envmapi_task_scan, &s, s.tasks);
    else envmapi_task_scan(&s, 0);
    for (int i = 0; i < s.tasks; ++i) bad |= s.bad[i];
    return !bad;
}

/* Level 0 of slice `first` into that of the following ones, count of all of them. */
static void envmapi_copy_slices(const envmap *map, int first, int count) {
    for (int k = first + 1; k < first + count; ++k)
        memcpy(envmapi_image(map, 0, k, 0), envmapi_image(map, 0, first, 0),
               envmapi_slice_floats(map, 0) * sizeof(float));
}

ENVMAPI_BODY envmap_result envmap_create(envmap *map, int mapping, int size, int levels,
                                         int slices) {
    uint64_t texels = 0, faces = (uint64_t)envmap_faces(mapping);
    if (!map || !faces || size < 1 || levels < 1 || levels > envmap_levels(size) || slices < 1)
        return ENVMAP_ERROR_ARGUMENT;
    if (size > ENVMAPI_SIZE_LIMIT || slices > ENVMAPI_SLICE_LIMIT) return ENVMAP_ERROR_LIMIT;
    for (int l = 0; l < levels; ++l) texels += faces * envmapi_area(mapping, envmapi_edge(size, l));
    uint64_t bytes = texels * (uint64_t)slices * 3 * sizeof(float);
    if (bytes > ENVMAPI_BYTE_LIMIT || bytes > PTRDIFF_MAX) return ENVMAP_ERROR_LIMIT;
    float *memory = (float *)ENVMAP_MALLOC(map->memory, (size_t)bytes);
    if (!memory) return ENVMAP_ERROR_MEMORY;
    memset(memory, 0, (size_t)bytes);
    map->texels = memory;
    map->mapping = mapping, map->size = size, map->levels = levels, map->slices = slices;
    map->p0 = -1, map->p1 = 1;
    return ENVMAP_OK;
}

ENVMAPI_BODY void envmap_free(envmap *map) {
    if (!map) return;
    void *memory = map->memory;
    if (map->texels) ENVMAP_FREE(memory, map->texels);
    memset(map, 0, sizeof *map);
    map->memory = memory;
}

ENVMAPI_BODY float *envmap_texel(const envmap *map, int level, int slice, int face, int x, int y) {
    if (!envmapi_valid(map) || level < 0 || level >= map->levels || slice < 0 ||
        slice >= map->slices || face < 0 || face >= envmap_faces(map->mapping))
        return NULL;
    int edge = envmapi_edge(map->size, level), width = envmapi_width(map->mapping, edge);
    if (x < 0 || x >= width || y < 0 || y >= edge) return NULL;
    size_t texel = (size_t)y * (size_t)width + (size_t)x;
    return envmapi_image(map, level, slice, face) + 3 * texel;
}

/* ---- solid angles ---- */

static double envmapi_disc_g(int mapping, double rr) {
    if (mapping == ENVMAP_SPHERE) return 2;
    if (mapping == ENVMAP_PARABOLOID) return 2 / (1 + rr);
    double half = sin(0.5 * ENVMAPI_PI * sqrt(rr));
    return rr > 1e-12 ? 2 * half * half / rr : ENVMAPI_PI * ENVMAPI_PI / 2;
}

/* The side from a to b of a cell: returns its share of the solid angle. Where a rim cuts the cell,
   sums gets its shares of the area and the first moments too; the integrands have kinks where the
   side meets the rim. */
static double envmapi_disc_side(double *sums, int mapping, const double a[2], const double b[2]) {
    double dx = b[0] - a[0], dy = b[1] - a[1], cross = a[0] * b[1] - a[1] * b[0], sum = 0;
    double dd = dx * dx + dy * dy, ends[4] = {0, 0, 0, 1}, t;
    if (!sums && dd < 1e-3) { /* three points of Gauss-Legendre are as exact here */
        for (int i = -1; i < 2; ++i) {
            double x = a[0] + (0.5 + i * 0.3872983346207417) * dx;
            double y = a[1] + (0.5 + i * 0.3872983346207417) * dy;
            sum += (i ? 5 : 8) * envmapi_disc_g(mapping, x * x + y * y) / 18;
        }
        return cross * sum;
    }
    if (sums) {
        double ad = a[0] * dx + a[1] * dy, root = ad * ad - dd * (a[0] * a[0] + a[1] * a[1] - 1);
        ends[1] = envmapi_clamp((-ad - sqrt(root > 0 ? root : 0)) / dd, 0, 1);
        ends[2] = envmapi_clamp((-ad + sqrt(root > 0 ? root : 0)) / dd, 0, 1);
    }
    for (int part = 0; part < 3; ++part) {
        if (!(ends[part + 1] > ends[part])) continue;
        int pieces = 1 + (int)(4 * (ends[part + 1] - ends[part]) * sqrt(dd));
        double step = (ends[part + 1] - ends[part]) / pieces;
        for (int i = 0; i < 8 * pieces; ++i) {
            double from = ends[part] + (i >> 3) * step;
            double weight = envmapi_gauss(&t, i & 7, from, from + step);
            double x = a[0] + t * dx, y = a[1] + t * dy, rr = x * x + y * y;
            if (rr > 1) x /= sqrt(rr), y /= sqrt(rr), weight /= rr, rr = 1;
            sum += weight * envmapi_disc_g(mapping, rr);
            if (!sums) continue;
            sums[0] += cross * weight / 2;
            sums[1] += cross * weight * x / 3, sums[2] += cross * weight * y / 3;
        }
    }
    return cross * sum;
}

/* A of four corners, as the argument of a product of complex numbers: one arc tangent, not four,
   and for a small cell its series, which is as exact and takes a fifth of the time. */
ENVMAPI_INLINE void envmapi_cube_turn(double to[2], double x0, double y0, double x1, double y1,
                                      double s00, double s01, double s10, double s11) {
    double re = s11 * s00 - x1 * y1 * x0 * y0, im = s11 * x0 * y0 + s00 * x1 * y1;
    double less_re = s01 * s10 - x0 * y1 * x1 * y0, less_im = s01 * x1 * y0 + s10 * x0 * y1;
    to[0] = re * less_re + im * less_im, to[1] = im * less_re - re * less_im;
}
ENVMAPI_INLINE double envmapi_small_atan(double z) {
    double zz = z * z;
    return z * (1 - zz * (1 / 3.0 - zz * (1 / 5.0 - zz * (1 / 7.0 - zz / 9))));
}
static double envmapi_cube_cell(double x0, double y0, double x1, double y1) {
    double a = x1 * x1 + 1, b = x0 * x0 + 1, p = y1 * y1, q = y0 * y0, to[2];
    envmapi_cube_turn(to, x0, y0, x1, y1, sqrt(b + q), sqrt(b + p), sqrt(a + q), sqrt(a + p));
    int tiny = fabs(to[1]) < 0.02 * to[0];
    return tiny ? envmapi_small_atan(to[1] / to[0]) : atan2(to[1], to[0]);
}

/* Solid angle of a triangle of three rays. */
static double envmapi_spherical_triangle(const double a[3], const double b[3], const double c[3]) {
    double ab[3], ac[3], n[3], of_a = sqrt(envmapi_dot(a, a)), of_b = sqrt(envmapi_dot(b, b));
    double of_c = sqrt(envmapi_dot(c, c));
    for (int i = 0; i < 3; ++i) ab[i] = b[i] - a[i], ac[i] = c[i] - a[i];
    envmapi_cross(n, ab, ac);
    return 2 *
           atan2(fabs(envmapi_dot(a, n)), of_a * (of_b * of_c + envmapi_dot(b, c)) +
                                              envmapi_dot(a, b) * of_c + envmapi_dot(c, a) * of_b);
}

/* What lies of a rectangle in a quadrant of an octahedral map (X, Y >= 0) above, and below the
   horizon X + Y = 1. */
static double envmapi_octa_rectangle(const double p[4][2]) {
    double d[6][3], w = 0;
    for (int side = -1; side < 2; side += 2) {
        int n = 0;
        for (int i = 0; i < 4; ++i) {
            const double *a = p[i], *b = p[(i + 1) & 3];
            double from = side * (1 - a[0] - a[1]), to = side * (1 - b[0] - b[1]);
            if (from >= 0) envmapi_octa_ray(d[n++], a[0], a[1]);
            if (!(from * to < 0)) continue;
            double t = from / (from - to);
            envmapi_octa_ray(d[n++], a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]));
        }
        for (int i = 2; i < n && i < 6; ++i) /* a compiler cannot know that n is 5 at most */
            w += envmapi_spherical_triangle(d[0], d[i - 1], d[i]);
    }
    return w;
}

static double envmapi_octa_cell(double x0, double y0, double x1, double y1) {
    double w = 0;
    for (int i = 0; i < 4; ++i) {
        double a0 = fmax(i & 1 ? -x1 : x0, 0), a1 = i & 1 ? -x0 : x1;
        double b0 = fmax(i & 2 ? -y1 : y0, 0), b1 = i & 2 ? -y0 : y1;
        const double corners[4][2] = {{a0, b0}, {a1, b0}, {a1, b1}, {a0, b1}};
        if (a0 < a1 && b0 < b1) w += envmapi_octa_rectangle(corners);
    }
    return w;
}

/* Solid angle of a cell, and (when asked for) the (u,v) it counts at: its centre, or the centroid
   of the part inside the rim. */
static double envmapi_cell(double centre[2], int mapping, double u0, double v0, double u1,
                           double v1) {
    double x0 = 2 * u0 - 1, x1 = 2 * u1 - 1, y0 = 1 - 2 * v1, y1 = 1 - 2 * v0;
    if (centre) centre[0] = (u0 + u1) / 2, centre[1] = (v0 + v1) / 2;
    if (mapping == ENVMAP_CUBE) return envmapi_cube_cell(x0, y0, x1, y1);
    if (mapping == ENVMAP_OCTAHEDRAL) return envmapi_octa_cell(x0, y0, x1, y1);
    if (mapping == ENVMAP_LATLONG)
        return 4 * ENVMAPI_PI * (u1 - u0) * sin(ENVMAPI_PI * (v0 + v1) / 2) *
               sin(ENVMAPI_PI * (v1 - v0) / 2);
    const double corners[4][2] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    double most_x = fmax(fabs(x0), fabs(x1)), least_x = x0 * x1 > 0 ? fmin(fabs(x0), fabs(x1)) : 0;
    double most_y = fmax(fabs(y0), fabs(y1)), least_y = y0 * y1 > 0 ? fmin(fabs(y0), fabs(y1)) : 0;
    double sums[3] = {0, 0, 0}, w = 0;
    int cut = most_x * most_x + most_y * most_y > 1;
    if (least_x * least_x + least_y * least_y >= 1) return 0;
    if (!cut && mapping == ENVMAP_SPHERE) return 16 * (u1 - u0) * (v1 - v0);
    for (int i = 0; i < 4; ++i)
        w += envmapi_disc_side(cut ? sums : NULL, mapping, corners[i], corners[(i + 1) & 3]);
    if (!cut) return w;
    if (!(sums[0] > 1e-15)) return 0;
    if (centre) centre[0] = 0.5 + 0.5 * sums[1] / sums[0];
    if (centre) centre[1] = 0.5 - 0.5 * sums[2] / sums[0];
    return w;
}

/* The same for texel (x,y) of a face of edge `edge`. */
static double envmapi_texel_cell(double centre[2], int mapping, int edge, int x, int y) {
    double w = envmapi_width(mapping, edge), h = edge;
    return envmapi_cell(centre, mapping, x / w, y / h, (x + 1) / w, (y + 1) / h);
}

ENVMAPI_BODY double envmap_solid_angle(const envmap *map, int level, int face, int x, int y) {
    if (!envmap_texel(map, level, 0, face, x, y)) return 0;
    return envmapi_texel_cell(NULL, map->mapping, envmapi_edge(map->size, level), x, y);
}

/* Direction of the centre of texel (x,y), in the extended domain outside a rim. */
static void envmapi_texel_direction(double d[3], int mapping, int face, int edge, int x, int y) {
    envmapi_direction(d, mapping, face, (x + 0.5) / envmapi_width(mapping, edge), (y + 0.5) / edge);
}

/* ---- lookups ---- */

/* One level of one slice. */
typedef struct envmapi_level {
    const float *texels; /* face 0; NULL: lookups add weights, to numbers one a texel */
    int mapping, edge, width;
} envmapi_level;

/* A map's only slice stands for all. */
static envmapi_level envmapi_level_of(const envmap *map, int level, int slice) {
    int edge = envmapi_edge(map->size, level);
    envmapi_level out = {envmapi_image(map, level, map->slices > 1 ? slice : 0, 0), map->mapping,
                         edge, envmapi_width(map->mapping, edge)};
    return out;
}

/* The texel of n that u in [0,1] falls in. */
static int envmapi_texel_at(double u, int n) { return (int)envmapi_clamp(floor(u * n), 0, n - 1); }

/* Off one edge of a cube face lies the texel of the neighbouring face that touches it there: its
   coordinate along the edge is the same, so a hair's breadth beyond the edge finds it. */
static void envmapi_cube_neighbour(int *face, int *x, int *y, int edge) {
    double hair = 1e-9, d[3], uv[2];
    double u = *x < 0 ? -hair : *x >= edge ? 1 + hair : (*x + 0.5) / edge;
    double v = *y < 0 ? -hair : *y >= edge ? 1 + hair : (*y + 0.5) / edge;
    envmapi_direction(d, ENVMAP_CUBE, *face, u, v);
    *face = envmapi_face(ENVMAP_CUBE, d);
    envmapi_project(uv, ENVMAP_CUBE, *face, d);
    *x = envmapi_texel_at(uv[0], edge), *y = envmapi_texel_at(uv[1], edge);
}

/* The sphere and angular maps clamp to the rim: to a texel whose centre is inside, so that what a
   file holds outside the circle never matters. */
static void envmapi_rim_neighbour(int *x, int *y, int edge) {
    double X = (2 * *x + 1.0) / edge - 1, Y = (2 * *y + 1.0) / edge - 1, r = X * X + Y * Y;
    if (r <= 1 + 3e-16 /* its root is 1 */) return;
    r = sqrt(r);
    *x = envmapi_texel_at(0.5 + 0.5 * X * (1 - 1.5 / edge) / r, edge);
    *y = envmapi_texel_at(0.5 + 0.5 * Y * (1 - 1.5 / edge) / r, edge);
}

/* Beyond an edge of an octahedral map, the same edge turned about its middle. */
static void envmapi_octa_neighbour(int *x, int *y, int edge) {
    if (*x < 0 || *x >= edge) *x = (*x < 0 ? -1 : 2 * edge - 1) - *x, *y = edge - 1 - *y;
    if (*y < 0 || *y >= edge) *y = (*y < 0 ? -1 : 2 * edge - 1) - *y, *x = edge - 1 - *x;
}

static void envmapi_add_tap(double *rgb, const envmapi_level *level, int face, int x, int y,
                            double weight) {
    int edge = level->edge, width = level->width;
    if (level->mapping == ENVMAP_CUBE) {
        if (x < 0 || y < 0 || x >= edge || y >= edge) envmapi_cube_neighbour(&face, &x, &y, edge);
    } else {
        if (level->mapping == ENVMAP_LATLONG) x = (x + width) % width;
        if (level->mapping == ENVMAP_OCTAHEDRAL) envmapi_octa_neighbour(&x, &y, edge);
        x = x < 0 ? 0 : x >= width ? width - 1 : x;
        y = y < 0 ? 0 : y >= edge ? edge - 1 : y;
        if (level->mapping == ENVMAP_SPHERE || level->mapping == ENVMAP_ANGULAR)
            envmapi_rim_neighbour(&x, &y, edge);
    }
    size_t at = ((size_t)face * (size_t)edge + (size_t)y) * (size_t)width + (size_t)x;
    if (!level->texels) rgb[at] += weight;
    for (int c = 0; c < 3 && level->texels; ++c)
        rgb[c] += weight * (double)level->texels[3 * at + (size_t)c];
}

/* rgb += weight times the bilinear value at (u,v) of a face. Within half a texel of a lat-long pole
   the row blends into its mean. Beyond a cube's corner there is no texel: the mean of the three
   that meet there stands in, which is continuous. */
static void envmapi_add_bilinear(double *rgb, const envmapi_level *level, int face, double u,
                                 double v, double weight) {
    double s = u * level->width - 0.5, t = v * level->edge - 0.5;
    int x = (int)floor(s), y = (int)floor(t), n = level->edge;
    double fx = s - x, fy = t - y, pole = t < 0 ? -2 * t : t > n - 1 ? 2 * (t - (n - 1)) : 0;
    if (level->mapping == ENVMAP_LATLONG && pole > 0) {
        for (int i = 0; i < level->width; ++i)
            envmapi_add_tap(rgb, level, 0, i, y, weight * pole / level->width);
        weight *= 1 - pole;
    }
    double taps[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    if (level->mapping == ENVMAP_CUBE && (x < 0 || x >= n - 1) && (y < 0 || y >= n - 1)) {
        int corner = (x < 0 ? 0 : 1) + (y < 0 ? 0 : 2);
        double third = taps[corner] / 3;
        for (int i = 0; i < 4; ++i) taps[i] = i == corner ? 0 : taps[i] + third;
    }
    for (int i = 0; i < 4; ++i)
        if (taps[i] > 0)
            envmapi_add_tap(rgb, level, face, x + (i & 1), y + (i >> 1), taps[i] * weight);
}

/* The share of a paraboloid of edge n at the radius r in its own plane, 1 the rim. In the last half
   texel before the rim the paraboloids blend, to half and half on it, so that front and back agree
   there; beyond the rim is what the other one has within it, at 1/r. */
static double envmapi_paraboloid_share(double r, int n) {
    double inside = (r > 1 ? 1 - 1 / r : 1 - r) * n;
    if (inside < 1) return r > 1 ? 0.5 * (1 - inside) : 0.5 * (1 + inside);
    return r > 1 ? 0 : 1;
}

/* Bilinear in direction d, where paraboloids blend of both. */
static void envmapi_add_lookup(double *rgb, const envmapi_level *level, const double d[3],
                               double weight) {
    int face = envmapi_face(level->mapping, d);
    double uv[2];
    if (level->mapping == ENVMAP_PARABOLOID) {
        double r = sqrt((1 - fabs(d[2])) / (1 + fabs(d[2])));
        double other = 1 - envmapi_paraboloid_share(r, level->edge);
        if (other > 0) { /* weights may be negative */
            envmapi_project(uv, ENVMAP_PARABOLOID, 1 - face, d);
            envmapi_add_bilinear(rgb, level, 1 - face, uv[0], uv[1], weight * other);
            weight *= 1 - other;
        }
    }
    envmapi_project(uv, level->mapping, face, d);
    envmapi_add_bilinear(rgb, level, face, uv[0], uv[1], weight);
}

/* Where p lies among the centres of n slices from p0 to p1: 0 .. n-1; 0 where there is no p. */
static double envmapi_slice_at(double p, double p0, double p1, int n) {
    double range = p1 - p0, s = fabs(range) > 0 ? (p - p0) / range * n - 0.5 : 0;
    return envmapi_finite(s) ? envmapi_clamp(s, 0, n - 1) : 0;
}

/* rgb += weight times the radiance in direction d, trilinear, at slice s and a mip level. */
static void envmapi_add_trilinear(double rgb[3], const envmap *map, const double d[3], double s,
                                  double level, double weight) {
    double l = level > 0 ? envmapi_clamp(level, 0, map->levels - 1) : 0;
    if (!envmapi_finite(l)) l = 0; /* -ffast-math may let NaN pass */
    double f_s = s - (int)s, f_l = l - (int)l;
    for (int i = 0; i < 4; ++i) {
        double share = (i & 1 ? f_s : 1 - f_s) * (i & 2 ? f_l : 1 - f_l);
        if (!(share > 0)) continue;
        envmapi_level image = envmapi_level_of(map, (int)l + (i >> 1), (int)s + (i & 1));
        envmapi_add_lookup(rgb, &image, d, weight * share);
    }
}

ENVMAPI_BODY void envmap_lookup_slice(float rgb[3], const envmap *map, const float dir[3], float p,
                                      float level) {
    double sum[3] = {0, 0, 0}, d[3];
    if (!rgb) return;
    if (dir && envmapi_valid(map)) {
        double s = envmapi_slice_at((double)p, (double)map->p0, (double)map->p1, map->slices);
        envmapi_unit_float(d, dir);
        envmapi_add_trilinear(sum, map, d, s, (double)level, 1);
    }
    for (int c = 0; c < 3; ++c) rgb[c] = (float)sum[c];
}

ENVMAPI_BODY void envmap_lookup(float rgb[3], const envmap *map, const float dir[3], float level) {
    envmap_lookup_slice(rgb, map, dir, map ? map->p0 : 0, level);
}

/* ---- symmetries: turns and mirrors that take axes to axes, and texels to texels */

/* Where a turn takes texel (x,y) of a face: to (x0 + xx x + xy y, y0 + yx x + yy y) of `face`. */
typedef struct envmapi_place {
    int face, x0, y0, xx, xy, yx, yy;
} envmapi_place;
typedef struct envmapi_turn {
    envmapi_place src[6], dst[6];
} envmapi_turn;

/* Turn t of 48: axes are permuted, t / 8, and some change their sign, t % 8. 0 where texels do not
   go to texels. Four probes tell: three define the place, the fourth must agree. */
static int envmapi_turn_place(envmapi_place *place, int t, int mapping, int edge, int face) {
    static const signed char axes[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                           {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    static const double probes[4][2] = {{0.5, 0.5}, {0.6, 0.5}, {0.5, 0.6}, {0.3, 0.65}};
    double d[3], turned[3], at[4][2], width = envmapi_width(mapping, edge), off = 0;
    int slope[4];
    for (int i = 0; i < 4; ++i) {
        envmapi_direction(d, mapping, face, probes[i][0], probes[i][1]);
        for (int c = 0; c < 3; ++c) turned[c] = (t >> c & 1 ? -1 : 1) * d[axes[t / 8][c]];
        if (!i) place->face = envmapi_face(mapping, turned);
        envmapi_project(at[i], mapping, place->face, turned);
        for (int c = 0; c < 2 && i; ++c) {
            double apart = at[i][c] - at[0][c];
            if (mapping == ENVMAP_LATLONG && !c) apart -= floor(apart + 0.5);
            if (i < 3) slope[2 * (i - 1) + c] = (int)floor(10 * apart + 0.5);
            off += i < 3 ? fabs(apart - 0.1 * slope[2 * (i - 1) + c])
                         : fabs(apart + 0.2 * slope[c] - 0.15 * slope[2 + c]);
        }
    }
    double x0 = width * at[0][0] - 0.5 + slope[0] * (1 - width) / 2 + slope[2] * (1.0 - edge) / 2;
    double y0 = edge * at[0][1] - 0.5 + slope[1] * (1 - width) / 2 + slope[3] * (1.0 - edge) / 2;
    place->x0 = (int)floor(x0 + 0.5), place->y0 = (int)floor(y0 + 0.5);
    place->xx = slope[0], place->yx = slope[1], place->xy = slope[2], place->yy = slope[3];
    return off + fabs(x0 - place->x0) + fabs(y0 - place->y0) < 1e-6;
}

/* All turns that serve both maps; returns how many. The first is none. */
static int envmapi_turns(envmapi_turn turns[48], const envmap *dst, const envmap *src) {
    int count = 0;
    for (int t = 0; t < 48; ++t) {
        int serves = 1;
        envmapi_turn *turn = turns + count;
        for (int face = 0; face < envmap_faces(src->mapping); ++face)
            serves &= envmapi_turn_place(turn->src + face, t, src->mapping, src->size, face);
        for (int face = 0; face < envmap_faces(dst->mapping); ++face)
            serves &= envmapi_turn_place(turn->dst + face, t, dst->mapping, dst->size, face);
        count += serves;
    }
    return count;
}

/* The texel that a turn takes (x,y) of a face to. */
ENVMAPI_INLINE size_t envmapi_turned(const envmap *map, const envmapi_place *to, int x, int y) {
    int w = envmapi_width(map->mapping, map->size), at = to->x0 + to->xx * x + to->xy * y;
    size_t row = (size_t)to->face * (size_t)map->size + (size_t)(to->y0 + to->yx * x + to->yy * y);
    return row * (size_t)w + (size_t)(at < 0   ? at + w
                                      : at < w ? at
                                               : at - w); /* a lat-long's seam */
}

/* Where up to 16 turns take the texels of a face: texel (0,0), by its number in the map and its
   column, and steps along x and y from there. Fewer turns: the last one again. */
typedef struct envmapi_images {
    int first[16], right[16], down[16], column[16], along[16];
} envmapi_images;

static void envmapi_images_of(envmapi_images *images, const envmap *map, const envmapi_turn *turns,
                              int count, int dst) {
    int w = envmapi_width(map->mapping, map->size);
    for (int i = 0; i < 16 * envmap_faces(map->mapping); ++i) {
        const envmapi_turn *turn = turns + (i % 16 < count ? i % 16 : count - 1);
        const envmapi_place *at = (dst ? turn->dst : turn->src) + i / 16;
        envmapi_images *s = images + i / 16;
        s->first[i % 16] = at->x0 + (at->y0 + at->face * map->size) * w;
        s->right[i % 16] = at->xx + at->yx * w, s->down[i % 16] = at->xy + at->yy * w;
        s->column[i % 16] = at->x0, s->along[i % 16] = at->xx;
    }
}

/* The numbers of the images of texel (x,y). */
ENVMAPI_INLINE void envmapi_images_at(int at[16], const envmapi_images *s, const envmap *map, int x,
                                      int y) {
    int latlong = map->mapping == ENVMAP_LATLONG, w = 2 * map->size;
    for (int i = 0; i < 16; ++i) {
        int column = s->column[i] + s->along[i] * x, wrap = column < 0 ? w : column < w ? 0 : -w;
        at[i] = s->first[i] + s->right[i] * x + s->down[i] * y + (latlong ? wrap : 0);
    }
}

/* ---- spans, for footprints */

/* From a to b in texels of a face of edge `edge`, along u and v, seen on the face of d. */
static void envmapi_span(double texels[2], int mapping, int edge, const double d[3],
                         const double a[3], const double b[3]) {
    double from[2], to[2];
    int face = envmapi_face(mapping, d);
    envmapi_project(from, mapping, face, a);
    envmapi_project(to, mapping, face, b);
    if (mapping == ENVMAP_OCTAHEDRAL) envmapi_octa_image(to, from);
    double du = to[0] - from[0];
    if (mapping == ENVMAP_LATLONG) du -= floor(du + 0.5);
    texels[0] = du * envmapi_width(mapping, edge), texels[1] = (to[1] - from[1]) * edge;
}

/* ---- nests: a texel of a coarser map of the same mapping, and what lies under it */

#define ENVMAPI_NEST 16 /* more than mips have under a texel */
typedef struct envmapi_nest {
    const float *from;
    float *to;
    int mapping, fine, edge, images; /* edges of both; faces times slices */
} envmapi_nest;

/* Some texels of the finer map, weights and where they are: as they lie and in three mirrors. */
typedef struct envmapi_nest_list {
    double w[ENVMAPI_NEST];
    size_t at[4][ENVMAPI_NEST];
    int count;
} envmapi_nest_list;

static void envmapi_nest_sum(double sums[][3], envmapi_nest_list *list, const float *from,
                             size_t size, int images) {
    for (int i = 0; i < 4 * images; ++i) {
        const float *image = from + (size_t)(i / 4) * size;
        const size_t *at = list->at[i & 3];
        double r = sums[i][0], g = sums[i][1], b = sums[i][2];
        for (int k = 0; k < list->count; ++k) {
            const float *texel = image + at[k];
            double w = list->w[k];
            r += w * (double)texel[0], g += w * (double)texel[1], b += w * (double)texel[2];
        }
        sums[i][0] = r, sums[i][1] = g, sums[i][2] = b;
    }
    list->count = 0;
}

/* A texel of up to 16 images, and its mirror images along u and v, where solid angles are the same:
   the sums by solid angle, or plain, of what lies under it; returns that of the weights. */
static double envmapi_nest_sums(double sums[][3], const envmapi_nest *n, int first, int images,
                                int x, int y, int plain) {
    int width = envmapi_width(n->mapping, n->edge), above = envmapi_width(n->mapping, n->fine);
    size_t size = 3 * envmapi_area(n->mapping, n->fine);
    const float *from = n->from + (size_t)first * size;
    double all = 0;
    envmapi_nest_list list;
    memset(sums, 0, (size_t)(12 * images) * sizeof(double)), list.count = 0;
    /* integers decide which child is first and last: no rounding */
    for (int b = y * n->fine / n->edge; b * n->edge < (y + 1) * n->fine; ++b) {
        double v0 = fmax((double)y / n->edge, (double)b / n->fine);
        double v1 = fmin((y + 1.0) / n->edge, (b + 1.0) / n->fine);
        for (int a = x * above / width; a * width < (x + 1) * above; ++a) {
            double u0 = fmax((double)x / width, (double)a / above);
            double u1 = fmin((x + 1.0) / width, (a + 1.0) / above);
            double w =
                plain ? (u1 - u0) * (v1 - v0) : envmapi_cell(NULL, n->mapping, u0, v0, u1, v1);
            if (list.count == ENVMAPI_NEST) envmapi_nest_sum(sums, &list, from, size, images);
            for (int i = 0; i < 4; ++i) {
                int u = i & 1 ? above - 1 - a : a, v = i & 2 ? n->fine - 1 - b : b;
                list.at[i][list.count] = 3 * ((size_t)v * (size_t)above + (size_t)u);
            }
            list.w[list.count++] = w, all += w;
        }
    }
    envmapi_nest_sum(sums, &list, from, size, images);
    return all;
}

/* The means; the plain ones for a texel wholly outside a rim. */
static void envmapi_nest_texel(const envmapi_nest *n, int first, int images, int x, int y) {
    int width = envmapi_width(n->mapping, n->edge);
    size_t area = envmapi_area(n->mapping, n->edge);
    double sums[64][3], all = envmapi_nest_sums(sums, n, first, images, x, y, 0);
    if (!(all > 0)) all = envmapi_nest_sums(sums, n, first, images, x, y, 1);
    for (int i = 0; i < 4 * images; ++i) {
        int u = i & 1 ? width - 1 - x : x, v = i & 2 ? n->edge - 1 - y : y;
        float *to =
            n->to + 3 * ((size_t)(first + i / 4) * area + (size_t)v * (size_t)width + (size_t)u);
        for (int c = 0; c < 3; ++c) to[c] = (float)(sums[i][c] * (1 / all));
    }
}

/* Task: row y of all images, and its mirror image. */
static void envmapi_task_nest(void *context, int y) {
    const envmapi_nest *n = (const envmapi_nest *)context;
    for (int first = 0; first < n->images; first += 16)
        for (int x = 0; 2 * x < envmapi_width(n->mapping, n->edge); ++x)
            envmapi_nest_texel(n, first, n->images - first < 16 ? n->images - first : 16, x, y);
}

/* ---- cleaning ---- */

/* One number; tells in energy what the limit takes of it, and whether it was fit to filter. */
static int envmapi_clean_number(float *number, double limit, envmap_cleaned *out, double energy[2],
                                double w) {
    double value = (double)*number, kept = value > 0 ? fmin(value, limit) : 0;
    int finite = envmapi_finite(value), infinite = !finite && envmapi_finite(1 / value);
    if (infinite && value > 0) kept = limit;
    out->infinite += infinite, out->nan += !finite && !infinite;
    out->negative += finite && value < 0, out->limited += finite && value > limit;
    if (finite && value > 0) energy[0] += w * value, energy[1] += w * (value - kept);
    *number = (float)kept;
    return finite && !(value < 0);
}

/* Its order is that of numbers from 0 on; those below, and NaN, come behind all. */
static uint32_t envmapi_order(float number) {
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

/* Whether one of them comes behind last. */
static int envmapi_behind(const float *floats, size_t count, uint32_t last) {
    uint32_t behind = 0;
    for (size_t i = 0; i < count; ++i) behind |= envmapi_order(floats[i]) > last;
    return behind > 0;
}

ENVMAPI_BODY envmap_result envmap_clean(envmap *map, float limit, envmap_cleaned *cleaned) {
    envmap_cleaned out;
    double energy[2] = {0, 0}, solid = 0, replaced = 0, each = 0;
    float most = limit;
    if (!envmapi_valid(map) || !envmapi_finite((double)limit) || limit < 0)
        return ENVMAP_ERROR_ARGUMENT;
    int w = envmapi_width(map->mapping, map->size), h = map->size;
    size_t area = envmapi_area(map->mapping, h);
    size_t count = area * (size_t)(envmap_faces(map->mapping) * map->slices);
    memset(&out, 0, sizeof out);
    if (!envmapi_behind(map->texels, 3 * count, limit > 0 ? envmapi_order(limit) : 0x7F7FFFFFu)) {
        if (cleaned) *cleaned = out; /* as most maps are */
        return ENVMAP_OK;
    }
    for (size_t i = 0; i < 3 * count && !(limit > 0); ++i) {
        uint32_t order = envmapi_order(map->texels[i]);
        if (order < 0x7F800000u && order > envmapi_order(most)) most = map->texels[i];
    }
    for (int t = 0; t < ((w + 1) / 2) * ((h + 1) / 2); ++t) {
        int x = t % ((w + 1) / 2), y = t / ((w + 1) / 2);
        if (!x || map->mapping != ENVMAP_LATLONG) /* of its images, too */
            each = envmapi_texel_cell(NULL, map->mapping, h, x, y);
        for (int turn = 0; turn < 4; ++turn) {
            int column = turn & 1 ? w - 1 - x : x, row = turn & 2 ? h - 1 - y : y;
            if ((turn & 1 && column == x) || (turn & 2 && row == y)) continue;
            for (size_t i = (size_t)row * (size_t)w + (size_t)column; i < count; i += area) {
                float *rgb = map->texels + 3 * i;
                uint32_t last = envmapi_order(most);
                int fit = 1;
                solid += each;
                if (envmapi_order(rgb[0]) <= last && envmapi_order(rgb[1]) <= last &&
                    envmapi_order(rgb[2]) <= last) {
                    energy[0] += each * ((double)rgb[0] + (double)rgb[1] + (double)rgb[2]);
                    continue;
                }
                for (int c = 0; c < 3; ++c)
                    fit &= envmapi_clean_number(rgb + c, (double)most, &out, energy, each);
                replaced += fit ? 0 : each;
            }
        }
    }
    out.energy = energy[0] > 0 ? energy[1] / energy[0] : 0, out.replaced = replaced / solid;
    if (cleaned) *cleaned = out;
    return ENVMAP_OK;
}

/* -------------------------------------------------------------------------------- >>resample --
   In: a map src. Out: dst, the same radiance in another mapping or size. With A_ij the solid angle
   that texel i of src and texel j of dst have in common,
       L_j = sum_i A_ij L_i / sum_i A_ij          sum_i A_ij = w_j     sum_j A_ij = w_i
   so constants stay, and so does the energy of each texel, to second order.
     one mapping, fewer texels     rectangles                               envmapi_task_nest
     dst finer by a quarter        bilinear radiance at points of dst       envmapi_orbit_points
     src a cube, lat-long or
     octahedral map                texels X of dst, polygons on cells Y     envmapi_orbit_cover
     dst a cube or a lat-long      texels X of src, polygons on cells Y     envmapi_task_light
     else                          by way of a finer cube                   envmapi_resample_slice
   A polygon's sides are straight on a face of Y, and its neighbours have the same sides, so that
   polygons cover each cell once, whatever the sides' true shape is. Rows of a lat-long are as high
   there as their solid angle. Near its poles, and where a rim cuts them, sides are divided; on an
   octahedral map a polygon is cut at the folds. Turns
   that both maps have in common (16 of a cube and a lat-long) serve one polygon to as many texels,
   an orbit. What a polygon has of a cell is as dense as in the middle of what their bounds share;
   a cube's face has 128 cells at least.
   Source: [Jones99], first order.
   Tests: tests/test_maps.c; resampling_* . */

/* ---- bilinear radiance */

/* Texels of X are polygons on the cells of Y. */
typedef struct envmapi_resampling {
    envmap dst, src, X, Y; /* one slice each; Y: src, or dst where it is to be scattered to */
    int points;            /* dst is finer: bilinear radiance at points of X */
    int parts;             /* a texel of a small map is parts x parts polygons */
    double *cosines;       /* of the edges of Y's rows where it is a lat-long */
    double *light;         /* scattered: RGB and solid angle of texels of dst, of even tasks and of
                              odd ones; NULL: gathered */
    int turn_count;        /* at most 16 */
    envmapi_images (*images)[6]; /* on faces of X and of Y */
} envmapi_resampling;

/* A texel of dst: src at its centre, or the mean of n x n points, those inside a rim. */
static void envmapi_resample_lookup(const envmapi_resampling *r, size_t texel, int n) {
    int mapping = r->dst.mapping, size = r->dst.size, w = envmapi_width(mapping, size);
    int row = (int)(texel / (size_t)w), x = (int)(texel % (size_t)w);
    double d[3], uv[2] = {0, 0}, rgb[3] = {0, 0, 0}, all = 0;
    envmapi_level level = envmapi_level_of(&r->src, 0, 0);
    for (int i = 0; i <= n * n; ++i) { /* the last one, where all others lie outside */
        double u = (x + (i % n + 0.5) / n) / w, v = (row % size + (i / n + 0.5) / n) / size;
        double rho = i < n * n ? envmapi_density(mapping, u, v) : 1;
        int outside = envmapi_is_disc(mapping) && hypot(2 * u - 1, 2 * v - 1) > 1;
        if (i < n * n ? outside : all > 0) continue;
        if (i == n * n) envmapi_texel_cell(uv, mapping, size, x, row % size);
        envmapi_direction(d, mapping, row / size, i < n * n ? u : uv[0], i < n * n ? v : uv[1]);
        envmapi_add_lookup(rgb, &level, d, rho), all += rho;
    }
    for (size_t c = 0; c < 3; ++c) r->dst.texels[3 * texel + c] = (float)(rgb[c] / all);
}

/* ---- how much of cells a polygon covers */

#define ENVMAPI_BOX     10
#define ENVMAPI_CORNERS 52 /* sides of 11 pieces, and arcs of a rim */

/* A polygon, its corners in cells; some cells, and the area of it left of each. */
typedef struct envmapi_polygon {
    double at[ENVMAPI_CORNERS + 3][2], area[ENVMAPI_BOX][ENVMAPI_BOX + 2];
    double low[2], high[2]; /* bounds, in cells of the box */
    int count, face, x, y, width, height;
} envmapi_polygon;

/* The middle of what the polygon's bounds and cell i have in common. */
static double envmapi_box_middle(const envmapi_polygon *p, int axis, double i) {
    double low = p->low[axis], high = p->high[axis];
    return 0.5 * ((low > i ? low : i) + (high < i + 1 ? high : i + 1));
}

/* Adds four sides from the first on, side by side: left of x in a row lies the integral of
   min(x', x) dy, over a side's part there (m + n) (n - m) dy / 2 dx, m and n: min(x' - x, 0) at its
   ends. count is the polygon's, which a compiler knows where it is 4. */
ENVMAPI_INLINE void envmapi_box_sides(envmapi_polygon *p, double fine, int first, int count) {
    double x0[4], y0[4], y1[4], slope[4];
    for (int i = 0; i < 4; ++i) { /* behind the last: none, from its end to its end */
        int from = first + i < count ? first + i : 0, to = from + 1 < count ? from + 1 : 0;
        const double *a = p->at[from], *b = p->at[first + i < count ? to : from];
        x0[i] = a[0] * fine - p->x, y0[i] = a[1] * fine - p->y, y1[i] = b[1] * fine - p->y;
        double dx = (b[0] - a[0]) * fine, dy = y1[i] - y0[i];
        slope[i] = fabs(dy) > 1e-9 ? dx / dy : 0;
    }
    for (int y = 0; y < p->height; ++y) {
        double from[4], to[4], part[4], *row = p->area[y], top = y, end = y + 1;
        for (int i = 0; i < 4; ++i) {
            double a = y0[i] < top ? top : y0[i], b = y1[i] < top ? top : y1[i];
            a = a > end ? end : a, b = b > end ? end : b;
            from[i] = x0[i] + slope[i] * (a - y0[i]), to[i] = x0[i] + slope[i] * (b - y0[i]);
            double d = to[i] - from[i], steep = fabs(d) < 1e-7 ? 1e-7 : 0;
            to[i] += steep, part[i] = 0.5 * (a - b) / (d + steep);
        }
        for (int x = 0; x <= p->width; x += 4, row += 4) {
            double sums[4] = {0, 0, 0, 0};
            for (int i = 0; i < 4; ++i)
                for (int k = 0; k < 4; ++k) {
                    double m = from[i] - (x + k), n = to[i] - (x + k);
                    m = m < 0 ? m : 0, n = n < 0 ? n : 0;
                    sums[k] += part[i] * ((m + n) * (n - m));
                }
            for (int k = 0; k < 4 && first; ++k) sums[k] += row[k];
            memcpy(row, sums, sizeof sums);
        }
    }
}

/* On a lat-long of n rows corners follow one another without a jump at the seam. Where the polygon
   holds a pole, or has a corner there, it is closed along the edge of the first or last row. */
static void envmapi_polygon_unroll(envmapi_polygon *p, int n) {
    double at[ENVMAPI_CORNERS][2], width = 2 * n, edge = p->at[0][1] < 0.5 * n ? 0 : n, end;
    int corner = -1, count = p->count;
    memcpy(at, p->at, (size_t)count * sizeof at[0]);
    for (int i = 0; i < count; ++i)
        if (at[i][1] < 1e-12 || at[i][1] > n - 1e-12) corner = i;
    if (corner >= 0) p->count = --count;
    for (int i = 0; i < count; ++i) {
        memcpy(p->at[i], at[(corner + 1 + i) % (count + (corner >= 0))], sizeof at[0]);
        if (i) p->at[i][0] += width * floor((p->at[i - 1][0] - p->at[i][0]) / width + 0.5);
    }
    double start = p->at[0][0], last = p->at[count - 1][0];
    end = corner >= 0 ? last : start + width * floor((last - start) / width + 0.5);
    if (corner < 0 && !(fabs(end - start) > 0)) return;
    double more[3][2] = {{end, corner < 0 ? p->at[0][1] : edge}, {end, edge}, {start, edge}};
    memcpy(p->at[count], more, sizeof more), p->count += 3;
}

/* ---- a texel of X and its images */

typedef struct envmapi_orbit {
    int face, x, y, count;
    int texel[16], turn[16]; /* images, each once, and a turn that leads there */
    double sums[16][4], all; /* RGB, gathered or to be scattered; solid angle */
    double *light, scale;    /* scattered to, and of what; 0: nothing yet */
    double w[ENVMAPI_BOX * ENVMAPI_BOX];
    int low[2], columns, rows; /* the cells of Y that count w */
    int points;                /* a side, where it is looked up */
    envmapi_polygon polygon;
} envmapi_orbit;

#define ENVMAPI_SQUARE 8

/* Whether of no texel of a square an image comes before it (1), of each (-1), or what else (0): the
   difference of their numbers is linear in x and y, but for seams. */
static int envmapi_orbit_first(const envmapi_resampling *r, int face, int x, int y) {
    const envmapi_images *s = r->images[0] + face;
    int first = 1, seam = r->X.mapping == ENVMAP_LATLONG ? 2 * r->X.size : 0;
    for (int i = 1; i < r->turn_count && first >= 0; ++i) {
        int dx = s->right[i] - s->right[0], dy = s->down[i] - s->down[0], n = ENVMAPI_SQUARE - 1;
        int least = s->first[i] - s->first[0] + x * dx + y * dy, most = least + seam;
        most += (dx > 0 ? n * dx : 0) + (dy > 0 ? n * dy : 0);
        least += (dx < 0 ? n * dx : 0) + (dy < 0 ? n * dy : 0) - seam;
        first = most < 0 ? -1 : least > 0 ? first : 0;
    }
    return first;
}

/* 0: another texel of the orbit comes first. first: that is known not to be. */
static int envmapi_orbit_of(envmapi_orbit *o, const envmapi_resampling *r, int first) {
    int kept = 0, late = 0, at[16]; /* kept: by how many turns; by one only, no image comes twice */
    envmapi_images_at(at, r->images[0] + o->face, &r->X, o->x, o->y);
    for (int i = 0; i < 16 && !first; ++i) late |= at[i] < at[0], kept += at[i] == at[0];
    if (late) return 0;
    o->all = 0, o->scale = o->points = 1, o->count = kept > 1 ? 0 : r->turn_count;
    for (int i = 0; i < 16; ++i) o->texel[i] = at[i], o->turn[i] = i;
    for (int i = 0, k; i < r->turn_count && kept > 1; ++i) {
        for (k = 0; k < o->count && o->texel[k] != at[i];) ++k;
        if (k == o->count) o->texel[k] = at[i], o->turn[k] = i, ++o->count;
    }
    memset(o->sums, 0, sizeof o->sums);
    for (int k = 0; k < o->count && (r->light || o->x % 4 == 0); ++k) { /* and the next row's */
        const float *texel = r->X.texels + 3 * (size_t)o->texel[k];
        ENVMAPI_PREFETCH(texel + 3 * (ptrdiff_t)r->images[0][o->face].down[o->turn[k]]);
        for (int c = 0; c < 4 && r->light; ++c) o->sums[k][c] = c < 3 ? (double)texel[c] : 1;
    }
    return 1;
}

/* Some columns of the cells, at all images: sums += w RGB, or with no floats light += w sums.
   From 4 floats a texel the one behind it comes along, which must exist. */
ENVMAPI_INLINE void envmapi_orbit_add(envmapi_orbit *o, const envmapi_images *s,
                                      const float *texels, const int at[16], int from, int columns,
                                      int rows, int floats) {
    ptrdiff_t size = floats ? 3 : 4;
    for (int k = 0; k < o->count; ++k) {
        ptrdiff_t right = size * s->right[o->turn[k]], down = size * s->down[o->turn[k]];
        ptrdiff_t row = size * at[o->turn[k]];
        const double *w = o->w + from;
        envmapi_double4 sum;
        memset(&sum, 0, sizeof sum);
        if (!floats) envmapi_double4_add(&sum, o->scale, envmapi_double4_at(o->sums[k]));
        for (int y = 0; y < rows; ++y, row += down, w += ENVMAPI_BOX) {
            ptrdiff_t i = row;
            for (int x = 0; x < columns; ++x, i += right) {
                double four[4] = {0, 0, 0, 0};
                for (int c = 0; c < floats; ++c) four[c] = (double)texels[i + c];
                if (floats) envmapi_double4_add(&sum, w[x], envmapi_double4_at(four));
                else envmapi_double4_add(envmapi_double4_at(o->light + i), w[x], &sum);
            }
        }
        if (floats) envmapi_double4_add(envmapi_double4_at(o->sums[k]), 1, &sum);
    }
}

/* The cells of a face and their images: at once, or column by column where an image may lie across
   a lat-long's seam, as it does if the cells lie across a quarter of the turn. */
static void envmapi_orbit_flush(envmapi_orbit *o, const envmapi_resampling *r, int face) {
    const envmapi_images *s = r->images[1] + face;
    const float *texels = r->src.texels;
    int w = envmapi_width(r->Y.mapping, r->Y.size), quarter = w % 4 ? w / 2 : w / 4;
    int x = (o->low[0] + 4 * w) % w, step = o->columns, rows = o->rows, at[16];
    int edge = o->low[1] < 1 || o->low[1] + o->rows >= r->Y.size;
    if (r->Y.mapping == ENVMAP_LATLONG && x / quarter != (x + step - 1) / quarter) step = 1;
    for (int from = 0; from < o->columns && o->scale > 0; from += step) {
        envmapi_images_at(at, s, &r->Y, (x + from) % w, o->low[1]);
        if (r->light) envmapi_orbit_add(o, s, NULL, at, from, step, rows, 0);
        else if (edge) envmapi_orbit_add(o, s, texels, at, from, step, rows, 3);
        else if (step == 2 && rows == 2) envmapi_orbit_add(o, s, texels, at, from, 2, 2, 4);
        else if (step == 2 && rows == 3) envmapi_orbit_add(o, s, texels, at, from, 2, 3, 4);
        else if (step == 3 && rows == 2) envmapi_orbit_add(o, s, texels, at, from, 3, 2, 4);
        else if (step == 3 && rows == 3) envmapi_orbit_add(o, s, texels, at, from, 3, 3, 4);
        else envmapi_orbit_add(o, s, texels, at, from, step, rows, 4);
    }
}

/* A box's cells, 2^shift x 2^shift of it each. */
static void envmapi_orbit_box(envmapi_orbit *o, const envmapi_resampling *r, int shift,
                              double sign) {
    const envmapi_polygon *box = &o->polygon;
    int latlong = r->Y.mapping == ENVMAP_LATLONG;
    double each = 1.0 / (r->Y.size << shift);
    o->low[0] = box->x >> shift, o->low[1] = box->y >> shift;
    o->columns = box->width >> shift, o->rows = box->height >> shift;
    memset(o->w, 0, (size_t)(o->rows * ENVMAPI_BOX) * sizeof(double));
    for (int y = 0; y < box->height; ++y) {
        double *w = o->w + (y >> shift) * ENVMAPI_BOX;
        const double *edge = r->cosines + (latlong ? box->y + y : 0);
        for (int x = 0; x < box->width; ++x) {
            double sum = sign * (box->area[y][x + 1] - box->area[y][x]);
            if (!(sum > 1e-12)) continue;
            double u = envmapi_box_middle(box, 0, box->x + x) * each;
            double v = envmapi_box_middle(box, 1, box->y + y) * each;
            double rho = latlong ? (edge[0] - edge[1]) * ENVMAPI_PI
                                 : envmapi_density(r->Y.mapping, u, v) * each;
            w[x >> shift] += sum * rho * each, o->all += sum * rho * each;
        }
    }
    envmapi_orbit_flush(o, r, box->face);
}

/* The polygon, box by box. Cells of a small cube are divided: they are not dense evenly. */
static void envmapi_orbit_cover(envmapi_orbit *o, const envmapi_resampling *r) {
    envmapi_polygon *p = &o->polygon;
    int n = r->Y.size, from[2], to[2], shift = 0, latlong = r->Y.mapping == ENVMAP_LATLONG;
    double area = 0, low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (int i = 0; i < p->count; ++i) {
        const double *a = p->at[i], *b = p->at[i + 1 < p->count ? i + 1 : 0];
        area += a[1] * b[0] - a[0] * b[1];
        for (int k = 0; k < 2; ++k)
            low[k] = a[k] < low[k] ? a[k] : low[k], high[k] = a[k] > high[k] ? a[k] : high[k];
    }
    for (int k = 0; k < 2; ++k) {
        int wraps = !k && latlong;
        from[k] = (int)floor(wraps || low[k] > 0 ? low[k] : 0);
        to[k] = (int)ceil(wraps || high[k] < n ? high[k] : n);
    }
    while (!latlong && n << shift < 128 && shift < 3) ++shift;
    int step = ENVMAPI_BOX >> shift;
    for (int k = 0; k < 2; ++k)
        p->low[k] = low[k] * (1 << shift), p->high[k] = high[k] * (1 << shift);
    for (int y = from[1]; y < to[1]; y += step)
        for (int x = from[0]; x < to[0]; x += step) {
            p->x = x * (1 << shift), p->width = (to[0] - x < step ? to[0] - x : step) << shift;
            p->y = y << shift, p->height = (to[1] - y < step ? to[1] - y : step) << shift;
            if (p->count == 4) envmapi_box_sides(p, 1 << shift, 0, 4);
            else
                for (int i = 0; i < p->count; i += 4) envmapi_box_sides(p, 1 << shift, i, p->count);
            envmapi_orbit_box(o, r, shift, area > 0 ? 1 : -1);
        }
}

/* ---- texels as polygons */

/* A corner of X's texels, and where it is on Y. */
typedef struct envmapi_corner {
    double at[2];
    float d[3];    /* for signs and distances */
    int face, rim; /* rim: see _at_rim */
} envmapi_corner;

/* Where a direction is on a face of Y and beyond its edges, in cells; 0: too far beyond. Rows of a
   lat-long are as high as their solid angle. */
static int envmapi_place_on(double at[2], const envmapi_resampling *r, int face,
                            const double d[3]) {
    int n = r->Y.size;
    if (r->Y.mapping == ENVMAP_CUBE) {
        const double *m = envmapi_cube[face][2];
        if (m[0] * d[0] + m[1] * d[1] + m[2] * d[2] < 0.1) return 0;
    }
    if (r->Y.mapping == ENVMAP_LATLONG) { /* an arc cosine to 7e-5, then the table */
        double y = fabs(d[1]), root = y < 1 ? sqrt(1 - y) : 0;
        double angle = root * (1.5707288 - y * (0.2121144 - y * (0.074261 - y * 0.0187293)));
        int row = (int)(n * (d[1] < 0 ? 1 - angle / ENVMAPI_PI : angle / ENVMAPI_PI));
        row = row < n - 1 ? row : n - 1;
        while (row > 0 && d[1] > r->cosines[row]) --row;
        while (row < n - 1 && d[1] < r->cosines[row + 1]) ++row;
        const double *edge = r->cosines + row;
        at[0] = d[0] * d[0] + d[2] * d[2] > 0 ? n + n / ENVMAPI_PI * atan2(d[0], -d[2]) : n;
        at[1] = row + envmapi_clamp((edge[0] - d[1]) / (edge[0] - edge[1]), 0, 1);
        return 1;
    }
    envmapi_project(at, r->Y.mapping, face, d);
    at[0] *= n, at[1] *= n;
    return 1;
}

/* 2: (x,y) in [-1,1]^2 is beyond the rim of X; 1: it is no more than 4 texels before it. */
static int envmapi_at_rim(const envmapi_resampling *r, double x, double y) {
    if (!envmapi_is_disc(r->X.mapping)) return 0;
    double out = x * x + y * y, most = fmax(1 - 8.0 / r->X.size, 0);
    return out > 1 ? 2 : out > most * most;
}

/* The corner at (x,y) in [-1,1]^2 of a face of X. */
static void envmapi_corner_of(envmapi_corner *c, const envmapi_resampling *r, int face, double x,
                              double y) {
    double d[3];
    envmapi_direction(d, r->X.mapping, face, 0.5 + 0.5 * x, 0.5 + 0.5 * y);
    c->face = envmapi_face(r->Y.mapping, d);
    envmapi_place_on(c->at, r, c->face, d);
    for (int k = 0; k < 3; ++k) c->d[k] = (float)d[k];
    c->rim = envmapi_at_rim(r, x, y);
}

/* Of how many pieces a texel's sides have to be: they are bent near Y's poles, -z of a sphere map
   and +z of an angular map. */
static int envmapi_texel_parts(const envmapi_resampling *r, const envmapi_corner *const c[4]) {
    double flat = 1e18, side = 0, parts = r->parts;
    int latlong = r->Y.mapping == ENVMAP_LATLONG, sphere = r->Y.mapping == ENVMAP_SPHERE;
    int disc = sphere || r->Y.mapping == ENVMAP_ANGULAR;
    for (int i = 0; i < 4; ++i) {
        const float *a = c[i]->d, *b = c[(i + 1) & 3]->d;
        float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
        float across = latlong ? a[2] : a[1], ahead = sphere ? a[2] : -a[2];
        double square = (double)(x * x + y * y + z * z);
        double from_pole = 1e-18 + (double)(a[0] * a[0] + across * across);
        if (disc && ahead > 0) from_pole += (double)(ahead * ahead);
        side = square > side ? square : side, flat = from_pole < flat ? from_pole : flat;
    }
    side *= disc || latlong ? 121 / flat : 0; /* 11 parts a radian at a distance of 1 */
    return (int)(side <= parts * parts ? parts : side < 121 ? ceil(sqrt(side)) : 11);
}

#define ENVMAPI_CHORDS 4

/* Corners of a quadrangle of X, of the part inside a rim, its sides and the rim's arc in pieces. */
static int envmapi_part_corners(double (*d)[3], const envmapi_resampling *r, int face,
                                double q[4][2], int pieces) {
    int count = 0, first = 0, m = r->X.mapping, arc = m == ENVMAP_PARABOLOID ? ENVMAPI_CHORDS : 1;
    double last[2] = {0, 0};
    while (first < 3 && envmapi_at_rim(r, q[first][0], q[first][1]) > 1) ++first;
    for (int k = first; k < first + 4; ++k) {
        const double *a = q[k & 3], *b = q[(k + 1) & 3];
        int from = envmapi_at_rim(r, a[0], a[1]), to = envmapi_at_rim(r, b[0], b[1]);
        double side[2] = {b[0] - a[0], b[1] - a[1]}, t[2] = {0, 1};
        double aa = a[0] * a[0] + a[1] * a[1] - 1, ad = a[0] * side[0] + a[1] * side[1];
        double dd = side[0] * side[0] + side[1] * side[1];
        double root = sqrt(fmax(ad * ad - aa * dd, 0));
        if (from > 1 && to > 1) continue;
        if (from > 1) t[0] = (-root - ad) / dd;
        if (to > 1) t[1] = (root - ad) / dd;
        int n = (from || to) && pieces < ENVMAPI_CHORDS ? ENVMAPI_CHORDS : pieces;
        for (int i = from > 1 ? 1 - arc : 0; i < n + (to > 1); ++i) {
            double s = t[0] + (t[1] - t[0]) * (i > 0 ? i : 0) / n;
            double x = a[0] + s * side[0], y = a[1] + s * side[1];
            double share = (double)(i + arc) / arc, length = 1;
            if (i < 0) x = last[0] + share * (x - last[0]), y = last[1] + share * (y - last[1]);
            if (i < 0) length = sqrt(x * x + y * y);
            else last[0] = x, last[1] = y;
            envmapi_direction(d[count++], m, face, 0.5 + 0.5 * x / length, 0.5 + 0.5 * y / length);
        }
    }
    return count;
}

/* What of a polygon lies in one of the octahedron's faces, octant. */
static int envmapi_part_clip(double (*out)[3], double (*d)[3], int count, int octant) {
    double from[ENVMAPI_CORNERS + 3][3];
    for (int k = 0; k < 3 && count; ++k) {
        double sign = octant >> k & 1 ? -1 : 1;
        memcpy(from, k ? out : d, (size_t)count * sizeof from[0]);
        int last = count - 1, n = count;
        count = 0;
        for (int i = 0; i < n; last = i++) {
            double a = sign * from[last][k], b = sign * from[i][k], t = a / (a - b);
            if (a * b < 0) {
                for (int c = 0; c < 3; ++c)
                    out[count][c] = from[last][c] + t * (from[i][c] - from[last][c]);
                out[count++][k] = 0;
            }
            if (b >= 0) memcpy(out[count++], from[i], sizeof from[i]);
        }
        for (int i = 0; i < count; ++i) out[i][k] = sign * fmax(sign * out[i][k], 1e-300);
    }
    return count;
}

/* A texel, of n x n quadrangles, on each face of Y that they touch. */
static void envmapi_orbit_parts(envmapi_orbit *o, const envmapi_resampling *r, int pieces) {
    int n = r->parts, octa = r->Y.mapping == ENVMAP_OCTAHEDRAL;
    double w = n * envmapi_width(r->X.mapping, r->X.size), h = n * r->X.size, q[4][2];
    double d[ENVMAPI_CORNERS][3], part[ENVMAPI_CORNERS + 3][3];
    envmapi_polygon *p = &o->polygon;
    for (int i = 0; i < n * n; ++i) {
        for (int k = 0; k < 4; ++k) {
            q[k][0] = 2 * (o->x * n + i % n + (k == 1 || k == 2)) / w - 1;
            q[k][1] = 2 * (o->y * n + i / n + (k > 1)) / h - 1;
        }
        int count = envmapi_part_corners(d, r, o->face, q, pieces);
        for (int face = 0; face < (octa ? 8 : envmap_faces(r->Y.mapping)) && count > 2; ++face) {
            p->face = octa ? 0 : face, p->count = count;
            if (octa) p->count = envmapi_part_clip(part, d, count, face);
            int ok = p->count > 2;
            for (int k = 0; k < p->count && ok; ++k)
                ok = envmapi_place_on(p->at[k], r, face, octa ? part[k] : d[k]);
            if (ok && r->Y.mapping == ENVMAP_LATLONG) envmapi_polygon_unroll(p, r->Y.size);
            if (ok) envmapi_orbit_cover(o, r);
        }
    }
}

/* Whether a point of Y is `by` cells away from the edges of its face, its folds and its rim. */
static int envmapi_inside(const envmap *Y, const double at[2], double by) {
    double n = Y->size, x = fabs(2 * at[0] - n), y = fabs(2 * at[1] - n), most = n - 2 * by;
    if (Y->mapping == ENVMAP_LATLONG) return y <= most;
    if (envmapi_is_disc(Y->mapping)) return hypot(x, y) <= most;
    return fmax(x, y) <= most &&
           (Y->mapping == ENVMAP_CUBE || (fmin(x, y) >= 2 * by && fabs(n - x - y) >= 4 * by));
}

#define ENVMAPI_POINTS (ENVMAPI_BOX - 2)

/* Bilinear radiance at points of the texel, at least 3 along a side and one for each cell that it
   crosses, or at its centre if it is small; 0: it is too long. Looked up where it is not inside. */
static int envmapi_orbit_points(envmapi_orbit *o, const envmapi_resampling *r, int inside) {
    double side[2][2], twist[2], longest[2] = {0, 0}, (*p)[2] = o->polygon.at;
    int n[2], *low = o->low, high[2];
    o->points = ENVMAPI_POINTS;
    for (int k = 0; k < 2; ++k) {
        double a = p[0][k], b = p[1][k], c = p[2][k], d = p[3][k];
        double least = a < b ? a : b, most = a > b ? a : b;
        side[0][k] = b - a, side[1][k] = d - a, twist[k] = a + c - b - d;
        least = c < least ? c : least, most = c > most ? c : most;
        low[k] = (int)floor((d < least ? d : least) - 0.5);
        high[k] = (int)floor((d > most ? d : most) + 0.5);
        if (high[k] - low[k] >= ENVMAPI_BOX) return 0;
        for (int i = 0; i < 2; ++i) {
            double one = fabs(side[i][k]), other = fabs(side[i][k] + twist[k]);
            one = one > other ? one : other, longest[i] = one > longest[i] ? one : longest[i];
        }
    }
    double longer = longest[longest[1] > longest[0]];
    double few = longer > 0.34 ? 3 : 1; /* at 0.5 a sun's light is 4e-3 off */
    for (int i = 0; i < 2; ++i) n[i] = (int)ceil(longest[i] > few ? longest[i] : few);
    o->points = n[0] > n[1] ? n[0] : n[1];
    if (!inside) return 1;
    o->columns = high[0] - low[0] + 1, o->rows = high[1] - low[1] + 1, o->all = 1;
    double part[2] = {1.0 / n[0], 1.0 / n[1]};
    memset(o->w, 0, (size_t)(o->rows * ENVMAPI_BOX) * sizeof(double));
    for (int i = 0; i < n[1]; ++i) {
        double t = (i + 0.5) * part[1], each = part[0] * part[1], at[2], step[2];
        for (int k = 0; k < 2; ++k) {
            step[k] = (side[0][k] + t * twist[k]) * part[0];
            at[k] = p[0][k] + t * side[1][k] + 0.5 * step[k] - 0.5 - low[k];
        }
        for (int j = 0; j < n[0]; ++j) {
            double x = at[0] + j * step[0], y = at[1] + j * step[1];
            double *to = o->w + (int)y * ENVMAPI_BOX + (int)x, *below = to + ENVMAPI_BOX;
            x -= (int)x, y = each * (y - (int)y);
            below[0] += y - x * y, below[1] += x * y, y = each - y;
            to[0] += y - x * y, to[1] += x * y;
        }
    }
    envmapi_orbit_flush(o, r, o->polygon.face);
    return 1;
}

static void envmapi_orbit_texel(envmapi_orbit *o, const envmapi_resampling *r,
                                const envmapi_corner *const c[4]) {
    envmapi_polygon *p = &o->polygon;
    int parts = envmapi_texel_parts(r, c), pieces = (parts + r->parts - 1) / r->parts;
    int whole = 1, octa = r->Y.mapping == ENVMAP_OCTAHEDRAL;
    double turn = 2 * r->Y.size;
    p->face = c[0]->face, p->count = 4;
    for (int i = 0; i < 4; ++i) {
        whole &= c[i]->face == p->face;
        whole &= !r->points || (c[i]->rim < 2 && envmapi_inside(&r->Y, c[i]->at, 1.75));
        for (int k = 0; k < 3 && octa; ++k) whole &= c[i]->d[k] * c[0]->d[k] > 0;
        memcpy(p->at[i], c[i]->at, sizeof c[i]->at);
        if (r->Y.mapping == ENVMAP_LATLONG)
            p->at[i][0] += turn * floor((p->at[0][0] - p->at[i][0]) / turn + 0.5);
    }
    if (r->points && envmapi_orbit_points(o, r, whole && parts <= 2)) return;
    int looked_up = octa || r->Y.mapping == ENVMAP_PARABOLOID;
    if (r->points && (looked_up || (envmapi_is_disc(r->Y.mapping) && parts > 4))) return;
    int rim = c[0]->rim | c[1]->rim | c[2]->rim | c[3]->rim;
    if (whole && parts == 1 && !rim) {
        envmapi_orbit_cover(o, r);
        return;
    }
    if (r->light && rim > 1) { /* as much as its solid angle, however its sides are bent */
        o->scale = 0, envmapi_orbit_parts(o, r, pieces);
        if (!(o->all > 0)) return;
        o->scale = envmapi_texel_cell(NULL, r->X.mapping, r->X.size, o->x, o->y) / o->all;
    }
    envmapi_orbit_parts(o, r, pieces);
}

/* Whether a texel's innermost corner lies outside a rim. */
static int envmapi_beyond(const envmap *map, int x, int y) {
    double n = map->size;
    double X = fmax(fabs(2 * x + 1 - n) - 1, 0), Y = fmax(fabs(2 * y + 1 - n) - 1, 0);
    return envmapi_is_disc(map->mapping) && X * X + Y * Y >= n * n;
}

/* Texel i of dst: sums to scale, or looked up where there are none. */
static void envmapi_resample_write(const envmapi_resampling *r, size_t i, const double *sums,
                                   double scale, int points) {
    for (size_t c = 0; c < 3 && scale > 0; ++c) r->dst.texels[3 * i + c] = (float)(sums[c] * scale);
    if (!(scale > 0)) envmapi_resample_lookup(r, i, points);
}

/* Task: a row of what was scattered. */
static void envmapi_task_light(void *context, int row) {
    const envmapi_resampling *r = (const envmapi_resampling *)context;
    size_t texels = envmapi_slice_floats(&r->dst, 0) / 3;
    size_t width = (size_t)envmapi_width(r->dst.mapping, r->dst.size), i = (size_t)row * width;
    for (size_t end = i + width; i < end; ++i) {
        double *light = r->light + 4 * i;
        envmapi_double4_add(envmapi_double4_at(light), 1, envmapi_double4_at(light + 4 * texels));
        envmapi_resample_write(r, i, light, light[3] > 0 ? 1 / light[3] : 0, 1);
    }
}

/* Up to 8 x 8 texels of a face of X. */
static void envmapi_orbit_square(envmapi_orbit *o, const envmapi_resampling *r, int x0, int y0) {
    enum { n = ENVMAPI_SQUARE, m = n + 1 };
    int w = envmapi_width(r->X.mapping, r->X.size), h = r->X.size, known = 0;
    envmapi_corner c[m * m];
    int first = envmapi_orbit_first(r, o->face, x0, y0);
    if (first < 0) return;
    for (int i = 0; i < n * n; ++i) {
        const envmapi_corner *at = c + i / n * m + i % n;
        const envmapi_corner *const corners[4] = {at, at + 1, at + m + 1, at + m};
        o->x = x0 + i % n, o->y = y0 + i / n;
        if (o->x >= w || o->y >= h || !envmapi_orbit_of(o, r, first)) continue;
        for (int k = 0; k < m * m && !known; ++k)
            envmapi_corner_of(c + k, r, o->face, 2.0 * (x0 + k % m) / w - 1,
                              2.0 * (y0 + k / m) / h - 1);
        known = 1;
        int beyond = envmapi_beyond(&r->X, o->x, o->y), alike = r->X.mapping != ENVMAP_PARABOLOID;
        if (!beyond) envmapi_orbit_texel(o, r, corners);
        double scale = o->all > 0 ? 1 / o->all : 0;
        float *like = r->dst.texels + 3 * (size_t)o->texel[0];
        for (int k = 0; k < o->count && !r->light; ++k)
            if (k && beyond && alike) memcpy(r->dst.texels + 3 * (size_t)o->texel[k], like, 12);
            else envmapi_resample_write(r, (size_t)o->texel[k], o->sums[k], scale, o->points);
    }
}

/* Task: 8 rows of a face of X. */
static void envmapi_task_overlap(void *context, int band) {
    const envmapi_resampling *r = (const envmapi_resampling *)context;
    int n = ENVMAPI_SQUARE, bands = (r->X.size + n - 1) / n;
    envmapi_orbit o;
    o.face = band / bands, o.light = r->light;
    if (o.light && band % 2) o.light += 4 * (envmapi_slice_floats(&r->dst, 0) / 3);
    for (int x0 = 0; x0 < envmapi_width(r->X.mapping, r->X.size); x0 += n)
        envmapi_orbit_square(&o, r, x0, band % bands * n);
}

/* ---- one slice */

/* Between two mappings, one of them a cube or a lat-long if means are asked for. */
static envmap_result envmapi_resample_overlap(envmapi_resampling *r, const envmap_work *work,
                                              envmapi_pool *pool) {
    size_t texels = envmapi_slice_floats(&r->dst, 0) / 3;
    int gather = r->points || !envmapi_is_disc(r->src.mapping);
    r->X = gather ? r->dst : r->src, r->Y = gather ? r->src : r->dst;
    r->parts = (63 + r->X.size) / r->X.size, r->light = NULL;
    if (r->X.mapping == ENVMAP_OCTAHEDRAL && r->X.size % 2) r->parts += r->parts % 2; /* folds */
    envmapi_turn *turns = (envmapi_turn *)envmapi_pool_get(pool, 49, sizeof(envmapi_turn));
    r->cosines = (double *)envmapi_pool_get(pool, (size_t)r->Y.size + 1, sizeof(double));
    if (!gather) r->light = (double *)envmapi_pool_get(pool, 8 * texels, sizeof(double));
    r->images = (envmapi_images(*)[6])envmapi_pool_get(pool, 2, sizeof r->images[0]);
    if (!turns || !r->images || !r->cosines || (!gather && !r->light)) return ENVMAP_ERROR_MEMORY;
    for (int y = 0; y <= r->Y.size; ++y) r->cosines[y] = cos(ENVMAPI_PI * y / r->Y.size);
    r->turn_count = envmapi_turns(turns, &r->X, &r->Y);
    if (r->turn_count > 16) r->turn_count = 8; /* of two cubes those that keep faces' axes */
    envmapi_images_of(r->images[0], &r->X, turns, r->turn_count, 1);
    envmapi_images_of(r->images[1], &r->Y, turns, r->turn_count, 0);
    int tasks = envmap_faces(r->X.mapping) * ((r->X.size + ENVMAPI_SQUARE - 1) / ENVMAPI_SQUARE);
    if (gather) return envmapi_run(work, envmapi_task_overlap, r, tasks);
    memset(r->light, 0, 8 * texels * sizeof(double));
    for (int i = 0; i < tasks; i += 2) { /* others would share light */
        if (envmapi_tell(&work->progress, (double)i / tasks)) return ENVMAP_CANCELLED;
        envmapi_run_batch(work, envmapi_task_overlap, r, i, tasks - i < 2 ? 1 : 2);
    }
    envmapi_run_all(work, envmapi_task_light, r, envmap_faces(r->dst.mapping) * r->dst.size);
    return ENVMAP_OK;
}

/* Texels of a map, those inside its rim. */
static double envmapi_count(const envmap *map) {
    double texels = (double)envmapi_slice_floats(map, 0) / 3;
    return envmapi_is_disc(map->mapping) ? texels * ENVMAPI_PI / 4 : texels;
}

static envmap_result envmapi_resample_slice(envmapi_resampling *r, const envmap_work *work,
                                            envmapi_pool *pool) {
    envmap dst = r->dst, *src = &r->src;
    int faces = envmap_faces(dst.mapping), n = src->size, same = dst.mapping == src->mapping;
    double n_dst = envmapi_count(&dst), n_src = envmapi_count(src);
    if (same && dst.size == n) {
        envmapi_scan_run(dst.texels, src->texels, envmapi_slice_floats(src, 0), 1, work);
        return envmapi_tell(&work->progress, 1);
    }
    if (same && dst.size <= n) {
        envmapi_nest nest = {src->texels, dst.texels, src->mapping, n, dst.size, faces};
        return envmapi_run(work, envmapi_task_nest, &nest, (dst.size + 1) / 2);
    }
    r->points = n_dst > 1.25 * n_src; /* about as many: means, which keep energy */
    if (r->points || src->mapping == ENVMAP_CUBE || src->mapping == ENVMAP_LATLONG ||
        dst.mapping == ENVMAP_CUBE || dst.mapping == ENVMAP_LATLONG)
        return envmapi_resample_overlap(r, work, pool);
    /* by way of a finer cube */
    envmapi_part first, second;
    envmap_work part = envmapi_work_part(&first, work, 0, 1, 2);
    r->dst.mapping = ENVMAP_CUBE;
    r->dst.size = (int)envmapi_clamp(ceil(sqrt(fmax(n_src, n_dst) / 3)), 1, ENVMAPI_SIZE_LIMIT);
    size_t floats = envmapi_slice_floats(&r->dst, 0);
    r->dst.texels = (float *)envmapi_pool_get(pool, floats, sizeof(float));
    if (!r->dst.texels) return ENVMAP_ERROR_MEMORY;
    envmap_result result = envmapi_resample_overlap(r, &part, pool);
    part = envmapi_work_part(&second, work, 1, 1, 2);
    *src = r->dst, r->dst = dst;
    return result ? result : envmapi_resample_overlap(r, &part, pool);
}

ENVMAPI_BODY envmap_result envmap_resample(envmap *dst, const envmap *src,
                                           const envmap_work *work) {
    envmap_result result = ENVMAP_OK;
    envmapi_resampling r;
    envmapi_pool pool;
    envmapi_part part;
    envmap_work all;
    if (!envmapi_pair_ok(dst, src) || !envmapi_work_of(&all, work)) return ENVMAP_ERROR_ARGUMENT;
    memset(&pool, 0, sizeof pool), pool.memory = all.memory;
    size_t floats = envmapi_slice_floats(dst, 0), slices = (size_t)src->slices;
    if (!envmapi_scan_run(NULL, src->texels, slices * envmapi_slice_floats(src, 0), 1, &all))
        return ENVMAP_ERROR_RADIANCE;
    float *out = dst->texels; /* staged where a part of it could be cancelled or fail */
    if (all.progress.report || slices > 1)
        out = (float *)envmapi_pool_get(&pool, floats * slices, sizeof(float));
    if (!out) result = ENVMAP_ERROR_MEMORY;
    for (int slice = 0, kept = pool.count; slice < src->slices && !result; ++slice) {
        envmap_work one = envmapi_work_part(&part, &all, slice, 1, src->slices);
        memset(&r, 0, sizeof r), envmapi_pool_free(&pool, kept);
        r.src = *src, r.dst = *dst, r.src.levels = r.src.slices = r.dst.slices = 1;
        r.src.texels = envmapi_image(src, 0, slice, 0), r.dst.texels = out + (size_t)slice * floats;
        result = envmapi_resample_slice(&r, &one, &pool);
    }
    if (!result && out != dst->texels) memcpy(dst->texels, out, floats * slices * sizeof(float));
    envmapi_pool_free(&pool, 0);
    if (!result && src->slices == 1) envmapi_copy_slices(dst, 0, dst->slices);
    return result;
}

/* ------------------------------------------------------------------------------------- >>pfm --
   A float picture, in memory or a file, to one level of a map and back.
       picture    "PF" (RGB) or "Pf" (grey), white space, width, height, scale, one white space,
                  then rows of 4-byte floats from the bottom up; scale < 0: lowest byte first
       radiance = |scale| sample         envmapi_pfm_sample
   Upside up, the strip of slices and faces is the memory order itself (envmapi_pfm_shape).
   Numbers are parsed and bytes put together here, so that neither locale nor host matters; sizes
   are checked before anything is allocated (envmapi_pfm_header).
   Called by users alone.  Source: pfm(5) of netpbm.  Tests: tests/test_pfm.c, tests/fuzz_pfm.c. */

/* A picture that is being read, and what its header says. */
typedef struct envmapi_pfm {
    const unsigned char *data;
    size_t bytes, at;
    int width, height, channels, size, slices;
    double scale;
} envmapi_pfm;

/* The next byte, or -1 at the end. */
static int envmapi_peek(const envmapi_pfm *in) {
    return in->at < in->bytes ? in->data[in->at] : -1;
}

static int envmapi_is_space(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/* White space and comments, "#" to the end of the line; at least one byte of them. */
static envmap_result envmapi_pfm_space(envmapi_pfm *in) {
    size_t start = in->at;
    for (int c, comment = 0; (c = envmapi_peek(in)) >= 0; ++in->at) {
        comment = c == '#' || (comment && c != '\n' && c != '\r');
        if (!comment && !envmapi_is_space(c)) break;
    }
    if (envmapi_peek(in) < 0) return ENVMAP_ERROR_TRUNCATED;
    return in->at > start ? ENVMAP_OK : ENVMAP_ERROR_FORMAT;
}

/* Digits go on with the number that *value is, or with its fraction; 0 where there are none. */
static int envmapi_pfm_digits(envmapi_pfm *in, double *value, int fraction) {
    size_t start = in->at;
    double unit = 1;
    for (int c; (c = envmapi_peek(in)) >= '0' && c <= '9'; ++in->at)
        if (fraction) unit /= 10, *value += unit * (c - '0');
        else *value = 10 * *value + (c - '0');
    return in->at > start;
}

static int envmapi_pfm_sign(envmapi_pfm *in) {
    int c = envmapi_peek(in);
    if (c == '-' || c == '+') ++in->at;
    return c == '-' ? -1 : 1;
}

/* A positive integer; more than nine digits are beyond every limit. */
static envmap_result envmapi_pfm_integer(envmapi_pfm *in, int *value) {
    double n = 0;
    envmapi_pfm_digits(in, &n, 0);
    if (envmapi_peek(in) < 0) return ENVMAP_ERROR_TRUNCATED;
    if (n >= 1e9) return ENVMAP_ERROR_LIMIT;
    *value = (int)n;
    return n > 0 ? ENVMAP_OK : ENVMAP_ERROR_FORMAT;
}

/* [+-] digits [. digits] [e [+-] digits] */
static envmap_result envmapi_pfm_number(envmapi_pfm *in, double *value) {
    double mantissa = 0, exponent = 0;
    int sign = envmapi_pfm_sign(in), seen = envmapi_pfm_digits(in, &mantissa, 0), up = 1;
    if (envmapi_peek(in) == '.') ++in->at, seen |= envmapi_pfm_digits(in, &mantissa, 1);
    if (seen && (envmapi_peek(in) == 'e' || envmapi_peek(in) == 'E')) {
        ++in->at;
        up = envmapi_pfm_sign(in), seen = envmapi_pfm_digits(in, &exponent, 0);
    }
    if (envmapi_peek(in) < 0) return ENVMAP_ERROR_TRUNCATED;
    if (!seen) return ENVMAP_ERROR_FORMAT;
    *value = sign * mantissa * pow(10.0, up * fmin(exponent, 400));
    return ENVMAP_OK;
}

/* Which map a picture of this shape is. */
static envmap_result envmapi_pfm_shape(envmapi_pfm *in, int mapping) {
    int faces = envmap_faces(mapping), edge = mapping == ENVMAP_LATLONG ? in->height : in->width;
    uint64_t strip = (uint64_t)faces * (uint64_t)edge;
    in->size = edge;
    in->slices = (int)((uint64_t)in->height / strip);
    if (mapping == ENVMAP_LATLONG && (uint64_t)in->width != 2 * (uint64_t)edge)
        return ENVMAP_ERROR_SHAPE;
    if ((uint64_t)in->height % strip || !in->slices) return ENVMAP_ERROR_SHAPE;
    return edge > ENVMAPI_SIZE_LIMIT ? ENVMAP_ERROR_LIMIT : ENVMAP_OK;
}

static envmap_result envmapi_pfm_header(envmapi_pfm *in, int mapping) {
    envmap_result result;
    if (in->bytes < 2) return ENVMAP_ERROR_TRUNCATED;
    if (in->data[0] != 'P' || (in->data[1] != 'F' && in->data[1] != 'f'))
        return ENVMAP_ERROR_FORMAT;
    in->channels = in->data[1] == 'F' ? 3 : 1;
    in->at = 2;
    if ((result = envmapi_pfm_space(in)) || (result = envmapi_pfm_integer(in, &in->width)) ||
        (result = envmapi_pfm_space(in)) || (result = envmapi_pfm_integer(in, &in->height)) ||
        (result = envmapi_pfm_space(in)) || (result = envmapi_pfm_number(in, &in->scale)))
        return result;
    int after = envmapi_peek(in);
    if (!envmapi_is_space(after)) return ENVMAP_ERROR_FORMAT;
    ++in->at;
    if (!envmapi_finite(in->scale) || !(fabs(in->scale) > 0)) return ENVMAP_ERROR_FORMAT;
    if ((result = envmapi_pfm_shape(in, mapping))) return result;
    uint64_t need = (uint64_t)in->width * (uint64_t)in->height * (uint64_t)in->channels * 4;
    uint64_t have = in->bytes - in->at;
    int lone = in->data[2] == '\r' && in->data[3] != '\n'; /* lines end in carriage returns alone */
    if (after == '\r' && envmapi_peek(in) == '\n' && !lone) ++in->at, --have; /* one line end */
    return have < need ? ENVMAP_ERROR_TRUNCATED : have > need ? ENVMAP_ERROR_TRAILING : ENVMAP_OK;
}

/* Four bytes, the lowest first when `little`, as a float. */
static float envmapi_pfm_sample(const unsigned char *b, int little) {
    uint32_t bits = little
                        ? b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24
                        : b[3] | (uint32_t)b[2] << 8 | (uint32_t)b[1] << 16 | (uint32_t)b[0] << 24;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

ENVMAPI_BODY envmap_result envmap_pfm_read(envmap *map, const void *data, size_t bytes,
                                           int mapping) {
    envmapi_pfm in = {(const unsigned char *)data, bytes, 0, 0, 0, 0, 0, 0, 0};
    envmap_result result;
    if (!map || !data || !envmap_faces(mapping)) return ENVMAP_ERROR_ARGUMENT;
    if ((result = envmapi_pfm_header(&in, mapping))) return result;
    if ((result = envmap_create(map, mapping, in.size, 1, in.slices))) return result;
    const unsigned char *sample = in.data + in.at;
    float factor = (float)envmapi_clamp(fabs(in.scale), 1e-38, 3e38);
    for (int y = in.height - 1; y >= 0; --y) {
        float *row = map->texels + 3 * (size_t)y * (size_t)in.width;
        for (int i = 0; i < 3 * in.width; ++i) {
            row[i] = envmapi_pfm_sample(sample, in.scale < 0);
            if (factor < 1 || factor > 1) row[i] *= factor; /* 1 keeps the bits of NaN */
            if (in.channels == 3 || i % 3 == 2) sample += 4;
        }
    }
    return ENVMAP_OK;
}

static char *envmapi_pfm_decimal(char *out, size_t value) {
    if (value > 9) out = envmapi_pfm_decimal(out, value / 10);
    *out = (char)('0' + value % 10);
    return out + 1;
}

ENVMAPI_BODY envmap_result envmap_pfm_write(void *data, size_t capacity, size_t *bytes,
                                            const envmap *map, int level) {
    char title[64] = "PF\n";
    if (!envmapi_valid(map) || level < 0 || level >= map->levels || (!data && !bytes) ||
        (map->mapping == ENVMAP_LATLONG && map->slices > 1))
        return ENVMAP_ERROR_ARGUMENT;
    int edge = envmapi_edge(map->size, level);
    size_t width = (size_t)envmapi_width(map->mapping, edge), row = 3 * width;
    size_t rows = (size_t)edge * (size_t)envmap_faces(map->mapping) * (size_t)map->slices;
    if (rows > PTRDIFF_MAX / row / 4) return ENVMAP_ERROR_ARGUMENT; /* no memory holds such a map */
    char *end = envmapi_pfm_decimal(title + 3, width);
    *end++ = ' ';
    end = envmapi_pfm_decimal(end, rows);
    memcpy(end, "\n-1.0\n", 6);
    size_t start = (size_t)(end + 6 - title);
    if (bytes) *bytes = start + 4 * rows * row;
    if (!data) return ENVMAP_OK;
    if (capacity < start + 4 * rows * row) return ENVMAP_ERROR_LIMIT;
    unsigned char *out = (unsigned char *)memcpy(data, title, start) + start;
    const float *samples = envmapi_image(map, level, 0, 0);
    for (size_t y = rows; y-- > 0;)
        for (size_t i = y * row; i < (y + 1) * row; ++i) {
            uint32_t bits;
            memcpy(&bits, samples + i, sizeof bits);
            for (int b = 0; b < 4; ++b) *out++ = (unsigned char)(bits >> (8 * b));
        }
    return ENVMAP_OK;
}

#ifndef ENVMAP_NO_STDIO
static FILE *envmapi_pfm_open(const char *path, const char *mode) {
#ifdef _MSC_VER /* warns of fopen, which under /sdl is an error */
    FILE *file = NULL;
    return fopen_s(&file, path, mode) ? NULL : file;
#else
    return fopen(path, mode);
#endif
}

/* How long a file is, -1 for what has no length; goes back to its start. */
static int64_t envmapi_pfm_bytes(FILE *file) {
#ifdef _WIN32 /* whose long ends at 2 GiB */
    int64_t bytes = _fseeki64(file, 0, SEEK_END) ? -1 : _ftelli64(file);
#else
    long end = fseek(file, 0, SEEK_END) ? -1 : ftell(file);
    int64_t bytes = end < LONG_MAX ? end : -1; /* LONG_MAX: a folder */
#endif
    return fseek(file, 0, SEEK_SET) ? -1 : bytes;
}

/* The whole file in memory, its size first, so that no header can make us allocate more. */
ENVMAPI_BODY envmap_result envmap_pfm_load(envmap *map, const char *path, int mapping) {
    envmap_result result = ENVMAP_ERROR_FILE;
    if (!map || !path || !envmap_faces(mapping)) return ENVMAP_ERROR_ARGUMENT;
    FILE *file = envmapi_pfm_open(path, "rb");
    if (!file) return ENVMAP_ERROR_FILE;
    int64_t bytes = envmapi_pfm_bytes(file);
    void *data = NULL;
    if (bytes >= 0) {
        result = ENVMAP_ERROR_MEMORY; /* one byte more: an empty file is no failed allocation */
        if ((uint64_t)bytes <= 2 * ENVMAPI_BYTE_LIMIT && (uint64_t)bytes < SIZE_MAX)
            data = ENVMAP_MALLOC(map->memory, (size_t)bytes + 1);
    }
    if (data) {
        int whole = fread(data, 1, (size_t)bytes, file) == (size_t)bytes;
        result = whole ? envmap_pfm_read(map, data, (size_t)bytes, mapping) : ENVMAP_ERROR_FILE;
        ENVMAP_FREE(map->memory, data);
    }
    fclose(file);
    return result;
}

/* Something with a length: a device must not be removed. */
static int envmapi_pfm_is_file(const char *path) {
    FILE *file = envmapi_pfm_open(path, "rb");
    if (!file) return 0;
    int is_file = envmapi_pfm_bytes(file) > 0;
    fclose(file);
    return is_file;
}

ENVMAPI_BODY envmap_result envmap_pfm_save(const envmap *map, const char *path, int level) {
    size_t bytes;
    if (!path || envmap_pfm_write(NULL, 0, &bytes, map, level)) return ENVMAP_ERROR_ARGUMENT;
    void *data = ENVMAP_MALLOC(map->memory, bytes);
    if (!data) return ENVMAP_ERROR_MEMORY;
    envmap_pfm_write(data, bytes, NULL, map, level);
    FILE *file = envmapi_pfm_open(path, "wb");
    int whole = file && fwrite(data, 1, bytes, file) == bytes;
    whole = file && fclose(file) == 0 && whole;
    if (file && !whole && envmapi_pfm_is_file(path)) remove(path);
    ENVMAP_FREE(map->memory, data);
    return whole ? ENVMAP_OK : ENVMAP_ERROR_FILE;
}
#endif

/* ------------------------------------------------------------------------------------ >>mips --
   Coarser levels from level 0, and what to read of them for a footprint.
       parent = sum over children of w(overlap) child / sum w(overlap)      envmapi_task_nest
       level  = log2 of the footprint's longer side in texels of level 0    envmap_footprint_level
       probes along the longer axis of the footprint's ellipse              envmapi_footprint_axes
   w is the solid angle of the overlap of the nested texels. So w(parent) parent = sum w(child)
   child, and every level carries the same energy. A parent wholly outside a rim takes the plain
   mean of what lies under it. Texels of edge 1 have the same w, and all become their mean, which is
   that of the sphere (envmapi_mip_top).
   Called by users alone. Source: [KVHS00] 5.1, [Williams83], [SKS96]. Tests: tests/test_mips.c. */

/* The texels of a level of edge 1: all the same. */
static void envmapi_mip_top(envmap *map, int level, int slice) {
    int texels = envmap_faces(map->mapping) * envmapi_width(map->mapping, 1);
    float *top = envmapi_image(map, level, slice, 0);
    double rgb[3] = {0, 0, 0};
    for (int i = 0; i < 3 * texels; ++i) rgb[i % 3] += (double)top[i];
    for (int i = 0; i < 3 * texels; ++i) top[i] = (float)(rgb[i % 3] / texels);
}

ENVMAPI_BODY envmap_result envmap_mips_work(envmap *map, const envmap_work *work) {
    envmap_work all;
    if (!envmapi_valid(map) || !envmapi_work_of(&all, work)) return ENVMAP_ERROR_ARGUMENT;
    for (int level = 1; level < map->levels; ++level) {
        int edge = envmapi_edge(map->size, level);
        envmapi_nest nest = {envmapi_image(map, level - 1, 0, 0),
                             envmapi_image(map, level, 0, 0),
                             map->mapping,
                             envmapi_edge(map->size, level - 1),
                             edge,
                             envmap_faces(map->mapping) * map->slices};
        if (edge < 64) all.executor.run = NULL; /* threads take longer to start */
        envmapi_run_all(&all, envmapi_task_nest, &nest, (edge + 1) / 2);
        for (int slice = 0; edge == 1 && slice < map->slices; ++slice)
            envmapi_mip_top(map, level, slice);
    }
    return ENVMAP_OK;
}

ENVMAPI_BODY envmap_result envmap_mips_build(envmap *map) { return envmap_mips_work(map, NULL); }

/* The sides of a footprint at dir in texels of level 0, along u and v, by small steps along them; 0
   for bad maps and numbers. */
static int envmapi_footprint(double texels[2][2], const envmap *map, const float dir[3],
                             const float dx[3], const float dy[3]) {
    double d[3], side[3], a[3], b[3];
    if (!envmapi_valid(map) || !dir || !dx || !dy) return 0;
    double length = sqrt((double)dir[0] * (double)dir[0] + (double)dir[1] * (double)dir[1] +
                         (double)dir[2] * (double)dir[2]);
    envmapi_unit_float(d, dir);
    for (int s = 0; s < 2; ++s) {
        for (int i = 0; i < 3; ++i) side[i] = (double)(s ? dy : dx)[i] / length;
        double size = sqrt(envmapi_dot(side, side)), step = size > 0 ? 1e-4 / size : 1;
        if (!envmapi_finite(size)) return 0;
        for (int i = 0; i < 3; ++i) a[i] = d[i] - step * side[i], b[i] = d[i] + step * side[i];
        envmapi_unit(a, a), envmapi_unit(b, b);
        envmapi_span(texels[s], map->mapping, map->size, d, a, b);
        for (int k = 0; k < 2; ++k) texels[s][k] /= 2 * step;
    }
    return 1;
}

ENVMAPI_BODY float envmap_footprint_level(const envmap *map, const float dir[3], const float dx[3],
                                          const float dy[3]) {
    double t[2][2];
    if (!envmapi_footprint(t, map, dir, dx, dy)) return 0;
    double texels =
        sqrt(fmax(t[0][0] * t[0][0] + t[0][1] * t[0][1], t[1][0] * t[1][0] + t[1][1] * t[1][1]));
    return texels > 1 ? (float)envmapi_clamp(log2(texels), 0, map->levels - 1) : 0;
}

/* The axes of the ellipse { d + cos(t) dx + sin(t) dy } as texels of level 0 see it: the longer and
   the shorter as sides of directions; returns the ratio of their lengths, 1 where there is none. */
static double envmapi_footprint_axes(float major[3], float minor[3], double texels[2][2],
                                     const float dx[3], const float dy[3]) {
    const double *x = texels[0], *y = texels[1];
    double xx = x[0] * x[0] + x[1] * x[1], yy = y[0] * y[0] + y[1] * y[1];
    double xy = x[0] * y[0] + x[1] * y[1], mean = (xx + yy) / 2, swing = hypot((xx - yy) / 2, xy);
    double turn = 0.5 * atan2(2 * xy, xx - yy), c = cos(turn), s = sin(turn);
    for (int i = 0; i < 3; ++i) {
        major[i] = (float)(c * (double)dx[i] + s * (double)dy[i]);
        minor[i] = (float)(c * (double)dy[i] - s * (double)dx[i]);
    }
    return fmax(1, sqrt((mean + swing) / fmax(mean - swing, 1)));
}

ENVMAPI_BODY void envmap_lookup_footprint(float rgb[3], const envmap *map, const float dir[3],
                                          const float dx[3], const float dy[3], int probes) {
    float level = envmap_footprint_level(map, dir, dx, dy), major[3], minor[3], probe[3];
    double texels[2][2], sum[3] = {0, 0, 0}, d[3];
    if (!rgb) return;
    if (!(level > 0) || probes <= 1) {
        envmap_lookup(rgb, map, dir, level);
        return;
    }
    envmapi_footprint(texels, map, dir, dx, dy);
    double ratio = envmapi_footprint_axes(major, minor, texels, dx, dy);
    int n = (int)envmapi_clamp(ceil(ratio - 0.01), 1, probes < 256 ? probes : 256);
    for (int c = 0; c < 3; ++c) major[c] /= (float)n;
    for (int i = 0; i < n; ++i) {
        float at = (float)i + 0.5f - 0.5f * (float)n;
        for (int c = 0; c < 3; ++c) probe[c] = dir[c] + at * major[c];
        level = envmap_footprint_level(map, probe, major, minor);
        envmapi_unit_float(d, probe);
        envmapi_add_trilinear(sum, map, d, 0, (double)level, 1.0 / n);
    }
    for (int c = 0; c < 3; ++c) rgb[c] = (float)sum[c];
}

/* ----------------------------------------------------------------------------------- >>lobes --
   In: a lobe and p. Out: k(x; p), x = cos theta, and what the methods ask about it. Every room
   below asks these calls; none asks which lobe it is.
       integral   2 pi int k(cos theta) sin(theta) d theta                 (envmapi_lobe_integral)
       lambda_l   the same of k P_l(cos theta), over the filter's norm     (envmapi_zonal)
   in closed form or by composite Gauss-Legendre (envmapi_quadrature). Its panels end at the ends of
   the support, at the kinks, and at angles that halve towards theta = 0 (a function's towards pi
   too), so that a peak is met at its own scale whatever that is.
   Banks: with psi = acos(p), k = -cos(theta + psi) - s, over (1-s)^2: a ring at pi - psi whose
   edges are acos(s) off; where the ring covers a pole, k has the tip of a cone there.
   Invariants: lambda_0 = 1 when normalised; closed forms agree with quadrature.
   Tests: tests/test_lobes.c. */

static envmap_lobe envmapi_lobe(int kind, float parameter) {
    envmap_lobe lobe;
    memset(&lobe, 0, sizeof lobe);
    lobe.kind = kind, lobe.parameter = parameter, lobe.scale = 1;
    return lobe;
}

ENVMAPI_BODY envmap_lobe envmap_lobe_mirror(void) { return envmapi_lobe(ENVMAP_LOBE_MIRROR, 0); }
ENVMAPI_BODY envmap_lobe envmap_lobe_diffuse(void) { return envmapi_lobe(ENVMAP_LOBE_PHONG, 1); }
ENVMAPI_BODY envmap_lobe envmap_lobe_phong(float exponent) {
    return envmapi_lobe(ENVMAP_LOBE_PHONG, exponent);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_gaussian(float sharpness) {
    return envmapi_lobe(ENVMAP_LOBE_GAUSSIAN, sharpness);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_ggx(float alpha) {
    if (alpha >= 0 && alpha <= 0) return envmap_lobe_mirror();
    return envmapi_lobe(ENVMAP_LOBE_GGX, alpha > 0 && alpha < 1e-4f ? 1e-4f : alpha);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_banks(float s) {
    envmap_lobe lobe = envmapi_lobe(ENVMAP_LOBE_BANKS, s);
    lobe.p0 = -1, lobe.p1 = 1;
    return lobe;
}

ENVMAPI_BODY envmap_lobe envmap_lobe_function(envmap_lobe_function_type *function, void *user) {
    envmap_lobe lobe = envmapi_lobe(ENVMAP_LOBE_FUNCTION, 0);
    lobe.function = function, lobe.user = user;
    return lobe;
}

ENVMAPI_BODY envmap_lobe envmap_lobe_table(const float *values, int size, int slices, float p0,
                                           float p1) {
    envmap_lobe lobe = envmapi_lobe(ENVMAP_LOBE_TABLE, 0);
    lobe.table = values, lobe.table_size = size, lobe.table_slices = slices;
    lobe.p0 = p0, lobe.p1 = p1;
    return lobe;
}

/* A cosine, to rounding, is what Banks' p must be. */
static int envmapi_cosine_ok(double p) { return fabs(p) <= 1 + 1e-6; }

/* What a query needs to be safe: kind, numbers and pointers, in O(1). */
static int envmapi_lobe_ok(const envmap_lobe *lobe) {
    if (!lobe) return 0;
    double parameter = (double)lobe->parameter, p0 = (double)lobe->p0, p1 = (double)lobe->p1;
    if (!envmapi_finite((double)lobe->scale + p0 + p1 + parameter)) return 0;
    switch (lobe->kind) {
    case ENVMAP_LOBE_MIRROR: return 1;
    case ENVMAP_LOBE_PHONG:
    case ENVMAP_LOBE_GAUSSIAN: return parameter >= 0 && parameter <= 1e9;
    case ENVMAP_LOBE_GGX: return parameter >= 0.99e-4 && parameter <= 1;
    case ENVMAP_LOBE_BANKS:
        return parameter >= 0 && parameter <= 0.99999 && envmapi_cosine_ok(p0) &&
               envmapi_cosine_ok(p1);
    case ENVMAP_LOBE_FUNCTION:
        return lobe->function && lobe->kink_count >= 0 && (lobe->kinks || !lobe->kink_count);
    case ENVMAP_LOBE_TABLE:
        return lobe->table && lobe->table_size >= 4 && lobe->table_size <= 1 << 20 &&
               lobe->table_slices >= 1 && lobe->table_slices <= ENVMAPI_SLICE_LIMIT &&
               lobe->table_size <= (1 << 28) / lobe->table_slices; /* so that int counts them */
    default: return 0;
    }
}

/* The same at the door of long calls: the table's numbers and the kinks too. */
static int envmapi_lobe_sound(const envmap_lobe *lobe) {
    int sound = envmapi_lobe_ok(lobe), kind = sound ? lobe->kind : 0;
    for (int i = 0; kind == ENVMAP_LOBE_FUNCTION && i < lobe->kink_count; ++i)
        sound &= lobe->kinks[i] > 0 && (double)lobe->kinks[i] < ENVMAPI_PI;
    for (int i = 0; kind == ENVMAP_LOBE_TABLE && i < lobe->table_size * lobe->table_slices; ++i)
        sound &= envmapi_finite((double)lobe->table[i]);
    return sound;
}

/* The mirror is a lobe, but no function. */
static int envmapi_lobe_has_k(const envmap_lobe *lobe, double p) {
    return envmapi_lobe_ok(lobe) && lobe->kind != ENVMAP_LOBE_MIRROR && envmapi_finite(p) &&
           (lobe->kind != ENVMAP_LOBE_BANKS || envmapi_cosine_ok(p));
}

static double envmapi_acos(double x) { return acos(envmapi_clamp(x, -1, 1)); }

/* 0 up to from, 1 beyond to, smooth between. */
static double envmapi_smooth_step(double value, double from, double to) {
    double t = envmapi_clamp((value - from) / (to - from), 0, 1);
    return t * t * (3 - 2 * t);
}

/* Catmull-Rom along a row; mirrored at both ends, as a zonal function is. */
static double envmapi_table_row(const envmap_lobe *lobe, int row, double theta) {
    const float *values = lobe->table + row * lobe->table_size;
    int last = lobe->table_size - 1;
    double t = envmapi_clamp(theta / ENVMAPI_PI, 0, 1) * last;
    int i = t >= last ? last - 1 : (int)t;
    double f = t - i, a = (double)values[i > 0 ? i - 1 : 1], b = (double)values[i];
    double c = (double)values[i + 1], d = (double)values[i + 2 <= last ? i + 2 : last - 1];
    double cubic = 3 * (b - c) + d - a, square = 2 * a - 5 * b + 4 * c - d;
    return b + 0.5 * f * (c - a + f * (square + f * cubic));
}

static double envmapi_table_k(const envmap_lobe *lobe, double x, double p) {
    double theta = envmapi_acos(x);
    double at = envmapi_slice_at(p, (double)lobe->p0, (double)lobe->p1, lobe->table_slices);
    int row = (int)at;
    double k = envmapi_table_row(lobe, row, theta);
    return at > row ? k + (at - row) * (envmapi_table_row(lobe, row + 1, theta) - k) : k;
}

/* 1/sqrt q by Newton's steps from half the exponent: sqrt sets errno, which no vector can. */
static inline double envmapi_inverse_root(double q) {
    uint64_t bits;
    double r;
    memcpy(&bits, &q, sizeof bits);
    bits = UINT64_C(0x5FE6EB50C7B537A9) - (bits >> 1);
    memcpy(&r, &bits, sizeof r);
    for (int step = 0; step < 4; ++step) r *= 1.5 - 0.5 * q * r * r;
    return r;
}

/* k, without scale, of n cosines: each lobe's formula, as a loop that a compiler can vectorise. */
static void envmapi_k_many(double *k, const double *x, int n, const envmap_lobe *lobe, double p) {
    double a = (double)lobe->parameter, aa = a * a, peak = 1 / ((1 - a) * (1 - a));
    switch (lobe->kind) {
    case ENVMAP_LOBE_PHONG:
        if (a >= 1 && a <= 1)
            for (int i = 0; i < n; ++i) k[i] = x[i] > 0 ? x[i] : 0;
        else
            for (int i = 0; i < n; ++i) /* 0 on the horizon, whatever rounding makes of x */
                k[i] = !(x[i] > 1e-12) ? 0 : a > 0 ? pow(x[i], a) : 1;
        return;
    case ENVMAP_LOBE_GAUSSIAN:
        for (int i = 0; i < n; ++i) k[i] = exp(a * (x[i] - 1));
        return;
    case ENVMAP_LOBE_GGX: /* q = (alpha^2-1) c^2 + 1, c^2 = (1+x)/2 */
        for (int i = 0; i < n; ++i) {
            double q = aa * (1 + x[i]) / 2 + (1 - x[i]) / 2;
            k[i] = x[i] > 0 ? aa / (ENVMAPI_PI * q * q) * x[i] : 0;
        }
        return;
    case ENVMAP_LOBE_BANKS:
        for (int i = 0; i < n; ++i) {
            double sines = (1 - x[i] * x[i]) * (1 - p * p);
            sines = sines > 0 ? sines : 0;
            double ring = sines * envmapi_inverse_root(sines) - x[i] * p - a;
            k[i] = ring > 0 ? ring * peak : 0;
        }
        return;
    case ENVMAP_LOBE_FUNCTION:
        for (int i = 0; i < n; ++i) k[i] = lobe->function(x[i], p, lobe->user);
        return;
    default:
        for (int i = 0; i < n; ++i) k[i] = envmapi_table_k(lobe, x[i], p);
    }
}

static double envmapi_k(const envmap_lobe *lobe, double x, double p) {
    double k;
    envmapi_k_many(&k, &x, 1, lobe, p);
    return k;
}

ENVMAPI_BODY double envmap_lobe_value(const envmap_lobe *lobe, double x, double p) {
    if (!envmapi_lobe_has_k(lobe, p) || !envmapi_finite(x)) return 0;
    return (double)lobe->scale * envmapi_k(lobe, envmapi_clamp(x, -1, 1), p);
}

ENVMAPI_BODY void envmap_lobe_support(double *from, double *to, const envmap_lobe *lobe, double p) {
    if (!from || !to) return;
    *from = *to = 0;
    if (!envmapi_lobe_has_k(lobe, p)) return;
    double a = (double)lobe->parameter, tail = 27.631; /* -ln 1e-12 */
    *to = ENVMAPI_PI;
    if (lobe->kind == ENVMAP_LOBE_GGX) *to = ENVMAPI_PI / 2;
    if (lobe->kind == ENVMAP_LOBE_PHONG) *to = a > 0 ? acos(exp(-tail / a)) : ENVMAPI_PI / 2;
    if (lobe->kind == ENVMAP_LOBE_GAUSSIAN && a > tail / 2) *to = 2 * asin(sqrt(tail / (2 * a)));
    if (lobe->kind == ENVMAP_LOBE_BANKS) {
        double ring = envmapi_acos(-p), edge = acos(a);
        *from = ring > edge ? ring - edge : 0;
        *to = ring + edge < ENVMAPI_PI ? ring + edge : ENVMAPI_PI;
    }
}

/* Does k have a root at its horizon, x^N, or a jump? */
static int envmapi_lobe_root(const envmap_lobe *lobe) {
    return lobe->kind == ENVMAP_LOBE_PHONG && lobe->parameter < 1;
}

/* Angles where k or its slope jumps, or its curvature has no bound: the horizon, the edges of a
   ring and the tip of a cone, a function's own. Returns how many. */
#define ENVMAPI_KINKS 64 /* further ones of a function do not count */
static int envmapi_lobe_kinks(double kinks[ENVMAPI_KINKS], const envmap_lobe *lobe, double p) {
    int n = 0, banks = lobe->kind == ENVMAP_LOBE_BANKS;
    int phong = lobe->kind == ENVMAP_LOBE_PHONG && lobe->parameter < 2;
    if (phong || lobe->kind == ENVMAP_LOBE_GGX) kinks[n++] = ENVMAPI_PI / 2;
    double from, to;
    envmap_lobe_support(&from, &to, lobe, p);
    if (banks && p > -1) kinks[n++] = from; /* at p = -1 and 1 the ring is a disk about a pole */
    if (banks && p < 1) kinks[n++] = to;
    if (lobe->kind == ENVMAP_LOBE_FUNCTION)
        for (; n < lobe->kink_count && n < ENVMAPI_KINKS; ++n) kinks[n] = (double)lobe->kinks[n];
    return n;
}

/* Composite Gauss-Legendre over a part of a lobe's support: panels between breaks, each cut into
   two or more pieces no longer than `step`, 8 nodes a piece. */
typedef struct envmapi_quadrature {
    double breaks[128], step;
    int count, panel, pieces, node; /* of breaks; where it is: a panel, its pieces, a node of it */
} envmapi_quadrature;

static void envmapi_quadrature_break(envmapi_quadrature *q, double theta) {
    int i = q->count;
    if (!(theta > q->breaks[0] && theta < q->breaks[i - 1]) || i >= 128) return;
    while (q->breaks[i - 1] > theta) --i;
    if (theta - q->breaks[i - 1] < 1e-9) return; /* an edge of two faces */
    memmove(q->breaks + i + 1, q->breaks + i, (size_t)(q->count - i) * sizeof *q->breaks);
    q->breaks[i] = theta;
    ++q->count;
}

static envmapi_quadrature envmapi_quadrature_of(const envmap_lobe *lobe, double p, double from,
                                                double to, double step) {
    envmapi_quadrature q;
    double low, high, kinks[ENVMAPI_KINKS], width = (double)lobe->parameter, finest = 1e-6;
    memset(&q, 0, sizeof q);
    envmap_lobe_support(&low, &high, lobe, p);
    q.breaks[0] = from > low ? from : low, q.breaks[1] = to < high ? to : high;
    if (!(q.breaks[0] < q.breaks[1])) return q;
    q.count = 2, q.step = lobe->kind < ENVMAP_LOBE_FUNCTION ? 1 : 0.1;
    /* No lobe of known width has detail a tenth of that, a ring none but its kinks, so their panels
       may be long; a table has pieces of its own. */
    if (lobe->kind == ENVMAP_LOBE_PHONG || lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        finest = 0.1 / sqrt(width + 1);
    if (lobe->kind == ENVMAP_LOBE_GGX) finest = 0.1 * width;
    if (lobe->kind == ENVMAP_LOBE_BANKS) finest = ENVMAPI_PI;
    if (lobe->kind == ENVMAP_LOBE_TABLE)
        q.step = ENVMAPI_PI / (lobe->table_size - 1), finest = ENVMAPI_PI;
    if (step < q.step) q.step /= ceil(q.step / step);
    int n = envmapi_lobe_kinks(kinks, lobe, p);
    for (int i = 0; i < n; ++i) envmapi_quadrature_break(&q, kinks[i]);
    for (double scale = 1.6; scale > finest; scale /= 2) {
        envmapi_quadrature_break(&q, scale);
        if (lobe->kind == ENVMAP_LOBE_FUNCTION)
            envmapi_quadrature_break(&q, ENVMAPI_PI - 0.75 * scale);
    }
    return q;
}

/* The next node and its weight in d theta; 0 at the end. */
static int envmapi_quadrature_next(envmapi_quadrature *q, double *theta, double *weight) {
    if (q->panel + 1 >= q->count) return 0;
    double from = q->breaks[q->panel], length = q->breaks[q->panel + 1] - from;
    if (!q->node) q->pieces = 2 + (int)(length / q->step);
    double piece = length / q->pieces, start = from + piece * (q->node / 8);
    *weight = envmapi_gauss(theta, q->node % 8, start, start + piece);
    if (++q->node == 8 * q->pieces) q->node = 0, ++q->panel;
    return 1;
}

/* 2 pi integral of k^power over [-1,1]; of |k| for power 0. Closed forms, as the square of these
   lobes is one of twice the parameter; else quadrature. */
static double envmapi_lobe_power(const envmap_lobe *lobe, double p, int power) {
    double a = (double)lobe->parameter * (power == 2 ? 2 : 1);
    if (lobe->kind == ENVMAP_LOBE_PHONG) return 2 * ENVMAPI_PI / (a + 1);
    if (lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        return a > 1e-12 ? -2 * ENVMAPI_PI * expm1(-2 * a) / a : 4 * ENVMAPI_PI;
    envmapi_quadrature q = envmapi_quadrature_of(lobe, p, 0, ENVMAPI_PI, 1);
    double sum = 0, theta, weight;
    while (envmapi_quadrature_next(&q, &theta, &weight)) {
        double k = envmapi_k(lobe, cos(theta), p);
        sum += weight * sin(theta) * (power == 2 ? k * k : power == 0 ? fabs(k) : k);
    }
    return 2 * ENVMAPI_PI * sum;
}

/* The integral without scale. */
static double envmapi_lobe_integral(const envmap_lobe *lobe, double p) {
    double a = (double)lobe->parameter;
    if (lobe->kind == ENVMAP_LOBE_BANKS && fabs(p) <= a && a < 0.99)
        return 2 * ENVMAPI_PI * sqrt(1 - p * p) * (acos(a) - a * sqrt(1 - a * a)) /
               ((1 - a) * (1 - a));
    return envmapi_lobe_power(lobe, p, 1);
}

ENVMAPI_BODY double envmap_lobe_integral(const envmap_lobe *lobe, double p) {
    if (!envmapi_lobe_has_k(lobe, p)) return 0;
    double integral = (double)lobe->scale * envmapi_lobe_integral(lobe, p);
    return envmapi_finite(integral) ? integral : 0;
}

/* The integral can be divided by: what is left of k that cancels is rounding. */
static int envmapi_lobe_positive(const envmap_lobe *lobe, double p) {
    double integral = envmapi_lobe_integral(lobe, p);
    if (!envmapi_finite(integral) || !(integral > 0)) return 0;
    if (lobe->kind != ENVMAP_LOBE_FUNCTION && lobe->kind != ENVMAP_LOBE_TABLE) return 1;
    return integral > 1e-9 * envmapi_lobe_power(lobe, p, 0);
}

/* Is the lobe nowhere negative, to rounding, at all nodes of its integral? */
static int envmapi_lobe_nonnegative(const envmap_lobe *lobe, double p) {
    if (lobe->raw && lobe->scale < 0) return 0;
    if (lobe->kind < ENVMAP_LOBE_FUNCTION) return 1;
    return envmapi_lobe_power(lobe, p, 1) >= (1 - 1e-12) * envmapi_lobe_power(lobe, p, 0);
}

/* What the filter divides by: 1 raw, one constant for all of Banks' slices; 0 asks for the sum of
   k w over the texels of each axis. */
static double envmapi_lobe_norm(const envmap_lobe *lobe) {
    if (lobe->raw) return 1 / (double)lobe->scale;
    return lobe->kind == ENVMAP_LOBE_BANKS ? envmapi_lobe_integral(lobe, 0) : 0;
}

/* The angle of the largest |k|, among 0 and the quadrature's nodes. */
static double envmapi_lobe_peak(const envmap_lobe *lobe, double p) {
    envmapi_quadrature q = envmapi_quadrature_of(lobe, p, 0, ENVMAPI_PI, 1);
    double peak = fabs(envmapi_k(lobe, 1, p)), at = 0, theta, weight;
    while (envmapi_quadrature_next(&q, &theta, &weight)) {
        double k = fabs(envmapi_k(lobe, cos(theta), p));
        if (k > peak) peak = k, at = theta;
    }
    for (double step = 0.02; step > 1e-5; step /= 2) /* between nodes */
        for (int side = -1; side <= 1; side += 2) {
            double beside = envmapi_clamp(at + side * step, 0, ENVMAPI_PI);
            double k = fabs(envmapi_k(lobe, cos(beside), p));
            if (k > peak) peak = k, at = beside;
        }
    return at;
}

/* How far |k| stays above `level` from the angle `peak` on, towards pi (side 1) or 0 (side -1), at
   most to there: by steps that grow by a tenth until it is below, then by halves. */
static double envmapi_lobe_flank(const envmap_lobe *lobe, double p, double peak, double level,
                                 int side) {
    double inside = 0, outside = 0, room = side > 0 ? ENVMAPI_PI - peak : peak;
    for (int halved = 0; halved < 40;) {
        double s = outside > 0 ? 0.5 * (inside + outside) : fmin(1.1 * inside + 1e-6, room);
        if (fabs(envmapi_k(lobe, cos(peak + side * s), p)) < level) outside = s;
        else if (s < room) inside = s;
        else return room;
        if (outside > 0) ++halved;
    }
    return outside;
}

ENVMAPI_BODY double envmap_lobe_sigma(const envmap_lobe *lobe, double p) {
    if (!envmapi_lobe_has_k(lobe, p)) return 0;
    double a = (double)lobe->parameter, level = 0.60653066; /* e^(-1/2) */
    double square = a * a * a * a, g = square / level;      /* GGX's is a quadratic's root */
    switch (lobe->kind) {
    case ENVMAP_LOBE_PHONG: return a > 0 ? 2 * asin(sqrt(-expm1(-0.5 / a) / 2)) : ENVMAPI_PI / 2;
    case ENVMAP_LOBE_GAUSSIAN: return a > 0.25 ? 2 * asin(sqrt(0.25 / a)) : ENVMAPI_PI;
    case ENVMAP_LOBE_BANKS: return acos(a + level * (1 - a));
    case ENVMAP_LOBE_GGX:
        return acos((1 + a * a) * (1 + a * a) /
                    (1 - square + 2 * g + 2 * sqrt(g * (1 - square + g))));
    default: break;
    }
    double peak = envmapi_lobe_peak(lobe, p);
    level *= fabs(envmapi_k(lobe, cos(peak), p));
    double left = envmapi_lobe_flank(lobe, p, peak, level, -1);
    double right = envmapi_lobe_flank(lobe, p, peak, level, 1);
    if (!(left < peak)) return peak + right; /* a peak that reaches the axis, or what is opposite */
    return right < ENVMAPI_PI - peak ? 0.5 * (left + right) : ENVMAPI_PI - peak + left;
}

/* ---- lambda_l: closed forms from lambda_0 on, quadrature */

static void envmapi_zonal_phong(double *lambda, int bands, double N) {
    if (bands > 1) lambda[1] = lambda[0] * (N + 1) / (N + 2);
    for (int l = 0; l + 2 < bands; ++l) lambda[l + 2] = lambda[l] * (N - l) / (N + l + 3);
}

/* r_l = lambda_l / lambda_(l-1) = 1 / ((2l+1)/kappa + r_(l+1)), downwards from where
   r = 1/(2b + r) holds; each step shrinks the error of the start by r^2. */
static void envmapi_zonal_gaussian(double *lambda, int bands, double kappa) {
    int start = bands + 32 + (int)(8 * sqrt(kappa));
    if (!(kappa > 1e-100)) kappa = 1e-100; /* no division by 0: lambda_1 = kappa/3 */
    double b = (2.0 * start + 1) / (2 * kappa), r = 1 / (b + sqrt(b * b + 1));
    for (int l = start - 1; l > 0; --l) {
        r = 1 / ((2.0 * l + 1) / kappa + r);
        if (l < bands) lambda[l] = r;
    }
    for (int l = 1; l < bands; ++l) lambda[l] *= lambda[l - 1];
}

/* P_l at 64 cosines side by side, for vectors to do; one l after the other. */
#define ENVMAPI_ANGLES 64
typedef struct envmapi_series {
    int l;
    const double *x;
    double P[ENVMAPI_ANGLES], before[ENVMAPI_ANGLES];
} envmapi_series;

static void envmapi_series_next(envmapi_series *series) {
    double a = (2 * series->l + 1.0) / (series->l + 1), b = series->l / (series->l + 1.0);
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
        double P = series->P[j];
        series->P[j] = a * series->x[j] * P - b * series->before[j], series->before[j] = P;
    }
    ++series->l;
}

/* The weights k go into P_0, as the recurrence is linear: lambda_l += sum_j k_j P_l. */
static void envmapi_zonal_quadrature(double *lambda, int bands, const envmap_lobe *lobe, double p,
                                     double factor) {
    envmapi_quadrature q = envmapi_quadrature_of(lobe, p, 0, ENVMAPI_PI, 8.0 / bands);
    double theta, weight, x[ENVMAPI_ANGLES] = {0};
    envmapi_series series;
    memset(lambda, 0, (size_t)bands * sizeof *lambda);
    for (int n = ENVMAPI_ANGLES; n == ENVMAPI_ANGLES;) {
        memset(&series, 0, sizeof series);
        series.x = x;
        for (n = 0; n < ENVMAPI_ANGLES && envmapi_quadrature_next(&q, &theta, &weight); ++n) {
            x[n] = cos(theta);
            series.P[n] = factor * 2 * ENVMAPI_PI * weight * sin(theta) * envmapi_k(lobe, x[n], p);
        }
        for (int l = 0; l < bands && n; ++l, envmapi_series_next(&series)) {
            double sum[8] = {0};
            for (int j = 0; j < ENVMAPI_ANGLES; j += 8)
                for (int i = 0; i < 8; ++i) sum[i] += series.P[j + i];
            lambda[l] += ((sum[0] + sum[1]) + (sum[2] + sum[3])) +
                         ((sum[4] + sum[5]) + (sum[6] + sum[7]));
        }
    }
}

/* The bands, divided by the filter's norm; 0 when that is not positive. */
static int envmapi_zonal(double *lambda, int bands, const envmap_lobe *lobe, double p) {
    double integral = envmapi_lobe_integral(lobe, p), norm = envmapi_lobe_norm(lobe);
    if (!lobe->raw && !(norm > 0)) norm = envmapi_lobe_positive(lobe, p) ? integral : 0;
    if (!envmapi_finite(integral) || (!lobe->raw && !(norm > 0))) return 0;
    double factor = lobe->raw ? (double)lobe->scale : 1 / norm;
    lambda[0] = factor * integral;
    if (lobe->kind == ENVMAP_LOBE_PHONG)
        envmapi_zonal_phong(lambda, bands, (double)lobe->parameter);
    else if (lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        envmapi_zonal_gaussian(lambda, bands, (double)lobe->parameter);
    else envmapi_zonal_quadrature(lambda, bands, lobe, p, factor);
    return 1;
}

#define ENVMAPI_BAND_LIMIT 4096

ENVMAPI_BODY envmap_result envmap_lobe_zonal(double *lambda, int bands, const envmap_lobe *lobe,
                                             double p) {
    if (!lambda || !lobe || bands < 1 || bands > ENVMAPI_BAND_LIMIT || !envmapi_finite(p))
        return ENVMAP_ERROR_ARGUMENT;
    if (!envmapi_lobe_has_k(lobe, p) || !envmapi_lobe_sound(lobe)) return ENVMAP_ERROR_LOBE;
    double first[1]; /* a lobe that fails does so at one band, before anything is written */
    if (!envmapi_zonal(first, 1, lobe, p)) return ENVMAP_ERROR_LOBE;
    envmapi_zonal(lambda, bands, lobe, p);
    return ENVMAP_OK;
}

/* p at the centre of slice k of n. */
static double envmapi_slice_p(const envmap_lobe *lobe, int k, int n) {
    double p0 = (double)lobe->p0, p1 = (double)lobe->p1;
    return p0 + (p1 - p0) * (k + 0.5) / n;
}

/* ---------------------------------------------------------------------------------- >>splines --
   Quintic B-splines, by which grids are interpolated, and what a grid loses.
     in     places between samples      out    weights of six samples; errors of waves and bands
       B(x) = sum_k (-1)^k (6 over k) max(x - k, 0)^5 / 120
       weights at two places            _splines, _splines_four
       (1, 26, 66, 26, 1)/120 c = f, for the coefficients c of samples f       _spline_factor
       what is lost of a wave, of a band; how wide a grid may be
                                        _spline_error, _band_error, _widest_spacing
   Used by >>rings, >>transform, >>harmonics, >>fast and >>plan.  Source [Unser91].
   Tests: tests/test_harmonics.c. */

/* w = sum_i powers[i] x^(5-i), by Horner's rule. */
ENVMAPI_INLINE void envmapi_powers(envmapi_float16 *w, const float powers[6][16],
                                   const envmapi_float16 *x) {
    envmapi_float16 sum = *envmapi_float16_at(powers[0]);
    for (int i = 1; i < 6; ++i) {
        envmapi_float16 next = *envmapi_float16_at(powers[i]);
        envmapi_float16_mad(&next, &sum, x), sum = next;
    }
    memset(w, 0, sizeof *w), envmapi_float16_add(w, 1.0f / 120, &sum);
}

/* Quintic B-splines at the six samples around two points, f and g in [0,1] past the third:
   w[0..5] and w[8..13]. */
ENVMAPI_INLINE void envmapi_splines(float w[16], float f, float g) {
    static const float powers[6][16] = {
        {-1, 5, -10, 10, -5, 1, 0, 0, -1, 5, -10, 10, -5, 1},
        {5, -20, 30, -20, 5, 0, 0, 0, 5, -20, 30, -20, 5},
        {-10, 20, 0, -20, 10, 0, 0, 0, -10, 20, 0, -20, 10},
        {10, 20, -60, 20, 10, 0, 0, 0, 10, 20, -60, 20, 10},
        {-5, -50, 0, 50, 5, 0, 0, 0, -5, -50, 0, 50, 5},
        {1, 26, 66, 26, 1, 0, 0, 0, 1, 26, 66, 26, 1},
    };
    const float at[16] = {f, f, f, f, f, f, f, f, g, g, g, g, g, g, g, g};
    envmapi_float16 x = *envmapi_float16_at(at), sums;
    envmapi_powers(&sums, powers, &x);
    memcpy(w, &sums, sizeof sums);
}

/* The first four of w[8..13] above, at g, times four numbers each; in wide registers evaluated
   again, as lanes do not move there without memory. */
ENVMAPI_INLINE void envmapi_splines_four(envmapi_float16 *terms, const float w[16], float g,
                                         const float value[4]) {
#define ENVMAPI_FOUR(a, b, c, d) {a, a, a, a, b, b, b, b, c, c, c, c, d, d, d, d}
    static const float powers[6][16] = {
        ENVMAPI_FOUR(-1, 5, -10, 10),  ENVMAPI_FOUR(5, -20, 30, -20),
        ENVMAPI_FOUR(-10, 20, 0, -20), ENVMAPI_FOUR(10, 20, -60, 20),
        ENVMAPI_FOUR(-5, -50, 0, 50),  ENVMAPI_FOUR(1, 26, 66, 26)};
#undef ENVMAPI_FOUR
    const float at[16] = {g, g, g, g, g, g, g, g, g, g, g, g, g, g, g, g};
    float each[16];
    envmapi_float16 x = *envmapi_float16_at(at), again;
    memset(terms, 0, sizeof *terms);
    for (int i = 0; i < 16; ++i) each[i] = value[i % 4];
    if (ENVMAPI_REGISTER == 16)
        ENVMAPI_UNROLL for (int b = 0; b < 4; ++b)
            envmapi_float4_add((envmapi_float4 *)terms + b, w[8 + b], envmapi_float4_at(value));
    else
        envmapi_powers(&again, powers, &x),
            envmapi_float16_mad(terms, &again, envmapi_float16_at(each));
}

/* What the spline loses of a wave of f cycles a sample: its fundamental by sum (f/(f+k))^6 over
   k != 0, and as much again goes to the aliases k.  Test: the_splines_error_is_what_waves_lose. */
static double envmapi_spline_error(double f) {
    double a = f / (1 - f), b = f / (1 + f);
    if (!(f < 0.5)) return 1;
    a *= a * a, b *= b * b, a *= a, b *= b;
    double lost = 1.08 * (a + b);
    return fmin(sqrt(lost * lost + a * a + b * b), 1);
}

/* The same of band l on a grid of spacing h. A harmonic is no plane wave in (u,v): a face's own
   curvature adds about 6 to l^2 (the sixth derivative of 1/sqrt(1+u^2) is 225, 6^3). A constant
   loses nothing.  Test: points_keep_the_tolerance. */
static double envmapi_band_error(int l, double h) {
    return l ? envmapi_spline_error(sqrt(l * l + 6.0) * h / (2 * ENVMAPI_PI)) : 0;
}

/* The widest that a grid for so many bands may be: 0.45 cycles a node, as 0.5 look slower. */
static double envmapi_widest_spacing(int bands) { return 0.45 * 2 * ENVMAPI_PI / bands; }

/* Factors of the symmetric matrix (1, 26, 66, 26, 1) of n rows whose first and last rows see
   themselves mirrored, times `first` and `last`: L D L^t, a row's [1/D, L one before, L two
   before], and two rows of zeros. */
static void envmapi_spline_factor(double (*factors)[3], int n, double first, double last) {
    memset(factors, 0, (size_t)(n + 2) * sizeof *factors);
    for (int i = 0; i < n; ++i) {
        double *f = factors[i];
        double diagonal = 66 + (i == 0 ? 26 * first : 0) + (i == n - 1 ? 26 * last : 0);
        double beside = 26 + (i == 1 ? first : 0) + (i == n - 1 ? last : 0);
        if (i > 1) f[2] = factors[i - 2][0];
        if (i > 0) f[1] = (beside - (i > 1 ? factors[i - 1][1] : 0)) * factors[i - 1][0];
        if (i > 0) diagonal -= f[1] * f[1] / factors[i - 1][0];
        if (i > 1) diagonal -= f[2];
        f[0] = 1 / diagonal;
    }
}

/* ------------------------------------------------------------------------------------ >>rings --
   Points of light <-> rings <-> a_lm: the only spherical harmonic transform here.
     in     points d_i with values e_i, or coefficients      out    a_lm, or values at points
       a_lm = sum_i e_i Y_lm(d_i)     and its adjoint     e_i = sum_lm lambda_l a_lm Y_lm(d_i)
   There are M rings of 2M samples, theta_j = (j+1/2) pi/M, phi_k = k pi/M:
       spread        each point on 6 x 6 samples by quintic B-splines, the adjoint of interpolation
                     _rings_spread, _rings_interpolate
       in phi        FFT, and divide by the spline's response, (66 + 52 cos w + 2 cos 2w)/120 for
                     w = pi m/M     _fft, _rings_unpack, _rings_pack
       in theta      solve (1, 26, 66, 26, 1)/120 c = f; ring -1 is ring 0 half a turn on: (-1)^m
                     _rings_solve
       Legendre      a_lm = sum_j P_lm(theta_j) F_m(theta_j)
                     _legendre_analyse, _legendre_synthesise
   and back by the same steps in reverse order. Spline and FFT are never inverted approximately, so
   all that is lost is what a spline loses of a wave of f cycles a sample, about 2.4 f^6
   (_spline_error), and the bands left out. Four channels: RGB and solid angle.
   Rings j and M-1-j are one complex number for the FFT, and e, o = north +- south for Legendre.
   Samples are floats, whose rounding stays where it is. That of F_m goes around: between the FFT
   and the sums they are integers in the place of the samples, of 2^-31 of the sum of a ring, or of
   the largest F_m of its m on the way back (_units).
   Used by >>transform.  Source [Swarztrauber79] for e and o; splines [Unser91].
   Tests: tests/test_harmonics.c. */

#define ENVMAPI_CHUNK 64 /* directions that are worked on together */

/* Angle of (x,y) in (-pi,pi] and length, for a chunk: a polynomial, good to 1e-12. No branches, no
   calls that set errno, so that compilers make vectors of it; no array may be another. */
static void envmapi_polar(double *angle, double *length, const double *y, const double *x) {
    static const double atan[8] = {0.9999999999941719,  -0.333333331674598,  0.19999986206395,
                                   -0.142851974611006,  0.1110077376986512,  -0.0897214949338374,
                                   0.06895142217074653, -0.036429357645156486};
    for (int i = 0; i < ENVMAPI_CHUNK; ++i) {
        double ax = fabs(x[i]), ay = fabs(y[i]), square = ax * ax + ay * ay;
        double most = ax > ay ? ax : ay, least = ax > ay ? ay : ax, r = 0;
        int wide = least > 0.41421356237309503 * most; /* |s| <= tan pi/8 */
        double s = (wide ? least - most : least) / ((wide ? least + most : most) + 1e-300);
        length[i] = square * envmapi_inverse_root(square);
        for (int k = 7; k >= 0; --k) r = s * s * r + atan[k];
        r = r * s + (wide ? ENVMAPI_PI / 4 : 0);
        r = ay > ax ? ENVMAPI_PI / 2 - r : r;
        r = x[i] < 0 ? ENVMAPI_PI - r : r;
        angle[i] = y[i] < 0 ? -r : r;
    }
}

/* A direction's angles: of phi 2^-32 turns, of theta half as much. */
typedef struct envmapi_point {
    uint32_t phi, theta;
} envmapi_point;

/* Where a point falls: the grid point before it, and how far past that. */
typedef struct envmapi_spot {
    int k, j;
    float f_k, f_j;
} envmapi_spot;

typedef struct envmapi_rings {
    int M, bands, stages, radices[24];
    size_t row, pairs; /* floats a row of G: rings -3 .. M+2, 4 channels; M/2, in blocks of 8 */
    float *G;          /* [-3 .. 2M+2][row]; the real parts of F_m in row 2m, the others in 2m+1 */
    double *units;     /* what F_m are counted in: of rings, [M][4]; on the way back [bands][4] */
    double *twiddles; /* cos, sin of 2 pi i/2M */
    double *response; /* 1 / the spline's response at m */
    double *x, *log_sin, *norms; /* cos and log sin of the rings; log of P_mm / sin^m */
    int *reversed;               /* where the FFT leaves frequency m: its digits in reverse */
    double (*factors)[3]; /* of the solve down the rings, [4][M/2+2]: even m and odd; e and o */
    /* the points, and what is there: RGB and solid angle */
    envmapi_point *points;
    float *values;      /* [count][4] */
    size_t count;
    size_t room, begin, lone; /* doubles from G on: all; G and points; of a, at the end as values */
    double *a;                /* coefficients, of a_bands >= bands */
    int a_bands, tasks, back; /* back: synthesis */
    double *lambda;           /* per band, for the way back */
    double *work;             /* a task's part: envmapi_rings_work */
} envmapi_rings;

/* The next M >= least, a multiple of 4 (so that blocks of 2 ring pairs are whole), for which
   2M = 2^a 3^b. */
static int envmapi_rings_size(int least) {
    int M = least <= 8 ? 8 : (least + 3) / 4 * 4;
    for (;; M += 4) {
        int rest = M;
        while (rest % 2 == 0) rest /= 2;
        while (rest % 3 == 0) rest /= 3;
        if (rest == 1) return M;
    }
}

static void envmapi_rings_tables(envmapi_rings *rings) {
    int M = rings->M, n = 2 * M, H = M / 2;
    double norm = -0.5 * log(4 * ENVMAPI_PI);
    for (int rest = n; rest > 1;) {
        int r = rest % 4 == 0 ? 4 : rest % 2 == 0 ? 2 : 3;
        rings->radices[rings->stages++] = r;
        rest /= r;
    }
    for (int i = 0; i < n; ++i) {
        int at = 0, f = i, length = n;
        rings->twiddles[2 * i] = cos(ENVMAPI_PI * i / M);
        rings->twiddles[2 * i + 1] = sin(ENVMAPI_PI * i / M);
        for (int s = 0; s < rings->stages; ++s) {
            length /= rings->radices[s];
            at += f % rings->radices[s] * length, f /= rings->radices[s];
        }
        rings->reversed[i] = at;
    }
    for (int m = 0; m < rings->bands; ++m) {
        double c = cos(ENVMAPI_PI * m / M);
        rings->response[m] = 120 / (64 + 52 * c + 4 * c * c);
        if (m) norm += 0.5 * log((2 * m + 1.0) / (2 * m));
        rings->norms[m] = norm;
    }
    for (int j = 0; j < H; ++j) {
        double theta = (j + 0.5) * ENVMAPI_PI / M;
        rings->x[j] = cos(theta), rings->log_sin[j] = log(sin(theta));
    }
    for (int i = 0; i < 4; ++i)
        envmapi_spline_factor(rings->factors + i * (H + 2), H, i & 2 ? -1 : 1, i & 1 ? -1 : 1);
}

/* Each has room of its own. More rooms than fit into a processor's cache cost more than tasks that
   end unevenly (speed only, at 16: 1.04 x for Phong 2000 on two threads). */
static int envmapi_rings_tasks(const envmap_work *work) { return work->executor.run ? 12 : 1; }

/* What a task of these needs: the FFT's block, or the tables and F of one m. */
static size_t envmapi_rings_work(int M) { return 36 * (size_t)M + 256; }

/* Coefficients of one m begin at [envmapi_triangle(m)], l = m .. bands-1, 8 numbers each: the real
   parts of RGB and solid angle, then the imaginary ones. */
static size_t envmapi_triangle(int bands, int m) {
    return 4 * (size_t)m * (size_t)(2 * bands - m + 1);
}

/* Rings for `count` points. room: how many they may be later, if a_lm are needed only until then,
   as they are in the place of values; else 0. done: whose work is done, or NULL: its memory is used
   where it is enough. All is in one block: glibc's malloc gives back the heap's end after a call in
   which no block is half of all, and the next has it mapped anew. */
static envmap_result envmapi_rings_create(envmapi_rings *rings, int M, int bands, size_t count,
                                          size_t room, int tasks, const envmapi_rings *done,
                                          envmapi_pool *pool) {
    size_t n = 2 * (size_t)M, H = (size_t)M / 2, L = (size_t)bands;
    memset(rings, 0, sizeof *rings);
    rings->M = M, rings->bands = bands, rings->tasks = tasks, rings->row = 4 * ((size_t)M + 6);
    size_t tables = 4 * n + 2 * L + 14 * H + 24, work = envmapi_rings_work(M) * (size_t)tasks;
    rings->pairs = (H + 7) / 8 * 8;
    size_t grid = (n + 6) * rings->row / 2, many = room > count ? room : count, own;
    size_t a = room ? envmapi_triangle(bands, bands) : done ? done->lone : 0;
    rings->begin = grid + many;
    if (done && !a && done->begin > rings->begin) rings->begin = done->begin; /* its points stay */
    own = rings->room = (rings->begin + (2 * many > a ? 2 * many : a) + 7) / 8 * 8;
    if (done && done->room >= own) own = 0, rings->room = done->room;
    size_t points = own || a ? 0 : count;
    double *block = (double *)envmapi_pool_get(pool, own + tables + work + (n + 1) / 2 + points,
                                               sizeof(double));
    if (!block) return ENVMAP_ERROR_MEMORY;
    double *G = own ? block : (double *)(void *)done->G, *end = G + rings->room;
    rings->G = (float *)G, rings->values = (float *)(end - 2 * count), rings->lone = a;
    if (a) rings->a = end - a, rings->a_bands = bands;
    rings->units = block + own, rings->twiddles = rings->units + 2 * n;
    rings->response = rings->twiddles + 2 * n;
    rings->norms = rings->response + L, rings->x = rings->norms + L;
    rings->log_sin = rings->x + H, rings->factors = (double(*)[3])(rings->log_sin + H);
    rings->work = rings->units + tables, rings->reversed = (int *)(rings->work + work);
    rings->points =
        (envmapi_point *)(points ? rings->units + tables + work + (n + 1) / 2 : G + grid);
    envmapi_rings_tables(rings);
    return ENVMAP_OK;
}

/* Channels of ring j, -3 .. M+2, at point k, -3 .. 2M+2. */
ENVMAPI_INLINE float *envmapi_ring(const envmapi_rings *rings, int k, int j) {
    return rings->G + (size_t)(k + 3) * rings->row + 4 * (size_t)(j + 3);
}

/* The polar axis is z; n <= 64 directions d[0..2][] of any length. */
static void envmapi_points_of(envmapi_point *points, double d[3][ENVMAPI_CHUNK], int n) {
    double scale = 2147483648.0 / ENVMAPI_PI, phi[ENVMAPI_CHUNK], theta[ENVMAPI_CHUNK];
    double across[ENVMAPI_CHUNK], length[ENVMAPI_CHUNK];
    for (int i = n; i < ENVMAPI_CHUNK; ++i) d[0][i] = d[1][i] = d[2][i] = 1;
    envmapi_polar(phi, across, d[1], d[0]);
    envmapi_polar(theta, length, across, d[2]);
    for (int i = 0; i < n; ++i) {
        double south = 2 * scale * theta[i] + 0.5;
        points[i].phi = (uint32_t)(int64_t)(scale * phi[i] + 4294967296.5);
        points[i].theta = (uint32_t)(south < 4294967295.0 ? south : 4294967295.0);
    }
}

/* Of n points: a loop of its own, as they are wanted in memory. */
static void envmapi_spots(envmapi_spot *spots, const envmapi_rings *rings,
                          const envmapi_point *points, size_t n) {
    for (size_t i = 0; i < n; ++i) {
        uint64_t k = (uint64_t)points[i].phi * (uint64_t)(2 * rings->M);
        uint64_t j = (uint64_t)points[i].theta * (uint64_t)rings->M + 0x80000000u;
        spots[i].k = (int)(k >> 32), spots[i].j = (int)(j >> 32) - 1;
        spots[i].f_k = (float)(int)((uint32_t)k >> 8) * 5.9604645e-8f; /* 2^-24 */
        spots[i].f_j = (float)(int)((uint32_t)j >> 8) * 5.9604645e-8f;
    }
}

static int envmapi_wrap(int k, int n) { return k < 0 ? k + n : k >= n ? k - n : k; }

/* Adjoint of the next: G += the points' values [count][4], rows from .. to-1 only, so that tasks
   can share the work. */
static void envmapi_rings_spread(envmapi_rings *rings, const envmapi_point *points,
                                 const float *values, size_t count, int from, int to) {
    uint64_t n = 2 * (uint64_t)rings->M, f = from > 3 ? (uint64_t)from - 3 : 0;
    uint64_t t = (uint64_t)to + 2; /* a point at phi concerns rows phi n / 2^32 - 2 .. + 3 */
    uint32_t low = (uint32_t)(((f << 32) + n - 1) / n);
    uint32_t high = t < n ? (uint32_t)(((t << 32) + n - 1) / n - 1) : 0xffffffffu;
    for (size_t done = 0; done < count; done += 64, points += 64, values += 256) {
        size_t many = count - done < 64 ? count - done : 64, found = 0, list[65];
        uint32_t any = 0;
        envmapi_point here[65];
        envmapi_spot spots[64];
        for (size_t i = 0; i < many; ++i) any |= points[i].phi - low <= high - low;
        if (!any) continue;
        for (size_t i = 0; i < 64; ++i) {
            /* every eighth, as what the last one changed cannot be read at once */
            size_t next = i % 8 * 8 + i / 8;
            if (next >= many) continue;
            here[found] = points[next], list[found] = next; /* no branch: half are taken */
            found += points[next].phi - low <= high - low;
        }
        envmapi_spots(spots, rings, here, found);
        for (size_t i = 0; i < found; ++i) {
            const envmapi_spot *p = spots + i;
            const float *value = values + 4 * list[i];
            int first = p->k - 2, a = first < from ? from - first : 0, end = to - first;
            envmapi_float4 two[2];
            envmapi_float16 four; /* of six samples down the rings, and the other two */
            float w[16], *ring = envmapi_ring(rings, first + a, p->j - 2);
            envmapi_splines(w, p->f_k, p->f_j);
            envmapi_splines_four(&four, w, p->f_j, value);
            memset(two, 0, sizeof two);
            envmapi_float4_add(two, w[12], envmapi_float4_at(value));
            envmapi_float4_add(two + 1, w[13], envmapi_float4_at(value));
            for (; a < (end < 6 ? end : 6); ++a, ring += rings->row) {
                envmapi_float16_add(envmapi_float16_at(ring), w[a], &four);
                envmapi_float4_add(envmapi_float4_at(ring + 16), w[a], two);
                envmapi_float4_add(envmapi_float4_at(ring + 20), w[a], two + 1);
            }
        }
    }
}

static void envmapi_rings_interpolate(const envmapi_rings *rings, const envmapi_point *points,
                                      float *values, size_t count) {
    envmapi_spot spots[64], *p = spots;
    for (size_t i = 0; i < count; ++i, ++p) {
        size_t n = count - i < 64 ? count - i : 64;
        if (i % 64 == 0) envmapi_spots(p = spots, rings, points + i, n);
        envmapi_float16 four; /* of six samples down the rings, and the other two */
        envmapi_float4 sums[6], sum;
        float w[16];
        const float *ring = envmapi_ring(rings, p->k - 2, p->j - 2);
        envmapi_splines(w, p->f_k, p->f_j);
        memset(&four, 0, sizeof four), memset(sums, 0, sizeof sums), memset(&sum, 0, sizeof sum);
        for (int a = 0; a < 6; ++a, ring += rings->row) {
            envmapi_float16_add(&four, w[a], envmapi_float16_at(ring));
            envmapi_float4_add(sums + 4, w[a], envmapi_float4_at(ring + 16));
            envmapi_float4_add(sums + 5, w[a], envmapi_float4_at(ring + 20));
        }
        memcpy(sums, &four, sizeof four);
        ENVMAPI_UNROLL for (int b = 0; b < 6; ++b) envmapi_float4_add(&sum, w[8 + b], sums + b);
        *envmapi_float4_at(values + 4 * i) = sum;
    }
}

/* n numbers beyond an end are others inside: added to these (fold), or copied from there. */
static void envmapi_fold(float *inside, float *beyond, size_t n, int fold) {
    for (size_t i = 0; i < n; ++i) {
        if (fold) inside[i] += beyond[i], beyond[i] = 0;
        else beyond[i] = inside[i];
    }
}

/* Samples beyond the seam are those a whole turn on. */
static void envmapi_rings_seam(envmapi_rings *rings, int fold) {
    for (int k = -3, n = 2 * rings->M; k < 3; ++k)
        envmapi_fold(envmapi_ring(rings, k < 0 ? n + k : k, -3),
                     envmapi_ring(rings, k < 0 ? k : n + k, -3), rings->row, fold);
}

/* Rings beyond a pole are the first ones half a turn on. */
static void envmapi_rings_close(envmapi_rings *rings, int fold) {
    int M = rings->M;
    if (fold) envmapi_rings_seam(rings, fold);
    for (int i = 0; i < 12 * M; ++i) {
        int k = i / 6, j = i % 3, south = i % 6 > 2;
        envmapi_fold(envmapi_ring(rings, envmapi_wrap(k + M, 2 * M), south ? M - 1 - j : j),
                     envmapi_ring(rings, k, south ? M + j : -1 - j), 4, fold);
    }
    if (!fold) envmapi_rings_seam(rings, fold);
}

/* ---- FFT along the rings */

#define ENVMAPI_BLOCK 8 /* doubles that one FFT carries along: 2 rings */

ENVMAPI_INLINE void envmapi_twiddle(double *re, double *im, double c, double s) {
    for (int v = 0; v < ENVMAPI_BLOCK; ++v) {
        double a = re[v], b = im[v];
        re[v] = a * c - b * s, im[v] = a * s + b * c;
    }
}

/* The DFT of r = 2, 3 or 4 rows in place, e^(sign 2 pi i pq/r). */
ENVMAPI_INLINE void envmapi_dft(double re[4][ENVMAPI_BLOCK], double im[4][ENVMAPI_BLOCK], int r,
                                double sign) {
    for (int v = 0; v < ENVMAPI_BLOCK; ++v) {
        double a = re[0][v], b = im[0][v], c = re[1][v], d = im[1][v];
        if (r == 2) {
            re[0][v] = a + c, im[0][v] = b + d, re[1][v] = a - c, im[1][v] = b - d;
        } else if (r == 3) {
            double p = c + re[2][v], q = d + im[2][v], half = sign * 0.86602540378443865;
            double x = (c - re[2][v]) * half, y = (d - im[2][v]) * half;
            re[0][v] = a + p, im[0][v] = b + q;
            re[1][v] = a - p / 2 - y, im[1][v] = b - q / 2 + x;
            re[2][v] = a - p / 2 + y, im[2][v] = b - q / 2 - x;
        } else {
            double e = re[2][v], f = im[2][v], g = re[3][v], h = im[3][v];
            double x = sign * (c - g), y = sign * (d - h);
            re[0][v] = a + e + (c + g), im[0][v] = b + f + (d + h);
            re[1][v] = a - e - y, im[1][v] = b - f + x;
            re[2][v] = a + e - (c + g), im[2][v] = b + f - (d + h);
            re[3][v] = a - e + y, im[3][v] = b - f - x;
        }
    }
}

/* One butterfly of r rows `apart`; twiddle factors stand after it on the way out, before it on the
   way back, so that one undoes the other. A row: the real parts, then the imaginary ones. */
ENVMAPI_INLINE void envmapi_butterfly(double *z, size_t apart, int r, const double *twiddles,
                                      int at, int sign) {
    double x[4][ENVMAPI_BLOCK], y[4][ENVMAPI_BLOCK];
    for (int q = 0; q < r; ++q) {
        const double *w = twiddles + 2 * q * at;
        memcpy(x[q], z + (size_t)q * apart, sizeof x[q]);
        memcpy(y[q], z + (size_t)q * apart + ENVMAPI_BLOCK, sizeof y[q]);
        if (sign > 0 && q && at) envmapi_twiddle(x[q], y[q], w[0], w[1]);
    }
    envmapi_dft(x, y, r, sign);
    for (int q = 0; q < r; ++q) {
        const double *w = twiddles + 2 * q * at;
        if (sign < 0 && q && at) envmapi_twiddle(x[q], y[q], w[0], -w[1]);
        memcpy(z + (size_t)q * apart, x[q], sizeof x[q]);
        memcpy(z + (size_t)q * apart + ENVMAPI_BLOCK, y[q], sizeof y[q]);
    }
}

/* One stage of the FFT below, of a radix that is known when this is compiled. */
ENVMAPI_INLINE void envmapi_fft_stage(double *z, int n, int length, int r, const double *twiddles,
                                      int sign) {
    size_t row = 2 * ENVMAPI_BLOCK, apart = (size_t)(length / r) * row;
    for (int start = 0; start < n; start += length)
        for (int j = 0; j < length / r; ++j)
            envmapi_butterfly(z + (size_t)(start + j) * row, apart, r, twiddles, j * (n / length),
                              sign);
}

/* 2M rows of z in place: out (sign -1) frequency m ends at reversed[m]; back (sign 1) it starts
   there. */
static void envmapi_fft(const envmapi_rings *rings, double *z, int sign) {
    int n = 2 * rings->M, length = sign < 0 ? n : 1;
    for (int i = 0; i < rings->stages; ++i) {
        int r = rings->radices[sign < 0 ? i : rings->stages - 1 - i];
        if (sign > 0) length *= r;
        if (r == 4) envmapi_fft_stage(z, n, length, 4, rings->twiddles, sign);
        else if (r == 3) envmapi_fft_stage(z, n, length, 3, rings->twiddles, sign);
        else envmapi_fft_stage(z, n, length, 2, rings->twiddles, sign);
        if (sign < 0) length /= r;
    }
}

/* Four numbers at a place of G, and four that are `apart` from these, in integers. */
ENVMAPI_INLINE void envmapi_whole_get(double x[8], const float *a, size_t apart) {
    int32_t whole[8];
    memcpy(whole, a, 16), memcpy(whole + 4, a + apart, 16);
    for (int i = 0; i < 8; ++i) x[i] = whole[i];
}

/* Beside 1.5 2^52 the last bits of a double are a whole number, and of NaN anything. */
ENVMAPI_INLINE void envmapi_whole_put(float *a, size_t apart, const double x[8]) {
    uint64_t bits[8];
    uint32_t whole[8];
    double beside[8];
    for (int i = 0; i < 8; ++i) beside[i] = x[i] + 6755399441055744.0;
    memcpy(bits, beside, sizeof bits);
    for (int i = 0; i < 8; ++i) whole[i] = (uint32_t)bits[i];
    memcpy(a, whole, 16), memcpy(a + apart, whole + 4, 16);
}

/* What numbers up to `most` are counted in, and one over that; 0 where they are no floats'. */
static double envmapi_whole_unit(double *unit, double most) {
    *unit = most / 2147483000.0;
    return most > 1e-250 && most < 1e250 ? 2147483000.0 / most : 0;
}

/* Rings 2b, 2b+1 (real parts of z) and M-2-2b, M-1-2b (imaginary ones) of block b -> F_m. */
static void envmapi_rings_unpack(const envmapi_rings *rings, int block, const double *z) {
    int n = 2 * rings->M, north = 8 * block, south = 4 * rings->M - 8 - north;
    double half[16], *units[2] = {rings->units + north, rings->units + south};
    for (int i = 0; i < 16; ++i)
        half[i] = envmapi_whole_unit(units[i / 8] + i % 8, units[i / 8][i % 8]) / 2;
    for (int m = 0; m < rings->bands; ++m) {
        const double *p = z + 2 * ENVMAPI_BLOCK * (size_t)rings->reversed[m];
        const double *q = z + 2 * ENVMAPI_BLOCK * (size_t)rings->reversed[(n - m) % n];
        float *re = envmapi_ring(rings, 2 * m, 0), *im = re + rings->row;
        double n_re[8], n_im[8], s_re[8], s_im[8];
        for (int i = 0; i < 8; ++i) {
            n_re[i] = (p[i] + q[i]) * half[i], n_im[i] = (p[8 + i] - q[8 + i]) * half[i];
            s_re[i] = (p[8 + i] + q[8 + i]) * half[8 + i], s_im[i] = (q[i] - p[i]) * half[8 + i];
        }
        envmapi_whole_put(re + north, 4, n_re), envmapi_whole_put(re + south, 4, s_re);
        envmapi_whole_put(im + north, 4, n_im), envmapi_whole_put(im + south, 4, s_im);
    }
}

static void envmapi_rings_pack(const envmapi_rings *rings, int block, double *z) {
    int n = 2 * rings->M, north = 8 * block, south = 4 * rings->M - 8 - north;
    memset(z, 0, (size_t)n * 2 * ENVMAPI_BLOCK * sizeof(double));
    for (int m = rings->bands - 1; m >= 0; --m) {
        double *p = z + 2 * ENVMAPI_BLOCK * (size_t)rings->reversed[m];
        double *q = z + 2 * ENVMAPI_BLOCK * (size_t)rings->reversed[(n - m) % n];
        const float *re = envmapi_ring(rings, 2 * m, 0), *im = re + rings->row;
        double n_re[8], n_im[8], s_re[8], s_im[8], w[8];
        for (int i = 0; i < 8; ++i) w[i] = rings->units[4 * m + i % 4] * rings->response[m];
        envmapi_whole_get(n_re, re + north, 4), envmapi_whole_get(n_im, im + north, 4);
        envmapi_whole_get(s_re, re + south, 4), envmapi_whole_get(s_im, im + south, 4);
        for (size_t k = 7; m > 3 && k < 9; ++k)
            ENVMAPI_PREFETCH(re - k * rings->row + north),
                ENVMAPI_PREFETCH(re - k * rings->row + south);
        for (int i = 0; i < 8; ++i) { /* p = N + i S, q = conj N + i conj S */
            q[i] = (n_re[i] + s_im[i]) * w[i], q[8 + i] = (s_re[i] - n_im[i]) * w[i];
            p[i] = m ? (n_re[i] - s_im[i]) * w[i] : n_re[i] * w[i];
            p[8 + i] = m ? (s_re[i] + n_im[i]) * w[i] : s_re[i] * w[i];
        }
    }
}

/* z between a block's rings and the FFT; on the way out also the sums of |z|, which no F_m
   exceeds. */
static void envmapi_rings_block(const envmapi_rings *rings, int block, double *z, int out) {
    int north = 2 * block, south = rings->M - 2 - north;
    double sums[2 * ENVMAPI_BLOCK] = {0};
    for (int k = 0; k < 2 * rings->M; ++k, z += 2 * ENVMAPI_BLOCK) {
        float *a = envmapi_ring(rings, k, north), *b = envmapi_ring(rings, k, south);
        ENVMAPI_PREFETCH(a + 8 * rings->row), ENVMAPI_PREFETCH(b + 8 * rings->row);
        for (int i = 0; i < ENVMAPI_BLOCK && out; ++i)
            a[i] = (float)z[i], b[i] = (float)z[ENVMAPI_BLOCK + i];
        for (int i = 0; i < ENVMAPI_BLOCK && !out; ++i)
            z[i] = (double)a[i], z[ENVMAPI_BLOCK + i] = (double)b[i];
        for (int i = 0; i < 2 * ENVMAPI_BLOCK && !out; ++i) sums[i] += fabs(z[i]);
    }
    if (out) return;
    memcpy(rings->units + 4 * north, sums, sizeof sums / 2);
    memcpy(rings->units + 4 * south, sums + ENVMAPI_BLOCK, sizeof sums / 2);
}

/* ---- Legendre functions along the meridian */

/* A and B of P_l = A_l x P_(l-1) - B_l P_(l-2), A_l = sqrt((4l^2-1)/(l^2-m^2)), B_l = A_l/A_(l-1),
   for l = m+1 .. bands; P_(m-1) is 0. */
static void envmapi_legendre_factors(double *A, double *B, int m, int bands) {
    for (int l = m + 1; l <= bands; ++l) {
        double ll = (double)l * l, square = (4 * ll - 1) / (ll - (double)m * m);
        A[l] = square * envmapi_inverse_root(square);
    }
    A[m] = 1;
    for (int l = m + 1; l <= bands; ++l) B[l] = A[l] / A[l - 1];
}

/* P_(l-1), P_(l-2) at 8 points x -> P_l, P_(l-1). */
ENVMAPI_INLINE void envmapi_legendre_step(envmapi_double8 *now, envmapi_double8 *before,
                                          const envmapi_double8 *x, double A, double B) {
    envmapi_double8 ax, next;
    memset(&ax, 0, sizeof ax), memset(&next, 0, sizeof next);
    envmapi_double8_add(&ax, A, x);
    envmapi_double8_add(&next, -B, before);
    envmapi_double8_mad(&next, &ax, now);
    *before = *now, *now = next;
}

/* P_lm of 2 blocks of 8 rings for l = m .. bands-1, which hide each other's latency: [block][l][8].
   sin^m begins as its logarithm: where it underflows, below e^-700, P stays negligible up to
   l ~ 1000. skip: of each block how many l, an even number, are below 1e-14 on all 8 rings, or -1
   when all are: less than the rounding of what is summed. Up to there P grows with l and towards
   the equator.  Test: skipped_legendre_functions_are_negligible. */
static void envmapi_legendre(double *P, int skip[2], const envmapi_rings *rings, int m, int first,
                             const double *A, const double *B) {
    int H = rings->M / 2, last = H - 1 - first, next = 8 * (rings->bands - m);
    int at[2] = {last < 7 ? last : 7, next + (last < 8 ? 0 : last < 15 ? last - 8 : 7)};
    double x[16], start[16];
    envmapi_double8 before[2], now[2];
    for (int b = 0; b < 16; ++b) {
        int j = b < last ? first + b : H - 1;
        double logarithm = rings->norms[m] + m * rings->log_sin[j];
        start[b] = logarithm > -700 && b <= last ? exp(logarithm) : 0;
        x[b] = rings->x[j];
    }
    memcpy(now, start, sizeof now), memset(before, 0, sizeof before);
    int count = start[last < 15 ? last : 15] > 0 ? rings->bands - m : 0;
    for (int l = 0; l < count; ++l)
        ENVMAPI_UNROLL for (int i = 0; i < 2; ++i) {
            *envmapi_double8_at(P + 8 * l + i * next) = now[i];
            envmapi_legendre_step(now + i, before + i, envmapi_double8_at(x + 8 * i),
                                  A[m + l + 1], B[m + l + 1]);
        }
    for (int i = 0; i < 2; ++i) {
        int l = 0;
        for (int step = 16; step; step /= 4) /* 16, 4, 1 */
            while (l + step <= count && !(fabs(P[8 * (l + step - 1) + at[i]]) > 1e-14)) l += step;
        skip[i] = l < count ? l & ~1 : -1;
    }
}

/* Solves down the rings of one m, e and o apart: the equator mirrors c as +-c, the pole as
   (-1)^m c. */
static void envmapi_rings_solve(const envmapi_rings *rings, double *f, int m) {
    int H = rings->M / 2;
    envmapi_double8_solve(f, H, 16, 2, 8, rings->factors + 2 * (m & 1) * (H + 2), H + 2);
}

/* F [pairs][16]: e re, e im, o re, o im, of north +- south. */
static void envmapi_rings_column(const envmapi_rings *rings, double *F, int m) {
    int H = rings->M / 2;
    memset(F + 16 * H, 0, 16 * (rings->pairs - (size_t)H) * sizeof(double));
    for (int j = 0; j < H; ++j, F += 16) {
        const double *n = rings->units + 4 * j, *s = rings->units + 4 * (rings->M - 1 - j);
        double north[8], south[8], w = rings->response[m];
        envmapi_whole_get(north, envmapi_ring(rings, 2 * m, j), rings->row);
        envmapi_whole_get(south, envmapi_ring(rings, 2 * m, rings->M - 1 - j), rings->row);
        for (int i = 0; i < 8; ++i) north[i] *= n[i % 4] * w, south[i] *= s[i % 4] * w;
        for (int i = 0; i < 8; ++i) F[i] = north[i] + south[i], F[8 + i] = north[i] - south[i];
    }
}

/* Back. Where one number is not finite, none of a solved column are: the units tell. */
static void envmapi_rings_column_back(const envmapi_rings *rings, const double *F, int m) {
    double most[8] = {0}, w[8];
    for (const double *f = F; f < F + 8 * rings->M; f += 16)
        for (int i = 0; i < 8; ++i) {
            double sum = fabs(f[i]) + fabs(f[8 + i]);
            most[i] = sum <= most[i] ? most[i] : sum;
        }
    for (int i = 0; i < 4; ++i) {
        double larger = most[i] > most[i + 4] ? most[i] : most[i + 4], all = most[i] + most[i + 4];
        w[i] = w[i + 4] = envmapi_whole_unit(rings->units + 4 * m + i, all < 1e250 ? larger : all);
    }
    for (int j = 0; j < rings->M / 2; ++j, F += 16) {
        double north[8], south[8];
        for (int i = 0; i < 8; ++i)
            north[i] = (F[i] + F[8 + i]) * w[i], south[i] = (F[i] - F[8 + i]) * w[i];
        envmapi_whole_put(envmapi_ring(rings, 2 * m, j), rings->row, north);
        envmapi_whole_put(envmapi_ring(rings, 2 * m, rings->M - 1 - j), rings->row, south);
    }
}

/* a[l] = sum_j P_l(j) F(j): even l - m see e, odd ones o. */
static void envmapi_legendre_analyse(const envmapi_rings *rings, double *a, int m, double *work) {
    int H = rings->M / 2, count = rings->bands - m;
    double *F = work, *A = F + 16 * rings->pairs, *B = A + rings->bands + 1;
    double *P = B + rings->bands + 1;
    envmapi_legendre_factors(A, B, m, rings->bands);
    envmapi_rings_column(rings, F, m);
    envmapi_rings_solve(rings, F, m);
    memset(a, 0, (size_t)count * 8 * sizeof(double));
    for (int first = 0, skip[2]; first < H; first += 8, P += first & 8 ? 8 * count : -8 * count) {
        if (!(first & 8)) envmapi_legendre(P, skip, rings, m, first, A, B);
        envmapi_double8 f[16];
        memcpy(f, F + 16 * first, sizeof f);
        for (int l = skip[first >> 3 & 1]; l >= 0 && l < count; l += 2) {
            envmapi_double8 even = *envmapi_double8_at(a + 8 * l), odd;
            const double *p = P + 8 * l, *q = l + 1 < count ? p + 8 : p;
            memset(&odd, 0, sizeof odd);
            ENVMAPI_UNROLL for (int b = 0; b < 8; ++b) {
                envmapi_double8_add(&even, p[b], f + 2 * b);
                envmapi_double8_add(&odd, q[b], f + 2 * b + 1);
            }
            *envmapi_double8_at(a + 8 * l) = even;
            if (l + 1 < count) envmapi_double8_add(envmapi_double8_at(a + 8 * l + 8), 1, &odd);
        }
    }
}

/* f(j) = sum_l a[l] P_l(j), l = from, from + 2, ..., for so many rings as fit into registers. */
enum { ENVMAPI_SUMS = ENVMAPI_REGISTER == 64 ? 8 : 4 };
ENVMAPI_INLINE void envmapi_legendre_sums(double *f, const double *a, const double *P, int from,
                                          int count) {
    envmapi_double8 sum[ENVMAPI_SUMS];
    memset(sum, 0, sizeof sum);
    for (int l = from; l < count; l += 2)
        ENVMAPI_UNROLL for (int b = 0; b < ENVMAPI_SUMS; ++b)
            envmapi_double8_add(sum + b, P[8 * l + b], envmapi_double8_at(a + 8 * l));
    for (int b = 0; b < ENVMAPI_SUMS; ++b) *envmapi_double8_at(f + 16 * b) = sum[b];
}

/* F(j) = sum_l lambda_l a[l] P_l(j). */
static void envmapi_legendre_synthesise(const envmapi_rings *rings, const double *a,
                                        const double *lambda, int m, double *work) {
    int H = rings->M / 2, count = rings->bands - m;
    double *F = work, *A = F + 16 * rings->pairs, *B = A + rings->bands + 1;
    double *P = B + rings->bands + 1, *scaled = P + 16 * rings->bands;
    envmapi_legendre_factors(A, B, m, rings->bands);
    for (int i = 0; i < 8 * count; ++i) scaled[i] = lambda[m + i / 8] * a[i];
    for (int first = 0, skip[2]; first < H; first += 8, P += first & 8 ? 8 * count : -8 * count) {
        if (!(first & 8)) envmapi_legendre(P, skip, rings, m, first, A, B);
        int l = skip[first >> 3 & 1];
        for (int b = 0; b < 8; b += ENVMAPI_SUMS)
            for (int odd = 0; odd < 2; ++odd) /* even and odd l - m */
                envmapi_legendre_sums(F + 16 * (first + b) + 8 * odd, scaled, P + b,
                                      l < 0 ? count : l + odd, count);
    }
    envmapi_rings_solve(rings, F, m);
    envmapi_rings_column_back(rings, F, m);
}

/* ---- as tasks, each a part that the data alone defines */

/* How many tasks spread, each to a range of k on all rings: a power of two, each range 24 wide or
   more, as points within 5 of a border are spread by both its tasks. */
static int envmapi_spread_tasks(const envmapi_rings *r) {
    int tasks = 1;
    while (2 * tasks <= r->tasks && 48 * tasks <= 2 * r->M) tasks *= 2;
    return tasks;
}

static void envmapi_task_spread(void *context, int task) {
    envmapi_rings *r = (envmapi_rings *)context;
    int n = 2 * r->M, tasks = envmapi_spread_tasks(r);
    int from = task ? n * task / tasks : -3;
    int to = task + 1 < tasks ? n * (task + 1) / tasks : n + 3;
    memset(envmapi_ring(r, from, -3), 0, (size_t)(to - from) * r->row * sizeof(float));
    envmapi_rings_spread(r, r->points, r->values, r->count, from, to);
}

static void envmapi_task_interpolate(void *context, int task) {
    const envmapi_rings *r = (const envmapi_rings *)context;
    size_t from = r->count * (size_t)task / (size_t)r->tasks;
    size_t to = r->count * ((size_t)task + 1) / (size_t)r->tasks;
    envmapi_rings_interpolate(r, r->points + from, r->values + 4 * from, to - from);
}

static void envmapi_task_fft(void *context, int task) {
    envmapi_rings *r = (envmapi_rings *)context;
    double *z = r->work + (size_t)task * envmapi_rings_work(r->M);
    int blocks = r->M / 4, end = blocks * (task + 1) / r->tasks;
    for (int block = blocks * task / r->tasks; block < end; ++block) {
        if (r->back) envmapi_rings_pack(r, block, z);
        else envmapi_rings_block(r, block, z, 0);
        envmapi_fft(r, z, r->back ? 1 : -1);
        if (r->back) envmapi_rings_block(r, block, z, 1);
        else envmapi_rings_unpack(r, block, z);
    }
}

static void envmapi_task_legendre(void *context, int task) {
    envmapi_rings *r = (envmapi_rings *)context;
    double *work = r->work + (size_t)task * envmapi_rings_work(r->M);
    for (int m = task; m < r->bands; m += r->tasks) {
        double *a = r->a + envmapi_triangle(r->a_bands, m);
        if (r->back) envmapi_legendre_synthesise(r, a, r->lambda, m, work);
        else envmapi_legendre_analyse(r, a, m, work);
    }
}

/* points, values -> a */
static void envmapi_analyse(envmapi_rings *r, const envmap_work *work) {
    r->back = 0;
    envmapi_run_all(work, envmapi_task_spread, r, envmapi_spread_tasks(r));
    envmapi_rings_close(r, 1);
    envmapi_run_all(work, envmapi_task_fft, r, r->tasks);
    envmapi_run_all(work, envmapi_task_legendre, r, r->tasks);
}

/* a, lambda -> values at points */
static void envmapi_synthesise(envmapi_rings *r, const envmap_work *work) {
    r->back = 1;
    envmapi_run_all(work, envmapi_task_legendre, r, r->tasks);
    envmapi_run_all(work, envmapi_task_fft, r, r->tasks);
    envmapi_rings_close(r, 0);
    envmapi_run_all(work, envmapi_task_interpolate, r, r->tasks);
}

/* ----------------------------------------------------------------------------------- >>lights --
   Texels that are summed by themselves, for every axis: L(a) = sum_i k(a.d_i) E_i.
     in     lights i, E_i = L_i w_i from d_i, a lobe, its p       out    RGB along eight axes
   Lights of one place and colour are a cluster. Its sum at its centroid stands for all of them
   where none of the eight axes sees a kink of the lobe in it; a cluster beyond the lobe's support
   from all eight is passed over.
       which lights are a cluster             envmapi_lights_group
       the lobe's support and kinks at p      envmapi_lights_aim
       what eight axes get                    envmapi_lit_all, by _add, 64 values of k at a time
   Over a disc of radius rho the mean of k is off by rho^2/8 of its Laplacian, 2 k/sigma^2 at the
   peak: for rho = 1.5 sigma sqrt(tolerance) half of the tolerance. Only lobes with kinks have
   clusters: others need few bands, and have no lights apart. Diffuse, GGX and Banks fall to 0 in a
   straight line; x^N, 1 < N < 4, curves by more than itself there, N (N - 1) / x^2, so its clusters
   are opened that much farther from the horizon. At the angle theta GGX has a Laplacian of
   16 k/theta^2 at most: theta/3 does for sigma there.
   Used by >>transform and >>fast.  Source: ours.
   Tests: tests/test_fast.c; a_cluster_of_lights_is_its_texels, also of the constants. */

#define ENVMAPI_CLUSTER    1.5  /* times sigma sqrt(tolerance): how far from the first light */
#define ENVMAPI_CURVED     0.25 /* times sigma sqrt(N (N - 1)): x^N is open so near its horizon */
#define ENVMAPI_ONE_COLOUR 0.05 /* of a light's RGB: its channels' centroids are one to rho/20 */

typedef struct envmapi_light {
    size_t texel;
    double d[3], value[4]; /* RGB times solid angle, solid angle */
} envmapi_light;

/* Some of the lights, side by side, and their sum at their centroid. */
typedef struct envmapi_cluster {
    envmapi_light sum;
    int first, count;
    double beyond[2]; /* cosine and sine of the angle from which the sum does */
} envmapi_cluster;

typedef struct envmapi_lights {
    const envmapi_light *all; /* as they were found */
    int count, clustered, kinks;
    envmapi_light *sorted;       /* cluster by cluster */
    envmapi_cluster *clusters;   /* [clustered] */
    double rho[2], angles[4][2]; /* cosine and sine: of rho; of the support's ends, of kinks */
    const envmap_lobe *lobe;
    double p, reach; /* reach: of a tail, whose whole is the lobe; or 0 */
} envmapi_lights;

static double envmapi_light_energy(const envmapi_light *light) {
    return light->value[0] + light->value[1] + light->value[2];
}

static double envmapi_light_square(const envmapi_light *light) {
    const double *v = light->value;
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

static int envmapi_light_joins(const envmapi_light *light, const envmapi_light *first,
                               double cosine) {
    double energy = envmapi_light_energy(light), ratio = energy / envmapi_light_energy(first);
    for (int c = 0; c < 3; ++c)
        if (fabs(light->value[c] - ratio * first->value[c]) > ENVMAPI_ONE_COLOUR * energy) return 0;
    return envmapi_dot(light->d, first->d) >= cosine;
}

/* Clusters for a lobe of this sigma: lights that join the first one of theirs are put beside it. */
static envmap_result envmapi_lights_group(envmapi_lights *l, const envmap_lobe *lobe, double sigma,
                                          double tolerance, envmapi_pool *pool) {
    double N = lobe->kind == ENVMAP_LOBE_PHONG ? (double)lobe->parameter : 0;
    int ggx = lobe->kind == ENVMAP_LOBE_GGX, power = N >= 1 && N < 4;
    int clusters = ggx || lobe->kind == ENVMAP_LOBE_BANKS || power;
    double part = ENVMAPI_CLUSTER * sqrt(tolerance), least = clusters ? part * sigma : 0;
    double rho = ggx ? fmax(least, part / 2) : least;
    double margin = power ? fmax(rho, ENVMAPI_CURVED * sqrt(N * (N - 1)) * sigma) : rho;
    size_t room = (size_t)l->count + 1;
    l->lobe = lobe, l->clustered = 0, l->rho[0] = cos(margin), l->rho[1] = sin(margin);
    l->sorted = (envmapi_light *)envmapi_pool_get(pool, room, sizeof(envmapi_light));
    l->clusters = (envmapi_cluster *)envmapi_pool_get(pool, room, sizeof(envmapi_cluster));
    if (!l->sorted || !l->clusters) return ENVMAP_ERROR_MEMORY;
    for (int i = 0; i < l->count; ++i) l->sorted[i] = l->all[i];
    for (int first = 0, end; first < l->count; first = end) {
        envmapi_cluster *cluster = l->clusters + l->clustered++;
        double sum[3] = {0, 0, 0};
        memset(cluster, 0, sizeof *cluster);
        for (int i = end = first; i < l->count; ++i) {
            envmapi_light light = l->sorted[i];
            int joins = clusters && envmapi_light_joins(&light, l->sorted + first, cos(rho));
            if (i > first && !joins) continue;
            l->sorted[i] = l->sorted[end], l->sorted[end++] = light;
            for (int c = 0; c < 3; ++c) {
                sum[c] += light.d[c] * envmapi_light_energy(&light);
                cluster->sum.value[c] += light.value[c];
            }
        }
        cluster->first = first, cluster->count = end - first;
        envmapi_unit(cluster->sum.d, sum);
        double radius = 0;
        for (int i = first; i < end; ++i)
            radius = fmax(radius, envmapi_angle(l->sorted[i].d, cluster->sum.d));
        double beyond = radius > least ? fmin(3 * radius / part, ENVMAPI_PI) : 0;
        cluster->beyond[0] = cos(beyond), cluster->beyond[1] = sin(beyond);
    }
    return ENVMAP_OK;
}

/* Makes ready for a slice at p. Without clusters no kink matters. */
static void envmapi_lights_aim(envmapi_lights *l, double p) {
    double angles[2 + ENVMAPI_KINKS];
    l->p = p;
    envmap_lobe_support(angles, angles + 1, l->lobe, p);
    l->kinks = envmapi_lobe_kinks(angles + 2, l->lobe, p);
    if (!(l->rho[1] > 0)) l->kinks = 0;
    for (int j = 0; j < 2 + l->kinks; ++j)
        l->angles[j][0] = cos(angles[j]), l->angles[j][1] = fabs(sin(angles[j]));
}

/* Cosines of an angle less and plus `around`, whose cosine and sine these are; -2, 2 where that is
   beyond pi or 0. */
static void envmapi_cosines(double x[2], const double angle[2], double c, double s) {
    x[0] = angle[1] * c + angle[0] * s <= 0 ? -2 : angle[0] * c - angle[1] * s;
    x[1] = angle[1] * c - angle[0] * s <= 0 ? 2 : angle[0] * c + angle[1] * s;
}

/* Eight axes, and the lights that wait for their k: 64 pairs at a time (speed only). */
#define ENVMAPI_BESIDE 8
typedef struct envmapi_lit {
    double a[3][ENVMAPI_BESIDE], rgb[3][ENVMAPI_BESIDE];
    const envmapi_light *waiting[8];
    int count;
} envmapi_lit;

/* rgb += what the lights that wait send along the axes. */
static void envmapi_lit_add(envmapi_lit *lit, const envmapi_lights *l) {
    double x[8 * ENVMAPI_BESIDE], k[8 * ENVMAPI_BESIDE];
    envmapi_double8 *a = envmapi_double8_at(lit->a[0]), *rgb = envmapi_double8_at(lit->rgb[0]);
    memset(x, 0, sizeof x);
    for (int i = 0; i < lit->count; ++i)
        for (int c = 0; c < 3; ++c)
            envmapi_double8_add(envmapi_double8_at(x) + i, lit->waiting[i]->d[c], a + c);
    envmapi_k_many(k, x, lit->count * ENVMAPI_BESIDE, l->lobe, l->p);
    for (int i = 0; i < lit->count * ENVMAPI_BESIDE && l->reach > 0; ++i)
        if (x[i] > 1 - l->reach * l->reach / 2)
            k[i] *= envmapi_smooth_step(envmapi_acos(x[i]), l->reach / 2, l->reach);
    for (int i = 0; i < lit->count; ++i)
        for (int c = 0; c < 3; ++c)
            envmapi_double8_add(rgb + c, lit->waiting[i]->value[c], envmapi_double8_at(k) + i);
    lit->count = 0;
}

/* The same of all lights, n <= 8 axes seen as one. */
static void envmapi_lit_all(envmapi_lit *lit, int n, const envmapi_lights *l) {
    double d[3] = {lit->a[0][n / 2], lit->a[1][n / 2], lit->a[2][n / 2]}, least = 1, x[4][2];
    for (int i = 0; i < n; ++i)
        least = fmin(least, lit->a[0][i] * d[0] + lit->a[1][i] * d[1] + lit->a[2][i] * d[2]);
    double beside = sqrt(fmax(1 - least * least, 1e-12)); /* sine of the angle to the farthest */
    double c = least * l->rho[0] - beside * l->rho[1], s = beside * l->rho[0] + least * l->rho[1];
    for (int j = 0; j < 2 + l->kinks; ++j)
        envmapi_cosines(x[j], l->angles[j], s > 0 ? c : -1, s > 0 ? s : 0); /* at most pi */
    for (const envmapi_cluster *one = l->clusters; one < l->clusters + l->clustered; ++one) {
        double cosine = envmapi_dot(d, one->sum.d);
        int whole = one->count > 1;
        if (one->beyond[1] > 0)
            whole &= cosine < one->beyond[0] * least - one->beyond[1] * beside;
        if (cosine > x[0][1] || cosine < x[1][0]) continue;
        for (int j = 1; j < 2 + l->kinks; ++j) whole &= cosine < x[j][0] || cosine > x[j][1];
        for (int i = 0; i < (whole ? 1 : one->count); ++i) {
            lit->waiting[lit->count++] = whole ? &one->sum : l->sorted + one->first + i;
            if (lit->count == 8) envmapi_lit_add(lit, l);
        }
    }
    envmapi_lit_add(lit, l);
}

/* -------------------------------------------------------------------------------- >>transform --
   Texels <-> nodes of a grid -> rings: project and fill, the two halves of every fast filter.
     in     a slice of a source, or a_lm and lambda_l       out    a_lm, or a slice of a result
       project   a_lm = sum_i L_i w_i Y_lm(d_i), texels i with solid angles w_i   _project_texels
       fill      L_i = sum_lm lambda_l a_lm Y_lm(d_i)                             _fill_texels
   A grid lies in a face's own (u,v), no finer than the bands, padded past the face's edges: a node
   there is simply a direction, and a point for the rings. Texels go to nodes by the adjoint of
   quintic spline interpolation (_task_reduce), and come from them by interpolation (_task_expand).
   An octahedral map has a grid for each face of the octahedron; sphere and angular maps have none,
   their texels are the points. Texels that a rim cuts are points of their own, and lights are
   summed apart, exactly (_add_lights).
   Used by >>harmonics (envmap_sh_project, envmap_sh_fill) and >>fast.  Tests: tests/test_fast.c,
   tests/test_sh.c. */

/* ---- what is read: a slice of a source */

typedef struct envmapi_input {
    const envmap *map;
    const float *texels; /* of the slice, or of a copy, times 2^-exponent */
    int exponent;
    float *omega; /* [(size+1)/2][4 width]: the solid angles of row y, of size-1-y too, thrice each
                     as RGB has it, then once each; 0 where a rim cuts */
    float *spare; /* what was asked for beside these */
    envmapi_light *rim; /* texels that a rim cuts, at their centroids */
    int rim_count;
} envmapi_input;

/* Solid angles of row y. Cube and paraboloid, 64 and larger: density rho = c (1+q)^-s, q = X^2+Y^2,
   averaged over the texel to fourth order, rho (1 + side^2/24 laplacian(rho)/rho). Octahedral maps:
   rho = |p|^-3, but in texels that a fold cuts; where the horizon halves them, two triangles. */
static void envmapi_task_omega(void *context, int y) {
    const envmapi_input *in = (const envmapi_input *)context;
    int mapping = in->map->mapping, edge = in->map->size, width = envmapi_width(mapping, edge);
    float *omega = in->omega + (size_t)y * 4 * (size_t)width, *once = omega + 3 * width;
    double side = 2.0 / width, Y = (2 * y + 1.0) / edge - 1, area = side * side;
    int cube = mapping == ENVMAP_CUBE,
        smooth = edge >= 64 && (cube || mapping == ENVMAP_PARABOLOID),
        folds = edge >= 64 && mapping == ENVMAP_OCTAHEDRAL;
    double row = mapping == ENVMAP_LATLONG ? envmapi_texel_cell(NULL, mapping, edge, 0, y) : 0;
    for (int x = 0; smooth && x < (width + 1) / 2; ++x) {
        double X = (2 * x + 1.0) * (1.0 / width) - 1, q = 1 + X * X + Y * Y;
        double r = envmapi_inverse_root(q), i = r * r * r * r, rho = cube ? r * r * r : 4 * i;
        once[x] =
            (float)(area * rho * (1 + area * i * (cube ? (1.5 * q - 2.5) / 4 : (2 * q - 3) / 3)));
    }
    for (int x = 0; folds && x < (width + 1) / 2; ++x) {
        double X = 1 - (2 * x + 1.0) * (1.0 / width), p = 1 - X - fabs(Y), low = p < 0 ? p : 0;
        double Z = fabs(Y) + low, xp = X + low - fabs(p), zp = Z - fabs(p);
        double r = envmapi_inverse_root((X + low) * (X + low) + Z * Z + p * p), i = r * r;
        once[x] = (float)(area * i * r * (1 + area * i * (0.625 * i * (xp * xp + zp * zp) - 0.5)));
    }
    for (int x = 0; !smooth && x < (width + 1) / 2; ++x) { /* where a fold is nearer than 0.7 */
        double X = 1 - (2 * x + 1.0) / width, Z = fabs(Y), p = fabs(1 - X - Z), e = side / 2;
        double a[3] = {X - e, 0, Z + e}, b[3] = {X + e, 0, Z - e}, c[3] = {X - e, side, Z - e};
        int apart = folds && fmin(X, Z) > 0.45 * side;
        if (apart && p > 0.7 * side) continue;
        if (apart && p < 0.1 * side) once[x] = (float)(2 * envmapi_spherical_triangle(a, b, c));
        else once[x] = (float)(row > 0 ? row : envmapi_texel_cell(NULL, mapping, edge, x, y));
    }
    for (int x = 0; envmapi_is_disc(mapping) && x < (width + 1) / 2; ++x) { /* cut by the rim */
        double X = fabs((2 * x + 1.0) / width - 1) + side / 2, y_end = fabs(Y) + side / 2;
        if (X * X + y_end * y_end > 1) once[x] = 0;
    }
    for (int x = (width + 1) / 2; x < width; ++x) once[x] = once[width - 1 - x];
    for (int x = 0; x < width; ++x) omega[3 * x] = omega[3 * x + 1] = omega[3 * x + 2] = once[x];
}

static const float *envmapi_omega_row(const envmapi_input *in, int y) {
    int edge = in->map->size, row = y < edge - 1 - y ? y : edge - 1 - y;
    return in->omega + (size_t)row * 4 * (size_t)envmapi_width(in->map->mapping, edge);
}

static envmapi_light envmapi_light_of(const envmapi_input *in, size_t texel, double w) {
    envmapi_light light;
    memset(&light, 0, sizeof light);
    light.texel = texel, light.value[3] = w;
    for (size_t c = 0; c < 3; ++c) light.value[c] = w * (double)in->texels[3 * texel + c];
    return light;
}

/* Lists the texels that a rim cuts: the same on every face. */
static void envmapi_input_rim(envmapi_input *in, int room) {
    const envmap *map = in->map;
    size_t area = envmapi_area(map->mapping, map->size);
    for (size_t t = 0; t < area && room; ++t) {
        int x = (int)(t % (size_t)map->size), y = (int)(t / (size_t)map->size);
        double X = fmax(fabs((2 * x + 1.0) / map->size - 1) - 1.0 / map->size, 0), at[2];
        double Y = fmax(fabs((2 * y + 1.0) / map->size - 1) - 1.0 / map->size, 0);
        if (envmapi_omega_row(in, y)[3 * x] > 0 || X * X + Y * Y > 1) continue;
        double w = envmapi_texel_cell(at, map->mapping, map->size, x, y);
        for (int face = 0; w > 0 && face < envmap_faces(map->mapping); ++face) {
            if (in->rim_count >= room) return;
            envmapi_light *light = in->rim + in->rim_count++;
            *light = envmapi_light_of(in, (size_t)face * area + t, w);
            envmapi_direction(light->d, map->mapping, face, at[0], at[1]);
        }
    }
}

/* With room for `spare` more floats in the same block: glibc's malloc gives the heap's end back
   after each call in which no block is half of all, and the next call has it mapped anew. */
static envmap_result envmapi_input_create(envmapi_input *in, const envmap *map, int slice,
                                          size_t spare, const envmap_work *work,
                                          envmapi_pool *pool) {
    /* a circle cuts at most 4 texels a column, on one or two faces; twice that */
    int room = envmapi_is_disc(map->mapping) ? 16 * map->size + 64 : 0, rows = (map->size + 1) / 2;
    size_t width = (size_t)envmapi_width(map->mapping, map->size);
    in->map = map, in->texels = envmapi_image(map, 0, slice, 0), in->rim_count = 0;
    size_t omega = (4 * width * (size_t)rows + 15) / 16 * 16;
    in->omega = (float *)envmapi_pool_get(pool, omega + spare, sizeof(float));
    in->rim = (envmapi_light *)envmapi_pool_get(pool, (size_t)room + 1, sizeof(envmapi_light));
    if (!in->omega || !in->rim) return ENVMAP_ERROR_MEMORY;
    in->spare = in->omega + omega;
    envmapi_run_all(work, envmapi_task_omega, in, rows);
    envmapi_input_rim(in, room);
    return ENVMAP_OK;
}

/* ---- the grid of a face, and a whole transform */

/* The grid of a map: nu x nv nodes a face, `pad` more beyond each edge; or the texels
   (identity), which have one tap each. closed: nodes beyond an edge are others of the grid.
   folded: an octahedral map's faces are the octahedron's, two triangles in each quadrant, whose
   nodes fill it: bit 0 of a face is the right half, bit 1 the lower, bit 2 beyond the horizon.
   bent: a cube's nodes lie at u = (1 + tan a/tan g)/2, a even from -g to g: fewer are wasted on
   corners. */
typedef struct envmapi_grid {
    const envmap *map;
    int faces, width, height, nu, nv, pad, identity, closed, folded, bent, taps;
    int line[2];  /* nodes that are solved together along v, and along u */
    size_t count; /* nodes */
} envmapi_grid;

/* g: the larger, the fewer nodes, but the farther apart where a face's spline ends. At 0.6
   lights_beside_an_edge_keep_the_tolerance fails: 33 tolerances. */
#define ENVMAPI_BEND     0.5
#define ENVMAPI_BEND_TAN 0.54630248984379 /* its tangent */

/* The largest |d direction / du| of a mapping, but at the rims of sphere and angular maps. */
static double envmapi_stretch(int mapping) {
    static const double span[ENVMAP_MAPPING_COUNT] = {
        2, 4, 4, 2 * ENVMAPI_PI, 2 * ENVMAPI_PI, 4.898979485566356}; /* 2 sqrt 6 */
    return span[mapping];
}

/* Nodes no farther apart than h. Sphere and angular maps end at their rims, so their texels are the
   grid; so they are where a grid has nearly as many nodes (0.8: speed only). A face is padded by 3
   nodes, which taps reach, and by those that feel a spline's end: it is 0.2 % wrong there and
   forgets it by its pole, 0.43 = e^-0.843, a node. An octahedron's face, whose rows and columns
   cross at 60 degrees, has one more, which three bands need (points_keep_the_tolerance). A
   lat-long's lines have no end: rows go on at the seam, columns beyond the poles. Test:
   a_light_beside_an_edge_keeps_the_tolerance. */
static envmapi_grid envmapi_grid_of(const envmap *map, double h, double tolerance) {
    envmapi_grid grid;
    int width = envmapi_width(map->mapping, map->size), closed = map->mapping == ENVMAP_LATLONG;
    int folds = map->mapping == ENVMAP_OCTAHEDRAL, faces = folds ? 8 : envmap_faces(map->mapping);
    int pad = 3 + (closed ? 0 : (int)ceil(log(0.002 / fmin(tolerance, 0.002)) / 0.843));
    double span = envmapi_stretch(map->mapping) / (1 + closed + folds);
    grid.map = map, grid.pad = pad;
    grid.bent = map->mapping == ENVMAP_CUBE && span > 4 * pad * h; /* nodes end before pi/2 */
    if (grid.bent) span *= ENVMAPI_BEND / ENVMAPI_BEND_TAN;
    int n = (int)fmax(ceil(span / h), 4) + folds;
    double nodes = faces * ((1.0 + closed) * n + 2 * grid.pad) * (n + 2.0 * grid.pad);
    grid.identity = map->mapping == ENVMAP_SPHERE || map->mapping == ENVMAP_ANGULAR ||
                    nodes > 0.8 * envmap_faces(map->mapping) * width * map->size;
    grid.closed = closed && !grid.identity, grid.taps = grid.identity ? 1 : 6;
    grid.folded = folds && !grid.identity;
    grid.faces = grid.folded ? faces : envmap_faces(map->mapping);
    if (grid.identity) grid.pad = grid.bent = 0;
    grid.nu = grid.identity ? width : n * (1 + closed);
    grid.nv = grid.identity ? map->size : n;
    grid.width = grid.nu + 2 * grid.pad, grid.height = grid.nv + 2 * grid.pad;
    grid.line[0] = grid.closed ? grid.nv : grid.height;
    grid.line[1] = grid.closed ? grid.nu / 2 : grid.width;
    grid.count = (size_t)grid.faces * (size_t)grid.width * (size_t)grid.height;
    return grid;
}

/* Where the columns, or rows, of a face begin and end: all n of the map, or a half. */
static void envmapi_grid_side(int run[2], const envmapi_grid *grid, int n, int second) {
    run[0] = grid->folded && second ? n / 2 : 0, run[1] = grid->folded && !second ? n / 2 : n;
}

/* The same of its texels in row y, one of its rows. */
static void envmapi_grid_run(int run[2], const envmapi_grid *grid, int face, int y) {
    int size = grid->map->size, right = face & 1;
    int horizon = (2 * y + 1 > size ? 2 * y + 1 - size : size - 2 * y - 1) / 2;
    envmapi_grid_side(run, grid, envmapi_width(grid->map->mapping, size), right);
    if (grid->folded) run[right ^ face >> 2] = right ? size - horizon : horizon;
}

/* (u,v) -> d as seen from a face, also beyond its edges. An octahedron's are planes. */
static void envmapi_grid_ray(double d[3], const envmapi_grid *grid, int face, double u, double v) {
    double a = face & 1 ? 1 : -1, b = face & 2 ? 1 : -1, x = a * (2 * u - 1), z = b * (2 * v - 1);
    if (!grid->folded) envmapi_ray(d, grid->map->mapping, face, u, v);
    else d[0] = a * (face & 4 ? 1 - z : x), d[1] = 1 - x - z, d[2] = b * (face & 4 ? 1 - x : z);
}

/* Six nodes and their spline weights for each texel along one side. */
typedef struct envmapi_taps {
    int start;
    float w[6];
} envmapi_taps;

static void envmapi_taps_fill(envmapi_taps *taps, int texels, int nodes, const envmapi_grid *grid) {
    for (int x = 0; x < texels; ++x) {
        double at = (x + 0.5) / texels;
        if (grid->bent) at = 0.5 + 0.5 / ENVMAPI_BEND * atan(ENVMAPI_BEND_TAN * (2 * at - 1));
        at = at * nodes * (1 + grid->folded) - 0.5 + grid->pad;
        if (grid->folded && x >= texels / 2) at -= nodes;
        double before = floor(at);
        float w[16];
        taps[x].start = (int)before - 2;
        envmapi_splines(w, (float)(at - before), 0);
        memcpy(taps[x].w, w, sizeof taps[x].w);
        if (grid->identity)
            memset(taps[x].w, 0, sizeof taps[x].w), taps[x].w[0] = 1, taps[x].start = x;
    }
}

/* One map's grid at work, and the rings behind it. A task is a part that the data alone defines. */
typedef struct envmapi_transform {
    envmapi_grid grid;
    envmapi_rings rings;        /* their points: the nodes, then the cut texels */
    const envmapi_input *in;    /* of a source */
    envmapi_taps *u, *v;        /* of the texels */
    double (*factors)[3];       /* of the solve along columns, rows; of odd parts */
    double *places;             /* u of the nodes, on a face's left half where it is folded */
    float *rows;                /* a task's rows of texels */
    int strips, along, adjoint; /* strips: of a face's grid, one a task; solve along rows */
    envmapi_lights lights;      /* summed apart */
    float *out;                 /* a result's slice */
    float *sums;                /* NULL, or what light 1 everywhere gives there */
    double norm;                /* what a light's k is divided by */
    int divide, positive; /* by the fourth channel; the lobe, though its bands may be negative */
    float least;          /* of what is divided by */
} envmapi_transform;

/* Rays of n texels or nodes at (u,v), to d[][at ..]; right: 1/2 to add to u, or 0. */
static void envmapi_rays(double d[3][ENVMAPI_CHUNK], int at, int n, const envmapi_grid *grid,
                         int face, const double *u, double right, double v) {
    double ray[3], next[3];
    int flat = grid->map->mapping == ENVMAP_CUBE || grid->folded;
    for (int i = 0; i < n && !flat; ++i) {
        envmapi_grid_ray(ray, grid, face, u[i] + right, v);
        for (int c = 0; c < 3; ++c) d[c][at + i] = ray[c];
    }
    if (!flat) return;
    envmapi_grid_ray(ray, grid, face, right, v);
    envmapi_grid_ray(next, grid, face, right + 1, v);
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < n; ++i) d[c][at + i] = ray[c] + u[i] * (next[c] - ray[c]);
}

/* u, or v, of the k-th of n nodes. */
static double envmapi_grid_place(const envmapi_grid *grid, int k, int n) {
    double at = (k - grid->pad + 0.5) / n; /* of a folded face, which is half of the map */
    if (grid->bent) return 0.5 + 0.5 / ENVMAPI_BEND_TAN * tan(ENVMAPI_BEND * (2 * at - 1));
    return grid->folded ? at / 2 : at;
}

/* Where the nodes are. Task: a row of the grid, of every face: 64 nodes at a time. */
static void envmapi_task_points(void *context, int y) {
    envmapi_transform *t = (envmapi_transform *)context;
    const envmapi_grid *grid = &t->grid;
    int width = grid->width, total = grid->faces * width, first = 0;
    double d[3][ENVMAPI_CHUNK], v = envmapi_grid_place(grid, y, grid->nv);
    envmapi_point points[ENVMAPI_CHUNK];
    for (int i = 0, next, n; i < total; i = next) { /* a run on one face, up to a full chunk */
        n = width - i % width;
        if (n > first + ENVMAPI_CHUNK - i) n = first + ENVMAPI_CHUNK - i;
        next = i + n;
        int face = i / width, right = grid->folded & face, below = grid->folded & face >> 1;
        envmapi_rays(d, i - first, n, grid, face, t->places + i % width, 0.5 * right,
                     v + 0.5 * below);
        if (next - first < ENVMAPI_CHUNK && next < total) continue;
        envmapi_points_of(points, d, next - first);
        for (int k = first; k < next; ++k) {
            size_t row = (size_t)(k / width) * (size_t)grid->height + (size_t)y;
            t->rings.points[row * (size_t)width + (size_t)(k % width)] = points[k - first];
        }
        first = next;
    }
}

/* A grid for map of spacing h, rings for it and `bands`, and room for all that works on them. in:
   NULL for results; done: another one, whose memory may be used, or NULL; room: that of rings. */
static envmap_result envmapi_transform_create(envmapi_transform *t, const envmap *map, double h,
                                              int bands, double tolerance, const envmapi_input *in,
                                              size_t room, const envmapi_transform *done,
                                              const envmap_work *work, envmapi_pool *pool) {
    memset(t, 0, sizeof *t);
    t->grid = envmapi_grid_of(map, h, tolerance), t->in = in;
    t->strips = t->grid.faces == 6 ? 1 : 8 / t->grid.faces;
    size_t width = (size_t)envmapi_width(map->mapping, map->size), size = (size_t)map->size;
    size_t strips = (size_t)(t->grid.faces * t->strips), high = (size_t)t->grid.height;
    size_t wide = (size_t)t->grid.width, rim = (size_t)(in ? in->rim_count : 0);
    int M = envmapi_rings_size((int)ceil(fmax(ENVMAPI_PI / h, bands + 2)));
    t->u = (envmapi_taps *)envmapi_pool_get(pool, width + size, sizeof(envmapi_taps));
    t->rows = (float *)envmapi_pool_get(pool, 28 * width * strips, sizeof(float));
    t->places = (double *)envmapi_pool_get(pool, wide + 6 * (high + wide + 4), sizeof(double));
    if (!t->u || !t->rows || !t->places ||
        envmapi_rings_create(&t->rings, M, bands, t->grid.count + rim, room,
                             envmapi_rings_tasks(work), done ? &done->rings : NULL, pool))
        return ENVMAP_ERROR_MEMORY;
    t->v = t->u + width, t->factors = (double(*)[3])(t->places + wide);
    for (int x = 0; x < t->grid.width; ++x)
        t->places[x] = envmapi_grid_place(&t->grid, x, t->grid.nu);
    envmapi_taps_fill(t->u, (int)width, t->grid.nu, &t->grid);
    envmapi_taps_fill(t->v, map->size, t->grid.nv, &t->grid);
    for (int i = 0; i < 4; ++i) { /* along v, u; the same for odd parts of closed lines */
        const int *n = t->grid.line, odd = i / 2, sign = odd ? -1 : 1;
        double(*to)[3] = t->factors + odd * (n[0] + n[1] + 4) + i % 2 * (n[0] + 2);
        envmapi_spline_factor(to, n[i % 2], sign, sign);
    }
    envmapi_run_all(work, envmapi_task_points, t, t->grid.height);
    return ENVMAP_OK;
}

/* Nodes beyond the seam and the poles of a lat-long are others of its nodes: add them there, for
   the adjoint, or copy. */
static void envmapi_grid_close(envmapi_transform *t) {
    const envmapi_grid *grid = &t->grid;
    int nu = grid->nu, nv = grid->nv, pad = grid->pad, row = grid->width;
    for (int y = -pad; y < nv + pad && grid->closed; ++y)
        for (int x = -pad; x < nu + pad; ++x) {
            int j = y < 0 ? -1 - y : y < nv ? y : 2 * nv - 1 - y;
            int i = envmapi_wrap(j == y ? x : x + nu / 2, nu);
            float *beyond = t->rings.values + 4 * (size_t)((y + pad) * row + x + pad);
            float *inside = t->rings.values + 4 * (size_t)((j + pad) * row + i + pad);
            if (beyond != inside) envmapi_fold(inside, beyond, 4, t->adjoint);
        }
}

/* Half of a closed line and the other half, which begins 2 nu numbers on: sums and differences of
   nodes that are each other's mirror images, or of those a pole's other side has. */
ENVMAPI_INLINE void envmapi_grid_parts(float *line, const envmapi_transform *t, int groups,
                                       size_t step, size_t apart, float scale) {
    int n = t->grid.line[t->along];
    for (int k = 0; k < n; ++k)
        for (int g = 0; g < groups; ++g) {
            float *a = line + (size_t)k * step + (size_t)g * apart;
            float *b = line + 2 * (size_t)t->grid.nu + (size_t)g * apart +
                       (size_t)(t->along ? n - 1 - k : k) * step;
            for (int c = 0; c < 4; ++c) {
                float even = a[c] + b[c], odd = a[c] - b[c];
                a[c] = even * scale, b[c] = odd * scale;
            }
        }
}

/* A spline that sees itself mirrored at its end is off by A z^k, k nodes from there, z = -0.43 its
   pole. The fifth difference of its coefficients tells A: it leaves next to nothing of a smooth
   function, but (1-z)^5 = 6 times A of this. Takes it away; for the adjoint, before the solve.
   Test: lights_beside_an_edge_keep_the_tolerance. */
static void envmapi_line_end(float *end, ptrdiff_t step, int n, int adjoint) {
    static const float difference[16] = {0.166896f,  -0.834482f, 1.668964f,
                                         -1.668964f, 0.834482f,  -0.166896f};
    static const float mode[16] = {1.0f,     -0.43058f,  0.18540f,  -0.07983f, 0.03437f, -0.01480f,
                                   0.00637f, -2.744e-3f, 1.181e-3f, -5.09e-4f, 2.19e-4f, -9.43e-5f,
                                   4.06e-5f, -1.75e-5f,  7.5e-6f,   -3.2e-6f};
    const float *from = adjoint ? mode : difference, *to = adjoint ? difference : mode;
    envmapi_float4 sum;
    memset(&sum, 0, sizeof sum);
    for (int k = 0; k < 16 && k < n; ++k)
        envmapi_float4_add(&sum, from[k], envmapi_float4_at(end + k * step));
    for (int k = 0; k < 16 && k < n; ++k)
        envmapi_float4_add(envmapi_float4_at(end + k * step), -to[k], &sum);
}

/* Both ends of so many lines. */
static void envmapi_line_ends(float *line, const envmapi_transform *t, int groups, size_t step,
                              size_t apart) {
    int n = t->grid.line[t->along];
    for (int g = 0; g < groups; ++g, line += apart) {
        envmapi_line_end(line, (ptrdiff_t)step, n, t->adjoint);
        envmapi_line_end(line + (size_t)(n - 1) * step, -(ptrdiff_t)step, n, t->adjoint);
    }
}

/* Solves along 1 or 4 lines. A closed one is an even and an odd line of half the length, whose ends
   see themselves mirrored, as +1 and as -1. */
ENVMAPI_INLINE void envmapi_lines_solve(float *line, const envmapi_transform *t, int groups,
                                        size_t step, size_t apart) {
    const int *n = t->grid.line, closed = t->grid.closed;
    double(*factors)[3] = t->along ? t->factors + n[0] + 2 : t->factors;
    if (closed) envmapi_grid_parts(line, t, groups, step, apart, 1);
    else if (t->adjoint) envmapi_line_ends(line, t, groups, step, apart);
    envmapi_float4_solve(line, n[t->along], step, groups, apart, factors, 0);
    if (!closed && !t->adjoint) envmapi_line_ends(line, t, groups, step, apart);
    if (!closed) return;
    envmapi_float4_solve(line + 2 * t->grid.nu, n[t->along], step, groups, apart,
                         factors + n[0] + n[1] + 4, 0);
    envmapi_grid_parts(line, t, groups, step, apart, 0.5f);
}

/* Samples to spline coefficients, or its adjoint. Task: a strip of a face's columns, then rows. */
static void envmapi_task_solve(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    const envmapi_grid *grid = &t->grid;
    int lines = grid->line[!t->along], part = task % t->strips;
    int line = lines * part / t->strips, to = lines * (part + 1) / t->strips;
    size_t row = 4 * (size_t)grid->width, step = t->along ? 4 : row, apart = t->along ? row : 4;
    float *nodes = t->rings.values + (size_t)(task / t->strips) * (size_t)grid->height * row;
    if (grid->closed) nodes += (size_t)grid->pad * (row + 4);
    for (; line + 4 <= to; line += 4)
        envmapi_lines_solve(nodes + (size_t)line * apart, t, 4, step, apart);
    for (; line < to; ++line) envmapi_lines_solve(nodes + (size_t)line * apart, t, 1, step, apart);
}

static void envmapi_grid_solve(envmapi_transform *t, int adjoint, const envmap_work *work) {
    t->adjoint = adjoint;
    if (adjoint) envmapi_grid_close(t);
    for (t->along = 0; t->along < 2 && !t->grid.identity; ++t->along)
        envmapi_run_all(work, envmapi_task_solve, t, t->grid.faces * t->strips);
    if (!adjoint) envmapi_grid_close(t);
}

/* ---- project: texels -> a_lm */

/* Rows of texels that are worked on together (speed only: one by one takes 1.9 x). */
#define ENVMAPI_ROWS 16

/* sums[j stride ..] += w[r][j] x[r] y[r], r < rows, j < taps, for n numbers; product 0: without y,
   -1: that and sums are 0 before; -2: that, and below 0 they become 0. The sums stay in registers
   while rows go by. */
typedef struct envmapi_rows {
    const float *x[ENVMAPI_ROWS], *y[ENVMAPI_ROWS];
    float w[ENVMAPI_ROWS][6];
    int rows;
} envmapi_rows;

/* What a look at the rows notes beside: the sum of squares, and the bits of x. */
typedef struct envmapi_rows_notes {
    envmapi_wide squares;
    envmapi_bits bits;
} envmapi_rows_notes;

/* y = n numbers of x, 0 beyond; a copy of unknown size would go through memory. */
ENVMAPI_INLINE void envmapi_wide_load(envmapi_wide *y, const float *x, size_t n) {
    if (n >= (size_t)ENVMAPI_WIDE) *y = *envmapi_wide_at(x);
    else memset(y, 0, sizeof *y), memcpy(y, x, n * sizeof *x);
}

ENVMAPI_INLINE void envmapi_rows_part(float *sums, size_t stride, int taps, const envmapi_rows *in,
                                      int product, envmapi_rows_notes *notes, size_t at,
                                      size_t n) {
    envmapi_wide acc[6], light, texel, omega, squares;
    envmapi_bits bits, all;
    if (notes) squares = notes->squares, all = notes->bits;
    memset(acc, 0, sizeof acc);
    if (product >= 0)
        ENVMAPI_UNROLL for (int j = 0; j < taps; ++j)
            envmapi_wide_load(acc + j, sums + (size_t)j * stride + at, n);
    for (int r = 0; r < in->rows; ++r) {
        ENVMAPI_PREFETCH(in->x[r] + at + 64);
        envmapi_wide_load(&texel, in->x[r] + at, n), light = texel;
        if (product > 0) {
            envmapi_wide_load(&omega, in->y[r] + at, n), memset(&light, 0, sizeof light);
            envmapi_wide_mad(&light, &texel, &omega);
        }
        if (notes) {
            memcpy(&bits, &texel, sizeof bits);
            ENVMAPI_EACH(&all) all.v[i] |= bits.v[i];
            envmapi_wide_mad(&squares, &light, &light);
        }
        ENVMAPI_UNROLL for (int j = 0; j < taps; ++j)
            envmapi_wide_add(acc + j, in->w[r][j], &light);
    }
    if (product < -1) { /* the sign's bit, less 1: all bits where it is 0 */
        memcpy(&bits, acc, sizeof bits);
        ENVMAPI_EACH(&bits) bits.v[i] &= (bits.v[i] >> 31) - 1;
        memcpy(acc, &bits, sizeof bits);
    }
    ENVMAPI_UNROLL for (int j = 0; j < taps; ++j) {
        float *out = sums + (size_t)j * stride + at;
        if (n >= (size_t)ENVMAPI_WIDE) *envmapi_wide_at(out) = acc[j];
        else memcpy(out, acc + j, n * sizeof *out);
    }
    if (notes) notes->squares = squares, notes->bits = all;
}

ENVMAPI_INLINE void envmapi_rows_add(float *sums, size_t stride, int taps, const envmapi_rows *in,
                                     int product, envmapi_rows_notes *notes, size_t n) {
    size_t i = 0;
    for (; i + ENVMAPI_WIDE <= n; i += ENVMAPI_WIDE)
        envmapi_rows_part(sums, stride, taps, in, product, notes, i, ENVMAPI_WIDE);
    if (i < n) envmapi_rows_part(sums, stride, taps, in, product, notes, i, n - i);
}

/* A finished row of texels -> a row of nodes: a run of texels between the same nodes is gathered in
   registers first. */
static void envmapi_reduce_row(float *nodes, const envmapi_transform *t, int face,
                               const float *row) {
    int width = envmapi_width(t->grid.map->mapping, t->grid.map->size), taps = t->grid.taps;
    int run[2];
    const float *solid = row + 3 * width;
    envmapi_grid_side(run, &t->grid, width, face & 1);
    for (int x = run[0]; x < run[1];) {
        int start = t->u[x].start;
        envmapi_float4 sums[6], *node = envmapi_float4_at(nodes + 4 * start);
        memset(sums, 0, sizeof sums);
        for (; x < run[1] && t->u[x].start == start; ++x) {
            float light[4] = {row[3 * x], row[3 * x + 1], row[3 * x + 2], solid[x]};
            ENVMAPI_UNROLL for (int i = 0; i < 6; ++i) /* of one tap, five are zero */
                envmapi_float4_add(sums + i, t->u[x].w[i], envmapi_float4_at(light));
        }
        ENVMAPI_UNROLL for (int i = 0; i < taps; ++i) envmapi_float4_add(node + i, 1, sums + i);
    }
}

/* Task: one horizontal strip of one face's grid, from the texels that reach it. Six rows of nodes,
   as wide as the texels, are open at a time. Solid angles are alike on all faces: only on the
   first. */
static void envmapi_task_reduce(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    const envmapi_grid *grid = &t->grid;
    int face = task / t->strips, strip = task % t->strips, size = grid->map->size, open;
    int taps = grid->taps, most = grid->folded ? 1 : ENVMAPI_ROWS, run[2];
    int from = grid->height * strip / t->strips, to = grid->height * (strip + 1) / t->strips, y;
    size_t width = (size_t)envmapi_width(grid->map->mapping, size), W = 4 * width;
    size_t floats = 4 * (size_t)grid->width;
    const float *texels = t->in->texels;
    float *nodes = t->rings.values + (size_t)face * (size_t)grid->height * floats;
    float *rows = t->rows + (size_t)task * 6 * W;
    if (!grid->folded) texels += 3 * (size_t)face * width * (size_t)size;
    envmapi_rows in;
    memset(nodes + (size_t)from * floats, 0, (size_t)(to - from) * floats * sizeof(float));
    memset(rows, 0, 6 * W * sizeof(float));
    envmapi_grid_side(run, grid, size, face & 2);
    y = run[0], size = run[1];
    while (y < size && t->v[y].start + taps <= from) ++y;
    for (open = y < size ? t->v[y].start : to; open < to; y += in.rows) {
        int next = y < size ? t->v[y].start : to;
        for (in.rows = 0; open < next && open < to; ++open) {
            float *row = rows + (size_t)(open % 6) * W;
            if (open >= from) envmapi_reduce_row(nodes + (size_t)open * floats, t, face, row);
            memset(row, 0, W * sizeof(float));
        }
        envmapi_grid_run(run, grid, face, y);
        size_t n = (size_t)(run[1] - run[0]), x = (size_t)run[0];
        for (int k = y; next < to && k < size && in.rows < most && t->v[k].start == next;
             ++k, ++in.rows) {
            in.x[in.rows] = texels + 3 * ((size_t)k * width + x);
            in.y[in.rows] = envmapi_omega_row(t->in, k) + 3 * x;
            for (int i = 0; i < taps; ++i)
                in.w[in.rows][taps == 6 ? (next + i) % 6 : 0] = t->v[k].w[i];
        }
        if (!in.rows) break;
        float *into = taps == 6 ? rows : rows + (size_t)(next % 6) * W;
        if (taps == 6) envmapi_rows_add(into + 3 * x, W, 6, &in, 1, NULL, 3 * n);
        else envmapi_rows_add(into, W, 1, &in, 1, NULL, 3 * n);
        for (int r = 0; r < in.rows; ++r) in.x[r] = in.y[r] + 3 * width - 2 * x;
        if (face == 0 || grid->folded)
            envmapi_rows_add(into + 3 * width + x, W, taps, &in, 0, NULL, n);
    }
}

/* Takes a texel's light out of the nodes; its solid angle stays, or the norm would have a hole. */
static void envmapi_light_out(envmapi_transform *t, const envmapi_light *light) {
    size_t width = (size_t)envmapi_width(t->grid.map->mapping, t->grid.map->size);
    size_t x = light->texel % width, line = light->texel / width, size = (size_t)t->grid.map->size;
    size_t face = line / size, y = line % size;
    int taps = t->grid.taps, run[2] = {0, 0};
    for (int f = t->grid.folded ? y >= size / 2 ? 2 : 0 : 8; f < 8; f += f & 1 ? 3 : 1) {
        envmapi_grid_run(run, &t->grid, f, (int)y);
        if ((int)x >= run[0] && (int)x < run[1]) face = (size_t)f;
    }
    if (!(envmapi_omega_row(t->in, (int)y)[3 * x] > 0)) return; /* a cut one is not there */
    for (int k = 0; k < taps * taps; ++k) {
        size_t row = face * (size_t)t->grid.height + (size_t)(t->v[y].start + k / taps);
        size_t at = row * (size_t)t->grid.width + (size_t)(t->u[x].start + k % taps);
        float tap = t->v[y].w[k / taps] * t->u[x].w[k % taps];
        for (int c = 0; c < 3; ++c)
            t->rings.values[4 * at + (size_t)c] -= tap * (float)light->value[c];
    }
}

/* Cut texels as points of their own, dark where they are among the lights; returns how many. */
static size_t envmapi_rim_points(envmapi_transform *t) {
    double d[3][ENVMAPI_CHUNK];
    size_t n = t->grid.count;
    for (const envmapi_light *cut = t->in->rim; cut < t->in->rim + t->in->rim_count; ++cut) {
        int out = 0;
        for (int k = 0; k < t->lights.count && !out; ++k)
            out = t->lights.all[k].texel == cut->texel;
        for (int c = 0; c < 3; ++c) d[c][0] = cut->d[c];
        for (int c = 0; c < 4; ++c)
            t->rings.values[4 * n + (size_t)c] = out && c < 3 ? 0 : (float)cut->value[c];
        envmapi_points_of(t->rings.points + n++, d, 1);
    }
    return n - t->grid.count;
}

/* All texels but the lights -> t->rings.a. */
static void envmapi_project_texels(envmapi_transform *t, const envmap_work *work) {
    size_t face = t->grid.count / (size_t)t->grid.faces;
    envmapi_run_all(work, envmapi_task_reduce, t, t->grid.faces * t->strips);
    for (size_t i = 0; i + face < t->grid.count && !t->grid.folded; ++i)
        t->rings.values[4 * (i + face) + 3] = t->rings.values[4 * i + 3];
    for (int i = 0; i < t->lights.count; ++i) envmapi_light_out(t, t->lights.all + i);
    envmapi_grid_solve(t, 1, work);
    t->rings.count = t->grid.count + envmapi_rim_points(t);
    envmapi_analyse(&t->rings, work);
}

/* ---- fill: a_lm -> texels */

/* RGB over what the lobe makes of the solid angles, already at the nodes: that varies by so little
   that the ratio is as smooth; but for what _axes_lack tells. Task: a strip of the nodes. */
static void envmapi_task_norm(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    size_t parts = (size_t)(t->grid.faces * t->strips), part = (size_t)task;
    size_t from = t->grid.count * part / parts, to = t->grid.count * (part + 1) / parts;
    for (float *node = t->rings.values + 4 * from; node < t->rings.values + 4 * to; node += 4) {
        float scale = 1 / (node[3] < t->least ? t->least : node[3]);
        for (int c = 0; c < 3; ++c) node[c] *= scale;
    }
}

/* sums += what the lights send to n <= 64 texels from (x,y) on, over their norm. */
static void envmapi_add_lights(float *sums, const float *norm, const envmapi_transform *t, int face,
                               int x, int y, int n) {
    double a[3][ENVMAPI_CHUNK] = {{0}}, u[ENVMAPI_CHUNK], scale = 1 / t->norm;
    int width = envmapi_width(t->grid.map->mapping, t->grid.map->size);
    for (int i = 0; i < n; ++i) u[i] = (x + i + 0.5) / width;
    envmapi_rays(a, 0, n, &t->grid, face, u, 0, (y + 0.5) / t->grid.map->size);
    for (int i = 0; i < n; i += ENVMAPI_BESIDE) {
        envmapi_lit lit;
        int m = n - i < ENVMAPI_BESIDE ? n - i : ENVMAPI_BESIDE;
        memset(&lit, 0, sizeof lit);
        for (int j = 0; j < ENVMAPI_BESIDE; ++j) {
            double d[3] = {a[0][i + j], a[1][i + j], a[2][i + j]};
            double shrink = envmapi_inverse_root(envmapi_dot(d, d));
            for (int c = 0; c < 3; ++c) lit.a[c][j] = d[c] * shrink;
        }
        envmapi_lit_all(&lit, m, &t->lights);
        for (int j = 0; j < m; ++j) {
            double over = t->divide ? scale / (double)norm[i + j] : scale;
            for (int c = 0; c < 3; ++c) sums[3 * (i + j) + c] += (float)(lit.rgb[c][j] * over);
        }
    }
}

/* A row of nodes -> as wide as the texels: RGB, then the norm. */
static void envmapi_expand_row(float *row, const envmapi_transform *t, int face,
                               const float *nodes) {
    int width = envmapi_width(t->grid.map->mapping, t->grid.map->size), run[2];
    envmapi_grid_side(run, &t->grid, width, face & 1);
    for (int x = run[0]; x < run[1]; ++x) {
        float sum[4];
        if (t->grid.identity) {
            memcpy(sum, nodes + 4 * x, sizeof sum);
        } else {
            const envmapi_float4 *node = envmapi_float4_at(nodes + 4 * t->u[x].start);
            envmapi_float4 total;
            memset(&total, 0, sizeof total);
            ENVMAPI_UNROLL for (int i = 0; i < 6; ++i)
                envmapi_float4_add(&total, t->u[x].w[i], node + i);
            memcpy(sum, &total, sizeof sum);
        }
        for (int c = 0; c < 3; ++c) row[3 * x + c] = sum[c];
        row[3 * width + x] = sum[3];
    }
}

/* A face's part of a row of texels from rows as wide as the map; norm: room for theirs. */
static void envmapi_expand_texels(float *out, float *norm, const envmapi_transform *t,
                                  envmapi_rows *in, int face, int y) {
    int width = envmapi_width(t->grid.map->mapping, t->grid.map->size), run[2];
    envmapi_grid_run(run, &t->grid, face, y);
    int from = run[0], n = run[1] - run[0];
    out += 3 * from;
    for (int r = 0; r < in->rows; ++r) in->x[r] += 3 * from;
    if (t->positive) envmapi_rows_add(out, 0, 1, in, -2, NULL, 3 * (size_t)n);
    else envmapi_rows_add(out, 0, 1, in, -1, NULL, 3 * (size_t)n);
    if (!t->lights.count && !t->sums) return;
    for (int r = 0; r < in->rows; ++r) in->x[r] += 3 * width - 2 * from;
    envmapi_rows_add(norm, 0, 1, in, -1, NULL, (size_t)n);
    if (t->sums) memcpy(t->sums + (out - t->out) / 3, norm, (size_t)n * sizeof *norm);
    for (int x = 0; x < n && t->lights.count; x += ENVMAPI_CHUNK)
        envmapi_add_lights(out + 3 * x, norm + x, t, face, from + x, y,
                           n - x < ENVMAPI_CHUNK ? n - x : ENVMAPI_CHUNK);
}

/* Texels from spline coefficients. Task: a strip of texel rows of a face; six rows of nodes are
   open at a time. */
static void envmapi_task_expand(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    const envmapi_grid *grid = &t->grid;
    int size = grid->map->size, face = task / t->strips, strip = task % t->strips, done = -1;
    size_t width = (size_t)envmapi_width(grid->map->mapping, size),
           floats = 4 * (size_t)grid->width;
    const float *nodes = t->rings.values + (size_t)face * (size_t)grid->height * floats;
    float *rows = t->rows + (size_t)task * 28 * width, *norm = rows + 24 * width;
    float *out = t->out + (grid->folded ? 0 : 3 * (size_t)face * width * (size_t)size);
    envmapi_rows in;
    int run[2];
    envmapi_grid_side(run, grid, size, face & 2);
    int from = run[0] + (run[1] - run[0]) * strip / t->strips;
    int to = run[0] + (run[1] - run[0]) * (strip + 1) / t->strips;
    for (int y = from; y < to; ++y) {
        int start = t->v[y].start, taps = grid->identity ? 1 : 6; /* constants: unrolled */
        for (int i = done < start ? start : done; i < start + taps; ++i)
            envmapi_expand_row(rows + (size_t)(i % 6) * 4 * width, t, face,
                               nodes + (size_t)i * floats);
        for (int i = 0; i < taps; ++i) {
            in.x[i] = rows + (size_t)((start + i) % 6) * 4 * width;
            in.w[i][0] = t->v[y].w[i];
        }
        done = start + taps, in.rows = taps;
        envmapi_expand_texels(out + 3 * (size_t)y * width, norm, t, &in, face, y);
    }
}

/* t->rings.a -> t->out. `bad` is the result where something is not finite; that, and a cancelling,
   is told before a texel is written. */
static envmap_result envmapi_fill_texels(envmapi_transform *t, const envmap_work *work,
                                         envmap_result bad) {
    int strips = t->grid.faces * t->strips;
    if (envmapi_tell(&work->progress, 0)) return ENVMAP_CANCELLED;
    t->rings.count = t->grid.count;
    envmapi_synthesise(&t->rings, work);
    if (t->divide) envmapi_run_all(work, envmapi_task_norm, t, strips);
    if (!envmapi_floats_ok(t->rings.values, 4 * t->grid.count, 1)) return bad;
    if (envmapi_tell(&work->progress, 1)) return ENVMAP_CANCELLED;
    envmapi_grid_solve(t, 0, work);
    envmapi_run_all(work, envmapi_task_expand, t, strips);
    return ENVMAP_OK;
}

/* ------------------------------------------------------------------------------- >>harmonics --
   Calls on coefficients a_lm, [bands^2][3] at l(l+1)+m.
     with a tolerance   envmap_sh_project and envmap_sh_fill are halves of >>transform
     without one        they are the definition, sums over points, 64 at a time:
       project            a_lm += sum_i e_i Y_lm(d_i)    (envmapi_sh_scatter; for three bands and
                          less envmapi_sh_moments_add, sums times products of 1, x, y, z)
       fill, evaluate     e_i = sum_lm a_lm Y_lm(d_i)    (envmapi_sh_gather), its adjoint
   Y_lm is N_m (P_lm/sin^m)(z) times Re, Im (x+iy)^m: no angles. P/sin^m grows to e^82 by 256 bands,
   and where sin^m underflows the product would be below 1e-270.
   Rotations are an exact quadrature, windows a search on the sphere; both ask points on rings.
   >>plan uses envmapi_sh_power.  Tests: tests/test_sh.c. */

#define ENVMAPI_SH_BANDS  256
#define ENVMAPI_SH_LIMIT  1e108 /* of what coefficients below 1e100 can reach */
#define ENVMAPI_SH_FLOATS 3e-6  /* the least tolerance that floats keep */

#define ENVMAPI_SH_POINTS 32 /* a multiple of 8; more take more stack */

/* Points with directions and energies; N_m (x+iy)^m for the m at hand, with sqrt 2 for m > 0. */
typedef struct envmapi_sh_points {
    double x[ENVMAPI_SH_POINTS], y[ENVMAPI_SH_POINTS], z[ENVMAPI_SH_POINTS];
    double e[3][ENVMAPI_SH_POINTS], powers[2][ENVMAPI_SH_POINTS];
    double A[ENVMAPI_SH_BANDS + 1], B[ENVMAPI_SH_BANDS + 1]; /* envmapi_legendre_factors */
    int count;
} envmapi_sh_points;

static void envmapi_sh_points_add(envmapi_sh_points *n, const double d[3]) {
    n->x[n->count] = d[0], n->y[n->count] = d[1], n->z[n->count] = d[2];
    ++n->count;
}

/* Nothing but direction d, of any length. */
static void envmapi_sh_points_one(envmapi_sh_points *n, const double d[3]) {
    double unit[3];
    n->count = 0;
    envmapi_unit(unit, d);
    envmapi_sh_points_add(n, unit);
}

/* Makes ready for m, after m - 1. Returns the number of points with those, of no energy, that fill
   up the last eight. */
static int envmapi_sh_points_order(envmapi_sh_points *n, int m, int bands) {
    int all = (n->count + 7) / 8 * 8;
    double factor = sqrt(m == 0 ? 1 / (4 * ENVMAPI_PI) : m == 1 ? 3 : 1 + 0.5 / m);
    envmapi_legendre_factors(n->A, n->B, m, bands);
    for (int i = n->count; i < all && m == 0; ++i) {
        n->x[i] = n->y[i] = n->e[0][i] = n->e[1][i] = n->e[2][i] = 0;
        n->z[i] = 1;
    }
    for (int i = 0; i < all; ++i) {
        double re = m ? n->powers[0][i] : 1, im = m ? n->powers[1][i] : 0;
        double x = m ? n->x[i] : 1, y = m ? n->y[i] : 0;
        n->powers[0][i] = factor * (re * x - im * y);
        n->powers[1][i] = factor * (re * y + im * x);
    }
    return all;
}

/* sh += sum of e Y_lm over the points. */
static void envmapi_sh_scatter(double *sh, int bands, envmapi_sh_points *n) {
    double F[6][ENVMAPI_SH_POINTS];
    for (int m = 0; m < bands && n->count; ++m) {
        envmapi_double8 now[ENVMAPI_SH_POINTS / 8], before[ENVMAPI_SH_POINTS / 8];
        int all = envmapi_sh_points_order(n, m, bands);
        memset(before, 0, sizeof before), memset(now, 0, sizeof now);
        for (int i = 0; i < all; ++i) {
            ((double *)now)[i] = 1;
            for (int c = 0; c < 6; ++c) F[c][i] = n->powers[c / 3][i] * n->e[c % 3][i];
        }
        for (int l = m; l < bands; ++l) {
            envmapi_double8 sums[6];
            memset(sums, 0, sizeof sums);
            for (int i = 0; i < all / 8; ++i) {
                for (int c = 0; c < 6; ++c)
                    envmapi_double8_mad(sums + c, now + i, envmapi_double8_at(F[c] + 8 * i));
                envmapi_legendre_step(now + i, before + i, envmapi_double8_at(n->z + 8 * i),
                                      n->A[l + 1], n->B[l + 1]);
            }
            for (int c = 0; c < (m ? 6 : 3); ++c) {
                const double *s = (const double *)(sums + c);
                sh[3 * (l * (l + 1) + (c < 3 ? m : -m)) + c % 3] +=
                    ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
            }
        }
    }
}

/* Its adjoint: e = sum of a_lm Y_lm, times factors [bands] where these are given. */
static void envmapi_sh_gather(envmapi_sh_points *n, const double *sh, int bands,
                              const double *factors) {
    memset(n->e, 0, sizeof n->e);
    for (int m = 0; m < bands; ++m) {
        int all = envmapi_sh_points_order(n, m, bands);
        for (int i = 0; i < all; i += 8) {
            envmapi_double8 sums[6], now, before;
            memset(sums, 0, sizeof sums), memset(&before, 0, sizeof before);
            for (int b = 0; b < 8; ++b) ((double *)&now)[b] = 1;
            for (int l = m; l < bands; ++l) {
                const double *a = sh + 3 * l * (l + 1);
                double factor = factors ? factors[l] : 1;
                for (int c = 0; c < 6; ++c)
                    envmapi_double8_add(sums + c, factor * a[c < 3 ? 3 * m + c : c - 3 - 3 * m],
                                        &now);
                envmapi_legendre_step(&now, &before, envmapi_double8_at(n->z + i), n->A[l + 1],
                                      n->B[l + 1]);
            }
            for (int c = 0; c < 6; ++c)
                envmapi_double8_mad(envmapi_double8_at(n->e[c % 3] + i), sums + c,
                                    envmapi_double8_at(n->powers[c / 3] + i));
        }
    }
}

/* The most that a channel can reach anywhere: |sum_m a_lm Y_lm| <= sqrt((2l+1)/4pi sum_m a_lm^2).
   Infinite for what is not finite. */
static double envmapi_sh_bound(const double *sh, int bands, const double *factors, int c) {
    double bound = 0;
    for (int l = 0; l < bands; ++l) {
        double square = 0;
        for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
            if (!envmapi_finite(sh[3 * i + c]) || fabs(sh[3 * i + c]) >= 1e100) return HUGE_VAL;
            square += sh[3 * i + c] * sh[3 * i + c];
        }
        bound += fabs(factors ? factors[l] : 1) * sqrt((2 * l + 1) / (4 * ENVMAPI_PI) * square);
    }
    return bound;
}

/* No channel exceeds the limit anywhere, and all is finite. */
static envmap_result envmapi_sh_check(const double *sh, int bands, double limit) {
    if (!sh || bands < 1 || bands > ENVMAPI_SH_BANDS) return ENVMAP_ERROR_ARGUMENT;
    for (int c = 0; c < 3; ++c)
        if (!(envmapi_sh_bound(sh, bands, NULL, c) <= limit)) return ENVMAP_ERROR_RADIANCE;
    return ENVMAP_OK;
}

ENVMAPI_BODY envmap_result envmap_sh_basis(double *Y, int bands, const double dir[3]) {
    envmapi_sh_points n;
    if (!Y || !dir || bands < 1 || bands > ENVMAPI_SH_BANDS) return ENVMAP_ERROR_ARGUMENT;
    envmapi_sh_points_one(&n, dir);
    for (int m = 0; m < bands; ++m) {
        double now = 1, before = 0;
        envmapi_sh_points_order(&n, m, bands);
        for (int l = m; l < bands; ++l) {
            Y[l * (l + 1) - m] = now * n.powers[1][0], Y[l * (l + 1) + m] = now * n.powers[0][0];
            double up = l + 1 < bands ? n.A[l + 1] * n.z[0] * now - n.B[l + 1] * before : 0;
            before = now, now = up;
        }
    }
    return ENVMAP_OK;
}

ENVMAPI_BODY envmap_result envmap_sh_evaluate(double rgb[3], const double *sh, int bands,
                                              const double dir[3]) {
    envmap_result result = envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT);
    envmapi_sh_points n;
    if (!rgb || !dir) return ENVMAP_ERROR_ARGUMENT;
    if (result) return result;
    envmapi_sh_points_one(&n, dir);
    envmapi_sh_gather(&n, sh, bands, NULL);
    for (int c = 0; c < 3; ++c) rgb[c] = n.e[c][0];
    return ENVMAP_OK;
}

/* ---- maps to coefficients and back */

/* Either way, between level 0 of a map of its own and coefficients. */
typedef struct envmapi_sh_job {
    envmap map;
    int slice, bands;
    double tolerance, *sums; /* project: the tasks', [ENVMAPI_TASKS][room], first [bands^2][3] */
    size_t room;
    const envmapi_input *in; /* project: of the map and slice, or NULL */
    const double *sh;        /* fill: from these */
    float *texels;           /* project: from these; fill: to these */
    envmap_work work;
    envmapi_pool pool;
} envmapi_sh_job;

/* 0 for bad numbers, or a bad executor. */
static int envmapi_sh_job_of(envmapi_sh_job *job, const envmap *map, int slice, int bands,
                             double tolerance, const envmap_work *work) {
    memset(job, 0, sizeof *job);
    if (!envmapi_work_of(&job->work, work) || !envmapi_finite(tolerance) || tolerance < 0) return 0;
    job->map = *map, job->slice = slice, job->bands = bands, job->tolerance = tolerance;
    job->pool.memory = job->work.memory;
    return 1;
}

static float *envmapi_sh_texel(const envmapi_sh_job *job, int face, int x, int y) {
    size_t width = (size_t)envmapi_width(job->map.mapping, job->map.size);
    size_t row = (size_t)face * (size_t)job->map.size + (size_t)y;
    return job->texels + 3 * (row * width + (size_t)x);
}

/* Texels from (x0,y) on of every face, as many as there is room for: added to the sums, at their
   centroids; or without sums, filled at their centres. */
static void envmapi_sh_texels(const envmapi_sh_job *job, double *sums, int x0, int y) {
    int mapping = job->map.mapping, edge = job->map.size, width = envmapi_width(mapping, edge);
    int count = width - x0 < ENVMAPI_SH_POINTS ? width - x0 : ENVMAPI_SH_POINTS;
    double at[ENVMAPI_SH_POINTS][2], w[ENVMAPI_SH_POINTS], d[3];
    envmapi_sh_points n;
    for (int i = 0; i < count; ++i) {
        at[i][0] = (x0 + i + 0.5) / width, at[i][1] = (y + 0.5) / edge;
        if (sums) w[i] = envmapi_texel_cell(at[i], mapping, edge, x0 + i, y);
    }
    for (int face = 0; face < envmap_faces(mapping); ++face) {
        float *texel = envmapi_sh_texel(job, face, x0, y);
        for (n.count = 0; n.count < count;) {
            envmapi_direction(d, mapping, face, at[n.count][0], at[n.count][1]);
            envmapi_sh_points_add(&n, d);
        }
        for (int i = 0; i < 3 * count && sums; ++i) n.e[i % 3][i / 3] = w[i / 3] * (double)texel[i];
        if (sums) envmapi_sh_scatter(sums, job->bands, &n);
        else envmapi_sh_gather(&n, job->sh, job->bands, NULL);
        for (int i = 0; i < 3 * count && !sums; ++i) texel[i] = (float)n.e[i % 3][i / 3];
    }
}

/* Tasks: every 16th row. */
static void envmapi_task_sh(void *context, int task) {
    const envmapi_sh_job *job = (const envmapi_sh_job *)context;
    double *sums = job->sums ? job->sums + (size_t)task * job->room : NULL;
    for (int y = task; y < job->map.size; y += ENVMAPI_TASKS)
        for (int x = 0; x < envmapi_width(job->map.mapping, job->map.size); x += ENVMAPI_SH_POINTS)
            envmapi_sh_texels(job, sums, x, y);
}

/* Sums of w L d_i d_j, d = (x, y, z, 1) on a face's own axes, for these i and j: all that three
   bands need. Odd along u, 1, or v, 2: there the mirror image of a texel counts negative. */
#define ENVMAPI_SH_MOMENTS 10
static const struct {
    int i, j, odd;
} envmapi_sh_moments[ENVMAPI_SH_MOMENTS] = {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {2, 3, 0}, {3, 3, 0},
                                            {0, 2, 1}, {0, 3, 1}, {1, 2, 2}, {1, 3, 2}, {0, 1, 3}};

/* Axis i of a face: S, T, M as of a cube's; which axis of the map it is, and its sign. */
static int envmapi_sh_axis(double *sign, int mapping, int face, int i) {
    int like = mapping == ENVMAP_CUBE ? face : mapping == ENVMAP_OCTAHEDRAL ? 2 : 4, j = 0;
    *sign = mapping == ENVMAP_PARABOLOID && face && i == 2 ? -1 : 1;
    if (i == 3) return i;
    while (!(fabs(envmapi_cube[like][i][j]) > 0)) ++j;
    *sign *= envmapi_cube[like][i][j];
    return j;
}

/* S, T, M and |d|, w / |d|^2 of a cube's row of small texels, as below: by vectors. */
static void envmapi_sh_cube_row(double *to, size_t half, int edge, int y) {
    double side = 2.0 / edge, y0 = y * side - 1, y1 = y0 + side, Y = y0 + side / 2;
    for (size_t i = 0; i < half; ++i) {
        double x0 = (double)(int)i * side - 1, x1 = x0 + side, X = x0 + side / 2, turn[2];
        double a = x1 * x1 + 1, b = x0 * x0 + 1, p = y1 * y1, q = y0 * y0, dd = 1 + X * X + Y * Y;
        double root = envmapi_inverse_root(dd);
        envmapi_cube_turn(turn, x0, y0, x1, y1, (b + q) * envmapi_inverse_root(b + q),
                          (b + p) * envmapi_inverse_root(b + p),
                          (a + q) * envmapi_inverse_root(a + q),
                          (a + p) * envmapi_inverse_root(a + p));
        to[i] = X, to[half + i] = Y, to[2 * half + i] = 1, to[3 * half + i] = dd * root;
        to[4 * half + i] = envmapi_small_atan(turn[1] / turn[0]) * root * root;
    }
    if (edge % 2) to[5 * half - 1] /= 2;
}

/* The left half of row y of a face's upper half: d and |d|, w / |d|^2, then their products. A texel
   in the middle is its own mirror image. On lat-long each d is the one before, turned by a column,
   and rows differ from the first, `from`, by a factor. */
static void envmapi_sh_products(double *to, size_t half, const envmapi_sh_job *job, int from,
                                int y) {
    int mapping = job->map.mapping, edge = job->map.size, width = envmapi_width(mapping, edge);
    double at[2], d[3] = {0}, sign[4], *along[4], step = ENVMAPI_PI / edge;
    double c = cos(step), s = sin(step);
    double w = 0, scale = 2 * y + 1 == edge ? 0.5 : 1, *weights = to + 4 * half;
    for (size_t k = 0; k < 4; ++k)
        along[envmapi_sh_axis(sign + k, mapping, 0, (int)k)] = to + k * half;
    int cube = mapping == ENVMAP_CUBE && edge >= 16;
    if (cube) envmapi_sh_cube_row(to, half, edge, y), sign[0] = sign[1] = sign[2] = 1;
    for (int i = 0; i < (int)half && !cube && (mapping != ENVMAP_LATLONG || y == from); ++i) {
        double x = d[0];
        if (mapping != ENVMAP_LATLONG || i % 64 == 0) {
            w = envmapi_texel_cell(at, mapping, edge, i, y);
            envmapi_ray(d, mapping, 0, at[0], at[1]);
        } else d[0] = c * x - s * d[2], d[2] = s * x + c * d[2];
        double dd = envmapi_dot(d, d);
        along[0][i] = d[0], along[1][i] = d[1], along[2][i] = d[2], along[3][i] = sqrt(dd);
        weights[i] = (2 * i + 1 == width ? 0.5 : 1) * w / dd;
    }
    if (mapping == ENVMAP_LATLONG) {
        double sine = sin((y + 0.5) * step) / sin((from + 0.5) * step);
        scale *= sine, sign[0] *= sine, sign[2] *= sine;
        sign[1] *= cos((y + 0.5) * step) / cos((from + 0.5) * step);
    }
    for (size_t k = 0; k < ENVMAPI_SH_MOMENTS; ++k) {
        int i = envmapi_sh_moments[k].i, j = envmapi_sh_moments[k].j;
        double *a = to + (size_t)i * half, *b = to + (size_t)j * half, *out = to + (5 + k) * half;
        double factor = scale * sign[i] * sign[j];
        for (size_t n = 0; n < half; ++n) out[n] = factor * weights[n] * a[n] * b[n];
    }
}

/* Adds row y of a face and its mirror image. A lane is a channel.
   rows  [2][3 width], and one more: the two added, and subtracted */
static void envmapi_sh_moments_add(envmapi_double4 *sums, const envmapi_sh_job *job, int face,
                                   int y, const double *products, double *rows) {
    int edge = job->map.size, width = envmapi_width(job->map.mapping, edge), half = (width + 1) / 2;
    const float *a = envmapi_sh_texel(job, face, 0, y);
    const float *b = envmapi_sh_texel(job, face, 0, edge - 1 - y);
    envmapi_double4 e[4];
    for (int i = 0; i < 3 * width; ++i) {
        rows[i] = (double)a[i] + (double)b[i];
        rows[3 * width + i] = (double)a[i] - (double)b[i];
    }
    for (int i = 0; i < half; ++i) {
        for (int odd = 0; odd < 4; ++odd) {
            const double *row = rows + odd / 2 * 3 * width;
            e[odd] = *envmapi_double4_at(row + 3 * i);
            envmapi_double4_add(e + odd, odd & 1 ? -1 : 1,
                                envmapi_double4_at(row + 3 * (width - 1 - i)));
        }
        for (int k = 0; k < ENVMAPI_SH_MOMENTS; ++k)
            envmapi_double4_add(sums + k, products[k * half + i], e + envmapi_sh_moments[k].odd);
    }
}

/* envmapi_task_sh for three bands and less (speed only: a tenth of its time). */
static void envmapi_task_sh_nine(void *context, int task) {
    const envmapi_sh_job *job = (const envmapi_sh_job *)context;
    int mapping = job->map.mapping, faces = envmap_faces(mapping), bands = job->bands;
    double *sh = job->sums + (size_t)task * job->room, M[4][4], sign[2];
    size_t width = (size_t)envmapi_width(mapping, job->map.size), half = (width + 1) / 2;
    double *rows = sh + job->room - 6 * width - 1, *products = sh + 3 * bands * bands;
    double k0 = sqrt(1 / (4 * ENVMAPI_PI)), k1 = sqrt(3.0) * k0, k2 = sqrt(15.0) * k0;
    envmapi_double4 sums[6][ENVMAPI_SH_MOMENTS];
    memset(sums, 0, sizeof sums);
    for (int y = task; 2 * y < job->map.size; y += ENVMAPI_TASKS) {
        envmapi_sh_products(products, half, job, task, y);
        for (int face = 0; face < faces; ++face)
            envmapi_sh_moments_add(sums[face], job, face, y, products + 5 * half, rows);
    }
    for (int c = 0; c < 3; ++c) {
        memset(M, 0, sizeof M);
        for (int k = 0; k < ENVMAPI_SH_MOMENTS * faces; ++k) {
            int face = k / ENVMAPI_SH_MOMENTS, n = k % ENVMAPI_SH_MOMENTS;
            int i = envmapi_sh_axis(sign, mapping, face, envmapi_sh_moments[n].i);
            int j = envmapi_sh_axis(sign + 1, mapping, face, envmapi_sh_moments[n].j);
            M[i < j ? i : j][i < j ? j : i] +=
                sign[0] * sign[1] * ((const double *)&sums[face][n])[c];
        }
        double Y[9] = {k0 * M[3][3], k1 * M[1][3], k1 * M[2][3], k1 * M[0][3]};
        Y[4] = k2 * M[0][1], Y[5] = k2 * M[1][2], Y[7] = k2 * M[0][2];
        Y[6] = sqrt(5.0) / 2 * k0 * (3 * M[2][2] - M[3][3]), Y[8] = k2 / 2 * (M[0][0] - M[1][1]);
        for (int i = 0; i < bands * bands; ++i) sh[3 * i + c] = Y[i];
    }
}

/* The definition, to sh or, when all of them are there, to texels; the other is NULL. */
static envmap_result envmapi_sh_exact(double *sh, float *texels, envmapi_sh_job *job) {
    size_t numbers = 3 * (size_t)(job->bands * job->bands);
    size_t width = (size_t)envmapi_width(job->map.mapping, job->map.size), nine = job->bands <= 3;
    size_t floats = envmapi_slice_floats(&job->map, 0);
    job->room = numbers + nine * (width / 2 * (5 + ENVMAPI_SH_MOMENTS) + 6 * width + 16);
    size_t all = ENVMAPI_TASKS * job->room;
    void *room = sh ? envmapi_pool_get(&job->pool, all, sizeof(double))
                    : envmapi_pool_get(&job->pool, floats, sizeof(float));
    if (!room) return ENVMAP_ERROR_MEMORY;
    if (sh) job->sums = (double *)memset(room, 0, all * sizeof(double));
    job->texels = sh ? envmapi_image(&job->map, 0, job->slice, 0) : (float *)room;
    envmap_task *task = sh && nine ? envmapi_task_sh_nine : envmapi_task_sh;
    envmap_result result = envmapi_run(&job->work, task, job, ENVMAPI_TASKS);
    if (texels && !result) memcpy(texels, room, floats * sizeof(float));
    if (!sh || result) return result;
    memset(sh, 0, numbers * sizeof(double));
    for (size_t i = 0; i < ENVMAPI_TASKS * numbers; ++i)
        sh[i % numbers] += job->sums[i / numbers * job->room + i % numbers];
    return envmapi_sh_check(sh, job->bands, ENVMAPI_SH_LIMIT);
}

/* The transform's a from sh, to sh from a: a_lm -+ i a_l-m, over sqrt 2 for m > 0. */
static void envmapi_sh_exchange(double *to, const double *from, int bands, int to_sh) {
    for (int m = 0; m < bands; ++m)
        for (int l = m; l < bands; ++l)
            for (int c = 0; c < (m ? 6 : 3); ++c) {
                size_t a = envmapi_triangle(bands, m) + (size_t)(8 * (l - m) + c + (c > 2));
                int sh = 3 * l * (l + 1) + (c < 3 ? 3 * m + c : c - 3 - 3 * m);
                double root = (c < 3 ? 1 : -1) * (m ? sqrt(2.0) : 1);
                if (to_sh) to[sh] = root * from[a];
                else to[a] = from[sh] / root;
            }
}

/* Half of >>transform, to sh where that is given, else to texels. The grid is the widest that loses
   no more than the tolerance of the last band: a fifth of it in each of the two splines on the
   way, as a face of few nodes loses more of one texel than the mean that is known. */
static envmap_result envmapi_sh_fast(double *sh, float *texels, envmapi_sh_job *job) {
    envmapi_input in;
    envmapi_transform t;
    const envmapi_input *from = job->in ? job->in : sh ? &in : NULL;
    int bands = job->bands;
    double lambda[ENVMAPI_SH_BANDS], h = envmapi_widest_spacing(bands);
    while (5 * envmapi_band_error(bands - 1, h) > job->tolerance) h *= 0.96;
    if ((sh && !job->in &&
         envmapi_input_create(&in, &job->map, job->slice, 0, &job->work, &job->pool)) ||
        envmapi_transform_create(&t, &job->map, h, bands, job->tolerance, from, 1, NULL, &job->work,
                                 &job->pool))
        return ENVMAP_ERROR_MEMORY;
    for (int l = 0; l < bands; ++l) lambda[l] = 1;
    t.rings.lambda = lambda, t.out = texels;
    if (sh) {
        if (envmapi_tell(&job->work.progress, 0)) return ENVMAP_CANCELLED;
        envmapi_project_texels(&t, &job->work);
        envmapi_sh_exchange(sh, t.rings.a, bands, 1);
        return envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT);
    }
    memset(t.rings.a, 0, envmapi_triangle(bands, bands) * sizeof(double));
    envmapi_sh_exchange(t.rings.a, job->sh, bands, 0);
    return envmapi_fill_texels(&t, &job->work, ENVMAP_ERROR_RADIANCE);
}

/* Frees the job's memory; sh may be written though it fails. */
static envmap_result envmapi_sh_project(double *sh, envmapi_sh_job *job) {
    const envmap *map = &job->map;
    envmap_result result = ENVMAP_ERROR_RADIANCE;
    if (job->tolerance >= ENVMAPI_SH_FLOATS) result = envmapi_sh_fast(sh, NULL, job);
    if (!result && !envmapi_sh_check(sh, job->bands, 1e-25) &&
        envmapi_exponent(envmapi_image(map, 0, job->slice, 0), envmapi_slice_floats(map, 0)) < -60)
        result = ENVMAP_ERROR_RADIANCE;
    if (result == ENVMAP_ERROR_RADIANCE) /* floats overflow, or vanish, where doubles do not */
        result = envmapi_sh_exact(sh, NULL, job);
    envmapi_pool_free(&job->pool, 0);
    return result;
}

ENVMAPI_BODY envmap_result envmap_sh_project(double *sh, int bands, const envmap *map, int slice,
                                             double tolerance, const envmap_work *work) {
    envmapi_sh_job job;
    if (!sh || bands < 1 || bands > ENVMAPI_SH_BANDS || !envmapi_valid(map) || slice < 0 ||
        slice >= map->slices || !envmapi_sh_job_of(&job, map, slice, bands, tolerance, work))
        return ENVMAP_ERROR_ARGUMENT;
    size_t bytes = 3 * (size_t)(bands * bands) * sizeof(double);
    double *out = (double *)ENVMAP_MALLOC(job.work.memory, bytes);
    envmap_result result = out ? envmapi_sh_project(out, &job) : ENVMAP_ERROR_MEMORY;
    if (!result) memcpy(sh, out, bytes);
    if (out) ENVMAP_FREE(job.work.memory, out);
    return result;
}

ENVMAPI_BODY envmap_result envmap_sh_fill(envmap *map, int level, int slice, const double *sh,
                                          int bands, double tolerance, const envmap_work *work) {
    envmapi_sh_job job;
    float *texels = envmap_texel(map, level, slice, 0, 0, 0);
    if (!texels || !envmapi_sh_job_of(&job, map, slice, bands, tolerance, work))
        return ENVMAP_ERROR_ARGUMENT;
    envmap_result result = envmapi_sh_check(sh, bands, ENVMAPI_FLOAT);
    if (result) return result;
    job.map.size = envmapi_edge(map->size, level), job.sh = sh;
    int tiny = !envmapi_sh_check(sh, bands, 1e-25) && envmapi_sh_check(sh, bands, 0);
    if (tolerance >= ENVMAPI_SH_FLOATS && !tiny && !envmapi_sh_check(sh, bands, 1e37))
        result = envmapi_sh_fast(NULL, texels, &job);
    else result = envmapi_sh_exact(NULL, texels, &job);
    envmapi_pool_free(&job.pool, 0);
    return result;
}

/* ---- from coefficients to coefficients */

/* |a_l|^2 over m and channels; beyond what is known, as flat as a light. */
static double envmapi_sh_power(const double *sh, int bands, int l) {
    double sum = 0;
    int known = l < bands ? l : bands - 1;
    if (bands < 1) return 2 * l + 1;
    for (int i = 3 * known * known; i < 3 * (known + 1) * (known + 1); ++i) sum += sh[i] * sh[i];
    return sum * (2 * l + 1) / (2 * known + 1);
}

static void envmapi_sh_scale(double *out, const double *sh, int bands, const double *factors) {
    for (int l = 0; l < bands; ++l)
        for (int i = 3 * l * l; i < 3 * (l + 1) * (l + 1); ++i) out[i] = factors[l] * sh[i];
}

ENVMAPI_BODY envmap_result envmap_sh_convolve(double *out, const double *sh, int bands,
                                              const envmap_lobe *lobe, double p) {
    double lambda[ENVMAPI_SH_BANDS];
    envmap_result result = envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT);
    if (!result) result = out ? envmap_lobe_zonal(lambda, bands, lobe, p) : ENVMAP_ERROR_ARGUMENT;
    if (!result) envmapi_sh_scale(out, sh, bands, lambda);
    return result;
}

/* Node i of n of Gauss-Legendre on [-1,1]; returns its weight. Newton from Tricomi's guess. */
static double envmapi_gauss_many(double *node, int i, int n) {
    double x = cos(ENVMAPI_PI * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 8; ++step) {
        double before = 1, P = x;
        for (int l = 2; l <= n; ++l) {
            double next = ((2 * l - 1) * x * P - (l - 1) * before) / l;
            before = P, P = next;
        }
        slope = n * (before - x * P) / (1 - x * x);
        x -= P / slope;
    }
    *node = x;
    return 2 / ((1 - x * x) * slope * slope);
}

static int envmapi_is_orthogonal(const double R[9]) {
    for (int i = 0; i < 9; ++i) {
        double off = envmapi_dot(R + 3 * (i / 3), R + 3 * (i % 3)) - (i % 4 == 0);
        if (!envmapi_finite(off) || fabs(off) > 1e-4) return 0;
    }
    return 1;
}

/* Points that divide the ring at height z into n: from the k-th on, as many as there is room for
   before `end`. */
static void envmapi_sh_ring(envmapi_sh_points *ring, double z, int n, int k, int end) {
    double sine = sqrt(1 - z * z);
    for (ring->count = 0; k < end && ring->count < ENVMAPI_SH_POINTS; ++k) {
        double phi = 2 * ENVMAPI_PI * k / n, d[3] = {sine * cos(phi), sine * sin(phi), z};
        envmapi_sh_points_add(ring, d);
    }
}

ENVMAPI_BODY envmap_result envmap_sh_rotate(double *out, const double *sh, int bands,
                                            const double rotation[9]) {
    envmap_result result = envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT);
    envmapi_sh_points ring;
    if (!out || out == sh || !rotation || !envmapi_is_orthogonal(rotation))
        return ENVMAP_ERROR_ARGUMENT;
    if (result) return result;
    int n = 2 * bands;
    memset(out, 0, 3 * (size_t)(bands * bands) * sizeof *out);
    for (int j = 0; j < bands; ++j) {
        double z, weight = envmapi_gauss_many(&z, j, bands) * 2 * ENVMAPI_PI / n;
        for (int k = 0; k < n; k += ENVMAPI_SH_POINTS) {
            envmapi_sh_ring(&ring, z, n, k, n);
            envmapi_sh_gather(&ring, sh, bands, NULL);
            for (int i = 0; i < ring.count; ++i) {
                double d[3] = {ring.x[i], ring.y[i], ring.z[i]}, t[3];
                for (int c = 0; c < 3; ++c)
                    t[c] = envmapi_dot(rotation + 3 * c, d), ring.e[c][i] *= weight;
                envmapi_unit(t, t);
                ring.x[i] = t[0], ring.y[i] = t[1], ring.z[i] = t[2];
            }
            envmapi_sh_scatter(out, bands, &ring);
        }
    }
    return ENVMAP_OK;
}

/* ---- ringing. Poisson's kernel is positive: where what is filtered with one mu is nowhere below
   zero, neither is it with a larger one. So mu starts at 0 and is raised wherever a direction asks
   for more, until none does. "Value" is the lowest channel over its mean. */

typedef struct envmapi_ringing {
    const double *sh;
    int bands;
    double mu, mean[3], most; /* of channels: lambda_0 a_00; the most over it that one can reach */
    double lambda[ENVMAPI_SH_BANDS], factors[ENVMAPI_SH_BANDS]; /* the lobe's; times the window's */
} envmapi_ringing;

static void envmapi_ringing_window(envmapi_ringing *r, double mu) {
    r->mu = mu;
    for (int l = 0; l < r->bands; ++l) r->factors[l] = r->lambda[l] * exp(-mu * l);
}

/* 0 when a channel's mean is not positive, and the channel not black. */
static int envmapi_ringing_aim(envmapi_ringing *r) {
    envmapi_ringing_window(r, r->most = 0);
    for (int c = 0; c < 3; ++c) {
        double bound = envmapi_sh_bound(r->sh, r->bands, r->lambda, c);
        r->mean[c] = r->lambda[0] * r->sh[c];
        if (!(r->mean[c] > 0) && !(r->mean[c] >= 0 && bound <= 0)) return 0;
        if (bound > r->most * r->mean[c]) r->most = bound / r->mean[c];
    }
    return 1;
}

/* The points' values, to n->e[0]; a black channel's is 1, as large as its mean. */
static void envmapi_ringing_values(const envmapi_ringing *r, envmapi_sh_points *n) {
    envmapi_sh_gather(n, r->sh, r->bands, r->factors);
    for (int i = 0; i < n->count; ++i) {
        double v[3];
        for (int c = 0; c < 3; ++c) v[c] = r->mean[c] > 0 ? n->e[c][i] / r->mean[c] : 1;
        n->e[0][i] = fmin(v[0], fmin(v[1], v[2]));
    }
}

/* From d, whose value is d[3], down to where the value is lowest: the best of 8 steps, or half the
   step. Ends where what lies within a step cannot be below zero, as channels bend by bands^2 times
   their most. n: room to work in. */
static double envmapi_ringing_descend(const envmapi_ringing *r, envmapi_sh_points *n, double d[4]) {
    double step = 0.4 / r->bands, bend = r->bands * r->bands * r->most, lowest = d[3];
    for (int moves = 0; moves < 400 && step > 1e-6 && lowest < step * step * bend; ++moves) {
        int best = -1;
        for (n->count = 0; n->count < 8;) { /* corners of a cube about d */
            double e[3];
            for (int i = 0; i < 3; ++i) e[i] = d[i] + (n->count >> i & 1 ? step : -step);
            envmapi_unit(e, e);
            envmapi_sh_points_add(n, e);
        }
        envmapi_ringing_values(r, n);
        for (int i = 0; i < 8; ++i) /* 1e-10: no walks along a valley */
            if (n->e[0][i] < lowest - 1e-10) lowest = n->e[0][i], best = i;
        if (best < 0) step /= 2;
        else d[0] = n->x[best], d[1] = n->y[best], d[2] = n->z[best];
    }
    return lowest;
}

/* The least mu, to 1e-4, from where on the value in direction d is not below zero. Beyond log(4
   most) none is: what is not the mean, 1/sqrt(4 pi), is at most exp(-mu) most there. */
static void envmapi_ringing_raise(envmapi_ringing *r, envmapi_sh_points *n, const double d[3]) {
    double low = fmax(r->mu, 1e-9), high = log(4 * r->most);
    envmapi_sh_points_one(n, d);
    while (high - low > 1e-4 * high) {
        envmapi_ringing_window(r, (low + high) / 2);
        envmapi_ringing_values(r, n);
        if (n->e[0][0] < 0) low = r->mu;
        else high = r->mu;
    }
    envmapi_ringing_window(r, 1.0001 * high);
}

/* Downhill from every point of rings, 8 to the shortest wave, that is the lowest of its neighbours
   or its ring's first. Returns 1 when mu was raised. */
static int envmapi_ringing_look(envmapi_ringing *r) {
    int rings = 4 * r->bands, around = 8 * r->bands, raised = 0, room = ENVMAPI_SH_POINTS;
    envmapi_sh_points n;
    for (int j = 0; j < rings; ++j)
        for (int k = 0; k < around; k += room - 2) { /* the others are neighbours */
            double low[ENVMAPI_SH_POINTS / 2 + 1][4]; /* no two neighbours are */
            int lows = 0;
            envmapi_sh_ring(&n, cos(ENVMAPI_PI * (j + 0.5) / rings), around, k - 1, around + 1);
            envmapi_ringing_values(r, &n);
            for (int i = 1; i + 1 < n.count; ++i) {
                double at[4] = {n.x[i], n.y[i], n.z[i], n.e[0][i]};
                if (k + i > 1 && !(at[3] < n.e[0][i - 1] && at[3] <= n.e[0][i + 1])) continue;
                memcpy(low[lows++], at, sizeof at);
            }
            for (int i = 0; i < lows; ++i) {
                if (i && raised) { /* what is there now */
                    envmapi_sh_points_one(&n, low[i]);
                    envmapi_ringing_values(r, &n), low[i][3] = n.e[0][0];
                }
                if (!(envmapi_ringing_descend(r, &n, low[i]) < -1e-12)) continue; /* rounding */
                envmapi_ringing_raise(r, &n, low[i]);
                raised = 1;
            }
        }
    return raised;
}

ENVMAPI_BODY envmap_result envmap_sh_window(double *out, double *moved, const double *sh, int bands,
                                            const envmap_lobe *lobe, double p) {
    envmapi_ringing r;
    envmap_result result = envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT);
    for (int l = 0; l < ENVMAPI_SH_BANDS; ++l) r.lambda[l] = 1;
    if (!result && lobe) result = envmap_lobe_zonal(r.lambda, bands, lobe, p);
    if (!out || result) return result ? result : ENVMAP_ERROR_ARGUMENT;
    r.sh = sh, r.bands = bands;
    if (!envmapi_ringing_aim(&r)) return ENVMAP_ERROR_RADIANCE;
    while (envmapi_ringing_look(&r)) continue;
    double change = 0, total = 0;
    for (int l = 0; l < bands; ++l) {
        double kept = r.factors[l] = exp(-r.mu * l), moves = r.lambda[l] * (1 - kept);
        double power = envmapi_sh_power(sh, bands, l);
        total += r.lambda[l] * r.lambda[l] * power, change += moves * moves * power;
    }
    if (moved) *moved = total > 0 ? sqrt(change / total) : 0;
    envmapi_sh_scale(out, sh, bands, r.factors);
    return ENVMAP_OK;
}

/* ---- how many bands */

/* power: room for ENVMAPI_BAND_LIMIT, first lambda, then what the filter leaves of a band. */
static int envmapi_sh_bands(double *power, const envmap_lobe *lobe, double p, const double *sh,
                            int bands, double tolerance) {
    envmap_lobe raw = *lobe;
    raw.raw = 1, raw.scale = 1;
    double light = 4 * ENVMAPI_PI * envmapi_lobe_power(lobe, p, 2);
    for (int n = bands > 32 ? bands : 32;; n = 2 * n) {
        if (n > ENVMAPI_BAND_LIMIT) n = ENVMAPI_BAND_LIMIT;
        double rest = light, total = 0;
        envmapi_zonal(power, n, &raw, p);
        for (int l = 0; l < n; ++l) {
            power[l] *= power[l], rest -= (2 * l + 1) * power[l];
            power[l] *= envmapi_sh_power(sh, bands, l), total += power[l];
        }
        if (rest < 1e-12 * light) rest = 0; /* rounding */
        double tail = rest * envmapi_sh_power(sh, bands, n) / (2 * n + 1);
        double limit = tolerance * tolerance * (total + tail);
        int l = n;
        while (l > 0 && tail <= limit) tail += power[--l];
        if (l < n) return l + 1;
        if (n == ENVMAPI_BAND_LIMIT) return n;
    }
}

ENVMAPI_BODY int envmap_sh_bands(const envmap_lobe *lobe, double p, const double *sh, int bands,
                                 double tolerance) {
    double first;
    if ((sh || bands) && envmapi_sh_check(sh, bands, ENVMAPI_SH_LIMIT)) return 0;
    if (!envmapi_finite(tolerance) || tolerance < 0 || envmap_lobe_zonal(&first, 1, lobe, p))
        return 0;
    double *power = (double *)ENVMAP_MALLOC(NULL, ENVMAPI_BAND_LIMIT * sizeof *power);
    int needed = power ? envmapi_sh_bands(power, lobe, p, sh, bands, tolerance) : 0;
    ENVMAP_FREE(NULL, power);
    return needed;
}

/* ---- for shaders */

ENVMAPI_BODY envmap_result envmap_sh_pack(float matrix[48], float packed[28], const double *sh) {
    /* [RH01] eq. 12 with the basis' constants; M's upper triangle xx xy xz xw yy yz yw zz zw ww */
    static const int at[16] = {0, 1, 2, 3, 1, 4, 5, 6, 2, 5, 7, 8, 3, 6, 8, 9};
    double k0 = sqrt(1 / (4 * ENVMAPI_PI)), x = sqrt(15.0) / 2 * k0, y = sqrt(3.0) / 2 * k0;
    double z = sqrt(5.0) / 2 * k0;
    envmap_result result = envmapi_sh_check(sh, 3, 1e38);
    if (!matrix && !packed) return ENVMAP_ERROR_ARGUMENT;
    if (result) return result;
    for (int c = 0; c < 3; ++c) {
        const double *a = sh + c;
        const double M[10] = {x * a[24], x * a[12], x * a[21],     y * a[9], -x * a[24],
                              x * a[15], y * a[3],  3 * z * a[18], y * a[6], k0 * a[0] - z * a[18]};
        if (matrix)
            for (int i = 0; i < 16; ++i) matrix[16 * c + i] = (float)M[at[i]];
        if (!packed) continue;
        double four[2][4] = {{2 * M[3], 2 * M[6], 2 * M[8], M[9]},
                             {2 * M[1], 2 * M[5], M[7], 2 * M[2]}};
        for (int i = 0; i < 8; ++i)
            packed[4 * c + 12 * (i >> 2) + (i & 3)] = (float)four[i >> 2][i & 3];
        packed[24 + c] = (float)M[0], packed[27] = 0;
    }
    return ENVMAP_OK;
}

/* ---------------------------------------------------------------------------------- >>source --
   What is summed for every axis, once for all of them.
     in     a slice of a map                    out    its texels i that count, in tiles of 256
       l_i, w_i, L_i      direction, solid angle, radiance    envmapi_source_create, _source_rgb
     in     light from a direction              out    a point more, of rings or of such a source
       sum_i L_i w_i k(l_i . a) of points         any k      envmapi_points_add
   Used by reference, banks, sharp and materials.  Source: ours.
   Tests: tests/test_filters.c, tests/test_near.c. */

/* The side of src's mean texel, rad. */
static double envmapi_texel_extent(const envmap *src) {
    double texels = (double)envmapi_area(src->mapping, src->size) * envmap_faces(src->mapping);
    if (envmapi_is_disc(src->mapping)) texels *= ENVMAPI_PI / 4;
    return sqrt(4 * ENVMAPI_PI / texels);
}

/* The texels that count, one array a quantity, in Z-order: a face is four squares, each of them
   four ... So 4^n texels in a row are near each other, and what a lobe does not reach is passed by
   256 (a tile) at a time. */
#define ENVMAPI_TILE 256
#define ENVMAPI_FEW  960000 /* texels' images under all turns, or their tents' places (memory) */
typedef struct envmapi_source {
    const envmap *map;
    const float *texels; /* of the slice */
    size_t count, tiles;
    double *x, *y, *z, *w; /* [count] direction and solid angle */
    uint32_t *code;        /* [count] face, then the bits of y and x in turn, 2 bits of them */
    uint32_t *place;       /* [count] of the texel in the map */
    int bits;              /* of y and x each */
    double (*centre)[5];   /* [tiles] unit mean of a tile's texels; cosine and sine of its radius */
    size_t *first;         /* [tiles + 1] first texel of a tile */
    void *block;           /* the memory of all of the above */
    double *tents;         /* NULL, or directions of all texels' places, of such tents: */
    double tent;           /* half their width, in texels */
    int places;            /* of one, a side */
} envmapi_source;

/* A tent by 1 to 4 places a side, and their weights: its centre; two and three that have the second
   moment of the four, which are the definition's. */
static const double envmapi_tent[4][4][2] = {
    {{0, 1}},
    {{-0.40824829, 0.5}, {0.40824829, 0.5}},
    {{-0.6164414, 0.21929825}, {0, 0.5614035}, {0.6164414, 0.21929825}},
    {{-0.64494897, 0.18195861}, {-0.15505103, 0.31804139}, {0.15505103, 0.31804139},
     {0.64494897, 0.18195861}}};

static const float *envmapi_source_rgb(const envmapi_source *s, size_t i) {
    return s->texels + 3 * (size_t)s->place[i];
}

static void envmapi_source_free(envmapi_source *source, void *memory) {
    if (source->block) ENVMAP_FREE(memory, source->block);
    if (source->tents) ENVMAP_FREE(memory, source->tents);
    source->block = NULL, source->tents = NULL;
}

/* x of the n-th place in Z-order; y is that of n >> 1. */
static int envmapi_unzip(uint32_t n, int bits) {
    uint32_t x = 0;
    for (int bit = 0; bit < bits; ++bit) x |= (n >> 2 * bit & 1) << bit;
    return (int)x;
}

/* A tile has all texels since the last one. */
static void envmapi_source_tile_ends(envmapi_source *s) {
    double sum[3] = {0, 0, 0}, *centre = s->centre[s->tiles], radius = 0;
    for (size_t i = s->first[s->tiles]; i < s->count; ++i)
        sum[0] += s->x[i], sum[1] += s->y[i], sum[2] += s->z[i];
    envmapi_unit(centre, sum);
    for (size_t i = s->first[s->tiles]; i < s->count; ++i) {
        double d[3] = {s->x[i], s->y[i], s->z[i]};
        radius = fmax(radius, envmapi_angle(d, centre));
    }
    radius = fmin(radius + 1e-6, ENVMAPI_PI), centre[3] = cos(radius), centre[4] = sin(radius);
    s->first[++s->tiles] = s->count;
}

/* Appends the texels whose codes start at `from`, and their tile. */
static void envmapi_source_tile(envmapi_source *s, uint32_t from) {
    int mapping = s->map->mapping, edge = s->map->size, width = envmapi_width(mapping, edge);
    int face = (int)(from >> 2 * s->bits);
    int x0 = envmapi_unzip(from, s->bits), y0 = envmapi_unzip(from >> 1, s->bits);
    double at[2], d[3];
    for (uint32_t n = 0; n < ENVMAPI_TILE; ++n) {
        int x = x0 + envmapi_unzip(n, 4), y = y0 + envmapi_unzip(n >> 1, 4);
        double w = x < width && y < edge ? envmapi_texel_cell(at, mapping, edge, x, y) : 0;
        if (!(w > 0)) continue;
        size_t i = s->count++;
        s->place[i] = (uint32_t)((face * edge + y) * width + x);
        envmapi_direction(d, mapping, face, at[0], at[1]);
        s->x[i] = d[0], s->y[i] = d[1], s->z[i] = d[2], s->w[i] = w, s->code[i] = from + n;
    }
    envmapi_source_tile_ends(s);
}

/* Lays out n texels in so many tiles in a block of that many bytes; NULL: only says how many. */
static size_t envmapi_source_room(envmapi_source *s, size_t n, size_t tiles, void *block) {
    size_t bytes = n * (4 * sizeof *s->x + 2 * sizeof *s->code);
    bytes += tiles * (sizeof *s->centre + sizeof *s->first) + sizeof *s->first;
    if (!block) return bytes;
    s->x = (double *)block, s->y = s->x + n, s->z = s->y + n, s->w = s->z + n;
    s->centre = (double(*)[5])(s->w + n);
    s->first = (size_t *)(s->centre + tiles), s->first[0] = 0;
    s->code = (uint32_t *)(s->first + tiles + 1), s->place = s->code + n;
    return bytes;
}

/* On failure there is nothing to free. */
static envmap_result envmapi_source_create(envmapi_source *s, const envmap *map, int slice,
                                           void *memory) {
    int faces = envmap_faces(map->mapping), width = envmapi_width(map->mapping, map->size);
    size_t n = envmapi_area(map->mapping, map->size) * (size_t)faces;
    size_t tiles = (size_t)((width + 15) / 16) * (size_t)((map->size + 15) / 16) * (size_t)faces;
    memset(s, 0, sizeof *s);
    if (n > SIZE_MAX / 256) return ENVMAP_ERROR_MEMORY;
    void *block = ENVMAP_MALLOC(memory, envmapi_source_room(s, n, tiles, NULL));
    if (!block) return ENVMAP_ERROR_MEMORY;
    envmapi_source_room(s, n, tiles, block);
    s->map = map, s->block = block, s->bits = 4, s->texels = envmapi_image(map, 0, slice, 0);
    while (1 << s->bits < width) ++s->bits;
    for (uint32_t code = 0; code >> 2 * s->bits < (uint32_t)faces; code += ENVMAPI_TILE)
        if (envmapi_unzip(code, s->bits) < width && envmapi_unzip(code >> 1, s->bits) < map->size)
            envmapi_source_tile(s, code);
    return ENVMAP_OK;
}

/* Directions of texel i's places, x of all, then y, then z. */
static void envmapi_source_tent(double *d, const envmapi_source *s, size_t i, double tent,
                                int places) {
    int mapping = s->map->mapping, edge = s->map->size, n = places * places;
    int width = envmapi_width(mapping, edge), face = (int)(s->code[i] >> 2 * s->bits);
    const double(*at)[2] = envmapi_tent[places - 1];
    double one[3] = {s->x[i], s->y[i], s->z[i]}, uv[2];
    envmapi_project(uv, mapping, face, one);
    for (int j = 0; j < n; ++j) {
        envmapi_direction(one, mapping, face, uv[0] + tent * at[j % places][0] / width,
                          uv[1] + tent * at[j / places][0] / edge);
        for (int c = 0; c < 3; ++c) d[c * n + j] = one[c];
    }
}

/* Keeps those of all texels, for many axes; speed only, and not where they are too many. */
static envmap_result envmapi_source_spread(envmapi_source *s, double tent, int places,
                                           void *memory) {
    size_t n = (size_t)(places * places);
    if (s->tents) ENVMAP_FREE(memory, s->tents);
    s->tents = NULL, s->tent = tent, s->places = places;
    if (!(tent > 0) || s->count * n > ENVMAPI_FEW) return ENVMAP_OK;
    s->tents = (double *)ENVMAP_MALLOC(memory, s->count * 3 * n * sizeof(double));
    if (!s->tents) return ENVMAP_ERROR_MEMORY;
    for (size_t i = 0; i < s->count; ++i)
        envmapi_source_tent(s->tents + 3 * n * i, s, i, tent, places);
    return ENVMAP_OK;
}

/* Points of light whose sum against any k is the definition's. */
typedef struct envmapi_points {
    envmapi_rings *rings; /* NULL: they are only counted */
    size_t count;
    double d[3][ENVMAPI_CHUNK];
} envmapi_points;

static void envmapi_points_add(envmapi_points *p, const double d[3], const double rgb[3],
                               double w) {
    size_t n = p->count++, at = n % ENVMAPI_CHUNK;
    for (int c = 0; c < 3; ++c) p->d[c][at] = d[c];
    if (!p->rings) return;
    for (int c = 0; c < 3; ++c) p->rings->values[4 * n + (size_t)c] = (float)(w * rgb[c]);
    p->rings->values[4 * n + 3] = (float)w, p->rings->count = p->count;
    if (at + 1 == ENVMAPI_CHUNK) envmapi_points_of(p->rings->points + n - at, p->d, ENVMAPI_CHUNK);
}

/* ------------------------------------------------------------------------------------ >>axis --
   What one axis sums of a source, for >>reference, which says how much of each.
     in     a source, a lobe, its p, an axis a      out    sum k L w and sum k w, or what each
                                                           texel counts, or points (of any axis)
       texels at centres, or spread by tents             _axis_sum, _axis_tent_k
       points of their bilinear radiance, on patches
       that end where it has kinks, by Gauss-Legendre    _patch_add, _patch_sum, _patch_node
   Tests: tests/test_filters.c, tests/test_search.c (the_oracle_is_the_reference). */

#define ENVMAPI_GAUSS 12 /* nodes of the largest rule */

/* One axis, what its lobe is to this source, and the sums so far. */
typedef struct envmapi_axis {
    const envmapi_source *source;
    const envmap_lobe *lobe;
    envmapi_level level; /* of the source, for lookups */
    double a[3], p;
    double from, to;    /* support of the lobe, rad (envmap_lobe_support) */
    double texel, tent; /* side of the mean texel, rad; t of the card */
    double bilinear;    /* share of the bilinear radiance, 0 .. 1 */
    double sigma, reach;    /* rad: of the lobe; up to here it may be sharp */
    int curves, kink_count; /* parts of a patch; kinks of the lobe */
    int places;             /* of a tent, a side: the definition's four, or fewer */
    double kinks[ENVMAPI_KINKS];
    double gauss[ENVMAPI_GAUSS - 1][ENVMAPI_GAUSS][2]; /* node and weight of rules of 2 .. 12 */
    double sum[4];          /* sum_i k L_i w_i, red, green and blue, and sum_i k w_i */
    double *light;          /* sum; or, where the level has no texels, [texels] what each counts */
    double sight;           /* rad: integrals end where so little is left of the lobe; to */
    double least;           /* |k| below which a node is passed by: 0 */
    double apart;           /* of nodes on circles, 1 from 1e-3 on: less at tight tolerances */
    envmapi_points *points; /* NULL, or where the definition's points go instead of being summed */
} envmapi_axis;

/* The cosine of an angle that may be none: below and above all cosines there. */
static double envmapi_cosine(double angle) {
    return angle > ENVMAPI_PI ? -2 : angle < 0 ? 2 : cos(angle);
}

/* What of k is not in the tail; 1 at cosines down to whole_to. */
static double envmapi_axis_fade(const envmapi_axis *axis, double x, double whole_to) {
    if (!(x < whole_to)) return 1;
    return 1 - envmapi_smooth_step(envmapi_acos(x), axis->reach / 2, axis->reach);
}

/* k averaged over texel i spread by the tent; or adds the points of that. */
static double envmapi_axis_tent_k(const envmapi_axis *axis, size_t i, double whole_to) {
    const envmapi_source *s = axis->source;
    int places = axis->places, n = places * places;
    const double(*at)[2] = envmapi_tent[places - 1];
    int kept = s->tents && s->places == places && s->tent >= axis->tent && s->tent <= axis->tent;
    double room[48], x[16] = {0}, k[16], sum = 0, rgb[3];
    const double *d = kept ? s->tents + 3 * n * (ptrdiff_t)i : room;
    if (!kept) envmapi_source_tent(room, s, i, axis->tent, places);
    for (int j = 0; j < n && axis->points; ++j) {
        double one[3] = {d[j], d[n + j], d[2 * n + j]};
        double weight = at[j % places][1] * at[j / places][1];
        for (int c = 0; c < 3; ++c) rgb[c] = (double)envmapi_source_rgb(s, i)[c];
        envmapi_points_add(axis->points, one, rgb, (1 - axis->bilinear) * s->w[i] * weight);
    }
    if (axis->points) return 0;
    for (int j = 0; j < n; ++j)
        x[j] = axis->a[0] * d[j] + axis->a[1] * d[n + j] + axis->a[2] * d[2 * n + j];
    envmapi_k_many(k, x, n, axis->lobe, axis->p);
    for (int j = 0; j < n; ++j)
        sum += at[j % places][1] * at[j / places][1] * envmapi_axis_fade(axis, x[j], whole_to) *
               k[j];
    return sum;
}

/* Adds k times n texels. */
static void envmapi_axis_add(envmapi_axis *axis, const size_t *texels, const double *k, int n) {
    const envmapi_source *s = axis->source;
    double red = 0, green = 0, blue = 0, all = 0; /* an array is 1.3 x */
    for (int j = 0; j < n; ++j) {
        double one = k[j] * s->w[texels[j]];
        const float *rgb = axis->level.texels ? envmapi_source_rgb(s, texels[j]) : NULL;
        all += one;
        if (rgb) red += one * (double)rgb[0], green += one * (double)rgb[1];
        if (rgb) blue += one * (double)rgb[2];
        else axis->light[s->place[texels[j]]] += one;
    }
    axis->sum[0] += red, axis->sum[1] += green, axis->sum[2] += blue, axis->sum[3] += all;
}

/* The texels i .. end - 1, at most 64 of them, whose cosines to the axis are last .. first. */
static int envmapi_axis_seen(size_t *seen, double *x, const envmapi_axis *axis, size_t *i,
                             size_t end, double last, double first) {
    const envmapi_source *s = axis->source;
    int n = 0;
    for (; *i < end && n < 64; ++*i) {
        x[n] = axis->a[0] * s->x[*i] + axis->a[1] * s->y[*i] + axis->a[2] * s->z[*i];
        seen[n] = *i, n += (x[n] >= last) & (x[n] <= first);
    }
    return n;
}

/* Adds the sum over texels, times `share`. core > 0: texels at their centres, from there on; else
   their tents, to two mean texels beyond the lobe's ends. fades: to the reach. */
static void envmapi_axis_sum(envmapi_axis *axis, double share, double core, int fades) {
    const envmapi_source *s = axis->source;
    double margin = axis->tent > 0 && !(core > 0) ? 2 * axis->texel : 0;
    double end = (fades ? fmin(axis->reach, axis->to) : axis->to) + margin + 1e-9;
    double last = envmapi_cosine(end), low = axis->from - margin - 1e-9, x[64], many[64];
    double first = envmapi_cosine(low), sine = sin(low), last_sine = sin(end);
    double whole_from = core > 0 ? envmapi_cosine(core) : 2; /* between these nothing fades */
    double whole_to = fades ? envmapi_cosine(axis->reach / 2) : -2;
    int plain = !(margin > 0) && !fades && !(core > 0);
    size_t seen[64];
    for (size_t tile = 0; tile < s->tiles; ++tile) {
        double middle = envmapi_dot(axis->a, s->centre[tile]);
        double c = s->centre[tile][3], r = s->centre[tile][4]; /* beyond a ring, or within: */
        if (end < ENVMAPI_PI && last_sine * c + last * r > 0 && middle < last * c - last_sine * r)
            continue;
        if (low > 0 && sine * c - first * r > 0 && middle > first * c + sine * r) continue;
        for (size_t next = s->first[tile]; next < s->first[tile + 1];) {
            int n = envmapi_axis_seen(seen, x, axis, &next, s->first[tile + 1], last, first);
            if (!(margin > 0)) envmapi_k_many(many, x, n, axis->lobe, axis->p); /* speed only */
            for (int j = 0; j < n && plain; ++j) many[j] *= share;
            for (int j = 0; j < n && !plain; ++j) {
                double step = margin > 0 ? share : share * envmapi_axis_fade(axis, x[j], whole_to);
                if (margin > 0) many[j] = envmapi_axis_tent_k(axis, seen[j], whole_to);
                if (x[j] > whole_from)
                    step *= envmapi_smooth_step(envmapi_acos(x[j]), core / 2, core);
                many[j] = step > 0 ? step * many[j] : 0;
            }
            envmapi_axis_add(axis, seen, many, n);
        }
    }
}

/* A part of a face's quadrant: (p,q) = (|2u - 1| width, |2v - 1| edge), whole numbers on the edges
   of texels and on the lines through their centres. */
#define ENVMAPI_MANY 4000000 /* points, beyond which memory would be much */
#define ENVMAPI_PATCHES 64 /* 15 halvings a side to the largest map's texel, and a few more */
typedef struct envmapi_patch {
    double from[2], to[2];
    int face, quadrant;
} envmapi_patch;

/* (p,q) to (u,v) and the direction there. */
static void envmapi_patch_at(double uv[2], double d[3], const envmapi_axis *axis,
                             const envmapi_patch *patch, double p, double q) {
    uv[0] = 0.5 + (patch->quadrant & 1 ? 0.5 : -0.5) * p / axis->level.width;
    uv[1] = 0.5 + (patch->quadrant & 2 ? 0.5 : -0.5) * q / axis->level.edge;
    envmapi_direction(d, axis->level.mapping, patch->face, uv[0], uv[1]);
}

/* The paraboloids' faces are summed apart, out to where the other one has all: so the lines of one
   face's texels are no kinks of the other's sum. A face of one texel has none, and reaches far. */
static int envmapi_patches_apart(const envmapi_level *level) {
    return level->mapping == ENVMAP_PARABOLOID && level->edge > 1;
}

/* Adds the point there, of bilinear radiance; counts it, where there are no rings yet. */
static void envmapi_patch_node(envmapi_axis *axis, const envmapi_patch *patch, double p, double q,
                               double weight) {
    const envmapi_level *level = &axis->level;
    double uv[2], d[3], rgb[3] = {0, 0, 0};
    if (!axis->points->rings) {
        ++axis->points->count;
        return;
    }
    envmapi_patch_at(uv, d, axis, patch, p, q);
    weight *= axis->bilinear * envmapi_density(level->mapping, uv[0], uv[1]);
    if (envmapi_patches_apart(level))
        weight *= envmapi_paraboloid_share(hypot(p, q) / level->edge, level->edge);
    if (level->mapping == ENVMAP_PARABOLOID && level->edge == 1)
        envmapi_add_lookup(rgb, level, d, 1);
    else envmapi_add_bilinear(rgb, level, patch->face, uv[0], uv[1], 1);
    envmapi_points_add(axis->points, d, rgb, weight);
}

/* Where integrands have kinks off the lines: q at p on curve i, from the inside out. That is an
   octahedral map's horizon; where paraboloids begin to blend, their rim, and where they end. */
static double envmapi_patch_curve(const envmapi_level *level, int i, double p) {
    int mapping = level->mapping, n = level->edge;
    if (i < 0) return -1;
    if (mapping == ENVMAP_OCTAHEDRAL && !i) return n - p;
    if (!envmapi_is_disc(mapping)) return 1e9;
    double r = n;
    if (envmapi_patches_apart(level)) r = i == 0 ? n - 1 : i == 1 ? n : r * n / (n - 1);
    return r > p ? sqrt((r - p) * (r + p)) : 0;
}

/* Adds what lies between curve - 1 and curve, with so many nodes along p and q. The outer
   coordinate is the one along which the curves are flatter; its range is cut where a curve enters
   or leaves the patch. On a sphere map the inner one is rim sin t, nodes lie along t, as directions
   have a root at the rim that t has not. */
static void envmapi_patch_sum(envmapi_axis *axis, const envmapi_patch *patch, int curve,
                              const int nodes[2]) {
    const envmapi_level *level = &axis->level;
    int outer = patch->from[0] > patch->from[1], inner = !outer;
    double p[2], end[6] = {patch->from[outer], 0, 0, 0, 0, patch->to[outer]}, swap;
    double unit = 0.25 / level->width / level->edge; /* du dv over dp dq */
    for (int i = 0; i < 4; ++i)
        end[1 + i] = envmapi_patch_curve(level, curve - 1 + (i >> 1),
                                         i & 1 ? patch->from[inner] : patch->to[inner]);
    if (end[2] > end[3]) swap = end[2], end[2] = end[3], end[3] = swap;
    for (int i = 1; i < 5; ++i) end[i] = envmapi_clamp(end[i], end[0], end[5]);
    for (int i = 0; i < 5 * nodes[outer]; ++i) {
        double from = end[i / nodes[outer]], to = end[i / nodes[outer] + 1];
        const double *g = axis->gauss[nodes[outer] - 2][i % nodes[outer]];
        p[outer] = (from + to + g[0] * (to - from)) / 2;
        double low = fmax(patch->from[inner], envmapi_patch_curve(level, curve - 1, p[outer]));
        double high = fmin(patch->to[inner], envmapi_patch_curve(level, curve, p[outer]));
        if (!(from < to && low < high)) continue;
        double rim = level->mapping == ENVMAP_SPHERE ? envmapi_patch_curve(level, 0, p[outer]) : 0;
        if (rim > 0) low = asin(low / rim), high = asin(fmin(high / rim, 1));
        for (int j = 0; j < nodes[inner]; ++j) {
            const double *h = axis->gauss[nodes[inner] - 2][j];
            double weight = unit * g[1] * h[1] * (to - from) * (high - low) / 4;
            p[inner] = (low + high + h[0] * (high - low)) / 2;
            if (rim > 0) weight *= rim * cos(p[inner]), p[inner] = rim * sin(p[inner]);
            envmapi_patch_node(axis, patch, p[0], p[1], weight);
        }
    }
}

/* Adds a patch that lies between lines where six nodes a side suffice, for 0.9 sigma. Else returns
   1, and its halves. */
static int envmapi_patch_add(envmapi_axis *axis, const envmapi_patch *patch,
                             envmapi_patch half[2]) {
    double corner[4][3], uv[2], length[2], size[2];
    for (int i = 0; i < 4; ++i)
        envmapi_patch_at(uv, corner[i], axis, patch, i & 1 ? patch->to[0] : patch->from[0],
                         i & 2 ? patch->to[1] : patch->from[1]);
    int nodes[2], whole = 1;
    for (int i = 0; i < 2; ++i) {
        length[i] = fmax(envmapi_angle(corner[0], corner[i ? 2 : 1]),
                         envmapi_angle(corner[3], corner[i ? 1 : 2]));
        nodes[i] = (int)fmin(1.5 + 5 * length[i] / fmin(axis->sigma, 1), 100);
        size[i] = patch->to[i] - patch->from[i];
        if (size[i] > 1) whole = 0;
    }
    if (whole && nodes[0] <= 5 && nodes[1] <= 5) {
        ++nodes[0], ++nodes[1];
        for (int i = 0; i < axis->curves; ++i) envmapi_patch_sum(axis, patch, i, nodes);
        return 0;
    }
    half[0] = half[1] = *patch;
    int cut = whole ? length[1] > length[0] : size[1] > size[0];
    half[0].to[cut] = half[1].from[cut] =
        patch->from[cut] + (whole ? size[cut] / 2 : floor((size[cut] + 1) / 2));
    return 1;
}

/* The points of all patches. */
static void envmapi_axis_patches(envmapi_axis *axis) {
    envmapi_patch todo[ENVMAPI_PATCHES], patch = {{0, 0}, {0, 0}, 0, 0};
    patch.to[0] = axis->level.width, patch.to[1] = axis->level.edge;
    for (int i = 0; i < 2 && envmapi_patches_apart(&axis->level); ++i) patch.to[i] += 2;
    for (int i = 0; i < 4 * envmap_faces(axis->level.mapping); ++i) {
        int count = 1;
        patch.face = i / 4, patch.quadrant = i % 4, todo[0] = patch;
        while (count && axis->points->count <= ENVMAPI_MANY) {
            envmapi_patch one = todo[--count];
            if (envmapi_patch_add(axis, &one, todo + count) && count + 4 <= ENVMAPI_PATCHES)
                count += 2;
        }
    }
}

/* --------------------------------------------------------------------------------- >>circles --
   The integral of k over the bilinear radiance, in polar coordinates: texels may be long and thin,
   and a lobe may have edges.
     in     an axis as >>axis has it      out    the same sums
   A chart is a disc, a lat-long, a face of a cube or of the octahedron. On a circle of angle rho
   about its middle, u and v of a chart are at + grow R(rho) cos(phi - turn), of a lat-long phi
   and rho themselves.
       charts; R(rho)                                        _chart_of; _chart_radius
       panels of rho end where circles touch a line through
       texel centres, a side of the chart, a kink of k       _axis_circles, _chart_touches
       arcs end at a chart's sides, and where a kink of k is at sin^2(phi/2) = (sin^2(kink/2) -
       sin^2((rho - alpha)/2)) / (sin rho sin alpha)         _chart_circle, _chart_half
       pieces of an arc end where it crosses lines           _chart_arc, _chart_cross
       Gauss-Legendre of k times what four texels count      _chart_piece, _chart_add
   Source: ours.  Test: works_that_broke_hold, of tests/test_search.c. */

typedef struct envmapi_chart {
    envmapi_axis *axis;
    int face, sides;
    double t[3], b[3], e[3];           /* e: its middle; phi goes from t to b */
    double side[4][3];                 /* along t, b and e: at least 0 times what lies in it */
    double at[2], grow[2], turn[2][2]; /* in texels from the first one's centre; cosine and sine */
    double share, whole_to, end;       /* whole_to: cosine to which k is in no tail; rad */
    double alpha, phi, a[2];           /* of the axis: rho, phi, and the cosine and sine of this */
    double cut[2];                     /* rho between which a side cuts the middle of the lobe */
    double few, more;          /* nodes of a piece: few + more sqrt(its length) */
    double most, root;         /* longest piece; where x^N ends with a root (0: no such lobe) */
    double kinked, tail;       /* a sixth of the nodes of a panel in which kinks cross lines; rad,
                                  from here on pieces grow, to a texel: longer ones end at lines */
    double rho, sine;   /* of a circle */
    double base[2], wave[2][2]; /* its coordinates: base + wave . (cos phi, sin phi); */
    double swing[2];            /* |wave| */
    double along, across;       /* its cosines to the axis: along cos(phi - axis' phi) + across */
    double weight, pole;        /* pole: what the mean of a lat-long's first or last row counts */
} envmapi_chart;

/* R of a circle; where R is r. */
static double envmapi_chart_radius(int mapping, double rho) {
    if (mapping == ENVMAP_SPHERE) return sin(rho / 2);
    if (mapping == ENVMAP_PARABOLOID) return tan(rho / 2);
    return mapping == ENVMAP_CUBE || mapping == ENVMAP_OCTAHEDRAL ? tan(rho) : rho / ENVMAPI_PI;
}

static double envmapi_chart_angle(int mapping, double r) {
    if (mapping == ENVMAP_SPHERE) return r < 1 ? 2 * asin(r) : ENVMAPI_PI;
    if (mapping == ENVMAP_PARABOLOID) return 2 * atan(r);
    return mapping == ENVMAP_CUBE || mapping == ENVMAP_OCTAHEDRAL ? atan(r) : ENVMAPI_PI * r;
}

/* How many charts a map has. */
static int envmapi_charts(int mapping) {
    return mapping == ENVMAP_OCTAHEDRAL ? 8 : envmap_faces(mapping);
}

/* Coordinate i grows by `by` (along t and b) for each R. */
static void envmapi_chart_grows(envmapi_chart *h, int i, double at, double by_t, double by_b) {
    h->at[i] = at, h->grow[i] = hypot(by_t, by_b);
    h->turn[i][0] = h->grow[i] > 0 ? by_t / h->grow[i] : 1;
    h->turn[i][1] = h->grow[i] > 0 ? by_b / h->grow[i] : 0;
}

/* An octant of an octahedral map: its directions are d = s/3 + tan(rho) (cos phi t + sin phi b) /
   sqrt 3 on the octahedron, s the octant's signs, and u and v are of these as >>directions says. */
static void envmapi_chart_octant(envmapi_chart *h, int octant) {
    double n = h->axis->level.edge, s[3], root = sqrt(1.0 / 3);
    for (int c = 0; c < 3; ++c) s[c] = octant >> c & 1 ? 1 : -1, h->e[c] = root * s[c];
    envmapi_tangents(h->t, h->b, h->e, NULL), h->sides = 3;
    for (int c = 0; c < 3; ++c) {
        h->side[c][0] = s[c] * h->t[c], h->side[c][1] = s[c] * h->b[c], h->side[c][2] = root;
    }
    for (int i = 0; i < 2; ++i) { /* X and Y; below the horizon X is sign x (1 - |z|) */
        int c = (s[1] > 0) == !i ? 0 : 2;
        double sign = s[1] > 0 ? 1 : -s[0] * s[2];
        double middle = s[1] > 0 ? s[2 * i] / 3 : s[2 * i] * 2 / 3;
        envmapi_chart_grows(h, i, (0.5 + 0.5 * middle) * n - 0.5, 0.5 * n * sign * root * h->t[c],
                            0.5 * n * sign * root * h->b[c]);
    }
}

/* Chart i of the axis' map. Returns rho of its farthest point. */
static double envmapi_chart_of(envmapi_chart *h, int i) {
    const envmapi_level *level = &h->axis->level;
    int mapping = level->mapping;
    double n = level->edge, middle[3];
    h->face = i, h->sides = 0;
    memset(h->t, 0, sizeof h->t), memset(h->b, 0, sizeof h->b), memset(h->e, 0, sizeof h->e);
    h->t[0] = h->b[1] = 1;
    if (mapping == ENVMAP_OCTAHEDRAL) {
        h->face = 0, envmapi_chart_octant(h, i);
        return atan(sqrt(2.0));
    }
    envmapi_chart_grows(h, 0, (n - 1) / 2, n / 2, 0);
    if (mapping == ENVMAP_LATLONG) {
        h->e[1] = 1, h->t[0] = 0, h->t[2] = -1, h->b[1] = 0, h->b[0] = 1;
        envmapi_chart_grows(h, 1, -0.5, n, 0);
        return ENVMAPI_PI;
    }
    envmapi_chart_grows(h, 1, (n - 1) / 2, 0, mapping == ENVMAP_CUBE ? n / 2 : -n / 2);
    if (mapping == ENVMAP_CUBE) {
        for (int c = 0; c < 3; ++c)
            h->t[c] = envmapi_cube[i][0][c], h->b[c] = envmapi_cube[i][1][c],
            h->e[c] = envmapi_cube[i][2][c];
        for (h->sides = 0; h->sides < 4; ++h->sides) {
            double *side = h->side[h->sides];
            side[0] = side[1] = 0, side[2] = sqrt(0.5);
            side[h->sides / 2] = h->sides % 2 ? sqrt(0.5) : -sqrt(0.5);
        }
        return atan(sqrt(2.0));
    }
    envmapi_direction(middle, mapping, i, 0.5, 0.5), h->e[2] = middle[2];
    if (mapping != ENVMAP_PARABOLOID) return ENVMAPI_PI;
    if (n > 1) return 2 * atan(n / (n - 1)); /* to the end of its share */
    h->grow[0] = h->grow[1] = 0;             /* all is one texel */
    return ENVMAPI_PI;
}

/* Nodes for a piece of this length over the lobe's scale; *parts of it, none longer than `most`,
   have so many each. */
static int envmapi_chart_nodes(int *parts, const envmapi_chart *h, double length, double most) {
    *parts = length < most ? 1 : length < 1e6 * most ? 1 + (int)(length / most) : 1000000;
    double each = *parts > 1 ? length / *parts : length > 0 ? length : 0;
    double nodes = h->few + h->more * sqrt(each);
    return nodes < 2 ? 2 : nodes < ENVMAPI_GAUSS ? (int)nodes : ENVMAPI_GAUSS;
}

/* Nodes crowd at both ends of a piece where there may be a root. Returns the slope. */
static double envmapi_chart_grade(double *at) {
    double t = *at;
    *at = t * t * (3 - 2 * t);
    return 6 * t * (1 - t);
}

/* The scale of k at an angle from the axis or beyond: how far GGX's pole is; a function's at least
   an eighth of what a bell's tail needs. */
static double envmapi_chart_scale(const envmapi_axis *axis, double away) {
    double scale = axis->sigma;
    if (axis->lobe->kind == ENVMAP_LOBE_GGX) scale = sqrt(3.24 * scale * scale + away * away);
    else if (axis->lobe->kind >= ENVMAP_LOBE_FUNCTION && !axis->kink_count)
        scale /= 2; /* may have kinks anywhere */
    if (axis->lobe->kind >= ENVMAP_LOBE_FUNCTION) scale = fmax(scale, away / 24);
    return fmin(scale, 1);
}

/* Adds what a cell counts of its texels: (x,y), its neighbours in x, in y, in both. As lookups do,
   the row beyond a lat-long's pole is twice a row's mean less that row, the texel beyond a cube's
   corner the mean of the other three. */
static void envmapi_chart_add(envmapi_chart *h, int x, int y, double w[4]) {
    const envmapi_level *level = &h->axis->level;
    int n = level->edge, beyond = y < 0 ? 0 : 2;
    if (level->mapping == ENVMAP_LATLONG && (y < 0 || y >= n - 1))
        for (int i = 0; i < 2; ++i)
            h->pole += 2 * w[beyond + i], w[2 - beyond + i] -= w[beyond + i], w[beyond + i] = 0;
    if (level->mapping == ENVMAP_CUBE && (x < 0 || x >= n - 1) && (y < 0 || y >= n - 1)) {
        int corner = (x < 0 ? 0 : 1) + beyond;
        double third = w[corner] / 3;
        for (int i = 0; i < 4; ++i) w[i] = i == corner ? 0 : w[i] + third;
    }
    for (int i = 0; i < 4; ++i)
        if (!(w[i] >= 0 && w[i] <= 0))
            envmapi_add_tap(h->axis->light, level, h->face, x + (i & 1), y + (i >> 1), w[i]);
}

/* Where coordinate i is at phi, whose cosine and sine these are. */
static double envmapi_chart_place(const envmapi_chart *h, int i, double c, double s) {
    if (h->axis->level.mapping == ENVMAP_LATLONG && !i)
        return (atan2(s, c) / (2 * ENVMAPI_PI) + 0.5) * h->axis->level.width - 0.5;
    return h->base[i] + h->wave[i][0] * c + h->wave[i][1] * s;
}

/* Adds a piece from e to f, unit vectors of phi. Nodes lie along t, the tangent of the angle from
   its middle. What they count of their four texels is summed first. root: x^N ends with it. */
static void envmapi_chart_piece(envmapi_chart *h, const double e[2], const double f[2], int root) {
    envmapi_axis *axis = h->axis;
    double half = 1 / sqrt(2 + 2 * (e[0] * f[0] + e[1] * f[1])), w[4] = {0, 0, 0, 0};
    double T = 2 * half * half * (e[0] * f[1] - e[1] * f[0]);
    double m[2] = {half * (e[0] + f[0]), half * (e[1] + f[1])};
    double look = fmax(e[0] * h->a[0] + e[1] * h->a[1], f[0] * h->a[0] + f[1] * h->a[1]);
    double scale = envmapi_chart_scale(axis, sqrt(fmax(2 - 2 * (h->along * look + h->across), 0)));
    double at_x = envmapi_chart_place(h, 0, m[0], m[1]), x = floor(at_x);
    double y = floor(envmapi_chart_place(h, 1, m[0], m[1]));
    /* 1 + t^2 has a pole, too */
    int parts, nodes = envmapi_chart_nodes(&parts, h, 2 * T * fmax(h->sine / scale, 2),
                                           root ? h->root : h->most);
    int round = axis->level.mapping == ENVMAP_LATLONG;
    double c[ENVMAPI_GAUSS], s[ENVMAPI_GAUSS], t[ENVMAPI_GAUSS], each[ENVMAPI_GAUSS];
    double dot[ENVMAPI_GAUSS], k[ENVMAPI_GAUSS];
    double step = parts > 1 ? 1.0 / parts : 1, weight = h->weight * T * step;
    for (int part = 0; part < parts && T > 0; ++part) {
        for (int i = 0; i < nodes; ++i) {
            const double *g = axis->gauss[nodes - 2][i];
            double at = (part + (1 + g[0]) / 2) * step;
            double slope = root ? envmapi_chart_grade(&at) : 1;
            t[i] = T * (2 * at - 1);
            double square = 1 / (1 + t[i] * t[i]), unit = sqrt(square);
            c[i] = (m[0] - t[i] * m[1]) * unit, s[i] = (m[1] + t[i] * m[0]) * unit;
            dot[i] = h->along * (c[i] * h->a[0] + s[i] * h->a[1]) + h->across;
            each[i] = weight * slope * g[1] * square;
        }
        envmapi_k_many(k, dot, nodes, axis->lobe, axis->p);
        for (int i = 0; i < nodes; ++i) {
            if (fabs(k[i]) < axis->least) continue;
            each[i] *= k[i] * envmapi_axis_fade(axis, dot[i], h->whole_to);
            double fx = h->base[0] + h->wave[0][0] * c[i] + h->wave[0][1] * s[i];
            double fy = h->base[1] + h->wave[1][0] * c[i] + h->wave[1][1] * s[i];
            if (round) fx = at_x + atan(t[i]) / (2 * ENVMAPI_PI) * axis->level.width;
            fx = envmapi_clamp(fx - x, 0, 1), fy = envmapi_clamp(fy - y, 0, 1);
            w[0] += (1 - fx) * (1 - fy) * each[i], w[1] += fx * (1 - fy) * each[i];
            w[2] += (1 - fx) * fy * each[i], w[3] += fx * fy * each[i], axis->sum[3] += each[i];
        }
    }
    envmapi_chart_add(h, (int)x, (int)y, w);
}

/* The next line through texel centres that an arc crosses, and where. */
typedef struct envmapi_crossing {
    double line, at[2];
    int falls, is; /* the coordinate falls along the arc; there is one */
    int turns;     /* how often it has turned: once at most, in a quarter of a circle */
} envmapi_crossing;

static void envmapi_chart_cross(envmapi_crossing *next, const envmapi_chart *h, int i) {
    double R = h->swing[i];
    next->is = 0;
    if (h->axis->level.mapping == ENVMAP_LATLONG) {
        double phi = 2 * ENVMAPI_PI * ((next->line + 0.5) / h->axis->level.width - 0.5);
        next->at[0] = cos(phi), next->at[1] = sin(phi), next->is = !i;
        return;
    }
    for (; next->turns < 2 && !next->is; next->turns += !next->is) {
        double c = R > 0 ? (next->line - h->base[i]) / R : 2;
        next->is = fabs(c) < 1;
        double s = (next->falls ? 1 : -1) * sqrt(fmax(1 - c * c, 0));
        next->at[0] = c * h->turn[i][0] - s * h->turn[i][1];
        next->at[1] = c * h->turn[i][1] + s * h->turn[i][0];
        if (!next->is) next->falls = !next->falls, next->line += next->falls ? -1 : 1;
    }
}

/* Grows with the angle from e to f; what rounding takes behind e is at e. */
static double envmapi_chart_ahead(const double e[2], const double f[2]) {
    double c = e[0] * f[0] + e[1] * f[1], s = e[0] * f[1] - e[1] * f[0];
    if (c > 0 && s < 0 && s > -1e-7) return 0;
    return s >= 0 ? 1 - c : 3 + c;
}

/* Adds the arc between two phi; x^N ends with it, where roots say so. */
static void envmapi_chart_arc(envmapi_chart *h, double from, double to, int before, int behind) {
    int parts = 1 + (int)((to - from) / (ENVMAPI_PI / 2));
    for (int part = 0; part < parts; ++part) {
        double start = from + part * (to - from) / parts, stop = start + (to - from) / parts;
        double e[2] = {cos(start), sin(start)}, last[2] = {cos(stop), sin(stop)};
        envmapi_crossing next[2];
        for (int i = 0; i < 2; ++i) {
            double place = envmapi_chart_place(h, i, e[0], e[1]);
            next[i].falls = h->turn[i][0] * e[1] - h->turn[i][1] * e[0] >= 0;
            if (h->axis->level.mapping == ENVMAP_LATLONG) next[i].falls = 0;
            next[i].turns = 0;
            next[i].line = next[i].falls ? ceil(place) - 1 : floor(place) + 1;
            envmapi_chart_cross(next + i, h, i);
        }
        for (int more = 1; more;) {
            double least = envmapi_chart_ahead(e, last);
            envmapi_crossing *first = NULL;
            for (int i = 0; i < 2; ++i) {
                double ahead = next[i].is ? envmapi_chart_ahead(e, next[i].at) : 4;
                if (ahead < least) least = ahead, first = next + i;
            }
            envmapi_chart_piece(h, e, first ? first->at : last,
                                before || (behind && !first && part + 1 == parts));
            before = 0;
            more = first != NULL;
            if (!more) break;
            memcpy(e, first->at, sizeof e), first->line += first->falls ? -1 : 1;
            envmapi_chart_cross(first, h, (int)(first - next));
        }
    }
}

/* Half of what a circle has of phi within an angle of the axis; -1: nothing. */
static double envmapi_chart_half(const envmapi_chart *h, double angle) {
    double apart = sin((h->rho - h->alpha) / 2), s = sin(angle / 2);
    double square = (s - apart) * (s + apart) / fmax(h->along, 1e-300);
    return square < 0 ? -1 : 2 * asin(sqrt(fmin(square, 1)));
}

static void envmapi_chart_break(envmapi_quadrature *q, double phi) {
    if (phi > 0) envmapi_quadrature_break(q, phi), envmapi_quadrature_break(q, -phi);
}

/* Adds the circle at rho. */
static void envmapi_chart_circle(envmapi_chart *h, double rho, double weight) {
    const envmapi_axis *axis = h->axis;
    envmapi_quadrature q;
    double cosine = cos(rho), R = envmapi_chart_radius(axis->level.mapping, rho);
    int ring = axis->lobe->kind == ENVMAP_LOBE_BANKS && axis->from > 0; /* whose edge is a kink */
    double inside = ring ? cos(axis->from) : 2;
    int round = axis->level.mapping == ENVMAP_LATLONG;
    h->rho = rho, h->sine = sin(rho), h->weight = weight * h->share * h->sine, h->pole = 0;
    if (axis->level.mapping == ENVMAP_PARABOLOID)
        h->weight *= envmapi_paraboloid_share(R, axis->level.edge);
    for (int i = 0; i < 2; ++i) {
        h->base[i] = h->at[i] + (round ? h->grow[i] * R : 0), h->swing[i] = h->grow[i] * R;
        for (int k = 0; k < 2; ++k) h->wave[i][k] = round ? 0 : h->grow[i] * R * h->turn[i][k];
    }
    h->along = h->sine * sin(h->alpha), h->across = cosine * cos(h->alpha);
    q.count = 2, q.breaks[1] = envmapi_chart_half(h, h->end), q.breaks[0] = -q.breaks[1];
    if (!(q.breaks[1] > 0)) return;
    envmapi_quadrature_break(&q, 0);
    for (int i = 0; i < axis->kink_count; ++i)
        envmapi_chart_break(&q, envmapi_chart_half(h, axis->kinks[i]));
    for (double away = h->tail; away < fmin(h->end, axis->texel); away *= 3)
        envmapi_chart_break(&q, envmapi_chart_half(h, away));
    for (int i = 0; i < h->sides; ++i) {
        const double *side = h->side[i];
        double x = -cosine * side[2] / (h->sine * hypot(side[0], side[1]));
        if (!(x > -1)) continue;
        double middle = atan2(side[1], side[0]) - h->phi, wide = acos(fmin(x, 1));
        envmapi_quadrature_break(&q, remainder(middle - wide, 2 * ENVMAPI_PI));
        envmapi_quadrature_break(&q, remainder(middle + wide, 2 * ENVMAPI_PI));
    }
    for (int i = 1; i < q.count; ++i) {
        double middle = h->phi + (q.breaks[i - 1] + q.breaks[i]) / 2, least = 1;
        if (h->along * cos(middle - h->phi) + h->across > inside) continue;
        for (int k = 0; k < h->sides; ++k)
            least = fmin(least, cosine * h->side[k][2] + h->sine * (h->side[k][0] * cos(middle) +
                                                                    h->side[k][1] * sin(middle)));
        if (least > 0)
            envmapi_chart_arc(h, h->phi + q.breaks[i - 1], h->phi + q.breaks[i],
                              h->root > 0 && i == 1, h->root > 0 && i + 1 == q.count);
    }
    if (!(h->pole >= 0 && h->pole <= 0))
        for (int x = 0; x < axis->level.width; ++x)
            envmapi_add_tap(axis->light, &axis->level, 0, x, rho < 1.6 ? 0 : axis->level.edge - 1,
                            h->pole / axis->level.width);
}

/* The next rho beyond `rho` at which a circle touches a line through texel centres, or goes through
   the point where one crosses a side. */
static double envmapi_chart_touches(const envmapi_chart *h, double rho) {
    int mapping = h->axis->level.mapping, round = mapping == ENVMAP_LATLONG;
    double R = envmapi_chart_radius(mapping, rho), least = HUGE_VAL, n = h->axis->level.edge;
    if (h->sides) { /* `at` texels from its middle */
        int cube = mapping == ENVMAP_CUBE, odd = h->axis->level.edge % 2;
        double middle = cube ? 1 : 0.5, long2 = (cube ? 4 : 6) / (n * n),
               half = cube == !odd ? 0.5 : 0;
        double at = sqrt(fmax(R * R - middle, 0) / long2) + 1e-9;
        at = R * R < 0.999999 * middle ? half : floor(at - half) + 1 + half;
        least = sqrt(middle + long2 * at * at);
    }
    for (int i = round; i < 2; ++i)
        for (int sign = round ? 1 : -1; sign < 2; sign += 2) {
            double line = floor(sign * h->at[i] + h->grow[i] * R + 1e-9) + 1;
            if (h->grow[i] > 0) least = fmin(least, (line - sign * h->at[i]) / h->grow[i]);
        }
    return envmapi_chart_angle(mapping, least);
}

/* Nodes that a panel has at least: circles go through points where two lines cross, and there the
   third derivative jumps, which a kink of k does where it crosses a line, more often: a thin ring
   within a fraction of a texel. A sphere map's texels are long, and more lines cross in a panel; an
   octant's panels are short. */
static double envmapi_chart_least(const envmapi_chart *h, double from, double to) {
    const envmapi_axis *axis = h->axis;
    double away = fmax(fmax(from - h->alpha, h->alpha - to), 0), middle = (from + to) / 2;
    double last = fmin(middle + h->alpha, 2 * ENVMAPI_PI - middle - h->alpha);
    int bell = axis->lobe->kind == ENVMAP_LOBE_PHONG || axis->lobe->kind == ENVMAP_LOBE_GAUSSIAN;
    int banks = axis->lobe->kind == ENVMAP_LOBE_BANKS;
    double unit = banks ? fmin(axis->texel, 4 * axis->sigma) : axis->texel;
    double least = banks || away < 6 * axis->sigma ? 8 : bell ? 0 : 2.6;
    for (int i = 0; i < axis->kink_count; ++i)
        if (axis->lobe->kind == ENVMAP_LOBE_FUNCTION ||
            (fabs(middle - h->alpha) < axis->kinks[i] && axis->kinks[i] < last))
            least = fmax(least, 6 * h->kinked);
    double shortest = 1;
    if (axis->level.mapping == ENVMAP_OCTAHEDRAL && axis->lobe->kind >= ENVMAP_LOBE_BANKS)
        shortest = axis->kink_count ? envmapi_clamp(axis->texel, 0.5, 1) : 0.3;
    return least * envmapi_clamp((to - from) / unit, shortest, 4) / pow(axis->apart, 0.75);
}

/* How far along a side, from its middle on, a circle cuts it. */
static double envmapi_chart_along(const envmapi_chart *h, double rho) {
    return acos(fmin(cos(rho) / sqrt(1 - h->side[0][2] * h->side[0][2]), 1));
}

/* Where a side cuts what is within 6 sigma of the axis, arcs end at k's own scale along the side,
   not along rho.  Test: works_that_broke_hold (Phong 8e4 on a cube of one texel a face). */
static void envmapi_chart_cut(envmapi_chart *h, const double a[3], envmapi_quadrature *q) {
    h->cut[0] = 4, h->cut[1] = 0;
    for (int i = 0; i < h->sides; ++i) {
        const double *side = h->side[i];
        double up = envmapi_dot(a, side), wide = 36 * pow(h->axis->sigma, 2) - up * up;
        if (!(wide > 0)) continue;
        double level = sqrt(1 - side[2] * side[2]); /* its middle is (e - side[2] side) / level */
        double x = fabs(atan2((side[0] * a[1] - side[1] * a[0]) / level,
                              (a[2] - up * side[2]) / level));
        wide = sqrt(wide);
        double from = acos(level * cos(fmax(x - wide, 0)));
        double to = acos(level * cos(fmin(x + wide, ENVMAPI_PI / 2)));
        envmapi_quadrature_break(q, from), envmapi_quadrature_break(q, to);
        h->cut[0] = fmin(h->cut[0], from), h->cut[1] = fmax(h->cut[1], to);
    }
}

/* Adds the circles of a panel. touch: where one last touched a line or a side, from which on the
   integral is a series of (rho - touch)^(1/2), so nodes are Gauss' in this; -1: nowhere. root: x^N
   ends with the panel. */
static void envmapi_chart_panel(envmapi_chart *h, double from, double to, double touch, int root) {
    const envmapi_axis *axis = h->axis;
    double away = fmax(fmax(from - h->alpha, h->alpha - to), 0);
    double length = to - from, least = envmapi_chart_least(h, from, to);
    if (from < h->cut[1] && to > h->cut[0])
        length = fmax(length, envmapi_chart_along(h, to) - envmapi_chart_along(h, from));
    length /= envmapi_chart_scale(axis, away);
    int parts, nodes = envmapi_chart_nodes(&parts, h, length, root ? h->root : h->most);
    if (touch >= 0 && from - touch < to - from) nodes += 2;
    if (nodes * parts < least) parts = 1 + (int)(least / 10), nodes = 1 + (int)(least / parts);
    nodes = nodes < ENVMAPI_GAUSS ? nodes : ENVMAPI_GAUSS;
    for (int k = 0; k < parts * nodes; ++k) {
        const double *g = axis->gauss[nodes - 2][k % nodes];
        double at = (k / nodes + (1 + g[0]) / 2) / parts, rho, slope = (to - from) / parts;
        double low = from + k / nodes * slope, high = low + slope;
        if (root) slope *= envmapi_chart_grade(&at), rho = from + (to - from) * at;
        else if (touch >= 0) {
            low = sqrt(low - touch), high = sqrt(high - touch);
            at = (low + high + (high - low) * g[0]) / 2, slope = (high - low) * 2 * at;
            rho = touch + at * at;
        } else rho = from + (to - from) * at;
        envmapi_chart_circle(h, rho, slope * g[1] / 2);
    }
}

/* The integral over a chart that ends at rho = most. Panels end where a circle touches
   a line, a kink or a side: there is a root of power 3/2, 1/2 at a side. */
static void envmapi_chart_sum(envmapi_chart *h, double most) {
    const envmapi_axis *axis = h->axis;
    double a[3], end = h->end, side = 4, n = axis->level.edge;
    int round = axis->level.mapping == ENVMAP_LATLONG; /* circles lie on rows */
    envmapi_quadrature q;
    for (int c = 0; c < 3; ++c) a[c] = envmapi_dot(axis->a, c == 0 ? h->t : c == 1 ? h->b : h->e);
    for (int i = 0; i < h->sides && end < ENVMAPI_PI / 2; ++i)
        if (envmapi_dot(a, h->side[i]) < -sin(end)) return;
    h->alpha = atan2(hypot(a[0], a[1]), a[2]), h->phi = atan2(a[1], a[0]);
    h->a[0] = cos(h->phi), h->a[1] = sin(h->phi);
    q.count = 2, q.breaks[0] = fmax(h->alpha - end, 0), q.breaks[1] = fmin(h->alpha + end, most);
    if (!(q.breaks[0] < q.breaks[1])) return;
    envmapi_quadrature_break(&q, h->alpha), envmapi_quadrature_break(&q, end - h->alpha);
    envmapi_quadrature_break(&q, 2 * ENVMAPI_PI - end - h->alpha);
    for (double away = h->tail; away < fmin(end, axis->texel); away *= 3)
        envmapi_quadrature_break(&q, h->alpha - away),
            envmapi_quadrature_break(&q, h->alpha + away);
    for (int i = 0; i < axis->kink_count; ++i) {
        envmapi_quadrature_break(&q, fabs(h->alpha - axis->kinks[i]));
        envmapi_quadrature_break(
            &q, fmin(h->alpha + axis->kinks[i], 2 * ENVMAPI_PI - h->alpha - axis->kinks[i]));
    }
    if (axis->level.mapping == ENVMAP_PARABOLOID) { /* where the faces blend */
        if (n > 1) envmapi_quadrature_break(&q, 2 * atan(1 - 1 / n));
        envmapi_quadrature_break(&q, ENVMAPI_PI / 2);
    }
    if (h->sides) envmapi_quadrature_break(&q, side = asin(h->side[0][2]));
    envmapi_chart_cut(h, a, &q);
    double from = q.breaks[0], to, touch = -1;
    for (int i = 1; i < q.count; from = to) {
        to = envmapi_chart_touches(h, from);
        int last = !(to > from && to < q.breaks[i]), first = !(from > q.breaks[i - 1]);
        if (!round && (!first || fabs(from - side) < 1e-9)) touch = from;
        if (last) to = q.breaks[i++];
        envmapi_chart_panel(h, from, to, touch, h->root > 0 && (first || last));
    }
}

/* The integral of the bilinear radiance. */
static void envmapi_axis_circles(envmapi_axis *axis, double share, double reach) {
    envmapi_chart h;
    memset(&h, 0, sizeof h);
    h.axis = axis, h.share = share, h.end = fmin(reach, axis->sight);
    h.whole_to = axis->to > reach ? cos(reach / 2) : -2;
    int kind = axis->lobe->kind, root = envmapi_lobe_root(axis->lobe); /* or jumps, as a cone's */
    /* measured for Gauss' error against GGX and against a Gaussian bell, down to 1e-9 */
    double digits = 5 - 4 * log10(axis->apart), finer = pow(axis->apart, 0.8);
    int ggx = kind == ENVMAP_LOBE_GGX;
    h.few = 1.4 + 0.12 * digits, h.more = (ggx ? 0.75 : 0.5) * digits;
    h.most = kind < ENVMAP_LOBE_FUNCTION || axis->kink_count ? 2 : 1.8 * finer;
    h.root = root ? 0.36 * finer : 0;
    h.kinked = root || kind == ENVMAP_LOBE_BANKS ? 2 : 1;
    if (ggx) /* its horizon: k falls by 4/pi alpha^2 there */
        h.kinked = fmin(cbrt(4 * pow((double)axis->lobe->parameter, 2)), 1);
    h.tail = axis->lobe->kind == ENVMAP_LOBE_GGX        ? axis->sigma
             : axis->lobe->kind >= ENVMAP_LOBE_FUNCTION ? 12 * axis->sigma
                                                        : h.end;
    for (int i = 0; i < envmapi_charts(axis->level.mapping); ++i) {
        double most = envmapi_chart_of(&h, i);
        envmapi_chart_sum(&h, most);
    }
}

/* About the point where all of a sphere or angular map's rim's texels meet: how far they are too
   long and thin for patches and windows, rad; 0: there is none.
   Test: a_sphere_map_of_noise_keeps_the_tolerance. */
static double envmapi_axis_rim(const envmapi_axis *axis) {
    int mapping = axis->level.mapping;
    return mapping == ENVMAP_SPHERE ? 0.5 : mapping == ENVMAP_ANGULAR ? 2 * axis->texel : 0;
}

/* Are there such texels within R of an axis a? */
static int envmapi_axis_at_rim(const envmapi_axis *axis, const double a[3], double R) {
    double rim = envmapi_axis_rim(axis);
    double away = envmapi_acos(axis->level.mapping == ENVMAP_SPHERE ? -a[2] : a[2]);
    return rim > 0 && away < fmin(R + rim, ENVMAPI_PI);
}

/* ------------------------------------------------------------------------------- >>reference --
   The definition: every other method is held to this sum. In: a slice of src, a lobe, the slice's
   parameter p. Out: a slice of dst. For every axis a, in double,
       L(a) = sum_i k(a.l_i; p) L_i w_i / norm,   norm = sum_i k w_i | Banks' constant | 1 for raw
   over all texels i of src with a solid angle w_i > 0. The error of this sum is of second order in
   the texel while the lobe is wide: sigma >= 2 mean texels. Below that each texel is spread by a
   tent of half-width t = clamp(2 - sigma/texel, 0, 1) texels in (u,v):
       0 < t < 1   four points a side carry the tent's moments (Gauss-Jacobi on each half)
       t = 1       the spread texels are the bilinear radiance. Its integral against k is taken
                   by Gauss-Legendre on circles that end where it or k has kinks, with more nodes
                   at tighter tolerances.
   A smooth step blends the two from t = 1/2 on. Both are of k (1 - step), another step, from half
   the reach to the reach: 12 texels, 8 sigma, or thrice the angle of a function's or a table's last
   flank. The tail k step (of GGX) is smooth at a texel's scale and stays a sum over centres. So the
   result is continuous in sigma and in every texel, and N -> infinity is the bilinear lookup. No
   number of this is tuned; >>circles' are, and only say how well its integral is known.
       l_i, w_i                    envmapi_source_create, once for all axes
       sum_i k ..., tents          envmapi_axis_sum, envmapi_axis_tent_k
       the bilinear radiance       envmapi_axis_circles
       which of them, how much     envmapi_axis_aim, envmapi_axis_filter
       / norm, and all axes        envmapi_axes_row, envmapi_axes_run
       the same for all lobes      envmapi_axis_points: points that >>fast takes through bands
   Called by filters for REFERENCE and for what FAST leaves. hierarchical shares envmapi_axes,
   materials the source.  Source: ours.
   Tests: tests/test_filters.c, tests/test_stability_filters.c. */

static void envmapi_axis_filter(envmapi_axis *axis, const void *method) {
    (void)method;
    int tail = axis->tent > 0 && axis->to > axis->reach;
    if (axis->bilinear < 1) envmapi_axis_sum(axis, 1 - axis->bilinear, 0, tail);
    if (axis->bilinear > 0) envmapi_axis_circles(axis, axis->bilinear, axis->reach);
    if (tail) envmapi_axis_sum(axis, 1, axis->reach, 0);
}

/* A method that fills slices axis by axis: a task is a row of a face of one slice. */
typedef struct envmapi_axes {
    const envmap *dst;
    envmapi_axis axis; /* what every axis of the slice starts from */
    double norm;
    int slice;
    int rim;      /* only axes about a sphere map's -z that need it: others are there already */
    double lack;  /* and how far they go, rad */
    void *method; /* the method's own; then what it needs of a slice (NULL: nothing), and an axis */
    envmap_result (*prepare)(void *method, const envmapi_axis *axis, int new_source, void *memory);
    void (*filter)(envmapi_axis *axis, const void *method);
} envmapi_axes;

/* The last flank of a function or a table: the angle beyond which k falls no faster than theta^-11,
   or is next to nothing. */
static double envmapi_axis_flank(const envmap_lobe *lobe, double p, double sigma) {
    double step = fmax(sigma / 2, ENVMAPI_PI / 4096), all = 0, last = 0, before = 0;
    for (double theta = step; theta < ENVMAPI_PI && lobe->kind >= ENVMAP_LOBE_FUNCTION;
         theta += step) {
        double k = fabs(envmapi_k(lobe, cos(theta), p)), ring = before * theta * step;
        all += ring;
        if (k < before * exp(-11 * step / theta) && ring > 1e-4 * all) last = theta;
        before = k;
    }
    return last;
}

/* Makes ready for a slice of src and of `slices` of a result. */
static void envmapi_axis_aim(envmapi_axis *axis, const envmap *src, int slice, int slices,
                             double tolerance) {
    axis->level = envmapi_level_of(src, 0, src->slices > 1 ? slice : 0);
    axis->p = envmapi_slice_p(axis->lobe, slice, slices), axis->places = 4;
    axis->apart = fmin(cbrt(tolerance * 1e3), 1);
    axis->sigma = envmap_lobe_sigma(axis->lobe, axis->p);
    envmap_lobe_support(&axis->from, &axis->to, axis->lobe, axis->p);
    axis->texel = envmapi_texel_extent(src);
    axis->tent = envmapi_clamp(2 - axis->sigma / axis->texel, 0, 1);
    axis->bilinear = envmapi_smooth_step(axis->tent, 0.5, 1);
    axis->reach = fmax(fmax(12 * axis->texel, 8 * axis->sigma),
                       3 * envmapi_axis_flank(axis->lobe, axis->p, axis->sigma));
    if (axis->from > 0 || axis->reach > axis->to) axis->reach = axis->to; /* all of it */
    axis->sight = axis->to; /* k of these bells is below 1e-16 of its peak from there on */
    if (axis->lobe->kind == ENVMAP_LOBE_PHONG || axis->lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        axis->sight = fmin(axis->to, envmapi_acos(1 - 37 / fmax((double)axis->lobe->parameter, 1)));
    axis->kink_count = envmapi_lobe_kinks(axis->kinks, axis->lobe, axis->p);
    axis->curves = 1 + (src->mapping == ENVMAP_OCTAHEDRAL);
    if (envmapi_patches_apart(&axis->level)) axis->curves = 3;
    for (int n = 2; n <= ENVMAPI_GAUSS; ++n)
        for (int i = 0; i < n; ++i)
            axis->gauss[n - 2][i][1] = envmapi_gauss_many(&axis->gauss[n - 2][i][0], i, n);
}

/* A sphere map's last texels are long. Between them the sum of a lobe that has negative parts may
   be far from its integral, or nearly nothing, and what bands miss of it counts the more.
   Test: works_that_broke_hold, of tests/test_search.c. */
static int envmapi_axes_lacking(const envmap *src, const envmap_lobe *lobe, double p) {
    return src->mapping == ENVMAP_SPHERE && !lobe->raw && lobe->kind >= ENVMAP_LOBE_FUNCTION &&
           !envmapi_lobe_nonnegative(lobe, p);
}

/* The angle from -z to the last axis whose sum is 5 % off there; negative: none. */
static double envmapi_axes_lack(envmapi_axis *axis) {
    const int steps = 32; /* to one radian, above an edge of a texel and above a corner */
    double integral = envmapi_lobe_integral(axis->lobe, axis->p), last = -1;
    for (int i = 0; i < 2 * steps; ++i) {
        double t = (i / 2 + 0.5) / steps, round = i % 2 * ENVMAPI_PI / 4;
        double a[3] = {sin(t) * cos(round), sin(t) * sin(round), -cos(t)};
        memcpy(axis->a, a, sizeof a), memset(axis->sum, 0, sizeof axis->sum);
        envmapi_axis_filter(axis, NULL);
        if (!(fabs(axis->sum[3] - integral) < 0.05 * integral)) last = t + 1.0 / steps;
    }
    return last;
}

static void envmapi_axes_row(void *context, int task) {
    const envmapi_axes *axes = (const envmapi_axes *)context;
    const envmap *dst = axes->dst;
    int face = task / dst->size, y = task % dst->size;
    float *out = envmap_texel(dst, 0, axes->slice, face, 0, y);
    envmapi_axis axis = axes->axis;
    axis.light = axis.sum;
    for (int x = 0; x < envmapi_width(dst->mapping, dst->size); ++x, out += 3) {
        envmapi_texel_direction(axis.a, dst->mapping, face, dst->size, x, y);
        if (axes->rim && envmapi_acos(-axis.a[2]) > axes->lack) continue;
        memset(axis.sum, 0, sizeof axis.sum);
        axes->filter(&axis, axes->method);
        double norm = axis.lobe->raw || axes->norm > 0 ? axes->norm : axis.sum[3];
        for (int c = 0; c < 3; ++c) out[c] = envmapi_to_float(axis.sum[c] / norm);
    }
}

/* Those axes of a slice that envmapi_axes_lack tells. */
static envmap_result envmapi_axes_rim(envmapi_axes *axes, const envmap_work *work) {
    axes->axis.light = axes->axis.sum, axes->lack = envmapi_axes_lack(&axes->axis);
    if (axes->lack < 0) return ENVMAP_OK;
    return envmapi_run(work, envmapi_axes_row, axes,
                       axes->dst->size * envmap_faces(axes->dst->mapping));
}

/* Every slice k of src into slice k of dst, or src's only one into all. Who asks for the reference
   holds other sums to it: its own tolerance is at most 1e-4.
   Test: the_reference_is_as_exact_as_it_is_at_a_tight_tolerance. */
static envmap_result envmapi_axes_run(envmapi_axes *axes, const envmap *src,
                                      const envmap_filter_desc *desc) {
    envmapi_source source;
    const envmap_lobe *lobe = axes->axis.lobe;
    int count = axes->dst->size * envmap_faces(axes->dst->mapping);
    int alike = src->slices == 1 && lobe->p0 == lobe->p1, runs = alike ? 1 : axes->dst->slices;
    double tolerance = (double)desc->tolerance;
    envmap_result result = ENVMAP_OK;
    if (desc->method == ENVMAP_METHOD_REFERENCE) tolerance = fmin(tolerance, 1e-4);
    memset(&source, 0, sizeof source);
    axes->norm = envmapi_lobe_norm(lobe);
    for (int run = 0; !result && run < runs; ++run) {
        envmapi_part part;
        envmap_work work = envmapi_work_part(&part, &desc->work, run, 1, runs);
        int new_source = run == 0 || src->slices > 1;
        if (new_source) {
            envmapi_source_free(&source, desc->work.memory);
            result = envmapi_source_create(&source, src, run, desc->work.memory);
        }
        if (result) break;
        axes->slice = run, axes->axis.source = &source;
        envmapi_axis_aim(&axes->axis, src, run, axes->dst->slices, tolerance);
        if (axes->axis.bilinear < 1 && axes->filter == envmapi_axis_filter)
            result = envmapi_source_spread(&source, axes->axis.tent, axes->axis.places,
                                           desc->work.memory);
        if (axes->prepare && !result)
            result = axes->prepare(axes->method, &axes->axis, new_source, desc->work.memory);
        if (!result && axes->rim) result = envmapi_axes_rim(axes, &work);
        else if (!result) result = envmapi_run(&work, envmapi_axes_row, axes, count);
    }
    envmapi_source_free(&source, desc->work.memory);
    if (!result && alike) envmapi_copy_slices(axes->dst, 0, axes->dst->slices);
    return result;
}

/* The points of all that an axis sums, for pieces of axis->sigma. */
static void envmapi_axis_points(envmapi_axis *axis, envmapi_points *points) {
    const envmapi_source *s = axis->source;
    axis->points = points, points->count = 0;
    for (size_t i = 0; i < s->count && axis->bilinear < 1; ++i) {
        double d[3] = {s->x[i], s->y[i], s->z[i]}, rgb[3];
        for (int c = 0; c < 3; ++c) rgb[c] = (double)envmapi_source_rgb(s, i)[c];
        if (axis->tent > 0) envmapi_axis_tent_k(axis, i, -2);
        else envmapi_points_add(points, d, rgb, s->w[i]);
    }
    if (axis->bilinear > 0) envmapi_axis_patches(axis);
    size_t rest = points->count % ENVMAPI_CHUNK;
    if (points->rings)
        envmapi_points_of(points->rings->points + points->count - rest, points->d, (int)rest);
}

/* rim: only of a sphere map's axes that need it, as _axes_lack says. */
static envmap_result envmapi_filter_reference(envmap *dst, const envmap *src,
                                              const envmap_lobe *lobe, int rim,
                                              const envmap_filter_desc *desc) {
    envmapi_axes axes;
    memset(&axes, 0, sizeof axes);
    axes.dst = dst, axes.axis.lobe = lobe, axes.filter = envmapi_axis_filter, axes.rim = rim;
    return envmapi_axes_run(&axes, src, desc);
}

/* ---------------------------------------------------------------------------- >>hierarchical --
   The method of [KVHS00] 5.1, as published: two mip-maps that are walked together.
       L(a) = sum over accepted nodes n of k_n(a) E_n / norm,   E_n = sum of L_i w_i, i below n
   A node of level l stands for 2^l x 2^l texels of a face and has up to four children.
       E_n, w_n      the environment's mip-map, once for all axes: envmapi_tree_create
       k_n           the lobe's, for every axis: sampled at nodes of level 2 and averaged upward
                     (envmapi_hier_visit), sampled below where a node is opened (_hier_open)
       accepted      its children are, and for each |k_child - k_n| <= threshold * peak of k
       norm          as the reference's: sum k_n w_n over the same nodes, so constants stay
   Ours: a node stands at the centroid of its solid angle, so rims and odd sizes need no padding. A
   cone about it keeps the walk inside the lobe's support. Phong and Gaussian come from a table of
   cubics (error 1e-8). Children have to be accepted, because four equal means around a peak would
   hide it. An axis for which no sample falls on a texel takes the bilinear radiance.
   Where it fails: the rule sees lobe values and not what they multiply, so a sun is kept no better
   than the dark; and a lobe thinner than 4 texels slips between samples.
   Called by filters for HIERARCHICAL.  Tests: tests/test_hierarchical.c. */

/* A node of any level from 2 on: what is known of its children. Those of level 1 are not kept: they
   are up to four texels of the source, side by side. */
typedef struct envmapi_node {
    double x[4], y[4], z[4];   /* their centroids, unit; the node's own where there is no child */
    double e[4][4];            /* r, g, b times solid angle, and the solid angle; 0: no child */
    double cosine[4], sine[4]; /* of the angle about the centroid within which lies all below it */
    double texels[4];    /* how many texels lie below each child, without those outside a rim */
    uint32_t code;       /* that of its texels, without the last 2 bits a level */
    int first, children; /* of the level below, or its first texel: texels are in Z-order */
} envmapi_node;

typedef struct envmapi_tree {
    envmapi_node *level[17]; /* at `last` a node is a face */
    float (*texels)[4]; /* r, g, b, 1 */
    int count[17], last;
    envmapi_pool pool;
} envmapi_tree;

/* A node whose children are all there as a child: its centroid d, E and w, and the angle about d
   within which lies all below it. */
static double envmapi_node_join(double d[3], double e[4], envmapi_node *node) {
    double moment[3] = {0, 0, 0}, radius = 0;
    memset(e, 0, 4 * sizeof *e);
    for (int j = 0; j < node->children; ++j) {
        double w = node->e[j][3];
        moment[0] += w * node->x[j], moment[1] += w * node->y[j], moment[2] += w * node->z[j];
        for (int c = 0; c < 4; ++c) e[c] += node->e[j][c];
    }
    envmapi_unit(d, moment);
    for (int j = 0; j < node->children; ++j) {
        double child[3] = {node->x[j], node->y[j], node->z[j]};
        radius = fmax(radius, envmapi_angle(d, child) + atan2(node->sine[j], node->cosine[j]));
    }
    for (int j = node->children; j < 4; ++j)
        node->x[j] = d[0], node->y[j] = d[1], node->z[j] = d[2];
    return radius < ENVMAPI_PI ? radius : ENVMAPI_PI;
}

/* A node of level 1: texels from i on. */
static void envmapi_node_texels(envmapi_node *node, const envmapi_tree *tree,
                                const envmapi_source *s, size_t i) {
    memset(node, 0, sizeof *node);
    node->code = s->code[i] >> 2;
    for (; i < s->count && s->code[i] >> 2 == node->code; ++i) {
        int j = node->children++;
        node->x[j] = s->x[i], node->y[j] = s->y[i], node->z[j] = s->z[i];
        float *texel = tree->texels[i];
        memcpy(texel, envmapi_source_rgb(s, i), 3 * sizeof *texel), texel[3] = 1;
        node->cosine[j] = node->texels[j] = 1;
        for (int c = 0; c < 4; ++c) node->e[j][c] = s->w[i] * (double)texel[c];
    }
}

/* A level from the one below it. */
static void envmapi_tree_raise(envmapi_tree *tree, const envmapi_source *s, int level) {
    envmapi_node leaf, *child = tree->level[level - 1], *node = tree->level[level];
    int below = level > 2 ? tree->count[level - 1] : (int)s->count;
    for (int i = 0, step; i < below; i += step) {
        double d[3], e[4];
        if (level == 2) envmapi_node_texels(child = &leaf, tree, s, (size_t)i);
        step = level == 2 ? child->children : 1;
        double radius = envmapi_node_join(d, e, child);
        uint32_t code = child->code >> 2;
        if (node->children && node->code != code) ++node;
        if (!node->children) node->code = code, node->first = i;
        int j = node->children++;
        node->x[j] = d[0], node->y[j] = d[1], node->z[j] = d[2];
        node->cosine[j] = cos(radius), node->sine[j] = sin(radius);
        memcpy(node->e[j], e, sizeof e);
        node->texels[j] =
            child->texels[0] + child->texels[1] + child->texels[2] + child->texels[3];
        child += level > 2;
    }
}

/* Levels, three at least, until a node is a face. */
static envmap_result envmapi_tree_create(envmapi_tree *tree, const envmapi_source *s) {
    int width = envmapi_width(s->map->mapping, s->map->size);
    tree->texels = (float(*)[4])envmapi_pool_get(&tree->pool, s->count, sizeof *tree->texels);
    if (!tree->texels) return ENVMAP_ERROR_MEMORY;
    for (int level = 2; level <= 3 || 1 << (level - 1) < width; ++level) {
        size_t count = 0;
        for (size_t i = 0; i < s->count; ++i)
            count += !i || s->code[i] >> 2 * level != s->code[i - 1] >> 2 * level;
        void *nodes = envmapi_pool_get(&tree->pool, count, sizeof(envmapi_node));
        if (!nodes) return ENVMAP_ERROR_MEMORY;
        tree->level[level] = (envmapi_node *)memset(nodes, 0, count * sizeof(envmapi_node));
        tree->count[level] = (int)count, tree->last = level;
        envmapi_tree_raise(tree, s, level);
    }
    return ENVMAP_OK;
}

/* A filter call: the tree of a slice of src, and the lobe of a slice of dst. */
#define ENVMAPI_HIER_STEPS 512
typedef struct envmapi_hier {
    envmapi_tree tree;
    double peak, threshold;                    /* largest |k|; in units of k, negative: never met */
    double cos_from, sin_from, cos_to, sin_to; /* of the ends of the lobe's support */
    double steps;                              /* of the table, per unit of 1 - x; 0: no table */
    double table[ENVMAPI_HIER_STEPS + 1][4];   /* the last: 0, for all beyond the support */
    float asked;                               /* the caller's threshold */
} envmapi_hier;

/* Cubics in f = [0,1] through four values of k on every step: exact for N = 1, 2, 3. */
static void envmapi_hier_tabulate(envmapi_hier *h, const envmap_lobe *lobe, double to) {
    double end = 1 - cos(to), n = (double)lobe->parameter, y[4];
    int phong = lobe->kind == ENVMAP_LOBE_PHONG && n > 0 && (n >= 3 || !(floor(n) < n));
    h->steps = 0;
    if (!phong && lobe->kind != ENVMAP_LOBE_GAUSSIAN) return;
    h->steps = ENVMAPI_HIER_STEPS / end;
    for (int i = 0; i < ENVMAPI_HIER_STEPS; ++i) {
        double *c = h->table[i];
        for (int j = 0; j < 4; ++j)
            y[j] = envmapi_k(lobe, 1 - end * (3 * i + j) / (3 * ENVMAPI_HIER_STEPS), 0);
        c[0] = y[0];
        c[1] = -5.5 * y[0] + 9 * y[1] - 4.5 * y[2] + y[3];
        c[2] = 9 * y[0] - 22.5 * y[1] + 18 * y[2] - 4.5 * y[3];
        c[3] = -4.5 * y[0] + 13.5 * y[1] - 13.5 * y[2] + 4.5 * y[3];
    }
}

/* Makes ready for a slice. */
static envmap_result envmapi_hier_prepare(void *method, const envmapi_axis *axis, int new_source,
                                          void *memory) {
    envmapi_hier *h = (envmapi_hier *)method;
    h->peak = fabs(envmapi_k(axis->lobe, cos(envmapi_lobe_peak(axis->lobe, axis->p)), axis->p));
    h->threshold = h->asked < 0 ? -1 : h->peak * (h->asked > 0 ? (double)h->asked : 1e-3);
    h->cos_from = cos(axis->from), h->sin_from = sin(axis->from);
    h->cos_to = cos(axis->to), h->sin_to = sin(axis->to);
    envmapi_hier_tabulate(h, axis->lobe, axis->to);
    if (!new_source) return ENVMAP_OK;
    envmapi_pool_free(&h->tree.pool, 0);
    h->tree.pool.memory = memory;
    return envmapi_tree_create(&h->tree, axis->source);
}

/* The lobe about the axis at four directions, those of the children of a node. */
static void envmapi_hier_k(double k[4], const envmapi_hier *h, const envmapi_axis *axis,
                           const double dx[4], const double dy[4], const double dz[4]) {
    double x[4];
    for (int i = 0; i < 4; ++i)
        x[i] = axis->a[0] * dx[i] + axis->a[1] * dy[i] + axis->a[2] * dz[i];
    if (!(h->steps > 0)) {
        envmapi_k_many(k, x, 4, axis->lobe, axis->p);
        return;
    }
    for (int i = 0; i < 4; ++i) {
        double t = (1 - x[i]) * h->steps;
        t = t < ENVMAPI_HIER_STEPS ? t : ENVMAPI_HIER_STEPS;
        int step = (int)t;
        const double *c = h->table[step], f = t - step;
        k[i] = c[0] + f * (c[1] + f * (c[2] + f * c[3]));
    }
}

/* Four values that one may stand for; NaN may not. */
static int envmapi_hier_alike(const double k[4], double value, double threshold) {
    return fabs(k[0] - value) <= threshold && fabs(k[1] - value) <= threshold &&
           fabs(k[2] - value) <= threshold && fabs(k[3] - value) <= threshold;
}

static void envmapi_hier_add(double sum[4], double k, const double e[4]) {
    for (int c = 0; c < 4; ++c) sum[c] += k * e[c];
}

/* Adds a node of level 2, where the lobe is k2, or its children, or theirs. */
static void envmapi_hier_open(const envmapi_hier *h, envmapi_axis *axis, const envmapi_node *two,
                              double k2, const double e2[4]) {
    const envmapi_source *s = axis->source;
    double k1[4], k0[4], sum[4] = {0, 0, 0, 0};
    envmapi_hier_k(k1, h, axis, two->x, two->y, two->z);
    if (envmapi_hier_alike(k1, k2, h->threshold)) {
        envmapi_hier_add(axis->sum, k2, e2);
        return;
    }
    size_t first = (size_t)two->first, count;
    for (int j = 0; j < two->children; ++j, first += count) {
        const double *x = s->x + first, *y = s->y + first, *z = s->z + first;
        double few[3][4];
        count = (size_t)two->texels[j];
        for (size_t i = 0; i < 4 && count < 4; ++i) { /* where a texel is missing: that of all */
            few[0][i] = i < count ? x[i] : two->x[j];
            few[1][i] = i < count ? y[i] : two->y[j];
            few[2][i] = i < count ? z[i] : two->z[j];
        }
        if (count < 4) x = few[0], y = few[1], z = few[2];
        envmapi_hier_k(k0, h, axis, x, y, z);
        if (envmapi_hier_alike(k0, k1[j], h->threshold)) envmapi_hier_add(sum, k1[j], two->e[j]);
        else
            for (size_t i = 0; i < count; ++i) {
                const float *texel = h->tree.texels[first + i];
                double k = k0[i] * s->w[first + i];
                for (int c = 0; c < 4; ++c) sum[c] += k * (double)texel[c];
            }
    }
    envmapi_hier_add(axis->sum, 1, sum);
}

/* Is a part of what lies below child j in the lobe's support? That is, its centroid at an angle
   from - radius .. to + radius from the axis, where these are within 0 .. pi. */
static int envmapi_hier_meets(const envmapi_hier *h, const envmapi_axis *axis,
                              const envmapi_node *node, int j) {
    double x = axis->a[0] * node->x[j] + axis->a[1] * node->y[j] + axis->a[2] * node->z[j];
    double c = node->cosine[j], s = node->sine[j];
    return (c <= h->cos_from || x <= h->cos_from * c + h->sin_from * s + 1e-12) &&
           (c <= -h->cos_to || x >= h->cos_to * c - h->sin_to * s - 1e-12);
}

/* Node i of level 3 or more: 1 and the mean of the lobe over it, if that may stand for it; else 0,
   and what lies below it has been added. The last level is always opened. */
static int envmapi_hier_visit(double *mean, const envmapi_hier *h, envmapi_axis *axis, int level,
                              int i) {
    const envmapi_node *node = h->tree.level[level] + i;
    double k[4] = {0, 0, 0, 0}, sum = 0, texels = 0;
    int accepted[4], all = level < h->tree.last;
    if (level == 3) envmapi_hier_k(k, h, axis, node->x, node->y, node->z);
    for (int j = 0; j < node->children; ++j) {
        accepted[j] = 1;
        if (level > 3 && envmapi_hier_meets(h, axis, node, j))
            accepted[j] = envmapi_hier_visit(k + j, h, axis, level - 1, node->first + j);
        all &= accepted[j];
        sum += node->texels[j] * k[j], texels += node->texels[j];
    }
    *mean = sum / texels;
    for (int j = node->children; j < 4; ++j) k[j] = *mean;
    if (all && envmapi_hier_alike(k, *mean, h->threshold)) return 1;
    for (int j = 0; j < node->children; ++j)
        if (level == 3)
            envmapi_hier_open(h, axis, h->tree.level[2] + node->first + j, k[j], node->e[j]);
        else if (accepted[j]) envmapi_hier_add(axis->sum, k[j], node->e[j]);
    return 0;
}

static void envmapi_hier_filter(envmapi_axis *axis, const void *method) {
    const envmapi_hier *h = (const envmapi_hier *)method;
    double mean;
    for (int face = 0; face < h->tree.count[h->tree.last]; ++face)
        envmapi_hier_visit(&mean, h, axis, h->tree.last, face);
    if (fabs(axis->sum[3]) > 1e-100 * h->peak) return;
    memset(axis->sum, 0, sizeof axis->sum); /* no sample of the lobe fell on a texel */
    envmapi_axis_circles(axis, 1, axis->to);
}

static envmap_result envmapi_filter_hierarchical(envmap *dst, const envmap *src,
                                                 const envmap_lobe *lobe,
                                                 const envmap_filter_desc *desc) {
    envmapi_axes axes;
    envmapi_hier *h = (envmapi_hier *)ENVMAP_MALLOC(desc->work.memory, sizeof *h);
    if (!h) return ENVMAP_ERROR_MEMORY;
    memset(h, 0, sizeof *h), memset(&axes, 0, sizeof axes);
    h->asked = desc->threshold;
    axes.dst = dst, axes.axis.lobe = lobe, axes.method = h;
    axes.prepare = envmapi_hier_prepare, axes.filter = envmapi_hier_filter;
    envmap_result result = envmapi_axes_run(&axes, src, desc);
    envmapi_pool_free(&h->tree.pool, 0);
    ENVMAP_FREE(desc->work.memory, h);
    return result;
}

/* ---------------------------------------------------------------------------------- >>windows --
   What of a face lies within R of an axis, and the nodes of a sum or an integral over it.
     in     an axis a, R, a face       out    a rectangle of (u,v); nodes along u and along v
       the rectangle                   _box: of a cube by tangents, of a lat-long by its rows, of
                                       discs by a sector, of an octahedral map's quadrant by planes
       where the axis is               _frame, _project
       sigma in texels; d omega        _finest; _density
       nodes at texels' centres        _centres
       nodes of Gauss-Legendre         _pieces, which end at the lines through texel centres
   Used by >>kernels.  Source: ours.  Tests: tests/test_near.c; a cap that holds a face's axis in
   every_tolerance_is_kept_in_a_mild_scene, an octahedral map's corners in
   a_wide_ring_about_the_corners_keeps_the_tolerance. */

/* Tuned as those of >>near are. */
/* So much shorter are pieces where paraboloids blend, and across an octahedral map's horizon: there
   light has kinks off the lines. */
#define ENVMAPI_BLEND 0.4
#define ENVMAPI_PIECES                                                                             \
    { 0.43, 0.85, 1.48, 2.06, 2.6 } /* sigma for 2 .. 6 nodes at 1e-3 */

/* A node along u or v of a window: its light is that of two texels, the share f of the next. */
typedef struct envmapi_knot {
    double at; /* u or v */
    float weight, f;
    int texel, column[2]; /* of the window: the two texels, along u */
    float place, apart;   /* of v: what _sines asks of it */
} envmapi_knot;

/* The range of r cos(phi), r in [r0,r1], phi no farther than `wide` from `at`. */
static void envmapi_window_sector(double range[2], double r0, double r1, double at, double wide) {
    for (int end = 0; end < 2; ++end) { /* the least is the largest on the other side */
        double phi = fabs(remainder(at + (end ? 0 : ENVMAPI_PI), 2 * ENVMAPI_PI)) - wide;
        double most = phi > 0 ? cos(phi) : 1;
        range[end] = (end ? 1 : -1) * most * (most > 0 ? r1 : r0);
    }
}

/* m = a in S, T and M of a cube's face; on a lat-long, pi u and pi v, and the sine of that. */
static void envmapi_window_frame(double m[3], int mapping, int face, const double a[3]) {
    double uv[2];
    for (int i = 0; i < 3; ++i) m[i] = envmapi_dot(a, envmapi_cube[face][i]);
    if (mapping != ENVMAP_LATLONG) return;
    envmapi_project(uv, mapping, face, a);
    m[0] = ENVMAPI_PI * uv[0], m[1] = ENVMAPI_PI * uv[1], m[2] = sin(m[1]);
}

/* |X| and |Y| of what a quadrant of an octahedral map has within R of a, over the whole sphere. |X|
   = t is a plane through (0,1,-1) above the horizon, through (1,1,0) below it. 0: nothing. */
static int envmapi_window_octa(double box[2][2], int quadrant, const double a[3], double R) {
    box[0][0] = box[1][0] = 1, box[0][1] = box[1][1] = 0;
    for (int below = 0; below < 2; ++below) {
        double y = below ? -a[1] : a[1], reach = R < 1.5 ? sin(R) : 2, part[2][2];
        for (int i = 0; i < 2; ++i) {
            double x = quadrant >> i & 1 ? a[2 * i] : -a[2 * i];
            double z = quadrant >> (1 - i) & 1 ? a[2 - 2 * i] : -a[2 - 2 * i], root = sqrt(0.5);
            double s = below ? root * (x + y) : x, c = below ? z : root * (y + z);
            double rho = hypot(s, c), wide = rho > reach ? asin(reach / rho) : 2 * ENVMAPI_PI;
            for (int end = 0; end < 2; ++end) {
                double at = atan2(s, c) + (end ? wide : -wide), t;
                t = tan(envmapi_clamp(at, 0, ENVMAPI_PI / 2)) * (below ? 1 / root : root);
                part[i][end] = t / (1 + t);
            }
        }
        for (int i = 0; i < 2; ++i) {
            double *range = part[i], *other = part[1 - i];
            if (below) range[0] = fmax(range[0], 1 - other[1]);
            else range[1] = fmin(range[1], 1 - other[0]);
        }
        if (y < -reach || part[0][0] >= part[0][1] || part[1][0] >= part[1][1]) continue;
        for (int i = 0; i < 2; ++i) {
            box[i][0] = fmin(box[i][0], part[i][0]);
            box[i][1] = fmax(box[i][1], part[i][1]);
        }
    }
    return box[0][0] < box[0][1];
}

/* The (u,v) that hold all within R of a on a face, as far as it goes: box[0] those of u, box[1] of
   v. Of an octahedral map, faces are quadrants. 0 where there are none. */
static int envmapi_window_box(double box[2][2], int mapping, int face, const double a[3], double R,
                              double border) {
    double at[2], m[3], sine = sin(R);
    int all = R > 1.5;
    for (int i = 0; i < 4; ++i) box[i / 2][i % 2] = i % 2;
    if (mapping == ENVMAP_CUBE) {
        envmapi_window_frame(m, mapping, face, a);
        if (!all && m[2] <= -sine) return 0;
        for (int i = 0; i < 2 && !all; ++i) { /* tan(angle -+ wide) by x, z and sin(wide) rho */
            double x = m[i], z = m[2], q = sqrt(fmax(x * x + z * z - sine * sine, 0));
            if (!(q > 0)) continue; /* it lies all around the line where x and z are 0 */
            double low = z * q + x * sine, high = z * q - x * sine;
            if ((low <= 0 && x > 0) || (high <= 0 && x < 0)) return 0;
            box[i][0] = low > 0 ? 0.5 + 0.5 * (x * q - z * sine) / low : -1;
            box[i][1] = high > 0 ? 0.5 + 0.5 * (x * q + z * sine) / high : 2;
        }
    } else if (mapping == ENVMAP_LATLONG) {
        envmapi_project(at, mapping, face, a);
        double theta = ENVMAPI_PI * at[1], pole = all || theta < R || theta + R > ENVMAPI_PI;
        double wide = pole > 0 ? 0.5 : asin(sine / sin(theta)) / (2 * ENVMAPI_PI);
        box[0][0] = at[0] - wide, box[0][1] = at[0] + wide;
        box[1][0] = at[1] - R / ENVMAPI_PI, box[1][1] = at[1] + R / ENVMAPI_PI;
    } else if (mapping == ENVMAP_OCTAHEDRAL) {
        if (!envmapi_window_octa(box, face, a, R)) return 0;
        for (int i = 0; i < 2; ++i) { /* a texel on a fold once */
            double least = box[i][0], most = box[i][1], hair = 1e-12;
            box[i][0] = 0.5 + 0.5 * (face >> i & 1 ? least : -most);
            box[i][1] = 0.5 + 0.5 * (face >> i & 1 ? most : -least) - (least > 0 ? 0 : hair);
        }
    } else if (!all) {
        int front = mapping == ENVMAP_SPHERE || (mapping == ENVMAP_PARABOLOID && face == 0);
        double theta = acos(envmapi_clamp(front ? a[2] : -a[2], -1, 1));
        int round = theta < R || theta + R > ENVMAPI_PI;
        double wide = round ? ENVMAPI_PI : asin(sine / sin(theta)), phi = atan2(a[1], a[0]);
        double last = mapping == ENVMAP_PARABOLOID ? 2.2 : ENVMAPI_PI; /* beyond the corners */
        double r0 = envmapi_chart_radius(mapping, envmapi_clamp(theta - R, 0, last));
        double r1 = envmapi_chart_radius(mapping, fmin(theta + R, last));
        if (mapping == ENVMAP_PARABOLOID && r0 > 1 + 4 * border) return 0; /* the other face's */
        envmapi_window_sector(box[0], r0, r1, phi, wide);
        envmapi_window_sector(box[1], r0, r1, phi + ENVMAPI_PI / 2, wide); /* v falls with Y */
        for (int i = 0; i < 4; ++i) box[i / 2][i % 2] = 0.5 + 0.5 * box[i / 2][i % 2];
    }
    for (int i = mapping == ENVMAP_LATLONG; i < 2; ++i) {
        box[i][0] = fmax(box[i][0], -border), box[i][1] = fmin(box[i][1], 1 + border);
        if (!(box[i][0] < box[i][1])) return 0;
    }
    return 1;
}

/* The axis on a face, or its image over an octahedral map's edges, where that is nearer. */
static void envmapi_window_project(double at[2], int mapping, int face, double box[2][2],
                                   const double a[3]) {
    double middle[2] = {(box[0][0] + box[0][1]) / 2, (box[1][0] + box[1][1]) / 2};
    envmapi_project(at, mapping, face, a);
    if (mapping == ENVMAP_OCTAHEDRAL) envmapi_octa_image(at, middle);
}

/* Faces, or an octahedral map's quadrants: each has a window of its own. */
static int envmapi_window_parts(int mapping) {
    return mapping == ENVMAP_OCTAHEDRAL ? 4 : envmap_faces(mapping);
}

/* sigma in texels along u (i 0) or v (1) where the window is finest: over |d direction / du|. */
static double envmapi_window_finest(const envmapi_level *level, double sigma, double box[2][2],
                                    const double a[3], int face, int i) {
    double most = 0, hair = 1e-5, at[2];
    int size = i ? level->edge : level->width;
    envmapi_window_project(at, level->mapping, face, box, a);
    for (int k = 0; k < 3; ++k) {
        double low[3], high[3], uv[2], square = 0;
        uv[i] = envmapi_clamp(at[i], box[i][0], box[i][1]);
        uv[1 - i] = k < 2 ? box[1 - i][k] : envmapi_clamp(at[1 - i], box[1 - i][0], box[1 - i][1]);
        uv[i] -= hair, envmapi_direction(low, level->mapping, face, uv[0], uv[1]);
        uv[i] += 2 * hair, envmapi_direction(high, level->mapping, face, uv[0], uv[1]);
        for (int c = 0; c < 3; ++c) square += (high[c] - low[c]) * (high[c] - low[c]);
        most = fmax(most, sqrt(square) / (2 * hair));
    }
    double X = fmax(fabs(2 * box[0][0] - 1), fabs(2 * box[0][1] - 1));
    double Y = fmax(fabs(2 * box[1][0] - 1), fabs(2 * box[1][1] - 1));
    double least = fmin(fabs(2 * box[0][0] - 1), fabs(2 * box[0][1] - 1)) +
                   fmin(fabs(2 * box[1][0] - 1), fabs(2 * box[1][1] - 1));
    if (level->mapping == ENVMAP_PARABOLOID && X * X + Y * Y > 1 - 4.0 / size)
        most /= ENVMAPI_BLEND;
    if (level->mapping == ENVMAP_OCTAHEDRAL && X + Y > 1 && least < 1) most /= ENVMAPI_BLEND;
    return sigma * size / most;
}

/* The sine of the angle between u and v at a on a disc: by its rim they are nearly one line. */
static double envmapi_window_shear(const envmapi_level *level, int face, const double a[3]) {
    double uv[2], d[3][3], hair = 1e-5;
    if (!envmapi_is_disc(level->mapping)) return 1;
    envmapi_project(uv, level->mapping, face, a);
    for (int i = 0; i < 3; ++i)
        envmapi_direction(d[i], level->mapping, face, uv[0] + hair * (i == 1),
                          uv[1] + hair * (i == 2));
    for (int i = 0; i < 6; ++i) d[1 + i / 3][i % 3] -= d[0][i % 3];
    double c = envmapi_dot(d[1], d[2]), all = envmapi_dot(d[1], d[1]) * envmapi_dot(d[2], d[2]);
    return all > c * c ? sqrt(1 - c * c / all) : 1;
}

/* What a point of a face counts: d omega / du dv; near the paraboloids' rim both have a share. */
static double envmapi_window_density(const envmapi_level *level, double u, double v) {
    double X = 2 * u - 1, Y = 2 * v - 1, r = sqrt(X * X + Y * Y);
    double density = envmapi_density(level->mapping, u, v);
    if (level->mapping == ENVMAP_PARABOLOID) density *= envmapi_paraboloid_share(r, level->edge);
    return level->mapping == ENVMAP_SPHERE && r >= 1 ? 0 : density;
}

/* Nodes of the texels whose centres lie from `from` to `to`, of n that fill a side, centres at
   whole numbers: each texel at so many places of a tent. */
static int envmapi_window_centres(envmapi_knot *node, int room, double from, double to, double n,
                                  double tent, int places) {
    int count = 0;
    for (double x = ceil(from); x <= to && count + 4 <= room; x += 1)
        for (int i = 0; i < places; ++i, ++count) {
            node[count].at = (x + 0.5 + tent * envmapi_tent[places - 1][i][0]) / n;
            node[count].weight = (float)envmapi_tent[places - 1][i][1];
            node[count].texel = (int)x, node[count].f = 0;
        }
    return count;
}

/* Nodes of the integral over [from, to], Gauss-Legendre's, 2 to 6 a piece of up to so many sigma.
   The axis is at `at`, where sigma is that many texels; grows: the lobe has detail near its axis
   only, and a little where it begins to fade out: there are at least grows + 1 nodes. Pieces get
   longer with the least distance from the axis of what is so far away along u, or v: that times
   the shear.  Test: works_that_broke_hold. */
static int envmapi_window_pieces(envmapi_knot *node, int room, double from, double to, double n,
                                 double at, double sigma, int grows, double shear,
                                 const double (*gauss)[ENVMAPI_GAUSS][2]) {
    static const double longest[5] = ENVMAPI_PIECES;
    int count = 0;
    for (double next; from < to && count + 6 <= room; from = next) {
        double texel = fmin(floor(from + 1e-9), ceil(to) - 1), end = fmin(texel + 1, to);
        double away = from < at ? fmax(at - end, (at - from) / 4.5) : from - at;
        double most = grows ? fmax(shear * away, 0.8 * sigma) : sigma;
        next = from + (end - from) / ceil((end - from) / (longest[4] * most));
        int k = grows > 1 ? grows - 1 : 0;
        while (k < 4 && next - from > longest[k] * most) ++k;
        for (int i = 0; i < k + 2; ++i, ++count) {
            double place = (from + next - gauss[k][i][0] * (next - from)) / 2;
            node[count].at = (place + 0.5) / n, node[count].texel = (int)texel;
            node[count].f = (float)(place - texel);
            node[count].weight = (float)((next - from) / n * gauss[k][i][1] / 2);
        }
    }
    return count;
}

/* -------------------------------------------------------------------------------- >>kernels --
   What each texel in sight of an axis counts.
     in     a source's level, a lobe, its p, axes of a result       out    K
       texels, tents of half-width t      K_i = w_i mean of k at places about c_i along u and v
       the bilinear radiance              K_i = integral of k B_i, B_i the bilinear weight of i
   Both are sums over the nodes of a window of a face, some along u times some along v. For the
   integral these are Gauss-Legendre's, two to six a piece; pieces end at the lines through texel
   centres, where B_i has its kinks, and are 2.5 sigma long at most.
   Where a lobe never ends (GGX) >>fast sums its tail.
       what is left to >>fast                     _tail_of
       windows and their nodes                    _open, _nodes
       the angles of nodes, k there, texels       _sines, _k, _add, _flush, _rim
       K of axes; of a lat-long's cell            _kernel; _fold
   Used by >>knots and >>near.  Source: ours.  Tests: tests/test_near.c. */

#define ENVMAPI_SPLIT 10 /* texels at 1e-3 that near sums reach where any reach is right: speed */

/* What a lobe has beyond its reach, where the definition sums texels at their centres: k times the
   step that fades tents and the integral out. It is smooth, and >>fast sums it. */
typedef struct envmapi_tail {
    envmap_lobe lobe; /* the tail, as a function */
    const envmap_lobe *whole;
    double reach, whole_from, integral, part; /* integral: of the tail; its part of the whole */
    float kinks[3];
    float *sums; /* NULL, or [texels of a slice] its own sum over texels, over the integral */
} envmapi_tail;

static double envmapi_tail_k(double x, double p, void *user) {
    const envmapi_tail *tail = (const envmapi_tail *)user;
    double step = 1;
    if (x > tail->whole_from)
        step = envmapi_smooth_step(envmapi_acos(x), tail->reach / 2, tail->reach);
    return step > 0 ? step * envmapi_k(tail->whole, x, p) : 0;
}

/* k from half the reach on, as a function. */
static void envmapi_tail_whole(envmapi_tail *tail, const envmap_lobe *lobe, double reach) {
    tail->lobe = envmap_lobe_function(envmapi_tail_k, tail), tail->whole = lobe;
    tail->reach = reach, tail->whole_from = envmapi_cosine(reach);
    tail->lobe.kinks = tail->kinks;
    tail->kinks[tail->lobe.kink_count++] = (float)(reach / 2);
    tail->kinks[tail->lobe.kink_count++] = (float)reach;
    if (lobe->kind == ENVMAP_LOBE_GGX)
        tail->kinks[tail->lobe.kink_count++] = (float)(ENVMAPI_PI / 2);
}

/* 0 where there is none: the lobe has slices, or ends before its reach does. Only what falls as a
   power is cut before that: functions may have flanks there, which few bands do not hold. */
static int envmapi_tail_of(envmapi_tail *tail, const envmap_lobe *lobe, const envmap *src,
                           double tolerance) {
    envmapi_axis axis;
    memset(&axis, 0, sizeof axis);
    axis.lobe = lobe;
    envmapi_axis_aim(&axis, src, 0, 1, 1e-3);
    double split = ENVMAPI_SPLIT * fmax(pow(1e-3 / tolerance, 0.4), 1); /* else lattices show */
    if (!(axis.bilinear > 0) && lobe->kind == ENVMAP_LOBE_GGX)
        axis.reach = fmin(axis.reach, split * axis.texel);
    envmapi_tail_whole(tail, lobe, axis.reach);
    if (lobe->p0 < lobe->p1 || lobe->p0 > lobe->p1 || !(axis.reach < axis.to) ||
        lobe->kind < ENVMAP_LOBE_GGX) /* ends soon: near sums see all of it */
        return 0;
    tail->integral = envmapi_lobe_integral(&tail->lobe, axis.p);
    tail->part = fabs(tail->integral / envmapi_lobe_integral(lobe, axis.p));
    /* not over its own sum over texels, which a sphere map's long ones change: sums has that */
    tail->lobe.raw = 1, tail->lobe.scale = lobe->raw ? lobe->scale : (float)(1 / tail->integral);
    double end = fabs(envmapi_k(lobe, cos(axis.reach), axis.p)) * axis.reach * axis.reach;
    return tail->part > 1e-9 && tail->part <= 1 && end > 1e-3 * fabs(tail->integral);
}

/* An axis of dst. Its windows and those of the count - 1 that follow are nearly the same texels. */
#define ENVMAPI_NEAR_AXES 8
typedef struct envmapi_near_axes {
    int face, x, y, count;
} envmapi_near_axes;

/* Axes [first, first + count) of a square of dst: what they read of the source stays in a cache.
   Where the source is a lat-long, all axes between the centres of its rows y and y + 1. */
#define ENVMAPI_NEAR_TILE 32
typedef struct envmapi_near_tile {
    int face, x, y, first, count;
} envmapi_near_tile;

/* K of 4 x 4 axes of a tile, or of 4 axes of a row of it, in windows alike about each: [16 or 4]
   [height][width]; x, y: of a window about axis 0 of a row, of a tile about that of row 0. */
typedef struct envmapi_near_knots {
    int ready, x, y, width, height, plane; /* plane: K is that of the face's plane */
    int part, row, step[2];                /* texels from axis to axis of a row */
    int folded;                            /* the row of axes that `line` is for */
    float *K, *line;
} envmapi_near_knots;

/* K^(1/4) of a cell, whose axes lie between the centres of rows `row` and row + 1 of a lat-long, at
   knots: [latitude][longitude][rows][columns], from row y and from `reach` columns before the axis'
   on. */
#define ENVMAPI_CELL_KNOTS 96  /* at most, along u or v; any number is right */
#define ENVMAPI_CELL_PIECE 1.2 /* sigma at 1e-3; at 2.4 the latitudes' test (above) fails */
#define ENVMAPI_CELL_CORE  1.5 /* texels about an axis where a sharp GGX has detail (speed only) */
typedef struct envmapi_near_cell {
    envmapi_near_knots knots;
    int reach, last[2];
    double at[2][ENVMAPI_CELL_KNOTS + 1]; /* knots along u and v, in [0,1], alike from either end */
    double *twice;                        /* k integrated twice from the axis' meridian on */
} envmapi_near_cell;

/* Texels of a row of the source that any axis needs, and where their blocks are; from the first to
   the last bright one of each block. begin, end: tiles that need them; here: they have blocks. */
#define ENVMAPI_NEAR_BLOCKS 9 /* 48 turns */
typedef struct envmapi_near_row {
    int from, to, bright[ENVMAPI_NEAR_BLOCKS][2], begin, end, here;
    size_t first;
} envmapi_near_row;

typedef struct envmapi_near envmapi_near;
struct envmapi_near {
    envmapi_axis axis; /* the lobe, and what it is to the source */
    envmap dst;
    int slice, tasks, first, tile_count, turn_count; /* first: of the tiles that are at work */
    int round, tile, ratio, knot[4]; /* tiles between two words to the progress callback; edge of
                                        one; texels of the source to one of dst, or 0; knots */
    float between[ENVMAPI_NEAR_TILE][4]; /* weights of the knots, for each place in a tile */
    envmapi_turn *turns;
    envmapi_images (*images)[6]; /* of texels of dst, 16 turns at a time */
    envmapi_near_axes *axes;
    envmapi_near_tile *tiles;
    envmapi_near_row *rows;
    int cells; /* each round of a lat-long's latitudes has blocks of its own */
    envmapi_input in;
    int exponent;  /* texels and sums are 2^-exponent of what they are */
    float *blocks; /* [3 turns / 16][texel][16]: RGB of a texel's images, turn after turn */
    size_t count, area, cell, own; /* blocks; texels of the largest window; a cell's K, an axis' */
    size_t all;                      /* texels, where the reference weighs them for all turns */
    int shift;                       /* of a float, to its place in the table; the fraction of it */
    float *table, inverse, fraction; /* k by 1 + inverse sin^2: envmapi_near_k */
    double sigma, R, R_bright, bright; /* an axis sees R, rad, and texels above `bright` farther */
    double tent;                       /* the definition's; the axis' is 0 where it adds little */
    double lit[16][3]; /* where paraboloids blend, texels of eight means show what nodes miss */
    int lit_count;     /* more than 16: they are everywhere */
    double piece, cell_piece;          /* pieces over ENVMAPI_PIECES; a cell's, in rows */
    const envmapi_tail *tail;          /* that is in dst already, or NULL */
    double poles[2][3]; /* a lat-long's means of its first and its last row */
    double scale, norm; /* k is scale times the table's; what sums are divided by, or 0 */
    char *work;
    size_t bytes, room; /* of a task: its memory; nodes along u, and along v */
    envmapi_near *parts;   /* of the lobe: all, or what is about the axis and what is beyond */
    int part_count;        /* 0: K is summed for each axis */
    double core, beyond;   /* where k fades out, or in; or 0 */
};

/* What a task works with: the texels of a face that some axes see, what an axis makes of them, and
   the sums of all axes and turns. */
typedef struct envmapi_window {
    int face, part, x, y, width, height;
    double box[2][2];                                     /* of u, of v */
    double sigma[2];                                      /* of the lobe, in texels along u and v */
    double axes[ENVMAPI_NEAR_AXES][3], middle[3], spread; /* spread: how far from the middle */
    int rim[ENVMAPI_NEAR_AXES];                           /* of axes: the reference serves them */
    double outside[4];                                    /* its sums outside a disc */
    envmapi_axis single;                                  /* one that is summed by itself */
    double a[3], m[3];                                    /* an axis, and on a cube's face */
    double R, limit; /* R in use, and its sine's square */
    int knot;        /* it is about a knot: K is that of the face's plane, beyond its edges too */
    envmapi_knot *u, *v;                                  /* [room] */
    float *place, *apart;                                 /* [room] of u: what _sines asks of it */
    float *rows[2]; /* [room] a row of texels and the next, by nodes along u */
    float *K, *own, *strip; /* [height][width][axes]; of an axis, between knots; as K, of a part */
    double *light;  /* [all] of an axis */
    envmapi_near_knots knots[2], lines[2][2]; /* within R, and within R_bright; of a row: on
                                                 another face, and on its own */
    envmapi_near_cell cells[2], *cell; /* cell: the one whose K is being summed */
    int tied;                          /* points along u, while K of the cell is summed */
    float sums[ENVMAPI_NEAR_BLOCKS][ENVMAPI_NEAR_AXES][16];
    double norms[ENVMAPI_NEAR_BLOCKS][ENVMAPI_NEAR_AXES]; /* sums of K */
} envmapi_window;

/* ---- windows */

/* How far a box goes beyond the face: paraboloids blend there. */
static double envmapi_near_border(const envmapi_window *w, const envmapi_near *s, int texels) {
    const envmapi_level *level = &s->axis.level;
    if (w->knot) return 1;
    if (level->mapping != ENVMAP_PARABOLOID || texels || !(s->axis.bilinear > 0)) return 0;
    return 0.5 / level->edge;
}

/* How far the texels lie that an axis needs. */
static double envmapi_near_reach(const envmapi_near *s, double R, int texels) {
    return R + (texels ? 3 * s->axis.tent * s->axis.texel : 0);
}

static void envmapi_near_aim(envmapi_window *w, const envmapi_near *s,
                             const envmapi_near_axes *axes) {
    const double *middle = w->axes[axes->count / 2], *far_off = middle;
    for (int n = 0; n < axes->count; ++n)
        envmapi_texel_direction(w->axes[n], s->dst.mapping, axes[n].face, s->dst.size, axes[n].x,
                                axes[n].y);
    for (int n = 0; n < axes->count; ++n)
        if (envmapi_dot(w->axes[n], middle) < envmapi_dot(far_off, middle)) far_off = w->axes[n];
    memcpy(w->middle, middle, sizeof w->middle);
    w->spread = 1.01 * envmapi_angle(far_off, middle);
}

/* The window of the axes on such a part; 0 where they see nothing of it. */
static int envmapi_near_open(envmapi_window *w, const envmapi_near *s, int part, double radius) {
    const envmapi_level *level = &s->axis.level;
    double box[2][2], R = envmapi_near_reach(s, radius, s->axis.bilinear < 1) + w->spread;
    int wide = level->width, face = level->mapping == ENVMAP_OCTAHEDRAL ? 0 : part;
    if (!envmapi_window_box(box, level->mapping, part, w->middle, R,
                             envmapi_near_border(w, s, 0)))
        return 0;
    memcpy(w->box, box, sizeof box);
    w->R = radius, w->limit = pow(sin(radius), 2);
    w->face = face, w->part = part, w->x = (int)floor(box[0][0] * wide - 0.5);
    w->y = (int)floor(box[1][0] * level->edge - 0.5);
    w->width = (int)floor(box[0][1] * wide - 0.5) + 2 - w->x;
    w->height = (int)floor(box[1][1] * level->edge - 0.5) + 2 - w->y;
    if (level->mapping == ENVMAP_LATLONG && w->width > wide) w->width = wide;
    int below = level->edge + 1 - w->y; /* all rows that there are */
    if (!w->knot && w->height > below) w->height = below;
    return 1;
}

/* The column of a window, or -1. */
static int envmapi_near_column(const envmapi_window *w, const envmapi_level *level, int x) {
    x -= w->x;
    if (level->mapping == ENVMAP_LATLONG) x = (x % level->width + level->width) % level->width;
    return x < w->width ? x : -1;
}

/* Places of a tent. Two do for half a texel; for nearly one they are off by 35 tolerances beside
   a lit texel, and at 2e-5 by 9 in rms. A sphere map's are long. */
static int envmapi_near_places(const envmapi_near *s) {
    int sphere = s->axis.level.mapping == ENVMAP_SPHERE;
    return !(s->axis.tent > 0) ? 1 : s->piece < 0.9 ? 4 : (s->axis.tent > 0.6 ? 3 : 2) + sphere;
}

/* The first of a direction's images: turns of a paraboloid map swap x and y, and any sign. */
static void envmapi_near_image(double image[3], const double d[3]) {
    double x = fabs(d[0]), y = fabs(d[1]);
    image[0] = fmax(x, y), image[1] = fmin(x, y), image[2] = fabs(d[2]);
}

/* Bright texels within two of where paraboloids blend. */
static void envmapi_near_light(envmapi_near *s, double bright) {
    const envmapi_level *level = &s->axis.level;
    int n = level->edge;
    double d[3];
    for (int i = 0; i < 2 * n * n && s->lit_count <= 16; ++i) {
        const float *t = level->texels + 3 * (size_t)i;
        if (fmax(fmax((double)t[0], (double)t[1]), (double)t[2]) <= bright) continue;
        envmapi_texel_direction(d, ENVMAP_PARABOLOID, i / (n * n), n, i % n, i / n % n);
        if (fabs(d[2]) > 4.0 / n) continue;
        if (s->lit_count < 16) envmapi_near_image(s->lit[s->lit_count], d);
        ++s->lit_count;
    }
}

/* Does a window see one, in any turn? */
static int envmapi_near_lit(const envmapi_near *s, const envmapi_window *w) {
    double a[3];
    int lit = s->lit_count > 16;
    envmapi_near_image(a, w->a);
    for (int i = 0; i < s->lit_count && !lit; ++i)
        lit = envmapi_dot(a, s->lit[i]) > cos(fmin(w->R + 4.0 / s->axis.level.edge, ENVMAPI_PI));
    return lit;
}

/* Nodes along u (i 0) or v (1) of a window; returns how many. */
static int envmapi_near_nodes(envmapi_knot *nodes, const envmapi_near *s, const envmapi_window *w,
                              double box[2][2], int i, int texels) {
    const envmapi_level *level = &s->axis.level;
    int size = i ? level->edge : level->width, room = (int)s->room - 16;
    double from = box[i][0] * size - 0.5, to = box[i][1] * size - 0.5, at[2];
    if (texels) /* each column of a lat-long once */
        return envmapi_window_centres(nodes, room, from, fmin(to, from + size - 1e-6), size,
                                      s->axis.tent, envmapi_near_places(s));
    int grows = s->axis.lobe->kind == ENVMAP_LOBE_GGX; /* to 5: 2e-5 .. 4e-6 need them */
    double shear = grows ? 2 * s->piece * envmapi_window_shear(level, w->face, w->a) : 1;
    shear = envmapi_clamp(shear, 0.05, 1); /* else there is no room for nodes */
    if (grows) grows += (int)envmapi_clamp(8 - 8 * s->piece, 0, 4);
    envmapi_window_project(at, level->mapping, w->face, box, w->a);
    int kinks = i && level->mapping == ENVMAP_LATLONG ? s->axis.kink_count : 0, count = 0;
    double piece = s->piece * w->sigma[i]; /* paraboloids have kinks where they blend, in texels */
    int blends = level->mapping == ENVMAP_PARABOLOID && fabs(w->a[2]) < w->R;
    if (blends && s->piece < 0.8) piece /= 2;
    if (blends && grows && envmapi_near_lit(s, w)) grows = 5;
    for (double end, place = at[i] * size - 0.5; from < to && count + 6 <= room; from = end) {
        end = to; /* about a pole kinks lie along rows, and what pieces miss does not cancel */
        for (int k = 0; k < 2 * kinks; ++k) {
            double cut = place + (k % 2 ? 1 : -1) * s->axis.kinks[k / 2] * size / ENVMAPI_PI;
            if (cut > from + 1e-6 && cut < end - 1e-6) end = cut;
        }
        count += envmapi_window_pieces(nodes + count, room - count, from, end, size, place, piece,
                                       grows, shear, s->axis.gauss);
    }
    return count;
}

/* ---- K */

/* sin^2, to a float's digits: the series at less than a quarter turn. */
static double envmapi_sine_square(double x) {
    x -= ENVMAPI_PI * floor(x / ENVMAPI_PI + 0.5);
    double y = x * x;
    double sine = x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72 * (1 - y / 110)))));
    return sine * sine;
}

/* What _sines asks of a node along u or v, by which float differences are exact enough.
     cube       d ~ (X,Y,1), axis m: X and m_2 X - m_0; Y and m_1 - m_2 Y
     lat-long   4 sin^2 of half the longitudes' difference; sin(theta) sin(theta_a), and 4 sin^2
                of half the latitudes' */
static void envmapi_near_place(float *place, float *apart, const envmapi_window *w, int mapping,
                               double at, int i) {
    const double *m = w->m;
    double X = 2 * at - 1, theta = ENVMAPI_PI * at;
    if (mapping == ENVMAP_CUBE) {
        *place = (float)X, *apart = (float)(i ? m[1] - m[2] * X : m[2] * X - m[0]);
    } else if (mapping == ENVMAP_LATLONG) {
        double square = envmapi_sine_square(i ? (theta - m[1]) / 2 : theta - m[0]);
        *place = (float)(i ? sin(theta) * m[2] : 4 * square);
        *apart = (float)(4 * square);
    }
}

/* p, the direction at (X,-Y) of an angular map; returns its density. Sine and cosine of half its
   angle are series of r^2, which take a third of the time. */
static double envmapi_near_angular(double p[3], double X, double Y) {
    static const double part[22] = {
        1.0 / 2,   1.0 / 6,   1.0 / 12,  1.0 / 20,  1.0 / 30,  1.0 / 42,  1.0 / 56,  1.0 / 72,
        1.0 / 90,  1.0 / 110, 1.0 / 132, 1.0 / 156, 1.0 / 182, 1.0 / 210, 1.0 / 240, 1.0 / 272,
        1.0 / 306, 1.0 / 342, 1.0 / 380, 1.0 / 420, 1.0 / 462, 1.0 / 506};
    double rr = X * X + Y * Y, square = ENVMAPI_PI * ENVMAPI_PI / 4 * fmin(rr, 1);
    double cosine = 1, sine = 1; /* this over the angle */
    for (int i = 20; i >= 0; i -= 2)
        cosine = 1 - square * part[i] * cosine, sine = 1 - square * part[i + 1] * sine;
    double ratio = ENVMAPI_PI * sine * cosine;
    p[0] = ratio * X, p[1] = -ratio * Y, p[2] = 2 * square * sine * sine - 1;
    return rr < 1 ? 4 * ENVMAPI_PI * ratio : 0;
}

/* As _sines, of a map that has no loop there: p along d, not of length 1. */
static void envmapi_near_rays(float *sines, float *density, const envmapi_window *w,
                              const envmapi_level *level, const envmapi_knot *u, double v, int n) {
    const double *a = w->a, Y = 2 * v - 1, back = w->face ? -0.5 : 0.5;
    int octa = level->mapping == ENVMAP_OCTAHEDRAL, sphere = level->mapping == ENVMAP_SPHERE;
    int angular = level->mapping == ENVMAP_ANGULAR;
    double inner = octa ? HUGE_VAL : pow(1 - 1.0 / level->edge, 2), rays = 0;
    for (int i = 0; i < n; ++i) {
        double X = 2 * u[i].at - 1, rr = X * X + Y * Y, x = fabs(X), y = fabs(Y);
        double side = (X < 0) == (y > 1) ? 1 : -1, fold = (Y < 0) == (x > 1) ? 1 : -1;
        x = x > 1 ? 2 - x : x, y = y > 1 ? 2 - y : y; /* an edge goes on, turned about its middle */
        double root = sphere ? 2 * sqrt(fmax(1 - rr, 0)) : 1, up = 1 - x - y;
        double p[3] = {root * X, -root * Y, sphere ? 1 - 2 * rr : back * (1 - rr)};
        if (octa) p[0] = side * (up < 0 ? 1 - y : x), p[1] = up, p[2] = fold * (up < 0 ? 1 - x : y);
        if (angular) rays = envmapi_near_angular(p, X, Y);
        double square = envmapi_dot(p, p), c = a[0] * p[1] - a[1] * p[0];
        double b = a[2] * p[0] - a[0] * p[2], d = a[1] * p[2] - a[2] * p[1];
        sines[i] = envmapi_dot(a, p) > 0 ? (float)((b * b + c * c + d * d) / square) : 2;
        density[i] = (float)(sphere ? 16 : 4 / (square * (octa ? sqrt(square) : 1)));
        if (angular) density[i] = (float)rays;
        else if (rr > inner) density[i] = (float)envmapi_window_density(level, u[i].at, v);
    }
}

/* n nodes along u, from `first` on, at v: the squared sines of their angles from the axis, 2 where
   these are obtuse; and d omega / du dv. Loops that a compiler can vectorise. */
static void envmapi_near_sines(float *sines, float *density, const envmapi_window *w,
                               const envmapi_near *s, const envmapi_knot *v, int first, int n) {
    const envmapi_level *level = &s->axis.level;
    const float *x = w->place + first, *p = w->apart + first;
    float Y = v->place, q = v->apart, side = (float)w->m[0];
    if (level->mapping == ENVMAP_CUBE) {
        float middle = (float)(w->m[2] + w->m[1] * (double)Y);
        for (int i = 0; i < n; ++i) { /* |a x d|^2 / |d|^2 */
            float square = 1 + Y * Y + x[i] * x[i], cross = Y * p[i] + x[i] * q, r;
            uint32_t bits;
            memcpy(&bits, &square, sizeof bits);
            bits = 0x5F3759DF - (bits >> 1); /* 1/sqrt, as envmapi_inverse_root */
            memcpy(&r, &bits, sizeof r);
            for (int step = 0; step < 3; ++step) r *= 1.5f - 0.5f * square * r * r;
            float sine = (p[i] * p[i] + q * q + cross * cross) * r * r;
            sines[i] = middle + side * x[i] > 0 ? sine : 2;
            density[i] = 4 * r * r * r;
        }
    } else if (level->mapping == ENVMAP_LATLONG) {
        float row = (float)(2 * ENVMAPI_PI * ENVMAPI_PI * sin(ENVMAPI_PI * v->at));
        for (int i = 0; i < n; ++i) { /* haversines; then chord^2 to sine^2 */
            float square = q + Y * x[i];
            sines[i] = square < 2 ? square - square * square / 4 : 2, density[i] = row;
        }
    } else {
        envmapi_near_rays(sines, density, w, level, w->u + first, v->at, n);
    }
}

/* k times `weight` of up to 64 squared sines; 0 beyond R. The bits of y = 1 + sine^2 / sigma^2 are
   the place in the table, of 2^bits values an octave. */
static void envmapi_near_k(float *k, const envmapi_near *s, float limit, const float *sines,
                           const float *weight, int n) {
    const float *table = s->table;
    float y[ENVMAPI_CHUNK] = {0}, low[ENVMAPI_CHUNK], high[ENVMAPI_CHUNK], w[ENVMAPI_CHUNK];
    float scale = s->inverse, fraction = s->fraction, most = 1 + scale * limit;
    uint32_t bits[ENVMAPI_CHUNK], mask = (1u << s->shift) - 1;
    int shift = s->shift, first = 127 << (23 - shift), place[ENVMAPI_CHUNK];
    for (int i = 0; i < n; ++i) {
        float one = 1 + scale * sines[i];
        w[i] = one < most ? weight[i] : 0, y[i] = one < most ? one : most;
    }
    memcpy(bits, y, sizeof bits);
    for (int i = 0; i < n; ++i) {
        place[i] = (int)(bits[i] >> shift) - first;
        y[i] = (float)(int)(bits[i] & mask) * fraction;
    }
    for (int i = 0; i < n; ++i) low[i] = table[place[i]], high[i] = table[place[i] + 1];
    for (int i = 0; i < n; ++i) k[i] = w[i] * (low[i] + y[i] * (high[i] - low[i]));
}

/* The solid angle of a texel of a cube's face, or of its plane, by that at its centre. */
static float envmapi_near_omega(const envmapi_level *level, int x, int y) {
    double u = (x + 0.5) / level->edge, v = (y + 0.5) / level->edge;
    return (float)(envmapi_density(level->mapping, u, v) / level->edge / level->edge);
}

/* Adds a finished row of points to K of a cell's n-th latitude: the mean of a tent's `places` times
   omega, or where this is NULL, the integral of k B_i: k's second integral's second difference. */
static void envmapi_near_fold(envmapi_window *w, int places, int n, int y, const float *omega) {
    envmapi_near_cell *cell = w->cell;
    envmapi_near_knots *knots = &cell->knots;
    int last = cell->last[0], most = (cell->reach + 1) * last, area = knots->height * knots->width;
    const float *k = w->rows[y & 1];
    double *twice = cell->twice, sum = 0, gauss = sqrt(1.0 / 12);
    float *out = w->apart;
    if (y < knots->y || y >= knots->y + knots->height) return;
    twice[0] = 0;
    for (int i = 0; i < most + last && !omega; ++i) {
        double step = cell->at[0][i % last + 1] - cell->at[0][i % last];
        double a = step / 2 * (double)k[2 * i], b = step / 2 * (double)k[2 * i + 1];
        twice[i + 1] = twice[i] + step * (sum + (0.5 + gauss) * a + (0.5 - gauss) * b);
        sum += a + b;
    }
    for (int i = 0; i <= most; ++i) {
        double mean = 0, before = twice[i > last ? i - last : last - i];
        for (int j = 0; j < places && omega; ++j)
            mean += envmapi_tent[places - 1][j][1] * (double)k[places * i + j];
        out[i] = omega ? (float)mean * *omega
                       : (float)(twice[i + last] - 2 * twice[i] + before);
    }
    for (int q = 0; q <= last; ++q) {
        float *K = knots->K + (n * (last + 1) + q) * area + (y - knots->y) * knots->width;
        for (int c = 0; c < knots->width; ++c) {
            int apart = (c - cell->reach) * last - q;
            K[c] += out[apart < 0 ? -apart : apart];
        }
    }
}

/* Adds a finished row of nodes to K of texels y; then it is empty. */
static void envmapi_near_flush(envmapi_window *w, const envmapi_near *s, int n, int count, int y,
                               int texels) {
    float *row = w->rows[y & 1], *K = w->K + ((y - w->y) * w->width) * ENVMAPI_NEAR_AXES + n;
    const envmapi_level *level = &s->axis.level;
    const float *omega =
        texels && !w->knot ? envmapi_omega_row(&s->in, y) + 3 * level->width : NULL;
    if (w->tied) envmapi_near_fold(w, envmapi_near_places(s), n, y, omega), count += -count & 15;
    for (int j = 0; j < count && !w->tied && y >= w->y && y < w->y + w->height;) {
        const envmapi_knot *u = w->u + j;
        float k = 0, next = 0; /* of all nodes of a texel */
        for (int texel = u->texel; j < count && w->u[j].texel == texel; ++j) {
            float one = row[j] * w->u[j].weight;
            k += one, next += one * w->u[j].f;
        }
        if (omega) k *= omega[envmapi_wrap(u->texel, level->width)];
        else if (texels) k *= envmapi_near_omega(level, u->texel, y);
        if (u->column[0] >= 0) K[u->column[0] * ENVMAPI_NEAR_AXES] += k - next;
        if (u->column[1] >= 0 && !texels) K[u->column[1] * ENVMAPI_NEAR_AXES] += next;
    }
    memset(row, 0, (size_t)(count + 15) * sizeof *row);
}

/* Are 16 nodes in a row all beyond R? Their sines have one minimum along a row. */
static int envmapi_near_misses(const float *sines, float limit) {
    return sines[0] >= limit && sines[15] >= limit &&
           (sines[1] > sines[0] || sines[14] > sines[15]);
}

/* Adds share times axis n's K of a window: the sum over texels, or the integral. */
static void envmapi_near_add(envmapi_window *w, const envmapi_near *s, int n, int texels,
                             double share) {
    const envmapi_level *level = &s->axis.level;
    double box[2][2], R = envmapi_near_reach(s, w->R, texels);
    float limit = (float)w->limit, sines[ENVMAPI_CHUNK], k[ENVMAPI_CHUNK], density[ENVMAPI_CHUNK];
    if (!envmapi_window_box(box, level->mapping, w->part, w->a, R,
                            envmapi_near_border(w, s, texels)))
        return;
    for (int i = 0; i < 2 && level->mapping == ENVMAP_CUBE; ++i) { /* what is open only */
        int first = i ? w->y : w->x, count = i ? w->height : w->width;
        box[i][0] = fmax(box[i][0], (first - 0.5) / level->edge);
        box[i][1] = fmin(box[i][1], (first + count + 0.5) / level->edge);
    }
    int count = w->tied ? w->tied : envmapi_near_nodes(w->u, s, w, box, 0, texels);
    int lines = envmapi_near_nodes(w->v, s, w, box, 1, texels), y = w->v[0].texel;
    int full = (count > lines ? count : lines) + 22 > (int)s->room;
    int summed = full && envmapi_axis_rim(&s->axis) > 0; /* by itself: texels are too long */
    if (summed) w->rim[n] = 1;
    if (!count || !lines || summed) return;
    int padded = (count + 15) / 16 * 16;
    int line = level->mapping == ENVMAP_CUBE || level->mapping == ENVMAP_LATLONG;
    for (int j = 0; j < padded && !w->tied; ++j) {
        if (j >= count) w->u[j] = w->u[count - 1];
        envmapi_near_place(w->place + j, w->apart + j, w, level->mapping, w->u[j].at, 0);
        for (int i = 0; i < 2; ++i)
            w->u[j].column[i] = envmapi_near_column(w, level, w->u[j].texel + i);
    }
    for (envmapi_knot *v = w->v; v < w->v + lines; ++v) {
        float here = (float)share * v->weight * (1 - v->f), next = (float)share * v->weight * v->f;
        for (; y < v->texel; ++y) envmapi_near_flush(w, s, n, count, y, texels);
        envmapi_near_place(&v->place, &v->apart, w, level->mapping, v->at, 1);
        for (int first = 0; first < padded; first += ENVMAPI_CHUNK) {
            int from = 0, to = padded - first < ENVMAPI_CHUNK ? padded - first : ENVMAPI_CHUNK;
            float *a = w->rows[y & 1] + first, *b = w->rows[~y & 1] + first;
            envmapi_near_sines(sines, density, w, s, v, first, to);
            while (line && from < to && envmapi_near_misses(sines + from, limit)) from += 16;
            while (line && from < to && envmapi_near_misses(sines + to - 16, limit)) to -= 16;
            if (texels)
                for (int i = from; i < to; ++i) density[i] = 1;
            envmapi_near_k(k, s, limit, sines + from, density + from, to - from);
            for (int i = from; i < to; ++i) a[i] += here * k[i - from];
            for (int i = from; i < to && !texels; ++i) b[i] += next * k[i - from];
        }
    }
    envmapi_near_flush(w, s, n, count, y, texels);
    if (!texels) envmapi_near_flush(w, s, n, count, y + 1, texels);
}

/* Adds the texels that a rim cuts, spread about their centroids. */
static void envmapi_near_rim(envmapi_window *w, const envmapi_near *s, int n, double share) {
    const envmapi_level *level = &s->axis.level;
    size_t width = (size_t)level->width, area = width * (size_t)level->edge;
    int places = envmapi_near_places(s), count = places * places;
    const double(*at)[2] = envmapi_tent[places - 1];
    double uv[2], d[3], tent = s->axis.tent / level->edge;
    double reach = cos(fmin(envmapi_near_reach(s, w->R, 1), ENVMAPI_PI));
    for (const envmapi_light *cut = s->in.rim; cut < s->in.rim + s->in.rim_count; ++cut) {
        int x = (int)(cut->texel % width) - w->x, y = (int)(cut->texel % area / width) - w->y;
        if ((int)(cut->texel / area) != w->face || x < 0 || x >= w->width || y < 0 ||
            y >= w->height || envmapi_dot(w->a, cut->d) < reach)
            continue;
        float sines[16], weight[16], k[16];
        envmapi_project(uv, level->mapping, w->face, cut->d);
        for (int i = 0; i < count; ++i) {
            const double *u = at[i % places], *v = at[i / places];
            envmapi_direction(d, level->mapping, w->face, uv[0] + tent * u[0], uv[1] + tent * v[0]);
            double c = envmapi_dot(w->a, d);
            sines[i] = (float)((1 - c) * (1 + c));
            weight[i] = (float)(share * cut->value[3] * u[1] * v[1]);
        }
        envmapi_near_k(k, s, (float)w->limit, sines, weight, count);
        for (int i = 0; i < count; ++i) w->K[(y * w->width + x) * ENVMAPI_NEAR_AXES + n] += k[i];
    }
}

/* K of some axes, in an open window. */
static void envmapi_near_kernel(envmapi_window *w, const envmapi_near *s, int axes) {
    const envmapi_level *level = &s->axis.level;
    double share = s->axis.bilinear;
    memset(w->K, 0, (size_t)(w->width * w->height * ENVMAPI_NEAR_AXES) * sizeof(float));
    for (int n = 0; n < axes; ++n) {
        memcpy(w->a, w->axes[n], sizeof w->a);
        if (w->rim[n]) continue;
        for (int i = 0; i < 2 && share > 0; ++i)
            w->sigma[i] = envmapi_window_finest(level, s->sigma, w->box, w->a, w->face, i);
        envmapi_window_frame(w->m, level->mapping, w->face, w->a);
        if (share > 0) envmapi_near_add(w, s, n, 0, share);
        if (share < 1) envmapi_near_add(w, s, n, 1, 1 - share);
        if (share < 1) envmapi_near_rim(w, s, n, 1 - share);
    }
}

/* ----------------------------------------------------------------------------------- >>knots --
   K of a few axes, and of those between, by cubic polynomials.
     in     a tile of axes, the open window of some       out    K of these
   Two cubes' texels lie alike about all axes of a face, if one's edge is a multiple of the other's:
   there K of a texel so many texels from the axis changes slowly from axis to axis. It is summed
   for 4 x 4 axes of a tile. On the face beyond an edge, and in two rows beside it where the
   integral ends, it changes slowly along the edge only: it is summed for 4 axes of each row.
   For a lat-long K is a function of the axis' latitude, the texel's row and the difference of their
   longitudes. It is summed at knots of both, for all axes between the centres of two rows, which
   are a cell; of its fourth root, as the root of a Gaussian is one twice as wide.
       knots of a tile or of a row        _tied: _steps, _knot, _tie
       those of a cell                    _cell_of, _cell_knots, _points, _cell_tie
       K between knots                    _mix: _between, _weights, _cell_add
   Used by >>near.  Source: ours.  Tests: tests/test_near.c,
   axes_between_knots_agree_with_those_summed_one_by_one and
   latitudes_between_knots_agree_with_axes_summed_one_by_one. */

/* Steps of windows on a part from axis to axis of a row: whole texels on the axes' own face, and on
   that beyond the edge along the row. 0 on others. */
static int envmapi_near_steps(int step[2], const envmapi_near *s, int part,
                              const envmapi_near_axes *axes) {
    double d[3], uv[2][2], size = s->dst.size, v = 2 * axes->y < s->dst.size ? 0 : 1;
    for (int i = 0; i < 2; ++i) {
        envmapi_direction(d, ENVMAP_CUBE, axes->face, (axes->x + i) / size, v);
        envmapi_project(uv[i], ENVMAP_CUBE, part, d);
    }
    for (int i = 0; i < 2; ++i) {
        double apart = (uv[1][i] - uv[0][i]) * s->axis.level.edge;
        step[i] = (int)floor(apart + 0.5);
        if (fabs(apart - step[i]) > 1e-3) return 0;
    }
    return 1;
}

/* Opens the window of a knot; x, y: where a window alike about axis 0 begins. 0 where it shows
   nothing; -1 where the face ends along a row. */
static int envmapi_near_knot(envmapi_window *w, const envmapi_near *s,
                             const envmapi_near_tile *tile, const envmapi_near_knots *knots,
                             int knot, double radius, int *x, int *y) {
    envmapi_near_axes one = {tile->face, tile->x + s->knot[knot & 3], knots->row, 1};
    const int *step = knots->step, edge = s->axis.level.edge;
    if (knots->plane) one.y = tile->y + s->knot[knot >> 2];
    envmapi_near_aim(w, s, &one);
    if (!envmapi_near_open(w, s, knots->part, radius)) return 0;
    *x = w->x - step[0] * one.x, *y = w->y - step[1] * one.x;
    if (knots->plane) *y -= s->ratio * one.y;
    int from = step[0] ? w->x : w->y, length = step[0] ? w->width : w->height;
    return knots->plane || (from >= 0 && from + length <= edge) ? 1 : -1;
}

/* K of knots, in windows of one size; ready is -1 where there is no room. */
static void envmapi_near_tie(envmapi_window *w, const envmapi_near *s,
                             const envmapi_near_tile *tile, envmapi_near_knots *knots,
                             double radius) {
    int x, y, right = 0, below = 0, open = 1, first = 1, count = knots->plane ? 16 : 4;
    w->knot = knots->plane, knots->x = knots->y = 0;
    for (int k = 0; k < count && open >= 0; ++k) {
        open = envmapi_near_knot(w, s, tile, knots, k, radius, &x, &y);
        if (open < 1) continue;
        if (first) knots->x = right = x, knots->y = below = y, first = 0;
        knots->x = x < knots->x ? x : knots->x, knots->y = y < knots->y ? y : knots->y;
        right = x + w->width > right ? x + w->width : right;
        below = y + w->height > below ? y + w->height : below;
    }
    knots->width = right - knots->x, knots->height = below - knots->y;
    if (!knots->plane && knots->part == tile->face)
        knots->y = 2 * knots->row < s->dst.size ? -1 : s->axis.level.edge - 1, knots->height = 2;
    size_t area = (size_t)(knots->width * knots->height);
    knots->ready = open >= 0 && area <= s->area ? 1 : -1;
    for (int k = 0; k < count && knots->ready > 0; ++k) {
        float *K = knots->K + (size_t)k * area;
        memset(K, 0, area * sizeof *K);
        if (!envmapi_near_knot(w, s, tile, knots, k, radius, &x, &y)) continue;
        w->x += knots->x - x, w->width = knots->width;
        w->y += knots->y - y, w->height = knots->height;
        envmapi_near_kernel(w, s, 1);
        for (size_t i = 0; i < area; ++i) K[i] = w->K[i * ENVMAPI_NEAR_AXES];
    }
    w->knot = 0;
}

/* Adds K of axis n between knots to the open window, where that of the knots begins at x, y: 4
   along u, and `lines` along v, from K on, `next` in a line. A lat-long's are roots, and go on over
   its seam; a plane's end where its face does. */
static void envmapi_near_mix(envmapi_window *w, const envmapi_near *s, int n,
                             const envmapi_near_knots *knots, const float *K, int next, int lines,
                             const float along[4], const float down[4], int x, int y) {
    int width = knots->width, height = knots->height, area = width * height;
    int edge = s->axis.level.edge, roots = s->axis.level.mapping == ENVMAP_LATLONG;
    int left = 0, right = w->width, top = 0, bottom = w->height; /* of the window */
    int cut = s->axis.bilinear > 0; /* beside an edge: _beside adds these */
    if (knots->plane) {
        left = w->x < 0 ? cut - w->x : 0, top = w->y < 0 ? cut - w->y : 0;
        right = w->x + right > edge ? edge - cut - w->x : right;
        bottom = w->y + bottom > edge ? edge - cut - w->y : bottom;
    }
    int from = top > y ? top - y : 0, count = bottom - y < height ? bottom - y : height;
    count = (count - from) * width, K += from * width;
    float *k = w->own, *out = w->K + n + (y + from) * w->width * ENVMAPI_NEAR_AXES;
    if (count <= 0) return;
    memset(k, 0, (size_t)count * sizeof *k);
    for (int i = 0; i < lines; ++i) {
        const float *a = K + i * next * area, *b = a + area, *c = b + area, *d = c + area;
        float e = down[i] * along[0], f = down[i] * along[1], g = down[i] * along[2];
        float h = down[i] * along[3];
        for (int j = 0; j < count; ++j) k[j] += e * a[j] + f * b[j] + g * c[j] + h * d[j];
    }
    for (int j = 0; j < count && roots; ++j) k[j] *= k[j], k[j] *= k[j];
    for (; count > 0; count -= width, k += width, out += w->width * ENVMAPI_NEAR_AXES)
        for (int to = x; to > -width; to -= roots ? s->axis.level.width : 2 * edge + width) {
            int first = left > to ? left - to : 0, end = right - to < width ? right - to : width;
            for (int c = first; c < end; ++c) out[(to + c) * ENVMAPI_NEAR_AXES] += k[c];
        }
}

/* Adds K of axes between knots, by Lagrange's cubic polynomials, to the open window. Of a tile's
   knots those of a row of axes come first, as all of the row share them. */
static void envmapi_near_between(envmapi_window *w, const envmapi_near *s,
                                 const envmapi_near_tile *tile, const envmapi_near_axes *axes,
                                 envmapi_near_knots *knots) {
    static const float one[4] = {1};
    const float *down = s->between[axes->y - tile->y], *K = knots->plane ? knots->line : knots->K;
    int y = knots->y + (knots->plane ? s->ratio * axes->y : 0) - w->y;
    int count = 4 * knots->width * knots->height;
    if (knots->plane && knots->folded != axes->y) {
        const float *a = knots->K, *b = a + count, *c = b + count, *d = c + count;
        for (int i = 0; i < count; ++i)
            knots->line[i] = down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i];
        knots->folded = axes->y;
    }
    for (int n = 0; n < axes->count; ++n)
        envmapi_near_mix(w, s, n, knots, K, 4, 1, s->between[axes->x + n - tile->x], one,
                         knots->x + knots->step[0] * (axes->x + n) - w->x,
                         y + knots->step[1] * (axes->x + n));
}

/* Knots between two texels' centres, where K has kinks as wide as the lobe: the ends of pieces, and
   two within each for a cubic polynomial. Pieces within `reach` of a kink are of one length, others
   as long as they are far. Returns the last. */
static int envmapi_near_cell_knots(double at[ENVMAPI_CELL_KNOTS + 1], double piece, double reach) {
    double sum = 0, end = 0;
    int count = 0;
    while (sum < 1 && 3 * count < ENVMAPI_CELL_KNOTS) {
        double from = 0, length = 0;
        sum = 0, ++count;
        for (int i = 0; i < (count + 1) / 2; ++i, from += length) {
            length = from < reach ? piece : fmax(piece, from);
            at[3 * i] = at[3 * (count - 1 - i)] = length;
        }
        for (int i = 0; i < count; ++i) sum += at[3 * i];
    }
    for (int i = 0; i < count; ++i) {
        double from = end, length = at[3 * i] / sum;
        end += length, at[3 * i] = from;
        at[3 * i + 1] = from + (1 - sqrt(0.5)) * length, at[3 * i + 2] = from + sqrt(0.5) * length;
    }
    at[3 * count] = 1;
    return sum < 1 ? 0 : 3 * count;
}

/* What is to be summed for a cell; returns how many numbers K has, or 0 where the axes are so few
   that each is summed. */
static size_t envmapi_near_cell_of(envmapi_near_cell *cell, const envmapi_near *s,
                                   const envmapi_near_tile *tile) {
    const envmapi_level *level = &s->axis.level;
    double high = ENVMAPI_PI / level->edge, least = s->beyond > 0 ? 1 : 0;
    double R = envmapi_near_reach(s, s->R_bright, s->axis.bilinear < 1);
    double theta = high * fmax(fmin(tile->y + 0.5, level->edge - tile->y - 1.5), 0);
    double across = theta > R ? asin(sin(R) / sin(theta)) / high : level->edge;
    double sine = sin(fmin(theta + high, ENVMAPI_PI / 2));
    double even = s->tail ? least : s->R_bright / high;
    cell->knots.row = tile->y, cell->knots.y = tile->y - (int)(R / high) - 1;
    cell->knots.height = 2 * (tile->y - cell->knots.y) + 2, cell->reach = (int)across + 1;
    if (2 * cell->reach + 2 > level->width) cell->reach = level->width / 2 - 1;
    cell->knots.width = 2 * cell->reach + 2;
    int u = envmapi_near_cell_knots(cell->at[0], s->cell_piece / sine, even / sine);
    int v = envmapi_near_cell_knots(cell->at[1], s->cell_piece, even);
    cell->last[0] = u, cell->last[1] = v;
    cell->knots.ready = u && v && u * v < 12 * tile->count &&
                  4 * (cell->reach + 2) * (u + 1) < (int)s->room - 16; /* 12: speed only */
    return (size_t)cell->knots.ready * (size_t)((u + 1) * (v + 1)) *
           (size_t)(cell->knots.height * cell->knots.width);
}

/* Points along u about a cell's meridian: two of Gauss and Legendre between knots, or those of a
   tent about each. Returns how many. */
static int envmapi_near_points(envmapi_window *w, const envmapi_near *s, int texels) {
    const envmapi_near_cell *cell = w->cell;
    int points = texels ? envmapi_near_places(s) : 2;
    int last = cell->last[0], count = points * ((cell->reach + 2) * last + 1);
    w->m[0] = 0;
    for (int i = 0; i < count + 15; ++i) {
        const double *at = cell->at[0] + i / points % last;
        double side = i % 2 ? 1 : -1, x = i / points / last + at[0];
        if (texels) x += s->axis.tent * envmapi_tent[points - 1][i % points][0];
        else x += (at[1] - at[0]) * (3 + side * sqrt(3.0)) / 6;
        envmapi_near_place(w->place + i, w->apart + i, w, ENVMAP_LATLONG, x / s->axis.level.width,
                           0);
    }
    return count;
}

/* K of a cell's knots. */
static void envmapi_near_cell_tie(envmapi_window *w, const envmapi_near *s,
                                  const envmapi_near_tile *tile) {
    envmapi_near_cell *cell = w->cell;
    int edge = s->axis.level.edge;
    double share = s->axis.bilinear;
    size_t count = envmapi_near_cell_of(cell, s, tile);
    if (!cell->knots.ready) return;
    memset(cell->knots.K, 0, count * sizeof(float));
    w->R = s->R_bright, w->limit = pow(sin(w->R), 2), w->part = w->face = 0;
    w->sigma[1] = s->sigma * edge / ENVMAPI_PI;
    w->y = w->width = w->height = 0; /* no window is open */
    for (int texels = share < 1 ? 1 : 0; texels >= (share > 0 ? 0 : 1); --texels) {
        double part = texels ? 1 - share : share / s->axis.level.width;
        w->tied = envmapi_near_points(w, s, texels);
        for (int n = 0; n <= cell->last[1]; ++n) {
            double v = (cell->knots.row + 0.5 + cell->at[1][n]) / edge;
            envmapi_direction(w->a, ENVMAP_LATLONG, 0, 0, v);
            w->m[1] = ENVMAPI_PI * v, w->m[2] = sin(w->m[1]);
            envmapi_near_add(w, s, n, texels, part);
        }
    }
    w->tied = 0;
    for (size_t i = 0; i < count; ++i) { /* K^(-1/4) by Newton's steps, as envmapi_inverse_root */
        float K = cell->knots.K[i] > 1e-30f ? cell->knots.K[i] : 1e-30f, r;
        uint32_t bits;
        memcpy(&bits, &K, sizeof bits);
        bits = 0x4F58CCCD - (bits >> 2);
        memcpy(&r, &bits, sizeof r);
        for (int step = 0; step < 3; ++step) r *= 1.25f - 0.25f * K * r * r * r * r;
        cell->knots.K[i] = K * r * r * r;
    }
}

/* Weights of the four knots about x, from the one that is returned on. */
static int envmapi_near_weights(float weight[4], const double *at, int last, double x) {
    int first = 0;
    while (first + 3 < last && x > at[first + 3]) first += 3;
    for (int i = 0; i < 4; ++i) {
        double f = 1;
        for (int j = 0; j < 4; ++j)
            if (j != i) f *= (x - at[first + j]) / (at[first + i] - at[first + j]);
        weight[i] = (float)f;
    }
    return first;
}

/* Adds K of an axis between a cell's knots to the open window. */
static void envmapi_near_cell_add(envmapi_window *w, const envmapi_near *s, int n,
                                  const envmapi_near_cell *cell) {
    const envmapi_level *level = &s->axis.level;
    int wide = level->width, next = cell->last[0] + 1;
    double uv[2];
    float along[4], down[4];
    envmapi_project(uv, ENVMAP_LATLONG, 0, w->axes[n]);
    double x = uv[0] * wide - 0.5, y = uv[1] * level->edge - 0.5 - cell->knots.row;
    int column = (int)floor(x), shift = (column - cell->reach - w->x) % wide;
    int q = envmapi_near_weights(along, cell->at[0], cell->last[0], x - column);
    int p = envmapi_near_weights(down, cell->at[1], cell->last[1], y);
    const float *K = cell->knots.K + (p * next + q) * cell->knots.width * cell->knots.height;
    envmapi_near_mix(w, s, n, &cell->knots, K, next, 4, along, down,
                     shift < 0 ? shift + wide : shift, cell->knots.y - w->y);
}

/* The knots of a tile, or of the row, for the open window; opens it again. */
static envmapi_near_knots *envmapi_near_tied(envmapi_window *w, const envmapi_near *s,
                                             const envmapi_near_tile *tile,
                                             const envmapi_near_axes *axes, int outer, int plane) {
    int part = w->part;
    envmapi_near_knots *knots =
        plane ? w->knots + outer : w->lines[outer] + (part == axes->face);
    if (knots->ready && (plane || (knots->row == axes->y && knots->part == part))) return knots;
    knots->part = part, knots->row = axes->y, knots->plane = plane, knots->ready = -1;
    knots->folded = -1;
    if (!envmapi_near_steps(knots->step, s, part, axes)) return knots;
    double R = w->R;
    envmapi_near_tie(w, s, tile, knots, R);
    envmapi_near_aim(w, s, axes);
    envmapi_near_open(w, s, part, R);
    return knots;
}

/* Adds K of some axes in a part of the open window. */
static void envmapi_near_strip(envmapi_window *w, const envmapi_near *s, int axes, int x, int y,
                               int width, int height) {
    const int open[4] = {w->x, w->y, w->width, w->height};
    float *out = w->K, *to = out + ((y - w->y) * w->width + x - w->x) * ENVMAPI_NEAR_AXES;
    w->x = x, w->y = y, w->width = width, w->height = height, w->K = w->strip;
    envmapi_near_kernel(w, s, axes);
    w->x = open[0], w->y = open[1], w->width = open[2], w->height = open[3], w->K = out;
    for (int i = 0; i < width * height * ENVMAPI_NEAR_AXES; ++i)
        to[i + i / (width * ENVMAPI_NEAR_AXES) * (w->width - width) * ENVMAPI_NEAR_AXES] +=
            w->strip[i];
}

/* K of some axes in the open window: between a tile's knots on the axes' own face, between a row's
   elsewhere. Where the integral over the own face ends, K of two rows or columns is another: it
   lies between a row's knots, or is that of each axis. */
static void envmapi_near_weigh(envmapi_window *w, const envmapi_near *s,
                               const envmapi_near_tile *tile, const envmapi_near_axes *axes,
                               int outer) {
    int edge = s->axis.level.edge, own = w->part == axes->face, cells = w->cells[0].knots.ready;
    int ends = own && s->axis.bilinear > 0, top = ends && w->y < 0, left = ends && w->x < 0;
    int bottom = ends && w->y + w->height > edge, right = ends && w->x + w->width > edge;
    int from = top ? 1 : w->y, rows = (bottom ? edge - 1 : w->y + w->height) - from;
    envmapi_near_knots *knots = NULL, *strip = NULL;
    cells = cells && (s->part_count < 2 || w->cells[1].knots.ready);
    if (s->ratio) knots = envmapi_near_tied(w, s, tile, axes, outer, own);
    if (!cells && (!knots || knots->ready < 0)) {
        envmapi_near_kernel(w, s, axes->count);
        return;
    }
    if (!cells && (top || bottom) && !left && !right)
        strip = envmapi_near_tied(w, s, tile, axes, outer, 0);
    memset(w->K, 0, (size_t)(w->width * w->height * ENVMAPI_NEAR_AXES) * sizeof *w->K);
    for (int i = 0; i < s->part_count * axes->count && cells; ++i)
        envmapi_near_cell_add(w, s, i % axes->count, w->cells + i / axes->count);
    if (cells) return;
    envmapi_near_between(w, s, tile, axes, knots);
    if (strip && strip->ready > 0) envmapi_near_between(w, s, tile, axes, strip);
    else if (top || bottom)
        envmapi_near_strip(w, s, axes->count, w->x, top ? -1 : edge - 1, w->width, 2);
    if (left) envmapi_near_strip(w, s, axes->count, -1, from, 2, rows);
    if (right) envmapi_near_strip(w, s, axes->count, edge - 1, from, 2, rows);
}

/* ------------------------------------------------------------------------------------- >>near --
   Sharp lobes: the sum that >>reference defines, over the few texels that such a lobe reaches.
     in     a slice of a source, a lobe, its p, a tolerance       out    a slice of a result
       L(a) = sum_i K_i(a) L_i / sum_i K_i       texels i within R of the axis a
   K_i depends on no radiance. Some of the 48 turns and mirrors take texels to texels, on both maps:
   all 48 for two cubes, 16 for a lat-long and a cube, 2 to 16 with discs. So one K_i serves all
   images of an axis and a texel. The RGB of these lie side by side, in blocks of 16 numbers, and
   up to eight neighbouring axes share what is read of a block.
       which axes, and the texels they need       _plan; these side by side: _task_near_blocks
       K times L for all turns; into dst          _apply, _put
       R, by the brightest texel in sight         _radius; _contrast tells which are bright
   Of a source of few texels all are in sight of a lobe that reaches far; there K_i is what the
   reference counts: _all.
   Called by filters for what FAST leaves.  Source: ours.  Tests: tests/test_near.c. */

/* Tuned on tests/test_near.c; the test named above a constant fails without it.
   a_sun_keeps_the_tolerance_as_far_as_the_lobe_reaches, of all */
#define ENVMAPI_COARSE  0.1 /* rad: texels wider than this are coarser than any kernel of FAST */
#define ENVMAPI_RUN     64  /* texels that are bright together; any number is right */
#define ENVMAPI_OCTAVES 320 /* of a float's exponents, from the least denormal on */

/* ---- the source as lookups see it, in blocks */

/* A texel, or what add_tap finds beyond an edge. The texel beyond a cube's corner is the mean of
   the three that meet there; the row beyond a lat-long's pole lets linear interpolation end at the
   row's mean on the pole. */
static void envmapi_near_texel(float out[3], const envmapi_near *s, int face, int x, int y) {
    const envmapi_level *level = &s->axis.level;
    int w = level->width, h = level->edge, pole = y < 0 || y >= h;
    double rgb[3] = {0, 0, 0};
    if (level->mapping == ENVMAP_LATLONG) x = ((x % w) + w) % w;
    if (s->all) { /* none is beyond an edge, some beyond a rim */
        const float *texel = level->texels + 3 * ((face * h + y) * w + x);
        for (int c = 0; c < 3; ++c) rgb[c] = (double)texel[c];
    } else if (level->mapping == ENVMAP_CUBE && (x < 0 || x >= w) && pole) {
        int in_x = x < 0 ? 0 : w - 1, in_y = y < 0 ? 0 : h - 1;
        envmapi_add_tap(rgb, level, face, in_x, in_y, 1.0 / 3);
        envmapi_add_tap(rgb, level, face, x, in_y, 1.0 / 3);
        envmapi_add_tap(rgb, level, face, in_x, y, 1.0 / 3);
    } else if (level->mapping == ENVMAP_LATLONG && pole) {
        envmapi_add_tap(rgb, level, face, x, y, -1);
        for (int c = 0; c < 3; ++c) rgb[c] += 2 * s->poles[y < 0 ? 0 : 1][c];
    } else {
        envmapi_add_tap(rgb, level, face, x, y, 1);
    }
    for (int c = 0; c < 3; ++c) out[c] = (float)rgb[c];
    if (s->exponent) envmapi_floats_scale(out, out, 3, -s->exponent);
}

/* Blocks of 16 numbers: RGB of turn after turn. */
static int envmapi_near_groups(const envmapi_near *s) { return (3 * s->turn_count + 15) / 16; }

static void envmapi_task_near_blocks(void *context, int task) {
    const envmapi_near *s = (const envmapi_near *)context;
    const envmapi_level *level = &s->axis.level;
    envmapi_near_row *row = s->rows + task;
    int high = level->edge + 2, face = task / high, y = task % high - 1, w = level->width;
    int round = level->mapping == ENVMAP_SPHERE || level->mapping == ENVMAP_ANGULAR;
    float most = (float)ldexp(s->bright, -s->exponent);
    if (!row->here) return;
    for (int i = 3 * s->turn_count; i < 16 * envmapi_near_groups(s); ++i)
        for (int x = 0; x < row->to - row->from; ++x)
            s->blocks[16 * ((size_t)(i / 16) * s->count + row->first + (size_t)x) +
                      (size_t)(i % 16)] = 0;
    for (int t = 0; t < s->turn_count; ++t) {
        const envmapi_place *to = s->turns[t].src + face;
        const float *image = level->texels + 3 * (size_t)(to->face * level->edge) * (size_t)w;
        float *out[3], rgb[3];
        for (int c = 0; c < 3; ++c)
            out[c] = s->blocks + 16 * ((size_t)((3 * t + c) / 16) * s->count + row->first) +
                     (3 * t + c) % 16;
        for (int x = row->from; x < row->to; ++x) {
            int X = to->x0 + to->xx * x + to->xy * y, Y = to->y0 + to->yx * x + to->yy * y;
            if (s->exponent || round || X < 0 || Y < 0 || X >= w || Y >= level->edge)
                envmapi_near_texel(rgb, s, to->face, X, Y);
            else memcpy(rgb, image + 3 * ((size_t)Y * (size_t)w + (size_t)X), sizeof rgb);
            for (int c = 0; c < 3; ++c) out[c][16 * (x - row->from)] = rgb[c];
            if (rgb[0] > most || rgb[1] > most || rgb[2] > most)
                for (int g = 3 * t / 16; g <= (3 * t + 2) / 16; ++g) {
                    if (row->bright[g][0] == row->bright[g][1]) row->bright[g][0] = x;
                    if (x < row->bright[g][0]) row->bright[g][0] = x;
                    if (x >= row->bright[g][1]) row->bright[g][1] = x + 1;
                }
        }
    }
}

static envmapi_near_row *envmapi_near_rows(const envmapi_near *s, const envmapi_window *w) {
    return s->rows + w->face * (s->axis.level.edge + 2) + w->y + 1;
}

/* Blocks that have a bright texel in the window, as bits. */
static unsigned envmapi_near_bright(const envmapi_window *w, const envmapi_near *s) {
    const envmapi_near_row *row = envmapi_near_rows(s, w);
    unsigned groups = 0;
    for (int y = 0; y < w->height; ++y, ++row)
        for (int g = 0; g < envmapi_near_groups(s); ++g)
            if (row->bright[g][0] < w->x + w->width && row->bright[g][1] > w->x) groups |= 1u << g;
    return groups;
}

/* Are K of four axes 0? */
static int envmapi_near_none(const float *k) {
    uint32_t bits[4];
    memcpy(bits, k, sizeof bits);
    return !((bits[0] | bits[1] | bits[2] | bits[3]) << 1);
}

/* sums += K times blocks: one K serves a texel's images under all turns; those of these blocks.
   Four axes at a time, as neighbours see nearly the same of a row. A row is summed by itself, as
   floats that are added one by one to a large sum lose more. */
static void envmapi_near_apply(envmapi_window *w, const envmapi_near *s, unsigned groups) {
    enum { N = ENVMAPI_NEAR_AXES, F = 4 };
    const envmapi_near_row *row = envmapi_near_rows(s, w);
    double total[N] = {0};
    for (int i = 0; i < w->height * N / F; ++i) {
        const float *K = w->K + i / (N / F) * w->width * N;
        int four = i % (N / F) * F, from = 0, to = w->width, y = i / (N / F);
        const float *k = K + four;
        while (from < to && envmapi_near_none(k + from * N)) ++from;
        while (from < to && envmapi_near_none(k + to * N - N)) --to;
        float in_row[F] = {0};
        for (int x = from; x < to; ++x)
            for (int n = 0; n < F; ++n) in_row[n] += k[x * N + n];
        for (int n = 0; n < F; ++n) total[four + n] += (double)in_row[n];
        size_t at = row[y].first + (size_t)(w->x - row[y].from) + (size_t)from;
        for (int g = 0; g < envmapi_near_groups(s) && from < to; ++g) {
            if (!(groups >> g & 1)) continue;
            const float *block = s->blocks + 16 * ((size_t)g * s->count + at);
            envmapi_float16 sums[F];
            memset(sums, 0, sizeof sums);
            for (const float *each = k + from * N; each < k + to * N; each += N, block += 16) {
                ENVMAPI_PREFETCH(block + 16 * (row[y].to - row[y].from)); /* the next row's */
                ENVMAPI_UNROLL for (int n = 0; n < F; ++n)
                    envmapi_float16_add(sums + n, each[n], envmapi_float16_at(block));
            }
            for (int n = 0; n < F; ++n)
                envmapi_float16_add(envmapi_float16_at(w->sums[g][four + n]), 1, sums + n);
        }
    }
    for (int g = 0; g < envmapi_near_groups(s); ++g)
        for (int n = 0; n < N && groups >> g & 1; ++n) w->norms[g][n] += total[n];
}

/* ---- a slice */

/* The reference's sum for a texel of dst; without what is in dst already. All texels outside a
   disc have one axis. */
static void envmapi_near_reference(double sum[4], envmapi_window *w, const envmapi_near *s,
                                   size_t texel) {
    envmapi_axis *axis = &w->single;
    *axis = s->axis;
    axis->light = axis->sum, axis->sight = s->R_bright, axis->tent = s->tent;
    int width = envmapi_width(s->dst.mapping, s->dst.size), row = (int)(texel / (size_t)width);
    envmapi_texel_direction(axis->a, s->dst.mapping, row / s->dst.size, s->dst.size,
                            (int)(texel % (size_t)width), row % s->dst.size);
    int sphere = s->dst.mapping == ENVMAP_SPHERE, disc = sphere || s->dst.mapping == ENVMAP_ANGULAR;
    int outside = disc && hypot(axis->a[0], axis->a[1]) < 1e-9 && (axis->a[2] < 0) == sphere;
    if (outside) axis->a[0] = axis->a[1] = 0;
    if (outside && w->outside[3] > 0) memcpy(axis->sum, w->outside, sizeof axis->sum);
    else if (s->tail && axis->bilinear >= 1) envmapi_axis_circles(axis, 1, axis->reach);
    else envmapi_axis_filter(axis, NULL);
    if (outside) memcpy(w->outside, axis->sum, sizeof axis->sum);
    memcpy(sum, axis->sum, sizeof axis->sum);
}

/* Axis n to its texel of dst and its images; all are read before one is written, as a texel on a
   mirror is its own image. */
static void envmapi_near_put(envmapi_window *w, const envmapi_near *s, int n,
                             const envmapi_near_axes *axes, int rim) {
    enum { N = 16 * ENVMAPI_NEAR_BLOCKS };
    float *image = envmapi_image(&s->dst, 0, s->slice, 0), out[N] = {0};
    const envmapi_tail *tail = rim && s->axis.bilinear < 1 ? NULL : s->tail; /* the sum has it */
    int fixed = fabs(s->norm) > 0, at[48];                                   /* raw, or Banks */
    double unit = rim ? 1 : s->scale, whole = tail && !fixed ? tail->integral / unit : 0;
    double power = ldexp(1, s->exponent), sum[4] = {0};
    for (int t = 0; t < s->turn_count; t += 16)
        envmapi_images_at(at + t, s->images[t / 16] + axes->face, &s->dst, axes->x, axes->y);
    for (int t = 0; t < s->turn_count && tail; ++t)
        for (int c = 0; c < 3; ++c) {
            float before = image[3 * (ptrdiff_t)at[t] + c];
            out[3 * t + c] = fixed || before > 0 ? before : 0;
        }
    for (int i = 0; i < 3 * s->turn_count; i += rim ? 3 : 16) {
        int g = i / 16, count = rim ? 3 : 16, twin = 0;
        while (rim && at[twin] != at[i / 3]) ++twin;
        if (rim && 3 * twin < i) { /* a texel in the middle of a disc is its own image */
            memcpy(out + i, out + 3 * twin, 3 * sizeof *out);
            continue;
        }
        if (rim) envmapi_near_reference(sum, w, s, (size_t)at[i / 3]);
        double norm = rim ? sum[3] : w->norms[g][n];
        double each = fixed ? unit / s->norm : 1 / (norm + whole);
        float lanes[16];
        memcpy(lanes, w->sums[g][n], sizeof lanes);
        for (int k = 0; k < count; ++k) {
            if (!fixed && tail && tail->sums)
                each = 1 / (norm + whole * (double)tail->sums[at[(i + k) / 3 % s->turn_count]]);
            double light = (rim ? sum[k] : power * (double)lanes[k]) * each;
            double share = fixed ? 1 : whole * each;
            out[i + k] = envmapi_to_float(light + share * (double)out[i + k]);
        }
    }
    for (int t = 0; t < s->turn_count; ++t)
        memcpy(image + 3 * (ptrdiff_t)at[t], out + 3 * t, 3 * sizeof *out);
}

/* Has an axis a rim's texels, which are long, in the core of its lobe?
   Test: works_that_broke_hold (tests/test_search.c), of tents. */
static int envmapi_near_at_rim(const envmapi_near *s, const double a[3]) {
    return envmapi_axis_at_rim(&s->axis, a, fmin(s->R_bright, 8 * s->sigma));
}

/* Some axes: all texels, as the reference weighs them. */
static void envmapi_near_all(envmapi_window *w, const envmapi_near *s, int axes) {
    enum { N = ENVMAPI_NEAR_AXES };
    envmapi_axis *axis = &w->single;
    float *K = w->K;
    *axis = s->axis;
    axis->level.texels = NULL, axis->light = w->light, axis->sight = s->R_bright;
    memset(K, 0, s->all * N * sizeof *K);
    for (int n = 0; n < axes; ++n) {
        memset(w->light, 0, s->all * sizeof *w->light);
        memcpy(axis->a, w->axes[n], sizeof axis->a);
        axis->tent = envmapi_near_at_rim(s, axis->a) ? s->tent : s->axis.tent;
        envmapi_axis_filter(axis, NULL);
        for (size_t i = 0; i < s->all; ++i) K[i * N + (size_t)n] = (float)(w->light[i] / s->scale);
    }
    w->x = w->y = w->face = 0, w->width = s->axis.level.width, w->height = s->axis.level.edge;
    for (; w->K < K + s->all * N; w->K += w->width * w->height * N, ++w->face)
        envmapi_near_apply(w, s, (1u << envmapi_near_groups(s)) - 1);
    w->K = K;
}

/* Some axes: what they see of every part, farther under those turns that show a bright texel. */
static void envmapi_near_see(envmapi_window *w, const envmapi_near *s,
                             const envmapi_near_tile *tile, const envmapi_near_axes *axes) {
    unsigned all = (1u << envmapi_near_groups(s)) - 1;
    memset(w->sums, 0, sizeof w->sums), memset(w->norms, 0, sizeof w->norms);
    envmapi_near_aim(w, s, axes);
    if (s->all) envmapi_near_all(w, s, axes->count);
    /* at tight tolerances what windows miss across an octahedral fold shows for axes on it */
    int folded = s->axis.level.mapping == ENVMAP_OCTAHEDRAL;
    double fold = folded ? 4 * s->sigma * (1 / s->piece - 1.3) : 0; /* from 1.2e-4 on */
    for (int n = 0; n < axes->count; ++n)
        w->rim[n] = !s->all &&
                    (fabs(w->axes[n][1]) < fold || envmapi_near_at_rim(s, w->axes[n]));
    for (int part = 0; part < envmapi_window_parts(s->axis.level.mapping) && !s->all; ++part) {
        unsigned bright = 0;
        for (int outer = 1; outer >= 0; --outer) {
            if (!envmapi_near_open(w, s, part, outer ? s->R_bright : s->R)) continue;
            if (outer && s->R < s->R_bright) bright = envmapi_near_bright(w, s);
            unsigned groups = outer ? bright : all & ~bright;
            if (!groups) continue;
            envmapi_near_weigh(w, s, tile, axes, outer);
            envmapi_near_apply(w, s, groups);
        }
    }
    for (int n = 0; n < axes->count; ++n) envmapi_near_put(w, s, n, axes + n, w->rim[n]);
}

static void envmapi_task_near(void *context, int task) {
    const envmapi_near *s = (const envmapi_near *)context;
    size_t room = s->room;
    envmapi_window *w = (envmapi_window *)(void *)(s->work + (size_t)task * s->bytes);
    w->light = (double *)(void *)(w + 1);
    w->u = (envmapi_knot *)(void *)(w->light + s->all), w->v = w->u + room;
    w->place = (float *)(w->v + room), w->apart = w->place + room;
    w->rows[0] = w->apart + room, w->rows[1] = w->rows[0] + room, w->K = w->rows[1] + room;
    memset(w->rows[0], 0, 2 * room * sizeof(float));
    w->knots[0].K = w->K + s->area * ENVMAPI_NEAR_AXES;
    w->knots[1].K = w->knots[0].K + s->area * 16, w->knot = 0;
    for (size_t i = 0; i < 4; ++i)
        w->lines[i / 2][i % 2].K = w->knots[1].K + s->area * (16 + 4 * i);
    w->knots[0].line = w->knots[1].K + s->area * 32;
    w->knots[1].line = w->knots[0].line + s->area * 4, w->strip = w->knots[1].line + s->area * 4;
    memset(w->cells, 0, sizeof w->cells), w->tied = 0, w->outside[3] = 0;
    float *end = (float *)(void *)((char *)w + s->bytes) - 2 * room;
    w->own = end -= s->own;
    for (int i = 0; i < s->part_count; ++i) {
        w->cells[i].twice = (double *)(void *)((char *)w + s->bytes) - room;
        w->cells[i].knots.K = end -= s->parts[i].cell;
    }
    int last = s->first + s->round;
    if (last > s->tile_count) last = s->tile_count;
    for (int i = s->first + task; i < last; i += s->tasks) {
        const envmapi_near_tile *tile = s->tiles + i;
        w->knots[0].ready = w->knots[1].ready = 0;
        for (int line = 0; line < 4; ++line) w->lines[line / 2][line % 2].ready = 0;
        for (int part = 0; part < s->part_count; ++part) {
            w->cell = w->cells + part;
            envmapi_near_cell_tie(w, s->parts + part, tile);
        }
        const envmapi_near_axes *axes = s->axes + tile->first, *after = axes + tile->count;
        for (; axes < after; axes += axes->count) envmapi_near_see(w, s, tile, axes);
    }
}

/* The first of the texels that turns take to each other does the work for all of them. The turns
   that keep a face; 0 where one takes it to an earlier one. */
static int envmapi_near_keep(const envmapi_place *kept[48], const envmapi_near *s, int face) {
    int count = 0;
    for (int t = 0; t < s->turn_count; ++t) {
        const envmapi_place *to = s->turns[t].dst + face;
        if (to->face < face) return 0;
        if (to->face == face) kept[count++] = to;
    }
    return count;
}

static int envmapi_near_first(const envmap *dst, const envmapi_place *const *kept, int count, int x,
                              int y) {
    size_t own = envmapi_turned(dst, kept[0], x, y); /* the first turn is none */
    for (int t = 1; t < count; ++t) {
        int row = kept[t]->y0 + kept[t]->yx * x + kept[t]->yy * y;
        if (row < y || (row == y && envmapi_turned(dst, kept[t], x, y) < own)) return 0;
    }
    return 1;
}

/* The texels that some axes need, row by row; and the largest window. */
static void envmapi_near_needs(envmapi_window *w, envmapi_near *s, const envmapi_near_axes *axes) {
    envmapi_near_aim(w, s, axes);
    for (int part = 0; part < envmapi_window_parts(s->axis.level.mapping) && !s->all; ++part) {
        if (!envmapi_near_open(w, s, part, s->R_bright)) continue;
        envmapi_near_row *row = s->rows + w->face * (s->axis.level.edge + 2) + w->y + 1;
        for (int y = 0; y < w->height; ++y, ++row) {
            if (row->from == row->to)
                row->from = w->x, row->to = w->x + w->width, row->begin = s->first;
            row->end = s->first;
            if (w->x < row->from) row->from = w->x;
            if (w->x + w->width > row->to) row->to = w->x + w->width;
        }
        if ((size_t)w->width * (size_t)w->height > s->area)
            s->area = (size_t)w->width * (size_t)w->height;
    }
}

/* Squares of dst, and whether K is summed for a few of their axes only: where texels of both maps
   lie alike about each axis. */
static void envmapi_near_tiles(envmapi_near *s, const envmap *src, double tolerance) {
    int size = s->dst.size, kind = s->axis.lobe->kind;
    double at[4];
    s->tile = s->all ? ENVMAPI_NEAR_AXES : ENVMAPI_NEAR_TILE, s->ratio = 0;
    s->round = s->all ? 16 : 64;
    if (s->dst.mapping != ENVMAP_CUBE || src->mapping != ENVMAP_CUBE || size < 128 ||
        src->size % size || kind >= ENVMAP_LOBE_FUNCTION || tolerance < 1e-4)
        return;
    s->ratio = src->size / size;
    int tiles = tolerance < 5e-4 ? 16 : 12; /* 12: off by up to 4 tolerances of 1e-3 */
    if ((size + tiles - 1) / tiles < s->tile) s->tile = (size + tiles - 1) / tiles;
    for (int i = 0; i < 4; ++i) { /* Chebyshev's nodes */
        double sine = sin((2 * i + 1) * ENVMAPI_PI / 16);
        at[i] = s->knot[i] = (int)((s->tile - 1) * sine * sine + 0.5);
    }
    for (int t = 0; t < s->tile; ++t) envmapi_near_weights(s->between[t], at, 3, t);
}

/* Which lobes K of a lat-long's cells is summed for: none where k may be negative or has kinks
   anywhere; a sharp GGX in two, as fewer knots serve beyond its core. */
static envmap_result envmapi_near_parts(envmapi_near *s, double tolerance, envmapi_pool *pool) {
    double high = ENVMAPI_PI / s->axis.level.edge;
    s->part_count = 0, s->core = s->beyond = 0, s->cell = s->own = 0;
    s->cell_piece = ENVMAPI_CELL_PIECE * pow(tolerance * 1e3, 0.25) * s->sigma / high;
    if (s->all || s->axis.level.mapping != ENVMAP_LATLONG ||
        s->axis.lobe->kind >= ENVMAP_LOBE_FUNCTION || tolerance < 1e-4 ||
        !envmapi_lobe_nonnegative(s->axis.lobe, s->axis.p))
        return ENVMAP_OK;
    s->parts = (envmapi_near *)envmapi_pool_get(pool, 2, sizeof *s->parts);
    if (!s->parts) return ENVMAP_ERROR_MEMORY;
    s->parts[0] = s->parts[1] = *s;
    s->part_count = s->tail && s->cell_piece < 0.5 ? 2 : 1;
    if (s->part_count == 1) return ENVMAP_OK;
    s->parts[0].core = s->parts[0].R_bright = s->parts[1].beyond = ENVMAPI_CELL_CORE * high;
    s->parts[1].cell_piece = 0.5;
    return ENVMAP_OK;
}

/* The axes of a tile that are summed, side by side as far as they see the same. */
static void envmapi_near_line(envmapi_window *w, envmapi_near *s, envmapi_near_tile *tile,
                              int *count, int most) {
    const envmapi_place *kept[48];
    int width = envmapi_width(s->dst.mapping, s->dst.size);
    int keeps = envmapi_near_keep(kept, s, tile->face);
    int end = keeps ? tile->x + s->tile < width ? tile->x + s->tile : width : 0;
    tile->first = *count;
    for (int y = tile->y; y < tile->y + s->tile && y < s->dst.size; ++y)
        for (int x = tile->x; x < end; ++x) {
            envmapi_near_axes *axes = s->axes + *count;
            int n = 0;
            for (; n < most && x < end && envmapi_near_first(&s->dst, kept, keeps, x, y); ++n, ++x)
                axes[n].face = tile->face, axes[n].x = x, axes[n].y = y;
            axes->count = n, *count += n;
            if (n) envmapi_near_needs(w, s, axes), --x;
        }
    tile->count = *count - tile->first;
}

/* The axes of a lat-long by latitude and longitude: tiles of those between two rows of texels. */
static envmap_result envmapi_near_cells(envmapi_window *w, envmapi_near *s, size_t room,
                                        envmapi_pool *pool) {
    const envmap *dst = &s->dst;
    const envmapi_level *level = &s->axis.level;
    int width = envmapi_width(dst->mapping, dst->size), bins = level->width / 4 + 1, count = 0;
    int blocks = pool->count;
    envmapi_near_axes *found = (envmapi_near_axes *)envmapi_pool_get(pool, room, sizeof *found);
    int *first = (int *)envmapi_pool_get(pool, (size_t)(bins * (level->edge + 1)), sizeof *first);
    if (!found || !first) return ENVMAP_ERROR_MEMORY;
    memset(first, -1, (size_t)(bins * (level->edge + 1)) * sizeof *first);
    for (int i = 0; i < envmap_faces(dst->mapping) * dst->size; ++i) {
        const envmapi_place *kept[48];
        int keeps = envmapi_near_keep(kept, s, i / dst->size);
        for (int x = 0; x < width && keeps; ++x) {
            envmapi_near_axes axis = {i / dst->size, x, i % dst->size, 0};
            if (!envmapi_near_first(dst, kept, keeps, x, axis.y)) continue;
            double a[3], uv[2];
            envmapi_texel_direction(a, dst->mapping, axis.face, dst->size, x, axis.y);
            envmapi_project(uv, ENVMAP_LATLONG, 0, a);
            int *bin = first + (int)(uv[1] * level->edge + 0.5) * bins + (int)(uv[0] * (bins - 1));
            axis.count = *bin, found[count] = axis, *bin = count++; /* count: the next in a bin */
        }
    }
    count = 0;
    for (int row = 0; row <= level->edge; ++row) {
        envmapi_near_tile *tile = s->tiles + s->tile_count;
        envmapi_near_axes *axes = NULL;
        int from = 0;
        tile->face = tile->x = 0, tile->y = row - 1, tile->first = count;
        for (int bin = 0; bin < bins; ++bin)
            for (int i = first[row * bins + bin]; i >= 0; i = found[i].count) {
                if (!axes || axes->count == ENVMAPI_NEAR_AXES || bin > from + 2)
                    axes = s->axes + count, axes->count = 0, from = bin;
                int n = axes->count;
                s->axes[count] = found[i], s->axes[count++].count = 1, axes->count = n + 1;
            }
        tile->count = count - tile->first, s->tile_count += tile->count > 0;
    }
    for (int n = s->first = 0; n < count; n += s->axes[n].count) {
        while (n >= s->tiles[s->first].first + s->tiles[s->first].count) ++s->first;
        envmapi_near_needs(w, s, s->axes + n);
    }
    for (int i = 0; i < s->tile_count * s->part_count; ++i) {
        envmapi_near *part = s->parts + i % s->part_count;
        size_t cell = envmapi_near_cell_of(w->cells, part, s->tiles + i / s->part_count);
        size_t own = (size_t)(w->cells->knots.height * w->cells->knots.width);
        if (cell > part->cell) part->cell = cell;
        if (cell && own > s->own) s->own = own;
    }
    envmapi_pool_free(pool, blocks);
    return ENVMAP_OK;
}

/* The rows that the tiles from `first` on need have blocks, in memory that all tiles have in turn;
   returns how many blocks. */
static size_t envmapi_near_round(envmapi_near *s, int first) {
    int rows = envmap_faces(s->axis.level.mapping) * (s->axis.level.edge + 2);
    size_t count = 0;
    s->first = first;
    for (envmapi_near_row *row = s->rows; row < s->rows + rows; ++row) {
        row->here = !s->cells || (row->begin < first + s->round && row->end >= first);
        row->first = count, count += row->here ? (size_t)(row->to - row->from) : 0;
    }
    return count;
}

/* Which axes are summed, and what they need. */
static envmap_result envmapi_near_plan(envmapi_near *s, envmapi_pool *pool) {
    const envmap *dst = &s->dst;
    int width = envmapi_width(dst->mapping, dst->size), faces = envmap_faces(dst->mapping);
    int most = (int)envmapi_clamp(4 + 2 * s->R / envmapi_texel_extent(dst), 1, ENVMAPI_NEAR_AXES);
    if (s->all) most = ENVMAPI_NEAR_AXES;
    int rows = envmap_faces(s->axis.level.mapping) * (s->axis.level.edge + 2), count = 0;
    int across = width / s->tile + 1, down = dst->size / s->tile + 1;
    /* texels over turns, and those on mirrors */
    size_t room = (size_t)(faces * dst->size) * (size_t)(width / s->turn_count + 1) +
                  (size_t)(8 * faces * width);
    s->axes = (envmapi_near_axes *)envmapi_pool_get(pool, room, sizeof(envmapi_near_axes));
    s->rows = (envmapi_near_row *)envmapi_pool_get(pool, (size_t)rows, sizeof *s->rows);
    s->tiles = (envmapi_near_tile *)envmapi_pool_get(
        pool, (size_t)(faces * across * down + s->axis.level.edge + 1), sizeof *s->tiles);
    envmapi_window *w = (envmapi_window *)envmapi_pool_get(pool, 1, sizeof *w);
    if (!s->axes || !s->rows || !s->tiles || !w) return ENVMAP_ERROR_MEMORY;
    w->knot = 0;
    memset(s->rows, 0, (size_t)rows * sizeof *s->rows);
    for (int i = 0; i < rows && s->all; ++i)
        if ((i + 1) % (s->axis.level.edge + 2) > 1) s->rows[i].to = s->axis.level.width;
    s->tile_count = 0, s->count = 0, s->area = s->all;
    int cells = s->axis.level.mapping == ENVMAP_LATLONG && !s->all;
    /* Half of the blocks' memory, 1.02 x the time. Without a tail blocks are half of all memory,
       which glibc's malloc then keeps for the next call. */
    s->cells = cells && s->tail;
    if (s->cells) s->round = 32;
    if (cells && envmapi_near_cells(w, s, room, pool)) return ENVMAP_ERROR_MEMORY;
    for (int i = 0; i < faces * across * down && !cells; ++i) {
        envmapi_near_tile *tile = s->tiles + s->tile_count;
        tile->face = i / (across * down), tile->x = i % across * s->tile;
        tile->y = i / across % down * s->tile;
        envmapi_near_line(w, s, tile, &count, most), s->tile_count += tile->count > 0;
    }
    for (int first = 0; first < s->tile_count; first += s->round) {
        size_t blocks = envmapi_near_round(s, first);
        s->count = blocks > s->count ? blocks : s->count;
    }
    size_t groups = (size_t)envmapi_near_groups(s);
    s->blocks = (float *)envmapi_pool_get(pool, s->count * groups, 64);
    return s->blocks ? ENVMAP_OK : ENVMAP_ERROR_MEMORY;
}

/* The brightest and the darkest texel of a slice, by their largest channels, and the mean. Returns
   a power of two that one of 64 runs of texels exceeds. */
static double envmapi_near_contrast(double look[3], const float *t, size_t count) {
    double sum = 0;
    float high = 0, low = 3e38f;
    int runs[ENVMAPI_OCTAVES] = {0};
    size_t above = 0;
    for (size_t i = 0; i < count;) {
        size_t end = i + 3 * ENVMAPI_RUN < count ? i + 3 * ENVMAPI_RUN : count;
        float most = 0;
        int octave;
        for (; i < end; i += 3) {
            float one = t[i] > t[i + 1] ? t[i] : t[i + 1];
            one = one > t[i + 2] ? one : t[i + 2];
            most = one > most ? one : most, low = one < low ? one : low, sum += (double)one;
        }
        high = most > high ? most : high;
        frexp((double)most, &octave);
        ++runs[octave + ENVMAPI_OCTAVES / 2];
    }
    look[0] = (double)high, look[1] = (double)low, look[2] = 3 * sum / (double)count;
    int octave = ENVMAPI_OCTAVES;
    while (octave > 0 && (above += (size_t)runs[octave - 1]) * 192 * ENVMAPI_RUN <= count) --octave;
    return fmin(ldexp(1, octave - ENVMAPI_OCTAVES / 2), (double)high);
}

/* The least angle beyond which the lobe sends no more than a fifth of the tolerance, and two fifths
   of what a texel may be off by from the brightest texel (or from all) into the darkest; pi where k
   is not finite. */
static double envmapi_near_radius(const envmapi_near *s, const double look[3], double tolerance) {
    const envmapi_axis *axis = &s->axis;
    double most = look[0], least = look[1], mean = look[2];
    double all = 0, theta, weight, reached = 0;
    int enough = 0;
    double dark = 8 * tolerance * fmax(least, 1e-3 * mean), part = tolerance / 5;
    for (int pass = 0; pass < 2; ++pass) {
        envmapi_quadrature q =
            envmapi_quadrature_of(axis->lobe, axis->p, 0, ENVMAPI_PI, s->sigma / 2);
        double left = all;
        while (envmapi_quadrature_next(&q, &theta, &weight)) {
            double k = fabs(envmapi_k(axis->lobe, cos(theta), axis->p));
            double one = 2 * ENVMAPI_PI * sin(theta) * weight * k;
            if (!pass) all += one;
            left -= one;
            if (enough && theta > reached) return theta;
            if (pass && !enough) reached = fmax(reached, theta); /* not in order, in a piece */
            if (pass && left <= part * all &&
                (left * most <= dark * all || 4 * ENVMAPI_PI * k * mean <= dark * all))
                enough = 1;
        }
        if (!envmapi_finite(all)) return ENVMAPI_PI;
        if (enough) return axis->to;
    }
    return ENVMAPI_PI;
}

/* k of the lobe by octaves of 1 + sin^2 / sigma^2, to a node beyond R. */
static envmap_result envmapi_near_table(envmapi_near *s, double tolerance, envmapi_pool *pool) {
    const envmapi_axis *axis = &s->axis;
    /* a function may have a tip at its axis, on which a texel's centre may lie */
    double fine = axis->lobe->kind == ENVMAP_LOBE_FUNCTION ? s->sigma / 32 : s->sigma;
    s->inverse = (float)(1 / (fine * fine));
    double limit = pow(sin(s->R_bright), 2);
    int bits = tolerance < 1e-5 ? 12 : tolerance < 2e-4 ? 10 : 7; /* 6e-8, 1e-6, 1e-4 are lost */
    int count = 3 + (int)((1 << bits) * (1 + log2(1 + limit * (double)s->inverse)));
    s->shift = 23 - bits, s->fraction = 1.0f / (float)(1 << s->shift);
    s->table = (float *)envmapi_pool_get(pool, (size_t)count, sizeof(float));
    if (!s->table) return ENVMAP_ERROR_MEMORY;
    s->scale = fabs(envmapi_lobe_integral(axis->lobe, axis->p));
    if (!(s->scale > 0)) s->scale = 1;
    for (int i = 0; i < count; ++i) {
        uint32_t place = (uint32_t)((127 << bits) + i) << s->shift;
        float y;
        memcpy(&y, &place, sizeof y);
        double x = sqrt(fmax(1 - (double)(y - 1) / (double)s->inverse, 0));
        double k = envmapi_k(axis->lobe, x, axis->p);
        if (s->tail) k *= 1 - envmapi_smooth_step(envmapi_acos(x), s->R / 2, s->R);
        if (s->core > 0) k *= 1 - envmapi_smooth_step(envmapi_acos(x), s->core / 2, s->core);
        if (s->beyond > 0) k *= envmapi_smooth_step(envmapi_acos(x), s->beyond / 2, s->beyond);
        s->table[i] = (float)(k / s->scale);
    }
    return ENVMAP_OK;
}

/* What an axis needs to be near: few texels within R, and few nodes. */
static int envmapi_near_serves(const envmapi_near *s) {
    double texels = s->R_bright / s->axis.texel;
    int grows = s->axis.lobe->kind == ENVMAP_LOBE_GGX;
    if (s->axis.lobe->kind == ENVMAP_LOBE_BANKS) return 0; /* a ring's edges are off the lines */
    return s->R_bright < 1.5 &&
           (s->tail ||
            (texels < 64 && (grows || s->R_bright < fmin(60, 250 * s->piece) * s->sigma)));
}

/* The texels of a source, or 0 where their images are too many to weigh all for an axis. */
static size_t envmapi_near_few(const envmap *src, int turns) {
    size_t texels = envmapi_area(src->mapping, src->size) * (size_t)envmap_faces(src->mapping);
    return texels * (size_t)turns <= ENVMAPI_FEW ? texels : 0;
}

/* How far axes see, how fine nodes are, and whether all texels are weighed for each. Returns 0
   where a lobe reaches too far in a source of many texels, or `declines` and points are quicker. */
static int envmapi_near_suits(envmapi_near *s, const envmap *src, int declines, double tolerance) {
    const envmapi_level *level = &s->axis.level;
    double look[3];
    s->bright = envmapi_near_contrast(look, level->texels, envmapi_slice_floats(src, 0));
    frexp(look[0], &s->exponent);
    if (s->exponent > -60 && s->exponent < 60) s->exponent = 0;
    s->sigma = envmap_lobe_sigma(s->axis.lobe, s->axis.p);
    s->R = s->R_bright = s->tail ? s->tail->reach : envmapi_near_radius(s, look, tolerance);
    s->lit_count = 0;
    if (level->mapping == ENVMAP_PARABOLOID && s->axis.lobe->kind == ENVMAP_LOBE_GGX)
        envmapi_near_light(s, 8 * look[2]);
    look[0] = s->bright;
    if (!s->tail) s->R = envmapi_near_radius(s, look, tolerance);
    s->piece = pow(tolerance * 1e3, 1.0 / 8);
    if (s->axis.lobe->kind >= ENVMAP_LOBE_FUNCTION) s->piece /= 2; /* may have kinks anywhere */
    /* and where they are known, what a piece across one misses falls as the square of its length */
    if (s->axis.lobe->kind == ENVMAP_LOBE_FUNCTION && s->axis.kink_count)
        s->piece *= fmin(pow(tolerance * 2e3, 0.4), 1);
    /* tent^2 / 12 is what a tent adds to k'': at 6 sigma of 2 texels a tenth of what is allowed */
    s->tent = s->axis.tent;
    if (s->axis.tent * s->axis.tent < 2.5 * tolerance && s->axis.texel < ENVMAPI_COARSE)
        s->axis.tent = 0; /* texels that are coarse lie across the horizon of x^N */
    int serves = envmapi_near_serves(s), tight = tolerance < 1e-4;
    /* speed only: about rims, folds and kinks windows of functions take longer than all texels */
    int slow = level->mapping == ENVMAP_OCTAHEDRAL;
    if (envmapi_axis_rim(&s->axis) > 0)
        slow = !(s->axis.bilinear > 0) || (tight && s->axis.kink_count);
    s->all = envmapi_near_few(src, serves || s->tail ? 48 : s->turn_count);
    /* speed only: all texels are as quick as windows and a tail, of a sphere map thrice as quick */
    int line = level->mapping == ENVMAP_CUBE || level->mapping == ENVMAP_LATLONG;
    int blunt = s->tail && !line && !(s->axis.bilinear > 0) &&
                s->axis.tent * s->axis.tent > 1000 * tolerance;
    if (serves && !blunt && !(slow && s->axis.lobe->kind >= ENVMAP_LOBE_FUNCTION) &&
        (s->axis.texel < ENVMAPI_COARSE ||
         (!tight && !envmapi_is_disc(src->mapping) && s->axis.lobe->kind < ENVMAP_LOBE_BANKS &&
          level->edge > 1))) /* else a row is its own neighbour, twice */
        s->all = 0;
    /* Functions and tables, and lobes of about a texel of an octahedral map, take more windows than
       points; thin lobes, whose bands are many, take fewer rings than points where texels are few.
       Speed only, as is to leave single texels to sums. */
    int many = envmapi_slice_floats(&s->dst, 0) > 768 * (size_t)s->turn_count &&
               s->axis.texel > ENVMAPI_COARSE / 2 && !s->axis.kink_count; /* axes */
    int costs = (!line || many) && s->axis.lobe->kind >= ENVMAP_LOBE_FUNCTION;
    int round = envmapi_axis_rim(&s->axis) > 0 && s->axis.lobe->kind == ENVMAP_LOBE_GGX;
    costs |= (level->mapping == ENVMAP_OCTAHEDRAL || round) && envmapi_near_few(src, 48) &&
             s->sigma > 0.7 * s->axis.texel;
    int few = s->all && s->axis.texel > ENVMAPI_COARSE && s->sigma < 0.03 &&
              s->axis.lobe->kind != ENVMAP_LOBE_GGX;
    if (declines && s->axis.tent > 0 && !few && (!serves || s->all || costs)) return 0;
    return serves || s->all;
}

/* Turns, where they take axes, and a lat-long's poles. */
static envmap_result envmapi_near_turn(envmapi_near *s, const envmap *src, envmapi_pool *pool) {
    const envmapi_level *level = &s->axis.level;
    s->turns = (envmapi_turn *)envmapi_pool_get(pool, 49, sizeof(envmapi_turn));
    s->images = (envmapi_images(*)[6])envmapi_pool_get(pool, 3, sizeof *s->images);
    if (!s->turns || !s->images) return ENVMAP_ERROR_MEMORY;
    s->turn_count = envmapi_turns(s->turns, &s->dst, src);
    for (int t = 0; t < s->turn_count; t += 16)
        envmapi_images_of(s->images[t / 16], &s->dst, s->turns + t, s->turn_count - t, 1);
    memset(s->poles, 0, sizeof s->poles);
    for (int i = 0; i < 2 * level->width && src->mapping == ENVMAP_LATLONG; ++i)
        envmapi_add_tap(s->poles[i % 2], level, 0, i / 2, i % 2 * (level->edge - 1),
                        1.0 / level->width);
    return ENVMAP_OK;
}

/* Looks at a slice of src, or its only one, and gets all memory that its sums take. *served: 0
   where another way is taken. */
static envmap_result envmapi_near_slice(envmapi_near *s, const envmap *src, int *served,
                                        int declines, const envmap_filter_desc *desc,
                                        envmapi_pool *pool) {
    const envmapi_level *level = &s->axis.level;
    double tolerance = (double)desc->tolerance;
    envmap_result result = ENVMAP_OK;
    if (envmapi_near_turn(s, src, pool)) return ENVMAP_ERROR_MEMORY;
    *served = envmapi_near_suits(s, src, declines, tolerance);
    if (!*served) return ENVMAP_OK;
    /* two have the second moment of four, and lose tent^4, across a kink tent^2; not across an
       octahedral fold, nor a jump */
    int kinked = s->axis.kink_count > 0;
    if (s->all && pow(s->tent, kinked ? 2 : 4) < tolerance &&
        src->mapping != ENVMAP_OCTAHEDRAL && !envmapi_lobe_root(s->axis.lobe))
        s->axis.places = 2;
    if (s->all) s->tail = NULL;
    if (!s->in.omega &&
        envmapi_input_create(&s->in, src, src->slices > 1 ? s->slice : 0, 0, &desc->work, pool))
        return ENVMAP_ERROR_MEMORY;
    s->room = 6 * (size_t)level->width + (size_t)(1024 / fmin(s->piece, 1));
    envmapi_near_tiles(s, src, tolerance);
    if (!result) result = envmapi_near_parts(s, tolerance, pool);
    if (!result) result = envmapi_near_plan(s, pool);
    if (!result) result = envmapi_near_table(s, tolerance, pool);
    s->axis.least = s->all ? 6e-4 * tolerance * s->scale : 0; /* what _radius lets a dark texel */
    for (int i = 0; i < s->part_count && !result; ++i)
        result = envmapi_near_table(s->parts + i, tolerance, pool);
    s->tasks = envmapi_tasks(&desc->work);
    s->bytes = sizeof(envmapi_window) + s->room * (2 * sizeof(envmapi_knot) + 4 * sizeof(float));
    s->bytes += s->all * sizeof(double);
    size_t kernels = s->area * (size_t)(ENVMAPI_NEAR_AXES + (s->ratio ? 64 : 0)) + 2 * s->room;
    if (s->ratio) s->own = s->area;
    for (int i = 0; i < s->part_count; ++i) kernels += s->parts[i].cell;
    kernels += s->own;
    s->bytes = (s->bytes + kernels * sizeof(float) + 127) / 64 * 64;
    s->work = (char *)envmapi_pool_get(pool, s->bytes * (size_t)s->tasks, 1);
    return result || !s->work ? ENVMAP_ERROR_MEMORY : ENVMAP_OK;
}

/* That slice into a slice of dst. */
static envmap_result envmapi_near_sum(envmapi_near *s, const envmap_work *work) {
    int rows = envmap_faces(s->in.map->mapping) * (s->in.map->size + 2);
    for (int first = 0; first < s->tile_count; first += s->round) {
        if (envmapi_tell(&work->progress, (double)first / s->tile_count)) return ENVMAP_CANCELLED;
        envmapi_near_round(s, first);
        for (int fills = !first || s->cells; fills >= 0; --fills)
            envmapi_run_all(work, fills ? envmapi_task_near_blocks : envmapi_task_near, s,
                            fills ? rows : s->tasks);
    }
    return ENVMAP_OK;
}

/* All that sums of one slice need, before its tail is in dst: then they cannot fail. NULL where
   others serve. For sources whose texels need not be listed (envmapi_source). */
static envmap_result envmapi_near_reserve(envmapi_near **out, const envmap *dst,
                                          const envmapi_input *in, const envmapi_tail *tail,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    const envmap *src = in->map;
    int kept = pool->count, served;
    envmapi_near *s = (envmapi_near *)envmapi_pool_get(pool, 1, sizeof *s);
    *out = NULL;
    if (!s) return ENVMAP_ERROR_MEMORY;
    memset(s, 0, sizeof *s), s->dst = *dst, s->axis.lobe = tail->whole, s->tail = tail, s->in = *in;
    s->norm = envmapi_lobe_norm(tail->whole);
    envmapi_axis_aim(&s->axis, src, 0, 1, (double)desc->tolerance);
    envmap_result result = envmapi_near_slice(s, src, &served, 0, desc, pool);
    if (!result && served) *out = s;
    else envmapi_pool_free(pool, kept);
    return result;
}

/* Slices from `first` on; adds to a lobe's tail, where there is one. Where a lobe without reaches
   too far in a source of many texels, the reference for all. */
static envmap_result envmapi_filter_near(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                         const envmapi_tail *tail, int first, int slices,
                                         int *declines, const envmap_filter_desc *desc,
                                         envmapi_pool *pool) {
    envmapi_near *s = (envmapi_near *)envmapi_pool_get(pool, 1, sizeof *s);
    envmapi_source source;
    int alike = src->slices == 1 && lobe->p0 == lobe->p1, runs = alike ? 1 : slices;
    int kept = pool->count, served = 1;
    envmap_result result = ENVMAP_OK;
    if (!s) return ENVMAP_ERROR_MEMORY;
    memset(s, 0, sizeof *s), memset(&source, 0, sizeof source);
    s->dst = *dst, s->axis.lobe = lobe, s->norm = envmapi_lobe_norm(lobe), s->tail = tail;
    for (int run = 0; run < runs && !result && served; ++run) {
        envmapi_part part;
        envmap_filter_desc one = *desc;
        one.work = envmapi_work_part(&part, &desc->work, run, 1, runs), s->slice = first + run;
        envmapi_axis_aim(&s->axis, src, s->slice, dst->slices, (double)desc->tolerance);
        s->axis.source = &source, s->in.omega = NULL;
        result = envmapi_near_slice(s, src, &served, declines != NULL, &one, pool);
        int listed = s->all || src->mapping == ENVMAP_SPHERE || src->mapping == ENVMAP_ANGULAR ||
                     (src->mapping == ENVMAP_OCTAHEDRAL && s->piece < 1); /* folds */
        if (!result && served && listed && (!source.block || src->slices > 1)) {
            envmapi_source_free(&source, desc->work.memory);
            result = envmapi_source_create(&source, src, src->slices > 1 ? s->slice : 0,
                                           desc->work.memory);
        }
        if (!result && served && listed && s->axis.bilinear < 1)
            result = envmapi_source_spread(&source, s->tent, s->axis.places,
                                           desc->work.memory);
        if (!result && served) result = envmapi_near_sum(s, &one.work);
        envmapi_pool_free(pool, kept);
    }
    envmapi_source_free(&source, desc->work.memory);
    if (declines) *declines = !served;
    if (!served && declines) return result;
    if (!served && !result) return envmapi_filter_reference(dst, src, lobe, 0, desc);
    if (!result && alike) envmapi_copy_slices(dst, first, slices);
    return result;
}

/* ----------------------------------------------------------------------------------- >>cells --
   A thin ring against the bilinear radiance of any map, as >>reference defines it, for >>banks.
     in     a source, cells of it, an axis' ring       out    what it counts of their corners' L
   A cell is what lies between the centres of four texels, or between these and a map's edge: there
   L is bilinear in (u,v). Cells are halved until they are as narrow as the ring. Four lines go
   across a cell, along u or along v, whichever is more across the ring. On a line L is linear, the
   density too, and t nearly, of which k is a function (see >>banks); so the integral between the
   places where k begins and ends is Gauss's, to rounding:
       parts of k that go to the nodes before and behind           _between, _weigh_cells
       t of 16 directions, and what it bends by                    _across, _bend
       lines of a cell, to a disc's rim                            _line, _cells_of, _within
       which cells are too large                                   _large
   Called by banks.  Source: ours.  Tests: tests/test_banks.c. */

#define ENVMAPI_BANKS_NODES 17 /* of a tile of cells, along u and v */
/* Tuned, in w: how wide a cell may be; how far its middle may be from a straight line's (without it
   a_lit_texel_counts_its_bilinear_radiance fails beside a fold); the width of a tile below which
   there is no more halving. */
#define ENVMAPI_BANKS_WIDE  2
#define ENVMAPI_BANKS_BEND  0.005
#define ENVMAPI_BANKS_LEAST 0.5

/* 4 x 4 cells by 16 lines along u (0), and by as many along v, four a cell: lane l has the cell
   l % 4. Places are in texels; ends of what lies in a cell are `at` j and j + 1. */
typedef struct envmapi_banks_cells {
    float d[2][5][3][16];          /* of ends, from the middle */
    float at[2][5][16];            /* their places */
    float light[2][5][16];         /* solid angle a texel of the line's length, there */
    float beside[2][16];           /* the line's place between nodes */
    float base[2][4], scale[2][4]; /* of cells: of nodes before them, 1 over their distance */
    float bends[2][6];             /* of steps before and behind three ends: half of t's bend */
    double centre[3], grows[2][3], reach;
    int node[2][4]; /* before each */
} envmapi_banks_cells;

/* What cells ask of a lobe and of its source. */
typedef struct envmapi_banks_cut {
    envmapi_level level;
    double width, fine, share, texel; /* w; what tighter tolerances take of it; of what is summed */
} envmapi_banks_cut;

/* Where a tile begins, in texels or cells, and how many it is wide. */
typedef struct envmapi_banks_spot {
    double x, y, side;
    int face;
} envmapi_banks_spot;

/* A slice's ring. */
typedef struct envmapi_banks_ring {
    double angle, cosine;
    float sine, inverse, square; /* of A; 1 / tan(w/2); tan^2(w/2) */
    double limits[17][2];        /* cosines beyond which it sees nothing of a block, or the tile */
} envmapi_banks_ring;

/* The square of the distance between directions; the angle that a square is of. */
static double envmapi_banks_square(const double a[3], const double b[3]) {
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static double envmapi_banks_angle(double square) { return 2 * asin(fmin(sqrt(square) / 2, 1)); }

/* Cells along u or v of a map n texels wide: from a map's edge to a texel's centre, to the next; of
   paraboloids, whose faces reach beyond, a texel more at each end. */
static int envmapi_banks_count(int mapping, int n) {
    return n + 1 + 2 * (mapping == ENVMAP_PARABOLOID);
}

/* Where node c is, which cell c begins with, in texels. Linear between nodes. */
static double envmapi_banks_place(int mapping, int n, double c) {
    double from = floor(c), one = from - 0.5, two = from + 0.5;
    if (mapping == ENVMAP_PARABOLOID) return c - 1.5;
    one = envmapi_clamp(one, 0, n), two = envmapi_clamp(two, 0, n);
    return one + (c - from) * (two - one);
}

/* Direction at place (x,y) of a face, in texels; solid angle a texel there. */
static double envmapi_banks_at(double d[3], const envmapi_level *level, int face, double x,
                               double y) {
    double u = x / level->width, v = y / level->edge;
    double w = envmapi_density(level->mapping, u, v) / level->width / level->edge;
    if (level->mapping == ENVMAP_PARABOLOID)
        w *= envmapi_paraboloid_share(hypot(2 * u - 1, 2 * v - 1), level->edge);
    envmapi_direction(d, level->mapping, face, u, v);
    return w;
}

/* What a line at the place `beside` has within a rim. Returns 0: nothing. */
static int envmapi_banks_within(double ends[2], const envmapi_level *level, double beside) {
    double n = level->edge, r = n / 2 - fabs(beside - n / 2);
    ends[0] = -1, ends[1] = level->width + level->edge;
    if (level->mapping != ENVMAP_SPHERE && level->mapping != ENVMAP_ANGULAR) return 1;
    r = r > 0 ? sqrt(r * (n - r)) : 0;
    ends[0] = n / 2 - r, ends[1] = n / 2 + r;
    return r > 0;
}

/* Half of the second derivative between four ends: the mean of two; or the smaller one, as a fold
   at an end has a large one. */
ENVMAPI_INLINE float envmapi_banks_bend(const float bends[4], const float *f, int stride) {
    float step = f[2 * stride] - f[stride];
    float one = bends[1] * step - bends[0] * (f[stride] - f[0]);
    float two = bends[3] * (f[3 * stride] - f[2 * stride]) - bends[2] * step;
    float less = fabsf(one) < fabsf(two) ? one : two, mean = (one + two) / 2;
    return fabsf(mean) > 3 * fabsf(less) ? less : mean;
}

/* A line of cells. Beyond a rim its ends are on it, where it has no length. */
static void envmapi_banks_line(envmapi_banks_cells *cells, const envmapi_banks_cut *h,
                               const envmapi_banks_spot *spot, const double from[2], int along,
                               int lane) {
    const envmapi_level *level = &h->level;
    int mapping = level->mapping, sizes[2] = {level->width, level->edge};
    float light[5];
    double side = spot->side / 16, ends[2], at[2], node, weight;
    double last = envmapi_banks_count(mapping, sizes[along]);
    double cell = from[!along] + side * (lane % 4);
    if (cell >= envmapi_banks_count(mapping, sizes[!along])) return;
    weight = envmapi_gauss_many(&node, lane / 4, 4) / 2 * h->share;
    at[!along] = envmapi_banks_place(mapping, sizes[!along], cell + side * (1 + node) / 2);
    weight *= side * (envmapi_banks_place(mapping, sizes[!along], floor(cell) + 1) -
                      envmapi_banks_place(mapping, sizes[!along], floor(cell)));
    if (!envmapi_banks_within(ends, level, at[!along])) return;
    cells->beside[along][lane] = (float)(cell - floor(cell) + side * (1 + node) / 2);
    for (int e = 0; e < 5; ++e) {
        double d[3], q = fmin(from[along] + e * side, last);
        at[along] = envmapi_banks_place(mapping, sizes[along], q);
        at[along] = envmapi_clamp(at[along], ends[0], ends[1]);
        light[e] = (float)(weight * envmapi_banks_at(d, level, spot->face, at[0], at[1]));
        cells->at[along][e][lane] =
            (float)(at[along] - floor(spot->x) * !along - floor(spot->y) * along);
        for (int c = 0; c < 3; ++c) cells->d[along][e][c][lane] = (float)(d[c] - cells->centre[c]);
        cells->reach = fmax(cells->reach, envmapi_banks_square(d, cells->centre));
    }
    for (int e = 0; e < 5; ++e) { /* as straight lines that have the mean of what bends */
        int i = e < 2 ? 0 : e < 4 ? e - 2 : 1, before = e > 0 ? e - 1 : 0;
        float bend = envmapi_banks_bend(cells->bends[along] + 2 * i, light + i, 1);
        float length = cells->at[along][before + 1][lane] - cells->at[along][before][lane];
        cells->light[along][e][lane] = fmaxf(light[e] - bend * length * length / 6, 0);
    }
}

/* 4 x 4 cells from `from` on. */
static void envmapi_banks_cells_of(envmapi_banks_cells *cells, const envmapi_banks_cut *h,
                                   const envmapi_banks_spot *spot, const double from[2]) {
    const envmapi_level *level = &h->level;
    int mapping = level->mapping, sizes[2] = {level->width, level->edge};
    double side = spot->side / 16, start[2] = {floor(spot->x), floor(spot->y)}, at[2], d[2][3];
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 4; ++j) {
            double node = floor(from[i] + j * side);
            double one = envmapi_banks_place(mapping, sizes[i], node);
            double two = envmapi_banks_place(mapping, sizes[i], node + 1);
            cells->node[i][j] = (int)(node - start[i]), cells->base[i][j] = (float)(one - start[i]);
            cells->scale[i][j] = two > one ? (float)(1 / (two - one)) : 0;
        }
        at[i] = envmapi_banks_place(mapping, sizes[i], from[i] + 2 * side);
        for (int e = 0; e < 3; ++e) {
            double p[3], most = envmapi_banks_count(mapping, sizes[i]);
            for (int k = 0; k < 3; ++k)
                p[k] = envmapi_banks_place(mapping, sizes[i], fmin(from[i] + (e + k) * side, most));
            double before = (p[1] - p[0]) * (p[2] - p[0]), behind = (p[2] - p[1]) * (p[2] - p[0]);
            cells->bends[i][2 * e] = before > 0 && behind > 0 ? (float)(1 / before) : 0;
            cells->bends[i][2 * e + 1] = before > 0 && behind > 0 ? (float)(1 / behind) : 0;
        }
    }
    envmapi_banks_at(cells->centre, level, spot->face, at[0], at[1]);
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            double place = at[i];
            at[i] = place + (j - 0.5) * side;
            envmapi_banks_at(d[j], level, spot->face, at[0], at[1]);
            at[i] = place;
        }
        for (int c = 0; c < 3; ++c) cells->grows[i][c] = d[1][c] - d[0][c];
        for (int lane = 0; lane < 16; ++lane) envmapi_banks_line(cells, h, spot, from, i, lane);
    }
    cells->reach = envmapi_banks_angle(cells->reach);
}

/* Are a tile's cells too large? Three of its lines are looked at along u and along v: cells are as
   wide as the ring, or t bends in them. */
static int envmapi_banks_large(const envmapi_banks_cut *h, const envmapi_banks_spot *spot) {
    const envmapi_level *level = &h->level;
    int sizes[2] = {level->width, level->edge};
    double start[2] = {spot->x, spot->y}, at[2], ends[2], d[3][3], w[3];
    for (int line = 0; line < 6; ++line) {
        int along = line % 2, n = sizes[along];
        double cell = start[!along] + (0.3 + 7.5 * (line / 2)) * spot->side / 16; /* no corner */
        at[!along] =
            envmapi_banks_place(level->mapping, sizes[!along],
                                fmin(cell, envmapi_banks_count(level->mapping, sizes[!along])));
        if (!envmapi_banks_within(ends, level, at[!along])) continue;
        for (int i = 0; i < 16; ++i) {
            double place[2], bend = 0;
            for (int k = 0; k < 2; ++k) {
                cell = fmin(start[along] + (i + k) * spot->side / 16,
                            envmapi_banks_count(level->mapping, n));
                place[k] = envmapi_banks_place(level->mapping, n, cell);
                place[k] = envmapi_clamp(place[k], ends[0], ends[1]);
            }
            for (int k = 0; k < 3; ++k) {
                at[along] = place[0] + k * (place[1] - place[0]) / 2;
                w[k] = envmapi_banks_at(d[k], level, spot->face, at[0], at[1]);
            }
            for (int c = 0; c < 3; ++c) bend += pow(d[1][c] - (d[0][c] + d[2][c]) / 2, 2);
            if (sqrt(envmapi_banks_square(d[0], d[2])) > ENVMAPI_BANKS_WIDE * h->fine * h->width ||
                sqrt(bend) > ENVMAPI_BANKS_BEND * h->fine * h->width ||
                fabs(w[1] - (w[0] + w[2]) / 2) > 0.004 * h->fine * pow(h->texel, 2))
                return 1;
        }
    }
    return 0;
}

/* t of 16 directions; and 1 / sin theta, cos theta. off: cos A - cos theta of their middle. */
ENVMAPI_INLINE void envmapi_banks_across(float t[16], float r[16], float x[16],
                                         const float d[3][16], const envmapi_banks_ring *ring,
                                         const float a[3], float off) {
    const float cosine = (float)ring->cosine;
    for (int l = 0; l < 16; ++l) {
        float beyond = off - (a[0] * d[0][l] + a[1] * d[1][l] + a[2] * d[2][l]), root;
        float from = cosine - beyond, square = 1 - from * from;
        square = square > 1e-12f ? square : 1e-12f;
        uint32_t bits; /* root = 1 / sin theta, as _inverse_root */
        memcpy(&bits, &square, sizeof bits);
        bits = 0x5F3759DF - (bits >> 1);
        memcpy(&root, &bits, sizeof root);
        for (int n = 0; n < 2; ++n) root *= 1.5f - 0.5f * square * root * root;
        t[l] = beyond / (square * root + ring->sine) * ring->inverse, r[l] = root, x[l] = from;
    }
}

/* What lies between the ends j and j + 1 of 16 lines: parts of k times light that go to the nodes
   before and behind. t is taken for a line that has its mean there, so k is a polynomial from where
   it begins to where it ends: three nodes of Gauss'. */
ENVMAPI_INLINE void envmapi_banks_between(float before[16], float behind[16],
                                          const envmapi_banks_cells *cells, int along, int j,
                                          const float t[5][16], float square) {
    const float g[3] = {-0.77459667f, 0, 0.77459667f};
    const float weight[3] = {5 / 9.0f, 8 / 9.0f, 5 / 9.0f};
    const float *at = cells->at[along][j], *to = cells->at[along][j + 1];
    const float *light = cells->light[along][j], *last = cells->light[along][j + 1];
    float base = cells->base[along][j], scale = cells->scale[along][j];
    int first = j < 2 ? 0 : 1;
    for (int l = 0; l < 16; ++l) {
        float bend = envmapi_banks_bend(cells->bends[along] + 2 * first, &t[first][l], 16);
        float rise = t[j + 1][l] - t[j][l], length = to[l] - at[l], sum = 0, moment = 0;
        float from = t[j][l] - bend * length * length / 6;
        rise += rise < 0 ? -1e-6f : 1e-6f;
        float low = (-1 - from) / rise, high = (1 - from) / rise, swap = low;
        low = low < high ? low : high, high = swap < high ? high : swap;
        low = low < 0 ? 0 : low > 1 ? 1 : low, high = high < 0 ? 0 : high > 1 ? 1 : high;
        float half = (high - low) / 2, middle = low + half;
        for (int i = 0; i < 3; ++i) {
            float x = middle + g[i] * half, u = from + rise * x, v;
            u *= u, v = square * u;
            u = weight[i] * (1 - u) * (1 - v * (1 - v)) * (light[l] + x * (last[l] - light[l]));
            sum += u, moment += u * x;
        }
        sum *= half * length, moment *= half * length * length * scale;
        moment += sum * (at[l] - base) * scale;
        before[l] = sum - moment, behind[l] = moment;
    }
}

/* Adds K of 4 x 4 cells to k of nodes; notes which ones, and how many are noted. */
static int envmapi_banks_weigh_cells(float *k, short *at, int count,
                                     const envmapi_banks_cells *cells,
                                     const envmapi_banks_ring *ring, const double axis[3],
                                     float off) {
    enum { ROW = ENVMAPI_BANKS_NODES };
    float t[5][16], r[16], x[16], part[4][16],
        a[3] = {(float)axis[0], (float)axis[1], (float)axis[2]};
    int along = fabs(envmapi_dot(axis, cells->grows[0])) < fabs(envmapi_dot(axis, cells->grows[1]));
    int next = along ? ROW : 1, other = along ? 1 : ROW;
    for (int e = 0; e < 5; ++e)
        envmapi_banks_across(t[e], r, x, (const float(*)[16])cells->d[along][e], ring, a, off);
    for (int j = 0; j < 4; ++j) {
        envmapi_banks_between(part[0], part[1], cells, along, j, (const float(*)[16])t,
                              ring->square);
        for (int l = 0; l < 16; ++l) {
            float beside = cells->beside[along][l];
            part[2][l] = part[0][l] * beside, part[3][l] = part[1][l] * beside;
            part[0][l] -= part[2][l], part[1][l] -= part[3][l];
        }
        for (int i = 0; i < 4; ++i)
            for (int l = 0; l < 8; ++l) part[i][l] += part[i][l + 8];
        for (int l = 0; l < 4; ++l) {
            int first = cells->node[along][j] * next + cells->node[!along][l] * other;
            for (int i = 0; i < 4; ++i) {
                int node = first + (i & 1) * next + (i >> 1) * other;
                float K = part[i][l] + part[i][l + 4];
                at[count] = (short)node, count += K > 0 && !(k[node] > 0), k[node] += K > 0 ? K : 0;
            }
        }
    }
    return count;
}

/* ----------------------------------------------------------------------------------- >>banks --
   Thin rings: the sum that >>reference defines, for Banks' lobes of s >= 0.98. Their rings see few
   texels, but of many parts of the source.
     in     a source, a lobe, slices of a result, a tolerance       out    these slices
       L(a) = sum_i L_i w_i sum_j q_j k(theta_j)    16 places j in the tent of texel i, weights q
   A ring at angle A from its axis has the half-width w = acos(s), and
       tan((theta - A)/2) = (cos A - cos theta) / (sin A + sin theta) = t tan(w/2)
       k = (cos(theta - A) - s) / (1-s) = (1 - t^2) / (1 + t^2 (1-s)/(1+s))
   A tile of 16 x 16 texels stays in a cache while all axes of all slices take it. Floats hold what
   is left of the middle of 4 x 4 texels, whose cosine is a double: so k keeps its digits beside the
   ring's edges. Over a tent t is a quadratic form in (u,v), from nine directions.
       nine directions of a texel; what a tile has for all turns   _lane, _light, _task_banks_tile
       which of a tile's texels a ring sees, k of these, and L_i   _ring_of, _weigh, _apply
       slices at p and -p see opposite rings                       _put
   Of maps with folds or a rim, texels' 16 places have directions of their own.
   Where the bilinear radiance counts (w < 2 texels), tiles have cells: >>cells.
       tiles, halved as long as their cells are too large          _split, _spots
   Below a tolerance of 1e-4, and where tiles are many, >>reference says what texels count:
       once for all images of that axis                            _task_banks_thin
   Called by sharp before >>near.  Source: ours.  Tests: tests/test_banks.c. */

#define ENVMAPI_BANKS_TILES 8  /* at a time; any number is right */
#define ENVMAPI_BANKS_ROUND 64 /* axes at a time, too */

/* 4 x 4 texels: their middle, and of each its own from there, what its direction grows by to the
   outermost places along u and v, and half of second derivatives: uu, uv (whole), vv. */
typedef struct envmapi_banks_block {
    float d[6][3][16], weight[16];
    double centre[3], reach; /* rad, to the farthest place; 0: no texels */
} envmapi_banks_block;

typedef struct envmapi_banks_tile {
    float rgb[ENVMAPI_NEAR_BLOCKS][ENVMAPI_BANKS_NODES * ENVMAPI_BANKS_NODES][16]; /* all turns' */
    union {
        envmapi_banks_block blocks[16]; /* texels as in these */
        envmapi_banks_cells cells[16];
    } of;
    double middle[3], radius;
} envmapi_banks_tile;

typedef struct envmapi_banks_axis {
    double a[3];
    envmapi_near_axes at;
} envmapi_banks_axis;

/* What is summed: texels' centres, their tents by parabolas, or by places where they may cross a
   fold; the bilinear radiance. */
typedef enum envmapi_banks_kind {
    ENVMAPI_BANKS_TEXELS,
    ENVMAPI_BANKS_TENTS,
    ENVMAPI_BANKS_PLACES,
    ENVMAPI_BANKS_CELLS
} envmapi_banks_kind;

typedef struct envmapi_banks {
    envmapi_near pair; /* the source, turns, and the slice of dst that is written */
    envmapi_banks_tile *tiles;
    envmapi_banks_spot *spots; /* of all tiles */
    envmapi_banks_axis *axes;
    float *sums;                                          /* [slice][axis][groups][16] */
    double *light;                                        /* weights of texels, of each task */
    int count, slice, slices, first, spot_count, tasks;   /* count: of axes */
    envmapi_banks_kind kind;
    int whole;                 /* _task_banks_thin has all */
    envmapi_banks_cut cut;     /* for cells; w, and the share of what is summed, for all */
} envmapi_banks;

/* Texel (x,y), lane `lane` of a block: a parabola through nine directions; of tents by places, one
   of the texel's. */
static void envmapi_banks_lane(envmapi_banks_block *block, const envmapi_banks *h, int face, int x,
                               int y, int lane) {
    const envmapi_level *level = &h->pair.axis.level;
    const double(*tent)[2] = envmapi_tent[3];
    int mapping = level->mapping, wide = level->width, high = level->edge;
    double at[2], p[9][3], d[6][3], w, step = h->pair.axis.tent * tent[3][0];
    if (x >= wide || y >= high) return;
    w = envmapi_texel_cell(at, mapping, high, x, y) * h->cut.share;
    if (!(w > 0)) return;
    if (h->kind == ENVMAPI_BANKS_PLACES) {
        at[0] += h->pair.axis.tent * tent[lane % 4][0] / wide;
        at[1] += h->pair.axis.tent * tent[lane / 4][0] / high;
        w *= tent[lane % 4][1] * tent[lane / 4][1], step = 0;
    }
    block->weight[lane] = (float)w;
    for (int i = 0; i < 9; ++i)
        envmapi_direction(p[i], mapping, face, at[0] + (i % 3 - 1) * step / wide,
                          at[1] + (i / 3 - 1) * step / high);
    for (int c = 0; c < 3; ++c) {
        d[0][c] = p[4][c] - block->centre[c];
        d[1][c] = (p[5][c] - p[3][c]) / 2, d[2][c] = (p[7][c] - p[1][c]) / 2;
        d[3][c] = (p[5][c] + p[3][c]) / 2 - p[4][c], d[5][c] = (p[7][c] + p[1][c]) / 2 - p[4][c];
        d[4][c] = (p[8][c] - p[6][c] - p[2][c] + p[0][c]) / 4;
        for (int i = 0; i < 6; ++i) block->d[i][c][lane] = (float)d[i][c];
    }
    for (int i = 0; i < 9; ++i)
        block->reach = fmax(block->reach, envmapi_banks_square(p[i], block->centre));
}

/* The texel that a lane of block n has. */
static void envmapi_banks_texel(int at[2], const envmapi_banks *h, const envmapi_banks_spot *spot,
                                int n, int lane) {
    int per = h->kind == ENVMAPI_BANKS_PLACES ? 1 : 4;
    at[0] = (int)spot->x + n % 4 * per + lane % per;
    at[1] = (int)spot->y + n / 4 * per + lane / 4 % per;
}

/* L of a turn's texel, or of the node that lies there; beyond a map's edge that is on the edge. */
static void envmapi_banks_look(float rgb[3], const envmapi_banks *h, const envmapi_place *to,
                               const int at[2], int node) {
    const envmapi_level *level = &h->pair.axis.level;
    int mapping = level->mapping, exponent = h->pair.exponent;
    int edge = at[0] < 0 || at[1] < 0 || at[0] >= level->width || at[1] >= level->edge;
    double sum[3] = {0, 0, 0}, first = mapping == ENVMAP_PARABOLOID ? 2 : 1, x, y;
    if (!node || !(edge || mapping == ENVMAP_SPHERE || mapping == ENVMAP_ANGULAR)) {
        envmapi_near_texel(rgb, &h->pair, to->face, to->x0 + to->xx * at[0] + to->xy * at[1],
                           to->y0 + to->yx * at[0] + to->yy * at[1]);
        return;
    }
    x = envmapi_banks_place(mapping, level->width, at[0] + first) - 0.5;
    y = envmapi_banks_place(mapping, level->edge, at[1] + first) - 0.5;
    envmapi_add_bilinear(sum, level, to->face,
                         (to->x0 + to->xx * x + to->xy * y + 0.5) / level->width,
                         (to->y0 + to->yx * x + to->yy * y + 0.5) / level->edge, 1);
    for (int c = 0; c < 3; ++c) rgb[c] = (float)sum[c];
    if (exponent) envmapi_floats_scale(rgb, rgb, 3, -exponent);
}

/* L of all turns of a tile's texels or nodes. */
static void envmapi_banks_light(envmapi_banks_tile *tile, const envmapi_banks *h,
                                const envmapi_banks_spot *spot) {
    const envmapi_near *s = &h->pair;
    const envmapi_level *level = &s->axis.level;
    int cells = h->kind == ENVMAPI_BANKS_CELLS, nodes = cells ? (int)fmax(spot->side, 1) + 1 : 16;
    int first = level->mapping == ENVMAP_PARABOLOID ? 2 : 1; /* the node at texel 0 */
    for (int n = 0; n < nodes * nodes; ++n) {
        int lane = cells ? n % nodes + n / nodes * ENVMAPI_BANKS_NODES : n, at[2];
        at[0] = (int)spot->x + n % nodes - first, at[1] = (int)spot->y + n / nodes - first;
        if (!cells && !(tile->of.blocks[n / 16].weight[n % 16] > 0)) continue;
        if (!cells) envmapi_banks_texel(at, h, spot, n / 16, n % 16);
        if (at[0] > level->width + first - 1 || at[1] > level->edge + first - 1) continue;
        for (int t = 0; t < s->turn_count; ++t) {
            float rgb[3];
            envmapi_banks_look(rgb, h, s->turns[t].src + spot->face, at, cells);
            for (int c = 0; c < 3; ++c)
                tile->rgb[(3 * t + c) / 16][lane][(3 * t + c) % 16] = rgb[c];
        }
    }
}

static void envmapi_task_banks_tile(void *context, int task) {
    const envmapi_banks *h = (const envmapi_banks *)context;
    const envmapi_level *level = &h->pair.axis.level;
    envmapi_banks_tile *tile = h->tiles + task;
    const envmapi_banks_spot *spot = h->spots + h->first + task;
    int cells = h->kind == ENVMAPI_BANKS_CELLS, at[2];
    memset(tile, 0, sizeof *tile);
    if (h->first + task >= h->spot_count) return;
    double centre[16][3], reach[16];
    for (int n = 0; n < 16; ++n) {
        if (cells) {
            envmapi_banks_cells *block = tile->of.cells + n;
            double from[2] = {spot->x + n % 4 * spot->side / 4, spot->y + n / 4 * spot->side / 4};
            envmapi_banks_cells_of(block, &h->cut, spot, from);
            memcpy(centre[n], block->centre, sizeof centre[n]), reach[n] = block->reach;
        } else {
            envmapi_banks_block *block = tile->of.blocks + n;
            double middle = spot->side / 8, uv[2];
            uv[0] = fmin((spot->x + n % 4 * spot->side / 4 + middle) / level->width, 1);
            uv[1] = fmin((spot->y + n / 4 * spot->side / 4 + middle) / level->edge, 1);
            envmapi_banks_texel(at, h, spot, n, 0);
            if (h->kind == ENVMAPI_BANKS_PLACES)
                envmapi_texel_cell(uv, level->mapping, level->edge, at[0], at[1]);
            envmapi_direction(block->centre, level->mapping, spot->face, uv[0], uv[1]);
            for (int l = 0; l < 16; ++l) {
                envmapi_banks_texel(at, h, spot, n, l);
                envmapi_banks_lane(block, h, spot->face, at[0], at[1], l);
            }
            block->reach = envmapi_banks_angle(block->reach);
            if (h->kind == ENVMAPI_BANKS_PLACES) /* the definition's tents reach so far */
                block->reach = fmin(block->reach, 2 * h->pair.axis.texel);
            memcpy(centre[n], block->centre, sizeof centre[n]), reach[n] = block->reach;
        }
        for (int c = 0; c < 3; ++c) tile->middle[c] += reach[n] > 0 ? centre[n][c] : 0;
    }
    envmapi_unit(tile->middle, tile->middle);
    for (int n = 0; n < 16; ++n)
        if (reach[n] > 0)
            tile->radius =
                fmax(tile->radius,
                     reach[n] + envmapi_banks_angle(envmapi_banks_square(tile->middle, centre[n])));
    if (tile->radius > 0) envmapi_banks_light(tile, h, spot);
}

/* The tiles of a square, which is halved as long as cells are too large; notes them where there is
   room. */
static int envmapi_banks_split(envmapi_banks_spot *spots, const envmapi_banks *h,
                               envmapi_banks_spot spot) {
    const envmapi_level *level = &h->pair.axis.level;
    int count = 0;
    if (h->kind == ENVMAPI_BANKS_CELLS) {
        if (spot.x >= envmapi_banks_count(level->mapping, level->width) ||
            spot.y >= envmapi_banks_count(level->mapping, level->edge))
            return 0;
    } else if (spot.x >= level->width || spot.y >= level->edge) return 0;
    if (h->kind != ENVMAPI_BANKS_CELLS ||
        spot.side * h->cut.texel < ENVMAPI_BANKS_LEAST * h->cut.width ||
        !envmapi_banks_large(&h->cut, &spot)) {
        if (spots) *spots = spot;
        return 1;
    }
    spot.side /= 2;
    for (int i = 0; i < 4; ++i) {
        envmapi_banks_spot quarter = spot;
        quarter.x += i % 2 * spot.side, quarter.y += i / 2 * spot.side;
        count += envmapi_banks_split(spots ? spots + count : NULL, h, quarter);
    }
    return count;
}

/* All tiles of the source. */
static int envmapi_banks_spots(envmapi_banks_spot *spots, const envmapi_banks *h) {
    const envmapi_level *level = &h->pair.axis.level;
    int count = 0, side = h->kind == ENVMAPI_BANKS_PLACES ? 4 : 16;
    for (int face = 0; face < envmap_faces(level->mapping); ++face)
        for (int y = 0; y < envmapi_banks_count(level->mapping, level->edge); y += side)
            for (int x = 0; x < envmapi_banks_count(level->mapping, level->width); x += side) {
                envmapi_banks_spot spot = {(double)x, (double)y, (double)side, face};
                count += envmapi_banks_split(spots ? spots + count : NULL, h, spot);
            }
    return count;
}

/* t over a block's texels: of their middles, u, v, uu, uv, vv. */
ENVMAPI_INLINE void envmapi_banks_form(float t[6][16], const envmapi_banks_block *block,
                                       const envmapi_banks_ring *ring, const float a[3],
                                       float off) {
    float r[16], x[16];
    envmapi_banks_across(t[0], r, x, (const float(*)[16])block->d[0], ring, a, off);
    for (int l = 0; l < 16; ++l) {
        float g[6], bends = x[l] * r[l] * r[l]; /* theta bends by its slope, too */
        for (int i = 1; i < 6; ++i)
            g[i] = a[0] * block->d[i][0][l] + a[1] * block->d[i][1][l] + a[2] * block->d[i][2][l];
        float grows = -0.5f * ring->inverse * (1 + t[0][l] * t[0][l] * ring->square) * r[l];
        t[1][l] = grows * g[1], t[2][l] = grows * g[2];
        t[3][l] = grows * (g[3] + 0.5f * bends * g[1] * g[1]);
        t[4][l] = grows * (g[4] + bends * g[1] * g[2]);
        t[5][l] = grows * (g[5] + 0.5f * bends * g[2] * g[2]);
    }
}

/* K of a block's texels, or their tents. */
ENVMAPI_INLINE void envmapi_banks_weigh(float K[16], float t[6][16],
                                        const envmapi_banks_block *block, float square,
                                        int places) {
    const float inner = (float)(envmapi_tent[3][2][0] / envmapi_tent[3][3][0]);
    const float at[4] = {-1, -inner, inner, 1};
    const float weight[2] = {(float)envmapi_tent[3][0][1], (float)envmapi_tent[3][1][1]};
    for (int l = 0; l < 16; ++l) {
        float u = t[0][l] * t[0][l], k = 0;
        if (places)
            for (int j = 0; j < 4; ++j) {
                float base = t[0][l] + at[j] * (t[2][l] + at[j] * t[5][l]);
                float slope = t[1][l] + at[j] * t[4][l];
                for (int i = 0; i < 2; ++i) { /* at both ends */
                    float middle = base + at[i] * at[i] * t[3][l], step = at[i] * slope;
                    float one = middle - step, two = middle + step;
                    one = 1 - one * one, two = 1 - two * two;
                    one = one > 0 ? one : 0, two = two > 0 ? two : 0;
                    k += weight[i] * weight[j < 2 ? j : 3 - j] * (one + two);
                }
            }
        else k = u < 1 ? 1 - u : 0;
        u = square * (u < 1 ? u : 1);
        K[l] = block->weight[l] * k * (1 - u * (1 - u));
    }
}

/* sums += K times the images of a tile's texels or nodes. */
static void envmapi_banks_apply(float *sums, const envmapi_banks_tile *tile,
                                const envmapi_banks_ring *ring, const double axis[3],
                                envmapi_banks_kind kind, int groups) {
    int count = 0;
    short at[ENVMAPI_BANKS_NODES * ENVMAPI_BANKS_NODES + 16];
    float k[ENVMAPI_BANKS_NODES * ENVMAPI_BANKS_NODES], K[16], t[6][16];
    float a[3] = {(float)axis[0], (float)axis[1], (float)axis[2]};
    if (kind == ENVMAPI_BANKS_CELLS) memset(k, 0, sizeof k);
    for (int n = 0; n < 16; ++n) {
        int cells = kind == ENVMAPI_BANKS_CELLS;
        double x = envmapi_dot(axis, cells ? tile->of.cells[n].centre : tile->of.blocks[n].centre);
        if (!(x > ring->limits[n][0] && x < ring->limits[n][1])) continue;
        float off = (float)(ring->cosine - x);
        if (cells) {
            count = envmapi_banks_weigh_cells(k, at, count, tile->of.cells + n, ring, axis, off);
            continue;
        }
        const envmapi_banks_block *block = tile->of.blocks + n;
        envmapi_banks_form(t, block, ring, a, off);
        if (kind == ENVMAPI_BANKS_TENTS) envmapi_banks_weigh(K, t, block, ring->square, 1);
        else envmapi_banks_weigh(K, t, block, ring->square, 0);
        if (kind == ENVMAPI_BANKS_PLACES) { /* of one texel */
            for (int l = 8; l > 0; l /= 2)
                for (int i = 0; i < l; ++i) K[i] += K[i + l];
            at[count] = (short)(16 * n), k[16 * n] = K[0], count += K[0] > 0;
            continue;
        }
        for (int l = 0; l < 16; ++l)
            at[count] = (short)(16 * n + l), k[16 * n + l] = K[l], count += K[l] > 0;
    }
    for (int g = 0; g < groups && count; ++g) {
        envmapi_float16 sum;
        memset(&sum, 0, sizeof sum);
        for (int i = 0; i < count; ++i)
            envmapi_float16_add(&sum, k[at[i]], envmapi_float16_at(tile->rgb[g][at[i]]));
        envmapi_float16_add(envmapi_float16_at(sums + 16 * g), 1, &sum);
    }
}

/* A slice's ring before a tile. */
static envmapi_banks_ring envmapi_banks_ring_of(const envmapi_banks *h, int slice,
                                                const envmapi_banks_tile *tile) {
    double p = envmapi_slice_p(h->pair.axis.lobe, slice, h->pair.dst.slices);
    double half = tan(h->cut.width / 2);
    envmapi_banks_ring ring;
    ring.angle = envmapi_acos(-p), ring.cosine = cos(ring.angle);
    ring.sine = (float)sin(ring.angle);
    ring.inverse = (float)(1 / half), ring.square = (float)(half * half);
    for (int n = 0; n < 17; ++n) {
        double reach = n == 16                          ? tile->radius
                       : h->kind == ENVMAPI_BANKS_CELLS ? tile->of.cells[n].reach
                                                        : tile->of.blocks[n].reach;
        double room = h->cut.width + reach + 1e-6;
        ring.limits[n][0] = reach > 0 ? envmapi_cosine(ring.angle + room) : 2;
        ring.limits[n][1] = envmapi_cosine(ring.angle - room);
    }
    return ring;
}

/* A part of all axes of all slices, for the tiles at hand. */
static void envmapi_task_banks(void *context, int task) {
    const envmapi_banks *h = (const envmapi_banks *)context;
    int64_t count = (int64_t)h->slices * h->count, end = count * (task + 1) / h->tasks;
    int groups = envmapi_near_groups(&h->pair);
    for (const envmapi_banks_tile *tile = h->tiles; tile < h->tiles + ENVMAPI_BANKS_TILES; ++tile) {
        envmapi_banks_ring ring;
        int slice = -1;
        for (int64_t i = count * task / h->tasks; i < end && tile->radius > 0; ++i) {
            const double *a = h->axes[i % h->count].a;
            if (slice != (int)(i / h->count))
                slice = (int)(i / h->count),
                ring = envmapi_banks_ring_of(h, h->slice + slice, tile);
            double x = envmapi_dot(a, tile->middle);
            if (x > ring.limits[16][0] && x < ring.limits[16][1])
                envmapi_banks_apply(h->sums + (size_t)i * (size_t)(16 * groups), tile, &ring, a,
                                    h->kind, groups);
        }
    }
}

/* Some axes' integrals of the bilinear radiance, as >>reference has them: what texels count serves
   all turns. */
static void envmapi_task_banks_thin(void *context, int task) {
    const envmapi_banks *h = (const envmapi_banks *)context;
    const envmapi_near *s = &h->pair;
    envmapi_axis axis = s->axis;
    int width = axis.level.width, edge = axis.level.edge, groups = envmapi_near_groups(s);
    size_t n = (size_t)(envmap_faces(axis.level.mapping) * edge) * (size_t)width;
    axis.level.texels = NULL, axis.light = h->light + (size_t)task * n;
    memset(axis.light, 0, n * sizeof *axis.light);
    for (int i = h->first + task; i < h->first + ENVMAPI_BANKS_ROUND && i < h->slices * h->count;
         i += h->tasks) {
        double sum[16 * ENVMAPI_NEAR_BLOCKS] = {0};
        memcpy(axis.a, h->axes[i % h->count].a, sizeof axis.a);
        axis.p = envmapi_slice_p(axis.lobe, h->slice + i / h->count, s->dst.slices);
        envmap_lobe_support(&axis.from, &axis.to, axis.lobe, axis.p);
        axis.kink_count = envmapi_lobe_kinks(axis.kinks, axis.lobe, axis.p);
        axis.reach = axis.sight = axis.to;
        envmapi_axis_filter(&axis, NULL);
        for (size_t j = 0; j < n; ++j) {
            double k = axis.light[j] / s->scale;
            if (!(k > 0)) continue;
            int x = (int)(j % (size_t)width), row = (int)(j / (size_t)width), y = row % edge;
            axis.light[j] = 0;
            for (int t = 0; t < s->turn_count; ++t) {
                const envmapi_place *to = s->turns[t].src + row / edge;
                float rgb[3];
                envmapi_near_texel(rgb, s, to->face, to->x0 + to->xx * x + to->xy * y,
                                   to->y0 + to->yx * x + to->yy * y);
                for (int c = 0; c < 3; ++c) sum[3 * t + c] += k * (double)rgb[c];
            }
        }
        for (int k = 0; k < 3 * s->turn_count; ++k)
            h->sums[(size_t)i * (size_t)(16 * groups) + (size_t)k] += (float)sum[k];
    }
}

/* Sums to the images of all axes; with opposite texels also to those of the slice at -p. */
static void envmapi_banks_put(envmapi_banks *h, envmapi_window *w, const envmapi_place *opposite) {
    envmapi_near *s = &h->pair;
    size_t groups = (size_t)envmapi_near_groups(s), width = (size_t)s->dst.size;
    if (s->dst.mapping == ENVMAP_LATLONG) width *= 2;
    for (size_t i = 0; i < (size_t)h->slices * (size_t)h->count; ++i) {
        envmapi_near_axes at = h->axes[i % (size_t)h->count].at;
        for (size_t g = 0; g < groups; ++g)
            memcpy(w->sums[g], h->sums + 16 * (i * groups + g), 16 * sizeof(float));
        s->slice = h->slice + (int)(i / (size_t)h->count);
        envmapi_near_put(w, s, 0, &at, 0);
        int other = s->dst.slices - 1 - s->slice;
        if (!opposite || other == s->slice) continue;
        size_t texel = envmapi_turned(&s->dst, opposite + at.face, at.x, at.y);
        at.x = (int)(texel % width), texel /= width;
        at.face = (int)(texel / (size_t)s->dst.size), at.y = (int)(texel % (size_t)s->dst.size);
        s->slice = other;
        envmapi_near_put(w, s, 0, &at, 0);
    }
}

/* Whether all slices are thin rings about no axis, and so many axes that tiles pay. Of few texels
   >>near has all. */
static int envmapi_banks_suits(const envmapi_banks *h) {
    const envmapi_axis *axis = &h->pair.axis;
    double axes = (double)envmapi_slice_floats(&h->pair.dst, 0) / 3 * h->slices;
    int suits = axis->lobe->kind == ENVMAP_LOBE_BANKS && axis->lobe->parameter >= 0.98f &&
                axes * (axis->tent > 0 ? 8 : 0.5) > 1 / axis->texel;
    for (int k = h->slice; k < h->slice + h->slices && suits; ++k) {
        double angle = envmapi_acos(-envmapi_slice_p(axis->lobe, k, h->pair.dst.slices));
        suits = fmin(angle, ENVMAPI_PI - angle) > h->cut.width + fmin(4 * axis->texel, 0.03);
    }
    return suits;
}

/* Are axes as >>reference has them quicker than tiles of cells? Both in ms, measured on sources of
   1 to 64 texels an edge and rings of s = 0.98 to 0.999: speed only. */
static int envmapi_banks_whole(envmapi_banks *h) {
    const envmapi_axis *axis = &h->pair.axis;
    double axes = (double)h->count * h->slices, charts = envmapi_charts(axis->level.mapping);
    h->kind = ENVMAPI_BANKS_CELLS;
    double cells = envmapi_banks_spots(NULL, h) * (0.22 + axes * (0.001 + 0.036 * h->cut.width));
    return cells > axes * 0.1 * fmax(charts, 2) * (1 + 0.25 / axis->texel);
}

/* The axes that do the work of their images; sums of none; room for tiles. */
static envmap_result envmapi_banks_create(envmapi_banks *h, envmapi_pool *pool) {
    envmapi_near *pair = &h->pair;
    const envmap *dst = &pair->dst;
    const envmapi_place *kept[48];
    int width = envmapi_width(dst->mapping, dst->size),
        rows = envmap_faces(dst->mapping) * dst->size;
    h->axes = (envmapi_banks_axis *)envmapi_pool_get(pool, envmapi_slice_floats(dst, 0) / 3,
                                                     sizeof *h->axes);
    for (int i = 0; i < rows && h->axes; ++i) {
        int keeps = envmapi_near_keep(kept, pair, i / dst->size);
        for (int x = 0; x < width && keeps; ++x) {
            envmapi_near_axes at = {i / dst->size, x, i % dst->size, 1};
            if (!envmapi_near_first(dst, kept, keeps, x, at.y)) continue;
            envmapi_texel_direction(h->axes[h->count].a, dst->mapping, at.face, dst->size, x, at.y);
            h->axes[h->count++].at = at;
        }
    }
    h->whole |= pair->axis.bilinear > 0 && envmapi_banks_whole(h);
    size_t groups = (size_t)envmapi_near_groups(pair);
    size_t numbers = (size_t)h->slices * (size_t)h->count * 16 * groups;
    h->sums = (float *)envmapi_pool_get(pool, numbers, sizeof(float));
    h->tiles = (envmapi_banks_tile *)envmapi_pool_get(pool, ENVMAPI_BANKS_TILES, sizeof *h->tiles);
    if (h->whole)
        h->light = (double *)envmapi_pool_get(
            pool,
            (size_t)h->tasks *
                (size_t)(envmap_faces(pair->axis.level.mapping) * pair->axis.level.edge) *
                (size_t)pair->axis.level.width,
            sizeof *h->light);
    if (!h->axes || !h->sums || !h->tiles || (!h->light && h->whole)) return ENVMAP_ERROR_MEMORY;
    memset(h->sums, 0, numbers * sizeof(float));
    return ENVMAP_OK;
}

/* Tiles, some at a time, for all axes of all slices. */
static envmap_result envmapi_banks_tiles(envmapi_banks *h, envmapi_banks_kind kind, double share,
                                         const envmap_work *work, envmapi_pool *pool) {
    h->kind = kind, h->cut.share = share, h->spot_count = envmapi_banks_spots(NULL, h);
    h->spots =
        (envmapi_banks_spot *)envmapi_pool_get(pool, (size_t)h->spot_count, sizeof *h->spots);
    if (!h->spots) return ENVMAP_ERROR_MEMORY;
    envmapi_banks_spots(h->spots, h);
    for (h->first = 0; h->first < h->spot_count; h->first += ENVMAPI_BANKS_TILES) {
        if (envmapi_tell(&work->progress, (double)h->first / h->spot_count))
            return ENVMAP_CANCELLED;
        envmapi_run_all(work, envmapi_task_banks_tile, h, ENVMAPI_BANKS_TILES);
        envmapi_run_all(work, envmapi_task_banks, h, h->tasks);
    }
    return ENVMAP_OK;
}

/* Texels or tents, then the bilinear radiance; or axes as >>reference has them. */
static envmap_result envmapi_banks_run(envmapi_banks *h, const envmap_work *work,
                                       envmapi_pool *pool) {
    double bilinear = h->pair.axis.bilinear;
    int axes = h->slices * h->count, mapping = h->pair.axis.level.mapping;
    int folds = mapping == ENVMAP_OCTAHEDRAL || mapping == ENVMAP_SPHERE ||
                mapping == ENVMAP_ANGULAR; /* or has a rim where texels meet */
    envmapi_banks_kind kind = !(h->pair.axis.tent > 0) ? ENVMAPI_BANKS_TEXELS
                              : folds                  ? ENVMAPI_BANKS_PLACES
                                                       : ENVMAPI_BANKS_TENTS;
    envmapi_part part;
    envmap_work one = *work;
    envmap_result result = ENVMAP_OK;
    for (h->first = 0; h->whole && h->first < axes; h->first += ENVMAPI_BANKS_ROUND) {
        if (envmapi_tell(&work->progress, (double)h->first / axes)) return ENVMAP_CANCELLED;
        envmapi_run_all(work, envmapi_task_banks_thin, h, h->tasks);
    }
    if (h->whole) return ENVMAP_OK;
    if (bilinear > 0) one = envmapi_work_part(&part, work, 0, 1, 2);
    if (bilinear < 1) result = envmapi_banks_tiles(h, kind, 1 - bilinear, &one, pool);
    if (bilinear > 0 && bilinear < 1) one = envmapi_work_part(&part, work, 1, 1, 2);
    else one = *work;
    if (!result && bilinear > 0)
        result = envmapi_banks_tiles(h, ENVMAPI_BANKS_CELLS, bilinear, &one, pool);
    return result;
}

/* Slices from `first` on. *served: 0 where other ways serve. */
static envmap_result envmapi_filter_banks(envmap *dst, const envmap *src, int first, int slices,
                                          int *served, const envmap_lobe *lobe,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    envmapi_banks *h = (envmapi_banks *)envmapi_pool_get(pool, 1, sizeof *h);
    envmapi_window *w = (envmapi_window *)envmapi_pool_get(pool, 1, sizeof *w);
    envmapi_place opposite[6];
    envmapi_source source;
    int mirrored =
        first == 0 && slices == dst->slices && !(fabs((double)lobe->p0 + (double)lobe->p1) > 0);
    double look[3], s = (double)lobe->parameter, tolerance = (double)desc->tolerance;
    if (!h || !w) return ENVMAP_ERROR_MEMORY;
    memset(h, 0, sizeof *h), memset(w, 0, sizeof *w);
    envmapi_near *pair = &h->pair;
    pair->dst = *dst, pair->axis.lobe = lobe, pair->all = 1; /* texels as they are */
    pair->norm = envmapi_lobe_norm(lobe), pair->scale = 1 / (1 - s);
    envmapi_axis_aim(&pair->axis, src, first, dst->slices, tolerance);
    h->slice = first, h->slices = slices, h->cut.width = acos(s);
    h->cut.fine = fmin(pow(tolerance * 1e3, 0.3), 1);
    h->cut.level = pair->axis.level, h->cut.texel = pair->axis.texel;
    h->tasks = (envmapi_tasks(&desc->work) + 1) / 2; /* their weights take memory */
    *served = envmapi_banks_suits(h);
    if (!*served) return ENVMAP_OK;
    h->whole = tolerance < 0.99e-4 || (src->mapping == ENVMAP_PARABOLOID && src->size == 1);
    memset(&source, 0, sizeof source);
    pair->axis.source = &source;
    envmapi_near_contrast(look, pair->axis.level.texels, envmapi_slice_floats(src, 0));
    frexp(look[0], &pair->exponent);
    if (pair->exponent > -60 && pair->exponent < 60) pair->exponent = 0;
    envmap_result result = envmapi_near_turn(pair, src, pool);
    for (int face = 0; face < envmap_faces(dst->mapping); ++face)
        mirrored &= envmapi_turn_place(opposite + face, 7, dst->mapping, dst->size, face);
    if (mirrored) h->slices = (slices + 1) / 2;
    if (!result) result = envmapi_banks_create(h, pool);
    if (!result && h->whole)
        result =
            envmapi_source_create(&source, src, src->slices > 1 ? first : 0, desc->work.memory);
    if (!result) result = envmapi_banks_run(h, &desc->work, pool);
    if (!result) envmapi_banks_put(h, w, mirrored ? opposite : NULL);
    envmapi_source_free(&source, desc->work.memory);
    return result;
}

/* ------------------------------------------------------------------------------------ >>scene --
   One look at a slice of a source: what FAST must know of it to keep its bounds.
     in     a slice, the sigma of the sharpest lobe that will ask      out    envmapi_scene
   Texels are summed in square blocks, these in blocks twice as wide, and so on. Of blocks i of one
   width, E_i their energies, w_i solid angles, m_i the mean radiance of i's parent, the block twice
   as wide, E all energy:
       kappa    sqrt(sum (E_i - m_i w_i)^2) / E       the contrast at that width    _scene_scales
       epsilon  max |E_i - m_i w_i| / E               that of the brightest block alone
       D        the darkest block's radiance over the mean radiance                 _scene_dark
   Band l is as strong as the contrast of blocks as wide as half its wave           _contrast_at
   For lobes with a kink the brightest texels become lights, which are summed apart (_scene_lights);
   kappa is that of all others. Histograms of axes, spread evenly and at the brightest blocks, tell
   which energy and which part of kappa^2 lies at each angle from an axis (_scene_histograms).
   Used by >>fast and >>plan.  Tests: tests/test_prepared.c, tests/test_scenes.c. */

#define ENVMAPI_SCALES 13 /* blocks of 4, 8 ... texels up to the largest map: 4 2^12 = 16384 */
/* Tuned as those of >>fast are. The test named above a constant fails without it.
   lights_are_the_texels_of_a_2000th_of_the_energy, of_too_many_lights_the_brightest_are_taken */
#define ENVMAPI_LIGHT  2000 /* a texel with more than this part of all energy is a light */
#define ENVMAPI_LIGHTS 512  /* the most that there are */
/* opposite_slices_of_banks_keep_the_tolerance */
#define ENVMAPI_NARROW 0.5 /* rad: lobes of at most this sigma ask axes about contrast too, */
#define ENVMAPI_ROUND  150 /* so many, the middles of 5 x 5 cells of a cube's faces; others 54 */
#define ENVMAPI_AXES   (ENVMAPI_ROUND + ENVMAPI_SCALES)
#define ENVMAPI_SEEN   2048 /* blocks that all axes look at, at most: speed only */

/* kappa and epsilon of blocks of one width, or of texels. */
typedef struct envmapi_contrast {
    double kappa, epsilon;
    size_t spot; /* the block that epsilon is of */
} envmapi_contrast;

/* Blocks of one width: how many along u and v, in all, and where they begin in `sums`. */
typedef struct envmapi_blocks {
    int nu, nv;
    size_t count, at;
} envmapi_blocks;

/* At each angle from an axis: RGB energy over the strongest channel's; then, width by width, the
   part of kappa^2. */
typedef struct envmapi_histogram {
    double axis[3];
    float seen[ENVMAPI_ANGLES][3 + ENVMAPI_SCALES];
} envmapi_histogram;

typedef struct envmapi_scene {
    envmapi_input in;
    float *sums;  /* blocks of texels, [count][4], then twice as wide, ... */
    double *rows; /* of each row of blocks: sum of squared energies; is a number negative */
    float *work;  /* a row of texels a task */
    int edge;     /* of the narrowest blocks, in texels; it doubles from scale to scale */
    double blur;  /* 0, or the band from which radiance that is bilinear has ever less */
    int tasks, scales;
    envmapi_blocks blocks[ENVMAPI_SCALES];
    double all, energy, solid; /* all channels; energy: without the lights */
    double sum[3], strongest;  /* energy of the channels; the largest */
    double mean[3];            /* radiance, without the lights */
    double norm;               /* sqrt of the sum of squares of all channels' energies */
    double squares, cut;       /* of the texels' energies; of those that a rim cuts */
    envmapi_contrast texel;    /* of single texels, at most */
    envmapi_contrast scale[ENVMAPI_SCALES]; /* of blocks of edge << i */
    envmapi_light *lights;                  /* taken out */
    int light_count;
    envmapi_histogram *histograms; /* [axes]: `round` evenly spread, then at each scale's spot */
    int round, axes, detail;       /* detail: with the parts of kappa^2 */
} envmapi_scene;

/* Adds n numbers of rows, times solid angles, to sums. Returns the sum of their squares; notes in
   *negative whether one has its sign bit set. */
static double envmapi_scene_rows(float *sums, const envmapi_rows *in, size_t n, int *negative) {
    envmapi_rows_notes notes;
    uint32_t bits[ENVMAPI_WIDE], any = 0;
    float squares[ENVMAPI_WIDE];
    double sum = 0;
    memset(&notes, 0, sizeof notes);
    envmapi_rows_add(sums, 0, 1, in, 1, &notes, n);
    memcpy(squares, &notes.squares, sizeof squares), memcpy(bits, &notes.bits, sizeof bits);
    for (int v = 0; v < ENVMAPI_WIDE; ++v) sum += (double)squares[v], any |= bits[v];
    *negative |= any >> 31 != 0;
    return sum;
}

/* Task: rows of blocks. Solid angles are alike on all faces: they are summed on the first only. */
static void envmapi_task_scene(void *context, int task) {
    const envmapi_scene *s = (const envmapi_scene *)context;
    int edge = s->in.map->size, faces = envmap_faces(s->in.map->mapping);
    size_t width = (size_t)envmapi_width(s->in.map->mapping, edge), W = 3 * width;
    int nu = s->blocks[0].nu, nv = s->blocks[0].nv;
    float *row = s->work + (size_t)task * 4 * width;
    for (int i = task; i < faces * nv; i += s->tasks) {
        int from = i % nv * s->edge, to = from + s->edge < edge ? from + s->edge : edge;
        const float *texels = s->in.texels + (size_t)(i / nv) * W * (size_t)edge;
        float *block = s->sums + 4 * (size_t)i * (size_t)nu;
        envmapi_rows in;
        int negative = 0;
        s->rows[2 * i] = 0;
        memset(row, 0, 4 * width * sizeof *row);
        for (int y = from; y < to; y += in.rows) {
            in.rows = to - y < ENVMAPI_ROWS ? to - y : ENVMAPI_ROWS;
            for (int r = 0; r < in.rows; ++r) {
                in.x[r] = texels + (size_t)(y + r) * W, in.y[r] = envmapi_omega_row(&s->in, y + r);
                in.w[r][0] = 1;
            }
            s->rows[2 * i] += envmapi_scene_rows(row, &in, W, &negative);
            for (int r = 0; r < in.rows; ++r) in.x[r] = in.y[r] + W;
            if (i < nv) envmapi_rows_add(row + W, 0, 1, &in, 0, NULL, width);
        }
        for (size_t x = 0, end; x < width; x = end, block += 4) {
            envmapi_float4 sum; /* of RGB, and the red beside it */
            float solid = 0;
            memset(&sum, 0, sizeof sum);
            for (end = x + (size_t)s->edge < width ? x + (size_t)s->edge : width; x < end; ++x) {
                envmapi_float4_add(&sum, 1, envmapi_float4_at(row + 3 * x));
                solid += row[W + x];
            }
            *envmapi_float4_at(block) = sum, block[3] = solid;
        }
        s->rows[2 * i + 1] = negative;
    }
}

/* Sums blocks at scale i to those at scale i+1, which are twice as wide. */
static void envmapi_scene_halve(const envmapi_scene *s, float *sums, int i) {
    const envmapi_blocks *from = s->blocks + i, *to = from + 1;
    const float *block = sums + from->at;
    memset(sums + to->at, 0, 4 * to->count * sizeof *sums);
    for (int row = 0; row < envmap_faces(s->in.map->mapping) * from->nv; ++row) {
        int line = row / from->nv * to->nv + row % from->nv / 2;
        float *parents = sums + to->at + 4 * (size_t)(line * to->nu);
        for (int x = 0; x < from->nu; x += 2, parents += 4) {
            envmapi_float4 sum = *envmapi_float4_at(parents);
            for (int end = x + 1 < from->nu ? 2 : 1; end > 0; --end, block += 4)
                envmapi_float4_add(&sum, 1, envmapi_float4_at(block));
            *envmapi_float4_at(parents) = sum;
        }
    }
}

/* e += E - m w of a block, of which `alike` in its parent have a share q together, 1/4 as a rule. A
   light counts (1-q)^2 of its square; where q is larger, beyond 0.3, that is to be brought to
   (3/4)^2: returns by how much. Blocks without siblings, q = 1, are held against the mean of the
   scene. Test: a_lit_texel_has_contrast_wherever_it_is. */
static double envmapi_block_excess(double e[3], const envmapi_scene *s, const float *block,
                                   const float *parent, int alike) {
    double w = (double)block[3], share = parent && parent[3] > 0 ? w / (double)parent[3] : 1;
    double q = alike * share;
    for (int c = 0; c < 3; ++c)
        e[c] += (double)block[c] - (q < 0.9 ? (double)parent[c] * share : s->mean[c] * w);
    return q < 0.9 && q > 0.3 ? 0.5625 / ((1 - q) * (1 - q)) : 1;
}

/* How many blocks beside block b make one that is as wide as at the equator: more than one in a row
   beside a lat-long's pole, all of the row at the pole.
   Test: a_lamp_on_a_pole_has_the_contrast_of_one_elsewhere. */
static int envmapi_block_group(const envmapi_scene *s, int i, size_t b) {
    int nu = s->blocks[i].nu, y = (int)(b / (size_t)nu);
    double row = ENVMAPI_PI * (s->edge << i) / s->in.map->size;
    if (s->in.map->mapping != ENVMAP_LATLONG) return 1;
    double radius = fmin(sin(y * row), sin(fmin((y + 1) * row, ENVMAPI_PI)));
    return (int)(1 / fmax(radius, 1.0 / nu));
}

/* Returns the sum of the squares of the blocks at scale i of `sums`. squares, unless NULL: each is
   added to that of the block at scale `to` that it is part of. *most, *spot: the largest square, if
   it exceeds *most, and its block. */
static double envmapi_scene_squares(double *squares, double *most, size_t *spot,
                                    const envmapi_scene *s, const float *sums, int i, int to) {
    const envmapi_blocks *from = s->blocks + i, *next = from + 1, *wide = s->blocks + to;
    const float *block = sums + from->at, *parents = i + 1 < s->scales ? sums + next->at : NULL;
    double sum = 0, e[3] = {0, 0, 0};
    size_t b = 0;
    for (int row = 0; b < from->count; ++row) {
        int face = row / from->nv, y = row % from->nv, group = envmapi_block_group(s, i, b),
            parent = (face * next->nv + y / 2) * next->nu;
        double *into = squares ? squares + (face * wide->nv + (y >> (to - i))) * wide->nu : NULL;
        for (int x = 0; x < from->nu; ++x, ++b, block += 4) {
            const float *around = parents ? parents + 4 * (parent + x / 2) : NULL;
            int alike = group > 1 && (x ^ 1) < from->nu ? 2 : 1;
            double square = envmapi_block_excess(e, s, block, around, alike);
            if (group > 1 && (x + 1) % group && x + 1 < from->nu) continue;
            square *= envmapi_dot(e, e), e[0] = e[1] = e[2] = 0;
            if (into) into[x >> (to - i)] += square;
            sum += square;
            if (square > *most) *most = square, *spot = b;
        }
    }
    return sum;
}

/* The coarser scales of `sums`, and the contrast at every one; off: squares that are not in blocks.
   A light's block and its three siblings have (3/4)^2 + 3 (1/4)^2 = 3/4 of the light's square, the
   block alone 9/16. An edge along the borders of blocks shows only where it runs through blocks. Of
   half the width twice as many hold a quarter each: kappa is 2^-1.5 of that of the scale above,
   epsilon 1/4 of it. The widest n blocks may be one wave, of 3 numbers instead of n: band 1.
   Tests: edges_along_the_texels_keep_the_tolerance,
   a_wave_of_band_1_keeps_the_tolerance_of_every_mapping. */
static void envmapi_scene_scales(envmapi_scene *s, float *sums, double off) {
    int last = s->scales - 1;
    for (int i = 0; i < last; ++i) envmapi_scene_halve(s, sums, i);
    for (int i = last; i >= 0; --i) {
        double most = off;
        double sum = envmapi_scene_squares(NULL, &most, &s->scale[i].spot, s, sums, i, i);
        double waves = i == last ? fmax(4.0 / 3, (double)s->blocks[i].count / 3) : 4.0 / 3;
        sum = sum * waves + off * 4 / 3;
        s->scale[i].kappa = s->norm > 0 ? fmin(sqrt(sum) / s->norm, 1) : 0;
        s->scale[i].epsilon = s->norm > 0 ? fmin(sqrt(most * 16 / 9) / s->norm, 1) : 0;
        if (i == last) continue;
        s->scale[i].kappa = fmax(s->scale[i].kappa, 0.354 * s->scale[i + 1].kappa);
        s->scale[i].epsilon = fmax(s->scale[i].epsilon, 0.25 * s->scale[i + 1].epsilon);
    }
}

/* kappa of single texels, from the sum of their squares less what evenly lit blocks would have, E^2
   of each over its texels: sums of floats, good to 1e-6. */
static void envmapi_scene_texel(envmapi_scene *s, const float *sums, double squares) {
    size_t width = (size_t)s->blocks[0].nu;
    double even = 0;
    s->texel = s->scale[0];
    if (!(s->norm > 0) || s->edge == 1) return; /* the blocks are texels */
    for (size_t row = 0; row < s->blocks[0].count; row += width) {
        double sum = 0;
        for (const float *e = sums + 4 * row; e < sums + 4 * (row + width); e += 4)
            sum += (double)e[0] * (double)e[0] + (double)e[1] * (double)e[1] +
                   (double)e[2] * (double)e[2];
        even += envmapi_block_group(s, 0, row) * sum;
    }
    squares = fmax(squares - even / (s->edge * s->edge), 1e-6 * s->squares);
    s->texel.kappa = fmin(sqrt(squares) / s->norm, 1);
}

/* y at l on a straight line of logarithms from (l0, y0) to (l1, y1); 0 counts as 1e-9. */
static double envmapi_between(double l, double l0, double y0, double l1, double y1) {
    double t = log(l / l0) / log(l1 / l0);
    return exp((1 - t) * log(fmax(y0, 1e-9)) + t * log(fmax(y1, 1e-9)));
}

/* The contrast of blocks as wide as half a wave of band l, pi/l; bilinear radiance has less. */
static envmapi_contrast envmapi_contrast_at(const envmapi_scene *s, double l) {
    double finer = ENVMAPI_PI / envmapi_texel_extent(s->in.map), at = finer / s->edge;
    double less = l > s->blur && s->blur > 0 ? pow(s->blur / l, 2) : 1;
    envmapi_contrast below = s->texel, out = s->scale[s->scales - 1];
    if (l >= finer) out = s->texel;
    for (int i = 0; i < s->scales && l < finer; below = s->scale[i++], finer = at, at /= 2) {
        if (l < at) continue;
        out.kappa = envmapi_between(l, at, s->scale[i].kappa, finer, below.kappa);
        out.epsilon = envmapi_between(l, at, s->scale[i].epsilon, finer, below.epsilon);
        break;
    }
    out.kappa *= less, out.epsilon *= less;
    return out;
}

/* The contrast of a sphere map's own solid angles for band l. Texels are long towards -z, 2 side /
   phi at the angle phi: their midpoints lose as much as a light at -z of 5/2 side^2/24 l^2 of all
   solid angle, side = 4/n, or in the end as one of the 2/n that the last texels have.
   Test: texels_that_are_long_beside_the_rim_keep_the_tolerance. */
static double envmapi_solid_contrast(const envmapi_scene *s, double l) {
    double n = s->in.map->size;
    if (s->in.map->mapping != ENVMAP_SPHERE || s->blur > 0) return 0;
    return fmin(5 * l * l / (3 * n * n), 2 / n);
}

/* The scale of the blocks whose width is nearest to pi/l, as a ratio. */
static int envmapi_scale_at(const envmapi_scene *s, double l) {
    double width = sqrt(2) * ENVMAPI_PI / (l * s->edge * envmapi_texel_extent(s->in.map));
    int i = 0;
    while (i + 1 < s->scales && width >= 2) ++i, width /= 2;
    return i;
}

/* How many blocks there are at every scale; returns the floats of all. Four rows at the least where
   there are so many: these see a difference between any two halves of the sphere, also where a
   lat-long's first and last row are one block each.
   Test: a_lobe_of_two_bands_keeps_the_tolerance_of_every_mapping. */
static size_t envmapi_scene_layout(envmapi_scene *s) {
    const envmap *map = s->in.map;
    int nu = (envmapi_width(map->mapping, map->size) + s->edge - 1) / s->edge;
    int nv = (map->size + s->edge - 1) / s->edge, faces = envmap_faces(map->mapping);
    size_t at = 0;
    for (int high = nv; s->scales < ENVMAPI_SCALES; high /= 2) {
        if (s->scales && (high < 1 || nv * faces < 4)) break;
        envmapi_blocks *blocks = s->blocks + s->scales++;
        blocks->nu = nu, blocks->nv = nv, blocks->at = at;
        blocks->count = (size_t)(nu * nv * faces), at += 4 * blocks->count;
        nu = (nu + 1) / 2, nv = (nv + 1) / 2;
    }
    return at;
}

/* Adds up the energies; returns whether a number is negative. */
static int envmapi_scene_sum(envmapi_scene *s, const envmap_work *work) {
    size_t faces = (size_t)envmap_faces(s->in.map->mapping);
    double *energy = s->sum;
    int negative = 0;
    memset(energy, 0, sizeof s->sum), s->solid = s->squares = s->cut = 0;
    envmapi_run_all(work, envmapi_task_scene, s, s->tasks);
    float *block = s->sums, *end = block + 4 * s->blocks[0].count;
    for (size_t n = 4 * s->blocks[0].count / faces; block < end; block += 4) {
        if (block >= s->sums + n) block[3] = (block - n)[3]; /* alike on all faces */
        for (int c = 0; c < 3; ++c) energy[c] += (double)block[c];
        s->solid += (double)block[3];
    }
    for (size_t row = 0; row < faces * (size_t)s->blocks[0].nv; ++row) {
        s->squares += s->rows[2 * row] * envmapi_block_group(s, 0, row * (size_t)s->blocks[0].nu);
        negative |= s->rows[2 * row + 1] > 0;
    }
    for (int i = 0; i < s->in.rim_count; ++i) {
        for (int c = 0; c < 3; ++c) energy[c] += s->in.rim[i].value[c];
        s->solid += s->in.rim[i].value[3], s->cut += envmapi_light_square(s->in.rim + i);
    }
    for (int c = 0; c < 3; ++c) s->mean[c] = energy[c] / s->solid;
    s->squares += s->cut, s->all = s->energy = energy[0] + energy[1] + energy[2];
    s->strongest = fmax(fmax(energy[0], energy[1]), energy[2]);
    s->norm = sqrt(envmapi_dot(energy, energy));
    return negative;
}

/* Puts a copy of the slice in its place, the largest number about 1. */
static envmap_result envmapi_scene_scale(envmapi_scene *s, envmapi_pool *pool) {
    size_t floats = envmapi_slice_floats(s->in.map, 0);
    int exponent = envmapi_exponent(s->in.texels, floats);
    float *copy = (float *)envmapi_pool_get(pool, floats, sizeof(float));
    if (!copy) return ENVMAP_ERROR_MEMORY;
    envmapi_floats_scale(copy, s->in.texels, floats, -exponent);
    s->in.texels = copy, s->in.exponent = exponent;
    for (envmapi_light *cut = s->in.rim; cut < s->in.rim + s->in.rim_count; ++cut)
        for (int c = 0; c < 3; ++c) cut->value[c] = ldexp(cut->value[c], -exponent);
    return ENVMAP_OK;
}

/* Looks at a slice, for lobes of this sigma and wider. The narrowest blocks are 8 texels wide where
   that is below sigma/4, else 4 (speed only, 1.26 x for Phong 10).  Errors: MEMORY, RADIANCE. */
static envmap_result envmapi_scene_create(envmapi_scene *s, const envmap *map, int slice,
                                          double sigma, const envmap_work *work,
                                          envmapi_pool *pool) {
    size_t W = 4 * (size_t)envmapi_width(map->mapping, map->size);
    memset(s, 0, sizeof *s);
    s->in.map = map, s->tasks = envmapi_tasks(work);
    s->edge = 32 * envmapi_texel_extent(map) <= sigma ? 8 : 4;
    while (s->edge > 1 && 4 * s->edge > map->size && map->mapping != ENVMAP_LATLONG)
        s->edge /= 2; /* or there are no four rows; a lat-long's outer rows are one block each */
    size_t at = envmapi_scene_layout(s);
    size_t rows = 2 * (size_t)(envmap_faces(map->mapping) * s->blocks[0].nv);
    if (envmapi_input_create(&s->in, map, slice, 2 * rows + at + W * (size_t)s->tasks, work, pool))
        return ENVMAP_ERROR_MEMORY;
    s->rows = (double *)(void *)s->in.spare;
    s->sums = (float *)(s->rows + rows), s->work = s->sums + at;
    int negative = envmapi_scene_sum(s, work);
    if ((negative || !envmapi_finite(s->energy)) && !envmapi_radiance_ok(map, 0))
        return ENVMAP_ERROR_RADIANCE;
    if (!(s->norm > 1e-12 && s->norm < 1e15)) { /* too small or large to be squared in floats */
        if (envmapi_scene_scale(s, pool)) return ENVMAP_ERROR_MEMORY;
        envmapi_scene_sum(s, work);
    }
    envmapi_scene_scales(s, s->sums, s->cut);
    envmapi_scene_texel(s, s->sums, s->squares);
    return ENVMAP_OK;
}

/* Makes lights of a block's texels with more energy than `limit`; 0 where there are too many. */
static int envmapi_block_lights(envmapi_scene *s, size_t block, double limit) {
    const envmap *map = s->in.map;
    int nu = s->blocks[0].nu, nv = s->blocks[0].nv, row = (int)(block / (size_t)nu);
    int x0 = (int)(block % (size_t)nu) * s->edge, y0 = row % nv * s->edge, face = row / nv;
    int width = envmapi_width(map->mapping, map->size);
    for (int y = y0; y < y0 + s->edge && y < map->size; ++y)
        for (int x = x0; x < x0 + s->edge && x < width; ++x) {
            size_t texel = (size_t)(face * map->size + y) * (size_t)width + (size_t)x;
            const float *rgb = s->in.texels + 3 * texel;
            double w = (double)envmapi_omega_row(&s->in, y)[3 * x];
            if (!(((double)rgb[0] + (double)rgb[1] + (double)rgb[2]) * w > limit)) continue;
            if (s->light_count >= ENVMAPI_LIGHTS) return 0;
            envmapi_light *light = s->lights + s->light_count++;
            *light = envmapi_light_of(&s->in, texel, w);
            envmapi_texel_direction(light->d, map->mapping, face, map->size, x, y);
        }
    return 1;
}

/* Of `sums`: the block that a light is in. */
static float *envmapi_light_block(float *sums, const envmapi_scene *s, const envmapi_light *light) {
    size_t width = (size_t)envmapi_width(s->in.map->mapping, s->in.map->size);
    size_t size = (size_t)s->in.map->size, x = light->texel % width, y = light->texel / width;
    size_t row = y / size * (size_t)s->blocks[0].nv + y % size / (size_t)s->edge;
    return sums + 4 * (row * (size_t)s->blocks[0].nu + x / (size_t)s->edge);
}

/* The contrast of what the lights leave, no texel of which has more than `limit` of all energy.
   rest: room for the blocks without the lights. */
static void envmapi_scene_unlit(envmapi_scene *s, double limit, float *rest) {
    size_t width = (size_t)envmapi_width(s->in.map->mapping, s->in.map->size);
    size_t size = (size_t)s->in.map->size;
    double squares = s->squares, off = s->cut;
    memcpy(rest, s->sums, 4 * s->blocks[0].count * sizeof *rest);
    for (int i = 0; i < s->light_count; ++i) {
        const double *v = s->lights[i].value, square = envmapi_light_square(s->lights + i);
        size_t x = s->lights[i].texel % width, y = s->lights[i].texel / width;
        float *sum = envmapi_light_block(rest, s, s->lights + i);
        int cut = !(envmapi_omega_row(&s->in, (int)(y % size))[3 * x] > 0);
        for (int c = 0; c < 3; ++c) {
            s->mean[c] = fmax(s->mean[c] - v[c] / s->solid, 0);
            if (!cut) sum[c] = (float)fmax((double)sum[c] - v[c], 0);
        }
        s->energy -= envmapi_light_energy(s->lights + i);
        squares -= square * envmapi_block_group(s, 0, (size_t)(sum - rest) / 4);
        if (cut) off -= square;
    }
    if (s->energy < 1e-6 * s->all) s->energy = 0;
    if (s->light_count) { /* else all is as it was */
        envmapi_scene_scales(s, rest, fmax(off, 0));
        envmapi_scene_texel(s, rest, squares);
    }
    limit *= envmapi_block_group(s, 0, s->scale[0].spot);
    s->texel.epsilon = fmin(s->scale[0].epsilon, limit);
}

/* The middle of block b at scale i. */
static void envmapi_block_direction(double d[3], const envmapi_scene *s, int i, size_t b) {
    int nu = s->blocks[i].nu, nv = s->blocks[i].nv, mapping = s->in.map->mapping;
    int wide = s->edge << i;
    int x = (int)(b % (size_t)nu), y = (int)(b / (size_t)nu), face = y / nv;
    envmapi_direction(d, mapping, face,
                      fmin((x + 0.5) * wide / envmapi_width(mapping, s->in.map->size), 1),
                      fmin((y % nv + 0.5) * wide / s->in.map->size, 1));
}

/* Blocks that axes see, for histograms: where, and RGB energy and parts of kappa^2; angle: the row
   of a histogram where the cosine is 1 - i/512. */
typedef struct envmapi_sight {
    envmapi_histogram *histograms;
    size_t count;
    double (*d)[3], *squares;
    float (*values)[3 + ENVMAPI_SCALES];
    unsigned char angle[1026];
    int first; /* histograms are to be cleared */
} envmapi_sight;

/* Task: what an axis sees. */
static void envmapi_task_see(void *context, int a) {
    const envmapi_sight *t = (const envmapi_sight *)context;
    envmapi_histogram *to = t->histograms + a;
    if (t->first) memset(to->seen, 0, sizeof to->seen);
    for (size_t b = 0; b < t->count; ++b) {
        float *seen = to->seen[t->angle[(int)(512.5 - 512 * envmapi_dot(to->axis, t->d[b]))]];
        envmapi_float16_add(envmapi_float16_at(seen), 1, envmapi_float16_at(t->values[b]));
    }
}

/* Adds the blocks at scale j to all histograms: energies if `from` is 0, and in detail the squares
   in `rest` of scales from .. j, over their sum. */
static void envmapi_histograms_add(envmapi_sight *t, envmapi_scene *s, const float *rest, int from,
                                   int j, const envmap_work *work) {
    const float *sums = s->sums + s->blocks[j].at;
    size_t count = t->count = s->strongest > 0 ? s->blocks[j].count : 0;
    t->first = !from;
    memset(t->squares, 0, (size_t)(j - from + 1) * count * sizeof *t->squares);
    memset(t->values, 0, count * sizeof *t->values);
    for (int i = from; i <= j && s->detail; ++i) {
        size_t spot;
        double most = 0, *part = t->squares + (size_t)(i - from) * count;
        double total = envmapi_scene_squares(part, &most, &spot, s, rest, i, j);
        for (size_t b = 0; b < count && total > 0; ++b)
            t->values[b][3 + i] = (float)(part[b] / total);
    }
    for (size_t b = 0; b < count; ++b) {
        envmapi_block_direction(t->d[b], s, j, b);
        for (int c = 0; c < 3 && !from; ++c)
            t->values[b][c] = (float)((double)sums[4 * b + (size_t)c] / s->strongest);
    }
    envmapi_run_all(work, envmapi_task_see, t, s->axes);
}

/* Fills the histograms. Energies and the finer scales come from blocks narrower than sigma/2, if
   these are not too many, coarser scales from their own; rest: the blocks without the lights. */
static envmap_result envmapi_scene_histograms(envmapi_scene *s, double sigma, const float *rest,
                                              const envmap_work *work, envmapi_pool *pool) {
    int j = 0, edge = s->round == ENVMAPI_ROUND ? 5 : 3;
    double extent = s->edge * envmapi_texel_extent(s->in.map);
    envmapi_sight t;
    while (j + 1 < s->scales && (4 * extent <= sigma || s->blocks[j].count > ENVMAPI_SEEN))
        ++j, extent *= 2;
    size_t count = s->blocks[j].count;
    t.histograms = s->histograms;
    t.squares = (double *)envmapi_pool_get(pool, (size_t)(j + 1) * count, sizeof *t.squares);
    t.d = (double(*)[3])envmapi_pool_get(pool, count, sizeof *t.d);
    t.values = (float(*)[3 + ENVMAPI_SCALES])envmapi_pool_get(pool, count, sizeof *t.values);
    if (!t.squares || !t.d || !t.values) return ENVMAP_ERROR_MEMORY;
    for (int i = 0; i < 1026; ++i) {
        double part = envmapi_acos(1 - i / 512.0) / ENVMAPI_PI;
        t.angle[i] = (unsigned char)fmin(sqrt(part) * ENVMAPI_ANGLES, ENVMAPI_ANGLES - 1);
    }
    for (int a = 0; a < s->round; ++a)
        envmapi_texel_direction(s->histograms[a].axis, ENVMAP_CUBE, a / edge / edge, edge, a % edge,
                                a / edge % edge);
    for (int i = 0; i < s->axes - s->round; ++i)
        envmapi_block_direction(s->histograms[s->round + i].axis, s, i, s->scale[i].spot);
    for (int from = 0; j < s->scales && (s->detail || !from); from = ++j)
        envmapi_histograms_add(&t, s, rest, from, j, work);
    return ENVMAP_OK;
}

/* Lists the texels with more than 1/2000 of the scene's energy, or so much more, by doubling, that
   there is room for all; kappa is then what they leave. Histograms are for lobes of this sigma. The
   blocks in s->sums stay whole. */
static envmap_result envmapi_scene_lights(envmapi_scene *s, double sigma, const envmap_work *work,
                                          envmapi_pool *pool) {
    const envmapi_blocks *last = s->blocks + s->scales - 1;
    int fits = 0;
    s->detail = sigma <= ENVMAPI_NARROW;
    s->round = s->detail ? ENVMAPI_ROUND : 54, s->axes = s->round + (s->detail ? s->scales : 0);
    s->lights = (envmapi_light *)envmapi_pool_get(pool, ENVMAPI_LIGHTS, sizeof(envmapi_light));
    s->histograms =
        (envmapi_histogram *)envmapi_pool_get(pool, (size_t)s->axes, sizeof(envmapi_histogram));
    int kept = pool->count;
    float *rest = (float *)envmapi_pool_get(pool, last->at + 4 * last->count, sizeof(float));
    if (!s->lights || !s->histograms || !rest) return ENVMAP_ERROR_MEMORY;
    double limit = s->energy / ENVMAPI_LIGHT / 2;
    while (!fits) {
        s->light_count = 0, fits = 1, limit *= 2;
        for (int i = 0; i < s->in.rim_count && fits; ++i)
            if (envmapi_light_energy(s->in.rim + i) > limit) {
                if (s->light_count < ENVMAPI_LIGHTS) s->lights[s->light_count++] = s->in.rim[i];
                else fits = 0;
            }
        for (size_t b = 0; b < s->blocks[0].count && fits; ++b) {
            const float *sum = s->sums + 4 * b;
            if ((double)sum[0] + (double)sum[1] + (double)sum[2] > limit)
                fits = envmapi_block_lights(s, b, limit);
        }
    }
    envmapi_scene_unlit(s, s->all > 0 ? limit / s->all : 1, rest);
    envmap_result result =
        envmapi_scene_histograms(s, sigma, s->light_count ? rest : s->sums, work, pool);
    envmapi_pool_free(pool, kept);
    return result;
}

/* D, from blocks no wider than the lobe, at most 2, which a colour may exceed. */
static double envmapi_scene_dark(const envmapi_scene *s, double sigma) {
    int i = 0;
    double extent = s->edge * envmapi_texel_extent(s->in.map), mean = s->all / s->solid / 3;
    float dark = 1e30f;
    for (; i + 1 < s->scales && 2 * extent <= sigma; ++i) extent *= 2;
    const float *block = s->sums + s->blocks[i].at, *end = block + 4 * s->blocks[i].count;
    for (; block < end; block += 4) { /* fmin and fmax would be calls */
        float most = block[0] > block[1] ? block[0] : block[1];
        most = block[2] > most ? block[2] : most;
        if (most < dark * block[3]) dark = most / block[3];
    }
    return mean > 0 ? fmin((double)dark / mean, 2) : 2;
}

/* ------------------------------------------------------------------------------------- >>fast --
   filter = fill . lambda . project: a lobe makes a result with nothing finer than its bands, and
   sees nothing finer in the source, so all work is done on grids that are no finer than the lobe.
     in     slices of a source that were looked at, lobes, a tolerance     out    slices of results
       how many bands, how fine a grid      _spec_fit          once for every lobe and scene
       texels -> a_lm                       _fast_analyse      once for smooth lobes and others each
       a_lm -> lambda_l a_lm -> texels      _fast_synthesise   once for every slice of a result
   Lost are all bands from L on, and of the others what splines on a grid of spacing h lose, e(l)
   (_band_error). A band holds at most kappa_l^2 times what one light of all the energy puts there:
     rms     sum_(l>=L) kappa_l^2 (2l+1) lambda_l^2 <= (tolerance/2)^2 R,            _slice_bands
             kappa^2 sum_l (2l+1) lambda_l^2 e(l)^2 <= (tolerance/4)^2 R, four times,
             R = (1-kappa^2) lambda_0^2 + kappa^2 sum_l (2l+1) lambda_l^2          _spacing_holds
             R is the result's power.  Test: colours_that_sum_to_grey_keep_the_tolerance
     texels  d(t) = sum (2l+1) lambda_l P_l(cos t), l >= L, or over all l times e(l), is lost at the
             angle t from a light. A share of the light itself, k(t), is allowed. What exceeds it,
             q(t) = max(|d(t)| - share k(t), 0), is held against the darkest texel:  _slice_allows
             epsilon q(t) <= share D lambda_0 / 2          the brightest spot, wherever it is
             sqrt(kappa^2 - epsilon^2) rms(q) <= share D lambda_0 / 2     all others together
   The bands of a lobe with a kink (diffuse, Banks) end slowly. There lights are summed apart, and D
   is the least that one of 54 axes gets. Where narrow lobes miss that, or leave an axis black, they
   are held to what each of 150 axes sees, L(a) being the light that axis a gets:    _slice_sees
             kappa sqrt(sum of q^2 over where the contrast is) <= 3/2 share L(a),
             epsilon q(t) <= 3/2 share L(a)          a at the angle t from the brightest spot
   Banks' slices at c and -c are each other's antipodes; slices of about as many bands share a grid.
   The first bound is proved but for kappa; the others are models of how errors meet, and measured:
   the worst texel of all tests stays below 20 tolerances.
   Tests: tests/test_fast.c, tests/test_scenes.c. */

/* Tuned for the fewest bands with no texel off by more than 20 tolerances: on the scenes of
   tests/test_fast.c and tests/test_scenes.c, softboxes on black of 32^2 and 48^2, five real maps.
   The test named above a constant fails without it. */
#define ENVMAPI_FAST_BANDS 768 /* the most that there are; test_harmonics.c tries so many */
/* every_tolerance_is_kept_in_a_studio */
#define ENVMAPI_SHARE   2.0  /* tolerances at a texel for each of four splines; bands: twice that */
#define ENVMAPI_NOTHING 5e-4 /* of the mean: what an axis gets at least, as it is counted */
/* opposite_slices_of_banks_keep_the_tolerance */
#define ENVMAPI_SEES  1.5  /* times the share where axes look, as they look at what is there */
#define ENVMAPI_BLACK 3e-3 /* of the mean: an axis that gets less sees black */
/* kinks_on_few_texels_keep_the_tolerance */
#define ENVMAPI_LATTICE 0.8 /* of the texels' lattice's first wave: from there lambda_l is small */
/* a_lit_texel_some_texels_away_keeps_the_tolerance, of tests/test_near.c, at 30 */
#define ENVMAPI_TAIL    3.0 /* times the share, for the tail of a sharp lobe */
#define ENVMAPI_BLUR    4.0 /* over texels: from this band on, bilinear radiance has less */
#define ENVMAPI_APART   15.0 /* over bands, rad: length of the pieces that points stand for */
#define ENVMAPI_SHARP   2.35 /* texels: near sums are quicker below, between cubes; speed only */
#define ENVMAPI_MIDDLE  40 /* squared bands a number of the result, of points: speed only */
#define ENVMAPI_PAIRS   0.2 /* L^3 a pair of numbers, beyond which sums are quicker: speed only */
#define ENVMAPI_HEAVY   190 /* bands, beyond which a GGX has its lights apart: speed only */
#define ENVMAPI_SMOOTH  8.0 /* over sigma: bands of a smooth lobe, or 24; at 4 rms fails, 1.45 */

/* The angles of histograms: their cosines, and sin t dt / 2. */
typedef struct envmapi_angles {
    double x[ENVMAPI_ANGLES], area[ENVMAPI_ANGLES];
} envmapi_angles;

static void envmapi_angles_fill(envmapi_angles *angles) {
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
        double t = (j + 0.5) / ENVMAPI_ANGLES; /* dt = 2 pi t/64 */
        angles->x[j] = cos(ENVMAPI_PI * t * t);
        angles->area[j] = sin(ENVMAPI_PI * t * t) * ENVMAPI_PI * t / ENVMAPI_ANGLES;
    }
}

/* A slice of a result. Radiance is in units of the light that a result of a uniform scene has. */
typedef struct envmapi_slice {
    double p, *lambda;           /* lambda_l of the bands that are known */
    double power, tail;          /* sum (2l+1) lambda_l^2: of all bands; of unknown ones */
    double k[ENVMAPI_ANGLES];    /* of the known bands, at the angles */
    double whole[ENVMAPI_ANGLES]; /* its size; of a tail that of the whole lobe */
    double mean, darkest;        /* of the result in this scene */
    double result[ENVMAPI_AXES]; /* what each axis gets */
    double dark[ENVMAPI_SCALES][ENVMAPI_ANGLES]; /* the least, that far from a scale's spot */
    int black, L; /* black: an axis gets next to nothing; L: the bands needed */
    double h;     /* the grid needed */
} envmapi_slice;

/* What a lobe asks of a scene, slice by slice; L: the most bands, h: the finest grid. */
typedef struct envmapi_spec {
    const envmap_lobe *lobe;
    const envmapi_tail *tail; /* the lobe is only the tail of a sharp one; NULL: all of it */
    double part;              /* of that one's integral; 1 */
    envmap *dst;
    envmapi_slice *slice;
    envmapi_angles *angles;
    int rim;              /* axes about a sphere map's -z are the definition's: envmapi_axes_lack */
    int slices, mirrored; /* mirrored: half of dst's slices; those at -p are theirs */
    int known, L, kinked; /* known: bands of which lambda_l is known */
    double h, tolerance, sigma;
    double brightest; /* the largest |lambda_0| of a slice */
    double dark;      /* D of the scene, for a smooth lobe */
    double midpoint;  /* side^2/24 of a texel's side: what its midpoint loses, over the curvature */
    const envmapi_scene *scene; /* that it is being fitted to, slice by slice, as this work says */
    const envmap_work *work;
    int points; /* texels of a source whose points stand for the definition's sum; dark is known */
    double most; /* bands that take no longer than sums, where these may be taken; 0: any number */
} envmapi_spec;

/* sum_l (2l+1) lambda_l^2 e^2 over l < to, e the spline's error on a grid of h, or 1. */
static double envmapi_slice_power(const envmapi_slice *slice, int to, double h) {
    double sum = 0;
    for (int l = 0; l < to; ++l) {
        double e = h > 0 ? envmapi_band_error(l, h) : 1;
        sum += (2 * l + 1) * slice->lambda[l] * slice->lambda[l] * e * e;
    }
    return sum;
}

static void envmapi_series_begin(envmapi_series *series, const double *x) {
    series->l = 0, series->x = x;
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) series->P[j] = 1, series->before[j] = 0;
}

/* sum += weight (2l+1) P_l; l goes on. */
static void envmapi_series_add(envmapi_series *series, double *sum, double weight) {
    weight *= 2 * series->l + 1;
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) sum[j] += weight * series->P[j];
    envmapi_series_next(series);
}

/* lambda_l for `bands` bands, and the power beyond them by Parseval: sum (2l+1) lambda_l^2 =
   4 pi (2 pi integral of k^2) / norm^2; 0 where that is not finite. */
static int envmapi_slice_lambda(envmapi_slice *slice, const envmap_lobe *lobe, int bands) {
    double norm = envmapi_lobe_norm(lobe);
    slice->power = HUGE_VAL;
    if (!envmapi_zonal(slice->lambda, bands, lobe, slice->p)) return 0;
    if (!(norm > 0) && !lobe->raw) norm = envmapi_lobe_integral(lobe, slice->p);
    slice->power = 4 * ENVMAPI_PI * envmapi_lobe_power(lobe, slice->p, 2) / (norm * norm);
    slice->tail = slice->power - envmapi_slice_power(slice, bands, 0);
    if (!(slice->tail > 1e-11 * slice->power)) slice->power -= slice->tail, slice->tail = 0;
    return envmapi_finite(slice->power);
}

/* sum_j w_j of all that an axis sees. */
static void envmapi_histogram_sum(float sums[3 + ENVMAPI_SCALES],
                                  const envmapi_histogram *histogram, const double *w) {
    envmapi_float16 even, odd;
    memset(&even, 0, sizeof even), memset(&odd, 0, sizeof odd);
    for (int j = 0; j < ENVMAPI_ANGLES; j += 2) {
        envmapi_float16_add(&even, (float)w[j], envmapi_float16_at(histogram->seen[j]));
        envmapi_float16_add(&odd, (float)w[j + 1], envmapi_float16_at(histogram->seen[j + 1]));
    }
    envmapi_float16_add(&even, 1, &odd);
    memcpy(sums, &even, sizeof even);
}

/* What axes get of the whole scene, for lobes with a kink. An axis stands for the angles beside it,
   as far as 150 axes are apart: sqrt(4 pi / 150), 0.3 rad. */
static void envmapi_slice_axes(envmapi_slice *slice, const envmapi_spec *spec,
                               const envmapi_scene *s) {
    double k[ENVMAPI_ANGLES], integral = envmapi_lobe_integral(spec->lobe, slice->p);
    double scale = 4 * ENVMAPI_PI * fabs(slice->lambda[0]) / integral;
    double rest = (1 / spec->part - 1) * spec->dark / 2 * slice->mean; /* what is near gets */
    envmapi_k_many(k, spec->angles->x, ENVMAPI_ANGLES, spec->lobe, slice->p);
    for (int a = 0; a < s->axes; ++a) {
        float rgb[3 + ENVMAPI_SCALES];
        envmapi_histogram_sum(rgb, s->histograms + a, k);
        double most = fmax(fmax((double)rgb[0], (double)rgb[1]), (double)rgb[2]);
        slice->result[a] = fmax(scale * most + rest, ENVMAPI_NOTHING * slice->mean);
        slice->darkest = fmin(slice->darkest, slice->result[a]);
    }
    for (int i = 0; i < s->scales && s->detail; ++i) {
        const double *spot = s->histograms[s->round + i].axis;
        for (int j = 0; j < ENVMAPI_ANGLES; ++j) slice->dark[i][j] = HUGE_VAL;
        for (int a = 0; a < s->axes; ++a) {
            double t = envmapi_acos(envmapi_dot(s->histograms[a].axis, spot));
            double from = sqrt(fmax(t - 0.3, 0) / ENVMAPI_PI) * ENVMAPI_ANGLES - 0.5;
            double to = sqrt((t + 0.3) / ENVMAPI_PI) * ENVMAPI_ANGLES - 0.5;
            for (int j = (int)ceil(from); j <= to && j < ENVMAPI_ANGLES; ++j)
                slice->dark[i][j] = fmin(slice->dark[i][j], slice->result[a]);
        }
    }
}

/* Looks at the scene. The mean is lambda_0, or where a slice is much darker than others a tenth of
   theirs (speed only). */
static void envmapi_slice_look(envmapi_slice *slice, const envmapi_spec *spec,
                               const envmapi_scene *s) {
    slice->mean = fmax(fabs(slice->lambda[0]), spec->brightest / 10);
    slice->darkest = slice->mean;
    if (spec->kinked) envmapi_slice_axes(slice, spec, s);
    else slice->darkest *= spec->dark;
    slice->black = slice->darkest < ENVMAPI_BLACK * slice->mean;
}

/* Is an error q(t) of every light small enough for the axes? The rms of all lights' together must
   stay below that share of what the axis gets. The brightest spot's must stay below that share of
   the least that an axis at that angle gets, or where there is black, of next to nothing. */
static int envmapi_slice_sees(const envmapi_slice *slice, const envmapi_scene *s, const double *q,
                              double share, int l) {
    envmapi_contrast contrast = envmapi_contrast_at(s, l);
    double squares[ENVMAPI_ANGLES];
    float sums[3 + ENVMAPI_SCALES];
    int i = envmapi_scale_at(s, l);
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
        double nothing = ENVMAPI_NOTHING * slice->mean;
        double least = slice->black ? nothing : slice->dark[i][j];
        if (contrast.epsilon * q[j] > share * least) return 0;
        squares[j] = q[j] * q[j];
    }
    for (int a = 0; a < s->round; ++a) {
        envmapi_histogram_sum(sums, s->histograms + a, squares);
        if (contrast.kappa * sqrt((double)sums[3 + i]) > share * slice->result[a]) return 0;
    }
    return 1;
}

/* Is an error d(t) of one light small enough, of bands from l on? Of |d| what exceeds `share` of k
   counts: the brightest light's must stay below that share of the dark, and so must the rms of all
   others' together. Where that is not so, or there is black, the axes say for a narrow lobe with a
   kink (always asking them: 1.4 x for Banks 0.9). 1e-3 of the mean is envmap_compare's least.
   The denominator is filtered on the same grid. Solid angles change from texel to texel, so it has
   an error of its own; it must stay below share * mean / 8.
   Test of both: a_wide_lamp_on_black_keeps_the_tolerance. */
static int envmapi_slice_allows(const envmapi_slice *slice, const envmapi_spec *spec,
                                const envmapi_scene *s, const double *d, double share, int l) {
    envmapi_contrast c = envmapi_contrast_at(s, l);
    double excess[ENVMAPI_ANGLES], most = 0, squares = 0;
    if (spec->tail) share *= ENVMAPI_TAIL;
    double dark = share / spec->part * fmax(slice->darkest / 2, 1e-3 * slice->mean);
    double others = fmax(c.kappa * c.kappa - c.epsilon * c.epsilon, 0);
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
        double over = fabs(d[j]) - share * fabs(slice->whole[j]);
        excess[j] = over > 0 ? over : 0;
        most = excess[j] > most ? excess[j] : most;
        squares += excess[j] * excess[j] * spec->angles->area[j];
    }
    double lumps = fmax(8 * spec->midpoint, envmapi_solid_contrast(s, l));
    if (lumps * most * spec->part > share * slice->mean) return 0;
    int fits = c.epsilon * most <= dark && others * squares <= dark * dark;
    if (!spec->kinked || !s->detail || (fits && !slice->black && !spec->tail)) return fits;
    return envmapi_slice_sees(slice, s, excess, ENVMAPI_SEES * share, l);
}

/* Does an error of this power stay below that part of the tolerance, in rms? */
static int envmapi_slice_rms(const envmapi_slice *slice, const envmapi_spec *spec, double error,
                             double c2, double part) {
    double result = (1 - c2) * slice->mean * slice->mean + c2 * slice->power;
    return error <= pow(spec->tolerance * part / spec->part, 2) * result;
}

/* kappa^2 for the rms, of light or of solid angles; and of n points at their lattice's waves, which
   are as many lights of their own.  Test: works_that_broke_hold, of tests/test_search.c. */
static double envmapi_slice_contrast(const envmapi_spec *spec, const envmapi_scene *s, int l) {
    double c = fmax(envmapi_contrast_at(s, l).kappa, envmapi_solid_contrast(s, l));
    double n = spec->points;
    return fmax(c * c, n > 0 && l > sqrt(n) ? pow(8 * spec->midpoint, 2) / n : 0);
}

/* The fewest bands that keep the bounds, or only the one on rms. Those on texels are tried at every
   band up to 32, then at every 32nd part more, which is added as they may fail between; to 3 L
   (speed only: at every band 1.15 x for Phong 10, without end 1.14 x for Banks 0.95). */
static int envmapi_slice_bands(const envmapi_slice *slice, const envmapi_spec *spec,
                               const envmapi_scene *s, int texels) {
    int L = spec->known;
    double tail = slice->tail * envmapi_slice_contrast(spec, s, L), lost[ENVMAPI_ANGLES];
    envmapi_series series;
    for (; L > 1; --L) {
        double c2 = envmapi_slice_contrast(spec, s, L);
        tail += c2 * (2 * L - 1) * slice->lambda[L - 1] * slice->lambda[L - 1];
        if (!envmapi_slice_rms(slice, spec, tail, c2, spec->tail ? 0.25 : 0.5)) break;
    }
    if (!texels) return L;
    envmapi_series_begin(&series, spec->angles->x);
    memcpy(lost, slice->k, sizeof lost);
    for (int l = 0, next = L; l < spec->known - 1 && l < 3 * L; ++l) {
        if (l == next) {
            next += 1 + l / 32;
            if (!envmapi_slice_allows(slice, spec, s, lost, 2 * ENVMAPI_SHARE * spec->tolerance,
                                      l + 1))
                L = l + 1 + l / 32;
        }
        envmapi_series_add(&series, lost, -slice->lambda[l]);
    }
    return L < spec->known ? L : spec->known;
}

/* Do grids whose spacing is 0.96^(n-1) of the widest keep the bounds? kappa of half the bands is
   that of all, and at least 1e-2.  Test: a_wide_lamp_on_black_keeps_the_tolerance. */
typedef struct envmapi_spacing {
    const envmapi_slice *slice;
    const envmapi_spec *spec;
    const envmapi_scene *scene;
    double widest;
} envmapi_spacing;

static int envmapi_spacing_holds(void *user, int n) {
    const envmapi_spacing *test = (const envmapi_spacing *)user;
    const envmapi_slice *slice = test->slice;
    const envmapi_spec *spec = test->spec;
    int middle = slice->L / 2 + 1;
    double h = test->widest * pow(0.96, n - 1), lost[ENVMAPI_ANGLES] = {0};
    double c2 = fmax(envmapi_slice_contrast(spec, test->scene, middle), 1e-4);
    envmapi_series series;
    if (!envmapi_slice_rms(slice, spec, c2 * envmapi_slice_power(slice, slice->L, h), c2, 0.25))
        return 0;
    envmapi_series_begin(&series, spec->angles->x);
    for (int l = 0; l < slice->L; ++l)
        envmapi_series_add(&series, lost, slice->lambda[l] * envmapi_band_error(l, h));
    return envmapi_slice_allows(slice, spec, test->scene, lost, ENVMAPI_SHARE * spec->tolerance,
                                middle);
}

/* The widest grid whose spline errors stay within the bounds, to 4 %. */
static double envmapi_slice_spacing(const envmapi_slice *slice, const envmapi_spec *spec,
                                    const envmapi_scene *s) {
    envmapi_spacing test = {slice, spec, s, envmapi_widest_spacing(slice->L)};
    int steps = 1 + (int)ceil(log(test.widest / 1e-3) / -log(0.96));
    return test.widest * pow(0.96, envmapi_least(steps, envmapi_spacing_holds, &test) - 1);
}

/* A task for every slice; one alone does not ask the executor. */
static void envmapi_spec_each(envmapi_spec *spec, envmap_task *task) {
    if (spec->slices > 1) envmapi_run_all(spec->work, task, spec, spec->slices);
    else task(spec, 0);
}

/* lambda_l of so many bands, and k of every slice; 0 where these are not finite. */
static void envmapi_task_lambda(void *context, int k) {
    envmapi_spec *spec = (envmapi_spec *)context;
    envmapi_slice *slice = spec->slice + k;
    envmapi_series series;
    envmapi_series_begin(&series, spec->angles->x);
    memset(slice->k, 0, sizeof slice->k);
    if (!envmapi_slice_lambda(slice, spec->lobe, spec->known)) return;
    for (int l = 0; l < spec->known; ++l) envmapi_series_add(&series, slice->k, slice->lambda[l]);
    memcpy(slice->whole, slice->k, sizeof slice->k);
    if (!spec->tail) return;
    /* Few bands are known of a tail that is a small part: its own k has all. */
    double scale = 4 * ENVMAPI_PI * slice->lambda[0] / spec->tail->integral;
    envmapi_k_many(slice->k, spec->angles->x, ENVMAPI_ANGLES, spec->lobe, slice->p);
    envmapi_k_many(slice->whole, spec->angles->x, ENVMAPI_ANGLES, spec->tail->whole, slice->p);
    for (int j = 0; j < ENVMAPI_ANGLES; ++j) slice->k[j] *= scale, slice->whole[j] *= scale;
}

static int envmapi_spec_lambda(envmapi_spec *spec, int bands) {
    int finite = 1;
    if (bands <= spec->known) return 1;
    spec->known = bands;
    envmapi_spec_each(spec, envmapi_task_lambda);
    for (int k = 0; k < spec->slices; ++k) finite &= envmapi_finite(spec->slice[k].power);
    return finite;
}

/* A sum over texel centres shows the texels' lattice if lambda_l has not decayed by the lattice's
   frequency, all the more of a scene that is a lattice itself. No band limit below that one can
   represent it.  Tests: a_lobe_takes_no_more_than_its_neighbours, works_that_broke_hold. */
static int envmapi_spec_lattice_holds(envmapi_spec *spec, const envmapi_scene *scene) {
    const envmap *map = scene->in.map;
    double wave = 2 * ENVMAPI_PI * envmapi_width(map->mapping, map->size);
    int l = (int)(ENVMAPI_LATTICE * wave / envmapi_stretch(map->mapping)), bands = 5 * l / 4;
    if (bands > ENVMAPI_FAST_BANDS) return 1;
    /* sum (2i+1) lambda_i^2 from `known` on is the tail: where it is small, no more are needed. */
    const envmapi_slice *s, *end = spec->slice + spec->slices;
    for (int known = l < 96 ? l : 96; known <= l; known *= 2) {
        if (!envmapi_spec_lambda(spec, known)) return 0;
        for (s = spec->slice; s < end && spec->known <= l; ++s)
            if (8 * spec->part * spec->part * fmax(s->tail, 1e-11 * s->power) >
                l * pow(spec->tolerance * s->mean, 2))
                break;
        if (s == end) return 1;
    }
    if (!envmapi_spec_lambda(spec, bands)) return 0;
    for (s = spec->slice; s < end; ++s)
        for (int i = l; i < bands; ++i)
            if (2 * fabs(s->lambda[i]) * spec->part > spec->tolerance * s->mean) return 0;
    return 1;
}

/* Are all kinks of the lobe known? A function or a table may have a tip at its axis. */
static int envmapi_spec_declared(const envmapi_spec *spec) {
    return spec->lobe->kind < ENVMAP_LOBE_FUNCTION || spec->lobe->kink_count;
}

/* The last ones may have more beyond them: as much as they have if lambda_l falls as l^-3 (a tip)
   and twice as many are known.  Test: checks_keep_the_tolerance, works_that_broke_hold. */
static int envmapi_spec_enough(const envmapi_spec *spec) {
    int slow = !envmapi_spec_declared(spec) && spec->known < ENVMAPI_FAST_BANDS;
    return spec->L <= (slow ? spec->known / 2 : spec->known - spec->known / 8);
}

static void envmapi_task_look(void *context, int k) {
    envmapi_spec *spec = (envmapi_spec *)context;
    envmapi_slice_look(spec->slice + k, spec, spec->scene);
}

static void envmapi_task_bands(void *context, int k) {
    envmapi_spec *spec = (envmapi_spec *)context;
    spec->slice[k].L = envmapi_slice_bands(spec->slice + k, spec, spec->scene, 1);
}

static void envmapi_task_spacing(void *context, int k) {
    envmapi_spec *spec = (envmapi_spec *)context;
    spec->slice[k].h = envmapi_slice_spacing(spec->slice + k, spec, spec->scene);
}

/* Bands of every slice, and the most; not all, where the first has not enough (speed only). */
static void envmapi_spec_bands(envmapi_spec *spec) {
    envmapi_task_bands(spec, 0);
    spec->L = spec->slice[0].L;
    if (spec->slices == 1) return;
    if (!envmapi_spec_enough(spec) && spec->known < ENVMAPI_FAST_BANDS) return;
    envmapi_spec_each(spec, envmapi_task_bands);
    for (int k = 0; k < spec->slices; ++k)
        if (spec->slice[k].L > spec->L) spec->L = spec->slice[k].L;
}

/* Bands for this scene; 0 where there are not enough, or more than `most`. lambda_l is known for
   24, 96, 192 ... bands until they are enough (speed only). */
static int envmapi_spec_search(envmapi_spec *spec, double most) {
    for (int bands = spec->known > 24 ? spec->known : 24;; bands = bands < 96 ? 96 : 2 * bands) {
        if (bands > ENVMAPI_FAST_BANDS) bands = ENVMAPI_FAST_BANDS;
        if (!envmapi_spec_lambda(spec, bands)) return 0;
        if (!spec->L) envmapi_spec_each(spec, envmapi_task_look);
        envmapi_spec_bands(spec);
        if (envmapi_spec_enough(spec)) return spec->L <= most;
        if (spec->L > most) return 0;
        if (bands < ENVMAPI_FAST_BANDS) continue;
        if (bands < ENVMAPI_SMOOTH / spec->sigma) return 0;
        /* a kink beside nothing but dark: at least the rms, and more where none is declared */
        spec->L = envmapi_spec_declared(spec) ? spec->known / 2 : spec->known;
        for (envmapi_slice *slice = spec->slice; slice < spec->slice + spec->slices; ++slice) {
            if (envmapi_slice_bands(slice, spec, spec->scene, 0) > spec->L) return 0;
            if (slice->L > spec->L) slice->L = spec->L;
        }
        return spec->L <= most;
    }
}

/* Bands and spacing for this scene; L 0 where that cannot be. */
static int envmapi_spec_fit(envmapi_spec *spec, const envmapi_scene *scene, double most) {
    spec->L = 0, spec->h = HUGE_VAL, spec->scene = scene;
    if (!spec->points) spec->dark = envmapi_scene_dark(scene, spec->tail ? 0 : spec->sigma);
    if (!envmapi_spec_search(spec, most) ||
        !(spec->points || envmapi_spec_lattice_holds(spec, scene)))
        return spec->L = 0;
    envmapi_spec_each(spec, envmapi_task_spacing);
    for (int k = 0; k < spec->slices; ++k) spec->h = fmin(spec->h, spec->slice[k].h);
    return spec->L;
}

/* Sets up a specification of all slices, or of one; 0 when the lobe is sharper than `least`. */
static int envmapi_spec_create(envmapi_spec *spec, envmap *dst, int one, const envmap_lobe *lobe,
                               const envmap *src, double least, double tolerance,
                               envmapi_pool *pool, envmap_result *result) {
    int varied = lobe->p0 < lobe->p1 || lobe->p0 > lobe->p1, all = varied ? dst->slices : 1;
    int from = one < 0 ? 0 : one;
    double side = envmapi_stretch(src->mapping) / envmapi_width(src->mapping, src->size);
    memset(spec, 0, sizeof *spec);
    spec->lobe = lobe, spec->dst = dst, spec->tolerance = tolerance, spec->part = 1;
    spec->sigma = ENVMAPI_PI, spec->midpoint = side * side / 24;
    /* Banks' ring at -c is that at c about -t. */
    spec->mirrored = one < 0 && lobe->kind == ENVMAP_LOBE_BANKS && varied &&
                     !(lobe->p0 + lobe->p1 < 0) && !(lobe->p0 + lobe->p1 > 0);
    spec->slices = one >= 0 ? 1 : spec->mirrored ? (all + 1) / 2 : all;
    for (int k = 0; k < spec->slices; ++k)
        spec->sigma =
            fmin(spec->sigma, envmap_lobe_sigma(lobe, envmapi_slice_p(lobe, from + k, all)));
    if (spec->sigma < least) return 0;
    size_t n = (size_t)spec->slices;
    size_t each = sizeof(envmapi_slice) + ENVMAPI_FAST_BANDS * sizeof(double);
    spec->slice = (envmapi_slice *)envmapi_pool_get(pool, n, each); /* and lambda_l of all */
    spec->angles = (envmapi_angles *)envmapi_pool_get(pool, 1, sizeof(envmapi_angles));
    if (!spec->slice || !spec->angles) *result = ENVMAP_ERROR_MEMORY;
    if (!*result) envmapi_angles_fill(spec->angles);
    for (int k = 0; k < spec->slices && !*result; ++k) {
        envmapi_slice *slice = spec->slice + k;
        slice->p = envmapi_slice_p(lobe, from + k, all);
        slice->lambda = (double *)(spec->slice + n) + (size_t)k * ENVMAPI_FAST_BANDS;
        if (!envmapi_zonal(slice->lambda, 1, lobe, slice->p)) slice->lambda[0] = 0;
        spec->brightest = fmax(spec->brightest, fabs(slice->lambda[0]));
    }
    return !*result;
}

/* A slice as it is, and what its lights leave (unlit.lights NULL: not known yet). */
typedef struct envmapi_scenes {
    envmapi_scene whole, unlit;
} envmapi_scenes;

/* Fits a spec to its scene. */
static void envmapi_task_fit(void *context, int i) {
    envmapi_spec *spec = (envmapi_spec *)context + i;
    double most = spec->kinked ? ENVMAPI_FAST_BANDS : fmax(24, ENVMAPI_SMOOTH / spec->sigma);
    if (!spec->kinked && (spec->tail || spec->lobe->kind == ENVMAP_LOBE_GGX))
        most = fmin(most, ENVMAPI_HEAVY);
    if (spec->most > 0) most = fmin(most, spec->most);
    if (spec->scene) envmapi_spec_fit(spec, spec->scene, most);
}

/* Fits them all to a scene. Those whose bands end slowly are fitted to what its lights leave.
   Several are tasks; one by itself has tasks. */
static envmap_result envmapi_specs_fit(envmapi_spec *specs, int count, envmapi_scenes *scenes,
                                       const envmap_work *work, envmapi_pool *pool) {
    int kinked = 0;
    double extent = envmapi_texel_extent(scenes->whole.in.map), sigma = ENVMAPI_PI;
    envmap_result result = ENVMAP_OK;
    envmap_work serial, all = *work;
    memset(&serial, 0, sizeof serial);
    if (count == 1) all = serial;
    for (envmapi_spec *spec = specs; spec < specs + count; ++spec)
        spec->kinked = 0, spec->scene = &scenes->whole, spec->work = count > 1 ? &serial : work;
    envmapi_run_all(&all, envmapi_task_fit, specs, count);
    for (envmapi_spec *spec = specs; spec < specs + count; ++spec) {
        kinked += spec->kinked = !spec->L;
        if (spec->kinked) sigma = fmin(sigma, spec->sigma);
        /* A kink sees the lattice of large texels. Test: a_lamp_anywhere_keeps_the_tolerance. */
        spec->scene = spec->kinked && (extent < 0.05 || spec->tail) ? &scenes->unlit : NULL;
    }
    if (kinked && !scenes->unlit.lights) {
        scenes->unlit = scenes->whole;
        result = envmapi_scene_lights(&scenes->unlit, sigma, work, pool);
    }
    if (kinked && !result) envmapi_run_all(&all, envmapi_task_fit, specs, count);
    return result;
}

/* ---- source to a_lm to results */

/* What the source side hands to the result side. */
typedef struct envmapi_spectrum {
    double *a; /* a_lm, where they have memory of their own */
    int kept;  /* the source's grid is still there: a result of the same shape takes it over */
    double h;
    envmapi_transform t;
} envmapi_spectrum;

/* A scene -> the spectrum that all specs of one kind can do with. */
static envmap_result envmapi_fast_analyse(envmapi_spectrum *out, const envmapi_spec *specs,
                                          int count, int kinked, int keeps,
                                          const envmapi_scene *scene, const envmapi_transform *done,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    envmapi_transform *t = &out->t;
    int bands = 1, fills = 0;
    size_t room = 0;
    memset(out, 0, sizeof *out);
    out->h = 1, out->kept = !keeps;
    for (const envmapi_spec *spec = specs; spec < specs + count; ++spec) {
        if (spec->kinked != kinked || !spec->L) continue;
        if (spec->L > bands) bands = spec->L;
        out->h = fmin(out->h, spec->h), fills += spec->slices + spec->mirrored;
        room = envmapi_grid_of(spec->dst, spec->h, (double)desc->tolerance).count;
    }
    if (keeps || fills > 1) {
        room = 0;
        out->a = (double *)envmapi_pool_get(pool, envmapi_triangle(bands, bands), sizeof(double));
        if (!out->a) return ENVMAP_ERROR_MEMORY;
    }
    if (envmapi_transform_create(t, scene->in.map, out->h, bands, (double)desc->tolerance,
                                 &scene->in, room, done, &desc->work, pool))
        return ENVMAP_ERROR_MEMORY;
    if (kinked) t->lights.all = scene->lights, t->lights.count = scene->light_count;
    if (out->a) t->rings.a = out->a, t->rings.a_bands = bands;
    envmapi_project_texels(t, &desc->work);
    return ENVMAP_OK;
}

/* Where texels have texels opposite: not on sphere, angular and octahedral maps. */
static int envmapi_has_antipodes(int mapping) {
    return mapping == ENVMAP_CUBE || mapping == ENVMAP_PARABOLOID || mapping == ENVMAP_LATLONG;
}

/* Task: dst(d) = src(-d), the slice at -p of that at p. */
static void envmapi_task_antipodes(void *context, int k) {
    const envmap *map = (const envmap *)context;
    int other = map->slices - 1 - k, faces = envmap_faces(map->mapping);
    envmapi_place to[6];
    for (int face = 0; face < faces; ++face)
        envmapi_turn_place(to + face, 7, map->mapping, map->size, face);
    const float *in = envmapi_image(map, 0, k, 0);
    float *out = envmapi_image(map, 0, other, 0);
    for (int i = 0; i < faces * map->size && other > k; ++i) {
        const envmapi_place place = to[i / map->size];
        for (int x = 0, y = i % map->size; x < envmapi_width(map->mapping, map->size); ++x, in += 3)
            memcpy(out + 3 * envmapi_turned(map, &place, x, y), in, 3 * sizeof *in);
    }
}

/* Slice k of a result, at the slice's p or at -p, where lambda_l is (-1)^l times as much. */
static envmap_result envmapi_fast_fill(envmapi_transform *t, const envmapi_spec *spec,
                                       const envmapi_slice *slice, int k, int opposite,
                                       const envmap_work *work) {
    double p = opposite ? -slice->p : slice->p;
    for (int l = 0; l < spec->L; ++l)
        t->rings.lambda[l] = opposite && l % 2 ? -slice->lambda[l] : slice->lambda[l];
    envmapi_lights_aim(&t->lights, p);
    t->out = envmapi_image(spec->dst, 0, k, 0);
    t->positive = envmapi_lobe_nonnegative(spec->lobe, p);
    t->divide = !spec->lobe->raw && spec->lobe->kind != ENVMAP_LOBE_BANKS;
    t->norm = t->divide ? envmapi_lobe_integral(spec->lobe, p) : envmapi_lobe_norm(spec->lobe);
    t->least = spec->rim ? (float)slice->lambda[0] / 2 : -3e38f;
    return envmapi_fill_texels(t, work, ENVMAP_ERROR_LOBE);
}

/* A slice of a specification, and that at -p, as far as they are among first .. first+slices-1. The
   latter waits where it is made of the former. */
static envmap_result envmapi_fast_pair(envmapi_transform *t, const envmapi_spec *spec, int row,
                                       int first, int slices, const envmap_work *work) {
    const envmap *dst = spec->dst;
    const envmapi_slice *slice = spec->slice + row;
    int last = first + slices, k = spec->slices > 1 || spec->mirrored ? row : first;
    int other = spec->mirrored ? dst->slices - 1 - row : k, here = k >= first && k < last;
    envmap_result result = here ? envmapi_fast_fill(t, spec, slice, k, 0, work) : ENVMAP_OK;
    if (result || other == k || other < first || other >= last) return result;
    if (here && envmapi_has_antipodes(dst->mapping)) return ENVMAP_OK;
    return envmapi_fast_fill(t, spec, slice, other, 1, work);
}

/* Slices from `row` on that need about as many bands, L at most, and a grid of h: up to which. */
static int envmapi_spec_run(int *L, double *h, const envmapi_spec *spec, int row) {
    int least = spec->slice[row].L;
    for (*L = least, *h = HUGE_VAL; row < spec->slices; ++row) {
        int one = spec->slice[row].L, most = one > *L ? one : *L,
            fewest = one < least ? one : least;
        if (4 * most > 5 * fewest) break;
        *L = most, least = fewest, *h = fmin(*h, spec->slice[row].h);
    }
    return row;
}

/* A spectrum -> slices of a result, from `first` on; slices of about as many bands share a grid.
   The source's serves again where it is not 1.2 times finer than need be (speed only). */
static envmap_result envmapi_fast_synthesise(const envmapi_spec *spec, envmapi_spectrum *spectrum,
                                             int first, int slices, const envmap_filter_desc *desc,
                                             envmapi_pool *pool) {
    const envmap *dst = spec->dst, *src = spectrum->t.grid.map;
    envmap_result result = ENVMAP_OK;
    for (int row = 0, end, L, kept = pool->count; row < spec->slices; row = end) {
        double h;
        envmapi_transform own, *t = &spectrum->t;
        end = envmapi_spec_run(&L, &h, spec, row);
        int here = row < first + slices && end > first, n = dst->slices;
        int there = spec->mirrored && n - end < first + slices && n - row > first;
        if (!here && !there && spec->slices > 1) continue;
        if (!spectrum->kept || dst->mapping != src->mapping || dst->size != src->size ||
            h > 1.2 * spectrum->h) {
            result = envmapi_transform_create(&own, dst, h, L, (double)desc->tolerance, NULL, 0,
                                              spectrum->kept ? t : NULL, &desc->work, pool);
            own.rings.a = t->rings.a, own.rings.a_bands = t->rings.a_bands;
            own.lights = t->lights;
            t = &own;
        }
        t->rings.bands = L;
        t->rings.lambda = (double *)envmapi_pool_get(pool, ENVMAPI_FAST_BANDS, sizeof(double));
        if (!result && !t->rings.lambda) result = ENVMAP_ERROR_MEMORY;
        const envmap_lobe *lobe = spec->tail ? spec->tail->whole : spec->lobe;
        t->lights.reach = spec->tail ? spec->tail->reach : 0;
        t->sums = spec->tail ? spec->tail->sums : NULL;
        if (!result)
            result = envmapi_lights_group(&t->lights, lobe, spec->sigma, spec->tolerance, pool);
        for (; row < end && !result; ++row) {
            envmapi_part part;
            envmap_work one = envmapi_work_part(&part, &desc->work, row, 1, spec->slices);
            result = envmapi_fast_pair(t, spec, row, first, slices, &one);
        }
        envmapi_pool_free(pool, kept);
        if (result) return result;
    }
    envmap all = *dst;
    if (spec->mirrored && slices == dst->slices && envmapi_has_antipodes(dst->mapping))
        envmapi_run_all(&desc->work, envmapi_task_antipodes, &all, slices / 2);
    if (spec->slices == 1 && !spec->mirrored) envmapi_copy_slices(dst, first, slices);
    return ENVMAP_OK;
}

/* Can all specs of a kind do with this spectrum? */
static int envmapi_spectrum_serves(const envmapi_spectrum *spectrum, const envmapi_spec *specs,
                                   int count, int kinked) {
    int serves = spectrum->a != NULL;
    for (int i = 0; i < count; ++i)
        if (specs[i].kinked == kinked && specs[i].L)
            serves &= specs[i].L <= spectrum->t.rings.a_bands && specs[i].h >= 0.999 * spectrum->h;
    return serves;
}

/* ----------------------------------------------------------------------------------- >>sharp --
   Which way a lobe goes.
     in     a source's scene and spectra, what >>fast found of each lobe      out    the results
       lobes of few bands: harmonics, one spectrum for all               _filter_fast
       lobes below two texels, or of too many bands                      _filter_sharp:
         Banks' thin rings: >>banks;  what windows serve: >>near
         what windows would be too many for: points of >>reference       _points_slice
         what is left: >>near, by all texels
   The bands of points hold no more than those of texels, times (b/l)^2 where they are bilinear
   radiance.  Tests: tests/test_near.c (k_is_asked_for_some_thousand_times), tests/test_banks.c. */

/* A slice's darkest texel, its brightest inside the rims of paraboloids, and that beyond. */
static void envmapi_points_look(double look[3], const envmap *src, const float *t) {
    int n = src->size, texels = (int)(envmapi_slice_floats(src, 0) / 3);
    look[0] = HUGE_VAL, look[1] = look[2] = 0;
    for (int i = 0; i < texels; ++i, t += 3) {
        double one = (double)fmaxf(fmaxf(t[0], t[1]), t[2]);
        double X = (2 * (i % n) + 1.0) / n - 1, Y = (2 * (i / n % n) + 1.0) / n - 1;
        double *most = look + (X * X + Y * Y > 1 ? 2 : 1);
        look[0] = fmin(look[0], one), *most = fmax(*most, one);
    }
}

/* The part of a lobe that the definition leaves to centres, beyond its reach; of GGX, which is
   smooth there, a tenth is what tents may make of it. */
static double envmapi_points_beyond(const envmapi_axis *axis) {
    double all = 0, beyond = 0, theta, weight;
    if (!(axis->to > axis->reach)) return 0;
    envmapi_quadrature q = envmapi_quadrature_of(axis->lobe, axis->p, 0, axis->to, 1);
    while (envmapi_quadrature_next(&q, &theta, &weight)) {
        double k = fabs(envmapi_k(axis->lobe, cos(theta), axis->p)) * weight * sin(theta);
        all += k, beyond += k * envmapi_smooth_step(theta, axis->reach / 2, axis->reach);
    }
    return all > 0 ? beyond / all * (axis->lobe->kind == ENVMAP_LOBE_GGX ? 0.1 : 1) : 0;
}

/* Points -> a_lm, of which lambda_l makes the definition's sum. mixed: beyond the reach that has
   centres, whose a_lm are c_lm, where tents have t_lm:
       lambda_l a_lm = lambda_l t_lm + lambda_l' (c_lm - t_lm),   lambda_l' of the tail, k step
   Test: works_that_broke_hold. */
static envmap_result envmapi_points_analyse(envmapi_axis *axis, envmapi_points *points,
                                            const envmapi_spec *spec, int mixed,
                                            const envmap_work *work, envmapi_pool *pool) {
    envmapi_rings *rings = points->rings;
    envmapi_tail tail;
    int L = spec->L;
    size_t n = mixed ? envmapi_triangle(L, L) : 0;
    double *c = (double *)envmapi_pool_get(pool, n + (size_t)L, sizeof(double)), *step = c + n;
    double tent = axis->tent, bilinear = axis->bilinear;
    if (!c) return ENVMAP_ERROR_MEMORY;
    if (mixed) {
        axis->tent = axis->bilinear = 0;
        envmapi_axis_points(axis, points);
        envmapi_analyse(rings, work);
        memcpy(c, rings->a, n * sizeof *c);
        axis->tent = tent, axis->bilinear = bilinear;
        envmapi_tail_whole(&tail, axis->lobe, axis->reach);
        tail.lobe.raw = 1;
        tail.lobe.scale = axis->lobe->raw ? axis->lobe->scale
                                          : (float)(1 / envmapi_lobe_integral(axis->lobe, axis->p));
        envmapi_zonal(step, L, &tail.lobe, axis->p);
    }
    envmapi_axis_points(axis, points);
    envmapi_analyse(rings, work);
    for (int m = 0; m < L && mixed; ++m)
        for (int l = m; l < L; ++l) {
            double whole = spec->slice->lambda[l], part = fabs(whole) > 0 ? step[l] / whole : 0;
            size_t at = envmapi_triangle(L, m) + 8 * (size_t)(l - m);
            for (size_t i = at; i < at + 8; ++i) rings->a[i] += part * (c[i] - rings->a[i]);
        }
    return ENVMAP_OK;
}

/* Slice k by points that stand for the reference's sum. *served: 0 where they or bands are too
   many. */
static envmap_result envmapi_points_slice(envmap *dst, const envmap *src, int k, int *served,
                                          const envmap_lobe *lobe, const envmap_filter_desc *desc,
                                          envmapi_pool *pool) {
    envmapi_spec spec;
    envmapi_source source;
    envmapi_axis *axis = (envmapi_axis *)envmapi_pool_get(pool, 1, sizeof *axis);
    envmapi_axes *axes = (envmapi_axes *)envmapi_pool_get(pool, 1, sizeof *axes);
    envmapi_points *points = (envmapi_points *)envmapi_pool_get(pool, 1, sizeof *points);
    envmapi_scene *scene = (envmapi_scene *)envmapi_pool_get(pool, 1, sizeof *scene);
    envmapi_spectrum spectrum;
    envmapi_rings *rings = &spectrum.t.rings;
    double tolerance = (double)desc->tolerance, look[3];
    envmap_result result = ENVMAP_OK;
    if (!axis || !axes || !points || !scene) return ENVMAP_ERROR_MEMORY;
    memset(axis, 0, sizeof *axis), memset(axes, 0, sizeof *axes), memset(points, 0, sizeof *points);
    memset(&spectrum, 0, sizeof spectrum);
    axis->lobe = lobe, spectrum.t.grid.map = src, *served = 0;
    envmapi_axis_aim(axis, src, k, dst->slices, tolerance);
    /* the definition has centres beyond its reach, points have tents: a sphere map's are long */
    double loses = src->mapping == ENVMAP_SPHERE ? 20 * tolerance : 500 * tolerance;
    int tents = axis->bilinear > 0 || axis->tent * axis->tent > loses;
    double beyond = tents && axis->to > axis->reach ? envmapi_points_beyond(axis) : 0;
    int mixed = beyond > tolerance; /* centres lose a tenth of it, which few bands do not know */
    if (mixed && (lobe->kind != ENVMAP_LOBE_GGX || beyond > 5 * tolerance)) return ENVMAP_OK;
    if (!envmapi_spec_create(&spec, dst, k, lobe, src, 0, tolerance, pool, &result))
        return result;
    int slice = src->slices > 1 ? k : 0;
    result = envmapi_scene_create(scene, src, slice, spec.sigma, &desc->work, pool);
    if (result) return result;
    envmapi_points_look(look, src, scene->in.texels);
    /* bilinear radiance shows what shines beyond the rims, which no survey of solid angles sees */
    if (src->mapping == ENVMAP_PARABOLOID && axis->bilinear > 0 && look[2] > 2 * look[1])
        return ENVMAP_OK;
    spec.points = (int)(envmapi_slice_floats(src, 0) / 3), spec.work = &desc->work;
    spec.midpoint = (1 - axis->bilinear) / 8;
    spec.dark = scene->all > 0 ? fmin(3 * look[0] * scene->solid / scene->all, 2) : 2;
    if (axis->bilinear >= 1) scene->blur = ENVMAPI_BLUR / axis->texel;
    double most = sqrt(ENVMAPI_MIDDLE * (double)envmapi_slice_floats(dst, 0));
    int fits = envmapi_spec_fit(&spec, scene, most);
    if (!fits && axis->bilinear > 0 && lobe->kind == ENVMAP_LOBE_GGX) /* a kink, in rms, as FAST */
        fits = envmapi_spec_fit(&spec, scene, ENVMAPI_FAST_BANDS) && spec.L <= most;
    if (!fits) return result;
    result = envmapi_source_create(&source, src, slice, desc->work.memory);
    if (result) return result;
    source.texels = axis->level.texels = scene->in.texels, axis->source = &source;
    spec.rim = !(axis->bilinear > 0) && envmapi_axes_lacking(src, lobe, axis->p);
    axes->dst = dst, axes->slice = k;
    axes->axis = *axis, axes->rim = spec.rim, axes->filter = envmapi_axis_filter;
    axis->sigma = ENVMAPI_APART / spec.L * fmin(1, pow(tolerance * 1e3, 1.0 / 7));
    envmapi_axis_points(axis, points);
    if (points->count > ENVMAPI_MANY) {
        envmapi_source_free(&source, desc->work.memory);
        return ENVMAP_OK;
    }
    int M = envmapi_rings_size((int)ceil(fmax(ENVMAPI_PI / spec.h, spec.L + 2)));
    size_t room = mixed && source.count > points->count ? source.count : points->count;
    if (envmapi_rings_create(rings, M, spec.L, room, envmapi_grid_of(dst, spec.h, tolerance).count,
                             envmapi_rings_tasks(&desc->work), NULL, pool))
        result = ENVMAP_ERROR_MEMORY;
    points->rings = rings, spectrum.kept = 1;
    if (!result) result = envmapi_points_analyse(axis, points, &spec, mixed, &desc->work, pool);
    if (!result) *served = 1, result = envmapi_fast_synthesise(&spec, &spectrum, k, 1, desc, pool);
    if (!result && spec.rim) result = envmapi_axes_rim(axes, &desc->work);
    envmapi_source_free(&source, desc->work.memory);
    float *out = envmapi_image(dst, 0, k, 0);
    if (!result && scene->in.exponent)
        envmapi_floats_scale(out, out, envmapi_slice_floats(dst, 0), scene->in.exponent);
    return result;
}

/* Slices from `first` on: what windows of near do not serve by points where bands suffice; else as
   near and the reference do. */
static envmap_result envmapi_filter_sharp(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                          const envmapi_tail *tail, int first, int slices,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    int alike = src->slices == 1 && lobe->p0 == lobe->p1, count = alike ? 1 : slices;
    int round = src->mapping == ENVMAP_SPHERE || src->mapping == ENVMAP_ANGULAR;
    int asks = !tail || lobe->kind >= ENVMAP_LOBE_FUNCTION || round, kept = pool->count;
    int together = src->slices == 1 ? count : 1; /* slices of the result, for rings */
    envmap_filter_desc one = *desc;
    envmapi_part part;
    for (int k = 0; k < count && asks; ++k) {
        int declined = 0, served = 0;
        envmap_result result = ENVMAP_OK;
        if (lobe->kind == ENVMAP_LOBE_BANKS && k % together == 0) {
            one.work = envmapi_work_part(&part, &desc->work, k, together, count);
            result = envmapi_filter_banks(dst, src, first + k, together, &served, lobe, &one, pool);
            envmapi_pool_free(pool, kept);
            if (served) k += together - 1;
        }
        if (result) return result;
        if (served) continue;
        served = 1;
        one.work = envmapi_work_part(&part, &desc->work, k, 1, count);
        result = envmapi_filter_near(dst, src, lobe, tail, first + k, 1, &declined, &one, pool);
        if (!result && declined)
            result = envmapi_points_slice(dst, src, first + k, &served, lobe, &one, pool);
        envmapi_pool_free(pool, kept);
        if (result) return result;
        one.work = envmapi_work_part(&part, &desc->work, k, count - k, count);
        if (!served)
            return envmapi_filter_near(dst, src, lobe, tail, first, slices, NULL, &one, pool);
    }
    if (!asks) return envmapi_filter_near(dst, src, lobe, tail, first, slices, NULL, desc, pool);
    if (alike) envmapi_copy_slices(dst, first, slices);
    return ENVMAP_OK;
}

/* All specs for one slice of a source: smooth lobes share one spectrum, those with kinks another,
   which has the lights taken out; ready: spectra that are there already, or NULL. The first comes
   last: its result is final as soon as it is written. sums: reserved for the only one, or NULL. */
static envmap_result envmapi_filter_fast(envmapi_spec *specs, int count,
                                         const envmapi_scenes *scenes,
                                         const envmapi_spectrum ready[2], envmapi_near *sums,
                                         int first, int slices, const envmap_filter_desc *desc,
                                         envmapi_pool *pool) {
    envmap_result result = ENVMAP_OK;
    envmap_filter_desc one = *desc;
    /* blocks of sums are filled later: here is room until then; in the pool, as stacks are small */
    envmapi_transform *later = (envmapi_transform *)envmapi_pool_get(pool, 1, sizeof *later);
    envmapi_spectrum *spectrum = (envmapi_spectrum *)envmapi_pool_get(pool, 1, sizeof *spectrum);
    int kept = pool->count, done = 0, steps = 0;
    if (!later || !spectrum) return ENVMAP_ERROR_MEMORY;
    memset(later, 0, sizeof *later);
    if (sums)
        later->rings.G = sums->blocks,
        later->rings.room = 8 * sums->count * (size_t)envmapi_near_groups(sums);
    for (int i = 0; i < count; ++i) steps += specs[i].L && specs[i].tail ? 2 : 1;
    for (int pass = 0; pass < 2 && !result; ++pass) {
        int kinked = pass ? specs[0].kinked : !specs[0].kinked, any = 0;
        const envmapi_scene *scene = kinked ? &scenes->unlit : &scenes->whole;
        for (int i = 0; i < count; ++i) any += specs[i].kinked == kinked && specs[i].L;
        if (any && ready && envmapi_spectrum_serves(ready + kinked, specs, count, kinked))
            *spectrum = ready[kinked];
        else if (any)
            result = envmapi_fast_analyse(spectrum, specs, count, kinked, 0, scene,
                                          sums ? later : NULL, desc, pool);
        for (const envmapi_spec *spec = specs + count; spec-- > specs && !result;) {
            envmapi_part part;
            size_t floats = (size_t)slices * envmapi_slice_floats(spec->dst, 0);
            float *out = envmapi_image(spec->dst, 0, first, 0);
            if (spec->kinked != kinked) continue;
            if (!spec->L && desc->method == ENVMAP_METHOD_HARMONICS) result = ENVMAP_ERROR_METHOD;
            if (!spec->L) continue;
            one.work = envmapi_work_part(&part, &desc->work, done++, 1, steps);
            result = envmapi_fast_synthesise(spec, spectrum, first, slices, &one, pool);
            if (!result && scene->in.exponent)
                envmapi_floats_scale(out, out, floats, scene->in.exponent);
        }
        envmapi_pool_free(pool, kept); /* what follows needs none of it */
        for (const envmapi_spec *spec = specs + count; spec-- > specs && !result;) {
            envmapi_part part;
            const envmapi_tail *tail = spec->L ? spec->tail : NULL;
            const envmap_lobe *lobe = spec->tail ? spec->tail->whole : spec->lobe;
            if (spec->kinked != kinked || (spec->L && !tail)) continue;
            one.work = envmapi_work_part(&part, &desc->work, done++, 1, steps);
            if (sums) result = envmapi_near_sum(sums, &one.work);
            else
                result = envmapi_filter_sharp(spec->dst, scene->in.map, lobe, tail, first, slices,
                                              &one, pool);
            envmapi_pool_free(pool, kept);
        }
    }
    return result;
}

/* ---------------------------------------------------------------------------------- >>filters --
   The calls. A job holds what one call works with: every level of the result, and a specification
   for those that go to the fast filter.
     in     maps, lobes, a desc       out    levels of the result, or a source that was looked at
       checks, which method, a look at the source       _job_open, for every call
       levels that go by themselves, then FAST's        _job_run
       beside dst until nothing can fail                _job_stage
   Tests: tests/test_filters.c, tests/test_prepared.c. */

/* desc with defaults filled in; 0 when a field is out of range. */
static int envmapi_desc(envmap_filter_desc *out, const envmap_filter_desc *desc) {
    memset(out, 0, sizeof *out);
    if (desc) *out = *desc;
    if (!envmapi_work_of(&out->work, desc ? &desc->work : NULL)) return 0;
    if (out->method < 0 || out->method >= ENVMAP_METHOD_COUNT) return 0;
    if (!envmapi_finite((double)out->tolerance) || out->tolerance < 0) return 0;
    if (!envmapi_finite((double)out->threshold)) return 0;
    if (!(out->tolerance > 0)) out->tolerance = 1e-3f;
    out->tolerance = (float)envmapi_clamp((double)out->tolerance, 1e-7, 0.1);
    return 1;
}

/* The lobe is in range, and can be normalised for every slice if it has to be. */
static int envmapi_lobe_fits(const envmap_lobe *lobe, int slices) {
    if (!envmapi_lobe_sound(lobe)) return 0;
    if (lobe->kind == ENVMAP_LOBE_MIRROR || lobe->kind == ENVMAP_LOBE_BANKS) return 1;
    if (lobe->p0 == lobe->p1) slices = 1;
    for (int k = 0; k < slices; ++k) {
        double p = envmapi_slice_p(lobe, k, slices);
        if (!envmapi_finite(envmapi_lobe_integral(lobe, p))) return 0;
        if (!lobe->raw && !envmapi_lobe_positive(lobe, p)) return 0;
    }
    return 1;
}

/* What one call works with: levels, and specs for those that go to the fast filter. */
typedef struct envmapi_job {
    const envmap *src;
    const envmap_lobe *lobes;
    int count, fast, planned[32]; /* fast: how many specs; planned: has this level one? */
    int late;                     /* level 0 is the mirror, and is written last, to dst itself */
    envmap views[32];
    envmapi_spec specs[32];
    envmapi_tail tails[32]; /* of sharp lobes, by their specs */
    envmapi_scenes scenes;
    const envmapi_spectrum *ready; /* of a prepared source */
    envmapi_near *sums;            /* for the only level, which has a tail, or NULL */
    envmap_filter_desc desc;
    envmapi_pool pool;
} envmapi_job;

/* What envmap_prepare keeps: a job that was looked at, and a_lm of both kinds of lobes. */
typedef struct envmapi_prepared {
    envmap src;
    envmapi_job job;
    envmapi_spectrum spectra[2];
} envmapi_prepared;

/* Is this level its source's one texel again? All texels are alike, which the first that is not
   tells at once, and the lobe is divided by its own sum, or the source is black. */
static int envmapi_job_constant(const envmapi_job *job, int l) {
    const envmap *src = job->src;
    const float *t = src->texels;
    size_t more = (size_t)src->slices * envmapi_slice_floats(src, 0) - 3;
    int black = !(fabsf(t[0]) > 0 || fabsf(t[1]) > 0 || fabsf(t[2]) > 0);
    return (black || (!job->lobes[l].raw && job->lobes[l].kind != ENVMAP_LOBE_BANKS)) &&
           !memcmp(t, t + 3, more * sizeof *t);
}

/* Does this level go to the fast filter, which shares the source? Then it has a spec. Of a coarse
   source, or of few pairs of texels, sums are as fast and exact. */
static envmap_result envmapi_job_spec(envmapi_job *job, int l) {
    envmap_result result = ENVMAP_OK;
    double floats = (double)envmapi_slice_floats(job->src, 0);
    double pairs = floats / 9 * (double)envmapi_slice_floats(job->views + l, 0);
    double extent = envmapi_texel_extent(job->src);
    int method = job->desc.method, coarse = extent > ENVMAPI_COARSE, ok = 0;
    const envmap_lobe *lobe = job->lobes + l;
    envmapi_spec *spec = job->specs + job->fast;
    envmapi_tail *tail = job->tails + job->fast;
    double tolerance = (double)job->desc.tolerance;
    if (method == ENVMAP_METHOD_AUTO && pairs * job->views[l].slices < 1e5) coarse = 1;
    /* half of a row of texels on the horizon, where x^N begins with a jump: no bands lose that */
    if (method != ENVMAP_METHOD_HARMONICS && envmapi_lobe_root(lobe) && pairs < 3e7 &&
        pow(0.7 * extent, 1 + (double)lobe->parameter) > tolerance)
        coarse = 1;
    int sharp = method != ENVMAP_METHOD_HARMONICS && lobe->kind < ENVMAP_LOBE_GGX &&
                job->views[l].mapping == ENVMAP_CUBE && job->src->mapping == ENVMAP_CUBE &&
                envmap_lobe_sigma(lobe, 0) < ENVMAPI_SHARP * extent;
    if (lobe->kind == ENVMAP_LOBE_MIRROR || method == ENVMAP_METHOD_REFERENCE ||
        method == ENVMAP_METHOD_HIERARCHICAL || envmapi_job_constant(job, l))
        return ENVMAP_OK;
    if (!coarse && !sharp)
        ok = envmapi_spec_create(spec, job->views + l, -1, lobe, job->src, 2 * extent, tolerance,
                                 &job->pool, &result);
    if (!coarse && !sharp && !ok && !result && method != ENVMAP_METHOD_HARMONICS &&
        envmapi_tail_of(tail, lobe, job->src, tolerance)) {
        ok = envmapi_spec_create(spec, job->views + l, -1, &tail->lobe, job->src, 0, tolerance,
                                 &job->pool, &result);
        spec->tail = tail, spec->part = tail->part;
    }
    if (ok && method != ENVMAP_METHOD_HARMONICS && lobe->kind <= ENVMAP_LOBE_GGX)
        spec->most = cbrt(ENVMAPI_PAIRS * (double)envmapi_slice_floats(spec->dst, 0) *
                          (double)envmapi_slice_floats(job->src, 0));
    for (int k = 0, n = job->views[l].slices; ok && k < n && method != ENVMAP_METHOD_HARMONICS; ++k)
        spec->rim |= envmapi_axes_lacking(job->src, lobe, envmapi_slice_p(lobe, k, n));
    job->planned[l] = ok, job->fast += ok;
    return ok || result || method != ENVMAP_METHOD_HARMONICS ? result : ENVMAP_ERROR_METHOD;
}

/* Looks at a slice of the source and fits the specs to it. */
static envmap_result envmapi_job_look(envmapi_job *job, int slice) {
    double sigma = ENVMAPI_PI;
    envmap_result result = ENVMAP_OK;
    for (int i = 0; i < job->fast; ++i) sigma = fmin(sigma, job->specs[i].sigma);
    if (!job->ready) {
        memset(&job->scenes, 0, sizeof job->scenes);
        result = envmapi_scene_create(&job->scenes.whole, job->src, slice, sigma, &job->desc.work,
                                      &job->pool);
    }
    if (result) return result;
    return envmapi_specs_fit(job->specs, job->fast, &job->scenes, &job->desc.work, &job->pool);
}

/* The one door: checks all but what envmapi_desc has checked, and finds out what there is to do. No
   texel of dst is read. The pool is the caller's to free, also where this fails. */
static envmap_result envmapi_job_open(envmapi_job *job, const envmap *dst, const envmap *src,
                                      const envmap_lobe *lobes, int count,
                                      const envmap_filter_desc *desc) {
    const envmapi_prepared *ready = NULL;
    envmap_result result = ENVMAP_OK;
    if (desc->prepared) ready = (const envmapi_prepared *)desc->prepared->state;
    memset(job, 0, sizeof *job);
    job->src = src, job->lobes = lobes, job->count = count;
    job->desc = *desc, job->pool.memory = desc->work.memory;
    if (!envmapi_pair_ok(dst, src) || !lobes || count < 1 ||
        (desc->prepared && !(ready && !memcmp(&ready->src, src, sizeof *src))))
        return ENVMAP_ERROR_ARGUMENT;
    for (int l = 0; l < count; ++l)
        if (!envmapi_lobe_fits(lobes + l, dst->slices)) return ENVMAP_ERROR_LOBE;
    if (ready && ready->job.fast) job->scenes = ready->job.scenes, job->ready = ready->spectra;
    for (int l = 0; l < count && !result; ++l) {
        job->views[l] = *dst;
        job->views[l].size = envmapi_edge(dst->size, l), job->views[l].levels = 1;
        result = envmapi_job_spec(job, l);
    }
    if (!result && (job->fast < count || src->slices > 1) &&
        !envmapi_scan_run(NULL, src->texels, (size_t)src->slices * envmapi_slice_floats(src, 0),
                          desc->method == ENVMAP_METHOD_REFERENCE, &desc->work))
        result = ENVMAP_ERROR_RADIANCE;
    return result || !job->fast ? result : envmapi_job_look(job, 0);
}

/* All levels into the views: first those that go by themselves, then what the fast filter makes,
   slice by slice of the source. */
static envmap_result envmapi_job_run(envmapi_job *job) {
    const envmap *src = job->src;
    int slices = job->views[0].slices, runs = src->slices > 1 ? slices : 1, done = 0;
    envmapi_part part;
    envmap_filter_desc desc = job->desc;
    envmap_result result = ENVMAP_OK;
    for (int l = job->late; l < job->count && !result; ++l) {
        const envmap_lobe *lobe = job->lobes + l;
        envmap *view = job->views + l;
        if (job->planned[l]) continue;
        desc.work = envmapi_work_part(&part, &job->desc.work, done++, 1, job->count);
        if (lobe->kind == ENVMAP_LOBE_MIRROR) result = envmap_resample(view, src, &desc.work);
        else if (desc.method == ENVMAP_METHOD_HIERARCHICAL)
            result = envmapi_filter_hierarchical(view, src, lobe, &desc);
        else if (desc.method == ENVMAP_METHOD_REFERENCE)
            result = envmapi_filter_reference(view, src, lobe, 0, &desc);
        else if (envmapi_job_constant(job, l))
            for (size_t i = 0; i < (size_t)slices * envmapi_slice_floats(view, 0); ++i)
                view->texels[i] = src->texels[i % 3];
        else
            result = envmapi_filter_sharp(view, src, lobe, NULL, 0, slices, &desc, &job->pool);
    }
    done *= runs;
    for (int run = 0; run < runs && job->fast && !result; ++run, done += job->fast) {
        int kept = job->pool.count;
        desc.work = envmapi_work_part(&part, &job->desc.work, done, job->fast, job->count * runs);
        if (run) result = envmapi_job_look(job, run);
        for (int i = 0; i < job->fast && src->mapping == ENVMAP_SPHERE && !result; ++i) {
            size_t texels = envmapi_slice_floats(job->specs[i].dst, 0) / 3;
            job->tails[i].sums = (float *)envmapi_pool_get(&job->pool, texels, sizeof(float));
            if (!job->tails[i].sums) result = ENVMAP_ERROR_MEMORY;
        }
        if (!result)
            result = envmapi_filter_fast(job->specs, job->fast, &job->scenes, job->ready, job->sums,
                                         run, runs > 1 ? 1 : slices, &desc, &job->pool);
        envmapi_pool_free(&job->pool, kept);
    }
    desc.work = job->desc.work, desc.work.progress.report = NULL;
    for (envmapi_spec *spec = job->specs; spec < job->specs + job->fast && !result; ++spec)
        if (spec->rim) result = envmapi_filter_reference(spec->dst, src, spec->lobe, 1, &desc);
    return result;
}

/* Room for the results, which become dst's when nothing can fail any more. Level 0, which would be
   most of it, is written to dst itself where the fast filter writes it last and at once, where sums
   of few texels do, or add to a tail with memory that they have, without a progress callback and
   with a lobe that cannot fail, and where it is a mirror: a silent envmap_resample writes nothing
   before it has its memory. One that takes long, and has a progress callback, is staged as others
   are, to be cancelled. */
static envmap_result envmapi_job_stage(envmapi_job *job, envmap *dst) {
    int kind = job->lobes[0].kind, by = job->desc.method;
    int cancels = !!job->desc.work.progress.report;
    int sums = job->count == 1 && !job->planned[0] && kind != ENVMAP_LOBE_MIRROR && !cancels &&
               kind < ENVMAP_LOBE_FUNCTION && by != ENVMAP_METHOD_HIERARCHICAL &&
               by != ENVMAP_METHOD_REFERENCE;
    int fast = job->planned[0] && job->specs[0].L && !job->specs[0].tail && !job->specs[0].rim;
    int tail = job->count == 1 && job->planned[0] && job->specs[0].L && job->specs[0].tail &&
               kind < ENVMAP_LOBE_FUNCTION && !cancels && dst->slices == 1 &&
               job->src->slices == 1 && !envmapi_near_few(job->src, 48) &&
               job->src->mapping != ENVMAP_SPHERE && job->src->mapping != ENVMAP_ANGULAR;
    envmap_result result = ENVMAP_OK;
    job->views[0].texels = dst->texels;
    if (tail && job->scenes.unlit.lights && !job->ready) /* without the histograms, got last */
        envmapi_pool_free(&job->pool, job->pool.count - 1);
    if (tail)
        result = envmapi_near_reserve(&job->sums, job->views, &job->scenes.whole.in,
                                      job->specs[0].tail, &job->desc, &job->pool);
    if (result) return result;
    int direct = dst->slices == 1 && (sums || fast || job->sums);
    int quick = dst->mapping == job->src->mapping && dst->size <= job->src->size;
    job->late = kind == ENVMAP_LOBE_MIRROR && (quick || !cancels);
    float *first = envmapi_image(dst, 0, direct || job->late ? dst->slices : 0, 0);
    size_t floats = (size_t)(envmapi_image(dst, job->count - 1, dst->slices, 0) - first);
    float *stage = (float *)envmapi_pool_get(&job->pool, floats + 1, sizeof(float));
    if (!stage) return ENVMAP_ERROR_MEMORY;
    for (int l = 0; l < job->count; ++l)
        job->views[l].texels =
            !l && first > dst->texels ? dst->texels : stage + (envmapi_image(dst, l, 0, 0) - first);
    const envmap_work *work = &job->desc.work;
    result = envmapi_job_run(job);
    /* a lobe that fails shows as NaN */
    if (!result && !envmapi_scan_run(NULL, stage, floats, 1, work)) result = ENVMAP_ERROR_LOBE;
    if (!result && !direct) result = envmapi_tell(&work->progress, 1);
    job->desc.work.progress.report = NULL;
    if (!result && job->late) result = envmap_resample(job->views, job->src, work);
    if (!result) envmapi_scan_run(first, stage, floats, 1, work);
    return result;
}

ENVMAPI_BODY envmap_result envmap_filter_chain(envmap *dst, const envmap *src,
                                               const envmap_lobe *lobes, int count,
                                               const envmap_filter_desc *desc) {
    envmap_filter_desc own;
    if (!dst || count > dst->levels || !envmapi_desc(&own, desc)) return ENVMAP_ERROR_ARGUMENT;
    envmapi_job *job = (envmapi_job *)ENVMAP_MALLOC(own.work.memory, sizeof *job);
    if (!job) return ENVMAP_ERROR_MEMORY;
    envmap_result result = envmapi_job_open(job, dst, src, lobes, count, &own);
    if (!result) result = envmapi_job_stage(job, dst);
    if (!result) dst->p0 = lobes[0].p0, dst->p1 = lobes[0].p1;
    envmapi_pool_free(&job->pool, 0);
    ENVMAP_FREE(own.work.memory, job);
    return result;
}

ENVMAPI_BODY envmap_result envmap_filter(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                         const envmap_filter_desc *desc) {
    return envmap_filter_chain(dst, src, lobe, 1, desc);
}

/* Keeps of a spectrum what does not change: a_lm. */
static envmap_result envmapi_prepared_spectrum(envmapi_prepared *p, int kinked) {
    envmapi_job *job = &p->job;
    int any = 0, kept = job->pool.count + 1; /* a_lm comes first */
    for (int i = 0; i < job->fast; ++i) any |= job->specs[i].kinked == kinked && job->specs[i].L;
    if (!any) return ENVMAP_OK;
    envmap_result result = envmapi_fast_analyse(p->spectra + kinked, job->specs, job->fast, kinked,
                                                1, kinked ? &job->scenes.unlit : &job->scenes.whole,
                                                NULL, &job->desc, &job->pool);
    if (!result) envmapi_pool_free(&job->pool, kept);
    return result;
}

ENVMAPI_BODY void envmap_prepared_free(envmap_prepared *prepared) {
    if (!prepared || !prepared->state) return;
    envmapi_prepared *state = (envmapi_prepared *)prepared->state;
    envmapi_pool_free(&state->job.pool, 0);
    ENVMAP_FREE(prepared->memory, state);
    prepared->state = NULL;
}

ENVMAPI_BODY envmap_result envmap_prepare(envmap_prepared *prepared, const envmap *src,
                                          const envmap_lobe *lobes, int count,
                                          const envmap_filter_desc *desc) {
    envmap_filter_desc own;
    float none = 0;
    if (!prepared || !envmapi_valid(src) || src->slices > 1 || count > 32 ||
        !envmapi_desc(&own, desc))
        return ENVMAP_ERROR_ARGUMENT;
    envmap dst = *src;
    dst.texels = &none, dst.slices = 32, dst.levels = 1;
    own.method = ENVMAP_METHOD_FAST, own.prepared = NULL, own.work.memory = prepared->memory;
    envmapi_prepared *state = (envmapi_prepared *)ENVMAP_MALLOC(prepared->memory, sizeof *state);
    envmap_prepared out = {state, prepared->memory};
    if (!state) return ENVMAP_ERROR_MEMORY;
    memset(state, 0, sizeof *state);
    state->src = *src;
    envmap_result result = envmapi_job_open(&state->job, &dst, &state->src, lobes, count, &own);
    for (int kinked = 0; kinked < 2 && !result; ++kinked)
        result = envmapi_prepared_spectrum(state, kinked);
    if (result) envmap_prepared_free(&out);
    else *prepared = out;
    return result;
}

/* ------------------------------------------------------------------------------------- >>plan --
   What a lobe, a scene and a tolerance need: as few bands, texels and slices as will do.
     in     a filter call without its result       out    envmap_plan
   The scene's a_lm, projected for as many bands as FAST needs, and lambda_l give P_l, the power of
   the result in band l (_power_create). All else is arithmetic:
       bands   sum_(l >= bands) P_l <= tolerance^2 sum P_l                               _power_from
       size    sum P_l e(l h)^2 <= tolerance^2 sum P_l, h the spacing of texels       _lookups_error
       slices  what lookups lose between two slices, weighted with the scene          _slices_error
       error   the bands that FAST leaves out and what its splines lose                 _plan_fill
   docs/plan.md derives them.  Tests: tests/test_plan.c. */

/* The power P_l of a result, l < bands; P[bands] is that of all beyond; gain and scene likewise. */
typedef struct envmapi_power {
    const envmap_lobe *lobe;
    double tolerance, *sh, finest; /* sh: the scene's a_lm, l < known; finest: where it ends */
    double *scene;                 /* |a_l|^2 / (2l+1): a light's is the same in all bands */
    double *gain;                  /* (2l+1) lambda_l^2, the mean of the slices */
    double *P;                     /* scene times gain */
    int known, bands, needed;      /* needed: what P_l says; 0: there is no scene */
    int angles;                    /* of a lone light, where there is none: sixteen a sigma */
    envmapi_sh_points *points;     /* room for the lights */
} envmapi_power;

static double envmapi_rms(double part, double whole) { return whole > 0 ? sqrt(part / whole) : 0; }

/* The result's power in all bands from `from` on. */
static double envmapi_power_from(const envmapi_power *d, int from) {
    double sum = d->P[d->bands];
    for (int l = d->bands - 1; l >= from; --l) sum += d->P[l];
    return sum;
}

/* What the lobe leaves of each band, over at most five slices; 0 where it fails. Of few bands FAST
   knows it already. `own` and its lambda are room to work in. */
static int envmapi_power_lobe(envmapi_power *d, const envmapi_spec *spec, int slices,
                              envmapi_slice *own) {
    int all = spec->L ? spec->slices : d->lobe->p0 == d->lobe->p1 ? 1 : slices;
    int n = all < 5 ? all : 5, known = spec->L && d->bands <= spec->known;
    memset(d->gain, 0, ((size_t)d->bands + 1) * sizeof *d->gain);
    for (int k = 0; k < n; ++k) {
        int at = (2 * k + 1) * all / (2 * n);
        own->p = spec->L ? spec->slice[at].p : envmapi_slice_p(d->lobe, k, n);
        if (!known && !envmapi_slice_lambda(own, d->lobe, d->bands)) return 0;
        const envmapi_slice *slice = known ? spec->slice + at : own;
        for (int l = 0; l < d->bands; ++l)
            d->gain[l] += (2 * l + 1) * slice->lambda[l] * slice->lambda[l] / n;
        d->gain[d->bands] += slice->tail / n;
    }
    return 1;
}

/* The scene's bands, as flat as a light beyond those that are known. */
static void envmapi_power_scene(envmapi_power *d) {
    int known = d->known;
    for (int l = 0; l <= d->bands; ++l) {
        if (l < known) d->scene[l] = envmapi_sh_power(d->sh, known, l) / (2 * l + 1);
        else d->scene[l] = l < d->finest ? (d->scene[known - 1] + d->scene[known - 2]) / 2 : 0;
        d->P[l] = d->scene[l] * d->gain[l];
    }
}

/* a_lm of a scene's lights: added (1), or taken out (-1). */
static void envmapi_power_lights(envmapi_power *d, const envmapi_scene *s, int sign) {
    envmapi_sh_points *n = d->points;
    for (int i = 0; i < s->light_count;) {
        for (n->count = 0; n->count < ENVMAPI_SH_POINTS && i < s->light_count; ++i) {
            for (int c = 0; c < 3; ++c)
                n->e[c][n->count] = sign * ldexp(s->lights[i].value[c], s->in.exponent);
            envmapi_sh_points_add(n, s->lights[i].d);
        }
        envmapi_sh_scatter(d->sh, d->known, n);
    }
}

/* Can the blocks in which the scene was summed stand for its texels? They can where the shortest
   wave is three blocks long, if each block is a texel of a smaller map. */
static int envmapi_power_coarse(const envmapi_power *d, const envmapi_scene *s, const envmap *src) {
    return !s->in.exponent && !envmapi_is_disc(src->mapping) && src->size % s->edge == 0 &&
           d->known * s->edge * envmapi_texel_extent(src) < 2.1;
}

/* a_lm from blocks instead of texels, which need not be read again. Lights, where there are any,
   are not in blocks. Over a block the mean of Y_lm is 1 - l(l+1) h^2/24 of that in its middle. */
static envmap_result envmapi_power_blocks(envmapi_power *d, envmapi_job *job) {
    const envmapi_scene *s = &job->scenes.whole, *unlit = &job->scenes.unlit;
    double h = s->edge * envmapi_texel_extent(job->src);
    size_t count = s->blocks[0].count;
    envmap map = *job->src;
    envmapi_sh_job sh;
    map.texels = (float *)envmapi_pool_get(&job->pool, 4 * count, sizeof(float));
    map.size = s->blocks[0].nv, map.levels = map.slices = 1;
    if (!map.texels) return ENVMAP_ERROR_MEMORY;
    memcpy(map.texels, s->sums, 4 * count * sizeof(float));
    for (int i = 0; i < unlit->light_count; ++i)
        for (int c = 0; c < 3; ++c)
            envmapi_light_block(map.texels, s, unlit->lights + i)[c] -=
                (float)unlit->lights[i].value[c];
    for (size_t i = 0; i < 3 * count; ++i)
        map.texels[i] = map.texels[i / 3 * 4 + i % 3] / s->sums[i / 3 * 4 + 3];
    envmapi_sh_job_of(&sh, &map, 0, d->known, 0.01, &job->desc.work);
    envmap_result result = envmapi_sh_project(d->sh, &sh);
    for (int l = 0, i = 0; l < d->known && !result; ++l)
        for (; i < 3 * (l + 1) * (l + 1); ++i) d->sh[i] /= 1 - l * (l + 1) * h * h / 24;
    if (!result) envmapi_power_lights(d, unlit, 1);
    return result;
}

/* For thin lobes the definition spreads large texels into tents, at last the bilinear radiance:
   a_lm of that, as far as it counts.  Test: the_contrast_of_few_texels_is_the_result_s */
static envmap_result envmapi_power_spread(envmapi_power *d, envmapi_job *job) {
    double h = envmapi_texel_extent(job->src), p = envmapi_slice_p(d->lobe, 0, job->views->slices);
    double tent = envmapi_clamp(2 - envmap_lobe_sigma(d->lobe, p) / h, 0, 1);
    double share = tent * tent + (1 - tent * tent) * envmapi_smooth_step(tent, 0.5, 1);
    envmap src = *job->src, fine;
    envmapi_sh_job sh;
    src.slices = src.levels = 1, fine = src, fine.size *= (int)ceil(h / ENVMAPI_COARSE);
    size_t numbers = 3 * (size_t)(d->known * d->known), floats = envmapi_slice_floats(&fine, 0);
    double *spread = (double *)envmapi_pool_get(&job->pool, numbers, sizeof(double));
    fine.texels = (float *)envmapi_pool_get(&job->pool, floats, sizeof(float));
    if (!spread || !fine.texels) return ENVMAP_ERROR_MEMORY;
    envmapi_sh_job_of(&sh, &fine, 0, d->known, 1e-3, &job->desc.work);
    envmap_result result = envmap_resample(&fine, &src, &job->desc.work);
    if (!result) result = envmapi_sh_project(spread, &sh);
    for (size_t i = 0; i < numbers && !result; ++i) d->sh[i] += share * (spread[i] - d->sh[i]);
    return result;
}

/* Where FAST has no specification the definition interpolates between texels, and the scene has
   nothing finer. Smooth lobes leave little of FAST's last bands (Phong 3 % at 0.7 L), so 0.7 L are
   projected, whose last may be inexact; where lights are taken out of them again, their error has
   to be small beside what remains.  Test: one_light_is_equally_bright_in_every_band. */
static envmap_result envmapi_power_create(envmapi_power *d, envmapi_job *job) {
    const envmapi_spec *spec = job->specs;
    double tolerance = spec->kinked && job->scenes.unlit.light_count ? 0.01 : 0.1;
    d->lobe = job->lobes, d->tolerance = (double)job->desc.tolerance;
    d->known = spec->L ? (int)envmapi_clamp(0.7 * spec->L, 12, ENVMAPI_SH_BANDS) : 24;
    d->bands = spec->L ? spec->known : ENVMAPI_FAST_BANDS;
    d->finest = spec->L ? HUGE_VAL : ENVMAPI_PI / envmapi_texel_extent(job->src);
    size_t numbers = 3 * (size_t)(d->known * d->known), bands = ENVMAPI_FAST_BANDS + 1;
    envmapi_slice *slice = (envmapi_slice *)envmapi_pool_get(&job->pool, 1, sizeof *slice);
    d->sh = (double *)envmapi_pool_get(&job->pool, numbers + 4 * bands, sizeof(double));
    d->points = (envmapi_sh_points *)envmapi_pool_get(&job->pool, 1, sizeof *d->points);
    if (!d->sh || !slice || !d->points) return ENVMAP_ERROR_MEMORY;
    d->scene = d->sh + numbers, d->gain = d->scene + bands, d->P = d->gain + bands;
    slice->lambda = d->P + bands;
    envmapi_sh_job sh;
    envmapi_sh_job_of(&sh, job->src, 0, d->known, spec->L ? tolerance : 1e-3, &job->desc.work);
    if (spec->L && !job->scenes.whole.in.exponent) sh.in = &job->scenes.whole.in;
    int coarse = spec->L && envmapi_power_coarse(d, &job->scenes.whole, job->src);
    envmap_result result = coarse ? envmapi_power_blocks(d, job) : envmapi_sh_project(d->sh, &sh);
    if (!result && !spec->L && envmapi_texel_extent(job->src) > ENVMAPI_COARSE)
        result = envmapi_power_spread(d, job);
    if (result) return result;
    for (int most = ENVMAPI_FAST_BANDS;; d->bands = 2 * d->bands < most ? 2 * d->bands : most) {
        if (!envmapi_power_lobe(d, spec, job->views[0].slices, slice)) return ENVMAP_ERROR_LOBE;
        envmapi_power_scene(d);
        double out = envmapi_rms(d->P[d->bands], envmapi_power_from(d, 0));
        if (!(out > d->tolerance) || d->bands == most) break;
    }
    return envmapi_finite(envmapi_power_from(d, 0)) ? ENVMAP_OK : ENVMAP_ERROR_LOBE;
}

/* ---- how many texels */

/* Along one side linear interpolation of exp(i w t) loses, in the mean square over t,
   5/3 + cos w / 3 - 4 (1 - cos w) / w^2 = w^4 / 120 - ..., here as a fraction to 1 % up to w = 3;
   waves of all directions in u and v together 0.96 of that. */
static double envmapi_bilinear_square(double w2) {
    double lost = 0.96 * w2 * w2 / (120 + 5.24 * w2 + 0.15 * w2 * w2);
    return lost < 5.0 / 3 ? lost : 5.0 / 3;
}

/* Texel spacings h of a map of edge 1, squared, at 4 x 4 points of a quarter of a face (the others
   mirror it), with weights. For unequal sides h is the spacing that loses as much as they do,
   (h_u^4 + h_v^4)/320 + h_u^2 h_v^2/576.
   Over a cube's edge texels do not face each other: beside it, at y along the edge, the neighbour's
   are y h/2 off, which loses 0.0041 l(l+1) / size^3 in the mean square; an octahedral map's folds
   lose 0.5 l(l+1) / size^3; a sphere map's rim is all one point, 1.4 l(l+1) / size^2 (measured). */
typedef struct envmapi_lookups {
    const envmapi_power *power;
    double h2[16], w[16], edges, falls, allowed; /* edges / size^falls is what edges lose */
} envmapi_lookups;

/* light: how much one light rules; it may be where texels are largest, twice the mean at most. */
static void envmapi_lookups_create(envmapi_lookups *t, const envmapi_power *d, int mapping,
                                   double light) {
    static const double lose[ENVMAP_MAPPING_COUNT] = {0.0041, 0, 1.4, 0, 0, 0.5};
    double solid = 0, step = 1e-4, most = 0, mean = 0;
    t->power = d, t->edges = 0, t->falls = mapping == ENVMAP_SPHERE ? 2 : 3;
    for (int l = 1; l < d->bands; ++l) t->edges += l * (l + 1.0) * d->P[l];
    t->edges *= lose[mapping];
    for (int i = 0; i < 16; ++i) {
        double x = (i % 4 + 0.5) / 8, y = ((i / 4) + 0.5) / 8, a[3], u[3], v[3];
        envmapi_direction(a, mapping, 0, x, y);
        envmapi_direction(u, mapping, 0, x + step, y);
        envmapi_direction(v, mapping, 0, x, y + step);
        double hu = pow(envmapi_angle(a, u) / step / envmapi_width(mapping, 1), 2);
        double hv = pow(envmapi_angle(a, v) / step, 2);
        t->h2[i] = sqrt(((hu * hu + hv * hv) / 320 + hu * hv / 576) / 0.00799);
        t->w[i] = envmapi_density(mapping, x, y);
        if (envmapi_is_disc(mapping) && hypot(2 * x - 1, 2 * y - 1) > 1) t->w[i] = 0;
        else most = fmax(most, t->h2[i]);
        solid += t->w[i], mean += t->w[i] * t->h2[i] * t->h2[i];
    }
    for (int i = 0; i < 16; ++i) t->w[i] /= solid;
    most = envmapi_clamp(most / sqrt(mean / solid), 1, 2);
    t->allowed = d->tolerance / (1 + light * (most - 1));
}

/* Relative rms of bilinear lookups in a map of this edge. */
static double envmapi_lookups_error(const envmapi_lookups *t, double size) {
    const envmapi_power *d = t->power;
    double sum = t->edges / pow(size, t->falls), lost[16] = {0}, total = envmapi_power_from(d, 0);
    for (int l = 1; l <= d->bands; ++l)
        for (int i = 0; i < 16; ++i)
            lost[i] += d->P[l] * envmapi_bilinear_square(l * (l + 1.0) * t->h2[i] / (size * size));
    for (int i = 0; i < 16; ++i) sum += t->w[i] * lost[i];
    return envmapi_rms(fmin(sum, 2 * total), total);
}

static int envmapi_lookups_hold(void *user, int size) {
    const envmapi_lookups *t = (const envmapi_lookups *)user;
    return envmapi_lookups_error(t, size) <= t->allowed;
}

/* ---- how many slices */

/* Up to 128 numbers from the first-th on, whose squares add up to the power of the slice at p: of
   as many of the scene's bands as are needed, or where there is no scene, of a lone light at many
   angles. Returns how many; 0 after the last, or where the lobe fails. */
static int envmapi_profile(double *v, const envmapi_power *d, double p, int first) {
    double x[128];
    int bands = first ? 0 : d->needed < 128 ? d->needed : 128;
    if (bands && !envmapi_zonal(v, bands, d->lobe, p)) return 0;
    for (int l = 0; l < bands; ++l) v[l] *= sqrt((2 * l + 1) * d->scene[l]);
    if (d->needed) return bands;
    if (first >= d->angles) return 0;
    for (int j = 0; j < 128; ++j) x[j] = cos(ENVMAPI_PI * (first + j + 0.5) / d->angles);
    envmapi_k_many(v, x, 128, d->lobe, p);
    for (int j = 0; j < 128; ++j) v[j] *= sqrt(sqrt(1 - x[j] * x[j]));
    return 128;
}

/* What lookups between n slices lose, and all that there is, task by task. */
#define ENVMAPI_SLICE_TASKS 16
typedef struct envmapi_slices {
    const envmapi_power *d;
    int n, samples, ends; /* ends: 1 where -p loses what p does; 2 */
    int failed[ENVMAPI_SLICE_TASKS];
    double lost[ENVMAPI_SLICE_TASKS], total[ENVMAPI_SLICE_TASKS];
} envmapi_slices;

/* Sample i at x, in slices from p0; returns its weight, 0 after the last. Most is lost near both
   ends, where a ring closes, and in the half slices there, where lookups clamp. In a scene each end
   has four samples in its half slice, and then one in gaps 0, 1, 2 ..., fewer and fewer: where
   (t (1-t))^2 is 1/30, its mean over the gap. A lone light shows more detail in p: samples that are
   denser towards both ends, and fall in step with no n. */
static double envmapi_slices_sample(double *x, const envmapi_slices *s, int i) {
    double golden = 0.6180339887498949 * (i + 0.5), t = ENVMAPI_PI * (golden - floor(golden));
    double half = (s->n - 1) / 2.0, count = 0.125;
    if (!s->d->needed) {
        *x = s->n * (0.5 - 0.5 * cos(t));
        return i < s->samples ? sin(t) : 0;
    }
    int j = i / s->ends - 4, gap = 0, next = 1;
    *x = (j + 4.5) / 8;
    if (j >= 0) {
        for (; j > 0 && next < half; --j) gap = next, next += 1 + gap;
        count = j ? 0 : fmin(next, half) - gap;
        *x = 0.5 + gap + (next - gap - 1) / 2 + 0.2403;
    }
    if (i % s->ends) *x = s->n - *x;
    return count;
}

static void envmapi_task_slices(void *context, int task) {
    envmapi_slices *s = (envmapi_slices *)context;
    const envmap_lobe *lobe = s->d->lobe;
    double k[128], k_low[128], k_high[128], lost = 0, total = 0, x, weight;
    for (int i = task, n = s->n; (weight = envmapi_slices_sample(&x, s, i)) > 0;
         i += ENVMAPI_SLICE_TASKS) {
        double p = (double)lobe->p0 + ((double)lobe->p1 - (double)lobe->p0) * x / n;
        double at = envmapi_clamp(x - 0.5, 0, n - 1);
        int low = (int)at, high = low + 1 < n ? low + 1 : low;
        double p_low = envmapi_slice_p(lobe, low, n), p_high = envmapi_slice_p(lobe, high, n);
        for (int first = 0, count; (count = envmapi_profile(k, s->d, p, first)); first += count) {
            const double *next = high > low ? k_high : k_low;
            s->failed[task] |= !envmapi_profile(k_low, s->d, p_low, first);
            s->failed[task] |= high > low && !envmapi_profile(k_high, s->d, p_high, first);
            for (int j = 0; j < count && !s->failed[task]; ++j) {
                double off = k[j] - k_low[j] - (at - low) * (next[j] - k_low[j]);
                lost += weight * off * off, total += weight * k[j] * k[j];
            }
        }
    }
    s->lost[task] = lost, s->total[task] = total;
}

/* Relative rms, over all p, of what lookups between n slices lose; 0 where the lobe fails. */
static double envmapi_slices_error(const envmapi_power *d, int n, const envmap_work *work) {
    const envmap_lobe *lobe = d->lobe;
    envmapi_slices s;
    double lost = 0, total = 0;
    memset(&s, 0, sizeof s);
    s.d = d, s.n = n, s.samples = n < 24 ? 96 : n < 256 ? 4 * n : 1024;
    s.ends = lobe->kind == ENVMAP_LOBE_BANKS && !(fabsf(lobe->p0 + lobe->p1) > 0) ? 1 : 2;
    envmapi_run_all(work, envmapi_task_slices, &s, ENVMAPI_SLICE_TASKS);
    for (int i = 0; i < ENVMAPI_SLICE_TASKS; ++i) {
        lost += s.lost[i], total += s.total[i];
        if (s.failed[i]) return 0;
    }
    return envmapi_rms(lost, total);
}

/* The fewest slices n, to 2 %, for which that is within the tolerance. It is about 1/2n, its
   logarithm about a line in that of n: a secant leads to 1 % more than where it meets the
   tolerance; halves, where that takes long. */
static int envmapi_slices_needed(const envmapi_power *d, const envmap_work *work) {
    int low = 0, high = ENVMAPI_SLICE_LIMIT, n = (int)envmapi_clamp(0.5 / d->tolerance, 16, 1024);
    double off = 0, was, slope = 1.05;
    for (int tried = 0, last = 0; high - low > 1 + low / 12; ++tried) {
        was = off, off = log(envmapi_slices_error(d, n, work) / d->tolerance);
        if (off <= 0 && off > -0.02) return n;
        if (last) slope = envmapi_clamp((was - off) / log((double)n / last), 0.5, 4);
        if (off > 0) low = n;
        else high = n;
        double next = 1.01 * n * exp(off / slope);
        if (tried > 8 || !envmapi_finite(next)) next = low + (high - low) / 2;
        last = n, n = (int)envmapi_clamp(ceil(next), low + 1, high - 1);
    }
    return high - low > 1 ? n : high;
}

ENVMAPI_BODY int envmap_lobe_slices(const envmap_lobe *lobe, double tolerance) {
    envmapi_power light;
    if (!envmapi_lobe_sound(lobe) || !envmapi_finite(tolerance) || tolerance < 0) return 0;
    if (lobe->kind == ENVMAP_LOBE_MIRROR || lobe->p0 == lobe->p1) return 1;
    light.lobe = lobe, light.tolerance = tolerance, light.needed = 0;
    double sigma = lobe->kind == ENVMAP_LOBE_TABLE ? 0 : ENVMAPI_PI; /* its rows may be unrelated */
    for (int k = 0; k < 8; ++k)
        sigma = fmin(sigma, envmap_lobe_sigma(lobe, envmapi_slice_p(lobe, k, 8)));
    light.angles = 128 * (int)envmapi_clamp(ceil(ENVMAPI_PI / (8 * fmax(sigma, 1e-3))), 2, 16);
    envmap_work serial;
    memset(&serial, 0, sizeof serial);
    return envmapi_slices_needed(&light, &serial);
}

/* ---- the call */

static envmap_result envmapi_plan_fill(envmap_plan *out, envmapi_job *job) {
    const envmapi_spec *spec = job->specs;
    const envmapi_scenes *scenes = &job->scenes;
    const envmap *dst = job->views;
    envmapi_power d;
    envmapi_lookups lookups;
    envmap_result result = envmapi_power_create(&d, job);
    if (result) return result;
    double total = envmapi_power_from(&d, 0);
    while (out->bands > 1 &&
           envmapi_rms(envmapi_power_from(&d, out->bands - 1), total) <= d.tolerance)
        --out->bands;
    out->nine = envmapi_rms(envmapi_power_from(&d, 3), total);
    out->contrast = envmapi_rms(envmapi_power_from(&d, 1), d.P[0]);
    double light = spec->L ? envmapi_contrast_at(&scenes->whole, out->bands).kappa : 0;
    envmapi_lookups_create(&lookups, &d, dst->mapping, light);
    out->lookup = envmapi_lookups_error(&lookups, dst->size);
    if (envmapi_texel_extent(job->src) * 2 <= envmap_lobe_sigma(d.lobe, 0))
        out->size = envmapi_least(ENVMAPI_SIZE_LIMIT, envmapi_lookups_hold, &lookups);
    d.needed = out->bands;
    if (d.lobe->p0 < d.lobe->p1 || d.lobe->p0 > d.lobe->p1)
        out->slices = envmapi_slices_needed(&d, &job->desc.work);
    if (spec->L && spec->kinked) out->lights = scenes->unlit.light_count;
    if (out->lights) envmapi_power_lights(&d, &scenes->unlit, -1), envmapi_power_scene(&d);
    out->method = ENVMAP_METHOD_FAST;
    double lost = envmapi_power_from(&d, spec->L); /* bands beyond those that FAST keeps, and */
    for (int l = 0; l < spec->L; ++l)              /* what four splines lose of these */
        lost += 4 * pow(envmapi_band_error(l, spec->h), 2) * d.P[l];
    if (spec->L) out->error = envmapi_rms(lost, total);
    return ENVMAP_OK;
}

ENVMAPI_BODY envmap_result envmap_filter_plan(envmap_plan *plan, const envmap *dst,
                                              const envmap *src, const envmap_lobe *lobe,
                                              const envmap_filter_desc *desc) {
    envmap_filter_desc fast;
    envmap shape;
    envmap_plan out;
    float none = 0;
    memset(&out, 0, sizeof out);
    if (!plan || !dst || !src || !envmapi_desc(&fast, desc)) return ENVMAP_ERROR_ARGUMENT;
    shape = *dst, shape.texels = &none, fast.method = ENVMAP_METHOD_FAST;
    envmapi_job *job = (envmapi_job *)ENVMAP_MALLOC(fast.work.memory, sizeof *job);
    if (!job) return ENVMAP_ERROR_MEMORY;
    envmap_result result = envmapi_job_open(job, &shape, src, lobe, 1, &fast);
    out.slices = 1, out.bands = ENVMAPI_FAST_BANDS;
    if (!result) { /* as large as it takes for texels no larger than src's */
        shape.size = src->size;
        double size = src->size * envmapi_texel_extent(&shape) / envmapi_texel_extent(src);
        out.size = (int)envmapi_clamp(ceil(size - 1e-6), 1, ENVMAPI_SIZE_LIMIT);
        if (job->specs[0].tail) job->specs[0].L = 0;
        if (lobe->kind != ENVMAP_LOBE_MIRROR && envmapi_job_constant(job, 0))
            out.size = out.bands = 1, out.method = ENVMAP_METHOD_FAST;
        else if (lobe->kind != ENVMAP_LOBE_MIRROR) result = envmapi_plan_fill(&out, job);
    }
    if (!result) *plan = out;
    envmapi_pool_free(&job->pool, 0);
    ENVMAP_FREE(fast.work.memory, job);
    return result;
}

/* ------------------------------------------------------------------------------- >>materials --
   In: a surface, which is a BRDF and n, t, v. Out: its outgoing radiance, or what turns prefiltered
   maps into it: lobes, axes, factors, taps.
     L = sum of f_r(v,l) (n.l) L_in w over texels    envmap_radiance, eq. 1 itself
     f_r (n.l) = sum of factors times lobes          envmap_fit_brdf; summed by envmap_fit_lookup
     integral of f_r (n.l) dl for GGX                envmap_ggx_split_sum, _table, _multiple
     an elongated lobe = sum of round ones           envmap_fan; summed by envmap_lookup_fan
   Tests: tests/test_materials.c; eq_1_of_lambert_is_the_diffuse_map,
   ggx_terms_agree_with_quadrature_over_normals, a_fan_of_round_lobes_is_elliptical. */

/* N and V, the unit normal and view; 0 where one of them is missing, zero or not finite. */
static int envmapi_surface(double N[3], double V[3], const float n[3], const float v[3]) {
    double size_n = 0, size_v = 0;
    for (int i = 0; n && v && i < 3; ++i)
        size_n += fabs((double)n[i]), size_v += fabs((double)v[i]);
    if (!(size_n * size_v > 0) || !envmapi_finite(size_n * size_v)) return 0;
    envmapi_unit_float(N, n);
    envmapi_unit_float(V, v);
    return 1;
}

/* f_r (n.l); 0 below the horizon, and *bad where f_r is none. */
static void envmapi_brdf_cosine(double f[3], const envmap_brdf *brdf, const double v[3],
                                const double l[3], int *bad) {
    f[0] = f[1] = f[2] = 0;
    if (!(l[2] > 0)) return;
    brdf->function(f, v, l, brdf->user);
    for (int c = 0; c < 3; ++c) {
        *bad |= !envmapi_finite(f[c]) || f[c] < 0;
        f[c] *= l[2];
    }
}

/* Tasks write `count` numbers to *stage. They go to `out` when all is done and all are finite. */
static envmap_result envmapi_run_staged(float *out, float **stage, size_t count,
                                        const envmap_work *work, envmap_task *task, void *context,
                                        int tasks) {
    size_t bytes = count * sizeof *out;
    *stage = count < SIZE_MAX / 8 ? (float *)ENVMAP_MALLOC(work->memory, bytes) : NULL;
    if (!*stage) return ENVMAP_ERROR_MEMORY;
    envmap_result result = envmapi_run(work, task, context, tasks);
    for (size_t i = 0; !result && i < count; ++i)
        if (!envmapi_finite((double)(*stage)[i])) result = ENVMAP_ERROR_LOBE;
    if (!result) result = envmapi_tell(&work->progress, 1);
    if (!result) memcpy(out, *stage, bytes);
    ENVMAP_FREE(work->memory, *stage);
    return result;
}

/* ---- eq. 1 ---- */

/* What the tasks of envmap_radiance share: a task is a frame. */
typedef struct envmapi_views {
    const envmapi_source *source;
    const envmap_brdf *brdf;
    const envmap_frame *frames;
    float *rgb; /* staged; infinite where the model failed */
} envmapi_views;

static void envmapi_view(void *context, int i) {
    const envmapi_views *views = (const envmapi_views *)context;
    const envmapi_source *s = views->source;
    const envmap_frame *frame = views->frames + i;
    double n[3], t[3], b[3], d[3], f[3], rgb[3] = {0, 0, 0};
    int bad = 0;
    envmapi_surface(n, d, frame->n, frame->v);
    envmapi_tangents(t, b, n, frame->t);
    const double v[3] = {envmapi_dot(d, t), envmapi_dot(d, b), envmapi_dot(d, n)};
    for (size_t k = 0; v[2] > 0 && k < s->count; ++k) {
        d[0] = s->x[k], d[1] = s->y[k], d[2] = s->z[k];
        double l[3] = {0, 0, envmapi_dot(d, n)};
        if (!(l[2] > 0)) continue;
        l[0] = envmapi_dot(d, t), l[1] = envmapi_dot(d, b);
        envmapi_brdf_cosine(f, views->brdf, v, l, &bad);
        const float *texel = envmapi_source_rgb(s, k);
        for (int c = 0; c < 3; ++c) rgb[c] += f[c] * s->w[k] * (double)texel[c];
    }
    for (int c = 0; c < 3; ++c)
        views->rgb[3 * i + c] =
            bad || !envmapi_finite(rgb[c]) ? (float)HUGE_VAL : envmapi_to_float(rgb[c]);
}

ENVMAPI_BODY envmap_result envmap_radiance(float *rgb, const envmap *map, const envmap_brdf *brdf,
                                           const envmap_frame *frames, int count,
                                           const envmap_work *work) {
    envmap_work set;
    envmapi_source source;
    envmapi_views views = {&source, brdf, frames, NULL};
    if (!rgb || !envmapi_valid(map) || !brdf || !brdf->function || !frames || count < 1 ||
        count > INT_MAX / 4 || !envmapi_work_of(&set, work))
        return ENVMAP_ERROR_ARGUMENT;
    for (int i = 0; i < count; ++i) {
        const float *t = frames[i].t;
        double n[3], v[3], sum = (double)t[0] + (double)t[1] + (double)t[2];
        if (!envmapi_surface(n, v, frames[i].n, frames[i].v) || !envmapi_finite(sum))
            return ENVMAP_ERROR_ARGUMENT;
    }
    if (!envmapi_radiance_ok(map, 1)) return ENVMAP_ERROR_RADIANCE;
    envmap_result result = envmapi_source_create(&source, map, 0, set.memory);
    if (!result)
        result = envmapi_run_staged(rgb, &views.rgb, 3 * (size_t)count, &set, envmapi_view, &views,
                                    count);
    envmapi_source_free(&source, set.memory);
    return result;
}

/* ---- Fresnel: with (a + ib)^2 = (n + ik)^2 - sin^2 and q = sin tan, of the light's two halves
     s: ((a-c)^2 + b^2) / ((a+c)^2 + b^2)        p: s ((a-q)^2 + b^2) / ((a+q)^2 + b^2)
   With k = 0, past the critical angle, a = 0, and all is reflected. ---- */

ENVMAPI_BODY double envmap_fresnel(double cosine, double n, double k) {
    if (!(n > 0 && n < 1e9 && k >= 0 && k < 1e9) || !envmapi_finite(cosine + n + k)) return 0;
    double c = envmapi_clamp(cosine, 0, 1);
    double x = (n - 1) * (n + 1) - k * k + c * c, y = 2 * n * k; /* the square's two parts */
    double root = sqrt(x * x + y * y), aa = root + x > 0 ? (root + x) / 2 : 0;
    double a = sqrt(aa), bb = root - aa, below = (a + c) * (a + c) + bb;
    if (!(below > 0)) return n < 1 || n > 1 || k > 0; /* grazing, unless there is no surface */
    double s = ((a - c) * (a - c) + bb) / below;
    if (!(c > 0)) return s;
    double q = (1 - c * c) / c;
    return s * (1 + ((a - q) * (a - q) + bb) / ((a + q) * (a + q) + bb)) / 2;
}

ENVMAPI_BODY double envmap_fresnel_schlick(double cosine, double f0) {
    if (!(f0 >= 0 && f0 <= 1) || !envmapi_finite(cosine)) return 0;
    double m = 1 - envmapi_clamp(cosine, 0, 1);
    return f0 + (1 - f0) * m * m * m * m * m;
}

/* ---- fits, slice by slice of c = n.v; v lies in the plane of x and n = z, at -theta from n.
     lobe_i(angle) = mean of f_r (n.l), less the other lobes, on the ring at that angle about the
                     axis, which stands at psi_i = m_i theta from n     envmapi_fit_ring
     m_i           = that with the largest integral of lobe_i^2         envmapi_fit_axis, by _gain
     factor_i      = least squares, not negative                        envmapi_fit_factors
   Lobes take turns, eight times (envmapi_fit_slice); then each row is scaled to the integral 1. */

#define ENVMAPI_RING 32

/* What tasks share; a task is a slice, and fills in the last two lines for itself. */
typedef struct envmapi_fitting {
    const envmap_brdf *brdf;
    envmap_fit *fit;
    envmap_lobe table;            /* fit->table as a lobe */
    int rows;                     /* of each lobe of the fit: slices, or 1 */
    double ring[ENVMAPI_RING][2]; /* cos and sin of phi; of a ring, symmetry asks half */
    int slice, bad;
    double v[3], theta, axis[3][2]; /* sin and cos of each psi */
} envmapi_fitting;

static void envmapi_fit_turn(envmapi_fitting *f, int lobe, double m) {
    f->axis[lobe][0] = sin(m * f->theta), f->axis[lobe][1] = cos(m * f->theta);
}

static envmapi_fitting envmapi_fit_of(const void *context, int slice) {
    envmapi_fitting f = *(const envmapi_fitting *)context;
    double c = (slice + 0.5) / f.fit->slices;
    f.v[0] = -sqrt(1 - c * c), f.v[2] = c, f.theta = acos(c), f.slice = slice;
    for (int i = 0; i < f.fit->lobes; ++i)
        envmapi_fit_turn(&f, i, (double)f.fit->axis[i * f.fit->slices + slice]);
    return f;
}

/* Lobe i in direction l. */
static double envmapi_fit_k(const envmapi_fitting *f, int i, const double l[3]) {
    int row = i * f->rows + (f->rows > 1 ? f->slice : 0);
    double x = l[0] * f->axis[i][0] + l[2] * f->axis[i][1];
    return envmapi_table_row(&f->table, row, envmapi_acos(x));
}

/* Node j of the ring at the angle of cosine c and sine s about a lobe's axis: l, and f_r (n.l). */
static void envmapi_fit_node(double f_r[3], double l[3], envmapi_fitting *f, int lobe, double c,
                             double s, int j) {
    const double *axis = f->axis[lobe];
    l[0] = c * axis[0] + s * f->ring[j][0] * axis[1], l[1] = s * f->ring[j][1];
    l[2] = c * axis[1] - s * f->ring[j][0] * axis[0];
    envmapi_brdf_cosine(f_r, f->brdf, f->v, l, &f->bad);
}

/* The mean over channels, too. */
static double envmapi_fit_ring(envmapi_fitting *f, int lobe, double angle) {
    double sum = 0, l[3], f_r[3], c = cos(angle), s = sin(angle);
    for (int j = 0; j < ENVMAPI_RING; ++j) {
        envmapi_fit_node(f_r, l, f, lobe, c, s, j);
        sum += (f_r[0] + f_r[1] + f_r[2]) / 3;
        for (int other = 0; other < f->fit->lobes; ++other)
            if (other != lobe) sum -= envmapi_fit_k(f, other, l);
    }
    return sum > 0 ? sum / ENVMAPI_RING : 0;
}

static double envmapi_fit_gain(envmapi_fitting *f, int lobe, double m) {
    double gain = 0;
    envmapi_fit_turn(f, lobe, m);
    for (int i = 0; i < 128; ++i) { /* close together where a peak would be */
        double u = (i + 0.5) / 128, angle = ENVMAPI_PI * u * u;
        double k = envmapi_fit_ring(f, lobe, angle);
        gain += k * k * sin(angle) * u;
    }
    return gain;
}

/* The best m within half of where it starts, by steps to the better side, each half of the last. */
static void envmapi_fit_axis(envmapi_fitting *f, int lobe) {
    double m = 1 - lobe, gain[3] = {0, envmapi_fit_gain(f, lobe, m), 0};
    for (double step = 0.25; step > 0.005; step /= 2) {
        gain[0] = envmapi_fit_gain(f, lobe, m - step);
        gain[2] = envmapi_fit_gain(f, lobe, m + step);
        int best = gain[0] > gain[1] ? 0 : gain[2] > gain[1] ? 2 : 1;
        m += (best - 1) * step, gain[1] = gain[best];
    }
    f->fit->axis[lobe * f->fit->slices + f->slice] = (float)m;
    envmapi_fit_turn(f, lobe, (double)(float)m);
}

static void envmapi_fit_slice(void *context, int slice) {
    static const int order[3] = {1, 0, 2}; /* diffuse first, or gloss would take all of it */
    envmapi_fitting f = envmapi_fit_of(context, slice);
    envmap_fit *fit = f.fit;
    for (int at = 0; at < (fit->lobes > 1 ? 24 : 3); ++at) {
        int lobe = order[at % 3];
        if (lobe >= fit->lobes) continue;
        float *row = fit->table + (lobe * fit->slices + slice) * fit->size;
        if (at < 6 && lobe != 1) envmapi_fit_axis(&f, lobe);
        for (int i = 0; i < fit->size; ++i)
            row[i] = (float)envmapi_fit_ring(&f, lobe, ENVMAPI_PI * i / (fit->size - 1));
    }
    fit->error[slice] = f.bad ? (float)HUGE_VAL : 0; /* refuses the fit in the end */
}

/* The integrals over l of the products of any two of: lobes (0 .. 2), channels of f_r (n.l)
   (3 .. 5), 1. They hold the channels' normal equations, and all that f_r (n.l) reflects. */
static void envmapi_fit_gather(double gram[7][7], envmapi_fitting *f) {
    double l[3], q[7] = {0, 0, 0, 0, 0, 0, 1};
    int rings = f->fit->size - 1;
    memset(gram, 0, 7 * sizeof *gram);
    for (int i = 0; i < rings * ENVMAPI_RING; ++i) {
        double angle = ENVMAPI_PI * (i / ENVMAPI_RING + 0.5) / rings, s = sin(angle);
        double w = s * 2 * ENVMAPI_PI / rings * ENVMAPI_PI / ENVMAPI_RING;
        envmapi_fit_node(q + 3, l, f, 0, cos(angle), s, i % ENVMAPI_RING);
        for (int a = 0; a < f->fit->lobes; ++a) q[a] = envmapi_fit_k(f, a, l);
        for (int a = 0; a < 7; ++a)
            for (int b = 0; b < 7; ++b) gram[a][b] += w * q[a] * q[b];
    }
}

/* x >= 0 by coordinate descent, which least squares with so few unknowns allows; then all of them
   together as much as f_r (n.l) reflects, as constant light shows energy and not squares. */
static void envmapi_fit_solve(double x[3], double gram[7][7], int channel) {
    const double *right = gram[3 + channel];
    x[0] = x[1] = x[2] = 0;
    for (int turn = 0; turn < 200; ++turn)
        for (int i = 0; i < 3; ++i) {
            double left = right[i] - envmapi_dot(gram[i], x) + gram[i][i] * x[i];
            x[i] = left > 0 && gram[i][i] > 0 ? left / gram[i][i] : 0;
        }
    double all = x[0] + x[1] + x[2];
    for (int i = 0; all > 0 && i < 3; ++i) x[i] *= right[6] / all;
}

static void envmapi_fit_factors(void *context, int slice) {
    envmapi_fitting f = envmapi_fit_of(context, slice);
    envmap_fit *fit = f.fit;
    double gram[7][7], x[3], left = 0, square = 0;
    envmapi_fit_gather(gram, &f);
    for (int c = 3; c < 6; ++c) {
        envmapi_fit_solve(x, gram, c - 3);
        square += gram[c][c], left += gram[c][c];
        for (int a = 0; a < fit->lobes; ++a) {
            fit->factor[3 * (a * fit->slices + slice) + c - 3] = (float)x[a];
            left += x[a] * (envmapi_dot(gram[a], x) - 2 * gram[c][a]);
        }
    }
    fit->error[slice] += square > 0 ? (float)sqrt(left > 0 ? left / square : 0) : 0;
}

/* A row of the table: the sum of `count` rows, its integral 1; uniform where there is nothing. */
static void envmapi_fit_normalise(float *to, const float *rows, int size, int count) {
    envmap_lobe lobe = envmap_lobe_table(to, size, 1, 0, 0);
    for (int i = 0; i < size; ++i) {
        double sum = 0;
        for (int r = 0; r < count; ++r) sum += (double)rows[r * size + i];
        to[i] = (float)sum;
    }
    double integral = envmapi_lobe_integral(&lobe, 0);
    for (int i = 0; i < size; ++i)
        to[i] = (float)(integral > 0 ? (double)to[i] / integral : 1 / (4 * ENVMAPI_PI));
}

static int envmapi_fit_fields_ok(const envmap_fit *fit) {
    return fit && fit->lobes >= 1 && fit->lobes <= 3 && fit->slices >= 1 && fit->slices <= 256 &&
           fit->size >= 16 && fit->size <= 65536 && (fit->flat == 0 || fit->flat == 1);
}

/* The table holds a row a slice until all lobes are known; flat fits add these up, in place. */
static envmap_result envmapi_fit_run(envmap_fit *fit, const envmap_brdf *brdf,
                                     const envmap_work *work) {
    int n = fit->slices, all = fit->lobes * n, merged = fit->flat ? n : 1, size = fit->size;
    double sum = 0;
    envmapi_fitting f;
    memset(&f, 0, sizeof f);
    f.brdf = brdf, f.fit = fit, f.rows = n;
    f.table = envmap_lobe_table(fit->table, size, all, 0, 1);
    for (int j = 0; j < ENVMAPI_RING; ++j) {
        double phi = ENVMAPI_PI * (j + 0.5) / ENVMAPI_RING;
        f.ring[j][0] = cos(phi), f.ring[j][1] = sin(phi);
    }
    for (int i = 0; i < all; ++i) fit->axis[i] = (float)(1 - i / n);
    envmap_result result = envmapi_run(work, envmapi_fit_slice, &f, n);
    if (result) return result;
    for (int i = 0; i < all / merged; ++i)
        envmapi_fit_normalise(fit->table + i * size, fit->table + i * merged * size, size, merged);
    f.rows = n / merged;
    envmapi_run_all(work, envmapi_fit_factors, &f, n);
    for (int i = 0; i < 3 * all; ++i) sum += (double)fit->factor[i];
    for (int i = 0; sum > 0 && i < n; ++i) sum += (double)fit->error[i];
    return envmapi_finite(sum) && sum > 0 ? envmapi_tell(&work->progress, 1) : ENVMAP_ERROR_LOBE;
}

ENVMAPI_BODY envmap_result envmap_fit_brdf(envmap_fit *fit, const envmap_brdf *brdf,
                                           const envmap_work *work) {
    envmap_work how;
    if (!fit || !brdf || !brdf->function || !envmapi_work_of(&how, work))
        return ENVMAP_ERROR_ARGUMENT;
    envmap_fit out = *fit;
    if (!out.lobes) out.lobes = 1;
    if (!out.slices) out.slices = 16;
    if (!out.size) out.size = 257;
    if (!envmapi_fit_fields_ok(&out)) return ENVMAP_ERROR_ARGUMENT;
    size_t n = (size_t)out.slices, all = (size_t)out.lobes * n, table = all * (size_t)out.size;
    size_t bytes = (table + 4 * all + n) * sizeof(float);
    out.table = (float *)ENVMAP_MALLOC(out.memory, bytes);
    if (!out.table) return ENVMAP_ERROR_MEMORY;
    memset(out.table, 0, bytes);
    out.axis = out.table + table, out.factor = out.axis + all, out.error = out.factor + 3 * all;
    envmap_result result = envmapi_fit_run(&out, brdf, &how);
    if (result) ENVMAP_FREE(out.memory, out.table);
    else *fit = out;
    return result;
}

ENVMAPI_BODY void envmap_fit_free(envmap_fit *fit) {
    if (!fit) return;
    if (fit->table) ENVMAP_FREE(fit->memory, fit->table);
    fit->table = fit->axis = fit->factor = fit->error = NULL;
}

ENVMAPI_BODY envmap_lobe envmap_fit_lobe(const envmap_fit *fit, int i) {
    int bad = !envmapi_fit_fields_ok(fit) || !fit->table || i < 0 || i >= fit->lobes;
    int rows = bad || fit->flat ? 1 : fit->slices;
    return envmap_lobe_table(bad ? NULL : fit->table + (size_t)(i * rows) * (size_t)fit->size,
                             bad ? 0 : fit->size, rows, 0, rows > 1 ? 1.0f : 0.0f);
}

/* Entry s of a row of numbers `stride` apart, linear between two. */
static double envmapi_entry(const float *row, int stride, double s) {
    const float *low = row + stride * (int)s;
    return (double)low[0] + (s > (int)s ? (s - (int)s) * (double)(low[stride] - low[0]) : 0);
}

ENVMAPI_BODY void envmap_fit_lookup(float rgb[3], const envmap_fit *fit, const envmap *maps,
                                    const float n[3], const float v[3]) {
    double N[3], V[3], T[3], B[3], c = 0, sum[3] = {0, 0, 0};
    if (!rgb) return;
    if (envmapi_fit_fields_ok(fit) && fit->table && maps && envmapi_surface(N, V, n, v))
        c = envmapi_dot(N, V);
    if (c > 0) envmapi_tangents(T, B, N, v);
    for (int i = 0; c > 0 && i < fit->lobes; ++i) {
        const float *factor = fit->factor + 3 * i * fit->slices;
        double at = envmapi_slice_at(c, 0, 1, fit->slices);
        double psi = envmapi_angle(N, V) * envmapi_entry(fit->axis + i * fit->slices, 1, at);
        float dir[3], light[3]; /* the axis, in the plane of n and v, away from v */
        for (int j = 0; j < 3; ++j) dir[j] = (float)(cos(psi) * N[j] - sin(psi) * T[j]);
        envmap_lookup_slice(light, maps + i, dir, (float)c, 0);
        for (int j = 0; j < 3; ++j) sum[j] += (double)light[j] * envmapi_entry(factor + j, 3, at);
    }
    for (int j = 0; j < 3; ++j) rgb[j] = envmapi_to_float(sum[j]);
}

/* ---- GGX, over half vectors h = (t cos phi, t sin phi, 1) / sqrt(1 + t^2), v = (s, 0, c):
     E  = integral of D G2 F (v.h) / c over h
     G2 = 2 l_z c / (l_z to_v + c to_l),  to_x = sqrt(alpha^2 + (1 - alpha^2) x_z^2)     [Heitz14]
     D h_z dh = du dphi / 2pi,  t^2 = alpha^2 u / (1 - u)
   The light is above the horizon where c t < s cos phi + sqrt(s^2 cos^2 phi + c^2). A column of one
   phi ends there, so that what is integrated along it is smooth (_column). Its variable y,
   t = alpha y / (1 - y), makes all of it rational. Gauss nodes lie closest at the ends of columns
   and where cos phi is 0, as grazing views change most there (_nodes).
   16 columns of 24 nodes: of 16 nodes, ggx_terms_agree_with_quadrature_over_normals fails. ---- */

/* Nodes of the panels of [0, 1] at 1 - q^3, close to 1, with weights. */
static void envmapi_ggx_nodes(double *nodes, double *weights, int panels) {
    for (int i = 0; i < 8 * panels; ++i) {
        double q, from = (i >> 3) / (double)panels, w;
        w = envmapi_gauss(&q, i & 7, from, from + 1.0 / panels);
        nodes[i] = 1 - q * q * q, weights[i] = 3 * w * q * q;
    }
}

/* Adds the column, x = s cos phi, times 1 - (1 - v.h)^5 and (1 - v.h)^5. */
static void envmapi_ggx_column(double sums[2], const double nodes[24], const double weights[24],
                               double c, double alpha, double x, double weight) {
    double aa = alpha * alpha, to_v = sqrt(aa + (1 - aa) * c * c);
    double r = sqrt(x * x + c * c) + fabs(x);
    double end = x > 0 ? r / (r + alpha * c) : c / (c + alpha * r);
    for (int i = 0; i < 24; ++i) {
        double y = end * nodes[i], z = 1 - y, n = y * y + z * z;
        double vh = alpha * x * y + c * z, hh = aa * y * y + z * z; /* h: (alpha y, z) */
        double h = 1 / sqrt(hh), l = 2 * vh * z * h * h - c, to_l = sqrt(aa + (1 - aa) * l * l);
        double m = 1 - vh * h, fresnel = m * m * m * m * m;
        double w = weight * end * weights[i] * 4 * y * vh * l / (n * n * (l * to_v + c * to_l));
        sums[0] += w * (1 - fresnel), sums[1] += w * fresnel;
    }
}

ENVMAPI_BODY void envmap_ggx_split_sum(double *scale, double *bias, double cosine, double alpha) {
    double sums[2] = {0, 0}, phi[8], weight[8], y[24], w[24];
    int columns = envmapi_finite(cosine) && envmapi_finite(alpha) ? 16 : 0;
    double c = envmapi_clamp(cosine, 1e-12, 1), a = envmapi_clamp(alpha, 1e-4, 1);
    envmapi_ggx_nodes(phi, weight, 1);
    envmapi_ggx_nodes(y, w, 3);
    for (int i = 0; i < columns; ++i) {
        double x = sqrt(1 - c * c) * cos(ENVMAPI_PI / 2 * phi[i / 2]);
        envmapi_ggx_column(sums, y, w, c, a, i & 1 ? -x : x, weight[i / 2] / 2);
    }
    if (scale) *scale = sums[0];
    if (bias) *bias = sums[1];
}

ENVMAPI_BODY double envmap_ggx_multiple(double f0, double scale, double bias) {
    double lost = 1 - scale - bias, f = f0 + (1 - f0) / 21;
    if (!(f0 >= 0 && f0 <= 1 && scale >= 0 && bias >= 0 && lost >= 0)) return 0;
    return 1 - f * lost > 0 ? (f0 * scale + bias) * f * lost / (1 - f * lost) : 0;
}

typedef struct envmapi_ggx_rows {
    float *values;
    int size;
} envmapi_ggx_rows;

static void envmapi_ggx_row(void *context, int y) {
    const envmapi_ggx_rows *rows = (const envmapi_ggx_rows *)context;
    double roughness = (y + 0.5) / rows->size, scale, bias;
    float *to = rows->values + 2 * y * rows->size;
    for (int x = 0; x < rows->size; ++x) {
        envmap_ggx_split_sum(&scale, &bias, (x + 0.5) / rows->size, roughness * roughness);
        *to++ = (float)scale, *to++ = (float)bias;
    }
}

ENVMAPI_BODY envmap_result envmap_ggx_table(float *values, int size, const envmap_work *work) {
    envmap_work how;
    envmapi_ggx_rows rows = {NULL, size};
    if (!values || size < 1 || size > 1024 || !envmapi_work_of(&how, work))
        return ENVMAP_ERROR_ARGUMENT;
    return envmapi_run_staged(values, &rows.values, 2 * (size_t)size * (size_t)size, &how,
                              envmapi_ggx_row, &rows, size);
}

ENVMAPI_BODY double envmap_roughness_level(double roughness, int levels, double bend) {
    if (!envmapi_finite(roughness) || !envmapi_finite(bend) || levels < 1) return 0;
    double r = envmapi_clamp(roughness, 0, 1), q = envmapi_clamp(bend, 0, 1);
    return (levels - 1) * r * (1 + q - q * r);
}

/* The smaller root of q r^2 - (1+q) r + y, in the form that stays exact for q -> 0. */
ENVMAPI_BODY double envmap_level_roughness(double level, int levels, double bend) {
    if (!envmapi_finite(level) || !envmapi_finite(bend) || levels < 2) return 0;
    double y = envmapi_clamp(level / (levels - 1), 0, 1), q = envmapi_clamp(bend, 0, 1);
    double root = (1 + q) * (1 + q) - 4 * q * y;
    return 2 * y / (1 + q + sqrt(root > 0 ? root : 0));
}

/* ---- fans: a comb of Gaussian weights, variance s^2, spacing h, under a Gaussian lobe. By
   Poisson's sum its first alias is exp(-2 pi^2 u^2 / h^2) of the wanted Gaussian at every point,
   twice. ---- */

ENVMAPI_BODY int envmap_fan(float *offsets, float *weights, int room, double along, double across,
                            double tolerance) {
    if (!(along > 0 && along <= 1.5 && across > 0 && across <= 1e9) ||
        !(tolerance >= 1e-6 && tolerance <= 0.5) || !envmapi_finite(along * across * tolerance))
        return 0;
    double s = along > across ? sqrt(along * along - across * across) : 0, sum = 0;
    double reach = sqrt(2 * log(2 / tolerance));              /* in s */
    double step = 2 * ENVMAPI_PI * across / (along * reach);  /* h / s */
    double half = s > 1e-3 * across ? ceil(reach / step) : 0; /* taps on each side */
    if (half > 1e6) return 0;
    int count = 1 + 2 * (int)half;
    for (int i = 0; i < count; ++i) sum += exp(-pow((i - half) * step, 2) / 2);
    for (int i = 0; i < count && i < room; ++i) {
        if (offsets) offsets[i] = (float)((i - half) * step * s);
        if (weights) weights[i] = (float)(exp(-pow((i - half) * step, 2) / 2) / sum);
    }
    return count;
}

ENVMAPI_BODY void envmap_lookup_fan(float rgb[3], const envmap *map, const float n[3],
                                    const float t[3], const float v[3], const float *offsets,
                                    const float *weights, int count) {
    double N[3], T[3], B[3], V[3], h[3], l[3], sum[3] = {0, 0, 0};
    if (!rgb) return;
    int ok = envmapi_valid(map) && t && offsets && weights && envmapi_surface(N, V, n, v);
    if (ok) envmapi_tangents(T, B, N, t);
    for (int i = 0; ok && i < count; ++i) {
        double half = (double)offsets[i] / 2;
        for (int j = 0; j < 3; ++j) h[j] = cos(half) * N[j] + sin(half) * T[j];
        double vh = envmapi_dot(V, h);
        for (int j = 0; j < 3; ++j) l[j] = 2 * vh * h[j] - V[j];
        envmapi_unit(l, l);
        envmapi_add_trilinear(sum, map, l, 0, 0, (double)weights[i]);
    }
    for (int j = 0; j < 3; ++j) rgb[j] = envmapi_to_float(sum[j]);
}

/* --------------------------------------------------------------------------------- >>compare --
   In: a map and the truth, of one shape. Out: envmap_difference, over all texels that have a solid
   angle.
   Tests: tests/test_compare.c; differences_of_six_texels_are_those_worked_out_by_hand. */

/* a/b, where nothing over nothing is nothing. */
static double envmapi_ratio(double a, double b) {
    return b > 0 || b < 0 ? a / b : a > 0 ? HUGE_VAL : a < 0 ? -HUGE_VAL : 0;
}

/* Adds w (a-b), w b, w (a-b)^2 and w b^2 of a texel to sums; returns its share in `worst`. */
static double envmapi_compare_texel(double sums[4], const float *a, const float *b, double w,
                                    double least) {
    double error = 0, peak = least > 0 ? least : 0;
    for (int c = 0; c < 3; ++c) {
        double truth = (double)b[c], off = (double)a[c] - truth;
        sums[0] += w * off, sums[1] += w * truth;
        sums[2] += w * off * off, sums[3] += w * truth * truth;
        error = fabs(off) > error ? fabs(off) : error, peak = truth > peak ? truth : peak;
    }
    return envmapi_ratio(error, peak);
}

ENVMAPI_BODY envmap_result envmap_compare(envmap_difference *difference, const envmap *a,
                                          const envmap *b, int level) {
    envmap_difference out = {0, 0, 0, 0, 0, 0, 0};
    double sums[4] = {0, 0, 0, 0}, total = 0, solid = 0;
    if (!difference || !envmapi_valid(a) || !envmapi_valid(b) || a->mapping != b->mapping ||
        a->slices != b->slices || level < 0 || level >= a->levels || level >= b->levels ||
        envmapi_edge(a->size, level) != envmapi_edge(b->size, level))
        return ENVMAP_ERROR_ARGUMENT;
    int edge = envmapi_edge(a->size, level), width = envmapi_width(a->mapping, edge);
    int faces = envmap_faces(a->mapping), area = width * edge;
    const float *from_a = envmapi_image(a, level, 0, 0), *from_b = envmapi_image(b, level, 0, 0);
    for (int pass = 0; pass < 2; ++pass) /* the first for the mean of b alone */
        for (int i = 0; i < area; ++i) {
            double w = envmapi_texel_cell(NULL, a->mapping, edge, i % width, i / width);
            for (int image = 0; w > 0 && image < faces * a->slices; ++image) {
                size_t at = 3 * ((size_t)image * (size_t)area + (size_t)i);
                const float *truth = from_b + at;
                if (!pass) solid += 3 * w;
                for (int c = 0; c < 3 && !pass; ++c) total += w * (double)truth[c];
                if (!pass) continue;
                double least = 1e-3 * total / solid;
                double error = envmapi_compare_texel(sums, from_a + at, truth, w, least);
                if (!(error > out.worst)) continue;
                out.slice = image / faces, out.face = image % faces;
                out.x = i % width, out.y = i / width, out.worst = error;
            }
        }
    if (!envmapi_finite(sums[2] + sums[3])) return ENVMAP_ERROR_RADIANCE;
    out.rms = sqrt(envmapi_ratio(sums[2], sums[3]));
    out.bias = envmapi_ratio(sums[0], sums[1]);
    *difference = out;
    return ENVMAP_OK;
}

#endif /* ENVMAP_IMPLEMENTATION_ONCE */
#endif /* ENVMAP_IMPLEMENTATION */

/* REFERENCES
     [Banks94]    D. Banks. Illumination in diverse codimensions. SIGGRAPH 1994.
     [Debevec98]  P. Debevec. Rendering synthetic objects into real scenes. SIGGRAPH 1998; and the
                  notes on light probe images (angular map, lat-long).
     [FdezAguera19] C. Fdez-Aguera. A multiple-scattering microfacet model for real-time image based
                  lighting. Journal of Computer Graphics Techniques 8(1), 2019.
     [Heitz14]    E. Heitz. Understanding the masking-shadowing function in microfacet-based BRDFs.
                  Journal of Computer Graphics Techniques 3(2), 2014.
     [HS98]       W. Heidrich, H.-P. Seidel. View-independent environment maps. Graphics Hardware
                  1998.
     [HS99]       W. Heidrich, H.-P. Seidel. Realistic, hardware-accelerated shading and lighting.
                  SIGGRAPH 1999.
     [Jones99]    P. Jones. First- and second-order conservative remapping schemes for grids in
                  spherical coordinates. Monthly Weather Review 127(9), 1999.
     [Karis13]    B. Karis. Real shading in Unreal Engine 4. SIGGRAPH 2013 course.
     [KM00]       J. Kautz, M. McCool. Approximation of glossy reflection with prefiltered
                  environment maps. Graphics Interface 2000.
     [KVHS00]     J. Kautz, P.-P. Vazquez, W. Heidrich, H.-P. Seidel. A unified approach to
                  prefiltered environment maps. Rendering Workshop 2000.
     [Miller84]   G. Miller, C. Hoffman. Illumination and reflection maps. SIGGRAPH 1984 course.
     [RH01]       R. Ramamoorthi, P. Hanrahan. An efficient representation for irradiance
                  environment maps. SIGGRAPH 2001.
     [Schlick94]  C. Schlick. An inexpensive BRDF model for physically-based rendering. Computer
                  Graphics Forum 13(3), 1994.
     [SKS96]      A. Schilling, G. Knittel, W. Strasser. Texram: a smart memory for texturing. IEEE
                  Computer Graphics and Applications 16(3), 1996.
     [Sloan08]    P.-P. Sloan. Stupid spherical harmonics (SH) tricks. Game Developers Conference
                  2008.
     [Swarztrauber79] P. Swarztrauber. On the spectral approximation of discrete scalar and vector
                  functions on the sphere. SIAM J. Numerical Analysis 16, 1979.
     [Unser91]    M. Unser, A. Aldroubi, M. Eden. Fast B-spline transforms for continuous image
                  representation and interpolation. IEEE PAMI 13, 1991.
     [Williams83] L. Williams. Pyramidal parametrics. SIGGRAPH 1983.
     [WMLT07]     B. Walter, S. Marschner, H. Li, K. Torrance. Microfacet models for refraction
                  through rough surfaces. Rendering Symposium 2007.

   CHANGES
     0.1  six parameterizations, maps, PFM, mip levels, lobes, spherical harmonics, materials,
          comparison; filters: the reference, the hierarchical one, and the fast one through
          harmonics

   LICENCE: MIT
     Copyright (c) 2026 the envmap.h authors
     Permission is hereby granted, free of charge, to any person obtaining a copy of this software
     and associated documentation files (the "Software"), to deal in the Software without
     restriction, including without limitation the rights to use, copy, modify, merge, publish,
     distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the
     Software is furnished to do so, subject to the following conditions:
     The above copyright notice and this permission notice shall be included in all copies or
     substantial portions of the Software.
     THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING
     BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
     NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM,
     DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
     OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE. */

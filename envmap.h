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
       ANGULAR     Debevec's: (X,Y) = acos(-d_z)/(pi sqrt(d_x^2+d_y^2)) (d_x,d_y); centre -z, rim +z.
     Mirrored    Seen from inside, the six cube faces, the front paraboloid and the sphere map are
                 MIRRORED pictures; lat-long, angular map and back paraboloid are not. This is what
                 OpenGL and the papers define, not a fault of the file.
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
     ENVMAP_FREE(ctx, ptr)   (default free(ptr)); define both or neither

   CONTENTS: the same names in the same order in the declarations, the bodies, tests/ and docs/.
     >>base        results, executor, progress
     >>directions  direction <-> (face, u, v), matrices
     >>maps        create, texel, solid angle, lookups, resample
     >>pfm         read and write float pictures
     >>mips        levels weighted by solid angle; level of a footprint
     >>lobes       mirror, diffuse, Phong, Gaussian, GGX, Banks, callback, table
     >>filters     the filter call
     >>compare     error norms
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

/* Every call that can fail returns one of these and leaves its outputs as they were. */
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
typedef enum envmap_result { ENVMAP_RESULTS(ENVMAPI_RESULT_ENUM) ENVMAP_RESULT_COUNT } envmap_result;

/* A sentence for a result, without a full stop. Never NULL, also for unknown numbers.
   Thread-safe.  Test: every_result_has_its_own_text. */
ENVMAP_API const char *envmap_result_text(int result);

/* Runs task(context, i) for i = 0 .. count-1, in any order, on any threads, and returns when all
   are done. The library starts no thread itself; `run` NULL means serial. Tasks are cut by the
   data alone, so results are the same bits for every executor.
   Test: results_are_the_same_bits_for_any_executor; examples with pthreads in examples/. */
typedef void envmap_task(void *context, int i);
typedef struct envmap_executor {
    void *user;
    void (*run)(void *user, envmap_task *task, void *context, int count);
} envmap_executor;

/* Called on the calling thread between rounds of tasks, fraction in [0,1]; return 0 to go on,
   anything else to cancel (the call then returns ENVMAP_CANCELLED, outputs untouched). */
typedef struct envmap_progress {
    void *user;
    int (*report)(void *user, float fraction);
} envmap_progress;

/* ------------------------------------------------------------------------------ >>directions -- */

typedef enum envmap_mapping {
    ENVMAP_CUBE,       /* 6 faces, density max/min 3 sqrt 3                                       */
    ENVMAP_PARABOLOID, /* 2 faces, 4                                                              */
    ENVMAP_SPHERE,     /* 1 face, constant solid angle, singular at -z                            */
    ENVMAP_LATLONG,    /* 1 face, twice as wide as high, unbounded at the poles                   */
    ENVMAP_ANGULAR,    /* 1 face, unbounded at the rim (+z)                                       */
    ENVMAP_MAPPING_COUNT
} envmap_mapping;

/* Faces of a mapping: 6, 2, 1, 1, 1; 0 for anything else. */
ENVMAP_API int envmap_faces(int mapping);

/* dir = the unit direction at (u,v) of a face.
   u, v  in [0,1]; beyond: the paraboloids, cube faces and lat-long go on, sphere and angular maps
         clamp to the rim.
   Out of range face or mapping, or non-finite u, v: +z.  Thread-safe.
   Source: CONVENTIONS above; [HS98], [Debevec98].  Test: directions_round_trip. */
ENVMAP_API void envmap_direction(float dir[3], envmap_mapping mapping, int face, float u, float v);

/* The inverse: the face that dir belongs to and (u,v) on it, in [0,1]. On an edge, the lower face.
   dir need not be of unit length; zero or non-finite counts as +z. At the sphere map's -z and the
   angular map's +z, where every rim point is right, (1, 1/2); at the lat-long poles u = 1/2.
   Float coordinates: near the sphere map's -z the round trip errs (3e-4 rad at 1e-3 rad from it).
   Thread-safe.  Test: directions_round_trip. */
ENVMAP_API void envmap_coordinates(int *face, float *u, float *v, envmap_mapping mapping,
                                   const float dir[3]);

/* The texture matrix of a paraboloid map: takes an eye-space reflection vector (r,1), as
   GL_REFLECTION_MAP generates it, to texture coordinates (s,t,r,q); s/q = u, t/q = v.
     matrix = (scale and bias to [0,1]) P S (M_l)^-1
   matrix     out [16], column-major
   modelview  [16], column-major: the space of the map -> eye space; only its linear part M_l
              counts, a rotation times a uniform scale (the scale is divided out)
   face       0 front, 1 back. A point is on the face where u, v lie inside the unit disc.
   Errors: ARGUMENT (NULL, face, singular or non-finite M_l).  Thread-safe.
   Source: [HS98] eqs. 6-9, [HS99]; front S = -I, d = (0,0,-1); back S = -I, d = (0,0,1), then
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

/* Number of levels from edge `size` down to edge 1: floor(log2 size) + 1; 0 for size < 1. */
ENVMAP_API int envmap_levels(int size);

/* A black map. Overwrites *map without freeing; keeps map->memory, so zero-initialise it.
   size    1 .. 16384      levels  1 .. envmap_levels(size)      slices  1 .. 4096
   Errors: ARGUMENT, LIMIT (beyond these, or more than 8 GiB), MEMORY.  *map stays as it was. */
ENVMAP_API envmap_result envmap_create(envmap *map, envmap_mapping mapping, int size, int levels,
                                       int slices);

/* Frees the texels and zeroes all but map->memory. NULL and twice are fine. */
ENVMAP_API void envmap_free(envmap *map);

/* Texel (x,y): 3 floats, then the rest of its row. NULL when anything is out of range.
   Test: texels_are_where_the_memory_order_says. */
ENVMAP_API float *envmap_texel(const envmap *map, int level, int slice, int face, int x, int y);

/* Solid angle of a texel, sr: closed form for cube, lat-long, paraboloid and sphere map, line
   quadrature (1e-13) for the angular map; only the part inside a disc's rim. 0 when out of range.
   The texels of a level sum to 4 pi.  Thread-safe.  Test: solid_angles_sum_to_4_pi. */
ENVMAP_API double envmap_solid_angle(const envmap *map, int level, int face, int x, int y);

/* rgb = radiance in direction dir, trilinear: bilinear in two levels, linear between.
   level  0 .. levels-1, clamped; NaN counts as 0
   Bilinear across faces: continuous over every cube edge and corner, over the paraboloids' rim
   (the faces blend in its last half texel), over lat-long's seam and its poles (where the row's
   mean is the pole). At a texel's centre it gives the texel (at rims: to second order).
   The slice is 0; envmap_lookup_slice interpolates between slice centres and clamps at the ends.
   Bad maps give black.  Thread-safe.  Test: lookups_are_continuous_across_seams. */
ENVMAP_API void envmap_lookup(float rgb[3], const envmap *map, const float dir[3], float level);
ENVMAP_API void envmap_lookup_slice(float rgb[3], const envmap *map, const float dir[3], float p,
                                    float level);

/* dst level 0 = src level 0 in dst's parameterization and size, slice by slice (src may have one
   slice for all). Each texel is the solid-angle-weighted mean of bilinear src over the texel,
   taken at a grid of points no coarser than src's texels there: a box prefilter when shrinking,
   bilinear interpolation when not. Same mapping and size: the same texels.
   Errors: ARGUMENT, RADIANCE (NaN, Inf).  O(max(texels)), allocates nothing.
   Test: resampling_* . */
ENVMAP_API envmap_result envmap_resample(envmap *dst, const envmap *src);

/* ------------------------------------------------------------------------------------- >>pfm -- */

/* Reads a float PFM: PF (RGB) or Pf (grey, copied to RGB), either byte order, rows bottom to top,
   samples times |scale|. One map, one level; the slices follow from the height:
     cube  w x 6w*slices     paraboloid  w x 2w*slices     sphere, angular  w x w*slices
     lat-long  2h x h (one slice)
   A picture of several faces is their vertical strip in face order, slices outermost.
   Radiance is kept as it is, NaN and negative numbers too (filters refuse them).
   Overwrites *map without freeing, keeps map->memory.
   Errors: ARGUMENT, FILE, FORMAT (also scale 0, NaN, Inf), SHAPE, LIMIT, TRUNCATED, TRAILING,
   MEMORY.  *map stays as it was.  No stdio, no locale in envmap_pfm_read.
   Test: pfm_round_trips, every_truncated_prefix_is_refused. */
ENVMAP_API envmap_result envmap_pfm_read(envmap *map, const void *data, size_t bytes,
                                         envmap_mapping mapping);

/* Writes one level as little-endian PF, scale -1, the same shapes. *bytes is the size of the file
   in any case but ARGUMENT; data NULL only asks for it.
   capacity  room at data, bytes
   Errors: ARGUMENT (bad map or level, lat-long with slices), LIMIT (capacity too small, nothing
   written).  Test: pfm_round_trips. */
ENVMAP_API envmap_result envmap_pfm_write(void *data, size_t capacity, size_t *bytes,
                                          const envmap *map, int level);

#ifndef ENVMAP_NO_STDIO
/* The same from and to a path. A file that could not be written whole is removed. */
ENVMAP_API envmap_result envmap_pfm_load(envmap *map, const char *path, envmap_mapping mapping);
ENVMAP_API envmap_result envmap_pfm_save(const envmap *map, const char *path, int level);
#endif

/* ------------------------------------------------------------------------------------ >>mips -- */

/* Fills levels 1 .. levels-1: each texel the mean of the level above it, weighted by the solid
   angle of the overlap (odd sizes too), so every level carries the energy of level 0; texels of a
   level of edge 1 are the mean of the whole sphere, the same on every face.
   Errors: ARGUMENT.  O(texels), allocates nothing.  Source [KVHS00] 5.1 with weights added.
   Test: mip_levels_carry_the_same_energy (<= 1e-6; an unweighted box drifts by percents). */
ENVMAP_API envmap_result envmap_mips_build(envmap *map);

/* The level whose texels match a footprint: log2 of its longer side in texels of level 0,
   clamped to [0, levels-1].
   dir  where; dx, dy  the footprint's sides: derivatives of the direction along two screen axes
   Bad maps or numbers give 0.  Thread-safe.  Source [Williams83], [HS99].
   Test: a_footprint_of_two_texels_is_level_one. */
ENVMAP_API float envmap_footprint_level(const envmap *map, const float dir[3], const float dx[3],
                                        const float dy[3]);

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

/* k(x; p), x in [-1,1] the cosine of the angle to the axis. Must be finite and deterministic, and
   thread-safe if the executor is parallel. */
typedef double envmap_lobe_function_type(double x, double p, void *user);

typedef struct envmap_lobe {
    int kind;        /* envmap_lobe_kind                                                          */
    int raw;         /* 0: normalised; 1: the papers' sums, with k_s (or k_d) = scale             */
    float parameter; /* N, lambda, alpha or s                                                     */
    float scale;     /* k_s or k_d, used when raw; the constructors write 1                       */
    float p0, p1;    /* range of p over a map's slices; equal: the lobe has no p                  */
    envmap_lobe_function_type *function; /* FUNCTION                                              */
    void *user;
    const float *table;            /* TABLE: [table_slices][table_size]; k at angle pi i/(size-1) */
    int table_size, table_slices;
    const float *kinks; /* FUNCTION: angles in (0,pi) where k has a kink, for every p; or NULL    */
    int kink_count;
} envmap_lobe;

/* Constructors. Parameters are checked by the calls that take a lobe (LOBE). Callbacks, tables and
   kinks are borrowed until such a call returns.
   mirror    delta: filtering with it is envmap_resample
   diffuse   max(x,0)
   phong     max(x,0)^N,               exponent N in [0, 1e9]; N = 0 is the open hemisphere
   gaussian  exp(lambda (x-1)),        sharpness lambda in [0, 1e9]
   ggx       D(sqrt((1+x)/2)) max(x,0), D(c) = alpha^2 / (pi ((alpha^2-1) c^2 + 1)^2),
             alpha = roughness^2 in (0, 1], at least 1e-4                          [WMLT07] eq. 33
   banks     max(0, sqrt(1-x^2) sqrt(1-c^2) - x c - s) / (1-s)^2, s in [0, 0.99999], c = p
             [Banks94], [KVHS00] section 4
   function  any k; set p0 != p1 for slices, kinks where it has any
   table     k(theta) by Catmull-Rom over `size` >= 4 samples at angles 0 .. pi, `slices` rows at
             slice centres of p (linear between)                                         [KM00] */
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
   sigma      half the width of the angles where k exceeds e^(-1/2) of its peak, rad
   support    [from, to] in angle: outside it k = 0, or below 1e-12 of its peak
   kinks      angles where k or its slope jumps (horizon, ring edges, tip of a cone); writes at
              most `room`, returns how many there are
   curvature  bound over [from, to] of max(|k_tt|, |cot t k_t|), t the angle: the eigenvalues of
              k's Hessian on the sphere; valid between kinks
   Thread-safe.  Test: lobes_know_*. */
ENVMAP_API double envmap_lobe_value(const envmap_lobe *lobe, double x, double p);
ENVMAP_API double envmap_lobe_integral(const envmap_lobe *lobe, double p);
ENVMAP_API double envmap_lobe_sigma(const envmap_lobe *lobe, double p);
ENVMAP_API void envmap_lobe_support(double *from, double *to, const envmap_lobe *lobe, double p);
ENVMAP_API int envmap_lobe_kinks(double *angles, int room, const envmap_lobe *lobe, double p);
ENVMAP_API double envmap_lobe_curvature(const envmap_lobe *lobe, double p, double from, double to);

/* lambda[l] = 2 pi integral of k P_l / norm, l = 0 .. bands-1 (Funk-Hecke: the filter maps Y_lm to
   lambda_l Y_lm); norm is that of the filter: the lobe's integral, Banks' at c = 0, or 1 when raw.
   bands  1 .. 4096. Stable to all of them (test: to l = 256 against quadrature).
   Errors: ARGUMENT, LOBE.  Phong: lambda_0 = 1, lambda_1 = (N+1)/(N+2),
   lambda_(l+2) = lambda_l (N-l)/(N+l+3); Gaussian: a continued fraction downwards; others:
   Gauss-Legendre between kinks, O(bands^2).  Test: zonal_coefficients_*. */
ENVMAP_API envmap_result envmap_lobe_zonal(double *lambda, int bands, const envmap_lobe *lobe,
                                           double p);

/* The number of bands L (1 .. 4096) beyond which the lobe has nothing more than `tolerance` of its
   rms: sqrt(sum_(l>=L) (2l+1) lambda_l^2) <= tolerance * sqrt(sum over all l), for every slice
   of `slices`. 4096 also when more would be needed; 0 for bad lobes. */
ENVMAP_API int envmap_lobe_bands(const envmap_lobe *lobe, int slices, double tolerance);

/* --------------------------------------------------------------------------------- >>filters -- */

typedef enum envmap_method {
    ENVMAP_METHOD_AUTO,         /* the cheapest that keeps the tolerance                          */
    ENVMAP_METHOD_REFERENCE,    /* every texel, in double: the definition                         */
    ENVMAP_METHOD_HIERARCHICAL, /* [KVHS00] 5.1                                                   */
    ENVMAP_METHOD_FAST,
    ENVMAP_METHOD_HARMONICS,
    ENVMAP_METHOD_COUNT
} envmap_method;

typedef struct envmap_filter_desc {
    int method;      /* envmap_method; 0: AUTO                                                    */
    float tolerance; /* desired relative rms error; 0: 1e-3                                       */
    float threshold; /* HIERARCHICAL: max |k_child - k_parent|, k with peak 1; 0: 0.001,
                        negative: open everything                                                 */
    envmap_executor executor; /* run NULL: serial                                                 */
    envmap_progress progress; /* report NULL: none                                                */
    void *memory;             /* context for temporary memory                                     */
} envmap_filter_desc;

/* dst level 0, every slice: L(a) = sum k(a.l; p) L_in(l) w(l) / norm over src's level-0 texels l,
   for the axis a of every texel of dst, those outside a rim too. Any parameterizations and sizes.
   As a lobe gets thinner than two texels of src, each texel spreads into a tent (bilinear radiance
   at the end), so the result is continuous in N, and N -> infinity is the bilinear mirror.
   Also writes dst->p0, p1.
   desc  NULL: defaults
   Errors: ARGUMENT (bad map or desc, dst is src), LOBE, RADIANCE (NaN, Inf; negative for all but
   the reference), METHOD, MEMORY, CANCELLED; dst then stays as it was.
   REFERENCE: O(texels of src * texels and slices of dst).  Thread-safe.
   Source [KVHS00] section 4.  Test: tests/test_filters.c. */
ENVMAP_API envmap_result envmap_filter(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                       const envmap_filter_desc *desc);

/* The same into level i with lobes[i], i = 0 .. count-1; count in 1 .. dst->levels. All levels
   are written, or none. */
ENVMAP_API envmap_result envmap_filter_chain(envmap *dst, const envmap *src,
                                             const envmap_lobe *lobes, int count,
                                             const envmap_filter_desc *desc);

/* --------------------------------------------------------------------------------- >>compare -- */

typedef struct envmap_difference {
    int slice, face, x, y; /* where the worst texel is                                            */
    double worst; /* max over texels of max_c |a_c - b_c| / max(max_c b_c, 1e-3 mean b)           */
    double rms;   /* sqrt(sum w |a-b|^2 / sum w |b|^2), all channels and slices                   */
    double bias;  /* sum w (a-b) / sum w b                                                        */
} envmap_difference;

/* How far level `level` of a is from b, the truth; texels outside a rim (w = 0) do not count.
   Black b: 0 where a is black too, else infinity.
   Errors: ARGUMENT (maps of different mapping, edge or slices), RADIANCE (NaN, Inf).
   Thread-safe.  Test: differences_*. */
ENVMAP_API envmap_result envmap_compare(envmap_difference *difference, const envmap *a,
                                        const envmap *b, int level);

#endif /* ENVMAP_H */

/* ============================ you can stop reading here: the bodies ============================ */

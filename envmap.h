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
     ENVMAP_NO_SIMD          plain loops where GCC and Clang would get vector types

   CONTENTS: the same names in the same order in the declarations, the bodies, tests/ and docs/.
     >>base        results, executor, progress
     >>directions  direction <-> (face, u, v), matrices
     >>maps        create, texel, solid angle, lookups, resample
     >>pfm         read and write float pictures
     >>mips        levels weighted by solid angle; level of a footprint, and probes along it
     >>lobes       mirror, diffuse, Phong, Gaussian, GGX, Banks, callback, table
     >>harmonics   transforms on rings of the sphere (bodies only, so far)
     >>filters     the filter call: reference, hierarchical, fast
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
typedef enum envmap_result {
    ENVMAP_RESULTS(ENVMAPI_RESULT_ENUM) ENVMAP_RESULT_COUNT
} envmap_result;

/* A sentence for a result, without a full stop. Never NULL, also for unknown numbers.
   Thread-safe.  Test: every_result_has_its_own_text. */
ENVMAP_API const char *envmap_result_text(envmap_result result);

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
   Float coordinates: near the sphere map's -z the round trip errs (up to 4e-4 rad at 1e-3 from it).
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
   taken at a grid of points three times finer than src's texels: a box prefilter when shrinking,
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

/* rgb = radiance over a footprint by footprint assembly: n trilinear probes along the longer axis
   of the ellipse that the sides span, each the level of its own part of the footprint:
     rgb = 1/n sum over i of map(dir + major ((i+1/2)/n - 1/2)),   n = ceil(longer / shorter axis)
   in texels of level 0. A level alone makes the footprint a square of its longer side.
   dir, dx, dy  as above
   probes  the most to take, 1 .. 256 (clamped); 1: one lookup at envmap_footprint_level
   Slice 0; bad maps give black, bad numbers level 0.  O(n) lookups.  Thread-safe.
   Source [SKS96].  Test: assembled_footprints_*. */
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
   kinks      angles where k or its slope jumps, or its curvature has no bound (horizon, ring
              edges, tip of a cone); writes at
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
    ENVMAP_METHOD_HIERARCHICAL, /* [KVHS00] 5.1: lobe and environment as mip-maps                 */
    ENVMAP_METHOD_FAST,         /* through harmonics; the reference where they cannot             */
    ENVMAP_METHOD_HARMONICS,    /* through harmonics; METHOD where they cannot                    */
    ENVMAP_METHOD_COUNT
} envmap_method;

typedef struct envmap_filter_desc {
    int method;      /* envmap_method; 0: AUTO                                                    */
    float tolerance; /* desired relative rms error, 1e-7 .. 0.1 (clamped); 0: 1e-3                */
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
   desc  NULL: defaults: AUTO, which takes FAST, or the reference where texels are few
   Errors: ARGUMENT (bad map or desc, dst is src), LOBE, RADIANCE (NaN, Inf; negative for all but
   the reference), METHOD, MEMORY, CANCELLED; dst then stays as it was.
   REFERENCE: O(texels of src * texels and slices of dst). Texels where k is below 1e-12 of its
   peak are passed over.
   FAST: O(texels of src + texels of dst + L^3), L the bands that lobe, scene and tolerance need.
   Lobes thinner than two texels of src, or of more than 768 bands, go to the reference: slow.
   Lobes with a kink (diffuse, Banks, GGX of large alpha) keep the tolerance in rms; beside a lamp
   on black their darkest texels may exceed 20 tolerances.
   Thread-safe.
   Source [KVHS00] sections 4, 5.1.  Test: tests/test_filters.c, test_hierarchical.c. */
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
#else
#define ENVMAPI_BODY
#endif

/* ------------------------------------------------------------------------------------ >>base --
   Numbers, 3-vectors in double, tasks. Bits, not comparisons, decide what is finite, so that
   -ffast-math changes nothing.  Tests: tests/test_base.c. */

#define ENVMAPI_PI 3.14159265358979323846

ENVMAPI_BODY const char *envmap_result_text(envmap_result result) {
#define ENVMAPI_RESULT_TEXT(name, text) text,
    static const char *const texts[] = {ENVMAP_RESULTS(ENVMAPI_RESULT_TEXT)};
    return (unsigned)result < ENVMAP_RESULT_COUNT ? texts[(unsigned)result] : "unknown result";
}

static int envmapi_finite(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits >> 52 & 0x7FF) != 0x7FF;
}

static double envmapi_clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
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

static void envmapi_unit(double out[3], const double in[3]) {
    double scale = fabs(in[0]) > fabs(in[1]) ? fabs(in[0]) : fabs(in[1]);
    if (fabs(in[2]) > scale) scale = fabs(in[2]);
    int usable = envmapi_finite(in[0]) && envmapi_finite(in[1]) && envmapi_finite(in[2]);
    if (!usable || !(scale > 0)) {
        out[0] = out[1] = 0, out[2] = 1;
        return;
    }
    double v[3] = {in[0] / scale, in[1] / scale, in[2] / scale};
    double length = sqrt(envmapi_dot(v, v));
    for (int i = 0; i < 3; ++i) out[i] = v[i] / length;
}

static void envmapi_unit_float(double out[3], const float in[3]) {
    double wide[3] = {(double)in[0], (double)in[1], (double)in[2]};
    envmapi_unit(out, wide);
}

static envmap_result envmapi_tell(const envmap_progress *progress, double fraction) {
    if (!progress->report) return ENVMAP_OK;
    return progress->report(progress->user, (float)fraction) ? ENVMAP_CANCELLED : ENVMAP_OK;
}

typedef struct envmapi_batch {
    envmap_task *task;
    void *context;
    int first;
} envmapi_batch;

static void envmapi_batch_task(void *context, int i) {
    const envmapi_batch *batch = (const envmapi_batch *)context;
    batch->task(batch->context, batch->first + i);
}

/* All tasks; with a progress callback in up to 64 rounds, told between them on this thread. */
static envmap_result envmapi_run(const envmap_executor *executor, const envmap_progress *progress,
                                 envmap_task *task, void *context, int count) {
    int rounds = progress->report ? 64 : 1, step = (count + rounds - 1) / rounds;
    for (int first = 0; first < count; first += step) {
        envmapi_batch batch = {task, context, first};
        int n = count - first < step ? count - first : step;
        if (envmapi_tell(progress, (double)first / count)) return ENVMAP_CANCELLED;
        if (executor->run)
            executor->run(executor->user, envmapi_batch_task, &batch, n);
        else
            for (int i = 0; i < n; ++i) task(context, first + i);
    }
    return ENVMAP_OK;
}

/* A part of the caller's progress, for one of several runs. */
typedef struct envmapi_progress_part {
    const envmap_progress *whole;
    float from, length;
} envmapi_progress_part;

static int envmapi_report_part(void *user, float fraction) {
    const envmapi_progress_part *part = (const envmapi_progress_part *)user;
    return part->whole->report(part->whole->user, part->from + part->length * fraction);
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

/* ------------------------------------------------------------------------------ >>directions --
   Every mapping is a pair of functions in double, direction(face, u, v) and project(face, d),
   inverse to each other. A cube face is spanned by S (along u) and T (along v) at distance M:
   d ~ M + (2u-1) S + (2v-1) T, OpenGL's table of (s_c, t_c, m_a) read as vectors. The three disc
   mappings differ only in how the radius r of (X,Y) depends on the angle to the centre:
       paraboloid tan(angle/2)      sphere map sin(angle/2)      angular map angle/pi
   Invariants: round trips, continuity across faces.  Tests: tests/test_directions.c. */

ENVMAPI_BODY int envmap_faces(int mapping) {
    static const int faces[ENVMAP_MAPPING_COUNT] = {6, 2, 1, 1, 1};
    return mapping >= 0 && mapping < ENVMAP_MAPPING_COUNT ? faces[mapping] : 0;
}

static const signed char envmapi_cube[6][3][3] = {
    /*     S            T            M     */
    {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},  /* +X */
    {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}},  /* -X */
    {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},    /* +Y */
    {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},  /* -Y */
    {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},   /* +Z */
    {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, /* -Z */
};

static int envmapi_is_disc(int mapping) {
    return mapping == ENVMAP_PARABOLOID || mapping == ENVMAP_SPHERE || mapping == ENVMAP_ANGULAR;
}

static void envmapi_disc_direction(double d[3], int mapping, int face, double X, double Y) {
    double rr = X * X + Y * Y;
    if (mapping == ENVMAP_PARABOLOID) {
        d[0] = 2 * X / (1 + rr), d[1] = 2 * Y / (1 + rr), d[2] = (1 - rr) / (1 + rr);
        if (face == 1) d[2] = -d[2];
        return;
    }
    double r = sqrt(rr), clamped = r > 1 ? 1 : r;
    if (r > 1) X /= r, Y /= r;
    if (mapping == ENVMAP_SPHERE) {
        double n_z = sqrt(1 - clamped * clamped);
        d[0] = 2 * n_z * X, d[1] = 2 * n_z * Y, d[2] = 1 - 2 * clamped * clamped;
    } else {
        double ratio = clamped > 0 ? sin(ENVMAPI_PI * clamped) / clamped : ENVMAPI_PI;
        d[0] = ratio * X, d[1] = ratio * Y, d[2] = -cos(ENVMAPI_PI * clamped);
    }
}

/* A direction of any length. */
static void envmapi_ray(double d[3], int mapping, int face, double u, double v) {
    if (mapping == ENVMAP_CUBE) {
        const signed char(*axes)[3] = envmapi_cube[face];
        for (int i = 0; i < 3; ++i)
            d[i] = axes[2][i] + (2 * u - 1) * axes[0][i] + (2 * v - 1) * axes[1][i];
    } else if (mapping == ENVMAP_LATLONG) {
        double phi = 2 * ENVMAPI_PI * (u - 0.5), theta = ENVMAPI_PI * v;
        d[0] = sin(theta) * sin(phi), d[1] = cos(theta), d[2] = -sin(theta) * cos(phi);
    } else {
        envmapi_disc_direction(d, mapping, face, 2 * u - 1, 1 - 2 * v);
    }
}

static void envmapi_direction(double d[3], int mapping, int face, double u, double v) {
    envmapi_ray(d, mapping, face, u, v);
    if (mapping == ENVMAP_CUBE) {
        double length = sqrt(envmapi_dot(d, d));
        for (int i = 0; i < 3; ++i) d[i] /= length;
    }
}

/* The face a unit direction belongs to. */
static int envmapi_face(int mapping, const double d[3]) {
    if (mapping == ENVMAP_PARABOLOID) return d[2] < 0;
    if (mapping != ENVMAP_CUBE) return 0;
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]);
    int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    return 2 * axis + (d[axis] < 0);
}

/* (X,Y) = d_xy times `ratio`; where d_xy = 0 on the rim, any rim point is right: (1,0). */
static void envmapi_disc_project(double uv[2], int mapping, int face, const double d[3]) {
    double rho = sqrt(d[0] * d[0] + d[1] * d[1]), z = d[2], ratio;
    double plus = z < 0 ? rho * rho / (1 - z) : 1 + z; /* 1 + z without cancellation */
    if (mapping == ENVMAP_PARABOLOID) {
        double minus = z > 0 ? rho * rho / (1 + z) : 1 - z;
        ratio = 1 / (face == 0 ? plus : minus);
    } else if (mapping == ENVMAP_SPHERE) {
        ratio = 1 / sqrt(2 * plus);
    } else {
        ratio = rho > 0 ? atan2(rho, -z) / (ENVMAPI_PI * rho) : 1 / ENVMAPI_PI;
    }
    int singular = !(rho > 0) && ((mapping == ENVMAP_SPHERE && z < 0) ||
                                  (mapping == ENVMAP_ANGULAR && z > 0));
    uv[0] = 0.5 + 0.5 * (singular ? 1 : rho > 0 ? d[0] * ratio : 0);
    uv[1] = 0.5 - 0.5 * (rho > 0 ? d[1] * ratio : 0);
}

/* (u,v) of a unit direction on a given face, also beyond the face's edge (for the cube up to
   nearly a right angle from its centre). */
static void envmapi_project(double uv[2], int mapping, int face, const double d[3]) {
    if (mapping == ENVMAP_CUBE) {
        const signed char(*axes)[3] = envmapi_cube[face];
        double p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = d[0] * axes[k][0] + d[1] * axes[k][1] + d[2] * axes[k][2];
        if (p[2] < 1e-3) p[2] = 1e-3;
        uv[0] = 0.5 + 0.5 * p[0] / p[2], uv[1] = 0.5 + 0.5 * p[1] / p[2];
    } else if (mapping == ENVMAP_LATLONG) {
        double rho = sqrt(d[0] * d[0] + d[2] * d[2]);
        uv[0] = rho > 0 ? 0.5 + atan2(d[0], -d[2]) / (2 * ENVMAPI_PI) : 0.5;
        uv[1] = atan2(rho, d[1]) / ENVMAPI_PI;
    } else {
        envmapi_disc_project(uv, mapping, face, d);
    }
}

ENVMAPI_BODY void envmap_direction(float dir[3], envmap_mapping mapping, int face, float u,
                                   float v) {
    double d[3] = {0, 0, 1};
    if (!dir) return;
    if (face >= 0 && face < envmap_faces((int)mapping) && envmapi_finite((double)u) &&
        envmapi_finite((double)v))
        envmapi_direction(d, (int)mapping, face, (double)u, (double)v);
    for (int i = 0; i < 3; ++i) dir[i] = (float)d[i];
}

ENVMAPI_BODY void envmap_coordinates(int *face, float *u, float *v, envmap_mapping mapping,
                                     const float dir[3]) {
    double d[3] = {0, 0, 1}, uv[2] = {0.5, 0.5};
    int at = 0;
    if (dir) envmapi_unit_float(d, dir);
    if (envmap_faces((int)mapping)) {
        at = envmapi_face((int)mapping, d);
        envmapi_project(uv, (int)mapping, at, d);
    }
    if (face) *face = at;
    if (u) *u = (float)envmapi_clamp(uv[0], 0, 1);
    if (v) *v = (float)envmapi_clamp(uv[1], 0, 1);
}

/* inverse = (M / cbrt|det M|)^-1 by cofactors; 0 when M is singular. M is column-major 4x4. */
static int envmapi_inverse_rotation(double inverse[3][3], const float modelview[16]) {
    double m[3][3], det = 0, largest = 0;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            m[r][c] = (double)modelview[4 * c + r];
            if (!envmapi_finite(m[r][c])) return 0;
            if (fabs(m[r][c]) > largest) largest = fabs(m[r][c]);
        }
    if (!(largest > 0)) return 0;
    for (int i = 0; i < 9; ++i) m[i / 3][i % 3] /= largest;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            inverse[c][r] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    for (int c = 0; c < 3; ++c) det += m[0][c] * inverse[c][0];
    if (fabs(det) < 1e-6) return 0;
    for (int i = 0; i < 9; ++i) inverse[i / 3][i % 3] *= cbrt(fabs(det)) / det;
    return 1;
}

ENVMAPI_BODY envmap_result envmap_paraboloid_matrix(float matrix[16], const float modelview[16],
                                                    int face) {
    double inverse[3][3], side = face == 0 ? -1 : 1;
    if (!matrix || !modelview || face < 0 || face > 1) return ENVMAP_ERROR_ARGUMENT;
    if (!envmapi_inverse_rotation(inverse, modelview)) return ENVMAP_ERROR_ARGUMENT;
    /* Rows of S (M_l)^-1 and its column d, the back's (X,Y) turned by diag(-1,-1,1,1); then P
       copies z into q, and u = (q + X)/2q, v = (q - Y)/2q. */
    double rows[3][4];
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) rows[r][c] = (face == 1 && r < 2 ? 1 : -1) * inverse[r][c];
        rows[r][3] = r == 2 ? side : 0;
    }
    for (int c = 0; c < 4; ++c) {
        matrix[4 * c + 0] = (float)(0.5 * rows[2][c] + 0.5 * rows[0][c]);
        matrix[4 * c + 1] = (float)(0.5 * rows[2][c] - 0.5 * rows[1][c]);
        matrix[4 * c + 2] = (float)rows[2][c];
        matrix[4 * c + 3] = (float)rows[2][c];
    }
    return ENVMAP_OK;
}

/* ------------------------------------------------------------------------------------ >>maps --
   Memory order, the solid angle of a cell, bilinear lookups across faces, resampling.

   The solid angle of a rectangle [u0,u1] x [v0,v1] of a face:
     cube      A(x1,y1) - A(x0,y1) - A(x1,y0) + A(x0,y0), A = atan(xy / sqrt(x^2 + y^2 + 1))
     lat-long  dphi (cos theta0 - cos theta1)
     discs     let 2 pi r^2 g(r^2) be the solid angle of the disc of radius r; by Green's theorem
               w = contour integral of g (X dY - Y dX) around cell-and-disc: four clipped segments
               and the arcs between them (where g = g(1), and X dY - Y dX = dphi).
               g: sphere map 2, paraboloid 2/(1+r^2), angular map (1 - cos pi r)/r^2.
   Invariants: the cells of any partition sum to 4 pi.  Tests: tests/test_maps.c. */

#define ENVMAPI_SIZE_LIMIT 16384
#define ENVMAPI_SLICE_LIMIT 4096
#define ENVMAPI_BYTE_LIMIT ((uint64_t)1 << 33)

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

/* First texel of a face's image. */
static float *envmapi_image(const envmap *map, int level, int slice, int face) {
    size_t faces = (size_t)envmap_faces(map->mapping), texels = 0;
    for (int l = 0; l < level; ++l)
        texels +=
            faces * (size_t)map->slices * envmapi_area(map->mapping, envmapi_edge(map->size, l));
    size_t area = envmapi_area(map->mapping, envmapi_edge(map->size, level));
    return map->texels + 3 * (texels + area * ((size_t)slice * faces + (size_t)face));
}

ENVMAPI_BODY envmap_result envmap_create(envmap *map, envmap_mapping mapping, int size, int levels,
                                         int slices) {
    uint64_t texels = 0, faces = (uint64_t)envmap_faces((int)mapping);
    if (!map || !faces || size < 1 || levels < 1 || levels > envmap_levels(size) || slices < 1)
        return ENVMAP_ERROR_ARGUMENT;
    if (size > ENVMAPI_SIZE_LIMIT || slices > ENVMAPI_SLICE_LIMIT) return ENVMAP_ERROR_LIMIT;
    for (int l = 0; l < levels; ++l)
        texels += faces * envmapi_area((int)mapping, envmapi_edge(size, l));
    uint64_t bytes = texels * (uint64_t)slices * 3 * sizeof(float);
    if (bytes > ENVMAPI_BYTE_LIMIT || bytes > PTRDIFF_MAX) return ENVMAP_ERROR_LIMIT;
    float *memory = (float *)ENVMAP_MALLOC(map->memory, (size_t)bytes);
    if (!memory) return ENVMAP_ERROR_MEMORY;
    memset(memory, 0, (size_t)bytes);
    map->texels = memory;
    map->mapping = (int)mapping, map->size = size, map->levels = levels, map->slices = slices;
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

/* Solid angle, area and first moments of a region of a disc, gathered along its boundary. */
typedef struct envmapi_region {
    double solid_angle, area, moment_x, moment_y;
} envmapi_region;

static double envmapi_disc_g(int mapping, double rr) {
    if (mapping == ENVMAP_SPHERE) return 2;
    if (mapping == ENVMAP_PARABOLOID) return 2 / (1 + rr);
    double half = sin(0.5 * ENVMAPI_PI * sqrt(rr));
    return rr > 1e-12 ? 2 * half * half / rr : ENVMAPI_PI * ENVMAPI_PI / 2;
}

static void envmapi_region_segment(envmapi_region *region, int mapping, const double a[2],
                                   const double b[2]) {
    double dx = b[0] - a[0], dy = b[1] - a[1], cross = a[0] * b[1] - a[1] * b[0], sum = 0;
    int pieces = 1 + (int)(4 * sqrt(dx * dx + dy * dy));
    for (int i = 0; i < 8 * pieces; ++i) {
        double t, weight = envmapi_gauss(&t, i & 7, (double)(i >> 3) / pieces,
                                         (double)((i >> 3) + 1) / pieces);
        double x = a[0] + t * dx, y = a[1] + t * dy;
        sum += weight * envmapi_disc_g(mapping, x * x + y * y);
    }
    region->solid_angle += cross * sum;
    region->area += cross / 2;
    region->moment_x += dy * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0]) / 6;
    region->moment_y -= dx * (a[1] * a[1] + a[1] * b[1] + b[1] * b[1]) / 6;
}

/* The unit circle from point a counter-clockwise to point b; a whole turn when a is b. */
static void envmapi_region_arc(envmapi_region *region, int mapping, const double a[2],
                               const double b[2]) {
    double from = atan2(a[1], a[0]), to = atan2(b[1], b[0]);
    if (to <= from) to += 2 * ENVMAPI_PI;
    double s0 = sin(from), s1 = sin(to), c0 = cos(from), c1 = cos(to);
    region->solid_angle += envmapi_disc_g(mapping, 1) * (to - from);
    region->area += (to - from) / 2;
    region->moment_x += ((s1 - s1 * s1 * s1 / 3) - (s0 - s0 * s0 * s0 / 3)) / 2;
    region->moment_y += ((c1 * c1 * c1 / 3 - c1) - (c0 * c0 * c0 / 3 - c0)) / 2;
}

/* The part of the segment a, b inside the unit disc; 0 when there is none. */
static int envmapi_clip(double from[2], double to[2], const double a[2], const double b[2]) {
    double d[2] = {b[0] - a[0], b[1] - a[1]};
    double dd = d[0] * d[0] + d[1] * d[1], ad = a[0] * d[0] + a[1] * d[1];
    double root = ad * ad - dd * (a[0] * a[0] + a[1] * a[1] - 1);
    if (!(root > 0)) return 0;
    double t0 = envmapi_clamp((-ad - sqrt(root)) / dd, 0, 1);
    double t1 = envmapi_clamp((-ad + sqrt(root)) / dd, 0, 1);
    if (t1 - t0 < 1e-12) return 0;
    for (int i = 0; i < 2; ++i) {
        from[i] = t0 > 0 ? a[i] + t0 * d[i] : a[i];
        to[i] = t1 < 1 ? a[i] + t1 * d[i] : b[i];
    }
    return 1;
}

/* The cell with corners (counter-clockwise) inside the unit disc. */
static envmapi_region envmapi_disc_cell(int mapping, const double corners[4][2]) {
    envmapi_region region = {0, 0, 0, 0};
    double from[4][2], to[4][2];
    int n = 0;
    for (int i = 0; i < 4; ++i)
        n += envmapi_clip(from[n], to[n], corners[i], corners[(i + 1) & 3]);
    for (int i = 0; i < n; ++i) {
        const double *next = from[(i + 1) % n];
        envmapi_region_segment(&region, mapping, from[i], to[i]);
        if (fabs(next[0] - to[i][0]) + fabs(next[1] - to[i][1]) > 1e-12)
            envmapi_region_arc(&region, mapping, to[i], next);
    }
    int holds_centre = corners[0][0] < 0 && corners[2][0] > 0 && corners[0][1] < 0 &&
                       corners[2][1] > 0;
    if (n == 0 && holds_centre) envmapi_region_arc(&region, mapping, corners[0], corners[0]);
    return region;
}

/* Solid angle of a rectangle of a face, and (when asked for) the (u,v) it counts at: its centre,
   or the centroid of the part inside the rim. */
static double envmapi_cell(double centre[2], int mapping, double u0, double v0, double u1,
                           double v1) {
    double x0 = 2 * u0 - 1, x1 = 2 * u1 - 1, y0 = 1 - 2 * v1, y1 = 1 - 2 * v0;
    if (centre) centre[0] = (u0 + u1) / 2, centre[1] = (v0 + v1) / 2;
    if (mapping == ENVMAP_CUBE)
        return atan2(x1 * y1, sqrt(x1 * x1 + y1 * y1 + 1)) -
               atan2(x0 * y1, sqrt(x0 * x0 + y1 * y1 + 1)) -
               atan2(x1 * y0, sqrt(x1 * x1 + y0 * y0 + 1)) +
               atan2(x0 * y0, sqrt(x0 * x0 + y0 * y0 + 1));
    if (mapping == ENVMAP_LATLONG)
        return 4 * ENVMAPI_PI * (u1 - u0) * sin(ENVMAPI_PI * (v0 + v1) / 2) *
               sin(ENVMAPI_PI * (v1 - v0) / 2);
    const double corners[4][2] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    envmapi_region region = envmapi_disc_cell(mapping, corners);
    if (!(region.area > 1e-15)) return 0;
    double far_x = fabs(x0) > fabs(x1) ? x0 : x1, far_y = fabs(y0) > fabs(y1) ? y0 : y1;
    if (centre && far_x * far_x + far_y * far_y > 1) {
        centre[0] = 0.5 + 0.5 * region.moment_x / region.area;
        centre[1] = 0.5 - 0.5 * region.moment_y / region.area;
    }
    return region.solid_angle;
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

/* A square image of one level, as lookups see it. */
typedef struct envmapi_level {
    const float *texels; /* face 0 */
    int mapping, edge, width;
} envmapi_level;

static envmapi_level envmapi_level_of(const envmap *map, int level, int slice) {
    int edge = envmapi_edge(map->size, level);
    envmapi_level out = {envmapi_image(map, level, slice, 0), map->mapping, edge,
                         envmapi_width(map->mapping, edge)};
    return out;
}

/* Off one edge of a cube face lies the texel of the neighbouring face that touches it there: its
   coordinate along the edge is the same, so a hair's breadth beyond the edge finds it. */
static void envmapi_cube_neighbour(int *face, int *x, int *y, int edge) {
    double hair = 1e-9, d[3], uv[2];
    double u = *x < 0 ? -hair : *x >= edge ? 1 + hair : (*x + 0.5) / edge;
    double v = *y < 0 ? -hair : *y >= edge ? 1 + hair : (*y + 0.5) / edge;
    envmapi_direction(d, ENVMAP_CUBE, *face, u, v);
    *face = envmapi_face(ENVMAP_CUBE, d);
    envmapi_project(uv, ENVMAP_CUBE, *face, d);
    *x = (int)envmapi_clamp(floor(uv[0] * edge), 0, edge - 1);
    *y = (int)envmapi_clamp(floor(uv[1] * edge), 0, edge - 1);
}

/* The sphere and angular maps clamp to the rim: to a texel whose centre is inside, so that what a
   file holds outside the circle never matters. */
static void envmapi_rim_neighbour(int *x, int *y, int edge) {
    double X = (2 * *x + 1.0) / edge - 1, Y = (2 * *y + 1.0) / edge - 1, r = sqrt(X * X + Y * Y);
    if (r <= 1) return;
    *x = (int)envmapi_clamp(floor((0.5 + 0.5 * X * (1 - 1.5 / edge) / r) * edge), 0, edge - 1);
    *y = (int)envmapi_clamp(floor((0.5 + 0.5 * Y * (1 - 1.5 / edge) / r) * edge), 0, edge - 1);
}

static void envmapi_add_tap(double rgb[3], const envmapi_level *level, int face, int x, int y,
                            double weight) {
    int edge = level->edge, width = level->width;
    if (level->mapping == ENVMAP_CUBE) {
        if (x < 0 || y < 0 || x >= edge || y >= edge) envmapi_cube_neighbour(&face, &x, &y, edge);
    } else {
        if (level->mapping == ENVMAP_LATLONG) x = (x + width) % width;
        x = x < 0 ? 0 : x >= width ? width - 1 : x;
        y = y < 0 ? 0 : y >= edge ? edge - 1 : y;
        if (level->mapping == ENVMAP_SPHERE || level->mapping == ENVMAP_ANGULAR)
            envmapi_rim_neighbour(&x, &y, edge);
    }
    const float *texel = level->texels + 3 * (((size_t)face * (size_t)edge + (size_t)y) *
                                                  (size_t)width + (size_t)x);
    for (int c = 0; c < 3; ++c) rgb[c] += weight * (double)texel[c];
}

/* A lat-long pole is one direction: the mean of its row. */
static void envmapi_add_pole(double rgb[3], const envmapi_level *level, int y, double weight) {
    for (int x = 0; x < level->width; ++x)
        envmapi_add_tap(rgb, level, 0, x, y, weight / level->width);
}

/* rgb += weight times the bilinear value at (u,v) of a face. Beyond a cube's corner there is no
   texel: the mean of the three that meet there stands in, which is continuous. */
static void envmapi_add_bilinear(double rgb[3], const envmapi_level *level, int face, double u,
                                 double v, double weight) {
    double s = u * level->width - 0.5, t = v * level->edge - 0.5;
    int x = (int)floor(s), y = (int)floor(t), n = level->edge;
    double fx = s - x, fy = t - y, pole = 0;
    if (level->mapping == ENVMAP_LATLONG && (y < 0 || y >= n - 1)) {
        double beyond = t < 0 ? -2 * t : t > n - 1 ? 2 * (t - (n - 1)) : 0;
        if (beyond > 0) {
            pole = beyond, y = t < 0 ? 0 : n - 1, fy = 0;
            envmapi_add_pole(rgb, level, y, weight * pole);
        }
    }
    double taps[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}, corner = 0;
    int off_cube[4], at_corner = 0;
    for (int i = 0; i < 4; ++i) {
        int tx = x + (i & 1), ty = y + (i >> 1);
        off_cube[i] = level->mapping == ENVMAP_CUBE && (tx < 0 || tx >= n) && (ty < 0 || ty >= n);
        if (off_cube[i]) corner = taps[i] / 3, at_corner = 1;
    }
    for (int i = 0; i < 4; ++i) {
        double tap = taps[i] + (at_corner ? corner : 0);
        if (tap > 0 && !off_cube[i])
            envmapi_add_tap(rgb, level, face, x + (i & 1), y + (i >> 1), tap * weight * (1 - pole));
    }
}

/* Bilinear in direction d. In the last half texel before the rim the paraboloids blend, to half
   and half on it, so that front and back agree there. */
static void envmapi_add_lookup(double rgb[3], const envmapi_level *level, const double d[3],
                               double weight) {
    int face = envmapi_face(level->mapping, d);
    double uv[2], other = 0;
    envmapi_project(uv, level->mapping, face, d);
    if (level->mapping == ENVMAP_PARABOLOID) {
        double r = sqrt((1 - fabs(d[2])) / (1 + fabs(d[2]))), inside = (1 - r) * level->edge;
        if (inside < 1) {
            double across[2];
            other = 0.5 * (1 - inside);
            envmapi_project(across, ENVMAP_PARABOLOID, 1 - face, d);
            envmapi_add_bilinear(rgb, level, 1 - face, across[0], across[1], weight * other);
        }
    }
    envmapi_add_bilinear(rgb, level, face, uv[0], uv[1], weight * (1 - other));
}

static void envmapi_add_trilinear(double rgb[3], const envmap *map, int slice, const double d[3],
                                  double level, double weight) {
    int lower = (int)level;
    double f = level - lower;
    envmapi_level a = envmapi_level_of(map, lower, slice);
    envmapi_add_lookup(rgb, &a, d, weight * (1 - f));
    if (f > 0) {
        a = envmapi_level_of(map, lower + 1, slice);
        envmapi_add_lookup(rgb, &a, d, weight * f);
    }
}

ENVMAPI_BODY void envmap_lookup_slice(float rgb[3], const envmap *map, const float dir[3], float p,
                                      float level) {
    double sum[3] = {0, 0, 0}, d[3];
    if (!rgb) return;
    if (envmapi_valid(map) && dir) {
        double l = level > 0 ? envmapi_clamp((double)level, 0, map->levels - 1) : 0, s = 0;
        double range = (double)map->p1 - (double)map->p0;
        envmapi_unit_float(d, dir);
        if (envmapi_finite((double)p) && envmapi_finite(range) && fabs(range) > 0)
            s = envmapi_clamp(((double)p - (double)map->p0) / range * map->slices - 0.5, 0,
                              map->slices - 1);
        double f = s - (int)s;
        envmapi_add_trilinear(sum, map, (int)s, d, envmapi_finite(l) ? l : 0, 1 - f);
        if (f > 0) envmapi_add_trilinear(sum, map, (int)s + 1, d, envmapi_finite(l) ? l : 0, f);
    }
    for (int c = 0; c < 3; ++c) rgb[c] = (float)sum[c];
}

ENVMAPI_BODY void envmap_lookup(float rgb[3], const envmap *map, const float dir[3], float level) {
    envmap first;
    if (!map) {
        envmap_lookup_slice(rgb, NULL, dir, 0, level);
        return;
    }
    first = *map;
    first.p1 = first.p0; /* no p: slice 0 */
    envmap_lookup_slice(rgb, &first, dir, 0, level);
}

/* The longer side, in texels of a face of edge `edge`, between the directions a and b seen on the
   face of d. */
static double envmapi_span(int mapping, int edge, const double d[3], const double a[3],
                           const double b[3]) {
    double from[2], to[2];
    int face = envmapi_face(mapping, d);
    envmapi_project(from, mapping, face, a);
    envmapi_project(to, mapping, face, b);
    double du = to[0] - from[0], dv = to[1] - from[1];
    if (mapping == ENVMAP_LATLONG) du -= floor(du + 0.5);
    du *= envmapi_width(mapping, edge), dv *= edge;
    return sqrt(du * du + dv * dv);
}

/* d(solid angle) / du dv */
static double envmapi_density(int mapping, double u, double v) {
    double X = 2 * u - 1, Y = 2 * v - 1, rr = X * X + Y * Y;
    if (mapping == ENVMAP_CUBE) return 4 / ((1 + rr) * sqrt(1 + rr));
    if (mapping == ENVMAP_LATLONG) return 2 * ENVMAPI_PI * ENVMAPI_PI * sin(ENVMAPI_PI * v);
    if (mapping == ENVMAP_PARABOLOID) return 16 / ((1 + rr) * (1 + rr));
    if (mapping == ENVMAP_SPHERE) return 16;
    double r = sqrt(rr);
    return r > 1e-9 ? 4 * ENVMAPI_PI * sin(ENVMAPI_PI * r) / r : 4 * ENVMAPI_PI * ENVMAPI_PI;
}

/* Points along one side of a texel of dst: three to a texel of src where it shrinks, or one bright
   texel would be met twice or not at all (bilinear tents met at a third of their half-width add up
   to within 0.7 %). The span of the midline is taken in pieces: a rim or pole may bend it back. */
static int envmapi_samples(const envmap *dst, const envmap *src, int face, int x, int y,
                           int along_v) {
    double a[3], b[3], middle[3], w = envmapi_width(dst->mapping, dst->size), h = dst->size;
    double u = (x + 0.5) / w, v = (y + 0.5) / h, span = 0;
    int pieces = envmapi_is_disc(dst->mapping) ? 8 : 2;
    for (int i = 0; i <= 2 * pieces; ++i) {
        double t = (double)i / (2 * pieces) - 0.5;
        envmapi_direction(b, dst->mapping, face, along_v ? u : u + t / w, along_v ? v + t / h : v);
        if (i & 1) memcpy(middle, b, sizeof middle);
        if (i > 0 && !(i & 1)) span += envmapi_span(src->mapping, src->size, middle, a, b);
        if (!(i & 1)) memcpy(a, b, sizeof a);
    }
    return span > 1.01 ? (int)envmapi_clamp(ceil(3 * span - 0.01), 2, 6.0 * src->size) : 1;
}

/* The mean of src over a texel of dst, weighted by solid angle; outside a rim's circle only the
   points inside count, if there are any. */
static void envmapi_resample_texel(double rgb[3], const envmap *dst, const envmapi_level *level,
                                   const envmap *src, int face, int x, int y) {
    double w = envmapi_width(dst->mapping, dst->size), h = dst->size, d[3], sum = 0;
    int cut = envmapi_is_disc(dst->mapping) &&
              envmapi_texel_cell(NULL, dst->mapping, dst->size, x, y) > 0;
    int n_u = envmapi_samples(dst, src, face, x, y, 0),
        n_v = envmapi_samples(dst, src, face, x, y, 1);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < n_u * n_v; ++i) {
        double u = (x + (i % n_u + 0.5) / n_u) / w, v = (y + (i / n_u + 0.5) / n_v) / h;
        double X = 2 * u - 1, Y = 2 * v - 1;
        if (cut && n_u * n_v > 1 && X * X + Y * Y > 1) continue;
        double weight = envmapi_density(dst->mapping, u, v);
        envmapi_direction(d, dst->mapping, face, u, v);
        envmapi_add_lookup(rgb, level, d, weight);
        sum += weight;
    }
    if (!(sum > 0)) { /* outside the angular map's circle, or a sliver between the points */
        rgb[0] = rgb[1] = rgb[2] = 0;
        envmapi_texel_direction(d, dst->mapping, face, dst->size, x, y);
        envmapi_add_lookup(rgb, level, d, sum = 1);
    }
    for (int c = 0; c < 3; ++c) rgb[c] /= sum;
}

/* NaN and Inf, and negative numbers unless they are allowed, have no place in level 0. */
static int envmapi_radiance_ok(const envmap *map, int negative_too) {
    size_t count = 3 * envmapi_area(map->mapping, map->size) * (size_t)envmap_faces(map->mapping) *
                   (size_t)map->slices;
    int bad = 0;
    for (size_t i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, map->texels + i, sizeof bits);
        bad |= (bits & 0x7F800000u) == 0x7F800000u || (!negative_too && bits > 0x80000000u);
    }
    return !bad;
}

/* dst and src are two valid maps that share no texels, and slices fit. */
static int envmapi_pair_ok(const envmap *dst, const envmap *src) {
    return envmapi_valid(dst) && envmapi_valid(src) && dst != src && dst->texels != src->texels &&
           (src->slices == 1 || src->slices == dst->slices);
}

static void envmapi_resample_slice(envmap *dst, const envmap *src, int slice) {
    envmapi_level level = envmapi_level_of(src, 0, src->slices > 1 ? slice : 0);
    int width = envmapi_width(dst->mapping, dst->size);
    for (int face = 0; face < envmap_faces(dst->mapping); ++face) {
        float *out = envmapi_image(dst, 0, slice, face);
        for (int i = 0; i < width * dst->size; ++i, out += 3) {
            double rgb[3];
            envmapi_resample_texel(rgb, dst, &level, src, face, i % width, i / width);
            for (int c = 0; c < 3; ++c) out[c] = (float)rgb[c];
        }
    }
}

ENVMAPI_BODY envmap_result envmap_resample(envmap *dst, const envmap *src) {
    if (!envmapi_pair_ok(dst, src)) return ENVMAP_ERROR_ARGUMENT;
    if (!envmapi_radiance_ok(src, 1)) return ENVMAP_ERROR_RADIANCE;
    size_t slice_floats =
        3 * envmapi_area(dst->mapping, dst->size) * (size_t)envmap_faces(dst->mapping);
    for (int slice = 0; slice < dst->slices; ++slice) {
        if (dst->mapping == src->mapping && dst->size == src->size)
            memcpy(envmapi_image(dst, 0, slice, 0),
                   envmapi_image(src, 0, src->slices > 1 ? slice : 0, 0),
                   slice_floats * sizeof(float));
        else if (slice > 0 && src->slices == 1)
            memcpy(envmapi_image(dst, 0, slice, 0), dst->texels, slice_floats * sizeof(float));
        else
            envmapi_resample_slice(dst, src, slice);
    }
    return ENVMAP_OK;
}

/* ------------------------------------------------------------------------------------- >>pfm --
   "PF" or "Pf", width, height, scale, one white space, then rows from the bottom up. Upside up,
   the strip of slices and faces is the memory order itself. Numbers are parsed and bytes put
   together here, so that neither locale nor host matters; sizes are checked before anything is
   allocated.  Tests: tests/test_pfm.c. */

typedef struct envmapi_reader {
    const unsigned char *data;
    size_t bytes, at;
} envmapi_reader;

/* The next byte, or -1 at the end. */
static int envmapi_peek(const envmapi_reader *in) {
    return in->at < in->bytes ? in->data[in->at] : -1;
}

static int envmapi_is_space(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/* White space and comments, "#" to the end of the line; at least one byte of them. */
static envmap_result envmapi_pfm_space(envmapi_reader *in) {
    size_t start = in->at;
    for (;; ++in->at) {
        int c = envmapi_peek(in);
        if (c == '#')
            while (c >= 0 && c != '\n' && c != '\r') ++in->at, c = envmapi_peek(in);
        if (!envmapi_is_space(c)) break;
    }
    if (envmapi_peek(in) < 0) return ENVMAP_ERROR_TRUNCATED;
    return in->at > start ? ENVMAP_OK : ENVMAP_ERROR_FORMAT;
}

/* A positive integer; more than nine digits are beyond every limit. */
static envmap_result envmapi_pfm_integer(envmapi_reader *in, int *value) {
    int n = 0, digits = 0, c;
    for (; (c = envmapi_peek(in)) >= '0' && c <= '9'; ++in->at) {
        if (n > 0 || c > '0') ++digits;
        if (digits <= 9) n = 10 * n + (c - '0');
    }
    if (c < 0) return ENVMAP_ERROR_TRUNCATED;
    if (digits > 9) return ENVMAP_ERROR_LIMIT;
    *value = n;
    return n > 0 ? ENVMAP_OK : ENVMAP_ERROR_FORMAT;
}

/* [+-] digits [. digits] [e [+-] digits] */
static envmap_result envmapi_pfm_number(envmapi_reader *in, double *value) {
    int c = envmapi_peek(in), negative = c == '-', digits = 0, shift = 0, exponent = 0, point = 0;
    double mantissa = 0;
    if (c == '-' || c == '+') ++in->at;
    for (; (c = envmapi_peek(in)) == '.' || (c >= '0' && c <= '9'); ++in->at) {
        if (c == '.' && point++) return ENVMAP_ERROR_FORMAT;
        if (c == '.') continue;
        ++digits;
        if (mantissa < 1e17) mantissa = 10 * mantissa + (c - '0'), shift -= point;
        else shift += !point;
    }
    if (c < 0) return ENVMAP_ERROR_TRUNCATED;
    if (!digits) return ENVMAP_ERROR_FORMAT;
    if (c == 'e' || c == 'E') {
        ++in->at;
        int down = (c = envmapi_peek(in)) == '-', seen = 0;
        if (c == '-' || c == '+') ++in->at;
        for (; (c = envmapi_peek(in)) >= '0' && c <= '9'; ++in->at, seen = 1)
            if (exponent < 10000) exponent = 10 * exponent + (c - '0');
        if (c < 0) return ENVMAP_ERROR_TRUNCATED;
        if (!seen) return ENVMAP_ERROR_FORMAT;
        if (down) exponent = -exponent;
    }
    *value = mantissa * pow(10.0, envmapi_clamp((double)exponent + shift, -400, 400));
    if (negative) *value = -*value;
    return ENVMAP_OK;
}

typedef struct envmapi_pfm {
    int width, height, channels, size, slices;
    double scale;
} envmapi_pfm;

/* Which map a picture of this shape is. */
static envmap_result envmapi_pfm_shape(envmapi_pfm *pfm, int mapping) {
    int faces = envmap_faces(mapping), edge = mapping == ENVMAP_LATLONG ? pfm->height : pfm->width;
    uint64_t strip = (uint64_t)faces * (uint64_t)edge;
    pfm->size = edge;
    pfm->slices = (int)((uint64_t)pfm->height / strip);
    if (mapping == ENVMAP_LATLONG && (uint64_t)pfm->width != 2 * (uint64_t)edge)
        return ENVMAP_ERROR_SHAPE;
    if ((uint64_t)pfm->height % strip || !pfm->slices) return ENVMAP_ERROR_SHAPE;
    return edge > ENVMAPI_SIZE_LIMIT ? ENVMAP_ERROR_LIMIT : ENVMAP_OK;
}

static envmap_result envmapi_pfm_header(envmapi_reader *in, envmapi_pfm *pfm, int mapping) {
    envmap_result result;
    if (in->bytes < 2) return ENVMAP_ERROR_TRUNCATED;
    if (in->data[0] != 'P' || (in->data[1] != 'F' && in->data[1] != 'f'))
        return ENVMAP_ERROR_FORMAT;
    pfm->channels = in->data[1] == 'F' ? 3 : 1;
    in->at = 2;
    if ((result = envmapi_pfm_space(in)) || (result = envmapi_pfm_integer(in, &pfm->width)) ||
        (result = envmapi_pfm_space(in)) || (result = envmapi_pfm_integer(in, &pfm->height)) ||
        (result = envmapi_pfm_space(in)) || (result = envmapi_pfm_number(in, &pfm->scale)))
        return result;
    int after = envmapi_peek(in);
    if (!envmapi_is_space(after)) return ENVMAP_ERROR_FORMAT;
    ++in->at;
    if (!envmapi_finite(pfm->scale) || !(fabs(pfm->scale) > 0)) return ENVMAP_ERROR_FORMAT;
    if ((result = envmapi_pfm_shape(pfm, mapping))) return result;
    uint64_t need = (uint64_t)pfm->width * (uint64_t)pfm->height * (uint64_t)pfm->channels * 4;
    uint64_t have = in->bytes - in->at;
    if (after == '\r' && envmapi_peek(in) == '\n') ++in->at, --have; /* one line end */
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
                                           envmap_mapping mapping) {
    envmapi_reader in = {(const unsigned char *)data, bytes, 0};
    envmapi_pfm pfm;
    envmap_result result;
    if (!map || !data || !envmap_faces((int)mapping)) return ENVMAP_ERROR_ARGUMENT;
    if ((result = envmapi_pfm_header(&in, &pfm, (int)mapping))) return result;
    if ((result = envmap_create(map, mapping, pfm.size, 1, pfm.slices))) return result;
    const unsigned char *sample = in.data + in.at;
    float factor = (float)envmapi_clamp(fabs(pfm.scale), 1e-38, 3e38);
    for (int y = pfm.height - 1; y >= 0; --y) {
        float *row = map->texels + 3 * (size_t)y * (size_t)pfm.width;
        for (int i = 0; i < 3 * pfm.width; ++i) {
            row[i] = factor * envmapi_pfm_sample(sample, pfm.scale < 0);
            if (pfm.channels == 3 || i % 3 == 2) sample += 4;
        }
    }
    return ENVMAP_OK;
}

static size_t envmapi_pfm_decimal(char *out, size_t at, size_t value) {
    char digits[24];
    size_t n = 0;
    do digits[n++] = (char)('0' + value % 10);
    while (value /= 10);
    while (n) out[at++] = digits[--n];
    return at;
}

/* The header of a picture; returns its length, below 64. */
static size_t envmapi_pfm_title(char title[64], size_t width, size_t height) {
    size_t at = 3;
    memcpy(title, "PF\n", 3);
    at = envmapi_pfm_decimal(title, at, width);
    title[at++] = ' ';
    at = envmapi_pfm_decimal(title, at, height);
    memcpy(title + at, "\n-1.0\n", 6);
    return at + 6;
}

static void envmapi_pfm_encode(unsigned char *out, const float *samples, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, samples + i, sizeof bits);
        for (int b = 0; b < 4; ++b) *out++ = (unsigned char)(bits >> (8 * b));
    }
}

/* Rows and columns of the strip that one level makes; 0 when it cannot be written. */
static size_t envmapi_pfm_rows(size_t *width, const envmap *map, int level) {
    if (!envmapi_valid(map) || level < 0 || level >= map->levels) return 0;
    if (map->mapping == ENVMAP_LATLONG && map->slices > 1) return 0;
    int edge = envmapi_edge(map->size, level);
    *width = (size_t)envmapi_width(map->mapping, edge);
    return (size_t)edge * (size_t)envmap_faces(map->mapping) * (size_t)map->slices;
}

ENVMAPI_BODY envmap_result envmap_pfm_write(void *data, size_t capacity, size_t *bytes,
                                            const envmap *map, int level) {
    char title[64];
    size_t width = 0, rows = envmapi_pfm_rows(&width, map, level);
    if (!rows || (!data && !bytes)) return ENVMAP_ERROR_ARGUMENT;
    size_t start = envmapi_pfm_title(title, width, rows), row = 12 * width;
    if (bytes) *bytes = start + rows * row;
    if (!data) return ENVMAP_OK;
    if (capacity < start + rows * row) return ENVMAP_ERROR_LIMIT;
    unsigned char *out = (unsigned char *)data;
    const float *samples = envmapi_image(map, level, 0, 0);
    memcpy(out, title, start);
    for (size_t y = 0; y < rows; ++y)
        envmapi_pfm_encode(out + start + y * row, samples + 3 * width * (rows - 1 - y), 3 * width);
    return ENVMAP_OK;
}

#ifndef ENVMAP_NO_STDIO
/* The whole file in memory, its size first, so that no header can make us allocate more. */
ENVMAPI_BODY envmap_result envmap_pfm_load(envmap *map, const char *path, envmap_mapping mapping) {
    envmap_result result = ENVMAP_ERROR_FILE;
    if (!map || !path || !envmap_faces((int)mapping)) return ENVMAP_ERROR_ARGUMENT;
    FILE *file = fopen(path, "rb");
    if (!file) return ENVMAP_ERROR_FILE;
    long bytes = fseek(file, 0, SEEK_END) ? -1 : ftell(file);
    if (bytes >= 0 && bytes < LONG_MAX && !fseek(file, 0, SEEK_SET)) {
        /* one byte more, so that an empty file is not a failed allocation */
        void *data = (uint64_t)bytes > 2 * ENVMAPI_BYTE_LIMIT
                         ? NULL
                         : ENVMAP_MALLOC(map->memory, (size_t)bytes + 1);
        if (!data)
            result = ENVMAP_ERROR_MEMORY;
        else if (fread(data, 1, (size_t)bytes, file) == (size_t)bytes)
            result = envmap_pfm_read(map, data, (size_t)bytes, mapping);
        if (data) ENVMAP_FREE(map->memory, data);
    }
    fclose(file);
    return result;
}

static int envmapi_pfm_put(FILE *file, const envmap *map, int level, size_t width, size_t rows) {
    unsigned char chunk[3072];
    const float *samples = envmapi_image(map, level, 0, 0);
    for (size_t y = rows; y-- > 0;)
        for (size_t x = 0; x < 3 * width; x += sizeof chunk / 4) {
            size_t count = 3 * width - x < sizeof chunk / 4 ? 3 * width - x : sizeof chunk / 4;
            envmapi_pfm_encode(chunk, samples + 3 * width * y + x, count);
            if (fwrite(chunk, 4, count, file) != count) return 0;
        }
    return 1;
}

/* Something with a length: a device must not be removed. */
static int envmapi_pfm_is_file(const char *path) {
    FILE *file = fopen(path, "rb");
    if (!file) return 0;
    int is_file = !fseek(file, 0, SEEK_END) && ftell(file) > 0;
    fclose(file);
    return is_file;
}

ENVMAPI_BODY envmap_result envmap_pfm_save(const envmap *map, const char *path, int level) {
    char title[64];
    size_t width = 0, rows = envmapi_pfm_rows(&width, map, level);
    if (!rows || !path) return ENVMAP_ERROR_ARGUMENT;
    FILE *file = fopen(path, "wb");
    if (!file) return ENVMAP_ERROR_FILE;
    size_t start = envmapi_pfm_title(title, width, rows);
    int whole = fwrite(title, 1, start, file) == start;
    whole = whole && envmapi_pfm_put(file, map, level, width, rows);
    whole = fclose(file) == 0 && whole;
    if (!whole && envmapi_pfm_is_file(path)) remove(path);
    return whole ? ENVMAP_OK : ENVMAP_ERROR_FILE;
}
#endif

/* ------------------------------------------------------------------------------------ >>mips --
   parent = sum over children of w(overlap) child / sum w(overlap), w the solid angle of the
   overlap of the nested texels: so w(parent) parent = sum w(child) child, and every level carries
   the same energy. A parent wholly outside a rim takes the plain mean of what lies under it.
   Tests: tests/test_mips.c. */

/* The children of parent texel i along one side, with the ends of their overlap in [0,1]. */
static int envmapi_nested(double ends[5], int *first, int i, int parents, int children) {
    double from = (double)i / parents, to = (double)(i + 1) / parents;
    int n = 0;
    /* integers decide which child is first and last: no rounding */
    *first = (int)((int64_t)i * children / parents);
    int last = (int)(((int64_t)(i + 1) * children + parents - 1) / parents);
    for (int j = *first; j < last && n < 4; ++j, ++n) {
        ends[n] = j == *first ? from : (double)j / children;
        ends[n + 1] = j + 1 == last ? to : (double)(j + 1) / children;
    }
    return n;
}

/* Texel (x,y) of every face and slice of a level, from the level above. */
static void envmapi_mip_texel(envmap *map, int level, int x, int y) {
    int mapping = map->mapping, child = envmapi_edge(map->size, level - 1);
    int edge = envmapi_edge(map->size, level), x0, y0;
    int width = envmapi_width(mapping, edge), above = envmapi_width(mapping, child);
    double ends_u[5], ends_v[5], weights[16], sum = 0, inside = 0;
    int n_u = envmapi_nested(ends_u, &x0, x, width, above);
    int n_v = envmapi_nested(ends_v, &y0, y, edge, child), n = n_u * n_v;
    for (int pass = 0; pass < 2 && !(inside > 0); ++pass, sum = inside)
        for (int i = 0; i < n; ++i) {
            double u0 = ends_u[i % n_u], u1 = ends_u[i % n_u + 1];
            double v0 = ends_v[i / n_u], v1 = ends_v[i / n_u + 1];
            weights[i] = pass ? (u1 - u0) * (v1 - v0) : envmapi_cell(NULL, mapping, u0, v0, u1, v1);
            inside += weights[i];
        }
    for (int image = 0; image < envmap_faces(mapping) * map->slices; ++image) {
        const float *from = envmapi_image(map, level - 1, 0, 0) +
                            3 * (size_t)image * envmapi_area(mapping, child);
        float *to = envmapi_image(map, level, 0, 0) +
                    3 * (size_t)image * envmapi_area(mapping, edge) +
                    3 * ((size_t)y * (size_t)width + (size_t)x);
        double rgb[3] = {0, 0, 0};
        for (int i = 0; i < n; ++i) {
            size_t at = (size_t)(y0 + i / n_u) * (size_t)above + (size_t)(x0 + i % n_u);
            for (int c = 0; c < 3; ++c) rgb[c] += weights[i] * (double)from[3 * at + (size_t)c];
        }
        for (int c = 0; c < 3; ++c) to[c] = (float)(rgb[c] / sum);
    }
}

/* The mean of the sphere from one level of a slice, written to every texel of the next. */
static void envmapi_mip_top(envmap *map, int level, int slice) {
    int edge = envmapi_edge(map->size, level - 1), width = envmapi_width(map->mapping, edge);
    int faces = envmap_faces(map->mapping);
    const float *from = envmapi_image(map, level - 1, slice, 0);
    float *to = envmapi_image(map, level, slice, 0);
    double rgb[3] = {0, 0, 0}, sum = 0;
    for (int i = 0; i < width * edge; ++i) {
        double w = envmapi_texel_cell(NULL, map->mapping, edge, i % width, i / width);
        for (int face = 0; face < faces; ++face, sum += w)
            for (int c = 0; c < 3; ++c)
                rgb[c] += w * (double)from[3 * (face * width * edge + i) + c];
    }
    for (int i = 0; i < faces * envmapi_width(map->mapping, 1); ++i)
        for (int c = 0; c < 3; ++c) to[3 * i + c] = (float)(rgb[c] / sum);
}

ENVMAPI_BODY envmap_result envmap_mips_build(envmap *map) {
    if (!envmapi_valid(map)) return ENVMAP_ERROR_ARGUMENT;
    for (int level = 1; level < map->levels; ++level) {
        int edge = envmapi_edge(map->size, level), width = envmapi_width(map->mapping, edge);
        if (edge == 1)
            for (int slice = 0; slice < map->slices; ++slice) envmapi_mip_top(map, level, slice);
        else
            for (int i = 0; i < width * edge; ++i)
                envmapi_mip_texel(map, level, i % width, i / width);
    }
    return ENVMAP_OK;
}

/* Texels of level 0 that a small step along `side` at d spans, per unit of the step. */
static double envmapi_footprint_side(const envmap *map, const double d[3], const double side[3]) {
    double length = sqrt(envmapi_dot(side, side)), a[3], b[3];
    if (!(length > 0) || !envmapi_finite(length)) return 0;
    double step = 1e-4 / length;
    for (int i = 0; i < 3; ++i) a[i] = d[i] - step * side[i], b[i] = d[i] + step * side[i];
    envmapi_unit(a, a), envmapi_unit(b, b);
    return envmapi_span(map->mapping, map->size, d, a, b) / (2 * step);
}

ENVMAPI_BODY float envmap_footprint_level(const envmap *map, const float dir[3], const float dx[3],
                                          const float dy[3]) {
    double d[3], x[3], y[3];
    if (!envmapi_valid(map) || !dir || !dx || !dy) return 0;
    double length = 0, sides = 0;
    for (int i = 0; i < 3; ++i) {
        length += (double)dir[i] * (double)dir[i];
        sides += fabs((double)dx[i]) + fabs((double)dy[i]);
    }
    length = sqrt(length);
    if (!(length > 0) || !envmapi_finite(length) || !envmapi_finite(sides)) return 0;
    envmapi_unit_float(d, dir);
    for (int i = 0; i < 3; ++i) x[i] = (double)dx[i] / length, y[i] = (double)dy[i] / length;
    double a = envmapi_footprint_side(map, d, x), b = envmapi_footprint_side(map, d, y);
    double texels = a > b ? a : b;
    return texels > 1 ? (float)envmapi_clamp(log2(texels), 0, map->levels - 1) : 0;
}

/* The axes of the ellipse { d + cos(t) dx + sin(t) dy } as texels of level 0 see it: the longer and
   the shorter as sides of directions; returns the ratio of their lengths, 1 where there is none.
   From |dx|^2, |dy|^2 and dx.dy in texels; the last by |dx + dy|^2. */
static double envmapi_footprint_axes(float major[3], float minor[3], const envmap *map,
                                     const float dir[3], const float dx[3], const float dy[3]) {
    double d[3] = {(double)dir[0], (double)dir[1], (double)dir[2]}, x[3], y[3], both[3];
    double length = sqrt(envmapi_dot(d, d));
    envmapi_unit_float(d, dir);
    for (int i = 0; i < 3; ++i) {
        x[i] = (double)dx[i] / length, y[i] = (double)dy[i] / length;
        both[i] = x[i] + y[i];
    }
    double a = envmapi_footprint_side(map, d, x), b = envmapi_footprint_side(map, d, y);
    double sum = envmapi_footprint_side(map, d, both), cross = (sum * sum - a * a - b * b) / 2;
    double turn = 0.5 * atan2(2 * cross, a * a - b * b), c = cos(turn), s = sin(turn);
    for (int i = 0; i < 3; ++i) {
        major[i] = (float)((c * x[i] + s * y[i]) * length);
        minor[i] = (float)((c * y[i] - s * x[i]) * length);
    }
    double mean = (a * a + b * b) / 2, half = (a * a - b * b) / 2;
    double swing = sqrt(half * half + cross * cross);
    double longer = sqrt(mean + swing), shorter = sqrt(envmapi_clamp(mean - swing, 1, 1e30));
    return longer > shorter ? longer / shorter : 1;
}

ENVMAPI_BODY void envmap_lookup_footprint(float rgb[3], const envmap *map, const float dir[3],
                                          const float dx[3], const float dy[3], int probes) {
    float level = envmap_footprint_level(map, dir, dx, dy), major[3], minor[3];
    if (!rgb) return;
    if (!(level > 0) || probes <= 1) {
        envmap_lookup(rgb, map, dir, level);
        return;
    }
    double limit = probes < 256 ? probes : 256, sum[3] = {0, 0, 0};
    int n = (int)envmapi_clamp(
        ceil(envmapi_footprint_axes(major, minor, map, dir, dx, dy) - 0.01), 1, limit);
    for (int c = 0; c < 3; ++c) major[c] /= (float)n;
    for (int i = 0; i < n; ++i) {
        float probe[3], at = (float)i + 0.5f - 0.5f * (float)n;
        for (int c = 0; c < 3; ++c) probe[c] = dir[c] + at * major[c];
        envmap_lookup(rgb, map, probe, envmap_footprint_level(map, probe, major, minor));
        for (int c = 0; c < 3; ++c) sum[c] += (double)rgb[c];
    }
    for (int c = 0; c < 3; ++c) rgb[c] = (float)(sum[c] / n);
}

/* ----------------------------------------------------------------------------------- >>lobes --
   k(x; p), x = cos theta, and what methods ask about it. Integrals over the sphere are
   2 pi sin(theta) k(theta) d theta by Gauss-Legendre on panels between breaks: the ends of the
   support, the kinks, and steps growing by 2 away from theta = 0 and pi, so that a peak is met at
   its own scale whatever that is.
   Banks: with psi = acos(c), k = -cos(theta + psi) - s, over (1-s)^2: a ring at pi - psi whose
   edges are acos(s) off; where the ring covers a pole, k has the tip of a cone there.
   Invariants: lambda_0 = 1 when normalised; closed forms agree with quadrature.
   Tests: tests/test_lobes.c. */

static envmap_lobe envmapi_lobe(int kind, float parameter, float p0, float p1) {
    envmap_lobe lobe;
    memset(&lobe, 0, sizeof lobe);
    lobe.kind = kind, lobe.parameter = parameter, lobe.scale = 1, lobe.p0 = p0, lobe.p1 = p1;
    return lobe;
}

ENVMAPI_BODY envmap_lobe envmap_lobe_mirror(void) {
    return envmapi_lobe(ENVMAP_LOBE_MIRROR, 0, 0, 0);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_diffuse(void) {
    return envmapi_lobe(ENVMAP_LOBE_PHONG, 1, 0, 0);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_phong(float exponent) {
    return envmapi_lobe(ENVMAP_LOBE_PHONG, exponent, 0, 0);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_gaussian(float sharpness) {
    return envmapi_lobe(ENVMAP_LOBE_GAUSSIAN, sharpness, 0, 0);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_ggx(float alpha) {
    return envmapi_lobe(ENVMAP_LOBE_GGX, alpha, 0, 0);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_banks(float s) {
    return envmapi_lobe(ENVMAP_LOBE_BANKS, s, -1, 1);
}

ENVMAPI_BODY envmap_lobe envmap_lobe_function(envmap_lobe_function_type *function, void *user) {
    envmap_lobe lobe = envmapi_lobe(ENVMAP_LOBE_FUNCTION, 0, 0, 0);
    lobe.function = function, lobe.user = user;
    return lobe;
}

ENVMAPI_BODY envmap_lobe envmap_lobe_table(const float *values, int size, int slices, float p0,
                                           float p1) {
    envmap_lobe lobe = envmapi_lobe(ENVMAP_LOBE_TABLE, 0, p0, p1);
    lobe.table = values, lobe.table_size = size, lobe.table_slices = slices;
    return lobe;
}

static int envmapi_lobe_ok(const envmap_lobe *lobe) {
    if (!lobe || !envmapi_finite((double)lobe->scale) || !envmapi_finite((double)lobe->p0) ||
        !envmapi_finite((double)lobe->p1) || !envmapi_finite((double)lobe->parameter))
        return 0;
    double parameter = (double)lobe->parameter;
    switch (lobe->kind) {
    case ENVMAP_LOBE_MIRROR: return 1;
    case ENVMAP_LOBE_PHONG:
    case ENVMAP_LOBE_GAUSSIAN: return parameter >= 0 && parameter <= 1e9;
    case ENVMAP_LOBE_GGX: return parameter >= 0.99e-4 && parameter <= 1;
    case ENVMAP_LOBE_BANKS: return parameter >= 0 && parameter <= 0.99999;
    case ENVMAP_LOBE_FUNCTION:
        if (!lobe->function || lobe->kink_count < 0 || (!lobe->kinks && lobe->kink_count)) return 0;
        for (int i = 0; i < lobe->kink_count; ++i)
            if (!(lobe->kinks[i] > 0 && (double)lobe->kinks[i] < ENVMAPI_PI)) return 0;
        return 1;
    case ENVMAP_LOBE_TABLE: break;
    default: return 0;
    }
    if (!lobe->table || lobe->table_size < 4 || lobe->table_size > 1 << 20 ||
        lobe->table_slices < 1 || lobe->table_slices > ENVMAPI_SLICE_LIMIT)
        return 0;
    int bad = 0;
    for (int i = 0; i < lobe->table_size * lobe->table_slices; ++i)
        bad |= !envmapi_finite((double)lobe->table[i]);
    return !bad;
}

/* The mirror is a lobe, but no function. */
static int envmapi_lobe_has_k(const envmap_lobe *lobe) {
    return envmapi_lobe_ok(lobe) && lobe->kind != ENVMAP_LOBE_MIRROR;
}

/* Catmull-Rom along a row; mirrored at both ends, as a zonal function is. */
static double envmapi_table_row(const envmap_lobe *lobe, int row, double theta) {
    int last = lobe->table_size - 1, tap;
    double t = envmapi_clamp(theta / ENVMAPI_PI, 0, 1) * last;
    int i = t >= last ? last - 1 : (int)t;
    double f = t - i, k[4];
    for (int j = 0; j < 4; ++j) {
        tap = i + j - 1;
        tap = tap < 0 ? -tap : tap > last ? 2 * last - tap : tap;
        k[j] = (double)lobe->table[row * lobe->table_size + tap];
    }
    return k[1] + 0.5 * f * (k[2] - k[0] + f * (2 * k[0] - 5 * k[1] + 4 * k[2] - k[3] +
                                                f * (3 * (k[1] - k[2]) + k[3] - k[0])));
}

static double envmapi_table_k(const envmap_lobe *lobe, double x, double p) {
    double range = (double)lobe->p1 - (double)lobe->p0, s = 0,
           theta = acos(envmapi_clamp(x, -1, 1));
    if (fabs(range) > 0)
        s = envmapi_clamp((p - (double)lobe->p0) / range * lobe->table_slices - 0.5, 0,
                          lobe->table_slices - 1);
    int row = (int)s;
    double k = envmapi_table_row(lobe, row, theta);
    return s > row ? k + (s - row) * (envmapi_table_row(lobe, row + 1, theta) - k) : k;
}

/* k without scale. */
static double envmapi_k(const envmap_lobe *lobe, double x, double p) {
    double a = (double)lobe->parameter;
    switch (lobe->kind) {
    case ENVMAP_LOBE_PHONG: return !(x > 0) ? 0 : a > 0 ? pow(x, a) : 1;
    case ENVMAP_LOBE_GAUSSIAN: return exp(a * (x - 1));
    case ENVMAP_LOBE_GGX: {
        double q = a * a * (1 + x) / 2 + (1 - x) / 2; /* (alpha^2-1) c^2 + 1, c^2 = (1+x)/2 */
        return x > 0 ? a * a / (ENVMAPI_PI * q * q) * x : 0;
    }
    case ENVMAP_LOBE_BANKS: {
        double sines = (1 - x * x) * (1 - p * p);
        double k = (sines > 0 ? sqrt(sines) : 0) - x * p - a;
        return k > 0 ? k / ((1 - a) * (1 - a)) : 0;
    }
    case ENVMAP_LOBE_FUNCTION: return lobe->function(x, p, lobe->user);
    case ENVMAP_LOBE_TABLE: return envmapi_table_k(lobe, x, p);
    default: return 0;
    }
}

/* The same for n cosines: loops that a compiler can vectorise where that is easy. */
static void envmapi_k_many(double *k, const double *x, int n, const envmap_lobe *lobe, double p) {
    double a = (double)lobe->parameter;
    if (lobe->kind == ENVMAP_LOBE_PHONG && a >= 1 && a <= 1) {
        for (int i = 0; i < n; ++i) k[i] = x[i] > 0 ? x[i] : 0;
    } else if (lobe->kind == ENVMAP_LOBE_BANKS) {
        double scale = 1 / ((1 - a) * (1 - a));
        for (int i = 0; i < n; ++i) {
            double sines = (1 - x[i] * x[i]) * (1 - p * p);
            double ring = sqrt(sines > 0 ? sines : 0) - x[i] * p - a;
            k[i] = ring > 0 ? ring * scale : 0;
        }
    } else {
        for (int i = 0; i < n; ++i) k[i] = envmapi_k(lobe, x[i], p);
    }
}

static double envmapi_acos(double x) { return acos(envmapi_clamp(x, -1, 1)); }

ENVMAPI_BODY double envmap_lobe_value(const envmap_lobe *lobe, double x, double p) {
    if (!envmapi_lobe_has_k(lobe)) return 0;
    return (double)lobe->scale * envmapi_k(lobe, envmapi_clamp(x, -1, 1), p);
}

ENVMAPI_BODY void envmap_lobe_support(double *from, double *to, const envmap_lobe *lobe, double p) {
    double low = 0, high = ENVMAPI_PI, log_tiny = 27.631; /* -ln 1e-12 */
    if (!from || !to) return;
    *from = *to = 0;
    if (!envmapi_lobe_has_k(lobe)) return;
    double a = (double)lobe->parameter;
    if (lobe->kind == ENVMAP_LOBE_GGX) high = ENVMAPI_PI / 2;
    if (lobe->kind == ENVMAP_LOBE_PHONG) high = a > 0 ? acos(exp(-log_tiny / a)) : ENVMAPI_PI / 2;
    if (lobe->kind == ENVMAP_LOBE_GAUSSIAN && a > log_tiny / 2)
        high = 2 * asin(sqrt(log_tiny / (2 * a)));
    if (lobe->kind == ENVMAP_LOBE_BANKS) {
        double ring = envmapi_acos(-p), edge = acos(a);
        low = ring > edge ? ring - edge : 0;
        high = ring + edge < ENVMAPI_PI ? ring + edge : ENVMAPI_PI;
    }
    *from = low, *to = high;
}

ENVMAPI_BODY int envmap_lobe_kinks(double *angles, int room, const envmap_lobe *lobe, double p) {
    double found[4] = {0, 0, 0, 0};
    int n = 0;
    if (!envmapi_lobe_has_k(lobe)) return 0;
    double a = (double)lobe->parameter;
    if (lobe->kind == ENVMAP_LOBE_FUNCTION) {
        for (; n < lobe->kink_count; ++n)
            if (angles && n < room) angles[n] = (double)lobe->kinks[n];
        return n;
    }
    if ((lobe->kind == ENVMAP_LOBE_PHONG && a < 2) || lobe->kind == ENVMAP_LOBE_GGX)
        found[n++] = ENVMAPI_PI / 2;
    if (lobe->kind == ENVMAP_LOBE_BANKS) {
        double ring = envmapi_acos(-p), edge = acos(a);
        if (ring >= edge) found[n++] = ring - edge;
        else if (ring > 0) found[n++] = 0;
        if (ring + edge <= ENVMAPI_PI) found[n++] = ring + edge;
        else if (ring < ENVMAPI_PI) found[n++] = ENVMAPI_PI;
    }
    for (int i = 0; i < n && i < room; ++i)
        if (angles) angles[i] = found[i];
    return n;
}

/* Walks the Gauss-Legendre nodes of a lobe's support (or a part of it), panel by panel. */
typedef struct envmapi_walk {
    double breaks[128], step; /* panels no longer than step */
    int count, at, piece, pieces, node;
} envmapi_walk;

static void envmapi_walk_break(envmapi_walk *walk, double theta, double from, double to) {
    int i = walk->count;
    if (!(theta > from && theta < to) || i >= 128) return;
    for (; i > 0 && walk->breaks[i - 1] > theta; --i) walk->breaks[i] = walk->breaks[i - 1];
    walk->breaks[i] = theta;
    ++walk->count;
}

static envmapi_walk envmapi_walk_of(const envmap_lobe *lobe, double p, double from, double to,
                                    double step) {
    envmapi_walk walk;
    double low, high, kinks[32];
    memset(&walk, 0, sizeof walk);
    envmap_lobe_support(&low, &high, lobe, p);
    if (from < low) from = low;
    if (to > high) to = high;
    walk.step = lobe->kind == ENVMAP_LOBE_TABLE ? ENVMAPI_PI / (lobe->table_size - 1) : 0.1;
    if (step < walk.step) walk.step /= ceil(walk.step / step);
    if (!(from < to)) return walk;
    walk.count = 2, walk.breaks[0] = from, walk.breaks[1] = to;
    int n = envmap_lobe_kinks(kinks, 32, lobe, p);
    for (int i = 0; i < n && i < 32; ++i) envmapi_walk_break(&walk, kinks[i], from, to);
    /* No lobe of known width has detail a tenth of that. */
    double width = (double)lobe->parameter, finest = 1e-6;
    if (lobe->kind == ENVMAP_LOBE_PHONG || lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        finest = 0.1 / sqrt(width + 1);
    if (lobe->kind == ENVMAP_LOBE_GGX) finest = 0.1 * width;
    /* A table's panels are its own pieces. */
    if (lobe->kind != ENVMAP_LOBE_TABLE)
        for (double scale = 1.6; scale > finest && scale > from / 2; scale /= 2)
            envmapi_walk_break(&walk, scale, from, to);
    if (lobe->kind == ENVMAP_LOBE_FUNCTION)
        for (double scale = 1.2; scale > 1e-6; scale /= 2)
            envmapi_walk_break(&walk, ENVMAPI_PI - scale, from, to);
    return walk;
}

/* The next node and its weight in d theta; 0 at the end. */
static int envmapi_walk_next(envmapi_walk *walk, double *theta, double *weight) {
    if (walk->at + 1 >= walk->count) return 0;
    double from = walk->breaks[walk->at], length = walk->breaks[walk->at + 1] - from;
    if (walk->node == 0 && walk->piece == 0) walk->pieces = 2 + (int)(length / walk->step);
    double piece = length / walk->pieces;
    *weight = envmapi_gauss(theta, walk->node, from + piece * walk->piece,
                            from + piece * (walk->piece + 1));
    if (++walk->node == 8) walk->node = 0, ++walk->piece;
    if (walk->piece == walk->pieces) walk->piece = 0, ++walk->at;
    return 1;
}

/* 2 pi integral of k^power over [-1,1]; of |k| for power 0. */
static double envmapi_lobe_power(const envmap_lobe *lobe, double p, int power) {
    envmapi_walk walk = envmapi_walk_of(lobe, p, 0, ENVMAPI_PI, 1);
    double sum = 0, theta, weight;
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        double k = envmapi_k(lobe, cos(theta), p);
        sum += weight * sin(theta) * (power == 2 ? k * k : power == 0 ? fabs(k) : k);
    }
    return 2 * ENVMAPI_PI * sum;
}

/* The integral without scale: closed forms, else quadrature. */
static double envmapi_lobe_integral(const envmap_lobe *lobe, double p) {
    double a = (double)lobe->parameter;
    if (lobe->kind == ENVMAP_LOBE_PHONG) return 2 * ENVMAPI_PI / (a + 1);
    if (lobe->kind == ENVMAP_LOBE_GAUSSIAN)
        return a > 1e-12 ? -2 * ENVMAPI_PI * expm1(-2 * a) / a : 4 * ENVMAPI_PI;
    if (lobe->kind == ENVMAP_LOBE_BANKS && fabs(p) <= a && a < 0.99)
        return 2 * ENVMAPI_PI * sqrt(1 - p * p) * (acos(a) - a * sqrt(1 - a * a)) /
               ((1 - a) * (1 - a));
    return envmapi_lobe_power(lobe, p, 1);
}

ENVMAPI_BODY double envmap_lobe_integral(const envmap_lobe *lobe, double p) {
    if (!envmapi_lobe_has_k(lobe)) return 0;
    return (double)lobe->scale * envmapi_lobe_integral(lobe, p);
}

/* The integral can be divided by: what is left of k that cancels is rounding. */
static int envmapi_lobe_positive(const envmap_lobe *lobe, double p) {
    double integral = envmapi_lobe_integral(lobe, p);
    if (!envmapi_finite(integral) || !(integral > 0)) return 0;
    if (lobe->kind != ENVMAP_LOBE_FUNCTION && lobe->kind != ENVMAP_LOBE_TABLE) return 1;
    return integral > 1e-9 * envmapi_lobe_power(lobe, p, 0);
}

/* What the filter divides by: 1 raw, one constant for all of Banks' slices; 0 asks for the sum of
   k w over the texels of each axis. */
static double envmapi_lobe_norm(const envmap_lobe *lobe) {
    if (lobe->raw) return 1 / (double)lobe->scale;
    return lobe->kind == ENVMAP_LOBE_BANKS ? envmapi_lobe_integral(lobe, 0) : 0;
}

/* Where k crosses `level` between an angle inside, where it is above, and one outside. */
static double envmapi_lobe_crossing(const envmap_lobe *lobe, double p, double level, double inside,
                                    double outside) {
    for (int i = 0; i < 60; ++i) {
        double middle = 0.5 * (inside + outside);
        if (envmapi_k(lobe, cos(middle), p) < level) outside = middle;
        else inside = middle;
    }
    return outside;
}

/* From the nodes where k exceeds e^(-1/2) of the peak, as far as they hang together with it. */
static double envmapi_lobe_sigma_by_nodes(const envmap_lobe *lobe, double p) {
    double peak = envmapi_k(lobe, 1, p), at = 0, theta, weight, low = -1, high = -1, last = 0;
    envmapi_walk start = envmapi_walk_of(lobe, p, 0, ENVMAPI_PI, 1), walk = start;
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        double k = envmapi_k(lobe, cos(theta), p);
        if (k > peak) peak = k, at = theta;
    }
    double level = 0.60653066 * peak, inside = at;
    walk = start;
    while (high < 0 && envmapi_walk_next(&walk, &theta, &weight)) {
        int below = envmapi_k(lobe, cos(theta), p) < level;
        if (theta < at && below) low = theta;
        if (theta < at && !below && low >= 0 && last <= low) inside = theta; /* first above low */
        if (theta > at && below) high = envmapi_lobe_crossing(lobe, p, level, last, theta);
        last = theta;
    }
    if (high < 0) high = ENVMAPI_PI;
    return low < 0 ? high : 0.5 * (high - envmapi_lobe_crossing(lobe, p, level, inside, low));
}

ENVMAPI_BODY double envmap_lobe_sigma(const envmap_lobe *lobe, double p) {
    if (!envmapi_lobe_has_k(lobe)) return 0;
    double a = (double)lobe->parameter, half = 0.60653066; /* e^(-1/2) */
    switch (lobe->kind) {
    case ENVMAP_LOBE_PHONG: return a > 0 ? 2 * asin(sqrt(-expm1(-0.5 / a) / 2)) : ENVMAPI_PI / 2;
    case ENVMAP_LOBE_GAUSSIAN: return a > 0.25 ? 2 * asin(sqrt(0.25 / a)) : ENVMAPI_PI;
    case ENVMAP_LOBE_BANKS: return acos(a + half * (1 - a));
    default: return envmapi_lobe_sigma_by_nodes(lobe, p);
    }
}

/* max(|k_tt|, |cot t k_t|) from the derivatives in t; no bound where a cone has its tip. */
static double envmapi_curvature_of(double theta, double k_t, double k_tt) {
    double sine = sin(theta), across = fabs(k_tt), along = fabs(k_t);
    if (sine > 0) along *= fabs(cos(theta)) / sine;
    else along = along > 0 ? HUGE_VAL : across;
    return along > across ? along : across;
}

/* The same from the derivatives in x: k_t = -sin t k_x, k_tt = sin^2 t k_xx - cos t k_x. */
static double envmapi_curvature_of_x(double theta, double k_x, double k_xx) {
    double x = cos(theta), along = fabs(x * k_x), across = fabs((1 - x * x) * k_xx - x * k_x);
    return along > across ? along : across;
}

/* At an angle inside the support: closed forms, else central differences over h. */
static double envmapi_curvature_at(const envmap_lobe *lobe, double p, double theta, double h) {
    double n = (double)lobe->parameter, x = cos(theta), k = envmapi_k(lobe, x, p);
    switch (lobe->kind) {
    case ENVMAP_LOBE_PHONG:
        return envmapi_curvature_of_x(theta, n > 0 ? n * pow(x, n - 1) : 0,
                                      n > 0 && !(n >= 1 && n <= 1) ? n * (n - 1) * pow(x, n - 2)
                                                                   : 0);
    case ENVMAP_LOBE_GAUSSIAN: return envmapi_curvature_of_x(theta, n * k, n * n * k);
    case ENVMAP_LOBE_GGX: { /* k = c x / q^2, q' = m */
        double m = (n * n - 1) / 2, q = n * n * (1 + x) / 2 + (1 - x) / 2, c = n * n / ENVMAPI_PI;
        return envmapi_curvature_of_x(theta, c / (q * q) * (1 - 2 * m * x / q),
                                      c * m / (q * q * q) * (6 * m * x / q - 4));
    }
    case ENVMAP_LOBE_BANKS: {
        double d = theta - envmapi_acos(-p), scale = 1 / ((1 - n) * (1 - n));
        return envmapi_curvature_of(theta, -sin(d) * scale, -cos(d) * scale);
    }
    default: break;
    }
    double before = envmapi_k(lobe, cos(theta - h), p), after = envmapi_k(lobe, cos(theta + h), p);
    if (!(theta > h / 2 && theta < ENVMAPI_PI - h / 2))
        return fabs(before - 2 * k + after) / (h * h);
    return envmapi_curvature_of(theta, (after - before) / (2 * h),
                                (before - 2 * k + after) / (h * h));
}

/* At the ends and at the nodes of the walk, four panels to a sigma, with a margin for what lies
   between. Differences keep h away from the ends. */
static double envmapi_curvature_between(const envmap_lobe *lobe, double p, double from, double to,
                                        double sigma) {
    int known = lobe->kind != ENVMAP_LOBE_FUNCTION && lobe->kind != ENVMAP_LOBE_TABLE;
    double low, high, h = 1e-3 * sigma, bound = 0, theta, weight, ends[2];
    envmap_lobe_support(&low, &high, lobe, p);
    if (from < low) from = low;
    if (to > high) to = high;
    if (!(from < to)) return 0;
    envmapi_walk walk = envmapi_walk_of(lobe, p, from, to, sigma / 2);
    if (h > (to - from) / 8) h = (to - from) / 8;
    if (known) h = 0;
    else if (!(h > 1e-9)) return 0;
    ends[0] = from > 0 ? from + h : 0, ends[1] = to < ENVMAPI_PI ? to - h : ENVMAPI_PI;
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        if (theta < from + h || theta > to - h) continue;
        double k = envmapi_curvature_at(lobe, p, theta, h);
        if (k > bound) bound = k;
    }
    for (int i = 0; i < 2; ++i) {
        double k = envmapi_curvature_at(lobe, p, ends[i], h);
        if (k > bound) bound = k;
    }
    return 1.02 * bound;
}

ENVMAPI_BODY double envmap_lobe_curvature(const envmap_lobe *lobe, double p, double from,
                                          double to) {
    double kinks[34], bound = 0;
    if (!envmapi_lobe_has_k(lobe) || !(from < to)) return 0;
    from = envmapi_clamp(from, 0, ENVMAPI_PI), to = envmapi_clamp(to, 0, ENVMAPI_PI);
    double sigma = envmap_lobe_sigma(lobe, p), start = from;
    int n = envmap_lobe_kinks(kinks, 32, lobe, p);
    if (n > 32) n = 32;
    kinks[n++] = to;
    while (start < to) { /* from kink to kink */
        double end = to;
        for (int i = 0; i < n; ++i)
            if (kinks[i] > start && kinks[i] < end) end = kinks[i];
        double k = envmapi_curvature_between(lobe, p, start, end, sigma);
        if (k > bound) bound = k;
        start = end;
    }
    return fabs((double)lobe->scale) * bound;
}

/* lambda_l / lambda_0 in closed form. */
static void envmapi_zonal_phong(double *lambda, int bands, double N) {
    lambda[0] = 1;
    if (bands > 1) lambda[1] = (N + 1) / (N + 2);
    for (int l = 0; l + 2 < bands; ++l) lambda[l + 2] = lambda[l] * (N - l) / (N + l + 3);
}

/* r_l = lambda_l / lambda_(l-1) = 1 / ((2l+1)/kappa + r_(l+1)), downwards from where
   r = 1/(2b + r) holds; each step shrinks the error of the start by r^2. */
static void envmapi_zonal_gaussian(double *lambda, int bands, double kappa) {
    int start = bands + 32 + (int)(8 * sqrt(kappa));
    lambda[0] = 1;
    if (!(kappa > 0)) {
        for (int l = 1; l < bands; ++l) lambda[l] = 0;
        return;
    }
    double b = (2.0 * start + 1) / (2 * kappa), r = 1 / (b + sqrt(b * b + 1));
    for (int l = start - 1; l > 0; --l) {
        r = 1 / ((2.0 * l + 1) / kappa + r);
        if (l < bands) lambda[l] = r;
    }
    for (int l = 1; l < bands; ++l) lambda[l] *= lambda[l - 1];
}

static void envmapi_zonal_quadrature(double *lambda, int bands, const envmap_lobe *lobe, double p) {
    envmapi_walk walk = envmapi_walk_of(lobe, p, 0, ENVMAPI_PI, 8.0 / bands);
    double theta, weight;
    for (int l = 0; l < bands; ++l) lambda[l] = 0;
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        double x = cos(theta), before = 0, P = 1;
        double k = 2 * ENVMAPI_PI * weight * sin(theta) * envmapi_k(lobe, x, p);
        for (int l = 0; l < bands; ++l) {
            lambda[l] += k * P;
            double next = ((2 * l + 1) * x * P - l * before) / (l + 1);
            before = P, P = next;
        }
    }
}

/* The bands, divided by the filter's norm; 0 when that is not positive. */
static int envmapi_zonal(double *lambda, int bands, const envmap_lobe *lobe, double p) {
    double integral = envmapi_lobe_integral(lobe, p), norm = envmapi_lobe_norm(lobe), factor;
    if (!(norm > 0) && !lobe->raw) norm = envmapi_lobe_positive(lobe, p) ? integral : 0;
    if (lobe->raw) factor = (double)lobe->scale;
    else if (envmapi_finite(norm) && norm > 0) factor = 1 / norm;
    else return 0;
    if (!envmapi_finite(integral)) return 0;
    if (lobe->kind == ENVMAP_LOBE_PHONG) {
        envmapi_zonal_phong(lambda, bands, (double)lobe->parameter);
        factor *= integral;
    } else if (lobe->kind == ENVMAP_LOBE_GAUSSIAN) {
        envmapi_zonal_gaussian(lambda, bands, (double)lobe->parameter);
        factor *= integral;
    } else {
        envmapi_zonal_quadrature(lambda, bands, lobe, p);
    }
    for (int l = 0; l < bands; ++l) lambda[l] *= factor;
    return 1;
}

#define ENVMAPI_BAND_LIMIT 4096

ENVMAPI_BODY envmap_result envmap_lobe_zonal(double *lambda, int bands, const envmap_lobe *lobe,
                                             double p) {
    if (!lambda || !lobe || bands < 1 || bands > ENVMAPI_BAND_LIMIT || !envmapi_finite(p))
        return ENVMAP_ERROR_ARGUMENT;
    if (!envmapi_lobe_has_k(lobe)) return ENVMAP_ERROR_LOBE;
    double first[1]; /* a lobe that fails does so at one band, before anything is written */
    if (!envmapi_zonal(first, 1, lobe, p)) return ENVMAP_ERROR_LOBE;
    envmapi_zonal(lambda, bands, lobe, p);
    return ENVMAP_OK;
}

/* p at the centre of slice k of n. */
static double envmapi_slice_p(const envmap_lobe *lobe, int k, int n) {
    return (double)lobe->p0 + ((double)lobe->p1 - (double)lobe->p0) * (k + 0.5) / n;
}

/* The fewest bands with  contrast * |tail| <= tolerance * |what a scene of that contrast leaves|:
   a scene's l-th band is taken as contrast^2 times that of one light, and its mean as 1. Contrast 1
   is one light: the tail relative to the lobe's own rms. By Parseval the sum over all l,
   sum (2l+1) lambda_l^2 = 4 pi (2 pi integral of k^2); bands are added until the tail they do not
   hold is known to be small enough. */
static int envmapi_bands(const envmap_lobe *lobe, double p, double tolerance, double contrast,
                         int limit_bands) {
    double lambda[ENVMAPI_BAND_LIMIT], integral = envmapi_lobe_integral(lobe, p);
    double total = 4 * ENVMAPI_PI * envmapi_lobe_power(lobe, p, 2), c2 = contrast * contrast;
    double limit = tolerance * tolerance * ((1 - c2) * integral * integral + c2 * total);
    envmap_lobe raw = *lobe;
    raw.raw = 1, raw.scale = 1;
    if (!envmapi_finite(integral) || !(total > 0)) return 0;
    if (!lobe->raw && lobe->kind != ENVMAP_LOBE_BANKS && !envmapi_lobe_positive(lobe, p)) return 0;
    for (int bands = 32;; bands = 2 * bands < limit_bands ? 2 * bands : limit_bands) {
        double tail = total;
        envmapi_zonal(lambda, bands, &raw, p);
        for (int l = 0; l < bands; ++l) tail -= (2 * l + 1) * lambda[l] * lambda[l];
        if (tail < 1e-12 * total) tail = 0; /* rounding */
        if (c2 * tail > limit && bands < limit_bands) continue;
        for (int l = bands; l > 1; --l) {
            tail += (2 * l - 1) * lambda[l - 1] * lambda[l - 1];
            if (c2 * tail > limit) return l;
        }
        return 1;
    }
}

ENVMAPI_BODY int envmap_lobe_bands(const envmap_lobe *lobe, int slices, double tolerance) {
    int bands = 0;
    if (!envmapi_lobe_has_k(lobe) || slices < 1 || slices > ENVMAPI_SLICE_LIMIT ||
        !(tolerance >= 0))
        return 0;
    if (!(fabs((double)lobe->p1 - (double)lobe->p0) > 0)) slices = 1;
    for (int k = 0; k < slices; ++k) {
        int n = envmapi_bands(lobe, envmapi_slice_p(lobe, k, slices), tolerance, 1,
                              ENVMAPI_BAND_LIMIT);
        if (!n) return 0;
        if (n > bands) bands = n;
    }
    return bands;
}

/* ------------------------------------------------------------------------------- >>harmonics --
   Points of light on the sphere -> coefficients a_lm -> a smooth function on the sphere, by way of
   M rings of 2M points, theta_j = (j+1/2) pi/M, phi_k = k pi/M:
       spread      each point on 4 x 4 grid points by cubic B-splines, the adjoint of interpolating
       in phi      FFT, and divide by the spline's response (4 + 2 cos(pi m/M))/6
       in theta    solve (1/6, 4/6, 1/6) c = f, ring -1 being ring 0 half a turn on: (-1)^m
       Legendre    a_lm = sum_j P_lm(theta_j) F_m(theta_j), three-term recurrence in l
   and the same steps in reverse order back to the grid, which 4 x 4 taps interpolate. Spline and
   FFT are never inverted approximately, so the only errors are the spline's own, 2.6 f^4 at few
   cycles a sample (f = l/2M), and the bands left out: both are weighted with lambda_l, which is
   small where they are large. Four channels: RGB and solid angle.
   Rings j and M-1-j are one complex number for the FFT, and e, o = north +- south for Legendre.
   Source [Swarztrauber79] for the folding; splines [Unser91].  Tests: tests/test_harmonics.c. */

#if defined(__GNUC__) && !defined(ENVMAP_NO_SIMD)
#define ENVMAPI_INLINE static inline __attribute__((always_inline))
typedef float envmapi_float4 __attribute__((vector_size(16)));
typedef double envmapi_double4 __attribute__((vector_size(32)));
typedef double envmapi_double8 __attribute__((vector_size(64)));
#define ENVMAPI_ADD(type, y, a, x)                                                                 \
    do {                                                                                           \
        type envmapi_y, envmapi_x;                                                                 \
        memcpy(&envmapi_y, y, sizeof envmapi_y), memcpy(&envmapi_x, x, sizeof envmapi_x);          \
        envmapi_y += (a) * envmapi_x;                                                              \
        memcpy(y, &envmapi_y, sizeof envmapi_y);                                                   \
    } while (0)
#else
#define ENVMAPI_INLINE static inline
typedef struct { float v[4]; } envmapi_float4;
typedef struct { double v[4]; } envmapi_double4;
typedef struct { double v[8]; } envmapi_double8;
#define ENVMAPI_ADD(type, y, a, x)                                                                 \
    for (size_t envmapi_i = 0; envmapi_i < sizeof(type) / sizeof *(y); ++envmapi_i)                \
    (y)[envmapi_i] += (a) * (x)[envmapi_i]
#endif

/* y += a x for 4 or 8 numbers: the loops that carry the work. */
ENVMAPI_INLINE void envmapi_add4f(float *y, float a, const float *x) {
    ENVMAPI_ADD(envmapi_float4, y, a, x);
}
ENVMAPI_INLINE void envmapi_add4(double *y, double a, const double *x) {
    ENVMAPI_ADD(envmapi_double4, y, a, x);
}
ENVMAPI_INLINE void envmapi_add8(double *y, double a, const double *x) {
    ENVMAPI_ADD(envmapi_double8, y, a, x);
}

/* Memory of one call: blocks that go together. */
typedef struct envmapi_pool {
    void *memory, *blocks[48];
    int count;
} envmapi_pool;

static void *envmapi_pool_get(envmapi_pool *pool, size_t count, size_t size) {
    if (pool->count >= 48 || count > SIZE_MAX / 2 / size) return NULL;
    void *block = ENVMAP_MALLOC(pool->memory, count * size + 64);
    if (block) pool->blocks[pool->count++] = block;
    return block;
}

static void envmapi_pool_free(envmapi_pool *pool, int keep) {
    while (pool->count > keep) ENVMAP_FREE(pool->memory, pool->blocks[--pool->count]);
}

/* Cubic B-spline at the four samples around a point, f in [0,1) past the second. */
ENVMAPI_INLINE void envmapi_spline(float w[4], float f) {
    float g = 1 - f;
    w[0] = g * g * g / 6;
    w[1] = (4 - 6 * f * f + 3 * f * f * f) / 6;
    w[2] = (4 - 6 * g * g + 3 * g * g * g) / 6;
    w[3] = f * f * f / 6;
}

/* What the spline loses of a wave of f cycles a sample: its fundamental by sum (f/(f+k))^4 over
   k != 0, and as much again goes to the aliases k. 2.6 f^4 for small f. */
static double envmapi_spline_error(double f) {
    double a = f / (1 - f), b = f / (1 + f);
    if (!(f < 0.5)) return 1;
    a *= a, b *= b, a *= a, b *= b;
    double lost = 1.08 * (a + b);
    return fmin(sqrt(lost * lost + a * a + b * b), 1);
}

/* atan(y/x) in all quadrants, to 1e-10: a polynomial, where libm's would be half of the time. */
ENVMAPI_INLINE double envmapi_atan2(double y, double x) {
    double ax = fabs(x), ay = fabs(y), most = ax > ay ? ax : ay, least = ax > ay ? ay : ax;
    double t = most > 0 ? least / most : 0, turned = t > 0.41421356237309503;
    double s = turned > 0 ? (t - 1) / (t + 1) : t, q = s * s, r = 0;
    for (int k = 25; k > 0; k -= 2)
        r = q * r + (k & 2 ? -1.0 : 1.0) / k; /* Taylor, |s| <= tan pi/8 */
    r = r * s + (turned > 0 ? ENVMAPI_PI / 4 : 0);
    r = ay > ax ? ENVMAPI_PI / 2 - r : r;
    r = x < 0 ? ENVMAPI_PI - r : r;
    return y < 0 ? -r : r;
}

typedef struct envmapi_rings {
    int M, bands, stages, radices[24];
    size_t row; /* doubles a row of G: north rings, south rings mirrored, 4 ghosts; 4 channels */
    double *G;        /* [2M][row] */
    double *F;        /* [bands][M/2][16]: e re, e im, o re, o im; 4 channels each */
    double *turns;    /* cos, sin of 2 pi i/2M */
    double *response; /* 1 / the spline's response at m */
    double *x, *log_sin, *norms; /* cos and log sin of the rings; log of P_mm / sin^m */
    int *place;       /* where the FFT leaves frequency m */
    int *offset;      /* ring j = -2 .. M+1 -> place in a row */
} envmapi_rings;

/* Where a point falls: the grid point before it, and how far past that. */
typedef struct envmapi_point {
    short k, j;
    float f_k, f_j;
} envmapi_point;

/* The next M >= least, a multiple of 8 (so that blocks of 4 ring pairs are whole), for which
   2M = 2^a 3^b. */
static int envmapi_rings_size(int least) {
    int M = (least + 7) / 8 * 8;
    for (;; M += 8) {
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
        rings->turns[2 * i] = cos(ENVMAPI_PI * i / M),
                         rings->turns[2 * i + 1] = sin(ENVMAPI_PI * i / M);
        for (int s = 0; s < rings->stages; ++s) {
            length /= rings->radices[s];
            at += f % rings->radices[s] * length, f /= rings->radices[s];
        }
        rings->place[i] = at;
    }
    for (int m = 0; m < rings->bands; ++m) {
        rings->response[m] = 6 / (4 + 2 * cos(ENVMAPI_PI * m / M));
        if (m) norm += 0.5 * log((2 * m + 1.0) / (2 * m));
        rings->norms[m] = norm;
    }
    for (int j = 0; j < H; ++j) {
        double theta = (j + 0.5) * ENVMAPI_PI / M;
        rings->x[j] = cos(theta), rings->log_sin[j] = log(sin(theta));
    }
    for (int j = -2; j < M + 2; ++j)
        rings->offset[j + 2] = 4 * (j < 0 ? M + 2 + j : j < H ? j : j < M ? H + M - 1 - j : j + 2);
}

static envmap_result envmapi_rings_create(envmapi_rings *rings, int M, int bands,
                                          envmapi_pool *pool) {
    size_t n = 2 * (size_t)M, H = (size_t)M / 2, L = (size_t)bands;
    memset(rings, 0, sizeof *rings);
    rings->M = M, rings->bands = bands, rings->row = 4 * ((size_t)M + 4);
    rings->G = (double *)envmapi_pool_get(pool, n * rings->row, sizeof(double));
    rings->F = (double *)envmapi_pool_get(pool, L * H * 16, sizeof(double));
    double *tables = (double *)envmapi_pool_get(pool, 2 * n + 2 * L + 2 * H, sizeof(double));
    int *places = (int *)envmapi_pool_get(pool, n + (size_t)M + 4, sizeof(int));
    if (!rings->G || !rings->F || !tables || !places) return ENVMAP_ERROR_MEMORY;
    rings->turns = tables, rings->response = tables + 2 * n, rings->norms = rings->response + L;
    rings->x = rings->norms + L, rings->log_sin = rings->x + H;
    rings->place = places, rings->offset = places + n;
    envmapi_rings_tables(rings);
    return ENVMAP_OK;
}

/* The polar axis is z; d of any length. */
ENVMAPI_INLINE envmapi_point envmapi_rings_point(const envmapi_rings *rings, const double d[3]) {
    double scale = rings->M / ENVMAPI_PI;
    double theta = envmapi_atan2(sqrt(d[0] * d[0] + d[1] * d[1]), d[2]) * scale - 0.5;
    double phi = envmapi_atan2(d[1], d[0]) * scale;
    if (phi < 0) phi += 2 * rings->M;
    int k = (int)phi, j = (int)(theta + 1) - 1;
    envmapi_point point = {(short)(k >= 2 * rings->M ? k - 2 * rings->M : k), (short)j,
                           (float)(phi - k), (float)(theta - j)};
    return point;
}

static int envmapi_wrap(int k, int n) { return k < 0 ? k + n : k >= n ? k - n : k; }

/* G += the points' values [count][4], rows from .. to-1 only, so that tasks can share the work. */
static void envmapi_rings_spread(envmapi_rings *rings, const envmapi_point *points,
                                 const float *values, size_t count, int from, int to) {
    int n = 2 * rings->M;
    for (size_t i = 0; i < count; ++i) {
        const envmapi_point *p = points + i;
        if ((p->k + 2 < from || p->k - 1 >= to) && p->k > 0 && p->k < n - 2) continue;
        const int *offset = rings->offset + p->j + 1;
        double value[4];
        float w_k[4], w_j[4];
        envmapi_spline(w_k, p->f_k), envmapi_spline(w_j, p->f_j);
        for (int c = 0; c < 4; ++c) value[c] = (double)values[4 * i + (size_t)c];
        for (int a = 0; a < 4; ++a) {
            int k = envmapi_wrap(p->k - 1 + a, n);
            if (k < from || k >= to) continue;
            double *row = rings->G + (size_t)k * rings->row;
            for (int b = 0; b < 4; ++b)
                envmapi_add4(row + offset[b], (double)w_k[a] * (double)w_j[b], value);
        }
    }
}

static void envmapi_rings_interpolate(const envmapi_rings *rings, const envmapi_point *points,
                                      float *values, size_t count) {
    int n = 2 * rings->M;
    for (size_t i = 0; i < count; ++i) {
        const envmapi_point *p = points + i;
        const int *offset = rings->offset + p->j + 1;
        double value[4] = {0, 0, 0, 0};
        float w_k[4], w_j[4];
        envmapi_spline(w_k, p->f_k), envmapi_spline(w_j, p->f_j);
        for (int a = 0; a < 4; ++a) {
            const double *row = rings->G + (size_t)envmapi_wrap(p->k - 1 + a, n) * rings->row;
            for (int b = 0; b < 4; ++b)
                envmapi_add4(value, (double)w_k[a] * (double)w_j[b], row + offset[b]);
        }
        for (int c = 0; c < 4; ++c) values[4 * i + (size_t)c] = (float)value[c];
    }
}

/* Rings beyond a pole are the first ones half a turn on: add them there (fold), or copy. */
static void envmapi_rings_poles(envmapi_rings *rings, int fold) {
    int M = rings->M;
    const int pairs[4][2] = {{0, 3}, {1, 2}, {M + 2, M + 1}, {M + 3, M}}; /* beyond, inside; +2 */
    for (int k = 0; k < 2 * M; ++k)
        for (int i = 0; i < 4; ++i) {
            size_t half_on = (size_t)envmapi_wrap(k + M, 2 * M);
            double *beyond = rings->G + (size_t)k * rings->row + rings->offset[pairs[i][0]];
            double *inside = rings->G + half_on * rings->row + rings->offset[pairs[i][1]];
            for (int c = 0; c < 4; ++c) {
                if (fold) inside[c] += beyond[c];
                else beyond[c] = inside[c];
            }
        }
}

#define ENVMAPI_BLOCK 16 /* doubles of a row that one FFT task takes: 4 rings */

ENVMAPI_INLINE void envmapi_rotate(double *re, double *im, double c, double s) {
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

/* One butterfly of r rows `apart`; turns stand after it on the way out, before it on the way
   back, so that one undoes the other. */
static void envmapi_butterfly(double *re, double *im, size_t apart, int r, const double *turns,
                              int turn, int sign) {
    double x[4][ENVMAPI_BLOCK], y[4][ENVMAPI_BLOCK];
    for (int q = 0; q < r; ++q) {
        memcpy(x[q], re + (size_t)q * apart, sizeof x[q]);
        memcpy(y[q], im + (size_t)q * apart, sizeof y[q]);
        if (sign > 0 && q && turn)
            envmapi_rotate(x[q], y[q], turns[2 * q * turn], turns[2 * q * turn + 1]);
    }
    if (r == 2) envmapi_dft(x, y, 2, sign);
    else if (r == 3) envmapi_dft(x, y, 3, sign);
    else envmapi_dft(x, y, 4, sign);
    for (int q = 0; q < r; ++q) {
        if (sign < 0 && q && turn)
            envmapi_rotate(x[q], y[q], turns[2 * q * turn], -turns[2 * q * turn + 1]);
        memcpy(re + (size_t)q * apart, x[q], sizeof x[q]);
        memcpy(im + (size_t)q * apart, y[q], sizeof y[q]);
    }
}

/* 2M rows of one block in place: out (sign -1) frequency m ends at place[m]; back (sign 1) it
   starts there. */
static void envmapi_fft(const envmapi_rings *rings, double *re, double *im, int sign) {
    int n = 2 * rings->M, length = sign < 0 ? n : 1;
    for (int i = 0; i < rings->stages; ++i) {
        int r = rings->radices[sign < 0 ? i : rings->stages - 1 - i];
        if (sign > 0) length *= r;
        for (int j = 0; j < length / r; ++j)
            for (int start = j; start < n; start += length)
                envmapi_butterfly(re + (size_t)start * rings->row, im + (size_t)start * rings->row,
                                  (size_t)(length / r) * rings->row, r, rings->turns,
                                  j * (n / length), sign);
        if (sign < 0) length /= r;
    }
}

/* Ring pairs of block b between G, where north + i south went through the FFT, and F. */
static void envmapi_rings_unpack(envmapi_rings *rings, int block) {
    int n = 2 * rings->M, H = rings->M / 2, first = 4 * block;
    for (int m = 0; m < rings->bands; ++m) {
        const double *p = rings->G + (size_t)rings->place[m] * rings->row + 4 * first;
        const double *q = rings->G + (size_t)rings->place[(n - m) % n] * rings->row + 4 * first;
        double *out = rings->F + ((size_t)m * (size_t)H + (size_t)first) * 16;
        double half = rings->response[m] / 2;
        for (int j = 0; j < 4; ++j, out += 16)
            for (int c = 0; c < 4; ++c) {
                double a = p[4 * j + c] * half, b = p[4 * (H + j) + c] * half;
                double d = q[4 * j + c] * half, e = q[4 * (H + j) + c] * half;
                out[c] = (a + d) + (b + e), out[4 + c] = (b - e) - (a - d);
                out[8 + c] = (a + d) - (b + e), out[12 + c] = (b - e) + (a - d);
            }
    }
}

static void envmapi_rings_pack(envmapi_rings *rings, int block) {
    int n = 2 * rings->M, H = rings->M / 2, first = 4 * block;
    for (int k = 0; k < n; ++k) {
        double *row = rings->G + (size_t)k * rings->row + 4 * first;
        memset(row, 0, ENVMAPI_BLOCK * sizeof(double));
        memset(row + 4 * H, 0, ENVMAPI_BLOCK * sizeof(double));
    }
    for (int m = rings->bands - 1; m >= 0; --m) {
        double *p = rings->G + (size_t)rings->place[m] * rings->row + 4 * first;
        double *q = rings->G + (size_t)rings->place[(n - m) % n] * rings->row + 4 * first;
        const double *in = rings->F + ((size_t)m * (size_t)H + (size_t)first) * 16;
        double w = rings->response[m];
        for (int j = 0; j < 4; ++j, in += 16)
            for (int c = 0; c < 4; ++c) {
                double nr = (in[c] + in[8 + c]) * w, ni = (in[4 + c] + in[12 + c]) * w;
                double sr = (in[c] - in[8 + c]) * w, si = (in[4 + c] - in[12 + c]) * w;
                q[4 * j + c] = nr + si, q[4 * (H + j) + c] = sr - ni; /* conj N + i conj S */
                p[4 * j + c] = m ? nr - si : nr, p[4 * (H + j) + c] = m ? sr + ni : sr;
            }
    }
}

/* (1/6, 4/6, 1/6) c = f down the rings of one m, e and o apart: the equator mirrors c as +-c, the
   pole as (-1)^m c. In place. */
static void envmapi_rings_solve(double *F, int H, int m, double *pivots) {
    for (int odd = 0; odd < 2; ++odd) {
        double *f = F + 8 * odd;
        for (int j = 0; j < H; ++j, f += 16) {
            double diagonal = 4.0 - (j ? pivots[j - 1] : 0);
            if (j == 0) diagonal += m & 1 ? -1 : 1;
            if (j == H - 1) diagonal += odd ? -1 : 1;
            pivots[j] = 1 / diagonal;
            for (int c = 0; c < 8; ++c) f[c] *= 6;
            if (j) envmapi_add8(f, -1, f - 16);
            for (int c = 0; c < 8; ++c) f[c] *= pivots[j];
        }
        for (int j = H - 2; j >= 0; --j)
            envmapi_add8(F + 8 * odd + 16 * j, -pivots[j], F + 8 * odd + 16 * (j + 1));
    }
}

/* P_lm of 8 rings for l = m .. bands-1: P_l = A_l (x P_(l-1) - B_l P_(l-2)),
   A_l = sqrt((4l^2-1)/(l^2-m^2)), B_l = sqrt(((l-1)^2-m^2)/(4(l-1)^2-1)).
   sin^m begins as its logarithm: where it underflows, P stays negligible up to l ~ 1000. Returns
   0 when it is on all 8. */
static int envmapi_legendre(double *P, const envmapi_rings *rings, int m, int first,
                            const double *A, const double *B) {
    int H = rings->M / 2, any = 0;
    double x[8], before[8], now[8];
    for (int b = 0; b < 8; ++b) {
        int j = first + b < H ? first + b : H - 1;
        double start = rings->norms[m] + m * rings->log_sin[j];
        now[b] = start > -700 && first + b < H ? exp(start) : 0;
        x[b] = rings->x[j], before[b] = 0, any |= now[b] > 0;
    }
    memcpy(P, now, sizeof now);
    for (int l = m + 1; any && l < rings->bands; ++l) {
        double a = A[l], ab = A[l] * B[l];
        for (int b = 0; b < 8; ++b) {
            double next = a * x[b] * now[b] - ab * before[b];
            before[b] = now[b], now[b] = next;
        }
        memcpy(P + 8 * (l - m), now, sizeof now);
    }
    return any;
}

static void envmapi_legendre_factors(double *A, double *B, int m, int bands) {
    double mm = (double)m * m;
    for (int l = m + 1; l < bands; ++l) {
        double ll = (double)l * l, before = (l - 1.0) * (l - 1.0);
        A[l] = sqrt((4 * ll - 1) / (ll - mm));
        B[l] = l - 1 > m ? sqrt((before - mm) / (4 * before - 1)) : 0;
    }
}

/* Coefficients of one m begin at [envmapi_triangle(m)], l = m .. bands-1, 8 numbers each. */
static size_t envmapi_triangle(int bands, int m) {
    return 4 * (size_t)m * (size_t)(2 * bands - m + 1);
}

/* a[l] = sum_j P_l(j) F(j): even l - m see e, odd ones o. work: 11 doubles a band, M/2 more. */
static void envmapi_legendre_analyse(envmapi_rings *rings, double *a, int m, double *work) {
    int H = rings->M / 2, bands = rings->bands;
    double *A = work, *B = A + bands, *P = B + bands, *F = rings->F + (size_t)m * (size_t)H * 16;
    envmapi_legendre_factors(A, B, m, bands);
    envmapi_rings_solve(F, H, m, P + 8 * bands);
    memset(a, 0, (size_t)(bands - m) * 8 * sizeof(double));
    for (int first = 0; first < H; first += 8) {
        if (!envmapi_legendre(P, rings, m, first, A, B)) continue;
        int count = H - first < 8 ? H - first : 8;
        for (int l = 0; l < bands - m; ++l) {
            double sum[8];
            const double *f = F + 16 * first + 8 * (l & 1);
            memcpy(sum, a + 8 * l, sizeof sum);
            for (int b = 0; b < count; ++b) envmapi_add8(sum, P[8 * l + b], f + 16 * b);
            memcpy(a + 8 * l, sum, sizeof sum);
        }
    }
}

/* F(j) = sum_l lambda_l a[l] P_l(j). */
static void envmapi_legendre_synthesise(envmapi_rings *rings, const double *a,
                                        const double *lambda, int m, double *work) {
    int H = rings->M / 2, bands = rings->bands;
    double *A = work, *B = A + bands, *P = B + bands, *F = rings->F + (size_t)m * (size_t)H * 16;
    envmapi_legendre_factors(A, B, m, bands);
    for (int first = 0; first < H; first += 8) {
        int any = envmapi_legendre(P, rings, m, first, A, B);
        for (int b = 0; b < 8 && first + b < H; ++b) {
            double sums[2][8] = {{0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0}};
            for (int l = 0; any && l < bands - m; l += 2)
                envmapi_add8(sums[0], P[8 * l + b] * lambda[m + l], a + 8 * l);
            for (int l = 1; any && l < bands - m; l += 2)
                envmapi_add8(sums[1], P[8 * l + b] * lambda[m + l], a + 8 * l);
            memcpy(F + 16 * (first + b), sums[0], sizeof sums[0]);
            memcpy(F + 16 * (first + b) + 8, sums[1], sizeof sums[1]);
        }
    }
    envmapi_rings_solve(F, H, m, P + 8 * bands);
}

/* The steps as tasks. A task is a part that the data alone defines. */
typedef struct envmapi_transform {
    envmapi_rings *rings;
    const envmapi_point *points; /* where */
    float *values;               /* and what: [count][4] */
    size_t count;
    double *a;            /* coefficients, of a_bands >= rings->bands */
    int a_bands;
    const double *lambda; /* per band, for the way back */
    double *work;         /* ENVMAPI_TASKS times work_size */
    size_t work_size;
} envmapi_transform;

#define ENVMAPI_TASKS 16

static void envmapi_task_spread(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    int n = 2 * t->rings->M, from = n * task / ENVMAPI_TASKS, to = n * (task + 1) / ENVMAPI_TASKS;
    memset(t->rings->G + (size_t)from * t->rings->row, 0,
           (size_t)(to - from) * t->rings->row * sizeof(double));
    envmapi_rings_spread(t->rings, t->points, t->values, t->count, from, to);
}

static void envmapi_task_interpolate(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    size_t from = t->count * (size_t)task / ENVMAPI_TASKS;
    size_t to = t->count * ((size_t)task + 1) / ENVMAPI_TASKS;
    envmapi_rings_interpolate(t->rings, t->points + from, t->values + 4 * from, to - from);
}

static void envmapi_task_fft_out(void *context, int block) {
    envmapi_rings *rings = ((const envmapi_transform *)context)->rings;
    double *re = rings->G + ENVMAPI_BLOCK * block;
    envmapi_fft(rings, re, re + 2 * rings->M, -1);
    envmapi_rings_unpack(rings, block);
}

static void envmapi_task_fft_back(void *context, int block) {
    envmapi_rings *rings = ((const envmapi_transform *)context)->rings;
    double *re = rings->G + ENVMAPI_BLOCK * block;
    envmapi_rings_pack(rings, block);
    envmapi_fft(rings, re, re + 2 * rings->M, 1);
}

static void envmapi_task_analyse(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    for (int m = task; m < t->rings->bands; m += ENVMAPI_TASKS)
        envmapi_legendre_analyse(t->rings, t->a + envmapi_triangle(t->a_bands, m), m,
                                 t->work + (size_t)task * t->work_size);
}

static void envmapi_task_synthesise(void *context, int task) {
    const envmapi_transform *t = (const envmapi_transform *)context;
    for (int m = task; m < t->rings->bands; m += ENVMAPI_TASKS)
        envmapi_legendre_synthesise(t->rings, t->a + envmapi_triangle(t->a_bands, m), t->lambda, m,
                                    t->work + (size_t)task * t->work_size);
}

static void envmapi_run_all(const envmap_executor *executor, envmap_task *task, void *context,
                            int count) {
    envmap_progress none = {NULL, NULL};
    envmapi_run(executor, &none, task, context, count);
}

/* points, values -> a */
static void envmapi_analyse(const envmapi_transform *t, const envmap_executor *executor) {
    envmapi_transform job = *t;
    envmapi_run_all(executor, envmapi_task_spread, &job, ENVMAPI_TASKS);
    envmapi_rings_poles(t->rings, 1);
    envmapi_run_all(executor, envmapi_task_fft_out, &job, t->rings->M / 8);
    envmapi_run_all(executor, envmapi_task_analyse, &job, ENVMAPI_TASKS);
}

/* a, lambda -> values at points */
static void envmapi_synthesise(const envmapi_transform *t, const envmap_executor *executor) {
    envmapi_transform job = *t;
    envmapi_run_all(executor, envmapi_task_synthesise, &job, ENVMAPI_TASKS);
    envmapi_run_all(executor, envmapi_task_fft_back, &job, t->rings->M / 8);
    envmapi_rings_poles(t->rings, 0);
    envmapi_run_all(executor, envmapi_task_interpolate, &job, ENVMAPI_TASKS);
}

/* --------------------------------------------------------------------------------- >>filters --
   REFERENCE, the definition: for every axis a
       L(a) = sum_i k(a.l_i; p) L_i w_i / norm,   norm = sum_i k w_i | Banks' constant | 1
   in double, i over all texels of src with w_i > 0. It is second order in the texel while the
   lobe is wide: sigma >= 2 mean texels. Below that each texel spreads with a tent of width
   t = clamp(2 - sigma/texel, 0, 1) texels in (u,v):
       0 < t < 1   four points a side carry the tent's moments (Gauss-Jacobi on each half)
       t = 1       the spread texels are the bilinear radiance: its integral against k by
                   quadrature in polar coordinates about a, within 12 texels or 8 sigma; a lobe's
                   wider tail (GGX) is smooth at a texel's scale and stays a sum over texels, the
                   two joined by a smooth step
   so N -> infinity is the bilinear lookup.  Tests: tests/test_filters.c. */

/* The side of src's mean texel, rad. */
static double envmapi_texel_extent(const envmap *src) {
    double texels = (double)envmapi_area(src->mapping, src->size) * envmap_faces(src->mapping);
    if (envmapi_is_disc(src->mapping)) texels *= ENVMAPI_PI / 4;
    return sqrt(4 * ENVMAPI_PI / texels);
}

/* The texels that count, one array a quantity. */
typedef struct envmapi_source {
    const envmap *map;
    size_t count;
    double *x, *y, *z, *w;   /* direction and solid angle */
    double *u, *v;           /* where on the face: a centre, or a centroid at a rim */
    double *r, *g, *b;       /* radiance times solid angle */
    int *texel;              /* index in the face order of the image, for the tent */
    void *block;             /* all of the above */
} envmapi_source;

static void envmapi_source_free(envmapi_source *source, void *memory) {
    if (source->block) ENVMAP_FREE(memory, source->block);
    source->block = NULL;
}

static envmap_result envmapi_source_create(envmapi_source *source, const envmap *map, int slice,
                                           void *memory) {
    int edge = map->size, width = envmapi_width(map->mapping, edge);
    size_t area = envmapi_area(map->mapping, edge), n = area * (size_t)envmap_faces(map->mapping);
    memset(source, 0, sizeof *source);
    source->map = map;
    if (n > SIZE_MAX / 128) return ENVMAP_ERROR_MEMORY;
    double *block = (double *)ENVMAP_MALLOC(memory, n * (9 * sizeof(double) + sizeof(int)));
    if (!block) return ENVMAP_ERROR_MEMORY;
    source->block = block;
    source->x = block, source->y = block + n, source->z = block + 2 * n, source->w = block + 3 * n;
    source->r = block + 4 * n, source->g = block + 5 * n, source->b = block + 6 * n;
    source->u = block + 7 * n, source->v = block + 8 * n;
    source->texel = (int *)(block + 9 * n);
    const float *texels = envmapi_image(map, 0, slice, 0);
    for (size_t t = 0; t < area; ++t) {
        double at[2], w = envmapi_texel_cell(at, map->mapping, edge, (int)(t % (size_t)width),
                                             (int)(t / (size_t)width));
        for (int face = 0; w > 0 && face < envmap_faces(map->mapping); ++face) {
            double d[3];
            size_t i = source->count++, texel = (size_t)face * area + t;
            envmapi_direction(d, map->mapping, face, at[0], at[1]);
            source->x[i] = d[0], source->y[i] = d[1], source->z[i] = d[2], source->w[i] = w;
            source->r[i] = w * (double)texels[3 * texel];
            source->g[i] = w * (double)texels[3 * texel + 1];
            source->b[i] = w * (double)texels[3 * texel + 2];
            source->u[i] = at[0], source->v[i] = at[1];
            source->texel[i] = (int)texel;
        }
    }
    return ENVMAP_OK;
}

/* One axis of a filter: where, which lobe, and the sums so far. */
typedef struct envmapi_axis {
    const envmapi_source *source;
    const envmap_lobe *lobe;
    envmapi_level level; /* of the source, for lookups */
    double a[3], p, sigma, texel;
    double from, to;     /* support of the lobe */
    double rgb[3], norm;
} envmapi_axis;

static void envmapi_axis_add(envmapi_axis *axis, size_t i, double k) {
    const envmapi_source *s = axis->source;
    axis->rgb[0] += k * s->r[i], axis->rgb[1] += k * s->g[i], axis->rgb[2] += k * s->b[i];
    axis->norm += k * s->w[i];
}

static double envmapi_axis_cosine(const envmapi_axis *axis, size_t i) {
    const envmapi_source *s = axis->source;
    return axis->a[0] * s->x[i] + axis->a[1] * s->y[i] + axis->a[2] * s->z[i];
}

/* 0 up to from, 1 beyond to, smooth between. */
static double envmapi_smooth_step(double value, double from, double to) {
    double t = envmapi_clamp((value - from) / (to - from), 0, 1);
    return t * t * (3 - 2 * t);
}

/* The definition; with `beyond` > 0 only what lies farther than about that angle. */
static void envmapi_axis_sum(envmapi_axis *axis, double beyond) {
    double end = axis->to < 1.5 ? cos(axis->to) : -2; /* below 1e-12 of the peak from there on */
    for (size_t i = 0; i < axis->source->count; ++i) {
        double x = envmapi_axis_cosine(axis, i), step = 1;
        if (x < end) continue;
        if (beyond > 0) {
            step = envmapi_smooth_step(envmapi_acos(x), beyond / 2, beyond);
            if (!(step > 0)) continue;
        }
        double k = step * envmapi_k(axis->lobe, x, axis->p);
        if (!(k >= 0 && k <= 0)) envmapi_axis_add(axis, i, k); /* NaN too: it must be seen */
    }
}

/* k averaged over texel i spread with a tent of half-width `tent` texels. */
static double envmapi_axis_tent_k(const envmapi_axis *axis, size_t i, double tent) {
    static const double at[4] = {-0.64494897, -0.15505103, 0.15505103, 0.64494897};
    static const double weight[4] = {0.18195861, 0.31804139, 0.31804139, 0.18195861};
    const envmapi_level *level = &axis->level;
    int area = level->width * level->edge;
    double sum = 0, d[3];
    for (int j = 0; j < 16; ++j) {
        double u = axis->source->u[i] + tent * at[j & 3] / level->width;
        double v = axis->source->v[i] + tent * at[j >> 2] / level->edge;
        envmapi_direction(d, level->mapping, axis->source->texel[i] / area, u, v);
        sum += weight[j & 3] * weight[j >> 2] *
               envmapi_k(axis->lobe, envmapi_dot(axis->a, d), axis->p);
    }
    return sum;
}

/* Tents where the lobe is sharp, which is near its axis or its ring; centres elsewhere. */
static void envmapi_axis_tents(envmapi_axis *axis, double tent, double reach) {
    double x_from = cos(axis->from - 2 * axis->texel > 0 ? axis->from - 2 * axis->texel : 0);
    double end = (axis->from > 0 || axis->to < reach ? axis->to : reach) + 2 * axis->texel;
    double x_to = cos(end < ENVMAPI_PI ? end : ENVMAPI_PI);
    double last = axis->to < ENVMAPI_PI - 2 * axis->texel ? cos(axis->to + 2 * axis->texel) : -2;
    for (size_t i = 0; i < axis->source->count; ++i) {
        double x = envmapi_axis_cosine(axis, i);
        if (x < last) continue;
        double k = x > x_to && x <= x_from ? envmapi_axis_tent_k(axis, i, tent)
                                           : envmapi_k(axis->lobe, x, axis->p);
        if (!(k >= 0 && k <= 0)) envmapi_axis_add(axis, i, k); /* NaN too: it must be seen */
    }
}

/* The bilinear radiance around a, ring by ring, out to about `reach`. */
static void envmapi_axis_polar(envmapi_axis *axis, double reach) {
    envmapi_walk walk = envmapi_walk_of(axis->lobe, axis->p, 0, reach, 2 * axis->texel);
    double t[3] = {0, 0, 0}, b[3], theta, weight;
    int least = fabs(axis->a[0]) < 0.6 ? 0 : fabs(axis->a[1]) < 0.6 ? 1 : 2;
    for (int i = 0; i < 3; ++i) t[i] = (i == least) - axis->a[least] * axis->a[i];
    envmapi_unit(t, t);
    b[0] = axis->a[1] * t[2] - axis->a[2] * t[1];
    b[1] = axis->a[2] * t[0] - axis->a[0] * t[2];
    b[2] = axis->a[0] * t[1] - axis->a[1] * t[0];
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        double k = weight * sin(theta) * envmapi_k(axis->lobe, cos(theta), axis->p);
        if (axis->to > reach) k *= 1 - envmapi_smooth_step(theta, reach / 2, reach);
        int n = (int)envmapi_clamp(8 * ENVMAPI_PI * sin(theta) / axis->texel, 16, 65536);
        double sum[3] = {0, 0, 0};
        for (int i = 0; i < n; ++i) {
            double phi = 2 * ENVMAPI_PI * (i + 0.5) / n, d[3];
            for (int j = 0; j < 3; ++j)
                d[j] = cos(theta) * axis->a[j] + sin(theta) * (cos(phi) * t[j] + sin(phi) * b[j]);
            envmapi_add_lookup(sum, &axis->level, d, 1.0 / n);
        }
        for (int c = 0; c < 3; ++c) axis->rgb[c] += 2 * ENVMAPI_PI * k * sum[c];
        axis->norm += 2 * ENVMAPI_PI * k;
    }
}

static void envmapi_axis_filter(envmapi_axis *axis) {
    axis->texel = envmapi_texel_extent(axis->source->map);
    double tent = envmapi_clamp(2 - axis->sigma / axis->texel, 0, 1);
    double reach = 12 * axis->texel > 8 * axis->sigma ? 12 * axis->texel : 8 * axis->sigma;
    if (!(tent > 0)) {
        envmapi_axis_sum(axis, 0);
    } else { /* from tents at t = 1/2 over to the bilinear radiance at t = 1 */
        double bilinear = envmapi_smooth_step(tent, 0.5, 1), rgb[3] = {0, 0, 0}, norm = 0;
        if (bilinear < 1) {
            envmapi_axis_tents(axis, tent, reach);
            for (int c = 0; c < 3; ++c) rgb[c] = (1 - bilinear) * axis->rgb[c], axis->rgb[c] = 0;
            norm = (1 - bilinear) * axis->norm, axis->norm = 0;
        }
        if (bilinear > 0) {
            if (axis->from > 0 || reach > axis->to) reach = axis->to; /* all of it */
            envmapi_axis_polar(axis, reach);
            if (axis->to > reach) envmapi_axis_sum(axis, reach);
        }
        for (int c = 0; c < 3; ++c) axis->rgb[c] = rgb[c] + bilinear * axis->rgb[c];
        axis->norm = norm + bilinear * axis->norm;
    }
}

/* One filter call on one level: a task is a row of one face of one slice. */
typedef struct envmapi_reference {
    const envmapi_source *source;
    const envmap *dst;
    const envmap_lobe *lobe;
    double norm;
    int first_slice;
} envmapi_reference;

/* Sums may exceed what a float holds; NaN stays to tell of a lobe that failed. */
static float envmapi_to_float(double value) {
    return (float)(value > 3.4e38 ? 3.4e38 : value < -3.4e38 ? -3.4e38 : value);
}

static void envmapi_reference_row(void *context, int task) {
    const envmapi_reference *job = (const envmapi_reference *)context;
    const envmap *dst = job->dst;
    int faces = envmap_faces(dst->mapping), y = task % dst->size, face = task / dst->size % faces;
    int slice = job->first_slice + task / dst->size / faces;
    float *out = envmap_texel(dst, 0, slice, face, 0, y);
    envmapi_axis axis;
    memset(&axis, 0, sizeof axis);
    axis.source = job->source, axis.lobe = job->lobe;
    axis.level = envmapi_level_of(job->source->map, 0, job->source->map->slices > 1 ? slice : 0);
    axis.p = envmapi_slice_p(job->lobe, slice, dst->slices);
    axis.sigma = envmap_lobe_sigma(job->lobe, axis.p);
    envmap_lobe_support(&axis.from, &axis.to, job->lobe, axis.p);
    for (int x = 0; x < envmapi_width(dst->mapping, dst->size); ++x, out += 3) {
        envmapi_texel_direction(axis.a, dst->mapping, face, dst->size, x, y);
        axis.rgb[0] = axis.rgb[1] = axis.rgb[2] = axis.norm = 0;
        envmapi_axis_filter(&axis);
        double norm = job->lobe->raw || job->norm > 0 ? job->norm : axis.norm;
        for (int c = 0; c < 3; ++c) out[c] = envmapi_to_float(axis.rgb[c] / norm);
    }
}

/* Every slice k of src into slice k of dst, or src's only one into all. */
static envmap_result envmapi_filter_reference(envmap *dst, const envmap *src,
                                              const envmap_lobe *lobe,
                                              const envmap_filter_desc *desc) {
    envmapi_source source;
    envmapi_reference job = {&source, dst, lobe, envmapi_lobe_norm(lobe), 0};
    int rows = dst->size * envmap_faces(dst->mapping),
        alike = src->slices == 1 && lobe->p0 == lobe->p1;
    int together = src->slices > 1 || alike ? 1 : dst->slices;
    int runs = src->slices > 1 ? dst->slices : 1;
    for (int run = 0; run < runs; ++run) {
        envmapi_progress_part part = {&desc->progress, (float)run / (float)runs, 1 / (float)runs};
        envmap_progress progress = {&part, desc->progress.report ? envmapi_report_part : NULL};
        job.first_slice = run;
        envmap_result result = envmapi_source_create(&source, src, run, desc->memory);
        if (!result)
            result = envmapi_run(&desc->executor, &progress, envmapi_reference_row, &job,
                                 rows * together);
        envmapi_source_free(&source, desc->memory);
        if (result) return result;
    }
    size_t floats = 3 * envmapi_area(dst->mapping, dst->size) * (size_t)envmap_faces(dst->mapping);
    for (int slice = 1; alike && slice < dst->slices; ++slice)
        memcpy(dst->texels + floats * (size_t)slice, dst->texels, floats * sizeof(float));
    return ENVMAP_OK;
}

/* HIERARCHICAL: [KVHS00] 5.1, two mip-maps that are walked together.
       L(a) = sum over accepted nodes n of k_n(a) E_n / norm,   E_n = sum of L_i w_i, w_i under n
   The environment's mip-map holds E and w, summed over 2x2 children: the solid angle is carried
   there and not by k. The lobe's is made anew for every axis: sampled at the nodes of level 2
   (4x4 texels), averaged upward by 2x2 boxes, and evaluated at levels 1 and 0 only where opened.
   A node serves in place of its four children where their lobe values differ from its own by no
   more than threshold * peak of k; normalised results divide by sum k_n w_n over the same nodes.
   Ours: a node is sampled at the centroid of its solid angle, so rims and sizes that are no powers
   of two need no padding texels; a cone about every node keeps the walk off what lies outside the
   lobe's support; Phong and Gaussian come from a table of cubics (1e-8); levels are walked from
   below, so that the lobe need not be stored, and a node serves only where all its children do:
   four equal means about a peak in their middle are no reason not to look at it. An axis that no
   sample of the lobe falls on takes the bilinear radiance.
   The rule compares lobe values alone: it keeps a sun no better than the dark, and a lobe thinner
   than 4 texels slips between samples.
   Invariants: negative threshold = the sum over texel centres; constants stay.
   Tests: tests/test_hierarchical.c; figures: tests/bench_table1.c. */

/* Four siblings. */
typedef struct envmapi_quad {
    double x[4], y[4], z[4]; /* centroids, unit */
    double e[4][4];          /* r, g, b times solid angle, and the solid angle */
} envmapi_quad;

/* A node of level 2: its 4 children and their 16. */
typedef struct envmapi_hier_block {
    envmapi_quad one, zero[4];
} envmapi_hier_block;

/* A node of level 3 (children are blocks) and more (children are nodes). */
typedef struct envmapi_hier_node {
    envmapi_quad quad;
    double share[4];         /* of the node's texels; 0: no such child */
    double radius[4];        /* angle from a child's centroid that holds all centroids below it */
    double low[4], high[4];  /* cosines between which the child meets the lobe's support */
    int child[4];
} envmapi_hier_node;

/* What a parent needs to know of a child. */
typedef struct envmapi_hier_part {
    double e[4], moment[3]; /* moment: sum of w d */
    double centre[3], radius;
    int texels;
} envmapi_hier_part;

typedef struct envmapi_hier_tree {
    envmapi_hier_block *blocks;
    envmapi_hier_node *nodes;
    int *texel; /* face order -> index in the source, -1: does not count; NULL once built */
    int block_count, node_count, levels, root[6];
    void *block; /* all of the above but texel */
} envmapi_hier_tree;

/* Four siblings become a quad and their parent. */
static void envmapi_hier_join(envmapi_hier_part *out, envmapi_quad *quad,
                              const envmapi_hier_part in[4]) {
    memset(out, 0, sizeof *out);
    for (int j = 0; j < 4; ++j) {
        for (int c = 0; c < 4; ++c) out->e[c] += in[j].e[c], quad->e[j][c] = in[j].e[c];
        for (int c = 0; c < 3; ++c) out->moment[c] += in[j].moment[c];
        out->texels += in[j].texels;
    }
    envmapi_unit(out->centre, out->moment);
    for (int j = 0; j < 4; ++j) {
        const double *d = in[j].texels ? in[j].centre : out->centre;
        double radius = envmapi_angle(out->centre, d) + in[j].radius;
        if (radius > out->radius) out->radius = radius;
        quad->x[j] = d[0], quad->y[j] = d[1], quad->z[j] = d[2];
    }
}

/* Texel (x,y) of a face as a part; without texels where there is none that counts. */
static void envmapi_hier_texel(envmapi_hier_part *part, const envmapi_hier_tree *tree,
                               const envmapi_source *source, int face, int x, int y) {
    int edge = source->map->size, width = envmapi_width(source->map->mapping, edge);
    memset(part, 0, sizeof *part);
    if (x >= width || y >= edge) return;
    int i = tree->texel[((size_t)face * (size_t)edge + (size_t)y) * (size_t)width + (size_t)x];
    if (i < 0) return;
    double w = source->w[i];
    part->e[0] = source->r[i], part->e[1] = source->g[i], part->e[2] = source->b[i];
    part->e[3] = w, part->texels = 1;
    part->centre[0] = source->x[i], part->centre[1] = source->y[i], part->centre[2] = source->z[i];
    for (int c = 0; c < 3; ++c) part->moment[c] = w * part->centre[c];
}

/* The 4x4 texels from (x,y) on. */
static int envmapi_hier_leaf(envmapi_hier_part *out, envmapi_hier_tree *tree,
                             const envmapi_source *source, int face, int x, int y) {
    envmapi_hier_block *block = tree->blocks + tree->block_count;
    envmapi_hier_part ones[4], zeros[4];
    for (int j = 0; j < 4; ++j) {
        int x1 = x + 2 * (j & 1), y1 = y + 2 * (j >> 1);
        for (int i = 0; i < 4; ++i)
            envmapi_hier_texel(zeros + i, tree, source, face, x1 + (i & 1), y1 + (i >> 1));
        envmapi_hier_join(ones + j, block->zero + j, zeros);
    }
    envmapi_hier_join(out, &block->one, ones);
    return out->texels ? tree->block_count++ : -1;
}

/* The node of a level whose first texel is (x,y), and all below it; -1 where there is nothing. */
static int envmapi_hier_plant(envmapi_hier_part *out, envmapi_hier_tree *tree,
                              const envmapi_source *source, int face, int level, int x, int y) {
    int edge = source->map->size;
    memset(out, 0, sizeof *out);
    if (x >= envmapi_width(source->map->mapping, edge) || y >= edge) return -1;
    if (level == 2) return envmapi_hier_leaf(out, tree, source, face, x, y);
    int at = tree->node_count++;
    envmapi_hier_node *node = tree->nodes + at;
    envmapi_hier_part parts[4];
    for (int j = 0; j < 4; ++j) {
        int side = 1 << (level - 1);
        node->child[j] = envmapi_hier_plant(parts + j, tree, source, face, level - 1,
                                            x + side * (j & 1), y + side * (j >> 1));
    }
    envmapi_hier_join(out, &node->quad, parts);
    if (!out->texels) {
        tree->node_count = at; /* nothing was planted below it */
        return -1;
    }
    for (int j = 0; j < 4; ++j) {
        node->share[j] = (double)parts[j].texels / out->texels;
        node->radius[j] = parts[j].radius;
    }
    return at;
}

static void envmapi_hier_free(envmapi_hier_tree *tree, void *memory) {
    if (tree->block) ENVMAP_FREE(memory, tree->block);
    tree->block = NULL;
}

/* Room for every block and node there can be, and for the texels' indices while planting. */
static envmap_result envmapi_hier_reserve(envmapi_hier_tree *tree, const envmap *map,
                                          void *memory) {
    size_t faces = (size_t)envmap_faces(map->mapping), blocks = 0, nodes = 0;
    size_t width = (size_t)envmapi_width(map->mapping, map->size), edge = (size_t)map->size;
    memset(tree, 0, sizeof *tree);
    for (size_t side = 4; tree->levels < 3 || side / 2 < width; side *= 2) {
        size_t count = faces * ((width + side - 1) / side) * ((edge + side - 1) / side);
        if (side == 4) blocks = count, tree->levels = 2;
        else nodes += count, ++tree->levels;
    }
    if (blocks > SIZE_MAX / 4096) return ENVMAP_ERROR_MEMORY;
    size_t bytes = blocks * sizeof *tree->blocks + nodes * sizeof *tree->nodes;
    tree->block = ENVMAP_MALLOC(memory, bytes);
    if (!tree->block) return ENVMAP_ERROR_MEMORY;
    tree->blocks = (envmapi_hier_block *)tree->block;
    tree->nodes = (envmapi_hier_node *)(void *)(tree->blocks + blocks);
    size_t texels = faces * width * edge;
    tree->texel = (int *)ENVMAP_MALLOC(memory, texels * sizeof(int));
    if (!tree->texel) return ENVMAP_ERROR_MEMORY;
    for (size_t i = 0; i < texels; ++i) tree->texel[i] = -1;
    return ENVMAP_OK;
}

/* The environment's mip-map of one slice. On failure nothing is left behind. */
static envmap_result envmapi_hier_create(envmapi_hier_tree *tree, const envmap *map, int slice,
                                         void *memory) {
    envmapi_source source;
    envmapi_hier_part whole;
    envmap_result result = envmapi_hier_reserve(tree, map, memory);
    if (!result) result = envmapi_source_create(&source, map, slice, memory);
    if (!result) {
        for (size_t i = 0; i < source.count; ++i) tree->texel[source.texel[i]] = (int)i;
        for (int face = 0; face < envmap_faces(map->mapping); ++face)
            tree->root[face] =
                envmapi_hier_plant(&whole, tree, &source, face, tree->levels, 0, 0);
        envmapi_source_free(&source, memory);
    }
    if (tree->texel) ENVMAP_FREE(memory, tree->texel);
    tree->texel = NULL;
    if (result) envmapi_hier_free(tree, memory);
    return result;
}

#define ENVMAPI_HIER_STEPS 512

/* One slice of one filter call: a task is a row of a face. */
typedef struct envmapi_hier {
    const envmap *dst, *src;
    const envmap_lobe *lobe;
    envmapi_hier_tree tree;
    double p, norm, peak, threshold, from, to;
    double steps; /* of the table, per unit of 1 - x; 0: no table */
    double table[ENVMAPI_HIER_STEPS][4];
    int slice;
} envmapi_hier;

/* Cubics in f = [0,1] through four values of k on every step: exact for N = 1, 2, 3. */
static void envmapi_hier_tabulate(envmapi_hier *job) {
    double end = 1 - cos(job->to), n = (double)job->lobe->parameter, y[4];
    int phong = job->lobe->kind == ENVMAP_LOBE_PHONG && n > 0 && (n >= 3 || !(floor(n) < n));
    job->steps = 0;
    if (!phong && job->lobe->kind != ENVMAP_LOBE_GAUSSIAN) return;
    job->steps = ENVMAPI_HIER_STEPS / end;
    for (int i = 0; i < ENVMAPI_HIER_STEPS; ++i) {
        double *c = job->table[i];
        for (int j = 0; j < 4; ++j)
            y[j] = envmapi_k(job->lobe, 1 - end * (3 * i + j) / (3 * ENVMAPI_HIER_STEPS), job->p);
        c[0] = y[0];
        c[1] = -5.5 * y[0] + 9 * y[1] - 4.5 * y[2] + y[3];
        c[2] = 9 * y[0] - 22.5 * y[1] + 18 * y[2] - 4.5 * y[3];
        c[3] = -4.5 * y[0] + 13.5 * y[1] - 13.5 * y[2] + 4.5 * y[3];
    }
}

static double envmapi_hier_peak(const envmap_lobe *lobe, double p) {
    envmapi_walk walk = envmapi_walk_of(lobe, p, 0, ENVMAPI_PI, 1);
    double peak = fabs(envmapi_k(lobe, 1, p)), theta, weight;
    while (envmapi_walk_next(&walk, &theta, &weight)) {
        double k = fabs(envmapi_k(lobe, cos(theta), p));
        if (k > peak) peak = k;
    }
    return peak;
}

/* Makes ready for a slice: the support, in cosines about every node, and the lobe's table. */
static void envmapi_hier_aim(envmapi_hier *job, int slice, double threshold) {
    job->slice = slice, job->p = envmapi_slice_p(job->lobe, slice, job->dst->slices);
    job->peak = envmapi_hier_peak(job->lobe, job->p);
    job->threshold = threshold < 0 ? -1 : job->peak * (threshold > 0 ? threshold : 1e-3);
    envmap_lobe_support(&job->from, &job->to, job->lobe, job->p);
    envmapi_hier_tabulate(job);
    for (int i = 0; i < job->tree.node_count; ++i) {
        envmapi_hier_node *node = job->tree.nodes + i;
        for (int j = 0; j < 4; ++j) {
            double inner = job->from - node->radius[j], outer = job->to + node->radius[j];
            node->low[j] = outer < ENVMAPI_PI ? cos(outer) - 1e-12 : -2;
            node->high[j] = inner > 0 ? cos(inner) + 1e-12 : 2;
        }
    }
}

/* The lobe about axis a at four siblings. */
static void envmapi_hier_k(double k[4], const envmapi_hier *job, const double a[3],
                           const envmapi_quad *quad) {
    double x[4];
    for (int i = 0; i < 4; ++i) x[i] = a[0] * quad->x[i] + a[1] * quad->y[i] + a[2] * quad->z[i];
    if (!(job->steps > 0)) {
        for (int i = 0; i < 4; ++i) k[i] = envmapi_k(job->lobe, x[i], job->p);
        return;
    }
    for (int i = 0; i < 4; ++i) {
        double t = (1 - x[i]) * job->steps;
        int step = t < ENVMAPI_HIER_STEPS ? (int)t : 0;
        const double *c = job->table[step];
        double f = t - step, value = c[0] + f * (c[1] + f * (c[2] + f * c[3]));
        k[i] = t < ENVMAPI_HIER_STEPS ? value : 0;
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

/* Adds a node of level 2, where the lobe is k2. */
static void envmapi_hier_open(double sum[4], const envmapi_hier *job, const double a[3],
                              const envmapi_hier_block *block, double k2, const double e[4]) {
    double k1[4], k0[4];
    envmapi_hier_k(k1, job, a, &block->one);
    if (envmapi_hier_alike(k1, k2, job->threshold)) {
        envmapi_hier_add(sum, k2, e);
        return;
    }
    for (int j = 0; j < 4; ++j) {
        envmapi_hier_k(k0, job, a, block->zero + j);
        if (envmapi_hier_alike(k0, k1[j], job->threshold))
            envmapi_hier_add(sum, k1[j], block->one.e[j]);
        else
            for (int i = 0; i < 4; ++i) envmapi_hier_add(sum, k0[i], block->zero[j].e[i]);
    }
}

/* Adds a node of level 3 or more to sum and returns the mean of the lobe over it; counts those that
   were opened, for their ancestors must be too. e NULL: the top, which is always opened. */
static double envmapi_hier_visit(double sum[4], int *opened, const envmapi_hier *job,
                                 const double a[3], int level, int at, const double *e) {
    const envmapi_hier_node *node = job->tree.nodes + at;
    const envmapi_quad *quad = &node->quad;
    double k[4] = {0, 0, 0, 0}, part[4] = {0, 0, 0, 0}, mean = 0;
    int before = *opened;
    if (level == 3) envmapi_hier_k(k, job, a, quad);
    for (int j = 0; level > 3 && j < 4; ++j) {
        double x = a[0] * quad->x[j] + a[1] * quad->y[j] + a[2] * quad->z[j];
        if (node->share[j] > 0 && x >= node->low[j] && x <= node->high[j])
            k[j] = envmapi_hier_visit(part, opened, job, a, level - 1, node->child[j],
                                      quad->e[j]);
    }
    for (int j = 0; j < 4; ++j) mean += node->share[j] * k[j];
    for (int j = 0; j < 4; ++j)
        if (!(node->share[j] > 0)) k[j] = mean;
    if (e && *opened == before && envmapi_hier_alike(k, mean, job->threshold)) {
        envmapi_hier_add(sum, mean, e);
        return mean;
    }
    ++*opened;
    for (int j = 0; level == 3 && j < 4; ++j)
        if (node->share[j] > 0)
            envmapi_hier_open(part, job, a, job->tree.blocks + node->child[j], k[j], quad->e[j]);
    envmapi_hier_add(sum, 1, part);
    return mean;
}

/* Where no sample of the lobe fell on a texel: the bilinear radiance. */
static void envmapi_hier_between(double sum[4], const envmapi_hier *job, const double a[3]) {
    envmapi_axis axis;
    memset(&axis, 0, sizeof axis);
    axis.lobe = job->lobe, axis.p = job->p, axis.from = job->from, axis.to = job->to;
    axis.level = envmapi_level_of(job->src, 0, job->src->slices > 1 ? job->slice : 0);
    memcpy(axis.a, a, sizeof axis.a);
    axis.texel = envmapi_texel_extent(job->src);
    envmapi_axis_polar(&axis, axis.to);
    for (int c = 0; c < 3; ++c) sum[c] = axis.rgb[c];
    sum[3] = axis.norm;
}

static void envmapi_hier_row(void *context, int task) {
    const envmapi_hier *job = (const envmapi_hier *)context;
    const envmap *dst = job->dst;
    int face = task / dst->size, y = task % dst->size;
    float *out = envmap_texel(dst, 0, job->slice, face, 0, y);
    for (int x = 0; x < envmapi_width(dst->mapping, dst->size); ++x, out += 3) {
        double a[3], sum[4] = {0, 0, 0, 0};
        int opened = 0;
        envmapi_texel_direction(a, dst->mapping, face, dst->size, x, y);
        for (int f = 0; f < envmap_faces(job->src->mapping); ++f)
            envmapi_hier_visit(sum, &opened, job, a, job->tree.levels, job->tree.root[f], NULL);
        if (fabs(sum[3]) <= 1e-100 * job->peak) envmapi_hier_between(sum, job, a);
        double norm = job->lobe->raw || job->norm > 0 ? job->norm : sum[3];
        for (int c = 0; c < 3; ++c) out[c] = envmapi_to_float(sum[c] / norm);
    }
}

/* Every slice k of src into slice k of dst, or src's only one into all. */
static envmap_result envmapi_filter_hierarchical(envmap *dst, const envmap *src,
                                                 const envmap_lobe *lobe,
                                                 const envmap_filter_desc *desc) {
    envmapi_hier job;
    int faces = envmap_faces(dst->mapping), alike = src->slices == 1 && lobe->p0 == lobe->p1;
    int runs = alike ? 1 : dst->slices;
    envmap_result result = ENVMAP_OK;
    memset(&job, 0, sizeof job);
    job.dst = dst, job.src = src, job.lobe = lobe, job.norm = envmapi_lobe_norm(lobe);
    for (int run = 0; !result && run < runs; ++run) {
        envmapi_progress_part part = {&desc->progress, (float)run / (float)runs, 1 / (float)runs};
        envmap_progress progress = {&part, desc->progress.report ? envmapi_report_part : NULL};
        if (run == 0 || src->slices > 1) {
            envmapi_hier_free(&job.tree, desc->memory);
            result = envmapi_hier_create(&job.tree, src, run, desc->memory);
        }
        if (result) break;
        envmapi_hier_aim(&job, run, (double)desc->threshold);
        result = envmapi_run(&desc->executor, &progress, envmapi_hier_row, &job, dst->size * faces);
    }
    envmapi_hier_free(&job.tree, desc->memory);
    size_t floats = 3 * envmapi_area(dst->mapping, dst->size) * (size_t)faces;
    for (int slice = 1; !result && alike && slice < dst->slices; ++slice)
        memcpy(dst->texels + floats * (size_t)slice, dst->texels, floats * sizeof(float));
    return result;
}

/* FAST. A lobe makes a result with nothing finer than its bands, and sees nothing finer in the
   source: so work on grids that are no finer than the lobe. Per face a grid in the map's own
   (u,v), padded past the edges (a node there is simply a direction):
       source texels --adjoint of cubic spline--> grid nodes --rings, a_lm, lambda_l, rings-->
       grid nodes of the result --cubic spline--> result texels
   Every arrow is linear and as exact for a sun as for a sky; what is lost of band l is
   e(l) = 2.6 (l h / 2 pi)^4 or more on a grid of spacing h, and everything beyond the last band.
   Both are bounded from lambda_l and the scene's contrast kappa: a band holds at most kappa^2
   times what one light of the same energy puts there (kappa^2 = sum (E_i - mean w_i)^2 /
   (sum E_i)^2 over blocks i as wide as the band's half wave).
     rms     kappa^2 sum_(l>=L) (2l+1) lambda_l^2 <= (tolerance/4)^2 R,
             kappa^2 sum_l (2l+1) lambda_l^2 e(l)^2 <= (tolerance/4)^2 R,
             R = (1-kappa^2) lambda_0^2 + kappa^2 sum_l (2l+1) lambda_l^2, the result's power
     texels  at every angle t from a light, what is lost, d(t) = sum (2l+1) lambda_l P_l(cos t) over
             l >= L or times e(l), stays below 5 tolerances of what the light itself sends
             there, or of the darkest that counts (8 at a kink; 3 for each spline, of which there
             are four): all of them together below 20:
             kappa |d(t)| <= 5 tolerance max(kappa k(t), D lambda_0),  D = 1/1000
   A lobe with a kink (diffuse, Banks) has bands that end slowly. There texels brighter than 1/2000
   of all light are summed one by one, exactly; and a first pass with 48 bands finds how dark the
   result really gets (D) before it is decided how many are needed.
   Tests: tests/test_fast.c. */

/* The grid of a map: nu x nv nodes a face, `pad` more beyond each edge; or the texels. */
typedef struct envmapi_grid {
    const envmap *map;
    int faces, width, height, nu, nv, pad, identity;
    size_t count; /* nodes */
} envmapi_grid;

/* Nodes no farther apart than h: the largest |d direction / du| is the span of a face. Sphere and
   angular maps end at their rims, so their texels are the grid; and no grid is worth it that is
   not coarser than the texels. */
static envmapi_grid envmapi_grid_of(const envmap *map, double h, double tolerance) {
    static const double span[ENVMAP_MAPPING_COUNT] = {2, 4, 1, 2 * ENVMAPI_PI, 1};
    envmapi_grid grid;
    int width = envmapi_width(map->mapping, map->size);
    double n = ceil(span[map->mapping] / h), aspect = map->mapping == ENVMAP_LATLONG ? 2 : 1;
    grid.map = map, grid.faces = envmap_faces(map->mapping);
    grid.pad =
        2 + (int)ceil(-log(tolerance) / 1.317); /* a spline forgets its end by 0.268 a node */
    double nodes = (n + 2 * grid.pad) * (n / aspect + 2 * grid.pad);
    grid.identity = map->mapping == ENVMAP_SPHERE || map->mapping == ENVMAP_ANGULAR ||
                    nodes > 0.6 * width * map->size;
    if (grid.identity) grid.pad = 0, n = width;
    grid.nu = n < 4 ? 4 : (int)n;
    grid.nv = grid.identity ? map->size : (int)ceil(grid.nu / aspect);
    if (grid.identity) grid.nu = width;
    grid.width = grid.nu + 2 * grid.pad, grid.height = grid.nv + 2 * grid.pad;
    grid.count = (size_t)grid.faces * (size_t)grid.width * (size_t)grid.height;
    return grid;
}

/* Four nodes and their spline weights for each texel along one side. */
typedef struct envmapi_taps {
    int start;
    float w[4];
} envmapi_taps;

static void envmapi_taps_fill(envmapi_taps *taps, int texels, int nodes, int pad) {
    for (int x = 0; x < texels; ++x) {
        double at = (x + 0.5) / texels * nodes - 0.5 + pad, before = floor(at);
        taps[x].start = (int)before - 1;
        envmapi_spline(taps[x].w, (float)(at - before));
    }
}

/* A texel that is summed by itself, exactly. */
typedef struct envmapi_light {
    size_t texel;
    double d[3], value[4]; /* RGB times solid angle, solid angle */
} envmapi_light;

/* One call's work in flight: the source side and the result side take turns with it. */
typedef struct envmapi_fast {
    envmapi_grid grid;
    envmapi_taps *u, *v;
    const float *texels; /* of the source slice */
    float *out;          /* of the result slice */
    float *omega;        /* solid angle of a face's texels; 0 where a rim cuts */
    float *nodes;        /* [count][4]: RGB and solid angle */
    float *rows;         /* a row of the grid for each task */
    envmapi_point *points;
    envmapi_rings rings;
    int strips; /* horizontal, of a face's grid: one a task */
    const envmap_lobe *lobe;
    double norm, p; /* of the slice */
    int divide;     /* by the fourth channel */
    const envmapi_light *lights;
    int light_count;
    double fine; /* kappa of the texels that are left */
    size_t rim_count;
    double limit; /* energy that makes a light */
} envmapi_fast;

/* Solid angles of row y. Cube and paraboloid, 64 and larger: density rho = c (1+q)^-s, q = X^2+Y^2,
   averaged over the texel to fourth order, rho (1 + side^2/24 laplacian(rho)/rho). */
static void envmapi_task_omega(void *context, int y) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    int mapping = f->grid.map->mapping, edge = f->grid.map->size,
        width = envmapi_width(mapping, edge);
    float *omega = f->omega + (size_t)y * (size_t)width;
    double side = 2.0 / width, Y = (2 * y + 1.0) / edge - 1, area = side * side;
    int cube = mapping == ENVMAP_CUBE,
        smooth = edge >= 64 && (cube || mapping == ENVMAP_PARABOLOID);
    double row = mapping == ENVMAP_LATLONG ? envmapi_texel_cell(NULL, mapping, edge, 0, y) : 0;
    for (int x = 0; smooth && x < width; ++x) {
        double X = (2 * x + 1.0) / width - 1, q = 1 + X * X + Y * Y, i = 1 / (q * q);
        double rho = cube ? sqrt(q) * i : 4 * i;
        omega[x] =
            (float)(area * rho * (1 + area * i * (cube ? (1.5 * q - 2.5) / 4 : (2 * q - 3) / 3)));
    }
    for (int x = 0; !smooth && x < width; ++x)
        omega[x] = (float)(row > 0 ? row : envmapi_texel_cell(NULL, mapping, edge, x, y));
    for (int x = 0; envmapi_is_disc(mapping) && x < width; ++x) { /* cut by the rim: see there */
        double X = fabs((2 * x + 1.0) / width - 1) + side / 2, y_end = fabs(Y) + side / 2;
        if (X * X + y_end * y_end > 1) omega[x] = 0;
    }
}

/* Texel rows whose taps meet grid rows from .. to-1. */
static void envmapi_grid_rows(int *first, int *last, const envmapi_fast *f, int from, int to) {
    *first = 0, *last = f->grid.map->size;
    while (*first < *last && f->v[*first].start + 3 < from) ++*first;
    while (*last > *first && f->v[*last - 1].start >= to) --*last;
}

/* row += one row of texels times solid angle, spread to the nodes: a run of texels between the
   same nodes is gathered in registers first. */
static void envmapi_reduce_row(float *row, const envmapi_fast *f, const float *texels,
                               const float *omega) {
    int width = envmapi_width(f->grid.map->mapping, f->grid.map->size);
    for (int x = 0; x < width;) {
        int start = f->u[x].start;
        float sum[4][4] = {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}};
        for (; x < width && f->u[x].start == start; ++x) {
            float w = omega[x];
            float light[4] = {w * texels[3 * x], w * texels[3 * x + 1], w * texels[3 * x + 2], w};
            for (int i = 0; i < 4; ++i) envmapi_add4f(sum[i], f->u[x].w[i], light);
        }
        for (int i = 0; i < 4; ++i) envmapi_add4f(row + 4 * (start + i), 1, sum[i]);
    }
}

/* Task: one horizontal band of one face's grid, from the texels that reach it. */
static void envmapi_task_reduce(void *context, int task) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    const envmapi_grid *grid = &f->grid;
    int face = task / f->strips, band = task % f->strips, first, last;
    int from = grid->height * band / f->strips, to = grid->height * (band + 1) / f->strips;
    size_t width = (size_t)envmapi_width(grid->map->mapping, grid->map->size);
    size_t area = width * (size_t)grid->map->size, row_floats = 4 * (size_t)grid->width;
    float *nodes = f->nodes + (size_t)face * (size_t)grid->height * row_floats;
    float *row = f->rows + (size_t)task * row_floats;
    memset(nodes + (size_t)from * row_floats, 0, (size_t)(to - from) * row_floats * sizeof(float));
    envmapi_grid_rows(&first, &last, f, from, to);
    for (int y = first; y < last; ++y) {
        memset(row, 0, row_floats * sizeof(float));
        envmapi_reduce_row(row, f, f->texels + 3 * ((size_t)face * area + (size_t)y * width),
                           f->omega + (size_t)y * width);
        for (int i = 0; i < 4; ++i) {
            int j = f->v[y].start + i;
            float w = f->v[y].w[i], *out = nodes + (size_t)j * row_floats;
            if (j < from || j >= to) continue;
            for (size_t k = 0; k < row_floats; ++k) out[k] += w * row[k];
        }
    }
}

/* The same where the nodes are the texels. Task: a face. */
static void envmapi_task_copy(void *context, int face) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    size_t area = f->grid.count / (size_t)f->grid.faces;
    const float *texel = f->texels + 3 * (size_t)face * area;
    float *node = f->nodes + 4 * (size_t)face * area;
    for (size_t i = 0; i < area; ++i, texel += 3, node += 4) {
        float w = f->omega[i];
        node[0] = w * texel[0], node[1] = w * texel[1], node[2] = w * texel[2], node[3] = w;
    }
}

/* (1/6, 4/6, 1/6) c = f along n items of `floats` numbers, `stride` apart, ends mirrored. */
static void envmapi_spline_solve(float *f, int n, size_t stride, size_t floats, float *pivots) {
    for (int i = 0; i < n; ++i) {
        float diagonal = (i == 0 || i == n - 1 ? 5.0f : 4.0f) - (i ? pivots[i - 1] : 0);
        float pivot = pivots[i] = 1 / diagonal, *now = f + (size_t)i * stride;
        const float *before = i ? now - stride : now;
        float last = i ? 1.0f : 0.0f;
        for (size_t k = 0; k < floats; ++k) now[k] = (6 * now[k] - last * before[k]) * pivot;
    }
    for (int i = n - 2; i >= 0; --i) {
        float *now = f + (size_t)i * stride;
        const float *after = now + stride;
        for (size_t k = 0; k < floats; ++k) now[k] -= pivots[i] * after[k];
    }
}

/* Samples to spline coefficients; its own adjoint. Task: a face. */
static void envmapi_task_solve(void *context, int face) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    size_t row = 4 * (size_t)f->grid.width;
    float *nodes = f->nodes + (size_t)face * (size_t)f->grid.height * row;
    float *pivots = f->rows + (size_t)face * (row + 4 * (size_t)f->grid.height);
    envmapi_spline_solve(nodes, f->grid.height, row, row, pivots);
    for (int y = 0; y < f->grid.height; ++y)
        envmapi_spline_solve(nodes + (size_t)y * row, f->grid.width, 4, 4, pivots);
}

/* Where the nodes are. Task: a row of the grid, of every face. */
static void envmapi_task_points(void *context, int y) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    const envmapi_grid *grid = &f->grid;
    for (int face = 0; face < grid->faces; ++face) {
        envmapi_point *points = f->points + ((size_t)face * (size_t)grid->height + (size_t)y) *
                                                (size_t)grid->width;
        for (int x = 0; x < grid->width; ++x) {
            double d[3];
            envmapi_ray(d, grid->map->mapping, face, (x - grid->pad + 0.5) / grid->nu,
                        (y - grid->pad + 0.5) / grid->nv);
            points[x] = envmapi_rings_point(&f->rings, d);
        }
    }
}

/* sum += what the lights, which the bands leave out, send to a texel. */
static void envmapi_add_lights(float sum[4], const envmapi_fast *f, int face, int x, int y) {
    double a[3], total[4] = {0, 0, 0, 0}, cosines[64], k[64];
    envmapi_texel_direction(a, f->grid.map->mapping, face, f->grid.map->size, x, y);
    for (int first = 0; first < f->light_count; first += 64) {
        const envmapi_light *lights = f->lights + first;
        int n = f->light_count - first < 64 ? f->light_count - first : 64;
        for (int i = 0; i < n; ++i) cosines[i] = envmapi_dot(a, lights[i].d);
        envmapi_k_many(k, cosines, n, f->lobe, f->p);
        for (int i = 0; i < n; ++i) envmapi_add4(total, k[i], lights[i].value);
    }
    for (int c = 0; c < 4; ++c) sum[c] += (float)(total[c] / f->norm);
}

/* Texels from spline coefficients, rgb / w where that is the norm. Task: a row of every face. */
static void envmapi_task_expand(void *context, int y) {
    const envmapi_fast *f = (const envmapi_fast *)context;
    const envmapi_grid *grid = &f->grid;
    int width = envmapi_width(grid->map->mapping, grid->map->size);
    size_t floats = 4 * (size_t)grid->width, area = (size_t)width * (size_t)grid->map->size;
    float *row = f->rows + (size_t)y * floats;
    for (int face = 0; face < grid->faces; ++face) {
        const float *nodes = f->nodes + ((size_t)face * (size_t)grid->height) * floats;
        float *out = f->out + 3 * ((size_t)face * area + (size_t)y * (size_t)width);
        if (grid->identity) {
            row = f->nodes + ((size_t)face * (size_t)grid->height + (size_t)y) * floats;
        } else {
            const float *from = nodes + (size_t)f->v[y].start * floats, *w = f->v[y].w;
            for (size_t k = 0; k < floats; ++k)
                row[k] = w[0] * from[k] + w[1] * from[floats + k] + w[2] * from[2 * floats + k] +
                         w[3] * from[3 * floats + k];
        }
        for (int x = 0; x < width; ++x, out += 3) {
            float sum[4] = {0, 0, 0, 0};
            if (grid->identity)
                memcpy(sum, row + 4 * x, sizeof sum);
            else
                for (int i = 0; i < 4; ++i)
                    envmapi_add4f(sum, f->u[x].w[i], row + 4 * (f->u[x].start + i));
            if (f->light_count) envmapi_add_lights(sum, f, face, x, y);
            float scale = f->divide ? 1 / sum[3] : 1;
            for (int c = 0; c < 3; ++c) out[c] = sum[c] * scale;
        }
    }
}

/* What a lobe asks of the scene: lambda_l of every slice, the bands that one light would need, and
   the grid for them. */
typedef struct envmapi_plan {
    const envmap_lobe *lobe;
    envmap *dst;
    double *lambda; /* [slices][bands] */
    double *rest;            /* [slices]: sum (2l+1) lambda_l^2 beyond them */
    int bands, need, slices; /* for one light (or all there may be), for this scene */
    double tolerance, h, sigma, dark; /* dark: the darkest of the result over its mean */
    int kinked;
} envmapi_plan;

#define ENVMAPI_FAST_BANDS 768

/* sum_l (2l+1) lambda_l^2 e^2 over l >= from of one slice, e the spline's error on a grid of h. */
static double envmapi_plan_power(const envmapi_plan *plan, int slice, int from, double h) {
    const double *lambda = plan->lambda + (size_t)slice * (size_t)plan->bands;
    double sum = plan->rest[slice];
    for (int l = from; l < plan->bands; ++l) {
        double e = h > 0 ? envmapi_spline_error(l * h / (2 * ENVMAPI_PI)) : 1;
        sum += (2 * l + 1) * lambda[l] * lambda[l] * e * e;
    }
    return sum;
}

/* The largest |lambda_0| of all slices: those much darker are held to a tenth of that. */
static double envmapi_plan_mean(const envmapi_plan *plan, int slice) {
    double brightest = 0;
    for (int k = 0; k < plan->slices; ++k)
        brightest = fmax(brightest, fabs(plan->lambda[(size_t)k * (size_t)plan->bands]));
    return fmax(fabs(plan->lambda[(size_t)slice * (size_t)plan->bands]), brightest / 10);
}

/* The rms bounds above, for L bands (h = 0) or grids of spacing h. */
static int envmapi_plan_rms_holds(const envmapi_plan *plan, int slice, int L, double h,
                                  double contrast) {
    double c2 = contrast * contrast, mean = envmapi_plan_mean(plan, slice);
    double R = (1 - c2) * mean * mean + c2 * envmapi_plan_power(plan, slice, 0, 0);
    double limit = plan->tolerance / 4;
    return c2 * envmapi_plan_power(plan, slice, L, h) <= limit * limit * R;
}

/* The bound on texels, at one angle: the fewest bands (h = 0) that keep it from there on, or
   whether a spacing h does. */
static int envmapi_plan_texel_bands(const envmapi_plan *plan, int slice, double x, double h,
                                    double contrast) {
    const double *lambda = plan->lambda + (size_t)slice * (size_t)plan->bands;
    double terms[ENVMAPI_FAST_BANDS], k = 0, lost = 0, before = 0, P = 1;
    for (int l = 0; l < plan->bands; ++l) {
        double e = h > 0 ? envmapi_spline_error(l * h / (2 * ENVMAPI_PI)) : 1;
        terms[l] = (2 * l + 1) * lambda[l] * P;
        k += terms[l], lost += e * terms[l];
        double next = ((2 * l + 1) * x * P - l * before) / (l + 1);
        before = P, P = next;
    }
    /* All of these add up to 20: the bands, a spline on either side and on either grid. */
    double limit = (h > 0 ? 3 : plan->kinked ? 8 : 5) * plan->tolerance *
                   fmax(contrast * fabs(k), envmapi_plan_mean(plan, slice) * plan->dark);
    if (h > 0) return contrast * fabs(lost) <= limit;
    int L = plan->bands;
    for (lost = 0; L > 0; --L)
        if (contrast * fabs(lost += terms[L - 1]) > limit) break;
    return L;
}

#define ENVMAPI_ANGLES 64 /* more densely towards the axis, where sharp lobes end */

static double envmapi_plan_cosine(int i) {
    double t = (i + 0.5) / ENVMAPI_ANGLES;
    return cos(ENVMAPI_PI * t * t);
}

/* Slices that are looked at: at most five, the ends and between. */
static int envmapi_plan_slice(const envmapi_plan *plan, int i) {
    return plan->slices <= 5 ? i : (int)((size_t)i * (size_t)(plan->slices - 1) / 4);
}

static int envmapi_plan_sampled(const envmapi_plan *plan) {
    return plan->slices < 5 ? plan->slices : 5;
}

/* The widest grid whose spline errors stay within the bounds. */
static double envmapi_plan_spacing(const envmapi_plan *plan, double contrast) {
    double low = 1e-3, high = 0.8;
    for (int i = 0; i < 6; ++i) { /* to 11 % */
        double h = sqrt(low * high);
        int holds = 1;
        for (int k = 0; k < envmapi_plan_sampled(plan) && holds; ++k) {
            int slice = envmapi_plan_slice(plan, k);
            holds = envmapi_plan_rms_holds(plan, slice, 0, h, contrast);
            for (int j = 0; j < ENVMAPI_ANGLES && holds; ++j)
                holds = envmapi_plan_texel_bands(plan, slice, envmapi_plan_cosine(j), h, contrast);
        }
        if (holds) low = h;
        else high = h;
    }
    return low;
}

/* The fewest bands that keep the rms bound, for the slices that are looked at; one more than there
   are when none do. */
static int envmapi_plan_rms_bands(const envmapi_plan *plan, double contrast) {
    int bands = 1;
    for (int k = 0; k < envmapi_plan_sampled(plan); ++k) {
        int slice = envmapi_plan_slice(plan, k), low = 1, high = plan->bands + 1;
        while (low < high) {
            int middle = (low + high) / 2;
            if (envmapi_plan_rms_holds(plan, slice, middle, 0, contrast)) high = middle;
            else low = middle + 1;
        }
        if (low > bands) bands = low;
    }
    return bands;
}

/* And the bound on texels too; what is near the last band there is may be beyond it. */
static int envmapi_plan_bands(const envmapi_plan *plan, double contrast) {
    int bands = envmapi_plan_rms_bands(plan, contrast);
    for (int k = 0; k < envmapi_plan_sampled(plan); ++k)
        for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
            int L = envmapi_plan_texel_bands(plan, envmapi_plan_slice(plan, k),
                                             envmapi_plan_cosine(j), 0, contrast);
            if (L > bands) bands = L;
        }
    return bands > plan->bands - plan->bands / 8 ? plan->bands + 1 : bands;
}

/* lambda_l of every slice for `bands` bands, and the power beyond them by Parseval:
   sum (2l+1) lambda_l^2 = 4 pi (2 pi integral of k^2) / norm^2. */
static int envmapi_plan_lambda(envmapi_plan *plan, int bands) {
    const envmap_lobe *lobe = plan->lobe;
    plan->bands = bands;
    for (int k = 0; k < plan->slices; ++k) {
        double p = envmapi_slice_p(lobe, k, plan->slices), norm = envmapi_lobe_norm(lobe);
        if (!envmapi_zonal(plan->lambda + (size_t)k * (size_t)bands, bands, lobe, p)) return 0;
        if (!(norm > 0) && !lobe->raw) norm = envmapi_lobe_integral(lobe, p);
        double power = 4 * ENVMAPI_PI * envmapi_lobe_power(lobe, p, 2) / (norm * norm);
        plan->rest[k] = 0;
        double rest = power - envmapi_plan_power(plan, k, 0, 0);
        plan->rest[k] = rest > 1e-11 * power ? rest : 0;
    }
    return 1;
}

/* Sets up a plan with the bands that one light would need, or all there may be. 0 when the lobe is
   sharper than src's texels, or than all bands. */
static int envmapi_plan_create(envmapi_plan *plan, envmap *dst, const envmap_lobe *lobe,
                               const envmap *src, double tolerance, envmapi_pool *pool,
                               envmap_result *result) {
    int varied = lobe->p0 < lobe->p1 || lobe->p0 > lobe->p1;
    memset(plan, 0, sizeof *plan);
    plan->lobe = lobe, plan->dst = dst, plan->tolerance = tolerance;
    plan->slices = varied ? dst->slices : 1;
    plan->sigma = ENVMAPI_PI, plan->dark = 1e-3;
    for (int k = 0; k < plan->slices; ++k)
        plan->sigma =
            fmin(plan->sigma, envmap_lobe_sigma(lobe, envmapi_slice_p(lobe, k, plan->slices)));
    if (plan->sigma < 2 * envmapi_texel_extent(src)) return 0;
    size_t n = (size_t)plan->slices;
    plan->lambda = (double *)envmapi_pool_get(pool, (ENVMAPI_FAST_BANDS + 1) * n, sizeof(double));
    if (!plan->lambda) {
        *result = ENVMAP_ERROR_MEMORY;
        return 0;
    }
    plan->rest = plan->lambda + ENVMAPI_FAST_BANDS * n;
    for (int bands = 24; bands <= ENVMAPI_FAST_BANDS; bands = bands == 24 ? 96 : 2 * bands) {
        if (!envmapi_plan_lambda(plan, bands)) return 0;
        if (envmapi_plan_bands(plan, 1) <= bands) break;
    }
    plan->need = envmapi_plan_bands(plan, 1);
    plan->h = 1;
    plan->kinked =
        plan->need > 100 && plan->need > 8 / plan->sigma; /* smooth ones end by 6/sigma */
    /* A kink sees the lattice of few, large texels, which no band holds. */
    if (plan->kinked) return envmapi_texel_extent(src) < 0.05;
    plan->h = envmapi_plan_spacing(plan, 1);
    return plan->need <= plan->bands;
}

/* Energy (all channels) and solid angle of a block of one face's nodes. */
static void envmapi_block_sum(double sum[2], const envmapi_grid *grid, const float *nodes, int x,
                              int y, int block) {
    sum[0] = sum[1] = 0;
    for (int j = y; j < y + block && j < grid->height; ++j)
        for (int i = x; i < x + block && i < grid->width; ++i) {
            const float *node = nodes + 4 * ((size_t)j * (size_t)grid->width + (size_t)i);
            sum[0] += (double)node[0] + (double)node[1] + (double)node[2];
            sum[1] += (double)node[3];
        }
}

/* kappa at the scale of band l: blocks as wide as its half wave on a grid of spacing h. */
static double envmapi_contrast(const envmapi_fast *f, double h, int l) {
    const envmapi_grid *grid = &f->grid;
    size_t area = 4 * grid->count / (size_t)grid->faces;
    double total[2] = {0, 0}, sum[2], squares = 0;
    int block = (int)envmapi_clamp(ENVMAPI_PI / (l + 1) / h, 1, 1e6);
    for (int face = 0; face < grid->faces; ++face) {
        envmapi_block_sum(sum, grid, f->nodes + (size_t)face * area, 0, 0, 1 << 20);
        total[0] += sum[0], total[1] += sum[1];
    }
    for (size_t i = grid->count; i < grid->count + f->rim_count; ++i) {
        const float *node = f->nodes + 4 * i;
        double off = (double)node[0] + (double)node[1] + (double)node[2];
        total[0] += off, total[1] += (double)node[3], squares += off * off;
    }
    if (!(total[0] > 0)) return 0;
    for (int face = 0; face < grid->faces; ++face)
        for (int y = 0; y < grid->height; y += block)
            for (int x = 0; x < grid->width; x += block) {
                envmapi_block_sum(sum, grid, f->nodes + (size_t)face * area, x, y, block);
                double off = sum[0] - total[0] / total[1] * sum[1];
                squares += off * off;
            }
    return envmapi_clamp(sqrt(squares) / total[0], 0, 1);
}

#define ENVMAPI_LIGHTS 2048

/* Texels that a rim cuts, as points of their own at their centroids; returns how many. Before there
   are rings, the values alone, which the contrast wants. */
static size_t envmapi_rim_points(envmapi_fast *f, size_t room, envmapi_light *lights,
                                 int *light_count) {
    const envmap *map = f->grid.map;
    size_t n = 0, area = envmapi_area(map->mapping, map->size);
    if (!envmapi_is_disc(map->mapping)) return 0;
    for (size_t t = 0; t < area; ++t) {
        int x = (int)(t % (size_t)map->size), y = (int)(t / (size_t)map->size);
        double X = fabs((2 * x + 1.0) / map->size - 1) - 1.0 / map->size, at[2], d[3];
        double Y = fabs((2 * y + 1.0) / map->size - 1) - 1.0 / map->size;
        if (f->omega[t] > 0 || X * X + Y * Y > 1) continue;
        double w = envmapi_texel_cell(at, map->mapping, map->size, x, y);
        for (int face = 0; w > 0 && face < f->grid.faces && n < room; ++face, ++n) {
            const float *texel = f->texels + 3 * ((size_t)face * area + t);
            float *node = f->nodes + 4 * (f->grid.count + n);
            envmapi_direction(d, map->mapping, face, at[0], at[1]);
            if (f->rings.M) {
                f->points[f->grid.count + n] = envmapi_rings_point(&f->rings, d);
                continue;
            }
            double energy = w * ((double)texel[0] + (double)texel[1] + (double)texel[2]);
            int out = lights && energy > f->limit && *light_count < ENVMAPI_LIGHTS;
            for (int c = 0; c < 4; ++c) node[c] = out ? 0 : (float)w * (c < 3 ? texel[c] : 1);
            if (!out) continue;
            envmapi_light *light = lights + (*light_count)++;
            light->texel = (size_t)face * area + t;
            memcpy(light->d, d, sizeof d);
            for (int c = 0; c < 4; ++c) light->value[c] = w * (c < 3 ? (double)texel[c] : 1.0);
        }
    }
    return n;
}

/* Everything of a grid that both sides need; `extra` points beyond its nodes. */
static envmap_result envmapi_fast_create(envmapi_fast *f, const envmap *map, double h,
                                         double tolerance, size_t extra, envmapi_pool *pool) {
    memset(f, 0, sizeof *f);
    f->grid = envmapi_grid_of(map, h, tolerance);
    f->strips = f->grid.faces == 6 ? 1 : 8 / f->grid.faces;
    int width = envmapi_width(map->mapping, map->size);
    size_t rows = (size_t)(map->size + f->strips * f->grid.faces), row = 4 * (size_t)f->grid.width;
    size_t solve = (size_t)f->grid.faces * (row + 4 * (size_t)f->grid.height);
    f->nodes = (float *)envmapi_pool_get(pool, 4 * (f->grid.count + extra), sizeof(float));
    f->points =
        (envmapi_point *)envmapi_pool_get(pool, f->grid.count + extra, sizeof(envmapi_point));
    f->u =
        (envmapi_taps *)envmapi_pool_get(pool, (size_t)(width + map->size), sizeof(envmapi_taps));
    f->rows =
        (float *)envmapi_pool_get(pool, (f->grid.identity ? 0 : rows * row) + solve, sizeof(float));
    if (!f->nodes || !f->points || !f->u || !f->rows) return ENVMAP_ERROR_MEMORY;
    f->v = f->u + width;
    envmapi_taps_fill(f->u, width, f->grid.nu, f->grid.pad);
    envmapi_taps_fill(f->v, map->size, f->grid.nv, f->grid.pad);
    return ENVMAP_OK;
}

/* Rings for L bands on a grid of spacing h, and the work space of the tasks. */
static envmap_result envmapi_transform_create(envmapi_transform *t, envmapi_rings *rings, double h,
                                              int bands, envmapi_pool *pool) {
    int M = envmapi_rings_size((int)(ENVMAPI_PI / h > bands + 2 ? ENVMAPI_PI / h : bands + 2));
    memset(t, 0, sizeof *t);
    t->rings = rings;
    t->work_size = 11 * (size_t)bands + (size_t)M;
    t->work = (double *)envmapi_pool_get(pool, ENVMAPI_TASKS * t->work_size, sizeof(double));
    if (!t->work) return ENVMAP_ERROR_MEMORY;
    return envmapi_rings_create(rings, M, bands, pool);
}

/* Source texels -> nodes. */
static void envmapi_fast_reduce(envmapi_fast *f, const envmap_executor *executor) {
    envmapi_run_all(executor, envmapi_task_omega, f, f->grid.map->size);
    if (f->grid.identity) envmapi_run_all(executor, envmapi_task_copy, f, f->grid.faces);
    else envmapi_run_all(executor, envmapi_task_reduce, f, f->grid.faces * f->strips);
}

#define ENVMAPI_FIRST_BANDS 48

/* kappa at l = 4, 8, 16 ... , and where the grid does not resolve it, between its last and that
   of the texels, on a straight line of logarithms. */
static void envmapi_contrasts(double contrasts[12], const envmapi_fast *f, double h) {
    double finest = ENVMAPI_PI / envmapi_texel_extent(f->grid.map), last = 4;
    for (int i = 0; i < 12; ++i) {
        double l = 4 << i, known = i ? contrasts[i - 1] : 1;
        if (i < 3 || l * h <= ENVMAPI_PI) {
            contrasts[i] = envmapi_contrast(f, h, 4 << i), last = l;
        } else {
            double left = fmax(log(finest / last), 0.7),
                   slope = log(fmax(f->fine, 1e-9) / fmax(known, 1e-9)) / left;
            contrasts[i] = known * exp(fmin(slope, 0) * log(l / last)), last = l;
        }
    }
}

/* The bands a plan needs of this scene: at ever finer scales, until they resolve the scale that
   the contrast was taken at. 0 where there are not enough. Sets the spacing too. */
static int envmapi_fast_bands(envmapi_plan *plan, const double contrasts[12]) {
    for (int i = 0; i < 12; ++i) {
        int l = 4 << i, need = envmapi_plan_bands(plan, contrasts[i]);
        if (need > plan->bands && l >= plan->bands) break;
        if (need > l) continue;
        plan->h = envmapi_plan_spacing(plan, contrasts[i]);
        return l < plan->bands ? l : plan->bands;
    }
    /* A kink beside nothing but dark: keep the rms at least, with room to spare. */
    int need = envmapi_plan_rms_bands(plan, contrasts[8]);
    if (need > plan->bands / 2) return 0;
    plan->h = ENVMAPI_PI / (plan->bands / 2);
    return plan->bands / 2;
}

/* For all plans; returns the most bands, and the spacing that leaves. A smooth lobe's bands hardly
   depend on the contrast, so one scale of it will do. */
static int envmapi_fast_fit(envmapi_plan *plans, int count, const envmapi_fast *f, double h,
                            const double contrasts[12], double *spacing) {
    int bands = 1;
    *spacing = 1;
    for (int i = 0; i < count; ++i) {
        if (plans[i].kinked) {
            plans[i].need = envmapi_fast_bands(plans + i, contrasts);
        } else {
            double contrast = envmapi_contrast(f, h, plans[i].need / 2);
            plans[i].need = envmapi_plan_bands(plans + i, contrast); /* at most that of one light */
            plans[i].h = envmapi_plan_spacing(plans + i, contrast);
        }
        if (plans[i].need > bands) bands = plans[i].need;
        if (plans[i].need && plans[i].h < *spacing) *spacing = plans[i].h;
    }
    return bands;
}


/* Takes a texel out of the nodes. */
static void envmapi_light_out(envmapi_fast *f, const envmapi_light *light, int face, int x, int y) {
    int taps = f->grid.identity ? 1 : 16;
    for (int k = 0; k < taps; ++k) {
        size_t row = (size_t)face * (size_t)f->grid.height + (size_t)(f->v[y].start + k / 4);
        size_t at = row * (size_t)f->grid.width + (size_t)(f->u[x].start + k % 4);
        float tap = f->grid.identity ? 1 : f->v[y].w[k / 4] * f->u[x].w[k % 4];
        if (f->grid.identity) at = light->texel;
        for (int c = 0; c < 4; ++c) f->nodes[4 * at + (size_t)c] -= tap * (float)light->value[c];
    }
}

/* Makes a list of the texels with more than 1/2000 of the scene's energy and takes them out of the
   nodes; what is left has the contrast f->fine. */
static int envmapi_fast_lights(envmapi_fast *f, envmapi_light *lights) {
    const envmap *map = f->grid.map;
    size_t area = envmapi_area(map->mapping, map->size), width = area / (size_t)map->size;
    size_t nodes = 4 * f->grid.count / (size_t)f->grid.faces;
    int n = 0;
    double total[2] = {0, 0}, sum[2], squares = 0, left = 0;
    for (int face = 0; face < f->grid.faces; ++face) {
        envmapi_block_sum(sum, &f->grid, f->nodes + nodes * (size_t)face, 0, 0, 1 << 20);
        total[0] += sum[0], total[1] += sum[1];
    }
    f->limit = total[0] / 2000;
    for (size_t i = 0; i < area * (size_t)f->grid.faces; ++i) {
        const float *texel = f->texels + 3 * i;
        double w = (double)f->omega[i % area];
        double energy = w * ((double)texel[0] + (double)texel[1] + (double)texel[2]);
        if (energy > f->limit && n < ENVMAPI_LIGHTS) {
            int face = (int)(i / area), x = (int)(i % width), y = (int)(i % area / width);
            envmapi_light *light = lights + n++;
            light->texel = i;
            for (int c = 0; c < 4; ++c) light->value[c] = w * (c < 3 ? (double)texel[c] : 1.0);
            envmapi_texel_direction(light->d, map->mapping, face, map->size, x, y);
            envmapi_light_out(f, light, face, x, y);
        } else {
            double off = energy - w * total[0] / total[1];
            left += energy, squares += off * off;
        }
    }
    f->fine = left > 0 ? fmin(sqrt(squares) / left, 1) : 0;
    return n;
}

/* What the source side hands to the result side. */
typedef struct envmapi_spectrum {
    double *a; /* a_lm */
    int bands;
    envmapi_light *lights;
    int light_count;
} envmapi_spectrum;

/* The smallest value over the mean of what a plan's slices make of the bands there are, at the
   rings (their spline coefficients, near enough); 1/1000 at least. */
static void envmapi_fast_dark(envmapi_plan *plan, envmapi_transform *t,
                              const envmap_executor *executor) {
    int n = 2 * t->rings->M;
    plan->dark = 1;
    t->count = 0;
    for (int i = 0; i < envmapi_plan_sampled(plan); ++i) {
        double least = HUGE_VAL, sum = 0;
        t->lambda = plan->lambda + (size_t)envmapi_plan_slice(plan, i) * (size_t)plan->bands;
        envmapi_synthesise(t, executor);
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < t->rings->M; ++j) {
                const double *v = t->rings->G + (size_t)k * t->rings->row + t->rings->offset[j + 2];
                double light = v[0] + v[1] + v[2];
                least = light < least ? light : least;
                sum += light * sin((j + 0.5) * ENVMAPI_PI / t->rings->M);
            }
        double mean = sum / n * ENVMAPI_PI / 2 / t->rings->M;
        plan->dark = fmin(plan->dark, mean > 0 ? least / mean / 2 : 0);
    }
    plan->dark = fmax(plan->dark, 1e-3);
}

/* Grid of spacing h -> contrasts, lights, and a_lm: of `bands`, or where 0 of those that fit. */
static envmap_result envmapi_fast_pass(envmapi_spectrum *out, envmapi_plan *plans, int count,
                                       const envmap *src, int slice, double h, int bands,
                                       const envmap_filter_desc *desc, envmapi_pool *pool) {
    envmapi_fast f;
    envmapi_transform t;
    envmap_result result;
    double contrasts[12] = {0}, spacing = h;
    int kept = pool->count;
    size_t rim = envmapi_is_disc(src->mapping) ? 16 * (size_t)src->size + 64 : 0;
    if ((result = envmapi_fast_create(&f, src, h, (double)desc->tolerance, rim, pool)))
        return result;
    f.omega = (float *)envmapi_pool_get(pool, envmapi_area(src->mapping, src->size), sizeof(float));
    if (!f.omega) return ENVMAP_ERROR_MEMORY;
    f.texels = envmapi_image(src, 0, slice, 0);
    envmapi_fast_reduce(&f, &desc->executor);
    out->light_count = plans[0].kinked ? envmapi_fast_lights(&f, out->lights) : 0;
    f.rim_count =
        envmapi_rim_points(&f, rim, plans[0].kinked ? out->lights : NULL, &out->light_count);
    if (bands == ENVMAPI_FIRST_BANDS && plans[0].kinked) envmapi_contrasts(contrasts, &f, h);
    if (!bands) bands = envmapi_fast_fit(plans, count, &f, h, NULL, &spacing);
    if ((result = envmapi_transform_create(&t, &f.rings, spacing, bands, pool))) return result;
    if (!f.grid.identity) envmapi_run_all(&desc->executor, envmapi_task_solve, &f, f.grid.faces);
    envmapi_run_all(&desc->executor, envmapi_task_points, &f, f.grid.height);
    t.points = f.points, t.values = f.nodes, t.a = out->a, t.a_bands = out->bands = bands;
    envmapi_rim_points(&f, rim, NULL, NULL);
    t.count = f.grid.count + f.rim_count;
    envmapi_analyse(&t, &desc->executor);
    if (bands == ENVMAPI_FIRST_BANDS && plans[0].kinked) {
        for (int i = 0; i < count; ++i) envmapi_fast_dark(plans + i, &t, &desc->executor);
        envmapi_fast_fit(plans, count, &f, h, contrasts, &spacing);
    }
    envmapi_pool_free(pool, kept);
    return ENVMAP_OK;
}

/* One slice of src -> the spectrum that all plans can do with; one with need 0 cannot. */
static envmap_result envmapi_fast_analyse(envmapi_spectrum *out, envmapi_plan *plans, int count,
                                          const envmap *src, int slice,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    double h = 1, first = 0.05 * pow((double)desc->tolerance / 1e-3, 0.25);
    int most = ENVMAPI_FIRST_BANDS, need = 0;
    envmap_result result;
    for (int i = 0; i < count; ++i) {
        if (plans[i].bands > most) most = plans[i].bands;
        if (plans[i].h < h) h = plans[i].h;
    }
    out->a = (double *)envmapi_pool_get(pool, envmapi_triangle(most, most), sizeof(double));
    out->lights = (envmapi_light *)envmapi_pool_get(pool, ENVMAPI_LIGHTS, sizeof(envmapi_light));
    if (!out->a || !out->lights) return ENVMAP_ERROR_MEMORY;
    if (!plans[0].kinked)
        return envmapi_fast_pass(out, plans, count, src, slice, h, 0, desc, pool);
    result =
        envmapi_fast_pass(out, plans, count, src, slice, first, ENVMAPI_FIRST_BANDS, desc, pool);
    for (int i = 0, h_set = 0; i < count && !result; ++i) {
        if (!plans[i].need) continue;
        need = plans[i].need > need ? plans[i].need : need;
        h = !h_set || plans[i].h < h ? plans[i].h : h, h_set = 1;
    }
    if (!result && (need > ENVMAPI_FIRST_BANDS || (need && h < 0.99 * first)))
        result = envmapi_fast_pass(out, plans, count, src, slice, h, need, desc, pool);
    return result;
}

/* A spectrum -> slices of a result, from `first` on. */
static envmap_result envmapi_fast_synthesise(const envmapi_plan *plan,
                                             const envmapi_spectrum *spectrum, int first,
                                             int slices, const envmap_filter_desc *desc,
                                             envmapi_pool *pool) {
    envmapi_fast f;
    envmapi_transform t;
    envmap_result result;
    const envmap *dst = plan->dst;
    int kept = pool->count;
    size_t floats = 3 * envmapi_area(dst->mapping, dst->size) * (size_t)envmap_faces(dst->mapping);
    if ((result = envmapi_fast_create(&f, dst, plan->h, (double)desc->tolerance, 0, pool)) ||
        (result = envmapi_transform_create(&t, &f.rings, plan->h, plan->need, pool)))
        return result;
    f.lobe = plan->lobe, f.lights = spectrum->lights, f.light_count = spectrum->light_count;
    f.divide = !plan->lobe->raw && plan->lobe->kind != ENVMAP_LOBE_BANKS;
    envmapi_run_all(&desc->executor, envmapi_task_points, &f, f.grid.height);
    t.points = f.points, t.values = f.nodes, t.count = f.grid.count;
    t.a = spectrum->a, t.a_bands = spectrum->bands;
    for (int k = first; k < first + slices; ++k) {
        if (k > first && plan->slices == 1) {
            memcpy(dst->texels + floats * (size_t)k, f.out, floats * sizeof(float));
            continue;
        }
        t.lambda = plan->lambda + (size_t)(plan->slices > 1 ? k : 0) * (size_t)plan->bands;
        f.out = dst->texels + floats * (size_t)k;
        f.p = envmapi_slice_p(plan->lobe, k, dst->slices);
        f.norm = envmapi_lobe_norm(plan->lobe);
        if (f.divide) f.norm = envmapi_lobe_integral(plan->lobe, f.p);
        if ((result = envmapi_tell(&desc->progress, (double)(k - first) / slices))) return result;
        envmapi_synthesise(&t, &desc->executor);
        if ((result = envmapi_tell(&desc->progress, (k - first + 0.5) / slices))) return result;
        if (!f.grid.identity)
            envmapi_run_all(&desc->executor, envmapi_task_solve, &f, f.grid.faces);
        envmapi_run_all(&desc->executor, envmapi_task_expand, &f, dst->size);
    }
    envmapi_pool_free(pool, kept);
    return ENVMAP_OK;
}

/* desc with a part of its progress. */
static envmap_filter_desc envmapi_part_desc(envmapi_progress_part *part,
                                            const envmap_filter_desc *desc, int done, int count,
                                            int total) {
    envmap_filter_desc out = *desc;
    part->whole = &desc->progress;
    part->from = (float)done / (float)total, part->length = (float)count / (float)total;
    out.progress.user = part;
    if (desc->progress.report) out.progress.report = envmapi_report_part;
    return out;
}

/* Plans that share a spectrum. */
static envmap_result envmapi_fast_group(envmapi_plan *plans, int count, const envmap *src,
                                        const envmap_filter_desc *desc, envmapi_pool *pool) {
    int slices = plans[0].dst->slices, runs = src->slices > 1 ? slices : 1, kept = pool->count;
    double spacing[32];
    for (int i = 0; i < count; ++i) spacing[i] = plans[i].h;
    for (int run = 0; run < runs; ++run) {
        envmapi_spectrum spectrum;
        for (int i = 0; i < count; ++i) plans[i].h = spacing[i], plans[i].dark = 1e-3;
        envmap_result result = envmapi_fast_analyse(&spectrum, plans, count, src, run, desc, pool);
        for (int i = 0; i < count && !result; ++i) {
            envmapi_progress_part part;
            envmap_filter_desc part_desc =
                envmapi_part_desc(&part, desc, run * count + i, 1, runs * count);
            if (plans[i].need)
                result = envmapi_fast_synthesise(plans + i, &spectrum, run, runs > 1 ? 1 : slices,
                                                 &part_desc, pool);
            else if (desc->method == ENVMAP_METHOD_HARMONICS)
                result = ENVMAP_ERROR_METHOD;
            else
                result = envmapi_filter_reference(plans[i].dst, src, plans[i].lobe, &part_desc);
        }
        envmapi_pool_free(pool, kept);
        if (result) return result;
    }
    return ENVMAP_OK;
}

/* Smooth lobes share one spectrum, those with kinks another, which has the lights taken out. */
static envmap_result envmapi_filter_fast(envmapi_plan *plans, int count, const envmap *src,
                                         const envmap_filter_desc *desc, envmapi_pool *pool) {
    int smooth = 0;
    envmap_result result = ENVMAP_OK;
    for (int i = 0; i < count; ++i)
        if (!plans[i].kinked) {
            envmapi_plan plan = plans[smooth];
            plans[smooth++] = plans[i], plans[i] = plan;
        }
    envmapi_progress_part part;
    envmap_filter_desc part_desc = envmapi_part_desc(&part, desc, 0, smooth, count);
    if (smooth) result = envmapi_fast_group(plans, smooth, src, &part_desc, pool);
    part_desc = envmapi_part_desc(&part, desc, smooth, count - smooth, count);
    if (!result && smooth < count)
        result = envmapi_fast_group(plans + smooth, count - smooth, src, &part_desc, pool);
    return result;
}

/* desc with defaults filled in; 0 when a field is out of range. */
static int envmapi_desc(envmap_filter_desc *out, const envmap_filter_desc *desc) {
    memset(out, 0, sizeof *out);
    if (desc) *out = *desc;
    if (out->method < 0 || out->method >= ENVMAP_METHOD_COUNT) return 0;
    if (!envmapi_finite((double)out->tolerance) || out->tolerance < 0) return 0;
    if (!envmapi_finite((double)out->threshold)) return 0;
    if (!(out->tolerance > 0)) out->tolerance = 1e-3f;
    out->tolerance = (float)envmapi_clamp((double)out->tolerance, 1e-7, 0.1);
    return 1;
}

/* The lobe is in range, and can be normalised for every slice if it has to be. */
static int envmapi_lobe_fits(const envmap_lobe *lobe, int slices) {
    if (!envmapi_lobe_ok(lobe)) return 0;
    if (lobe->kind == ENVMAP_LOBE_MIRROR || lobe->kind == ENVMAP_LOBE_BANKS) return 1;
    if (lobe->p0 == lobe->p1) slices = 1;
    for (int k = 0; k < slices; ++k) {
        double p = envmapi_slice_p(lobe, k, slices);
        if (!envmapi_finite(envmapi_lobe_integral(lobe, p))) return 0;
        if (!lobe->raw && !envmapi_lobe_positive(lobe, p)) return 0;
    }
    return 1;
}

/* Level l of a map laid out like dst, as a map of one level of its own. */
static envmap envmapi_view(float *texels, const envmap *dst, int l) {
    envmap view = *dst;
    view.size = envmapi_edge(dst->size, l), view.levels = 1;
    view.texels = texels + (envmapi_image(dst, l, 0, 0) - dst->texels);
    return view;
}

/* Pairs of texels; where they are few, the definition is the fastest method too. */
static double envmapi_pairs(const envmap *dst, const envmap *src) {
    double pairs = dst->slices;
    pairs *= (double)envmapi_area(dst->mapping, dst->size) * envmap_faces(dst->mapping);
    return pairs * (double)envmapi_area(src->mapping, src->size) * envmap_faces(src->mapping);
}

/* Does this level go to the fast filter, which shares the source? Then it has a plan. */
static int envmapi_filter_plan(envmapi_plan *plan, envmap *dst, const envmap *src,
                               const envmap_lobe *lobe, const envmap_filter_desc *desc,
                               envmapi_pool *pool, envmap_result *result) {
    int method = desc->method;
    if (lobe->kind == ENVMAP_LOBE_MIRROR || method == ENVMAP_METHOD_REFERENCE) return 0;
    if (method == ENVMAP_METHOD_HIERARCHICAL) return 0;
    if (method == ENVMAP_METHOD_AUTO && envmapi_pairs(dst, src) < 1e5) return 0;
    if (envmapi_texel_extent(src) > 0.1) return 0; /* coarser than any kernel of these */
    int planned = envmapi_plan_create(plan, dst, lobe, src, (double)desc->tolerance, pool, result);
    if (!planned && !*result && method == ENVMAP_METHOD_HARMONICS) *result = ENVMAP_ERROR_METHOD;
    return planned;
}

/* Or by itself. */
static envmap_result envmapi_filter_level(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                          const envmap_filter_desc *desc) {
    if (lobe->kind == ENVMAP_LOBE_MIRROR) return envmap_resample(dst, src);
    if (desc->method == ENVMAP_METHOD_HIERARCHICAL)
        return envmapi_filter_hierarchical(dst, src, lobe, desc);
    return envmapi_filter_reference(dst, src, lobe, desc);
}

/* All levels into `views`. */
static envmap_result envmapi_filter_stage(envmap *views, const envmap *src,
                                          const envmap_lobe *lobes, int count,
                                          const envmap_filter_desc *desc, envmapi_pool *pool) {
    envmapi_plan plans[32];
    envmapi_progress_part part;
    envmap_filter_desc part_desc;
    envmap_result result = ENVMAP_OK;
    int planned[32], fast = 0, done = 0;
    for (int l = 0; l < count && !result; ++l)
        fast += planned[l] =
            envmapi_filter_plan(plans + fast, views + l, src, lobes + l, desc, pool, &result);
    for (int l = 0; l < count && !result; ++l) {
        if (planned[l]) continue;
        part_desc = envmapi_part_desc(&part, desc, done++, 1, count);
        result = envmapi_filter_level(views + l, src, lobes + l, &part_desc);
    }
    part_desc = envmapi_part_desc(&part, desc, count - fast, fast, count);
    if (!result && fast) result = envmapi_filter_fast(plans, fast, src, &part_desc, pool);
    if (result) return result;
    return envmapi_tell(&desc->progress, 1);
}

ENVMAPI_BODY envmap_result envmap_filter_chain(envmap *dst, const envmap *src,
                                               const envmap_lobe *lobes, int count,
                                               const envmap_filter_desc *desc) {
    envmap_filter_desc filled;
    if (!envmapi_pair_ok(dst, src) || !lobes || count < 1 || count > dst->levels ||
        !envmapi_desc(&filled, desc))
        return ENVMAP_ERROR_ARGUMENT;
    for (int l = 0; l < count; ++l)
        if (!envmapi_lobe_fits(lobes + l, dst->slices)) return ENVMAP_ERROR_LOBE;
    if (!envmapi_radiance_ok(src, filled.method == ENVMAP_METHOD_REFERENCE))
        return ENVMAP_ERROR_RADIANCE;
    size_t floats = (size_t)(envmapi_image(dst, count - 1, dst->slices, 0) - dst->texels);
    envmapi_pool pool = {filled.memory, {NULL}, 0};
    float *stage = (float *)envmapi_pool_get(&pool, floats, sizeof(float));
    envmap views[32];
    if (!stage) return ENVMAP_ERROR_MEMORY;
    for (int l = 0; l < count; ++l) views[l] = envmapi_view(stage, dst, l);
    envmap_result result = envmapi_filter_stage(views, src, lobes, count, &filled, &pool);
    int bad = 0; /* a lobe that fails shows as NaN */
    for (size_t i = 0; !result && i < floats; ++i) bad |= !envmapi_finite((double)stage[i]);
    if (bad) result = ENVMAP_ERROR_LOBE;
    if (!result) {
        memcpy(dst->texels, stage, floats * sizeof(float));
        dst->p0 = lobes[0].p0, dst->p1 = lobes[0].p1;
    }
    envmapi_pool_free(&pool, 0);
    return result;
}

ENVMAPI_BODY envmap_result envmap_filter(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                         const envmap_filter_desc *desc) {
    return envmap_filter_chain(dst, src, lobe, 1, desc);
}

/* --------------------------------------------------------------------------------- >>compare --
   Two passes over the level: the mean of b, then the sums and the worst texel.
   Tests: tests/test_compare.c. */

static double envmapi_mean(const envmap *map, int level) {
    int edge = envmapi_edge(map->size, level), width = envmapi_width(map->mapping, edge);
    int images = envmap_faces(map->mapping) * map->slices;
    const float *texels = envmapi_image(map, level, 0, 0);
    size_t area = envmapi_area(map->mapping, edge);
    double sum = 0, weights = 0;
    for (size_t t = 0; t < area; ++t) {
        double w = envmapi_texel_cell(NULL, map->mapping, edge, (int)(t % (size_t)width),
                                      (int)(t / (size_t)width));
        for (int image = 0; image < images; ++image, weights += 3 * w)
            for (int c = 0; c < 3; ++c)
                sum += w * (double)texels[3 * ((size_t)image * area + t) + (size_t)c];
    }
    return sum / weights;
}

/* Sums while comparing. */
typedef struct envmapi_comparison {
    double mean, difference, square, error, total;
    envmap_difference out;
    int bad;
} envmapi_comparison;

static void envmapi_compare_texel(envmapi_comparison *sums, const float *a, const float *b,
                                  double w, int image, int faces, int x, int y) {
    double error = 0, peak = 0, worst = 0;
    for (int c = 0; c < 3; ++c) {
        double truth = (double)b[c], off = (double)a[c] - truth;
        sums->bad |= !envmapi_finite(truth) || !envmapi_finite((double)a[c]);
        sums->difference += w * off, sums->total += w * truth;
        sums->error += w * off * off, sums->square += w * truth * truth;
        if (fabs(off) > error) error = fabs(off);
        if (truth > peak) peak = truth;
    }
    if (peak < 1e-3 * sums->mean) peak = 1e-3 * sums->mean;
    if (error > 0) worst = peak > 0 ? error / peak : HUGE_VAL;
    if (worst > sums->out.worst) {
        sums->out.worst = worst;
        sums->out.slice = image / faces, sums->out.face = image % faces;
        sums->out.x = x, sums->out.y = y;
    }
}

/* a/b, where nothing over nothing is nothing. */
static double envmapi_ratio(double a, double b) {
    return b > 0 || b < 0 ? a / b : a > 0 ? HUGE_VAL : a < 0 ? -HUGE_VAL : 0;
}

ENVMAPI_BODY envmap_result envmap_compare(envmap_difference *difference, const envmap *a,
                                          const envmap *b, int level) {
    envmapi_comparison sums;
    if (!difference || !envmapi_valid(a) || !envmapi_valid(b) || a->mapping != b->mapping ||
        a->slices != b->slices || level < 0 || level >= a->levels || level >= b->levels ||
        envmapi_edge(a->size, level) != envmapi_edge(b->size, level))
        return ENVMAP_ERROR_ARGUMENT;
    int edge = envmapi_edge(a->size, level), width = envmapi_width(a->mapping, edge);
    int faces = envmap_faces(a->mapping);
    size_t area = envmapi_area(a->mapping, edge);
    memset(&sums, 0, sizeof sums);
    sums.mean = envmapi_mean(b, level);
    for (size_t t = 0; t < area; ++t) {
        int x = (int)(t % (size_t)width), y = (int)(t / (size_t)width);
        double w = envmapi_texel_cell(NULL, a->mapping, edge, x, y);
        for (int image = 0; w > 0 && image < faces * a->slices; ++image) {
            size_t at = 3 * ((size_t)image * area + t);
            envmapi_compare_texel(&sums, envmapi_image(a, level, 0, 0) + at,
                                  envmapi_image(b, level, 0, 0) + at, w, image, faces, x, y);
        }
    }
    if (sums.bad) return ENVMAP_ERROR_RADIANCE;
    sums.out.rms = sqrt(envmapi_ratio(sums.error, sums.square));
    sums.out.bias = envmapi_ratio(sums.difference, sums.total);
    *difference = sums.out;
    return ENVMAP_OK;
}

#endif /* ENVMAP_IMPLEMENTATION_ONCE */
#endif /* ENVMAP_IMPLEMENTATION */

/* REFERENCES
     [Banks94]    D. Banks. Illumination in diverse codimensions. SIGGRAPH 1994.
     [Debevec98]  P. Debevec. Rendering synthetic objects into real scenes. SIGGRAPH 1998; and the
                  notes on light probe images (angular map, lat-long).
     [HS98]       W. Heidrich, H.-P. Seidel. View-independent environment maps. Graphics Hardware
                  1998.
     [HS99]       W. Heidrich, H.-P. Seidel. Realistic, hardware-accelerated shading and lighting.
                  SIGGRAPH 1999.
     [KM00]       J. Kautz, M. McCool. Approximation of glossy reflection with prefiltered
                  environment maps. Graphics Interface 2000.
     [KVHS00]     J. Kautz, P.-P. Vazquez, W. Heidrich, H.-P. Seidel. A unified approach to
                  prefiltered environment maps. Rendering Workshop 2000.
     [Miller84]   G. Miller, C. Hoffman. Illumination and reflection maps. SIGGRAPH 1984 course.
     [SKS96]      A. Schilling, G. Knittel, W. Strasser. Texram: a smart memory for texturing. IEEE
                  Computer Graphics and Applications 16(3), 1996.
     [Swarztrauber79] P. Swarztrauber. On the spectral approximation of discrete scalar and vector
                  functions on the sphere. SIAM J. Numerical Analysis 16, 1979.
     [Unser91]    M. Unser, A. Aldroubi, M. Eden. Fast B-spline transforms for continuous image
                  representation and interpolation. IEEE PAMI 13, 1991.
     [Williams83] L. Williams. Pyramidal parametrics. SIGGRAPH 1983.
     [WMLT07]     B. Walter, S. Marschner, H. Li, K. Torrance. Microfacet models for refraction
                  through rough surfaces. Rendering Symposium 2007.

   CHANGES
     0.1  five parameterizations, maps, PFM, mip levels, lobes, comparison; filters: the reference,
          the hierarchical one, and a first fast one through harmonics

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

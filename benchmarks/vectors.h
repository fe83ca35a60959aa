/* Several numbers at a time in GCC's vector types, eight in AVX-512 and else four: arithmetic,
 * distances, transposed loads and stores.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __AVX512F__
enum { LANES = 8 };
#else
enum { LANES = 4 };
#endif

typedef double real __attribute__((vector_size(8 * LANES)));
typedef int64_t mask __attribute__((vector_size(8 * LANES)));
typedef struct { real x, y, z; } vector;
typedef struct { real distance, foot; vector normal; } contact;

#define INLINE static inline __attribute__((always_inline))

INLINE real splat(double a) { return a - (real){0}; }
INLINE real choose(mask m, real a, real b) { return (real)((m & (mask)a) | (~m & (mask)b)); }

INLINE real root(real a) {
    real b;
    for (int k = 0; k < LANES; k++) b[k] = sqrt(a[k]);
    return b;
}

INLINE vector minus(vector p, vector q) { return (vector){p.x - q.x, p.y - q.y, p.z - q.z}; }
INLINE vector times(real a, vector p) { return (vector){a * p.x, a * p.y, a * p.z}; }
INLINE real dot(vector p, vector q) { return p.x * q.x + p.y * q.y + p.z * q.z; }

INLINE vector cross(vector p, vector q) {
    return (vector){p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}

INLINE vector choose_vector(mask m, vector p, vector q) {
    return (vector){choose(m, p.x, q.x), choose(m, p.y, q.y), choose(m, p.z, q.z)};
}

INLINE contact apart(vector w, real foot) {
    real d = root(dot(w, w));
    return (contact){d, foot, times(1.0 / d, w)};
}

/* The nearest point of a rod along u: clamping the foot takes care of both ends. */
INLINE contact to_rod(vector w, vector u, real inverse) {
    real foot = dot(w, u) * inverse;
    foot = choose(foot > 0.0, foot, splat(0.0));
    foot = choose(foot < 1.0, foot, splat(1.0));
    return apart((vector){w.x - foot * u.x, w.y - foot * u.y, w.z - foot * u.z}, foot);
}

/* Exchange rows and columns of a square. */
#ifdef __AVX512F__
INLINE void transpose(real *a) {
    real b[8], c[8];
#pragma GCC unroll 4
    for (int k = 0; k < 8; k += 2) {
        b[k] = __builtin_shufflevector(a[k], a[k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        b[k + 1] = __builtin_shufflevector(a[k], a[k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
#pragma GCC unroll 4
    for (int n = 0; n < 4; n++) {
        int k = n + (n & 2); /* 0, 1, 4, 5 */
        c[k] = __builtin_shufflevector(b[k], b[k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
        c[k + 2] = __builtin_shufflevector(b[k], b[k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
#pragma GCC unroll 4
    for (int k = 0; k < 4; k++) {
        a[k] = __builtin_shufflevector(c[k], c[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        a[k + 4] = __builtin_shufflevector(c[k], c[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}
#else
INLINE void transpose(real *a) {
    real b[4];
    b[0] = __builtin_shufflevector(a[0], a[1], 0, 4, 2, 6);
    b[1] = __builtin_shufflevector(a[0], a[1], 1, 5, 3, 7);
    b[2] = __builtin_shufflevector(a[2], a[3], 0, 4, 2, 6);
    b[3] = __builtin_shufflevector(a[2], a[3], 1, 5, 3, 7);
#pragma GCC unroll 2
    for (int k = 0; k < 2; k++) {
        a[k] = __builtin_shufflevector(b[k], b[k + 2], 0, 1, 4, 5);
        a[k + 2] = __builtin_shufflevector(b[k], b[k + 2], 2, 3, 6, 7);
    }
}
#endif

/* A row of numbers a lane, stride numbers apart. */
INLINE void load(const double *q, int width, int stride, real *in) {
#pragma GCC unroll 8
    for (int k = 0; k < width; k += LANES) {
        const int some = width - k < LANES ? width - k : LANES;
        real square[LANES] = {0};
#pragma GCC unroll 8
        for (int lane = 0; lane < LANES; lane++)
            memcpy(&square[lane], q + stride * lane + k, some * sizeof(double));
        transpose(square);
#pragma GCC unroll 8
        for (int n = 0; n < some; n++) in[k + n] = square[n];
    }
}

/* The same the other way. */
INLINE void store(const real *a, int width, int stride, double *to) {
#pragma GCC unroll 16
    for (int k = 0; k < width; k += LANES) {
        const int some = width - k < LANES ? width - k : LANES;
        real square[LANES] = {0};
#pragma GCC unroll 8
        for (int n = 0; n < some; n++) square[n] = a[k + n];
        transpose(square);
#pragma GCC unroll 8
        for (int lane = 0; lane < LANES; lane++)
            memcpy(to + stride * lane + k, &square[lane], some * sizeof(double));
    }
}

/* The same nine gaps and 54 derivatives as gaps.c, several pairs at a time in GCC's vector types:
 * selections instead of branches, sines by polynomials, results transposed in registers.
 */
#include "vectors.h"

enum { A1B1, A1B2, A2B1, A2B2, A1b, A2b, aB1, aB2, ab, CONTACTS, ROWS = 54 };

typedef struct { vector at; real sine, cosine, turn, slide; } ball;

/* |x| below a million: reduction by pi/2 in three parts, then Taylor sums on [-pi/4, pi/4]. */
INLINE void sine_cosine(real x, real *sine, real *cosine) {
    const double rounder = 0x1.8p52;
    real shifted = x * (2.0 / 3.141592653589793) + rounder, count = shifted - rounder;
    mask quadrant = (mask)shifted;
    real y = x - count * 1.5707963267341256;
    y -= count * 6.077100506303966e-11;
    y -= count * 2.0222662487959506e-21;
    real z = y * y;
    real s = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
    s = s * z - 1.0 / 39916800.0;
    s = s * z + 1.0 / 362880.0;
    s = s * z - 1.0 / 5040.0;
    s = s * z + 1.0 / 120.0;
    s = s * z - 1.0 / 6.0;
    s = s * (z * y) + y;
    real c = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
    c = c * z + 1.0 / 479001600.0;
    c = c * z - 1.0 / 3628800.0;
    c = c * z + 1.0 / 40320.0;
    c = c * z - 1.0 / 720.0;
    c = c * z + 1.0 / 24.0;
    c = c * (z * z) + (1.0 - 0.5 * z);
    mask odd = (quadrant & 1) != 0;
    real even_sine = choose(odd, c, s), even_cosine = choose(odd, s, c);
    *sine = (real)((mask)even_sine ^ (quadrant & 2) << 62);
    *cosine = (real)((mask)even_cosine ^ ((quadrant + 1) & 2) << 62);
}

INLINE void place(const real *q, double length, double rho, ball *balls) {
    real sine, cosine, across, along;
    sine_cosine(q[0], &sine, &cosine);
    sine_cosine(q[2], &across, &along);
    across *= 0.5 * length;
    along *= 0.5 * length;
    real s = across * (1.0 / rho), c = root(1.0 - s * s), turn = along / (rho * c);
    balls[0] = (ball){.sine = sine * c - cosine * s, .cosine = cosine * c + sine * s,
                      .turn = -turn, .slide = across};
    balls[1] = (ball){.sine = sine * c + cosine * s, .cosine = cosine * c - sine * s,
                      .turn = turn, .slide = -across};
    balls[0].at = (vector){rho * balls[0].sine, q[1] - along, -rho * balls[0].cosine};
    balls[1].at = (vector){rho * balls[1].sine, q[1] + along, -rho * balls[1].cosine};
}

/* The derivative of n.centre by phi, eta, theta. */
INLINE void pull(const ball *b, vector n, double rho, real *row) {
    real lift = rho * (b->cosine * n.x + b->sine * n.z);
    row[0] = lift;
    row[1] = n.y;
    row[2] = b->turn * lift + b->slide * n.y;
}

INLINE void pull_rod(const ball *rod, vector n, real foot, double rho, real *row) {
    real start[3], end[3];
    pull(&rod[0], n, rho, start);
    pull(&rod[1], n, rho, end);
    row[0] = start[0] + foot * (end[0] - start[0]);
    row[1] = n.y;
    row[2] = start[2] + foot * (end[2] - start[2]);
}

INLINE void several(const real *q, const double *p, real *f, real *J) {
    const double length = p[0], r = p[1], t = p[2], rho = p[3];
    ball A[2], B[2];
    place(q, length, rho, A);
    place(q + 3, length, rho, B);
    vector w[2][2], u = minus(A[1].at, A[0].at), v = minus(B[1].at, B[0].at);
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++)
#pragma GCC unroll 2
        for (int j = 0; j < 2; j++) {
            int k = 2 * i + j;
            w[i][j] = minus(A[i].at, B[j].at);
            contact c = apart(w[i][j], splat(0.0));
            f[k] = c.distance - 2.0 * r;
            pull(&A[i], c.normal, rho, J + 6 * k);
            pull(&B[j], times(splat(-1.0), c.normal), rho, J + 6 * k + 3);
        }
    real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), by_uu = 1.0 / uu, by_vv = 1.0 / vv;
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++) {
        contact c = to_rod(w[i][0], v, by_vv);
        f[A1b + i] = c.distance - r - t;
        pull(&A[i], c.normal, rho, J + 6 * (A1b + i));
        pull_rod(B, times(splat(-1.0), c.normal), c.foot, rho, J + 6 * (A1b + i) + 3);
    }
#pragma GCC unroll 2
    for (int j = 0; j < 2; j++) {
        contact c = to_rod(times(splat(-1.0), w[0][j]), u, by_uu);
        f[aB1 + j] = c.distance - r - t;
        pull_rod(A, times(splat(-1.0), c.normal), c.foot, rho, J + 6 * (aB1 + j));
        pull(&B[j], c.normal, rho, J + 6 * (aB1 + j) + 3);
    }
    real uw = dot(u, w[0][0]), vw = dot(v, w[0][0]);
    real den = uu * vv - uv * uv, s = uv * vw - vv * uw, z = uu * vw - uv * uw;
    mask crossing = (den > 1e-20 * uu * vv) & (s > 0.0) & (den > s) & (z > 0.0) & (den > z);
    real by_den = 1.0 / choose(crossing, den, splat(1.0)), size = root(by_den);
    vector n = cross(u, v);
    real height = dot(w[0][0], n), row[6], nearest = f[A1b];
    mask sign = (mask)height & INT64_MIN;
    size = (real)((mask)size ^ sign);
    n = times(size, n);
    pull_rod(A, n, s * by_den, rho, row);
    pull_rod(B, times(splat(-1.0), n), z * by_den, rho, row + 3);
#pragma GCC unroll 6
    for (int k = 0; k < 6; k++) J[6 * ab + k] = J[6 * A1b + k];
#pragma GCC unroll 3
    for (int i = A2b; i <= aB2; i++) {
        mask nearer = f[i] < nearest;
        nearest = choose(nearer, f[i], nearest);
#pragma GCC unroll 6
        for (int k = 0; k < 6; k++) J[6 * ab + k] = choose(nearer, J[6 * i + k], J[6 * ab + k]);
    }
    f[ab] = choose(crossing, height * size - 2.0 * t, nearest + r - t);
#pragma GCC unroll 6
    for (int k = 0; k < 6; k++) J[6 * ab + k] = choose(crossing, row[k], J[6 * ab + k]);
}

/* As in gaps.c; count must be a multiple of eight. */
void gaps(int64_t count, const double *q, const double *p, double *f, double *J) {
    for (int64_t i = 0; i < count; i += LANES) {
        real in[6], F[CONTACTS], D[ROWS];
        load(q + 6 * i, 6, 6, in);
        several(in, p, F, D);
        store(F, CONTACTS, CONTACTS, f + CONTACTS * i);
        store(D, ROWS, ROWS, J + ROWS * i);
    }
}

/* The nine gaps of two dumbbells in space and their 126 derivatives, several pairs at a time.
 *
 * A pose is the middle of a dumbbell and a unit quaternion w, x, y, z; the rod lies along the third
 * axis of the body.  The order is that of the parts 1, 2, rod of A, each with those of B.
 */
#include "vectors.h"

enum { CONTACTS = 9, POSE = 7, COLUMNS = 2 * POSE, ROWS = CONTACTS * COLUMNS, RODS = 8 };

/* Half the derivatives of the axis by the quaternion are its entries. */
typedef struct { vector middle, axis, ends[2]; real w, x, y, z; } body;

/* A normal from B to A, and where along the axes of both bodies it acts. */
typedef struct { real gap, along_a, along_b; vector normal; } touch;

INLINE vector moved(vector p, real s, vector u) {
    return (vector){p.x + s * u.x, p.y + s * u.y, p.z + s * u.z};
}

INLINE body place(const real *q, double half) {
    body b = {.middle = {q[0], q[1], q[2]}, .w = q[3], .x = q[4], .y = q[5], .z = q[6]};
    b.axis = (vector){2.0 * (b.x * b.z + b.w * b.y), 2.0 * (b.y * b.z - b.w * b.x),
                      b.w * b.w - b.x * b.x - b.y * b.y + b.z * b.z};
    b.ends[0] = moved(b.middle, splat(-half), b.axis);
    b.ends[1] = moved(b.middle, splat(half), b.axis);
    return b;
}

/* The derivative of n.(middle + along axis) by the pose. */
INLINE void pull(const body *b, vector n, real along, real *row) {
    real twice = 2.0 * along;
    row[0] = n.x;
    row[1] = n.y;
    row[2] = n.z;
    row[3] = twice * (b->y * n.x - b->x * n.y + b->w * n.z);
    row[4] = twice * (b->z * n.x - b->w * n.y - b->x * n.z);
    row[5] = twice * (b->w * n.x + b->z * n.y - b->y * n.z);
    row[6] = twice * (b->x * n.x + b->y * n.y + b->z * n.z);
}

INLINE touch nearer(mask m, touch a, touch b) {
    return (touch){choose(m, a.gap, b.gap), choose(m, a.along_a, b.along_a),
                   choose(m, a.along_b, b.along_b), choose_vector(m, a.normal, b.normal)};
}

/* Contacts in the order of the results. */
INLINE void meet(const body *A, const body *B, const double *p, touch *all) {
    const double half = 0.5 * p[0], r = p[1], t = p[2];
    const real at[2] = {splat(-half), splat(half)};
    vector w[2][2], u = minus(A->ends[1], A->ends[0]), v = minus(B->ends[1], B->ends[0]);
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++)
#pragma GCC unroll 2
        for (int j = 0; j < 2; j++) {
            w[i][j] = minus(A->ends[i], B->ends[j]);
            contact c = apart(w[i][j], splat(0.0));
            all[3 * i + j] = (touch){c.distance - 2.0 * r, at[i], at[j], c.normal};
        }
    real uu = dot(u, u), vv = dot(v, v), by_uu = 1.0 / uu, by_vv = 1.0 / vv;
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++) {
        contact c = to_rod(w[i][0], v, by_vv);
        all[3 * i + 2] = (touch){c.distance - r - t, at[i], half * (2.0 * c.foot - 1.0), c.normal};
    }
#pragma GCC unroll 2
    for (int j = 0; j < 2; j++) {
        contact c = to_rod(times(splat(-1.0), w[0][j]), u, by_uu);
        all[6 + j] = (touch){c.distance - r - t, half * (2.0 * c.foot - 1.0), at[j],
                             times(splat(-1.0), c.normal)};
    }
    vector n = cross(u, v);
    real nn = dot(n, n), s = -dot(cross(w[0][0], v), n), z = -dot(cross(w[0][0], u), n);
    mask crossing = (nn > 1e-20 * uu * vv) & (s > 0.0) & (nn > s) & (z > 0.0) & (nn > z);
    real by_nn = 1.0 / choose(crossing, nn, splat(1.0)), size = root(by_nn);
    real height = dot(w[0][0], n);
    size = (real)((mask)size ^ ((mask)height & INT64_MIN));
    touch rods = {height * size - 2.0 * t, half * (2.0 * s * by_nn - 1.0),
                  half * (2.0 * z * by_nn - 1.0), times(size, n)};
    touch ends = nearer(all[5].gap < all[2].gap, all[5], all[2]);
    ends = nearer(all[6].gap < ends.gap, all[6], ends);
    ends = nearer(all[7].gap < ends.gap, all[7], ends);
    ends.gap += r - t;
    all[RODS] = nearer(crossing, rods, ends);
}

INLINE void both(const double *q, const double *p, body *A, body *B, touch *all) {
    real in[COLUMNS];
    load(q, POSE, COLUMNS, in);
    load(q + POSE, POSE, COLUMNS, in + POSE);
    *A = place(in, 0.5 * p[0]);
    *B = place(in + POSE, 0.5 * p[0]);
    meet(A, B, p, all);
}

/* Poses (count, 14), sizes l r t, results (count, 9); count must be a multiple of eight. */
void values(int64_t count, const double *q, const double *p, double *f) {
    for (int64_t i = 0; i < count; i += LANES) {
        body A, B;
        touch all[CONTACTS];
        real F[CONTACTS];
        both(q + COLUMNS * i, p, &A, &B, all);
#pragma GCC unroll 9
        for (int k = 0; k < CONTACTS; k++) F[k] = all[k].gap;
        store(F, CONTACTS, CONTACTS, f + CONTACTS * i);
    }
}

/* The same with derivatives (count, 9, 14). */
void gaps(int64_t count, const double *q, const double *p, double *f, double *J) {
    for (int64_t i = 0; i < count; i += LANES) {
        body A, B;
        touch all[CONTACTS];
        real F[CONTACTS];
        both(q + COLUMNS * i, p, &A, &B, all);
#pragma GCC unroll 9
        for (int k = 0; k < CONTACTS; k++) {
            real row[COLUMNS];
            F[k] = all[k].gap;
            pull(&A, all[k].normal, all[k].along_a, row);
            pull(&B, times(splat(-1.0), all[k].normal), all[k].along_b, row + POSE);
            store(row, COLUMNS, ROWS, J + ROWS * i + COLUMNS * k);
        }
        store(F, CONTACTS, CONTACTS, f + CONTACTS * i);
    }
}

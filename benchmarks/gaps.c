/* Nine gaps of a dumbbell pair in a drum and their 54 partial derivatives, as one would write them
 * by hand: one pair at a time, with branches.
 *
 * A distance changes as fast as its two nearest points part along the line between them, so a row
 * of the Jacobian is the unit normal n pulled back through the ball centres: three numbers a ball.
 */
#include <math.h>
#include <stdint.h>

enum { A1B1, A1B2, A2B1, A2B2, A1b, A2b, aB1, aB2, ab, CONTACTS };

typedef struct { double x, y, z; } vector;

/* A centre (rho sine, eta +- half cos theta, -rho cosine), and how it moves with theta. */
typedef struct { vector at; double sine, cosine, turn, slide; } ball;

typedef struct { double distance, foot; vector normal; } contact;

static vector minus(vector p, vector q) { return (vector){p.x - q.x, p.y - q.y, p.z - q.z}; }
static vector times(double a, vector p) { return (vector){a * p.x, a * p.y, a * p.z}; }
static double dot(vector p, vector q) { return p.x * q.x + p.y * q.y + p.z * q.z; }

static vector cross(vector p, vector q) {
    return (vector){p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}

static vector between(vector p, vector q, double s) {
    return (vector){p.x + s * (q.x - p.x), p.y + s * (q.y - p.y), p.z + s * (q.z - p.z)};
}

static void place(const double *q, double length, double rho, ball *balls) {
    double sine = sin(q[0]), cosine = cos(q[0]);
    double across = 0.5 * length * sin(q[2]), along = 0.5 * length * cos(q[2]);
    double s = across / rho, c = sqrt(1.0 - s * s), turn = along / (rho * c);
    balls[0] = (ball){.sine = sine * c - cosine * s, .cosine = cosine * c + sine * s,
                      .turn = -turn, .slide = across};
    balls[1] = (ball){.sine = sine * c + cosine * s, .cosine = cosine * c - sine * s,
                      .turn = turn, .slide = -across};
    balls[0].at = (vector){rho * balls[0].sine, q[1] - along, -rho * balls[0].cosine};
    balls[1].at = (vector){rho * balls[1].sine, q[1] + along, -rho * balls[1].cosine};
}

/* Add weight * (derivative of n.centre by phi, eta, theta). */
static void pull(const ball *b, vector n, double weight, double rho, double *row) {
    double lift = weight * rho * (b->cosine * n.x + b->sine * n.z), shift = weight * n.y;
    row[0] += lift;
    row[1] += shift;
    row[2] += b->turn * lift + b->slide * shift;
}

/* The row of a distance between a point of A and a point of B, s and t of the way along each. */
static void row_of(const ball *A, const ball *B, double s, double t, vector n, double rho,
                   double *row) {
    for (int k = 0; k < 6; k++) row[k] = 0.0;
    if (s < 1.0) pull(&A[0], n, 1.0 - s, rho, row);
    if (s > 0.0) pull(&A[1], n, s, rho, row);
    if (t < 1.0) pull(&B[0], n, t - 1.0, rho, row + 3);
    if (t > 0.0) pull(&B[1], n, -t, rho, row + 3);
}

static contact apart(vector p, vector q, double foot) {
    vector w = minus(p, q);
    double d = sqrt(dot(w, w));
    return (contact){d, foot, times(1.0 / d, w)};
}

/* The nearest point of a rod; the contacts with its ends are known already. */
static contact to_rod(vector p, const ball *rod, contact start, contact end) {
    vector u = minus(rod[1].at, rod[0].at);
    double foot = dot(minus(p, rod[0].at), u) / dot(u, u);
    if (foot <= 0.0) return (contact){start.distance, 0.0, start.normal};
    if (foot >= 1.0) return (contact){end.distance, 1.0, end.normal};
    return apart(p, between(rod[0].at, rod[1].at, foot), foot);
}

static void one(const double *q, const double *p, double *f, double *J) {
    const double length = p[0], r = p[1], t = p[2], rho = p[3];
    ball A[2], B[2];
    contact ends[2][2];
    place(q, length, rho, A);
    place(q + 3, length, rho, B);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            int k = 2 * i + j;
            ends[i][j] = apart(A[i].at, B[j].at, 0.0);
            f[k] = ends[i][j].distance - 2.0 * r;
            row_of(A, B, i, j, ends[i][j].normal, rho, J + 6 * k);
        }
    int least = A1b;
    for (int i = 0; i < 2; i++) {
        contact c = to_rod(A[i].at, B, ends[i][0], ends[i][1]);
        f[A1b + i] = c.distance - r - t;
        row_of(A, B, i, c.foot, c.normal, rho, J + 6 * (A1b + i));
        if (f[A1b + i] < f[least]) least = A1b + i;
    }
    for (int j = 0; j < 2; j++) {
        /* The normal leads from B to A, here from the ball to the rod. */
        contact start = ends[0][j], end = ends[1][j];
        start.normal = times(-1.0, start.normal);
        end.normal = times(-1.0, end.normal);
        contact c = to_rod(B[j].at, A, start, end);
        f[aB1 + j] = c.distance - r - t;
        row_of(A, B, c.foot, j, times(-1.0, c.normal), rho, J + 6 * (aB1 + j));
        if (f[aB1 + j] < f[least]) least = aB1 + j;
    }
    vector u = minus(A[1].at, A[0].at), v = minus(B[1].at, B[0].at), w = minus(A[0].at, B[0].at);
    double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w);
    double den = uu * vv - uv * uv, s = uv * vw - vv * uw, z = uu * vw - uv * uw;
    if (den > 1e-20 * uu * vv && 0.0 < s && s < den && 0.0 < z && z < den) {
        vector n = cross(u, v);
        double height = dot(w, n), size = 1.0 / sqrt(den);
        f[ab] = fabs(height) * size - 2.0 * t;
        n = times(copysign(size, height), n);
        row_of(A, B, s / den, z / den, n, rho, J + 6 * ab);
    } else {
        f[ab] = f[least] + r - t;
        for (int k = 0; k < 6; k++) J[6 * ab + k] = J[6 * least + k];
    }
}

/* q (count, 6), p = {l, r, t, rho}, f (count, 9), J (count, 9, 6). */
void gaps(int64_t count, const double *q, const double *p, double *f, double *J) {
    for (int64_t i = 0; i < count; i++) one(q + 6 * i, p, f + CONTACTS * i, J + 6 * CONTACTS * i);
}

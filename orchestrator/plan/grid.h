/* Equidistant points in time, exact: start + k * numerator / denominator [ns]. Their times are the
 * nearest nanoseconds. No point times its denominator exceeds 2^53, so that operands of
 * divisions are exact doubles. */

typedef struct {
    int64_t start, numerator, denominator;
} Grid;

/* The time of point `k`, which is not negative [ns]. */
static int64_t point_of(const Grid *g, int64_t k) {
    if (g->denominator == 1) return g->start + k * g->numerator;
    return g->start + (2 * k * g->numerator + g->denominator) / (2 * g->denominator);
}

/* The last point at or before `t`, which is not before the start. */
static int64_t last_of(const Grid *g, int64_t t) {
    int64_t k = (t - g->start) * g->denominator / g->numerator;
    return k + (point_of(g, k + 1) <= t);
}

/* The double nearest to a point [s]: both operands are exact. */
static double seconds_of(const Grid *g, int64_t k) {
    return (double)(g->start * g->denominator + k * g->numerator) / (1e9 * (double)g->denominator);
}

/* The double nearest to the distance of two points [s]. */
static double step_seconds(const Grid *g) {
    return (double)g->numerator / (1e9 * (double)g->denominator);
}

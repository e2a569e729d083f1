#include "plausible.h"

#include <math.h>

#define ON_LINE 0.3 /* [m], accuracy of a line through two patches where it meets a third */

/* Range at which the line from `a` to `b` crosses the direction of `c` [m], infinite if it does
 * not. */
static double crossing(const Patch *a, const Patch *b, const Patch *c, double range) {
    double along[2] = {b->place[0] - a->place[0], b->place[1] - a->place[1]};
    double numerator = a->place[0] * along[1] - a->place[1] * along[0];
    double denominator = c->place[0] * along[1] - c->place[1] * along[0];
    if (numerator < 0.0) {
        numerator = -numerator;
        denominator = -denominator;
    }
    return denominator > 0.0 ? numerator / denominator * range : INFINITY;
}

/* Whether the farther surface is seen over the nearer one, as a cabin is over a bonnet and a roof
 * over its edge. Only the bonnet of a van is followed by a much higher part, and at once: what
 * rises farther behind is another vehicle. */
static int is_over(const Search *search, const Surroundings *near, const Surroundings *far) {
    const double tolerance = 0.1;                 /* [m] of heights */
    const double high = 0.8, bonnet_length = 1.2; /* [m] */
    double step = far->range - near->range;
    double line = near->top - (search->sensor_height - near->top) * step / near->range;
    if (far->foot < line - tolerance || step > search->settings->roof_gap) return 0;
    return far->top - near->top <= high || step <= bonnet_length;
}

/* Whether the line from `a` to `b` goes on to patch `c`, within the noise of a lidar. */
static int is_on_line(const Search *search, uint32_t a, uint32_t b, uint32_t c) {
    const double noise = 0.1; /* [m] */
    const Patch *patches = search->patches->sorted;
    double range = search->around[c].range;
    return fabs(crossing(&patches[a], &patches[b], &patches[c], range) - range) <= noise;
}

/* Whether a surface that recedes up to `near` on one side is known well enough to say where it goes
 * on: from three patches, of which the last step is about as large as the one in question. */
static int is_receding(const Search *search, uint32_t near, int side, double step) {
    const Surroundings *around = search->around;
    uint32_t before = around[near].beside[side];
    if (before == NO_PATCH || around[near].range - around[before].range <= 0.25 * step) return 0;
    uint32_t first = around[before].beside[side];
    return first != NO_PATCH && is_on_line(search, first, before, near);
}

/* Whether two surfaces in adjacent directions are one that is seen along: the nearer one recedes to
 * where the farther one is; or it is the end of a body, and the farther one comes from there, or is
 * the only direction in which anything is seen there. */
static int is_along(const Search *search, uint32_t near, uint32_t far) {
    const Patch *patches = search->patches->sorted;
    const Surroundings *around = search->around;
    uint32_t ahead = (patches[far].direction - patches[near].direction) % DIRECTIONS;
    if (ahead == 0) return 0;
    int side = ahead < DIRECTIONS / 2; /* of the far one, seen from the near one */
    double range = around[far].range, step = range - around[near].range;
    uint32_t before = around[near].beside[!side], after = around[far].beside[side];
    if (before != NO_PATCH
        && range <= crossing(&patches[before], &patches[near], &patches[far], range) + ON_LINE)
        return 1;
    if (is_receding(search, near, !side, step)) return 0;
    if (after == NO_PATCH || around[after].range < range)
        return !around[far].is_joined[0] && !around[far].is_joined[1];
    range = around[near].range;
    return range >= crossing(&patches[far], &patches[after], &patches[near], range) - ON_LINE;
}

/* Else a body has no part behind a visible edge: what is seen past the end of a truck is the next
 * one. */
int is_plausible(const Search *search, const Link *link) {
    const Surroundings *around = search->around;
    return link->is_hidden || is_over(search, &around[link->near], &around[link->far])
           || is_along(search, link->near, link->far);
}

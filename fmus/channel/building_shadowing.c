#include "building_shadowing.h"
#include "buffer.h"
#include "sort.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static Area area_of(const Buildings *s, size_t k) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = s->first[k]; i < s->first[k + 1]; i++)
        for (int axis = 0; axis < 2; axis++) {
            low[axis] = smaller(low[axis], s->corner[i][axis]);
            high[axis] = larger(high[axis], s->corner[i][axis]);
        }
    return area_between(low, high);
}

/* How often the ring turns around, counter-clockwise, from wall to wall. */
static double turns(const double (*ring)[2], size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        const double *p = ring[i], *q = ring[(i + 1) % n], *r = ring[(i + 2) % n];
        double ux = q[0] - p[0], uy = q[1] - p[1], vx = r[0] - q[0], vy = r[1] - q[1];
        sum += direction_angle(ux * vy - uy * vx, ux * vx + uy * vy);
    }
    return sum / (2 * PI);
}

/* More corners than this are not worth a look before the links themselves. */
static const size_t MANY_CORNERS = 64;

/* A ring that turns around once winds once around every point that sees all walls from the same
 * side, so that such a point is inside. Walls without length have no sides: without effect. */
static void find_walls(Buildings *s, size_t k) {
    const double (*ring)[2] = (const double (*)[2])(s->corner + s->first[k]);
    size_t n = s->first[k + 1] - s->first[k];
    s->is_opaque[k] = false;
    if (n > MANY_CORNERS) return;
    double turned = turns(ring, n), sense = turned < 0 ? -1 : 1;
    s->is_opaque[k] = fabs(fabs(turned) - 1) < 1e-6;
    for (size_t i = 0; i < n; i++) {
        const double *p = ring[(i + n - 1) % n], *q = ring[i];
        double x = q[0] - p[0], y = q[1] - p[1], length = sqrt(x * x + y * y);
        Wall wall = {{0, 0}, 0, 0};
        if (length > 0) {
            wall.normal[0] = -sense * y / length;
            wall.normal[1] = sense * x / length;
            wall.offset = wall.normal[0] * p[0] + wall.normal[1] * p[1];
        }
        for (size_t c = 0; c < n; c++)
            wall.lowest = smaller(wall.lowest, wall.normal[0] * ring[c][0]
                                                + wall.normal[1] * ring[c][1] - wall.offset);
        s->wall[s->first[k] + i] = wall;
    }
}

int buildings_set(Buildings *s, const double *corner, const int32_t *index, size_t corners,
                  const double *height, size_t count) {
    s->version++;
    s->count = 0;
    if (BUFFER_RESERVE(s->corner, s->corner_capacity, corners)
        || BUFFER_RESERVE(s->wall, s->wall_capacity, corners)
        || BUFFER_RESERVE(s->is_opaque, s->opaque_capacity, count)
        || BUFFER_RESERVE(s->first, s->first_capacity, count + 1)
        || BUFFER_RESERVE(s->height, s->height_capacity, count)
        || BUFFER_RESERVE(s->area, s->area_capacity, count))
        return 1;
    for (size_t i = 0; i < corners; i++) {
        if (i == 0 || index[i] != index[i - 1]) s->first[index[i]] = i;
        for (int k = 0; k < 2; k++) s->corner[i][k] = corner[2 * i + (size_t)k];
    }
    s->first[count] = corners;
    s->count = count;
    for (size_t k = 0; k < count; k++) {
        s->height[k] = height[k];
        s->area[k] = area_of(s, k);
        find_walls(s, k);
    }
    return area_index_build(&s->index, s->area, count);
}

void buildings_free(Buildings *s) {
    free(s->corner);
    free(s->wall);
    free(s->is_opaque);
    free(s->first);
    free(s->height);
    free(s->area);
    area_index_free(&s->index);
    *s = (Buildings){0};
}

int building_scratch_reserve(BuildingScratch *scratch, const Buildings *s) {
    size_t corners = s->count > 0 ? s->first[s->count] : 0;
    return BUFFER_RESERVE(scratch->crossing, scratch->crossing_capacity, corners)
        || BUFFER_RESERVE(scratch->near, scratch->near_capacity, s->count);
}

void building_scratch_free(BuildingScratch *scratch) {
    free(scratch->crossing);
    free(scratch->near);
    *scratch = (BuildingScratch){0};
}

/* The part of the link a-b that runs below `height`. */
static Span span_below(double height, Position a, Position b) {
    if (a.z < height && b.z < height) return (Span){0, 1};
    if (a.z >= height && b.z >= height) return (Span){1, 0};
    double t = (height - a.z) / (b.z - a.z);
    return a.z < height ? (Span){0, t} : (Span){t, 1};
}

/* Add what the part of the link inside one building penetrates. An end of the span that is no end
 * of the link is a wall or the roof. */
static void penetrate(Penetration *sum, Span inside, Span below, double length) {
    double enter = larger(inside.enter, below.enter), leave = smaller(inside.leave, below.leave);
    if (!(enter < leave)) return;
    sum->walls += (enter > 0) + (leave < 1);
    sum->indoors += (leave - enter) * length;
}

static bool is_before(const uint32_t *a, const uint32_t *b) { return *a < *b; }

/* There are few near a link. */
DEFINE_INSERTION_SORT(sort_indices, uint32_t, is_before)

Nearby buildings_near(const Buildings *s, BuildingScratch *scratch, Position a, Position b,
                      const double margin[2]) {
    size_t count = area_index_near(&s->index, a, b, margin, scratch->near);
    sort_indices(scratch->near, count);
    return (Nearby){scratch->near, count};
}

/* Add what the link penetrates of building k. */
static void penetrate_building(const Buildings *s, double *crossing, uint32_t k, Position a,
                               Position b, double length, bool finite, Penetration *sum) {
    Span below = finite ? span_below(s->height[k], a, b) : (Span){0, 1};
    if (!(below.enter < below.leave)) return;
    const double (*ring)[2] = (const double (*)[2])(s->corner + s->first[k]);
    size_t n = s->first[k + 1] - s->first[k];
    if (a.x == b.x && a.y == b.y) { /* a vertical link is inside all along, or nowhere */
        if (ring_contains(ring, n, a)) penetrate(sum, (Span){0, 1}, below, length);
        return;
    }
    size_t crossings = ring_crossings(ring, n, a, b, crossing);
    for (size_t c = 0; c + 1 < crossings; c += 2)
        penetrate(sum, (Span){crossing[c], crossing[c + 1]}, below, length);
}

bool buildings_penetrate(const Buildings *s, BuildingScratch *scratch, Position a, Position b,
                         Nearby near, const WallModel *model, double limit_db, Penetration *sum) {
    *sum = (Penetration){0, 0};
    double length = distance_between(a, b);
    Corridor way = corridor(a, b, (double[]){0, 0});
    for (size_t i = 0; i < near.count; i++) {
        if (!area_meets(&s->area[near.index[i]], &way)) continue;
        penetrate_building(s, scratch->crossing, near.index[i], a, b, length, model->finite, sum);
        if (penetration_db(model, sum) > limit_db) return false;
    }
    return true;
}

/* Distances from a wall to an area, positive on the inner side: the least and the greatest. */
static Span distances(const Wall *wall, const Area *area) {
    double x = wall->normal[0], y = wall->normal[1];
    double center = x * area->center[0] + y * area->center[1] - wall->offset;
    double reach = fabs(x) * area->half[0] + fabs(y) * area->half[1];
    return (Span){center - reach, center + reach};
}

/* Keep the part of `span` where the line from `start` at 0 to `stop` at 1 is not negative. */
static void keep_positive(double start, double stop, Span *span) {
    if (start < 0 && stop < 0) span->leave = -1;
    else if (start < 0) span->enter = larger(span->enter, start / (start - stop));
    else if (stop < 0) span->leave = smaller(span->leave, start / (start - stop));
}

/* Whether all corners lie on one side of all links between the areas. */
static bool is_beside(const Buildings *s, uint32_t k, const Area *a, const Area *b) {
    double x = a->center[1] - b->center[1], y = b->center[0] - a->center[0];
    double line = x * a->center[0] + y * a->center[1];
    double reach = larger(fabs(x) * a->half[0] + fabs(y) * a->half[1],
                        fabs(x) * b->half[0] + fabs(y) * b->half[1]);
    reach += 1e-9 * (fabs(line) + reach); /* against rounding */
    bool left = true, right = true;
    for (size_t i = s->first[k]; i < s->first[k + 1] && (left || right); i++) {
        double side = x * s->corner[i][0] + y * s->corner[i][1] - line;
        left &= side > reach;
        right &= side < -reach;
    }
    return left || right;
}

Cover building_cover(const Buildings *s, uint32_t k, const Area *a, const Area *b) {
    static const double MARGIN = 1e-6; /* against rounding [m] */
    if (s->first[k + 1] - s->first[k] > MANY_CORNERS) return (Cover){.inside = 0};
    Span inside = {0, 1};
    bool a_outside = false, b_outside = false;
    for (size_t i = s->first[k]; i < s->first[k + 1]; i++) {
        const Wall *wall = &s->wall[i];
        Span at_a = distances(wall, a), at_b = distances(wall, b);
        bool a_beyond = at_a.leave < wall->lowest - MARGIN;
        bool b_beyond = at_b.leave < wall->lowest - MARGIN;
        if (a_beyond && b_beyond) return (Cover){.is_clear = true};
        a_outside |= a_beyond;
        b_outside |= b_beyond;
        keep_positive(at_a.enter - MARGIN, at_b.enter - MARGIN, &inside);
    }
    Cover cover = {.inside = s->is_opaque[k] ? larger(inside.leave - inside.enter, 0) : 0};
    cover.is_hidden = cover.inside > 0 && a_outside && b_outside;
    cover.is_clear = cover.inside <= 0 && is_beside(s, k, a, b);
    return cover;
}

#include "building_shadowing.h"
#include "buffer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int buildings_set(Buildings *s, const double *corner, const int32_t *index, size_t corners,
                  const double *height, size_t count) {
    s->count = 0;
    if (BUFFER_RESERVE(s->corner, s->corner_capacity, corners)
        || BUFFER_RESERVE(s->crossing, s->crossing_capacity, corners)
        || BUFFER_RESERVE(s->first, s->first_capacity, count + 1)
        || BUFFER_RESERVE(s->height, s->height_capacity, count)
        || BUFFER_RESERVE(s->box, s->box_capacity, count)
        || BUFFER_RESERVE(s->near, s->near_capacity, count))
        return 1;
    for (size_t k = 0; k < count; k++) {
        s->height[k] = height[k];
        s->box[k] = (Box){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    }
    for (size_t i = 0; i < corners; i++) {
        if (i == 0 || index[i] != index[i - 1]) s->first[index[i]] = i;
        Box *box = &s->box[index[i]];
        for (int k = 0; k < 2; k++) {
            s->corner[i][k] = corner[2 * i + (size_t)k];
            box->low[k] = fmin(box->low[k], s->corner[i][k]);
            box->high[k] = fmax(box->high[k], s->corner[i][k]);
        }
    }
    s->first[count] = corners;
    s->count = count;
    return grid_build(&s->grid, s->box, count);
}

void buildings_free(Buildings *s) {
    free(s->corner);
    free(s->first);
    free(s->height);
    free(s->box);
    free(s->crossing);
    free(s->near);
    grid_free(&s->grid);
    *s = (Buildings){0};
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
    double enter = fmax(inside.enter, below.enter), leave = fmin(inside.leave, below.leave);
    if (!(enter < leave)) return;
    sum->walls += (enter > 0) + (leave < 1);
    sum->indoors += (leave - enter) * length;
}

Penetration buildings_penetration(Buildings *s, Position a, Position b, bool finite) {
    Penetration sum = {0, 0};
    double length = distance_between(a, b);
    size_t near = grid_near_segment(&s->grid, a, b, s->near);
    for (size_t i = 0; i < near; i++) {
        uint32_t k = s->near[i];
        Span below = finite ? span_below(s->height[k], a, b) : (Span){0, 1};
        if (!(below.enter < below.leave)) continue;
        const double (*ring)[2] = (const double (*)[2])(s->corner + s->first[k]);
        size_t n = s->first[k + 1] - s->first[k];
        if (a.x == b.x && a.y == b.y) { /* a vertical link is inside all along, or nowhere */
            if (ring_contains(ring, n, a)) penetrate(&sum, (Span){0, 1}, below, length);
            continue;
        }
        size_t crossings = ring_crossings(ring, n, a, b, s->crossing);
        for (size_t c = 0; c + 1 < crossings; c += 2)
            penetrate(&sum, (Span){s->crossing[c], s->crossing[c + 1]}, below, length);
    }
    return sum;
}

#include "view.h"

#include <math.h>
#include <string.h>

#include "memory.h"
#include "portable_math.h"

/* The angle that a change of direction `difference`, in (-2 pi, 2 pi), turns through. */
static double turn(double difference) {
    if (difference > PI)
        return difference - 2.0 * PI;
    return difference <= -PI ? difference + 2.0 * PI : difference;
}

/* Room for every face that `prisms` could have. */
static int reserve(View *view, const Scene *scene) {
    int failed = 0;
    size_t corners = scene->corner_count, longest = 1;
    for (size_t i = 0; i < scene->count; i++)
        if (scene->prism[i].count > longest)
            longest = scene->prism[i].count;
    view->wall = with_room(view->wall, &view->wall_capacity, corners, sizeof *view->wall, &failed);
    view->wall_window = with_room(view->wall_window, &view->wall_window_capacity, corners,
                                  sizeof *view->wall_window, &failed);
    view->cap
        = with_room(view->cap, &view->cap_capacity, scene->count, sizeof *view->cap, &failed);
    view->cap_window = with_room(view->cap_window, &view->cap_window_capacity, scene->count,
                                 sizeof *view->cap_window, &failed);
    view->corner = with_room(view->corner, &view->corner_capacity, corners,
                             2 * sizeof *view->corner, &failed);
    view->angle
        = with_room(view->angle, &view->angle_capacity, longest, sizeof *view->angle, &failed);
    view->crossing = with_room(view->crossing, &view->crossing_capacity, longest,
                               sizeof *view->crossing, &failed);
    return failed;
}

static int within_range(const Prism *prism, const Viewpoint *from) {
    double x = prism->center[0] - from->position[0], y = prism->center[1] - from->position[1];
    double reach = from->range + prism->radius;
    return x * x + y * y <= reach * reach;
}

/* Square of the distance of the edge a - b from the origin. */
static double edge_distance_square(const double *a, const double *b) {
    double x = b[0] - a[0], y = b[1] - a[1], length_square = x * x + y * y;
    double along = length_square > 0.0 ? -(a[0] * x + a[1] * y) / length_square : 0.0;
    along = fmin(fmax(along, 0.0), 1.0);
    double px = a[0] + along * x, py = a[1] + along * y;
    return px * px + py * py;
}

static void add_walls(View *view, const Prism *prism, const double *ring, const Viewpoint *from,
                      uint32_t bins) {
    for (size_t i = 0; i < prism->count; i++) {
        size_t j = i + 1 < prism->count ? i + 1 : 0;
        const double *a = ring + 2 * i, *b = ring + 2 * j;
        double area = a[0] * (b[1] - a[1]) - a[1] * (b[0] - a[0]);
        if (!(area < 0.0)) /* seen from behind or edge-on */
            continue;
        if (edge_distance_square(a, b) > from->range * from->range)
            continue;
        double x = b[0] - a[0], y = b[1] - a[1];
        view->wall_window[view->wall_count] = window_over(
            view->angle[i] - fabs(turn(view->angle[j] - view->angle[i])), view->angle[i], bins);
        view->wall[view->wall_count++] = (Wall){
            .x0 = a[0],
            .y0 = a[1],
            .x1 = b[0],
            .y1 = b[1],
            .bottom = prism->bottom - from->position[2],
            .top = prism->top - from->position[2],
            .area = area,
            .inverse_length = 1.0 / sqrt(x * x + y * y),
            .surface = prism->surface,
        };
    }
}

/* The azimuths that a ring covers, by following it around; all of them if it goes around the sensor
 * or so close by that the sense of a turn is uncertain. */
static Window ring_window(const View *view, const Prism *prism, uint32_t bins) {
    double angle = view->angle[0], low = angle, high = angle;
    for (size_t i = 0; i < prism->count; i++) {
        size_t j = i + 1 < prism->count ? i + 1 : 0;
        double step = turn(view->angle[j] - view->angle[i]);
        if (fabs(step) > PI - 1e-6)
            return (Window){0, bins};
        angle += step;
        low = fmin(low, angle);
        high = fmax(high, angle);
    }
    return window_over(low, fmin(high, low + 2.0 * PI), bins);
}

static void add_cap(View *view, const Prism *prism, size_t first, double height, uint32_t bins) {
    view->cap_window[view->cap_count] = ring_window(view, prism, bins);
    view->cap[view->cap_count++] = (Cap){
        .first = first, .count = prism->count, .height = height, .surface = prism->surface};
}

int view_build(View *view, const Scene *scene, const Viewpoint *from, uint32_t bins) {
    if (reserve(view, scene))
        return 1;
    double sine, cosine;
    sine_cosine(from->heading, &sine, &cosine);
    view->wall_count = view->cap_count = view->corner_count = 0;
    view->height = from->position[2];
    for (size_t p = 0; p < scene->count; p++) {
        const Prism *prism = scene->prism + p;
        if (prism->owner == from->vehicle || !within_range(prism, from))
            continue;
        size_t first = view->corner_count;
        double *ring = view->corner + 2 * first;
        for (size_t i = 0; i < prism->count; i++) {
            const double *corner = scene->corner + 2 * (prism->first + i);
            double x = corner[0] - from->position[0], y = corner[1] - from->position[1];
            ring[2 * i] = cosine * x + sine * y;
            ring[2 * i + 1] = cosine * y - sine * x;
            view->angle[i] = atan2(ring[2 * i + 1], ring[2 * i]);
        }
        view->corner_count += prism->count;
        add_walls(view, prism, ring, from, bins);
        if (prism->top < from->position[2])
            add_cap(view, prism, first, prism->top - from->position[2], bins);
        if (prism->bottom > from->position[2])
            add_cap(view, prism, first, prism->bottom - from->position[2], bins);
    }
    return bins_fill(&view->wall_bins, view->wall_window, view->wall_count, bins)
           || bins_fill(&view->cap_bins, view->cap_window, view->cap_count, bins);
}

void view_clear(View *view) {
    free(view->wall);
    free(view->wall_window);
    free(view->cap);
    free(view->cap_window);
    free(view->corner);
    free(view->angle);
    free(view->crossing);
    bins_clear(&view->wall_bins);
    bins_clear(&view->cap_bins);
    memset(view, 0, sizeof *view);
}

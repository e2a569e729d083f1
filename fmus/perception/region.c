#include "region.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is known of a sub-cell while a line is drawn. */
enum { ON_ROAD = 1, NEAR_ROUTE = 2 };

/* Most sub-cells along a side of a cell. */
enum { SIDE_MAXIMUM = 100 };

/* Maps are within this distance of the origin [m]: no product of coordinates overflows. */
static const double COORDINATE_LIMIT = 1e9;

/* ---- checks --------------------------------------------------------------------------------- */

static int check_points(const char *name, const double *vertex, size_t count, Problem *problem) {
    for (size_t i = 0; i < 2 * count; i++)
        if (!(fabs(vertex[i]) <= COORDINATE_LIMIT))
            return fail(problem, "%s[%zu, %zu] is %g, must be within 1e9 m of 0", name, i / 2,
                        i % 2, vertex[i]);
    return 0;
}

int route_check(const Route *route, Problem *problem) {
    return check_points("route.vertex", route->vertex, route->count, problem);
}

/* The end of the polygon that begins with corner `first`. */
static size_t end_of(const Road *road, size_t first) {
    size_t end = first + 1;
    while (end < road->count && road->index[end] == road->index[first]) end++;
    return end;
}

int road_check(const Road *road, Problem *problem) {
    if (check_points("road.vertex", road->vertex, road->count, problem)) return 1;
    for (size_t i = 0; i < road->count; i++)
        if (road->index[i] < 0 || (i > 0 && road->index[i] < road->index[i - 1]))
            return fail(problem, "road.index[%zu] is %d, must be >= 0 and not fall", i,
                        (int)road->index[i]);
    for (size_t first = 0, end; first < road->count; first = end) {
        end = end_of(road, first);
        if (end - first < 3)
            return fail(problem, "road polygon %d has %zu corners, at least 3 are needed",
                        (int)road->index[first], end - first);
    }
    return 0;
}

/* ---- the map in the matrix frame ------------------------------------------------------------ */

/* World to matrix frame: origin in the centre of the matrix, x along its heading, y left. */
static void turn(double turned[2], const double *point, const Pose *pose) {
    double x = point[0] - pose->center[0], y = point[1] - pose->center[1];
    turned[0] = pose->cosine * x + pose->sine * y;
    turned[1] = pose->cosine * y - pose->sine * x;
}

/* Whether the box around some corners reaches into the square around the matrix, whatever its
 * heading. */
static int is_near(const double *corner, size_t count, const Pose *pose, double reach) {
    for (size_t axis = 0; axis < 2; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < count; i++) {
            low = fmin(low, corner[2 * i + axis]);
            high = fmax(high, corner[2 * i + axis]);
        }
        if (!(low <= pose->center[axis] + reach && high >= pose->center[axis] - reach)) return 0;
    }
    return 1;
}

static void add_edges(Region *region, const Road *road, size_t first, size_t end,
                      const Pose *pose) {
    double before[2], here[2];
    turn(before, &road->vertex[2 * (end - 1)], pose);
    for (size_t i = first; i < end; i++) {
        turn(here, &road->vertex[2 * i], pose);
        int rises = here[0] > before[0];
        const double *low = rises ? before : here, *high = rises ? here : before;
        if (here[0] != before[0])
            region->edges[region->edge_count++] =
                (Edge){{low[0], low[1]}, {high[0], high[1]}, road->index[first], rises ? 1 : -1};
        memcpy(before, here, sizeof before);
    }
}

static int collect_edges(Region *region, const Pose *pose, double reach, const Road *road,
                         Problem *problem) {
    region->edge_count = 0;
    for (size_t first = 0, end; first < road->count; first = end) {
        end = end_of(road, first);
        if (!is_near(&road->vertex[2 * first], end - first, pose, reach)) continue;
        if (reserve(&region->edges, &region->edge_capacity, region->edge_count + (end - first),
                    sizeof(Edge), problem))
            return 1;
        add_edges(region, road, first, end, pose);
    }
    return reserve(&region->crossings, &region->crossing_capacity, region->edge_count,
                   sizeof(Crossing), problem);
}

static int collect_segments(Region *region, const Pose *pose, double reach, const Route *route,
                            Problem *problem) {
    region->segment_count = 0;
    if (reserve(&region->segments, &region->segment_capacity, route->count, sizeof(Segment),
                problem))
        return 1;
    for (size_t i = 0; i + 1 < route->count; i++) {
        const double *piece = &route->vertex[2 * i];
        if (!is_near(piece, 2, pose, reach)) continue;
        Segment *segment = &region->segments[region->segment_count++];
        turn(segment->start, piece, pose);
        turn(segment->end, piece + 2, pose);
    }
    return 0;
}

/* ---- one line of sub-cells ------------------------------------------------------------------ */

/* A line of sub-cells across the matrix at `x`: centres are at (i + 0.5) step - width / 2. */
typedef struct {
    double x, step, width;
    size_t count;
} Line;

/* Index of the first sub-cell whose centre is at `y` or to the left of it. */
static size_t index_at(const Line *line, double y) {
    double i = ceil((y + line->width / 2) / line->step - 0.5);
    return !(i > 0.0) ? 0 : i < (double)line->count ? (size_t)i : line->count;
}

static void mark(uint8_t *cells, const Line *line, double low, double high, uint8_t flag) {
    size_t end = index_at(line, high);
    for (size_t i = index_at(line, low); i < end; i++) cells[i] |= flag;
}

/* Insertion sort: a line has few crossings with a polygon. */
static void sort_crossings(Crossing *crossings, size_t count) {
    for (size_t i = 1; i < count; i++) {
        Crossing moved = crossings[i];
        size_t k = i;
        for (; k > 0 && crossings[k - 1].y > moved.y; k--) crossings[k] = crossings[k - 1];
        crossings[k] = moved;
    }
}

/* Mark what is inside a polygon: where its ring winds around (nonzero winding number), so that a
 * ring that overlaps itself, as the outline of a sharp bend may, has no holes. */
static void mark_polygon(Region *region, const Line *line) {
    int32_t winding = 0;
    sort_crossings(region->crossings, region->crossing_count);
    for (size_t i = 0; i + 1 < region->crossing_count; i++) {
        winding += region->crossings[i].turn;
        if (winding != 0)
            mark(region->line, line, region->crossings[i].y, region->crossings[i + 1].y, ON_ROAD);
    }
    region->crossing_count = 0;
}

static void mark_road(Region *region, const Line *line) {
    region->crossing_count = 0;
    for (size_t i = 0; i < region->edge_count; i++) {
        const Edge *edge = &region->edges[i];
        if (i > 0 && edge->polygon != edge[-1].polygon) mark_polygon(region, line);
        if (!(edge->start[0] <= line->x && line->x < edge->end[0])) continue;
        double part = (line->x - edge->start[0]) / (edge->end[0] - edge->start[0]);
        double y = edge->start[1] + part * (edge->end[1] - edge->start[1]);
        region->crossings[region->crossing_count++] = (Crossing){y, edge->turn};
    }
    mark_polygon(region, line);
}

/* An interval of y; empty while low > high. */
typedef struct {
    double low, high;
} Interval;

/* Keep where `offset + slope y` is within [least, most]. */
static void narrow(Interval *interval, double offset, double slope, double least, double most) {
    if (slope == 0.0) {
        if (!(offset >= least && offset <= most)) *interval = (Interval){INFINITY, -INFINITY};
        return;
    }
    double a = (least - offset) / slope, b = (most - offset) / slope;
    interval->low = fmax(interval->low, fmin(a, b));
    interval->high = fmin(interval->high, fmax(a, b));
}

static Interval hull(Interval a, Interval b) {
    return (Interval){fmin(a.low, b.low), fmax(a.high, b.high)};
}

static Interval across_disc(const double center[2], double radius, double x) {
    double half2 = radius * radius - (x - center[0]) * (x - center[0]);
    if (!(half2 >= 0.0)) return (Interval){INFINITY, -INFINITY};
    double half = sqrt(half2);
    return (Interval){center[1] - half, center[1] + half};
}

/* The part of a line within `reach` of a segment. What lies within it is convex: two discs and the
 * rectangle between them; so the parts in these three make one interval. */
static Interval across_segment(const Segment *segment, double reach, double x) {
    const double *a = segment->start, *b = segment->end;
    Interval found = hull(across_disc(a, reach, x), across_disc(b, reach, x));
    double along[2] = {b[0] - a[0], b[1] - a[1]};
    double length = sqrt(along[0] * along[0] + along[1] * along[1]);
    if (!(length > 0.0)) return found;
    Interval between = {-INFINITY, INFINITY};
    double u = along[0] / length, v = along[1] / length;
    narrow(&between, (x - a[0]) * u - a[1] * v, v, 0.0, length);
    narrow(&between, -(x - a[0]) * v - a[1] * u, u, -reach, reach);
    return between.low <= between.high ? hull(found, between) : found;
}

static void mark_corridor(Region *region, const Line *line, double corridor) {
    for (size_t i = 0; i < region->segment_count; i++) {
        Interval part = across_segment(&region->segments[i], corridor, line->x);
        if (part.low <= part.high) mark(region->line, line, part.low, part.high, NEAR_ROUTE);
    }
}

/* ---- the region ----------------------------------------------------------------------------- */

/* Add the sub-cells of a line that are in the region to the cells of `row`. */
static void count_line(Region *region, const RegionSettings *settings, const ScanSettings *matrix,
                       const Line *line, uint32_t *row, uint8_t wanted) {
    double ahead = line->x + matrix->offset; /* of the sensor */
    double nearest2 = settings->near_field * settings->near_field;
    double farthest2 = settings->horizon * settings->horizon;
    for (size_t i = 0; i < line->count; i++) {
        if (region->line[i] != wanted) continue;
        double y = ((double)i + 0.5) * line->step - line->width / 2;
        double distance2 = ahead * ahead + y * y;
        if (distance2 >= nearest2 && distance2 <= farthest2) row[i / region->side]++;
    }
}

static int prepare(Region *region, const RegionSettings *settings, const ScanSettings *matrix,
                   Problem *problem) {
    size_t cells = (size_t)matrix->rows * matrix->columns;
    double side = ceil(matrix->cell / settings->resolution);
    region->side = side < (double)SIDE_MAXIMUM ? (uint32_t)side : SIDE_MAXIMUM;
    if (reserve(&region->inside, &region->inside_capacity, cells, sizeof *region->inside, problem)
        || reserve(&region->line, &region->line_capacity,
                   (size_t)matrix->columns * region->side, 1, problem))
        return 1;
    memset(region->inside, 0, cells * sizeof *region->inside);
    return 0;
}

int region_make(Region *region, const RegionSettings *settings, const ScanSettings *matrix,
                const Pose *pose, const Road *road, const Route *route, Problem *problem) {
    double length = matrix->rows * matrix->cell, width = matrix->columns * matrix->cell;
    double reach = 0.5 * sqrt(length * length + width * width);
    if (prepare(region, settings, matrix, problem)
        || collect_edges(region, pose, reach, road, problem)
        || collect_segments(region, pose, reach + settings->corridor, route, problem))
        return 1;
    uint8_t wanted = (uint8_t)((road->count ? ON_ROAD : 0) | (route->count > 1 ? NEAR_ROUTE : 0));
    Line line = {.step = matrix->cell / region->side,
                 .width = width,
                 .count = (size_t)matrix->columns * region->side};
    for (uint64_t i = 0; i < (uint64_t)matrix->rows * region->side; i++) {
        line.x = ((double)i + 0.5) * line.step - length / 2;
        if (!(fabs(line.x + matrix->offset) <= settings->horizon)) continue;
        memset(region->line, 0, line.count);
        if (road->count) mark_road(region, &line);
        mark_corridor(region, &line, settings->corridor);
        count_line(region, settings, matrix, &line,
                   &region->inside[i / region->side * matrix->columns], wanted);
    }
    return 0;
}

void region_free(Region *region) {
    free(region->inside);
    free(region->line);
    free(region->segments);
    free(region->edges);
    free(region->crossings);
}

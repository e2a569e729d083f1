/* The channel's formulas as functions on arrays, for tests against golden data. Compiled together
 * with the sources of the FMU itself. Links are rows of `a` and `b`: x, y, z [m]. */
#include "antenna.h"
#include "building_shadowing.h"
#include "error_rate.h"
#include "knife_edge.h"
#include "link.h"
#include "path_loss.h"
#include "random.h"
#include "vehicle_shadowing.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

static const double NO_MARGIN[2] = {0, 0};

static Position position(const double *row) { return (Position){row[0], row[1], row[2]}; }

static Antenna antenna(const double *row, int64_t body) {
    return (Antenna){position(row), row[2], 0, body < 0 ? NO_BODY : (size_t)body};
}

/* ---- path loss and antennas ---- */

/* Columns: wavelength [m], PathLossModel, exponent, lossless distance, permittivity, breakpoint
 * distance, loss at 1 m, loss at the breakpoint, exponent beyond it. */
static Parameters path_loss_parameters(const double model[9]) {
    return (Parameters){
        .wavelength = {model[0], model[0], model[0]}, .path_loss = (PathLossModel)model[1],
        .path_loss_exponent = model[2], .lossless_distance = model[3], .permittivity = model[4],
        .breakpoint_distance = model[5], .breakpoint_near_loss_db = model[6],
        .breakpoint_far_loss_db = model[7], .breakpoint_far_exponent = model[8],
    };
}

EXPORT void path_losses(size_t n, const double *a, const double *b, const double (*model)[9],
                        double *loss) {
    for (size_t i = 0; i < n; i++) {
        Parameters p = path_loss_parameters(model[i]);
        PathLoss prepared = path_loss_prepare(&p);
        double x = b[3 * i] - a[3 * i], y = b[3 * i + 1] - a[3 * i + 1];
        double z = b[3 * i + 2] - a[3 * i + 2], gain[BANDS];
        Path path = {x * x + y * y + z * z, x * x + y * y, {a[3 * i + 2], b[3 * i + 2]}};
        path_gains(&prepared, &path, gain);
        loss[i] = -10 * log10(gain[CENTER]);
    }
}

/* The bound below which no path of at least `distance` [m] on the ground comes [dB]. */
EXPORT double lowest_path_loss(const double model[9], double distance) {
    Parameters p = path_loss_parameters(model);
    PathLoss prepared = path_loss_prepare(&p);
    return -10 * log10(path_highest_gain(&prepared, distance * distance));
}

EXPORT double pattern_gain(size_t n, const double *gain_db, double azimuth) {
    return pattern_gain_db(gain_db, n, azimuth);
}

/* ---- obstacles ---- */

EXPORT int penetrations(size_t corners, const double *corner, const int32_t *index, size_t count,
                        const double *height, bool finite, size_t n, const double *a,
                        const double *b, double *walls, double *indoors) {
    Buildings buildings = {0};
    BuildingScratch scratch = {0};
    int failed = buildings_set(&buildings, corner, index, corners, height, count)
        || building_scratch_reserve(&scratch, &buildings);
    for (size_t i = 0; i < n && !failed; i++) {
        Position from = position(a + 3 * i), to = position(b + 3 * i);
        Nearby near = buildings_near(&buildings, &scratch, from, to, NO_MARGIN);
        WallModel model = {1, 1, finite};
        Penetration p;
        buildings_penetrate(&buildings, &scratch, from, to, near, &model, INFINITY, &p);
        walls[i] = p.walls;
        indoors[i] = p.indoors;
    }
    buildings_free(&buildings);
    building_scratch_free(&scratch);
    return failed;
}

/* `own_a`, `own_b`: index of the body that carries the antenna, or -1. */
EXPORT int shadows(size_t bodies, const double *center, const double *heading, const double *size,
                   bool reciprocal, double factor, size_t n, const double *a, const double *b,
                   const int64_t *own_a, const int64_t *own_b, const double *wavelength,
                   double (*loss)[2], bool (*blocked)[2]) {
    Bodies s = {0};
    BodyScratch scratch = {0};
    int failed = bodies_resize(&s, bodies);
    if (!failed) {
        for (size_t k = 0; k < bodies; k++)
            bodies_put(&s, k, position(center + 3 * k), heading[k], size + 3 * k);
        failed = bodies_index(&s) || body_scratch_reserve(&scratch, &s);
    }
    for (size_t i = 0; i < n && !failed; i++) {
        double w = wavelength[i];
        Parameters p = {.wavelength = {w, w, w}, .knife_edge_factor = factor, .reciprocal = reciprocal};
        EdgeModel model = edge_model(&p);
        Antenna from = antenna(a + 3 * i, own_a[i]), to = antenna(b + 3 * i, own_b[i]);
        Nearby near = bodies_near(&s, &scratch, from.at, to.at, NO_MARGIN);
        BodyShadow shadow = bodies_shadow(&s, &scratch, &from, &to, near, &model, BOTH);
        for (int way = 0; way < 2; way++) {
            loss[i][way] = edge_loss_db(edges_loss(&shadow.edges[way], model.scale.at[CENTER]));
            blocked[i][way] = shadow.blocked[way];
        }
    }
    bodies_free(&s);
    body_scratch_free(&scratch);
    return failed;
}

EXPORT double profile_loss(size_t n, const double *distance, const double *height,
                           double wavelength, double factor) {
    Profile profile = {distance, height, n};
    Parameters p = {.wavelength = {wavelength, wavelength, wavelength}, .knife_edge_factor = factor};
    uint32_t *major = malloc(n * sizeof *major);
    Edges edges = {.v = malloc(2 * n * sizeof(double))};
    double loss = NAN;
    if (major && edges.v) {
        knife_edges(&profile, major, &edges);
        loss = edge_loss_db(edges_loss(&edges, edge_scale(&p).at[CENTER]));
    }
    free(major);
    free(edges.v);
    return loss;
}

/* ---- links in a scene ---- */

typedef struct {
    double carrier_frequency, path_loss, path_loss_exponent, lossless_distance, permittivity,
        breakpoint_distance, breakpoint_near_loss, breakpoint_far_loss, breakpoint_far_exponent,
        maximum_range, wall_loss, indoor_loss, knife_edge_factor;
    bool band_edges, building_shadowing, finite_buildings, vehicle_shadowing, reciprocal;
    size_t antenna_gains;
    const double *antenna_gain;
} Model;

typedef struct {
    size_t vehicles, buildings, corners;
    const double *position, *heading, *size, *antenna_height;
    const bool *equipped;
    const double *corner, *building_height;
    const int32_t *index;
} Town;

/* Matrices, row = transmitter. `rank`: place of the receiver in the row, -1 if it is not in it. */
typedef struct {
    double *gain, *distance;
    int32_t *kind, *rank;
} LinkMatrix;

static Parameters parameters(const Model *m) {
    Parameters p = {
        .antenna_gain_db = m->antenna_gain, .antenna_gains = m->antenna_gains,
        .maximum_range = m->maximum_range, .band_edges = m->band_edges,
        .path_loss = (PathLossModel)m->path_loss, .path_loss_exponent = m->path_loss_exponent,
        .lossless_distance = m->lossless_distance, .permittivity = m->permittivity,
        .breakpoint_distance = m->breakpoint_distance,
        .breakpoint_near_loss_db = m->breakpoint_near_loss,
        .breakpoint_far_loss_db = m->breakpoint_far_loss,
        .breakpoint_far_exponent = m->breakpoint_far_exponent, .wall_loss_db = m->wall_loss,
        .indoor_loss_db = m->indoor_loss, .knife_edge_factor = m->knife_edge_factor,
        .building_shadowing = m->building_shadowing, .finite_buildings = m->finite_buildings,
        .vehicle_shadowing = m->vehicle_shadowing, .reciprocal = m->reciprocal,
    };
    double highest = 0;
    for (size_t k = 0; k < m->antenna_gains; k++) highest = fmax(highest, m->antenna_gain[k]);
    p.highest_antenna_gain = pow(10, highest / 10);
    for (int band = 0; band < BANDS; band++)
        p.wavelength[band] =
            LIGHT_SPEED / (m->carrier_frequency + (m->band_edges ? 5e6 * (band - CENTER) : 0));
    return p;
}

static int put_buildings(Scene *s, const Town *t) {
    return buildings_set(&s->buildings, t->corner, t->index, t->corners, t->building_height,
                         t->buildings);
}

static int put_vehicles(Scene *s, const Town *t) {
    size_t n = t->vehicles;
    s->id = realloc(s->id, n * sizeof *s->id);
    s->antenna = realloc(s->antenna, n * sizeof *s->antenna);
    s->equipped = realloc(s->equipped, n * sizeof *s->equipped);
    if (!s->id || !s->antenna || !s->equipped || bodies_resize(&s->bodies, n)) return 1;
    s->count = n;
    for (size_t k = 0; k < n; k++) {
        Position center = position(t->position + 3 * k), at = center;
        at.z += t->antenna_height[k];
        s->id[k] = (int64_t)k;
        s->equipped[k] = t->equipped[k];
        s->antenna[k] = (Antenna){at, t->antenna_height[k], t->heading[k], k};
        bodies_put(&s->bodies, k, center, t->heading[k], t->size + 3 * k);
    }
    return bodies_index(&s->bodies);
}

static int build(Scene *s, const Town *t) { return put_vehicles(s, t) || put_buildings(s, t); }

static void dismantle(Scene *s, Links *links) {
    links_free(links);
    bodies_free(&s->bodies);
    buildings_free(&s->buildings);
    free(s->id);
    free(s->antenna);
    free(s->equipped);
}

static void put(const LinkMatrix *m, size_t n, size_t from, const Link *link, int32_t rank) {
    size_t k = from * n + link->receiver;
    memcpy(m->gain + BANDS * k, link->gain, sizeof link->gain);
    m->distance[k] = link->distance;
    m->kind[k] = link->kind;
    m->rank[k] = rank;
}

/* What is announced while the rows are asked for: in front of each `width` of them, as many of
 * `radio`, to so many workers; nothing if `workers` is 0. Between rows a single link is asked for. */
typedef struct {
    size_t workers, width;
    const uint32_t *radio;
} Announced;

static int announce(Links *links, const Announced *a, size_t i, size_t rows, double floor) {
    if (a->workers == 0 || i % a->width > 0) return 0;
    size_t count = rows - i < a->width ? rows - i : a->width;
    Expected expected = {a->radio + i, count, floor, floor / 100, (double)(count % 5)};
    return links_rest(links) || links_expect(links, &expected);
}

static int ask_between(Links *links, const Announced *a, const uint32_t *order, size_t i) {
    Link link;
    if (a->workers == 0 || i == 0 || order[i] == order[i - 1]) return 0;
    return link_between(links, order[i], order[i - 1], 1e-14, &link);
}

/* The rows of the transmitters in `order`, each asked for with its own floor. */
EXPORT int link_rows(const Town *town, const Model *model, size_t rows, const uint32_t *order,
                     const double *floor, const Announced *announced, const LinkMatrix *out) {
    Scene scene = {0};
    Links links = {0};
    Parameters p = parameters(model);
    p.workers = (uint32_t)announced->workers;
    int failed = build(&scene, town) || links_forget(&links, &scene, &p);
    for (size_t i = 0; i < rows && !failed; i++) {
        LinksFrom found = {0};
        int32_t rank = 0;
        failed = announce(&links, announced, i, rows, floor[i]) || ask_between(&links, announced, order, i)
            || links_from(&links, order[i], floor[i], &found);
        for (size_t to = 0; to < town->vehicles && !failed; to++)
            out->rank[order[i] * town->vehicles + to] = -1;
        for (size_t k = 0; k < found.count && !failed; k++)
            if (found.link[k].gain[CENTER] >= floor[i])
                put(out, town->vehicles, order[i], &found.link[k], rank++);
    }
    dismantle(&scene, &links);
    return failed;
}

/* Scenes that follow each other; the buildings of one that has none stay those before. All rows of each
 * are asked for, and links by themselves at the floor `negligible`; those of the last one are told. */
EXPORT int link_rows_of_scenes(size_t scenes, const Town *town, const Model *model, double floor,
                               double negligible, const LinkMatrix *out) {
    Scene scene = {0};
    Links links = {0};
    int failed = 0;
    for (size_t i = 0; i < scenes && !failed; i++) {
        const Town *t = &town[i];
        Parameters p = parameters(&model[i]);
        failed = put_vehicles(&scene, t) || (t->buildings > 0 && put_buildings(&scene, t))
            || links_forget(&links, &scene, &p);
        for (size_t from = 0; from < t->vehicles && !failed; from++) {
            LinksFrom found = {0};
            Link alone;
            failed = links_from(&links, from, floor, &found);
            for (size_t k = 0; k < found.count && !failed && i + 1 == scenes; k++)
                put(out, t->vehicles, from, &found.link[k], (int32_t)k);
            for (size_t to = 0; to < t->vehicles && !failed; to++)
                if (to != from && scene.equipped[from] && scene.equipped[to])
                    failed = link_between(&links, from, to, negligible, &alone);
        }
        links.models.parameters = NULL; /* gone */
    }
    dismantle(&scene, &links);
    return failed;
}

/* What buildings take at least between the cells of vehicles 0 and 1 [dB]; -1 if memory is short. */
EXPORT int least_loss(const Town *town, const Model *model, double floor) {
    Scene scene = {0};
    Links links = {0};
    Parameters p = parameters(model);
    Reach reach;
    int loss = -1;
    if (!build(&scene, town) && !links_forget(&links, &scene, &p)) {
        StreetCells *s = &links.cells;
        street_cells_prepare(s, &reach, &links.models, floor, INFINITY);
        View view = links_view(&links);
        loss = street_cells_find_loss(s, &view, s->cell_of[0], s->cell_of[1]);
    }
    dismantle(&scene, &links);
    return loss;
}

/* A link whose obstacles are looked up for it alone. */
static Link looked_up(const View *view, size_t from, size_t to) {
    const Antenna *a = &view->scene->antenna[from], *b = &view->scene->antenna[to];
    int way = is_before(a, b) || (!is_before(b, a) && from < to) ? 0 : 1;
    Pair pair;
    pair_evaluate(view, way ? b : a, way ? a : b, BOTH, 0, &pair);
    const double *gain = pair.gain[way];
    return (Link){{gain[0], gain[1], gain[2]}, pair.distance, (uint32_t)to, pair.kind[way]};
}

/* Every link on its own: among radios by `link_between` if wanted, else looked up. */
EXPORT int link_pairs(const Town *town, const Model *model, bool by_views, double negligible,
                      const LinkMatrix *out) {
    Scene scene = {0};
    Links links = {0};
    Parameters p = parameters(model);
    int failed = build(&scene, town) || links_forget(&links, &scene, &p);
    for (size_t from = 0; from < town->vehicles && !failed; from++)
        for (size_t to = 0; to < town->vehicles; to++) {
            if (to == from) continue;
            View view = links_view(&links);
            Link link = looked_up(&view, from, to);
            if (by_views && scene.equipped[from] && scene.equipped[to])
                failed |= link_between(&links, from, to, negligible, &link);
            put(out, town->vehicles, from, &link, 0);
        }
    dismantle(&scene, &links);
    return failed;
}

/* ---- error rates and draws ---- */

EXPORT int successes(double bitrate, size_t n, const double *snir, const double *bits,
                     double *chunk, double *header, double *payload) {
    const Mode *mode = mode_of_bitrate(bitrate);
    for (size_t i = 0; i < n && mode; i++) {
        chunk[i] = success_probability(mode, snir[i], bits[i]);
        header[i] = header_success_probability(snir[i]);
        payload[i] = payload_success_probability(mode, snir[i], (uint32_t)(bits[i] / 8));
    }
    return mode == NULL;
}

EXPORT int64_t duration(double bitrate, uint32_t size) {
    return frame_duration(mode_of_bitrate(bitrate), size);
}

EXPORT void philox(const uint32_t *counter, const uint32_t *key, uint32_t *out) {
    philox4x32(counter, key, out);
}

EXPORT void uniforms(uint64_t seed, int64_t packet, uint8_t hop, size_t n, double *out) {
    for (size_t i = 0; i < n; i++) {
        Uniforms u = draw(seed, DRAW_RECEPTION, packet, hop, (int64_t)i);
        out[2 * i] = u.first;
        out[2 * i + 1] = u.second;
    }
}

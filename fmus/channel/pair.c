#include "pair.h"
#include "decibel.h"
#include "records.h"
#include <math.h>
#include <string.h>

static const double NO_MARGIN[2] = {0, 0};

Propagation propagation_prepare(const Parameters *p) {
    return (Propagation){
        .parameters = p,
        .path_loss = path_loss_prepare(p),
        .walls = {p->wall_loss_db, p->indoor_loss_db, p->finite_buildings},
        .edges = edge_model(p),
        .antennas_gain = from_db(2 * p->antenna_gain_db[0]),
        .two_walls = from_db(2 * p->wall_loss_db) * (1 - 1e-9),
        .indoor_nepers = p->indoor_loss_db * (LOG_10 / 10) * (1 - 1e-9),
    };
}

int pair_scratch_reserve(PairScratch *s, const Scene *scene) {
    return building_scratch_reserve(&s->buildings, &scene->buildings)
        || body_scratch_reserve(&s->bodies, &scene->bodies);
}

void pair_scratch_free(PairScratch *s) {
    building_scratch_free(&s->buildings);
    body_scratch_free(&s->bodies);
}

bool is_before(const Antenna *a, const Antenna *b) {
    if (a->at.x != b->at.x) return a->at.x < b->at.x;
    if (a->at.y != b->at.y) return a->at.y < b->at.y;
    return a->at.z < b->at.z;
}

double highest_gain(const Propagation *m, double plane_distance) {
    double antenna = m->parameters->highest_antenna_gain;
    return path_highest_gain(&m->path_loss, plane_distance * plane_distance) * antenna * antenna;
}

static Path path_between(const Antenna *a, const Antenna *b) {
    double x = b->at.x - a->at.x, y = b->at.y - a->at.y, z = b->at.z - a->at.z;
    double plane_square = x * x + y * y;
    return (Path){plane_square + z * z, plane_square, {a->height, b->height}};
}

/* Path loss and antennas. */
static void start(const Propagation *m, const Antenna *a, const Antenna *b, Pair *pair) {
    Path path = path_between(a, b);
    pair->distance = sqrt(path.square);
    pair->kind[0] = pair->kind[1] = LOS;
    path_gains(&m->path_loss, &path, pair->gain[0]);
    double antennas = m->parameters->antenna_gains == 1
        ? m->antennas_gain : from_db(antennas_gain_db(m->parameters, a, b));
    for (int k = 0; k < BANDS; k++) pair->gain[1][k] = pair->gain[0][k] *= antennas;
}

static void attenuate(Pair *pair, double gain) {
    for (int k = 0; k < BANDS; k++) pair->gain[1][k] = pair->gain[0][k] *= gain;
}

/* Apply the shadow on one direction, first at the centre; false if it falls below the floor. */
static bool shade_way(const Propagation *m, const BodyShadow *shadow, int way, double floor,
                      Pair *pair) {
    const EdgeScale *scale = &m->edges.scale;
    const Edges *edges = &shadow->edges[way];
    double *gain = pair->gain[way];
    if (shadow->blocked[way] && pair->kind[way] == LOS) pair->kind[way] = NLOSV;
    if (edges->n > 0) gain[CENTER] *= edge_gain(edges_loss(edges, scale->at[CENTER]));
    if (gain[CENTER] < floor) return false;
    for (int k = 0; k < BANDS; k++) {
        if (k == CENTER) continue;
        if (!m->parameters->band_edges) gain[k] = gain[CENTER];
        else if (edges->n > 0) gain[k] *= edge_gain(edges_loss(edges, scale->at[k]));
    }
    return true;
}

/* Apply the shadow of vehicles; false if all wanted directions fall below the floor. */
static bool shade(const Propagation *m, const BodyShadow *shadow, unsigned ways, double floor,
                  Pair *pair) {
    if (m->edges.reciprocal) {
        bool strong = shade_way(m, shadow, 0, floor, pair);
        memcpy(pair->gain[1], pair->gain[0], sizeof pair->gain[1]);
        pair->kind[1] = pair->kind[0];
        return strong;
    }
    bool forth = ways & FORTH && shade_way(m, shadow, 0, floor, pair);
    bool back = ways & BACK && shade_way(m, shadow, 1, floor, pair);
    return forth || back;
}

static bool is_strong(const Pair *pair, double floor) { return pair->gain[0][CENTER] >= floor; }

/* Apply what the link penetrates; false if it falls below the floor. */
static bool pass_buildings(const View *v, const Antenna *a, const Antenna *b, double floor,
                           Pair *pair) {
    const Propagation *m = v->models;
    const Buildings *buildings = &v->scene->buildings;
    BuildingScratch *scratch = &v->scratch->buildings;
    if (!m->parameters->building_shadowing) return true;
    Nearby near = buildings_near(buildings, scratch, a->at, b->at, NO_MARGIN);
    if (near.count == 0) return true;
    /* too high rather than too low, so that what is exact decides */
    double limit_db = floor > 0 ? rough_db(pair->gain[0][CENTER] / floor) : INFINITY;
    Penetration found;
    if (!buildings_penetrate(buildings, scratch, a->at, b->at, near, &m->walls, limit_db, &found))
        return false;
    if (!(found.walls > 0 || found.indoors > 0)) return true;
    attenuate(pair, from_db(-penetration_db(&m->walls, &found)));
    pair->kind[0] = pair->kind[1] = NLOSB;
    return is_strong(pair, floor);
}

static bool pass_bodies(const View *v, const Antenna *a, const Antenna *b, unsigned ways,
                        double floor, Pair *pair) {
    const Propagation *m = v->models;
    const Bodies *bodies = &v->scene->bodies;
    BodyScratch *scratch = &v->scratch->bodies;
    if (!m->parameters->vehicle_shadowing) return true;
    Nearby near = bodies_near(bodies, scratch, a->at, b->at, NO_MARGIN);
    if (near.count == 0) return true;
    BodyShadow shadow = bodies_shadow(bodies, scratch, a, b, near, &m->edges, ways);
    return shade(m, &shadow, ways, floor, pair);
}

static bool end(Pair *pair) {
    for (int way = 0; way < 2; way++)
        for (int k = 0; k < BANDS; k++) pair->gain[way][k] = larger(pair->gain[way][k], LEAST_GAIN);
    return true;
}

/* No factor is above 1: a gain below the floor stays there. */
bool pair_evaluate(const View *v, const Antenna *a, const Antenna *b, unsigned ways, double floor,
                   Pair *pair) {
    start(v->models, a, b, pair);
    return is_strong(pair, floor) && pass_buildings(v, a, b, floor, pair)
        && pass_bodies(v, a, b, ways, floor, pair) && end(pair);
}

Attenuation attenuation(const View *v, const Antenna *a, const Antenna *b) {
    const Scene *s = v->scene;
    const Propagation *m = v->models;
    const Parameters *p = m->parameters;
    Attenuation found = {.antennas_db = antennas_gain_db(p, a, b)};
    double gain[BANDS];
    Path path = path_between(a, b);
    path_gains(&m->path_loss, &path, gain);
    found.path_db = to_db(1 / gain[CENTER]);
    if (p->vehicle_shadowing) {
        BodyScratch *scratch = &v->scratch->bodies;
        Nearby near = bodies_near(&s->bodies, scratch, a->at, b->at, NO_MARGIN);
        BodyShadow shadow = bodies_shadow(&s->bodies, scratch, a, b, near, &m->edges, BOTH);
        for (int way = 0; way < 2; way++) {
            EdgeLoss loss = edges_loss(&shadow.edges[way], m->edges.scale.at[CENTER]);
            found.vehicles_db[way] = edge_loss_db(loss);
            if (shadow.blocked[way]) found.kind[way] = NLOSV;
        }
    }
    if (p->building_shadowing) {
        BuildingScratch *scratch = &v->scratch->buildings;
        Nearby near = buildings_near(&s->buildings, scratch, a->at, b->at, NO_MARGIN);
        Penetration inside;
        buildings_penetrate(&s->buildings, scratch, a->at, b->at, near, &m->walls, INFINITY, &inside);
        found.buildings_db = penetration_db(&m->walls, &inside);
        if (inside.walls > 0 || inside.indoors > 0) found.kind[0] = found.kind[1] = NLOSB;
    }
    return found;
}

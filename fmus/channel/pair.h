/* What happens to power on its way between two antennas, in both directions. */
#ifndef PAIR_H
#define PAIR_H
#include "antenna.h"
#include "path_loss.h"
#include "scene.h"
#include "vehicle_shadowing.h"

/* The models of all links, prepared for many of them. */
typedef struct {
    const Parameters *parameters;
    PathLoss path_loss;
    WallModel walls;
    EdgeModel edges;
    double antennas_gain; /* if the pattern has one sample */
    double two_walls;     /* loss factor, a little too small */
    double indoor_nepers; /* natural logarithm of the loss factor per metre, a little too small */
} Propagation;

Propagation propagation_prepare(const Parameters *);

/* Direction 0 is from the first to the second antenna, 1 is back. */
typedef struct {
    double gain[2][BANDS]; /* at least LEAST_GAIN */
    double distance;       /* [m] */
    uint8_t kind[2];       /* LOS, NLOSV or NLOSB */
} Pair;

/* An order of two antennas that does not depend on who transmits. Everything is computed in it, so
 * that rounding and ties cannot make a link depend on which of its ends was looked at first. */
bool is_before(const Antenna *a, const Antenna *b);

/* What looking between two antennas writes to; each thread has its own. */
typedef struct {
    BuildingScratch buildings;
    BodyScratch bodies;
} PairScratch;

/* Make room for looking around in this scene; nonzero if memory is short. */
int pair_scratch_reserve(PairScratch *, const Scene *);
void pair_scratch_free(PairScratch *);

/* What it takes to look between two antennas. */
typedef struct {
    const Scene *scene;
    const Propagation *models;
    PairScratch *scratch;
} View;

/* Evaluate a pair in the directions `ways`, `a` not after `b`. False, and `pair` is incomplete, as soon
 * as these directions have gains below `floor` at the centre. */
bool pair_evaluate(const View *, const Antenna *a, const Antenna *b, unsigned ways, double floor,
                   Pair *pair);

/* No link that is longer on the ground has a higher gain at the centre. A little too high rather than
 * too low. */
double highest_gain(const Propagation *, double plane_distance);

/* What there is between two antennas, model by model, at the centre [dB]. */
typedef struct {
    double path_db, antennas_db, buildings_db, vehicles_db[2];
    uint8_t kind[2];
} Attenuation;

/* `a` not after `b`; at any distance. */
Attenuation attenuation(const View *, const Antenna *a, const Antenna *b);

#endif

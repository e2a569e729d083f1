/* The private state of the unit and its serialization. */
#ifndef STATE_H
#define STATE_H
#include "match.h"
#include "seen.h"

typedef struct {
    /* what survives from step to step */
    Tracks tracks;
    Match match;
    /* what is made anew in every step; kept for its memory */
    Map map;
    Scan scan;
    Seen seen;
    Objects objects;
    Layer layer;
    Region region;
    Zones zones;
    Demand demand;
    Bytes apms_out, objects_out;
} Perception;

/* Write the state to `bytes` unless that is NULL; returns its size. */
size_t state_save(const Perception *, uint8_t *bytes);
/* Replace the state by a saved one; on failure it is as before. */
int state_load(Perception *, const uint8_t *bytes, size_t size, Problem *);

#endif

/* The private state of the channel, and its bytes. */
#ifndef STATE_H
#define STATE_H
#include "events.h"
#include "frames.h"
#include "link.h"
#include "packets.h"
#include "parameters.h"
#include "radios.h"
#include "reports.h"
#include "scene.h"

/* Another frame on air during a reception. */
typedef struct {
    int64_t begin, end; /* [ps] */
    double power[BANDS]; /* [mW] */
} Interferer;

typedef struct {
    /* derived from the variables */
    Parameters parameters;
    Scene scene;
    Links links;
    int64_t longest_delay; /* of propagation [ps] */
    /* to be saved */
    Waiting waiting;
    Radios radios;
    Frames frames;
    int64_t window_ends; /* of the busy ratio [ps] */
    /* of one step */
    Waiting gone; /* frames whose radios have gone */
    Events events;
    Reports reports;
    Interferer *interferer; /* scratch */
    uint32_t *sender;
    size_t interferer_capacity, sender_capacity;
} Channel;

/* See ModelOps. */
size_t state_save(const Channel *, uint8_t *bytes);
ModelStatus state_load(Instance *, Channel *, const uint8_t *bytes, size_t size);

#endif

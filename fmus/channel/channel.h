/* The private state of the channel and what its parts do in a step. */
#ifndef CHANNEL_H
#define CHANNEL_H
#include "link.h"
#include "packets.h"
#include "parameters.h"
#include "receptions.h"
#include "scene.h"

typedef struct {
    /* derived from the variables */
    Parameters parameters;
    Scene scene;
    Links links;
    /* to be saved */
    Waiting waiting;
    Receptions on_air;
} Channel;

/* Put one frame on air: decide its reception at every radio in range, and let it wait for its next
 * hop where a relay has received it. Returns 0; 1 if the frame vanished because its transmitter is
 * gone or has no radio any more; -1 if memory is short. */
int transmit(Channel *, const Transmission *);

/* See ModelOps. */
size_t state_save(const Channel *, uint8_t *bytes);
ModelStatus state_load(Instance *, Channel *, const uint8_t *bytes, size_t size);

#endif

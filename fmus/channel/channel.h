/* The private state of the channel and what its parts do in a step. Functions that return an int
 * return nonzero if memory is short. */
#ifndef CHANNEL_H
#define CHANNEL_H
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
    size_t interferer_capacity;
} Channel;

/* ---- schedule.c: the events of a step ---- */

/* Everything that happens in a step to `end` [ps]. */
int run_until(Channel *, int64_t end);
/* Schedule the next event of a radio: the end of its contention if that has changed; whatever it
 * waits for; the first events of a new frame. */
int schedule_contention(Channel *, uint32_t radio);
int schedule_radio(Channel *, uint32_t radio);
int schedule_frame(Channel *, uint32_t frame);

/* ---- transmission.c: from the packet to the frame on air ---- */

/* A packet, or the next hop of one, reaches its radio. */
int hand_over(Channel *, const Transmission *);
/* A radio may send what it has waited to send; it starts; it has ended. */
int end_contention(Channel *, uint32_t radio, int64_t now);
int start_sending(Channel *, uint32_t radio, int64_t now);
int end_sending(Channel *, uint32_t radio, int64_t now);
/* A frame will not be sent; see FATES in fmus/messages/records.py. */
int give_up(Channel *, const Transmission *, int64_t now, uint8_t fate);
/* How a frame arrives over a link, fading included. */
Arrival arrival_of_link(Channel *, const AirFrame *, const Link *);

/* ---- reception.c: from the frame on air to its outcome ---- */

int begin_arrival(Channel *, AirFrame *, Arrival *);
int end_arrival(Channel *, AirFrame *, Arrival *);
/* A frame has begun at a radio, or the radio begins to send one. */
int sense_busy(Channel *, uint32_t radio, int64_t now);
/* A frame has ended at a radio, or the radio has ended its own one: is the medium idle now? */
int sense_idle(Channel *, uint32_t radio, int64_t now);

/* ---- interference.c: what else is on air ---- */

/* The arrival of a frame at a radio, also where it is too weak to be noticed; NULL if there is none.
 * Sets `failed` if memory is short. */
Arrival *arrival_at(Channel *, AirFrame *, uint32_t radio, int *failed);
/* Complete the arrivals of all frames on air, so that the scene may change. */
int complete_arrivals(Channel *, int64_t now);
/* Power in a band of all noticeable frames on air at a radio, without the frame `but` [mW]. */
double power_on_air(Channel *, uint32_t radio, int64_t now, int band, const AirFrame *but);
/* Lowest SNIR of an arrival over bands and time, from the end of its preamble on; as if it was
 * `alone` on air, if wanted. Sets `failed` if memory is short. */
double lowest_snir(Channel *, const AirFrame *, const Arrival *, bool alone, int *failed);

/* ---- state.c; see ModelOps ---- */
size_t state_save(const Channel *, uint8_t *bytes);
ModelStatus state_load(Instance *, Channel *, const uint8_t *bytes, size_t size);

#endif

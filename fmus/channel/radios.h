/* The radios of the vehicles: what each one is doing. */
#ifndef RADIOS_H
#define RADIOS_H
#include "access_category.h"
#include "queues.h"
#include "scene.h"

#define NO_RADIO UINT32_MAX

typedef struct {
    Queue queue;
    uint32_t backoff; /* slots still to wait after the AIFS */
    uint32_t window;  /* contention window: the next backoff is drawn from 0 to this */
} Category;

/* No padding: it is saved as it is. */
typedef struct {
    int64_t vehicle;
    /* the medium as carrier sense tells it */
    int64_t idle_since, busy_since; /* [ps] */
    int64_t busy_time;              /* closed spans of this window [ps] */
    int64_t entered;                /* since when there has been this radio [ps] */
    double busy_ratio;              /* of the last window, or the part that there was the radio */
    /* medium access */
    int64_t contention_ends; /* NEVER if nothing waits or the medium is busy */
    uint64_t backoffs;       /* number of backoffs drawn */
    /* sending: from `sending_from`, a turnaround after the decision, to `sending_until`, which is
     * known from then on; both NEVER if the radio listens */
    int64_t sending_from, sending_until;
    Transmission sending;
    Category category[CATEGORIES];
    /* a new stamp for each `contention_ends`; the one whose event has been scheduled */
    uint32_t contention_stamp, scheduled_stamp;
    uint32_t locked; /* index of the frame that is received, or NO_FRAME */
    uint8_t is_idle, is_equipped, reserved[2];
} Radio;
_Static_assert(sizeof(Radio) == 272, "Radio");

typedef struct {
    Radio *item; /* as the vehicles of the scene, in their order */
    size_t count, capacity;
    Radio *before; /* scratch */
    size_t before_capacity;
    uint32_t *moved; /* index now of the radio that had this index before, or NO_RADIO */
    size_t moved_capacity;
    QueueStore store;
} Radios;

/* Whether a radio sends or is about to. */
static inline bool radio_is_sending(const Radio *r) { return r->sending_from != NEVER; }

/* Follow the vehicles of the scene; `radios->moved` has an entry for each former radio. A vehicle
 * without a radio has one that does nothing. Frames that wait in a radio that has gone are handed
 * to `gone`. Nonzero if memory is short. */
int radios_follow(Radios *, const Scene *, int64_t now, Waiting *gone);
void radios_free(Radios *);

#endif

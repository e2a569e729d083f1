/* Frames on air, and how they arrive at the radios. */
#ifndef FRAMES_H
#define FRAMES_H
#include "parameters.h"
#include "radios.h"

/* What a receiver makes of a frame that is not lost before its end. */
typedef enum {
    UNNOTICED,    /* below the sensitivity, or no frame but noise */
    LOCKED,       /* is received */
    IGNORED,      /* the receiver is busy with another frame */
    ABANDONED,    /* was received until a stronger one captured the receiver */
    DEAFENED,     /* the receiver sends */
    VERDICTS
} Verdict;

/* A frame at one receiver. No padding: it is saved as it is. */
typedef struct {
    double power[BANDS]; /* [mW] */
    int64_t delay;       /* of propagation [ps] */
    uint32_t receiver;   /* index of a radio; NO_RADIO if it has gone */
    uint8_t link;        /* LOS, NLOSV or NLOSB */
    uint8_t verdict;
    uint16_t reserved;
} Arrival;
_Static_assert(sizeof(Arrival) == 40, "Arrival");

typedef struct {
    Transmission what;
    int64_t start, end;       /* on air at the transmitter [ps] */
    double power;             /* transmitted [mW] */
    uint32_t transmitter;     /* index of a radio; NO_RADIO if it has gone */
    bool is_settled;          /* all arrivals are known; the scene may change */
    /* The first `noticed` arrivals, by (delay, receiver), are events: `begun` have begun, `ended`
     * have ended. Further ones only interfere. */
    Arrival *arrival;
    size_t arrivals, noticed, begun, ended, capacity;
    uint32_t *at; /* of each radio: 1 + index of its arrival; 0: none, or not known yet */
    size_t radios, at_capacity;
} AirFrame;

typedef struct {
    AirFrame *pool;
    size_t pool_count, pool_capacity;
    uint32_t *live; /* indices of frames that are on air or may still interfere, by start */
    size_t count, live_capacity;
    uint32_t *free; /* indices of the others */
    size_t free_count, free_capacity;
} Frames;

/* A new frame, the last of `live`, without arrivals; NULL if memory is short. Frames do not move
 * while none is added. */
AirFrame *frames_add(Frames *, size_t radios);
static inline uint32_t frame_index(const Frames *s, const AirFrame *frame) {
    return (uint32_t)(frame - s->pool);
}

/* Room for one more arrival; NULL if memory is short. */
Arrival *frame_add_arrival(AirFrame *);

static inline bool frame_has_ended(const AirFrame *f) { return f->ended == f->noticed; }
static inline int64_t arrival_begins(const AirFrame *f, const Arrival *a) {
    return f->start + a->delay;
}
static inline int64_t arrival_ends(const AirFrame *f, const Arrival *a) { return f->end + a->delay; }

/* Let go of frames that have ended everywhere and before any began whose SNIR is still to be told.
 * `now`: nothing earlier will begin. `longest_delay` of propagation [ps]. */
void frames_let_go(Frames *, int64_t now, int64_t longest_delay);

/* Follow the radios, see radios_follow. Nonzero if memory is short. */
int frames_follow(Frames *, const Radios *);
void frames_free(Frames *);

#endif

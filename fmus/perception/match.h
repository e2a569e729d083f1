/* Which sharers see what the ego vehicle does not. */
#ifndef MATCH_H
#define MATCH_H
#include "apm.h"
#include "blind_zone.h"

typedef struct {
    int64_t maximum_age;      /* of a received matrix [ns] */
    double benefit_threshold; /* [m^2] */
    double release_ratio, switch_margin;
} MatchSettings;

/* The newest message of one source. */
typedef struct {
    int64_t vehicle, time;
    Bytes message;
} Received;

typedef struct {
    int64_t vehicle;
    double benefit; /* [m^2] */
} Sharer;

typedef struct {
    Received *received; /* ascending by vehicle */
    size_t received_count, received_capacity;
    Sharer *sharers; /* that pass, best first */
    size_t sharer_count, sharer_capacity;
    int64_t *chosen; /* the sharers that passed last time, in their order */
    size_t chosen_count, chosen_capacity;
} Match;

/* What became of a message. */
typedef enum { TAKEN, DROPPED, NO_MEMORY } Fate;

/* Remember a message that arrived by `now` [ns]; dropped, with the reason, if it is malformed. */
Fate match_receive(Match *, const MatchSettings *, int64_t now, const uint8_t *message,
                   size_t size, Problem *);
/* Forget messages older than the maximum age. */
void match_forget(Match *, const MatchSettings *, int64_t now);
/* Rank the sources of the messages by what they see in the first `count` of the zones, which are
 * relative to the matrix of `ego` seen from `pose`; keep the best `capacity`. */
int match_rank(Match *, const MatchSettings *, int64_t ego, const Pose *pose, const Zone *zones,
               size_t count, size_t capacity, Problem *);
/* Nobody is chosen any more. */
void match_release(Match *);
void match_free(Match *);

/* Sum over the cells of `apm` of index times area in the zones [m^2]. */
double match_benefit(const Apm *, const Pose *pose, const Zone *zones, size_t count);

#endif

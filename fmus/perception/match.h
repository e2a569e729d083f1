/* Which sharers see what the ego vehicle does not. */
#ifndef MATCH_H
#define MATCH_H
#include "apm.h"
#include "demand.h"

/* What the cells of a matrix say; the items of the parameter `index`. */
typedef enum { ANY_INDEX, POINTS, SEEN_AREA } Index;

typedef struct {
    int64_t maximum_age;      /* of a received matrix [ns] */
    int64_t hold;             /* how long a sharer stays one that does not pass any more [ns] */
    double maximum_offset;    /* of a matrix from its source [m] */
    double benefit_threshold; /* [m^2] */
    Index index;              /* of the matrices that are used */
    uint32_t index_limit;     /* an index above it counts as it; 0: no limit */
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
    int64_t passed; /* when its benefit last sufficed [ns] */
} Sharer;

typedef struct {
    Received *received; /* ascending by vehicle */
    size_t received_count, received_capacity;
    Sharer *sharers; /* that pass or are held, best first */
    size_t sharer_count, sharer_capacity;
    Sharer *chosen; /* the sharers of last time, in their order */
    size_t chosen_count, chosen_capacity;
    Bytes space; /* for the message that is being read */
} Match;

/* What became of a message. */
typedef enum { TAKEN, DROPPED, NO_MEMORY } Fate;

/* Remember a message that arrived by `now` [ns]; dropped, with the reason, if it is malformed. */
Fate match_receive(Match *, const MatchSettings *, int64_t now, const uint8_t *message,
                   size_t size, Problem *);
/* Forget messages older than the maximum age. */
void match_forget(Match *, const MatchSettings *, int64_t now);
/* Rank at `now` [ns] the sources of the messages by what they see of what `ego` demands, whose
 * matrix is seen from `pose`; keep the best `capacity`. */
int match_rank(Match *, const MatchSettings *, int64_t now, int64_t ego, const Pose *pose,
               const Demand *, size_t capacity, Problem *);
/* Nobody is chosen any more. */
void match_release(Match *);
void match_free(Match *);

/* Sum over the cells of `apm` of index, at most `index_limit` unless that is 0, times area in
 * demand [m^2]. */
double match_benefit(const Apm *, const Pose *pose, const Demand *, uint32_t index_limit);

#endif

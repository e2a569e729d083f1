/* The links between one radio and those around it. Looking around writes to nothing that others read,
 * so that several threads may do it for several radios at a time. */
#ifndef SURROUNDINGS_H
#define SURROUNDINGS_H
#include "pair.h"
#include "street_cells.h"

typedef struct {
    double gain[BANDS];  /* received over transmitted power, antennas included, fading not */
    double distance;     /* between the antennas [m] */
    uint32_t receiver;   /* index in the scene */
    uint8_t kind;        /* LOS, NLOSV or NLOSB */
} Link;

/* The other direction of a link: from `radio` back. */
typedef struct { Link link; uint32_t radio; } BackLink;

/* Links from one radio, and to it. */
typedef struct {
    Link *there;
    BackLink *back;
    size_t there_count, back_count, there_capacity, back_capacity;
    bool is_short; /* of memory, and so incomplete */
} Surroundings;

/* Which pairs belong to whom: a pair is looked at for that radio whose turn comes first, and not at
 * all where that is DONE. */
typedef uint32_t Turn;
#define DONE 0
#define LATER UINT32_MAX

/* Where to look. */
typedef struct {
    const Scene *scene;
    const Propagation *models;
    const StreetCells *cells;
    const Reach *reach;
    double floor;     /* of the gain at the centre */
    const Turn *turn; /* of each radio */
} Search;

/* Find the links of the pairs that belong to the radio `from`. */
void surroundings_find(Surroundings *, const Search *, PairScratch *, size_t from);
void surroundings_free(Surroundings *);

/* Whether `from` is the first antenna of the pair, see is_before; of equals the lower index. */
bool goes_first(const Scene *, size_t from, size_t to);

/* One direction of a pair as a link to the radio `to`. */
Link link_along(const Pair *, int way, size_t to);

#endif

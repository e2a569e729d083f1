/* Gain and class of the links between the antennas of the scene. */
#ifndef LINK_H
#define LINK_H
#include "parameters.h"
#include "scene.h"
#include "street_cells.h"

typedef struct {
    double gain[BANDS];  /* received over transmitted power, antennas included, fading not */
    double distance;     /* between the antennas [m] */
    uint32_t receiver;   /* index in the scene */
    uint8_t kind;        /* LOS, NLOSV or NLOSB */
} Link;

/* The links of one transmitter. */
typedef struct {
    Link *link;
    size_t count, capacity;
    bool is_complete; /* and in order; otherwise what the rows of others have told so far */
} LinkRow;

typedef struct {
    LinkRow *row;
    size_t count, capacity;
    double floor; /* of all rows; negative: none is complete */
} LinkRows;

/* A pair is evaluated when the first of its two rows is asked for, which leaves the result to the
 * other. */
typedef struct {
    Propagation models;
    StreetCells cells;
    Reach reach, any_reach; /* of `known`; of a link that is asked for by itself */
    LinkRows known;
    LinkRows strong; /* those of `known` that reach a higher floor */
    uint64_t *key;   /* scratch */
    Link *unsorted;
    size_t key_capacity, unsorted_capacity;
} Links;

/* Forget all links: scene or parameters have changed; to be called before the first link, too.
 * Nonzero if memory is short. */
int links_forget(Links *, const Scene *, const Parameters *);
void links_free(Links *);

/* The links from the radio `from` to all other radios within the maximum range whose gain at the
 * centre is not below `floor`, nearest first, of equally near ones the lower index first. They stay
 * in place until the links are forgotten or another `floor` is asked for; a lower one than before
 * costs as much as to forget the links. Nonzero if memory is short. */
int links_from(Links *, Scene *, size_t from, double floor, const Link **links, size_t *count);

/* The link between two radios at any distance. All gains are 0 if the one at the centre is below
 * `negligible`, and `kind` is then unknown. Nonzero if memory is short. */
int link_between(Links *, Scene *, size_t from, size_t to, double negligible, Link *link);

#endif

/* Gain and class of the links between the antennas of the scene. */
#ifndef LINK_H
#define LINK_H
#include "parameters.h"
#include "scene.h"
#include "street_cells.h"
#include "surroundings.h"
#include "team.h"

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

/* The rows that are being found, perhaps by several threads. */
typedef struct {
    uint32_t *radio;     /* whose they are, in the order of their turns, which begin at 1 */
    Surroundings *found; /* by task */
    size_t count, radio_capacity, found_capacity;
    size_t taken;        /* the first so many have become complete rows */
} Batch;

/* A pair is evaluated when the first of its two rows is asked for, which leaves the result to the
 * other. Rows that will be asked for soon may be found together, by threads; the links are the
 * same. */
typedef struct {
    const Scene *scene;
    Propagation models;
    StreetCells cells;
    Reach reach, any_reach; /* of `known`; of a link that is asked for by itself */
    LinkRows known;
    Turn *turn;      /* of each radio */
    Search search;
    Batch batch;
    Team *team;
    size_t workers_allowed;
    PairScratch *scratch; /* of each worker, first the caller */
    size_t turn_capacity, scratch_capacity;
    uint64_t *key;        /* scratch */
    Link *unsorted;
    size_t key_capacity, unsorted_capacity;
} Links;

/* Forget all links: scene or parameters have changed; to be called before the first link, too. Both
 * stay where they are. Nonzero if memory is short. */
int links_forget(Links *, const Scene *, const Parameters *);
void links_free(Links *);

/* What will probably be asked for next. */
typedef struct {
    const uint32_t *radio; /* links from these radios, in this order */
    size_t count;
    double floor;          /* of these links */
    double negligible;     /* of links that are asked for by themselves meanwhile */
    double load;           /* frames that are on air at a time */
} Expected;

/* Have threads begin to find these links. Only spares time. Nonzero if memory is short. */
int links_expect(Links *, const Expected *);

/* Let the threads rest; to be called before a step ends. Nonzero if memory is short. */
int links_rest(Links *);

/* Links of one radio, nearest first, of equally near ones the lower index first. */
typedef struct {
    const Link *link;
    size_t count;
    double floor; /* all within the maximum range whose gain at the centre is not below this */
} LinksFrom;

/* The links from the radio `from` to all other radios whose gain is not below `floor`, and perhaps
 * weaker ones. They stay in place until the links are forgotten or a lower `floor` is asked for, which
 * costs as much. Nonzero if memory is short. */
int links_from(Links *, size_t from, double floor, LinksFrom *);

/* The link between two radios at any distance. All gains are 0 if the one at the centre is below
 * `negligible`, and `kind` is then unknown. Nonzero if memory is short. */
int link_between(Links *, size_t from, size_t to, double negligible, Link *link);

/* The scene as the links see it, for looking at what is between other antennas. */
View links_view(const Links *);

#endif

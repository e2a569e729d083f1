/* Loss and class of the link between two antennas. */
#ifndef LINK_H
#define LINK_H
#include "parameters.h"
#include "scene.h"

typedef struct {
    double loss_db;
    uint32_t era; /* the scene that the link belongs to */
    uint8_t kind; /* LOS, NLOSV or NLOSB */
} Link;

/* Every link is computed when it is first needed and kept until the scene changes. */
typedef struct {
    Link *known; /* of `side` x `side` vehicles, row by row */
    size_t side;
    uint32_t era; /* the scene now */
} Links;

/* To be called when scene or parameters have changed; nonzero if memory is short. */
int links_forget(Links *, size_t vehicles);
void links_free(Links *);

/* The link between the antennas of vehicles `from` and `to` of the scene. */
Link link_between(Links *, Scene *, const Parameters *, size_t from, size_t to);

#endif

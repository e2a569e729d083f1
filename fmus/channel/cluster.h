/* Radios that stand close together, so that what is between two groups of them is looked up once
 * for all their pairs. Only spares work: no result depends on it. */
#ifndef CLUSTER_H
#define CLUSTER_H
#include "pair.h"
#include "scene.h"

typedef struct {
    Area area;
    double top;             /* height of the highest antenna above z = 0 [m] */
    uint32_t first, count;  /* its radios: member[first], ... */
    uint32_t sight;         /* the first of what it sees, or NO_SIGHT */
    bool has_looked;        /* everything it sees is known */
} Cluster;

/* What may be in the way between two clusters. */
typedef struct {
    size_t first;
    uint32_t buildings, bodies; /* number; obstacle[first], ...: first the buildings, ascending */
} View;

/* A cluster that is seen by another one: an item of a linked list. */
typedef struct { uint32_t cluster, view, next; } Sight;
#define NO_SIGHT UINT32_MAX

/* A view that was asked for by itself, for one floor of the scene. */
typedef struct { uint32_t a, b, scene, view; } KnownView;
#define NO_VIEW UINT32_MAX

typedef struct {
    Cluster *cluster;
    uint32_t *member, *cluster_of; /* radios by cluster; the cluster of a vehicle */
    uint32_t *hider;               /* buildings that have hidden something, see hider_between */
    uint64_t *key;                 /* scratch: radios by a coordinate */
    Sight *sight;
    View *view;
    uint32_t *obstacle;
    KnownView *known; /* a hash table; entries of other scenes are free */
    uint32_t scene;   /* number of the scene */
    double known_floor;
    size_t known_size, known_count;
    size_t clusters, members, sights, views, obstacles;
    size_t cluster_capacity, member_capacity, cluster_of_capacity, key_capacity,
        sight_capacity, view_capacity, obstacle_capacity;
} Clusters;

/* Group the radios of the scene. Which building has hidden what in the scene before is remembered, to
 * be tried first. Nonzero if memory is short. */
int clusters_build(Clusters *, const Scene *);
void clusters_free(Clusters *);

/* Find out what the cluster sees: all clusters within range, itself too, to which there is any link
 * whose gain may reach `floor`, the same in all calls. Nonzero if memory is short. */
int clusters_look(Clusters *, Scene *, const Propagation *, double floor, size_t cluster);

/* The view between the clusters of two radios, NO_VIEW if no link between these clusters has a gain
 * above `floor`. Nonzero if memory is short. */
int clusters_view(Clusters *, Scene *, const Propagation *, double floor, size_t from, size_t to,
                  uint32_t *view);

static inline Nearby view_buildings(const Clusters *s, uint32_t view) {
    return (Nearby){s->obstacle + s->view[view].first, s->view[view].buildings};
}
static inline Nearby view_bodies(const Clusters *s, uint32_t view) {
    const View *v = &s->view[view];
    return (Nearby){s->obstacle + v->first + v->buildings, v->bodies};
}

#endif

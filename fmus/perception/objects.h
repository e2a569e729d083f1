/* Objects: clusters that are vehicles, with their tracked velocities. */
#ifndef OBJECTS_H
#define OBJECTS_H
#include "boxes.h"
#include "tracks.h"

typedef struct {
    uint32_t minimum_points; /* fewest points above the ground that are an object */
    int has_labels;          /* whether clusters are told from each other by their labels */
    BoxKind boxes;
    TrackSettings track;
} ObjectSettings;

typedef struct {
    Object *objects;      /* of one sensor, ascending by track number */
    size_t count, capacity;
    uint32_t *of_cluster; /* index into objects, or NO_OBJECT, for each cluster of the scan */
    size_t cluster_capacity;
    /* kept for their memory */
    Boxes boxes;
    const double **former_axes; /* for each cluster of the scan, of the track that it may be of */
    size_t former_capacity;
} Objects;
#define NO_OBJECT UINT32_MAX

/* Replace the contents of `objects` by what the scan of `sensor` shows, and update the tracks. The
 * sides of its clusters become those of their boxes. */
int objects_detect(Objects *, Tracks *, const ObjectSettings *, const Sensor *, Scan *, Problem *);
void objects_free(Objects *);

#endif

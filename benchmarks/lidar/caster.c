/* The lidar unit's own ray casting, to be timed without noise, packing and importer: what the unit
 * does in a scan (fmus/lidar/lidar.c) up to the hits. There is no clock in here. */
#include <math.h>
#include <stdlib.h>

#include "pattern.h"
#include "raster.h"
#include "scene.h"
#include "view.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef struct {
    Pattern pattern;
    Scene scene;
    View view;
    Hits hits;
} Caster;

EXPORT Caster *caster_new(void) { return calloc(1, sizeof(Caster)); }

EXPORT void caster_free(Caster *caster) {
    pattern_clear(&caster->pattern);
    scene_clear(&caster->scene);
    view_clear(&caster->view);
    hits_clear(&caster->hits);
    free(caster);
}

/* These return nonzero if memory is short. */

EXPORT int caster_pattern(Caster *caster, const PatternParameters *parameters) {
    return pattern_prepare(&caster->pattern, parameters);
}

EXPORT int caster_scene(Caster *caster, const Vehicles *vehicles, const Buildings *buildings) {
    return scene_build(&caster->scene, vehicles, buildings);
}

EXPORT int caster_cast(Caster *caster, const Viewpoint *from) {
    return view_build(&caster->view, &caster->scene, from, &caster->pattern)
           || trace(&caster->view, &caster->pattern, &caster->hits);
}

/* What the last scan hit: distance along the ray [m], INFINITY for nothing, and instance; one element
 * per ray, by azimuth, then channel. */
EXPORT void caster_hits(const Caster *caster, double *distance, int32_t *instance) {
    const Pattern *pattern = &caster->pattern;
    uint32_t channels = pattern->parameters.channels, rays = channels * pattern->parameters.azimuths;
    for (uint32_t i = 0; i < rays; i++) {
        uint32_t face = caster->hits.face[i];
        int is_hit = face != NOTHING;
        double nearness = caster->hits.nearness[i] * pattern->level[i % channels];
        distance[i] = is_hit ? 1.0 / nearness : INFINITY;
        instance[i] = is_hit ? caster->view.face[face].surface.instance : 0;
    }
}

/* The prisms of the scene, for others to build theirs from. */

EXPORT size_t caster_prisms(const Caster *caster) { return caster->scene.count; }

/* Returns the ring of a prism, `*count` corners (x, y) [m]; `level` is its bottom and its top [m]. */
EXPORT const double *caster_prism(const Caster *caster, size_t number, size_t *count, double *level,
                                  int32_t *instance) {
    const Prism *prism = caster->scene.prism + number;
    *count = prism->count;
    level[0] = prism->bottom;
    level[1] = prism->top;
    *instance = prism->surface.instance;
    return caster->scene.corner + 2 * prism->first;
}

/* The parameters of the unit, as its parts want them. */
#ifndef SETTINGS_H
#define SETTINGS_H
#include "fmi3_model.h"
#include "match.h"
#include "seen.h"

typedef struct {
    ScanSettings matrix;
    PatternSettings pattern;
    ObjectSettings object;
    RegionSettings region;
    ZoneSettings zone;
    MatchSettings match;
    int has_region_benefit;
    int has_layer, is_compressed;
    int is_ego_alone; /* only the scan of the ego vehicle is processed */
} Settings;

/* The values that the variables have now. */
Settings settings_of(Instance *);
/* Whether they go together: fail, naming what does not. */
int settings_check(const Settings *, Problem *);
/* Of a time in seconds, rounded. */
int64_t nanoseconds(double seconds);

#endif

/* The border: are the inputs a scene? Behind it everything trusts them. */
#ifndef CHECK_H
#define CHECK_H

#include "fmi3_model.h"
#include "pattern.h"
#include "scene.h"

/* Log the first thing that is wrong, with the variable and the index, and return MODEL_ERROR. */
ModelStatus check_parameters(Instance *, const PatternParameters *);
ModelStatus check_vehicles(Instance *, const Vehicles *);
ModelStatus check_buildings(Instance *, const Buildings *);

#endif

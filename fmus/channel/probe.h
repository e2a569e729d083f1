/* Links between any two points, evaluated in the scene without any packet. */
#ifndef PROBE_H
#define PROBE_H
#include "fmi3_model.h"
#include "pair.h"
#include "scene.h"

/* Compute the outputs `probe.*` from the inputs. An error names the element that is wrong. */
ModelStatus probes_update(Instance *, const View *);

#endif

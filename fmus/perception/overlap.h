/* Area common to a cell of another vehicle's matrix and a blind zone of the own one. */
#ifndef OVERLAP_H
#define OVERLAP_H
#include "kernel.h"

/* Area [m^2] of the intersection of two squares: one with sides parallel to the axes, half side
 * `range`, centred on the origin; the other with half side `half`, centred on `center` and turned
 * by the angle with this sine and cosine. Not finite centres have no area in common with it. */
double overlap_area(double range, const double center[2], double half, double cosine, double sine);

#endif

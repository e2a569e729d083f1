/* What the ego vehicle wants to know: how much of each cell of its matrix. */
#ifndef DEMAND_H
#define DEMAND_H
#include "blind_zone.h"

typedef struct {
    uint32_t rows, columns;
    double cell;        /* side [m] */
    double full;        /* weight of a cell that is wanted wholly, once */
    uint64_t *weights;  /* rows x columns */
    uint64_t *integral; /* of the weights, (rows + 1) x (columns + 1) */
    size_t weight_capacity, integral_capacity;
} Demand;

/* Replace the contents of the demand by the area in the first `count` of the zones: wholly, or only
 * the part that is in the region. Where zones overlap, the area counts once for each. */
int demand_make(Demand *, const ScanSettings *, const Zones *, size_t count, const Region *,
                int only_in_region, Problem *);
/* Sum of the weights over rows and columns from the first to before the last. */
uint64_t demand_over(const Demand *, const uint32_t first[2], const uint32_t last[2]);
void demand_free(Demand *);

#endif

#include "demand.h"

#include <stdlib.h>
#include <string.h>

static int prepare(Demand *demand, const ScanSettings *matrix, Problem *problem) {
    size_t cells = (size_t)matrix->rows * matrix->columns;
    size_t corners = ((size_t)matrix->rows + 1) * ((size_t)matrix->columns + 1);
    if (reserve(&demand->weights, &demand->weight_capacity, cells, sizeof(uint64_t), problem)
        || reserve(&demand->integral, &demand->integral_capacity, corners, sizeof(uint64_t),
                   problem))
        return 1;
    memset(demand->weights, 0, cells * sizeof(uint64_t));
    demand->rows = matrix->rows;
    demand->columns = matrix->columns;
    demand->cell = matrix->cell;
    return 0;
}

static void add_zone(Demand *demand, const Zone *zone, const Region *region, int only_in_region) {
    uint32_t full = region->side * region->side;
    for (uint32_t row = zone->row; row < zone->row + zone->size; row++)
        for (uint32_t column = zone->column; column < zone->column + zone->size; column++) {
            size_t cell = (size_t)row * demand->columns + column;
            demand->weights[cell] += only_in_region ? region->inside[cell] : full;
        }
}

static void integrate(Demand *demand) {
    size_t width = (size_t)demand->columns + 1;
    memset(demand->integral, 0, width * sizeof(uint64_t));
    for (uint32_t row = 0; row < demand->rows; row++) {
        uint64_t sum = 0;
        uint64_t *at = &demand->integral[(row + 1) * width];
        *at = 0;
        for (uint32_t column = 0; column < demand->columns; column++) {
            sum += demand->weights[(size_t)row * demand->columns + column];
            at++;
            *at = *(at - width) + sum;
        }
    }
}

int demand_make(Demand *demand, const ScanSettings *matrix, const Zones *zones, size_t count,
                const Region *region, int only_in_region, Problem *problem) {
    if (prepare(demand, matrix, problem)) return 1;
    demand->full = (double)region->side * region->side;
    for (size_t i = 0; i < count; i++)
        add_zone(demand, &zones->zones[i], region, only_in_region);
    integrate(demand);
    return 0;
}

uint64_t demand_over(const Demand *demand, const uint32_t first[2], const uint32_t last[2]) {
    size_t width = (size_t)demand->columns + 1;
    const uint64_t *low = &demand->integral[first[0] * width];
    const uint64_t *high = &demand->integral[last[0] * width];
    return high[last[1]] - high[first[1]] - low[last[1]] + low[first[1]];
}

void demand_free(Demand *demand) {
    free(demand->weights);
    free(demand->integral);
}

/* The parameters of the channel, checked and in the units of the formulas. */
#ifndef PARAMETERS_H
#define PARAMETERS_H
#include "fmi3_model.h"
#include "modulation.h"
#include <stdbool.h>

typedef struct {
    double wavelength;                                  /* [m] */
    double transmit_power, noise_floor, sensitivity;    /* [dBm] */
    double path_loss_exponent, lossless_distance;       /* [1], [m] */
    double wall_loss, indoor_loss;                      /* [dB], [dB/m] */
    double knife_edge_factor;                           /* under the root of v */
    double maximum_range;                               /* [m] */
    int64_t relay_delay;                                /* [ns] */
    uint64_t seed;
    const Mode *mode;
    double certain_snir;                                /* see certain_snir_db [dB] */
    uint32_t mac_header;                                /* [byte] */
    bool building_shadowing, finite_buildings, vehicle_shadowing, unequipped_shadow, reciprocal;
} Parameters;

#define LIGHT_SPEED 299792458.0 /* [m/s] */

/* Read all parameters. The shell has checked the bounds in interface.py, so that they are finite. */
ModelStatus parameters_read(Instance *, Parameters *);

#endif

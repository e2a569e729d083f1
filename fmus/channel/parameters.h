/* The parameters of the channel, checked and in the units of the formulas. */
#ifndef PARAMETERS_H
#define PARAMETERS_H
#include "fmi3_model.h"
#include "modulation.h"
#include <stdbool.h>

#define LIGHT_SPEED 299792458.0 /* [m/s] */

/* Frequencies at which a frame is weighed: 5 MHz below the carrier, the carrier, 5 MHz above. */
#define BANDS 3
#define LOWER_EDGE 0
#define CENTER 1

typedef enum { PATH_LOSS_EXPONENT = 1, PATH_LOSS_TWO_RAY, PATH_LOSS_BREAKPOINT } PathLossModel;
typedef enum { FADING_NONE = 1, FADING_NAKAGAMI } FadingModel;

/* Powers are in mW, as are the logarithms in dBm; gains and losses are factors unless they are
 * called `_db`. */
typedef struct {
    /* radio */
    double wavelength[BANDS]; /* [m] */
    double transmit_power, noise, sensitivity;
    const double *antenna_gain_db; /* equally spaced over the circle from the heading on */
    size_t antenna_gains;
    double highest_antenna_gain; /* factor, of one antenna, at least 1 */
    double antenna_height;       /* [m]; 0: as in the inputs */
    double maximum_range;        /* [m] */
    int64_t relay_delay;         /* [ps] */
    uint64_t seed;
    const Mode *mode;
    uint32_t mac_header;         /* [byte] */
    double certain_snir;         /* factor; see certain_snir_db */
    double capture_ratio;        /* factor; infinite: never */
    uint32_t workers;            /* threads that look for links, the caller among them; 0: automatic */
    bool antenna_in_front, weak_receptions, band_edges;
    double noticeable; /* weaker frames change nothing but the SNIR of others */
    double negligible; /* weaker frames change nothing at all */
    /* medium access */
    bool medium_access;
    double cca_threshold;    /* of the power of frames alone, without the noise */
    uint32_t queue_limit;    /* 0: none */
    int64_t packet_lifetime; /* [ps]; 0: for ever */
    int64_t busy_window;     /* [ps] */
    /* propagation */
    PathLossModel path_loss;
    double path_loss_exponent, lossless_distance;     /* [1], [m] */
    double permittivity;                              /* [1] */
    double breakpoint_distance, breakpoint_near_loss_db, breakpoint_far_loss_db,
        breakpoint_far_exponent;                      /* [m], [dB], [dB], [1] */
    FadingModel fading;
    double fading_near_m, fading_far_m, fading_distance; /* [1], [1], [m] */
    bool fading_clipped;
    double wall_loss_db, indoor_loss_db;              /* per wall, per metre */
    double knife_edge_factor;                         /* under the root of v */
    double shadow_width;                              /* of a body that shadows, at least [m] */
    bool building_shadowing, finite_buildings, vehicle_shadowing, unequipped_shadow, reciprocal;
} Parameters;

/* Read all parameters. The shell has checked the bounds in interface.py, so that they are finite. */
ModelStatus parameters_read(Instance *, Parameters *);

/* The seed is tunable, and arrays stay in the shell, which may have moved them. */
void parameters_renew(Instance *, Parameters *);

#endif

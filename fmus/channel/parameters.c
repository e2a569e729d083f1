#include "parameters.h"
#include "error_rate.h"
#include "variables.h"
#include <math.h>

static double number(Instance *i, uint32_t reference) {
    return *(const double *)variable_data(i, reference);
}

static bool flag(Instance *i, uint32_t reference) {
    return *(const bool *)variable_data(i, reference);
}

ModelStatus parameters_read(Instance *i, Parameters *p) {
    double bitrate = number(i, VR_bitrate);
    const Mode *mode = mode_of_bitrate(bitrate);
    if (!mode)
        return model_log(i, MODEL_ERROR,
                         "bitrate is %g bit/s; the rates of a 10 MHz channel are 3e6, 4.5e6, 6e6, "
                         "9e6, 12e6, 18e6, 24e6 and 27e6 bit/s", bitrate);
    *p = (Parameters){
        .wavelength = LIGHT_SPEED / number(i, VR_carrier_frequency),
        .transmit_power = number(i, VR_transmit_power),
        .noise_floor = number(i, VR_noise_floor),
        .sensitivity = number(i, VR_sensitivity),
        .path_loss_exponent = number(i, VR_path_loss_exponent),
        .lossless_distance = number(i, VR_lossless_distance),
        .wall_loss = number(i, VR_wall_loss),
        .indoor_loss = number(i, VR_indoor_loss),
        .knife_edge_factor = flag(i, VR_knife_edge_itu) ? 2 : 1,
        .maximum_range = number(i, VR_maximum_range),
        .relay_delay = llround(number(i, VR_relay_delay) * 1e9),
        .seed = *(const uint64_t *)variable_data(i, VR_seed),
        .mode = mode,
        .certain_snir = certain_snir_db(mode),
        .mac_header = *(const uint32_t *)variable_data(i, VR_mac_header),
        .building_shadowing = flag(i, VR_building_shadowing),
        .finite_buildings = flag(i, VR_finite_buildings),
        .vehicle_shadowing = flag(i, VR_vehicle_shadowing),
        .unequipped_shadow = flag(i, VR_unequipped_shadow),
        .reciprocal = flag(i, VR_reciprocal),
    };
    return MODEL_OK;
}

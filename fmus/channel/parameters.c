#include "parameters.h"
#include "decibel.h"
#include "error_rate.h"
#include "variables.h"
#include <math.h>

static double number(Instance *i, uint32_t reference) {
    return *(const double *)variable_data(i, reference);
}

static bool flag(Instance *i, uint32_t reference) {
    return *(const bool *)variable_data(i, reference);
}

static uint32_t whole(Instance *i, uint32_t reference) {
    return *(const uint32_t *)variable_data(i, reference);
}

static int64_t item(Instance *i, uint32_t reference) {
    return *(const int64_t *)variable_data(i, reference);
}

static int64_t duration(Instance *i, uint32_t reference) {
    return from_seconds(number(i, reference));
}

static void read_radio(Instance *i, Parameters *p) {
    double carrier = number(i, VR_carrier_frequency);
    p->band_edges = flag(i, VR_band_edges);
    for (int band = 0; band < BANDS; band++) {
        double offset = p->band_edges ? 5e6 * (band - CENTER) : 0;
        p->wavelength[band] = LIGHT_SPEED / (carrier + offset);
    }
    p->transmit_power = from_db(number(i, VR_transmit_power));
    p->noise = from_db(number(i, VR_noise_floor));
    p->sensitivity = from_db(number(i, VR_sensitivity));
    p->antenna_gain_db = variable_data(i, VR_antenna_gain);
    p->antenna_gains = variable_length(i, VR_antenna_gain);
    double highest = 0;
    for (size_t k = 0; k < p->antenna_gains; k++) highest = fmax(highest, p->antenna_gain_db[k]);
    p->highest_antenna_gain = from_db(highest);
    p->antenna_in_front = flag(i, VR_antenna_in_front);
    p->antenna_height = number(i, VR_antenna_height);
    p->maximum_range = number(i, VR_maximum_range);
    p->relay_delay = duration(i, VR_relay_delay);
    p->seed = *(const uint64_t *)variable_data(i, VR_seed);
    p->mac_header = whole(i, VR_mac_header);
    p->certain_snir = from_db(certain_snir_db(p->mode));
    p->capture_ratio = flag(i, VR_frame_capture) ? from_db(number(i, VR_capture_margin)) : INFINITY;
    p->weak_receptions = flag(i, VR_weak_receptions);
}

static void read_medium_access(Instance *i, Parameters *p) {
    p->medium_access = flag(i, VR_medium_access);
    p->cca_threshold = fmax(from_db(number(i, VR_cca_threshold)) - p->noise, 0);
    p->queue_limit = whole(i, VR_queue_limit);
    p->packet_lifetime = duration(i, VR_packet_lifetime);
    p->busy_window = duration(i, VR_busy_window);
}

static void read_propagation(Instance *i, Parameters *p) {
    p->path_loss = (PathLossModel)item(i, VR_path_loss);
    p->path_loss_exponent = number(i, VR_path_loss_exponent);
    p->lossless_distance = number(i, VR_lossless_distance);
    p->permittivity = number(i, VR_permittivity);
    p->breakpoint_distance = number(i, VR_breakpoint_distance);
    p->breakpoint_near_loss_db = number(i, VR_breakpoint_near_loss);
    p->breakpoint_far_loss_db = number(i, VR_breakpoint_far_loss);
    p->breakpoint_far_exponent = number(i, VR_breakpoint_far_exponent);
    p->fading = (FadingModel)item(i, VR_fading);
    p->fading_near_m = number(i, VR_fading_near_m);
    p->fading_far_m = number(i, VR_fading_far_m);
    p->fading_distance = number(i, VR_fading_distance);
    p->fading_clipped = flag(i, VR_fading_clipped);
    p->building_shadowing = flag(i, VR_building_shadowing);
    p->wall_loss_db = number(i, VR_wall_loss);
    p->indoor_loss_db = number(i, VR_indoor_loss);
    p->finite_buildings = flag(i, VR_finite_buildings);
    p->vehicle_shadowing = flag(i, VR_vehicle_shadowing);
    p->unequipped_shadow = flag(i, VR_unequipped_shadow);
    p->reciprocal = flag(i, VR_reciprocal);
    p->knife_edge_factor = flag(i, VR_knife_edge_itu) ? 2 : 1;
}

/* The values that the descriptions in interface.py give as Veins'. */
static void adopt_veins(Instance *i, Parameters *p) {
    double carrier = number(i, VR_carrier_frequency);
    p->band_edges = true;
    for (int band = 0; band < BANDS; band++)
        p->wavelength[band] = LIGHT_SPEED / (carrier + 5e6 * (band - CENTER));
    p->antenna_in_front = true;
    p->antenna_height = 1.895;
    p->mac_header = 0;
    p->capture_ratio = INFINITY;
    p->lossless_distance = 1;
    p->fading_clipped = true;
    p->finite_buildings = p->unequipped_shadow = p->reciprocal = false;
    p->knife_edge_factor = 2;
}

void parameters_renew(Instance *i, Parameters *p) {
    p->antenna_gain_db = variable_data(i, VR_antenna_gain);
}

ModelStatus parameters_read(Instance *i, Parameters *p) {
    enum { MODEL_VEINS = 2 };
    double bitrate = number(i, VR_bitrate);
    *p = (Parameters){.mode = mode_of_bitrate(bitrate)};
    if (!p->mode)
        return model_log(i, MODEL_ERROR,
                         "bitrate is %g bit/s; the rates of a 10 MHz channel are 3e6, 4.5e6, 6e6, "
                         "9e6, 12e6, 18e6, 24e6 and 27e6 bit/s", bitrate);
    read_radio(i, p);
    read_medium_access(i, p);
    read_propagation(i, p);
    if (item(i, VR_model) == MODEL_VEINS) adopt_veins(i, p);
    if (p->cca_threshold == 0)
        return model_log(i, MODEL_ERROR,
                         "cca_threshold is %g dBm; with a noise_floor of %g dBm the medium would never "
                         "be idle", number(i, VR_cca_threshold), number(i, VR_noise_floor));
    p->noticeable = fmin(p->sensitivity, p->cca_threshold);
    return MODEL_OK;
}

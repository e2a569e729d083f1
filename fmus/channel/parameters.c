#include "parameters.h"
#include "decibel.h"
#include "error_rate.h"
#include "variables.h"
#include <math.h>

static int64_t duration(Instance *i, uint32_t reference) {
    return from_seconds(real(i, reference));
}

static void set_wavelengths(Parameters *p, double carrier) {
    for (int band = 0; band < BANDS; band++) {
        double offset = p->band_edges ? 5e6 * (band - CENTER) : 0;
        p->wavelength[band] = LIGHT_SPEED / (carrier + offset);
    }
}

static void read_radio(Instance *i, Parameters *p) {
    p->band_edges = boolean(i, VR_band_edges);
    set_wavelengths(p, real(i, VR_carrier_frequency));
    p->transmit_power = from_db(real(i, VR_transmit_power));
    p->noise = from_db(real(i, VR_noise_floor));
    p->sensitivity = from_db(real(i, VR_sensitivity));
    p->antenna_gain_db = variable_data(i, VR_antenna_gain);
    p->antenna_gains = variable_length(i, VR_antenna_gain);
    double highest = 0;
    for (size_t k = 0; k < p->antenna_gains; k++) highest = fmax(highest, p->antenna_gain_db[k]);
    p->highest_antenna_gain = from_db(highest);
    p->antenna_in_front = boolean(i, VR_antenna_in_front);
    p->antenna_height = real(i, VR_antenna_height);
    p->maximum_range = real(i, VR_maximum_range);
    p->relay_delay = duration(i, VR_relay_delay);
    p->seed = uint64(i, VR_seed);
    p->mac_header = uint32(i, VR_mac_header);
    p->workers = uint32(i, VR_threads);
    p->certain_snir = from_db(certain_snir_db(p->mode));
    p->capture_ratio = boolean(i, VR_frame_capture) ? from_db(real(i, VR_capture_margin)) : INFINITY;
    p->weak_receptions = boolean(i, VR_weak_receptions);
    p->negligible = p->noise * from_db(-real(i, VR_interference_margin));
}

static void read_medium_access(Instance *i, Parameters *p) {
    p->medium_access = boolean(i, VR_medium_access);
    p->cca_threshold = fmax(from_db(real(i, VR_cca_threshold)) - p->noise, 0);
    p->queue_limit = uint32(i, VR_queue_limit);
    p->packet_lifetime = duration(i, VR_packet_lifetime);
    p->busy_window = duration(i, VR_busy_window);
}

static void read_propagation(Instance *i, Parameters *p) {
    p->path_loss = (PathLossModel)int64(i, VR_path_loss);
    p->path_loss_exponent = real(i, VR_path_loss_exponent);
    p->lossless_distance = real(i, VR_lossless_distance);
    p->permittivity = real(i, VR_permittivity);
    p->breakpoint_distance = real(i, VR_breakpoint_distance);
    p->breakpoint_near_loss_db = real(i, VR_breakpoint_near_loss);
    p->breakpoint_far_loss_db = real(i, VR_breakpoint_far_loss);
    p->breakpoint_far_exponent = real(i, VR_breakpoint_far_exponent);
    p->fading = (FadingModel)int64(i, VR_fading);
    p->fading_near_m = real(i, VR_fading_near_m);
    p->fading_far_m = real(i, VR_fading_far_m);
    p->fading_distance = real(i, VR_fading_distance);
    p->fading_clipped = boolean(i, VR_fading_clipped);
    p->building_shadowing = boolean(i, VR_building_shadowing);
    p->wall_loss_db = real(i, VR_wall_loss);
    p->indoor_loss_db = real(i, VR_indoor_loss);
    p->finite_buildings = boolean(i, VR_finite_buildings);
    p->vehicle_shadowing = boolean(i, VR_vehicle_shadowing);
    p->unequipped_shadow = boolean(i, VR_unequipped_shadow);
    p->shadow_width = real(i, VR_shadow_width);
    p->reciprocal = boolean(i, VR_reciprocal);
    p->knife_edge_factor = boolean(i, VR_knife_edge_itu) ? 2 : 1;
}

/* The values that the descriptions in interface.py give as Veins'. */
static void adopt_veins(Instance *i, Parameters *p) {
    p->band_edges = true;
    set_wavelengths(p, real(i, VR_carrier_frequency));
    p->antenna_in_front = true;
    p->antenna_height = 1.895;
    p->mac_header = 0;
    p->capture_ratio = INFINITY;
    p->lossless_distance = 1;
    p->fading_clipped = true;
    p->finite_buildings = p->unequipped_shadow = p->reciprocal = false;
    p->shadow_width = 0;
    p->knife_edge_factor = 2;
}

void parameters_renew(Instance *i, Parameters *p) {
    p->antenna_gain_db = variable_data(i, VR_antenna_gain);
    p->seed = uint64(i, VR_seed);
}

ModelStatus parameters_read(Instance *i, Parameters *p) {
    enum { MODEL_VEINS = 2 };
    double bitrate = real(i, VR_bitrate);
    *p = (Parameters){.mode = mode_of_bitrate(bitrate)};
    if (!p->mode)
        return model_log(i, MODEL_ERROR,
                         "bitrate is %g bit/s; the rates of a 10 MHz channel are 3e6, 4.5e6, 6e6, "
                         "9e6, 12e6, 18e6, 24e6 and 27e6 bit/s", bitrate);
    read_radio(i, p);
    read_medium_access(i, p);
    read_propagation(i, p);
    if (int64(i, VR_model) == MODEL_VEINS) adopt_veins(i, p);
    if (p->cca_threshold == 0)
        return model_log(i, MODEL_ERROR,
                         "cca_threshold is %g dBm; with a noise_floor of %g dBm the medium would never "
                         "be idle", real(i, VR_cca_threshold), real(i, VR_noise_floor));
    p->noticeable = fmin(p->sensitivity, p->cca_threshold);
    return MODEL_OK;
}

#include "probe.h"
#include "decibel.h"
#include "error_rate.h"
#include "pair.h"
#include "records.h"
#include "variables.h"

/* The inputs of all probes. */
typedef struct {
    const double *position[2];
    const int64_t (*carrier)[2];
    const uint32_t *size;
    size_t count;
} Probes;

static Probes probes_of(Instance *i) {
    return (Probes){
        .position = {variable_data(i, VR_probe_transmitter), variable_data(i, VR_probe_receiver)},
        .carrier = variable_data(i, VR_probe_carrier),
        .size = variable_data(i, VR_probe_size),
        .count = variable_length(i, VR_probe_size),
    };
}

static ModelStatus check(Instance *i, const Probes *probes, const Scene *s, const Parameters *p) {
    ModelStatus status =
        check_range(i, "probe.transmitter", VR_probe_transmitter, 3, -FARTHEST, FARTHEST);
    if (status == MODEL_OK)
        status = check_range(i, "probe.receiver", VR_probe_receiver, 3, -FARTHEST, FARTHEST);
    if (status != MODEL_OK) return status;
    for (size_t k = 0; k < probes->count; k++) {
        for (int end = 0; end < 2; end++) {
            int64_t carrier = probes->carrier[k][end];
            if (carrier != NO_VEHICLE && scene_find(s, carrier) == NO_INDEX)
                return model_log(i, MODEL_ERROR,
                                 "probe.carrier[%zu, %d] is %lld; there is no such vehicle, and -1 is "
                                 "none", k, end, (long long)carrier);
        }
        if (probes->size[k] > FRAME_SIZE_MAX - p->mac_header)
            return model_log(i, MODEL_ERROR,
                             "probe.size[%zu] is %u bytes; with %u of headers a frame has at most %u", k,
                             (unsigned)probes->size[k], (unsigned)p->mac_header, FRAME_SIZE_MAX);
    }
    return MODEL_OK;
}

/* One end of a probe. Without a carrier the ground is at z = 0, and the antenna heads for x. */
static Antenna antenna_of(const Probes *probes, size_t k, int end, const Scene *s) {
    const double *at = probes->position[end] + 3 * k;
    Antenna a = {.at = {at[0], at[1], at[2]}, .height = at[2], .heading = 0, .body = NO_BODY};
    if (probes->carrier[k][end] != NO_VEHICLE) {
        const Antenna *own = &s->antenna[scene_find(s, probes->carrier[k][end])];
        a.height = at[2] - (own->at.z - own->height);
        a.heading = own->heading;
        a.body = own->body;
    }
    a.height = larger(a.height, 0);
    return a;
}

static void set(Instance *i, uint32_t output, size_t k, double value) {
    ((double *)variable_data(i, output))[k] = value;
}

static void probe(Instance *i, const View *view, const Probes *probes, size_t k) {
    const Parameters *p = view->models->parameters;
    Antenna transmitter = antenna_of(probes, k, 0, view->scene);
    Antenna receiver = antenna_of(probes, k, 1, view->scene);
    int way = is_before(&receiver, &transmitter) ? 1 : 0;
    const Antenna *a = way ? &receiver : &transmitter, *b = way ? &transmitter : &receiver;
    Attenuation found = attenuation(view, a, b);
    double power_db = found.antennas_db - found.path_db - found.buildings_db - found.vehicles_db[way];
    double power = p->transmit_power * from_db(power_db), snir = power / p->noise;
    set(i, VR_probe_path_loss, k, found.path_db);
    set(i, VR_probe_antenna_gain, k, found.antennas_db);
    set(i, VR_probe_building_loss, k, found.buildings_db);
    set(i, VR_probe_vehicle_loss, k, found.vehicles_db[way]);
    set(i, VR_probe_power, k, to_db(p->transmit_power) + power_db);
    set(i, VR_probe_header_success, k, header_success_probability(snir));
    set(i, VR_probe_payload_success, k,
        payload_success_probability(p->mode, snir, probes->size[k] + p->mac_header));
    ((int32_t *)variable_data(i, VR_probe_link))[k] = found.kind[way];
}

ModelStatus probes_update(Instance *i, const View *view) {
    Probes probes = probes_of(i);
    ModelStatus status = check(i, &probes, view->scene, view->models->parameters);
    if (status != MODEL_OK) return status;
    for (size_t k = 0; k < probes.count; k++) probe(i, view, &probes, k);
    return MODEL_OK;
}

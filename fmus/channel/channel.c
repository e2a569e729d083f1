/* The channel as an FMU: what happens in one communication step. */
#include "arrivals.h"
#include "dispatch.h"
#include "probe.h"
#include "state.h"
#include "transmission.h"
#include "variables.h"
#include <math.h>
#include <stdlib.h>

static ModelStatus create(Instance *i, void **state) {
    Channel *c = calloc(1, sizeof *c);
    if (!c) return model_log(i, MODEL_ERROR, "memory is short");
    c->scene.is_stale = true;
    c->waiting.highest_vehicle = -1;
    queues_clear(&c->radios.store);
    *state = c;
    return MODEL_OK;
}

static void destroy(Instance *i, void *state) {
    (void)i;
    Channel *c = state;
    if (!c) return;
    scene_free(&c->scene);
    links_free(&c->links);
    waiting_free(&c->waiting);
    radios_free(&c->radios);
    frames_free(&c->frames);
    events_free(&c->events);
    reports_free(&c->reports);
    waiting_free(&c->gone);
    free(c->interferer);
    free(c->sender);
    free(c);
}

/* All parameters but the seed are fixed from here on. */
static ModelStatus begin(Instance *i, void *state, double t) {
    Channel *c = state;
    if (!(fabs(t) < LAST_SECOND))
        return model_log(i, MODEL_ERROR, "the start time %g s is out of range", t);
    c->scene.is_stale = true;
    ModelStatus status = parameters_read(i, &c->parameters);
    c->longest_delay = (int64_t)(c->parameters.maximum_range / LIGHT_SPEED * 1e12) + 1;
    c->window_ends = from_seconds(t) + c->parameters.busy_window;
    return status;
}

static ModelStatus out_of_memory(Instance *i) {
    return model_log(i, MODEL_ERROR, "memory is short for %zu vehicles",
                     variable_length(i, VR_vehicle_id));
}

/* Bring scene, links, radios and frames on air in line with the inputs. */
static ModelStatus update(Instance *i, Channel *c, int64_t now) {
    bool changed;
    parameters_renew(i, &c->parameters);
    ModelStatus status = scene_update(i, &c->scene, &c->parameters, &changed);
    if (status != MODEL_OK || !changed) return status;
    if (links_forget(&c->links, &c->scene, &c->parameters)
        || radios_follow(&c->radios, &c->scene, now, &c->gone)
        || frames_follow(&c->frames, &c->radios))
        return out_of_memory(i);
    while (c->gone.count > 0)
        if (give_up(c, &c->gone.item[--c->gone.count], now, GONE)) return out_of_memory(i);
    return MODEL_OK;
}

static void tell_busy_ratios(Instance *i, const Channel *c) {
    double *ratio = variable_data(i, VR_busy_ratio);
    for (size_t k = 0; k < c->radios.count; k++) ratio[k] = c->radios.item[k].busy_ratio;
}

/* No time passes: receptions only come from steps, so what the last step told stays. */
static ModelStatus output(Instance *i, void *state, double t) {
    Channel *c = state;
    ModelStatus status = update(i, c, from_seconds(t));
    if (status != MODEL_OK) return status;
    Reports none = {0};
    Binary *receptions = variable_binary(i, VR_receptions);
    Binary *transmissions = variable_binary(i, VR_transmissions);
    bool failed = receptions->size == 0 && reports_release(&none, receptions, transmissions);
    reports_free(&none);
    if (failed) return out_of_memory(i);
    tell_busy_ratios(i, c);
    View view = links_view(&c->links);
    return probes_update(i, &view);
}

static ModelStatus step(Instance *i, void *state, double t, double h) {
    Channel *c = state;
    if (!(t > -LAST_SECOND && h >= 0 && t + h < LAST_SECOND))
        return model_log(i, MODEL_ERROR, "a step from %g s over %g s is out of range", t, h);
    int64_t start = from_seconds(t), end = from_seconds(t + h), slack = from_seconds(1);
    if (c->window_ends < start - slack
        || c->window_ends > start + c->parameters.busy_window + slack)
        return model_log(i, MODEL_ERROR, "at %g s the state is of another time: %g s", t,
                         (double)c->window_ends * 1e-12);
    ModelStatus status = update(i, c, start);
    if (status == MODEL_OK)
        status = packets_accept(i, &c->waiting, &c->scene, c->parameters.mac_header, start);
    if (status != MODEL_OK) return status;
    bool failed = expect_arrivals(c, start, end) || run_until(c, end) || complete_arrivals(c, end);
    failed |= links_rest(&c->links); /* in any case */
    if (failed) return out_of_memory(i);
    if (reports_release(&c->reports, variable_binary(i, VR_receptions),
                        variable_binary(i, VR_transmissions)))
        return out_of_memory(i);
    tell_busy_ratios(i, c);
    View view = links_view(&c->links);
    return probes_update(i, &view);
}

static size_t save(Instance *i, void *state, uint8_t *bytes) {
    (void)i;
    return state_save(state, bytes);
}

static ModelStatus load(Instance *i, void *state, const uint8_t *bytes, size_t size) {
    return state_load(i, state, bytes, size);
}

const ModelOps MODEL = {create, destroy, begin, output, step, save, load};

/* The channel as an FMU: what happens in one communication step. */
#include "channel.h"
#include "variables.h"
#include <math.h>
#include <stdlib.h>

static ModelStatus create(Instance *i, void **state) {
    Channel *c = calloc(1, sizeof *c);
    if (!c) return model_log(i, MODEL_ERROR, "memory is short");
    c->scene.is_stale = true;
    c->waiting.highest_vehicle = -1;
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
    receptions_free(&c->on_air);
    free(c);
}

/* All parameters are fixed from here on. */
static ModelStatus begin(Instance *i, void *state, double t) {
    (void)t;
    Channel *c = state;
    c->scene.is_stale = true;
    return parameters_read(i, &c->parameters);
}

/* Bring scene and links in line with the inputs. */
static ModelStatus update(Instance *i, Channel *c) {
    bool changed;
    ModelStatus status = scene_update(i, &c->scene, &c->parameters, &changed);
    if (status == MODEL_OK && changed && links_forget(&c->links, c->scene.count))
        return model_log(i, MODEL_ERROR, "memory is short for the links of %zu vehicles",
                         c->scene.count);
    return status;
}

static ModelStatus out_of_memory(Instance *i) {
    return model_log(i, MODEL_ERROR, "memory is short for the receptions");
}

/* No time passes: receptions only come from steps, so what the last step told stays. */
static ModelStatus output(Instance *i, void *state, double t) {
    (void)state;
    (void)t;
    Binary *binary = variable_binary(i, VR_receptions);
    Receptions none = {0};
    if (binary->size > 0 || !receptions_release(&none, 0, binary)) return MODEL_OK;
    return out_of_memory(i);
}

static ModelStatus step(Instance *i, void *state, double t, double h) {
    Channel *c = state;
    if (!(fabs(t) < 4e9 && h >= 0 && h < 4e9)) /* 64-bit nanoseconds end at 9.2e9 s */
        return model_log(i, MODEL_ERROR, "a step from %g s over %g s is out of range", t, h);
    int64_t start = llround(t * 1e9), end = llround((t + h) * 1e9);
    ModelStatus status = update(i, c);
    if (status == MODEL_OK)
        status = packets_accept(i, &c->waiting, &c->scene, c->parameters.mac_header, start);
    if (status != MODEL_OK) return status;
    size_t vanished = 0;
    for (Transmission next; waiting_take(&c->waiting, end, &next);) {
        int result = transmit(c, &next);
        if (result < 0) return out_of_memory(i);
        vanished += (size_t)result;
    }
    if (vanished > 0)
        model_log(i, MODEL_OK, "%zu frames vanished: their transmitters have left", vanished);
    if (receptions_release(&c->on_air, end, variable_binary(i, VR_receptions)))
        return out_of_memory(i);
    return MODEL_OK;
}

static size_t save(Instance *i, void *state, uint8_t *bytes) {
    (void)i;
    return state_save(state, bytes);
}

static ModelStatus load(Instance *i, void *state, const uint8_t *bytes, size_t size) {
    return state_load(i, state, bytes, size);
}

const ModelOps MODEL = {create, destroy, begin, output, step, save, load};

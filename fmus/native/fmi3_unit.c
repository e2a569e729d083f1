#include "fmi3_unit.h"

fmi3Status settle(Instance *instance, ModelStatus status) {
    if (status >= MODEL_ERROR) instance->mode = FAILED;
    return (fmi3Status)status;
}

void destroy_model(Instance *instance) {
    if (MODEL.destroy) MODEL.destroy(instance, instance->model);
    instance->model = NULL;
}

ModelStatus recreate_model(Instance *instance) {
    destroy_model(instance);
    instance->has_begun = false;
    instance->is_stale = true;
    return MODEL.create ? MODEL.create(instance, &instance->model) : MODEL_OK;
}

ModelStatus begin_model(Instance *instance) {
    if (instance->has_begun) return MODEL_OK;
    ModelStatus status =
        MODEL.begin ? MODEL.begin(instance, instance->model, instance->time) : MODEL_OK;
    instance->has_begun = status <= MODEL_WARNING;
    return status;
}

fmi3Status refresh_outputs(Instance *instance) {
    if (!instance->is_stale) return fmi3OK;
    ModelStatus began = begin_model(instance);
    if (began > MODEL_WARNING) return settle(instance, began);
    ModelStatus status = MODEL.output(instance, instance->model, instance->time);
    if (status <= MODEL_WARNING) instance->is_stale = false;
    return settle(instance, status > began ? status : began);
}

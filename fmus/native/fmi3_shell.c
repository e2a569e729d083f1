/* FMI 3.0 Co-Simulation around one ModelOps: life cycle and state machine. */
#include "fmi3_shell.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ------------------------------------------------------------------------------ */

static const char *const CATEGORIES[] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal",
};
#define CATEGORY_COUNT (sizeof CATEGORIES / sizeof CATEGORIES[0])
#define ALL_CATEGORIES ((1u << CATEGORY_COUNT) - 1)

static void pass_on(Instance *instance, ModelStatus status, const char *message) {
    /* FMI 3.0.2, 2.2.4: errors are logged whether logging is on or not. */
    bool is_wanted = status >= MODEL_ERROR || (instance->log_mask >> status & 1u) != 0;
    if (instance->log && is_wanted)
        instance->log(instance->environment, (fmi3Status)status, CATEGORIES[status], message);
}

ModelStatus model_log(Instance *instance, ModelStatus status, const char *format, ...) {
    char message[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    pass_on(instance, status, message);
    return status;
}

fmi3Status refuse(Instance *instance, const char *function, const char *format, ...) {
    char reason[1600], message[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reason, sizeof reason, format, arguments);
    va_end(arguments);
    snprintf(message, sizeof message, "%s: %s", function, reason);
    pass_on(instance, MODEL_ERROR, message);
    return fmi3Error;
}

const char *mode_name(Mode mode) {
    static const char *const NAMES[] = {
        "the state Instantiated", "Configuration Mode", "Initialization Mode", "Event Mode",
        "Step Mode", "Reconfiguration Mode", "the state Terminated",
        "the state Terminated (after an error)",
    };
    return NAMES[mode];
}

fmi3Status refuse_mode(Instance *instance, const char *function) {
    return refuse(instance, function, "not allowed in %s", mode_name(instance->mode));
}

#define REQUIRE(instance, condition)                                   \
    do {                                                               \
        if (!(instance)) return fmi3Error;                             \
        if (!(condition)) return refuse_mode((instance), __func__);    \
    } while (0)

/* ---- the unit's private state -------------------------------------------------------------- */

fmi3Status settle(Instance *instance, ModelStatus status) {
    if (status >= MODEL_ERROR) instance->mode = FAILED;
    return (fmi3Status)status;
}

static void destroy_model(Instance *instance) {
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

/* ---- instantiation ------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)instanceName, (void)resourcePath, (void)visible, (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables;
    (void)intermediateUpdate;
    Instance blank = {
        .environment = instanceEnvironment,
        .log = logMessage,
        .log_mask = loggingOn ? ALL_CATEGORIES : 0,
        .uses_event_mode = eventModeUsed,
    };
    if (!instantiationToken || strcmp(instantiationToken, INSTANTIATION_TOKEN) != 0) {
        refuse(&blank, __func__, "the instantiation token is `%s`, this binary belongs to `%s`",
               instantiationToken ? instantiationToken : "", INSTANTIATION_TOKEN);
        return NULL;
    }
    Instance *instance = malloc(sizeof *instance);
    if (!instance) {
        refuse(&blank, __func__, "out of memory");
        return NULL;
    }
    *instance = blank;
    if (!allocate_values(instance) || !reset_values(instance)) {
        refuse(instance, __func__, "out of memory");
        free_values(instance);
        free(instance);
        return NULL;
    }
    if (recreate_model(instance) > MODEL_WARNING) {
        refuse(instance, __func__, "the model could not be created");
        fmi3FreeInstance(instance);
        return NULL;
    }
    return instance;
}

void fmi3FreeInstance(fmi3Instance c) {
    Instance *instance = c;
    if (!instance) return;
    destroy_model(instance);
    free_values(instance);
    free(instance);
}

fmi3Status fmi3Reset(fmi3Instance c) {
    Instance *instance = c;
    if (!instance) return fmi3Error;
    instance->mode = INSTANTIATED;
    instance->time = 0;
    if (!reset_values(instance)) {
        instance->mode = FAILED;
        return refuse(instance, __func__, "out of memory");
    }
    return settle(instance, recreate_model(instance));
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    Instance *instance = c;
    if (!instance) return fmi3Error;
    unsigned mask = nCategories == 0 ? ALL_CATEGORIES : 0;
    for (size_t i = 0; i < nCategories; i++) {
        size_t k = 0;
        while (k < CATEGORY_COUNT && strcmp(categories[i], CATEGORIES[k]) != 0) k++;
        if (k == CATEGORY_COUNT)
            return refuse(instance, __func__, "there is no log category `%s`", categories[i]);
        mask |= 1u << k;
    }
    instance->log_mask = loggingOn ? instance->log_mask | mask : instance->log_mask & ~mask;
    return fmi3OK;
}

/* ---- modes --------------------------------------------------------------------------------- */

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == INSTANTIATED || instance->mode == STEP);
    instance->mode = instance->mode == STEP ? RECONFIGURATION : CONFIGURATION;
    return fmi3OK;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == CONFIGURATION || instance->mode == RECONFIGURATION);
    if (!apply_sizes(instance)) {
        return refuse(instance, __func__,
                      "out of memory; the arrays and structural parameters are as before");
    }
    instance->mode = instance->mode == RECONFIGURATION ? STEP : INSTANTIATED;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance;
    Instance *instance = c;
    REQUIRE(instance, instance->mode == INSTANTIATED);
    if (!isfinite(startTime))
        return refuse(instance, __func__, "the start time is %g", startTime);
    if (stopTimeDefined && !(stopTime >= startTime))
        return refuse(instance, __func__, "the stop time %g is before the start time %g", stopTime,
                      startTime);
    instance->time = startTime;
    instance->is_stale = true;
    instance->mode = INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == INITIALIZATION);
    fmi3Status status = refresh_outputs(instance);
    if (status <= fmi3Warning) instance->mode = instance->uses_event_mode ? EVENT : STEP;
    return status;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == STEP && instance->uses_event_mode);
    instance->mode = EVENT;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == EVENT);
    *discreteStatesNeedUpdate = *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = *valuesOfContinuousStatesChanged = fmi3False;
    *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0;
    return refresh_outputs(instance);
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == EVENT);
    fmi3Status status = refresh_outputs(instance);
    if (status <= fmi3Warning) instance->mode = STEP;
    return status;
}

fmi3Status fmi3Terminate(fmi3Instance c) {
    Instance *instance = c;
    REQUIRE(instance, instance->mode == STEP || instance->mode == EVENT);
    instance->mode = TERMINATED;
    return fmi3OK;
}

/* ---- stepping ------------------------------------------------------------------------------ */

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    Instance *instance = c;
    REQUIRE(instance, instance->mode == STEP);
    const double t = currentCommunicationPoint, h = communicationStepSize;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = instance->time;
    if (!(h > 0) || !isfinite(h))
        return refuse(instance, __func__, "the communication step size is %g", h);
    /* Importers compute t in their own way; it may differ from ours by rounding only. */
    if (!(fabs(t - instance->time) <= 1e-9 * (1 + fabs(instance->time))))
        return refuse(instance, __func__, "the communication point is %.17g, but the last step "
                      "ended at %.17g", t, instance->time);
    ModelStatus status = MODEL.step(instance, instance->model, t, h);
    if (status <= MODEL_WARNING) {
        instance->time = *lastSuccessfulTime = t + h;
        instance->is_stale = false;
    }
    return settle(instance, status);
}

/* FMI 3.0 Co-Simulation around one ModelOps: life cycle and state machine. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_log.h"
#include "fmi3_unit.h"
#include "fmi3_values.h"

#define REQUIRE(instance, condition)                                   \
    do {                                                               \
        if (!(instance)) return fmi3Error;                             \
        if (!(condition)) return refuse_mode((instance), __func__);    \
    } while (0)

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

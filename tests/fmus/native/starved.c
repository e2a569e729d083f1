/* Lives a whole life of an instance again and again, each time with the next allocation failing.
 * Nothing may crash, nothing may leak, and with enough memory everything must succeed.
 * Linked with the shell and the unit `lag`. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "starving.h"
#include "variables.h"

static void on_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                       fmi3String message) {
    (void)environment, (void)category, (void)message;
    messages += status >= fmi3Error;
}

static void step(fmi3Instance c, double t) {
    bool event, terminate, early;
    double last;
    note(fmi3DoStep(c, t, 0.1, true, &event, &terminate, &early, &last));
}

static void initialise(fmi3Instance c, uint64_t channels) {
    const fmi3ValueReference size = VR_n_channel;
    note(fmi3EnterConfigurationMode(c));
    note(fmi3SetUInt64(c, &size, 1, &channels, 1));
    note(fmi3ExitConfigurationMode(c));
    note(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
    note(fmi3ExitInitializationMode(c));
}

static fmi3Instance instantiate(void) {
    fmi3Instance c = fmi3InstantiateCoSimulation("lag", INSTANTIATION_TOKEN, NULL, false, true,
                                                 false, false, NULL, 0, NULL, on_message, NULL);
    failures += c == NULL;
    return c;
}

static void live_once(void) {
    fmi3Instance one = instantiate(), two = instantiate();
    if (one && two) {
        initialise(one, 5);
        initialise(two, 2);
        double u[5] = {1, 2, 3, 4, 5}, x[5];
        const fmi3ValueReference in = VR_u, out = VR_x;
        note(fmi3SetFloat64(one, &in, 1, u, 5));
        step(one, 0);
        note(fmi3GetFloat64(one, &out, 1, x, 5));
        move_state(one, two);
        step(two, 0.1);
        note(fmi3Reset(one));
        initialise(one, 3);
        step(one, 0);
        note(fmi3Terminate(one));
    }
    fmi3FreeInstance(one);
    fmi3FreeInstance(two);
}

int main(void) { return starve(live_once); }

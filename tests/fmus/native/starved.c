/* Lives a whole life of an instance again and again, each time with the next allocation failing.
 * Nothing may crash, nothing may leak, and with enough memory everything must succeed.
 * Linked with the shell and the unit `lag`. */
#include "starving.h"
#include "variables.h"

static void begin(fmi3Instance c, uint64_t channels) {
    note(fmi3EnterConfigurationMode(c));
    set_length(c, VR_n_channel, channels);
    note(fmi3ExitConfigurationMode(c));
    initialise(c);
}

static void live_together(fmi3Instance one, fmi3Instance two) {
    begin(one, 5);
    begin(two, 2);
    double u[5] = {1, 2, 3, 4, 5}, x[5];
    const fmi3ValueReference out = VR_x;
    set_floats(one, VR_u, u, 5);
    step(one, 0, 0.1);
    note(fmi3GetFloat64(one, &out, 1, x, 5));
    move_state(one, two);
    step(two, 0.1, 0.1);
    note(fmi3Reset(one));
    begin(one, 3);
    step(one, 0, 0.1);
    note(fmi3Terminate(one));
}

static void live_once(void) { live_as_two("lag", live_together); }

int main(void) { return starve(live_once); }

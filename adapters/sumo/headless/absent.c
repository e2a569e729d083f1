/* A stand-in for a library that SUMO's window needs, for machines without one.

   LIBRARY is its name, FUNCTIONS the file with its functions. None of them is ever called: there
   is no window. If one is, the process ends, and says which. */
#include <stdio.h>
#include <stdlib.h>

__attribute__((noreturn, unused)) static void absent(const char *name) {
    fprintf(stderr, "nlosim: " LIBRARY " is not installed, and SUMO calls `%s` of it\n", name);
    abort();
}

#define ABSENT(name)                                         \
    __attribute__((visibility("default"))) void name(void) { \
        absent(#name);                                       \
    }

#include FUNCTIONS

/* What a component should not do to the process it is in. */
#ifdef _WIN32
#include <direct.h>
#define chdir _chdir
#else
#include <unistd.h>
#endif
#include <stdlib.h>

#include "misbehave.h"

void misbehave(int deed) {
    int *volatile nowhere = NULL;
    volatile int forever = 1;
    if (deed == 6) *nowhere = 1;
    if (deed == 7) abort();
    if (deed == 8) exit(0);
    while (deed == 9 && forever) {}
    if (deed == 10 && chdir("/") != 0) abort();
}

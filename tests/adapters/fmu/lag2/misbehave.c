/* What a component should not do to the process it is in. */
#ifdef _WIN32
#include <direct.h>
#include <process.h>
#define chdir _chdir
#else
#include <unistd.h>
#endif
#include <stdlib.h>
#include <string.h>

#include "misbehave.h"

static char *volatile filled; /* or the compiler leaves it out */

void misbehave(int deed) {
    int *volatile nowhere = NULL;
    volatile int forever = 1;
    if (deed == 6) *nowhere = 1;
    if (deed == 7) abort();
    if (deed == 8) exit(0);
    for (int k = 0; deed == 11 && k < 64; k++) {
        filled = malloc(1 << 24);
        if (filled) memset(filled, k, 1 << 24);
    }
    if (deed == 12) _exit(0);
    while ((deed == 9 || deed == 11) && forever) {}
    if (deed == 10 && chdir("/") != 0) abort();
}

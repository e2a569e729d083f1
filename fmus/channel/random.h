/* Random numbers that are a function of what they decide, not of what was drawn before. */
#ifndef RANDOM_H
#define RANDOM_H
#include <stdint.h>

/* Philox4x32-10: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as
 * easy as 1, 2, 3", SC 2011. */
void philox4x32(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);

/* What a draw decides; a new use takes a new number, so that old draws stay as they are. */
typedef enum { DRAW_RECEPTION, DRAW_BACKOFF, DRAW_FADING } Draw;

/* Two uniform numbers in [0, 1) for a packet (or the number of a decision), a hop (or the number of
 * an attempt) and a vehicle. */
typedef struct { double first, second; } Uniforms;
Uniforms draw(uint64_t seed, Draw what, int64_t packet, uint16_t hop, int64_t vehicle);

#endif

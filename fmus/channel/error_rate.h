/* Probability that OFDM symbols are decoded.
 * G. Pei, T. R. Henderson, "Validation of OFDM error rate model in ns-3", Boeing, 2010, after
 * L. E. Miller, "Validation of 802.11a/UWB coexistence simulation", NIST, 2003. */
#ifndef ERROR_RATE_H
#define ERROR_RATE_H
#include "modulation.h"

/* Probability that `bits` bits sent in `mode` are all right at the linear SNIR `snir`. */
double success_probability(const Mode *mode, double snir, double bits);

/* Of the SIGNAL field: 24 bits in the 3 Mbit/s mode. */
double header_success_probability(double snir);

/* Of SERVICE, a frame of `size` bytes and the tail. */
double payload_success_probability(const Mode *mode, double snir, uint32_t size);

/* The lowest SNIR [dB], to 0.1 dB, from which on every frame is decoded: both probabilities round
 * to 1. Spares their calculation. */
double certain_snir_db(const Mode *mode);

#endif
